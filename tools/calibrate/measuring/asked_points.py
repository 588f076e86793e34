"""Where a person measures that a platform stands, asked for while it does, as a file of points."""

from __future__ import annotations

import math
import os
import select
import sys
import termios
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

from cdpr_profiles.errors import ProfileError
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.readings.data import load_points
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output

_LOOK_S: Final = 0.2
_NAMES: Final = ("x", "y", "z")
_BYTES: Final = 4096
_MOVED_m: Final = 2e-3
_DOUBTFUL_m: Final = 0.2
"""A point that is further off is asked for again: no exit point may be moved by more."""


def require_points_of(poses: int, path: Path) -> None:
    """Raise BadInputError where a file has points of poses that have not been read; ProfileError.

    They were measured at poses of an earlier run, whose data are not in the folder any more.
    """
    if not path.exists():
        return
    last = max((point.pose + 1 for point in load_points(path)), default=0)
    if last > poses:
        raise BadInputError(
            f"{path}: has a point of pose {last}, where {poses} were read: of an earlier run; "
            "allowed: another --out, or remove it"
        )


class AskedPoints:
    """Asks on standard input for a position at each pose, and keeps it in a file for `--points`.

    `coordinates` are those of the platform's origin, 2 or 3. `place` returns where the platform is,
    (d,), by its cables, and raises where it is held no longer or somebody wants an end; it is asked
    while nobody has typed anything yet. Raises ProfileError where the file cannot be written.
    """

    def __init__(
        self, out: Output, path: Path, coordinates: int, place: Callable[[], FloatArray]
    ) -> None:
        self._out, self._path, self._names = out, path, _NAMES[:coordinates]
        self._place, self._read = place, b""
        self._open = sys.stdin is not None  # None: closed by a shell's `<&-`
        if not path.exists():
            self._append(",".join(["pose", *(f"{name}_mm" for name in self._names), "sigma_mm"]))

    def __call__(self, pose: int) -> None:
        """Ask for the position at a pose, counted from 1, at which the platform stands now.

        Raises WorkFailedError where it is moved meanwhile, and what `place` raises.
        """
        if not self._open:
            return
        with self._out.paused():
            if sys.stdin.isatty():
                # typed while it was on its way here: nobody has measured this pose yet
                termios.tcflush(sys.stdin, termios.TCIFLUSH)
            self._ask(pose, self._origin_m())

    def _ask(self, pose: int, origin_m: FloatArray) -> None:
        names, doubted = " ".join(self._names), [""]
        while True:
            # who measures stands beside a robot that moves once this is answered
            self._out.note(
                f"pose {pose} stands: measured {names} in mm [and sigma], Enter for none; stand "
                "clear, it moves on then:"
            )
            words = self._line(pose, origin_m).split()
            if not words:
                return
            numbers = self._numbers(words)
            if not numbers:
                self._out.note(
                    f"allowed: {names}, numbers in mm, a decimal point, blanks between them; and "
                    "how sure, above 0, where not 2 mm"
                )
                continue
            off_m = float(np.linalg.norm(1e-3 * np.array(numbers[: len(origin_m)]) - origin_m))
            if off_m <= _DOUBTFUL_m or words == doubted:
                self._append(",".join([str(pose), *map(repr, numbers)]))
                return
            doubted = words
            by_cables = " ".join(f"{1e3 * x:.0f}" for x in origin_m)
            self._out.note(
                f"that is {1e3 * off_m:.0f} mm from where its cables have it, {by_cables}; "
                "where it is right, type the same again"
            )

    def _numbers(self, words: list[str]) -> list[float]:
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            return []
        k = len(self._names)
        given = k <= len(numbers) <= k + 1 and all(map(math.isfinite, numbers))
        return numbers if given and min(numbers[k:], default=1.0) > 0.0 else []

    def _line(self, pose: int, origin_m: FloatArray) -> str:
        """Return a line of standard input, an empty one at its end."""
        number = sys.stdin.fileno()
        while b"\n" not in self._read:
            self._require_there(pose, origin_m)
            if select.select([number], [], [], _LOOK_S)[0]:
                more = os.read(number, _BYTES)
                if not more:
                    self._open = False
                    return ""
                self._read += more
        self._require_there(pose, origin_m)
        line, _, self._read = self._read.partition(b"\n")
        return line.decode(errors="replace")

    def _origin_m(self) -> FloatArray:
        return self._place()[: len(self._names)]

    def _require_there(self, pose: int, origin_m: FloatArray) -> None:
        if np.abs(self._origin_m() - origin_m).max() > _MOVED_m:
            raise WorkFailedError(
                f"the platform was moved after pose {pose} had been read, so that nothing measured "
                "belongs to it"
            )

    def _append(self, line: str) -> None:
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(f"{line}\n")
        except OSError as error:
            raise ProfileError(self._path, "", f"cannot be written: {error.strerror}") from None
