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

from cdpr_profiles.errors import ProfileError
from cdpr_rt.calibration.readings.data import load_points
from cdpr_tools.calibrate.measuring.ways import StoppedError
from cdpr_tools.errors import BadInputError

_LOOK_S: Final = 0.2
_NAMES: Final = ("x", "y", "z")
_BYTES: Final = 4096


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

    `coordinates` are those of the platform's origin, 2 or 3. `stop` is asked whether somebody wants
    an end. Raises ProfileError where the file cannot be written.
    """

    def __init__(
        self, path: Path, coordinates: int, say: Callable[[str], None], stop: Callable[[], bool]
    ) -> None:
        self._path, self._names, self._say, self._stop = path, _NAMES[:coordinates], say, stop
        self._read, self._open = b"", sys.stdin is not None  # None: closed by a shell's `<&-`
        if not path.exists():
            self._append(",".join(["pose", *(f"{name}_mm" for name in self._names), "sigma_mm"]))

    def __call__(self, pose: int) -> None:
        """Ask for the position at a pose, counted from 1; raises StoppedError."""
        names = " ".join(self._names)
        if self._open and sys.stdin.isatty():
            # what was typed before the platform stood here was not measured here
            termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
        while self._open:
            # who measures stands beside a robot that moves once this is answered
            self._say(
                f"pose {pose} stands: measured {names} in mm [and sigma], Enter for none; stand "
                "clear, it moves on then:"
            )
            words = self._line().replace(",", " ").split()
            if not words:
                return
            if numbers := self._numbers(words):
                self._append(",".join([str(pose), *map(repr, numbers)]))
                return
            self._say(f"allowed: {names}, numbers in mm, and how sure, above 0, where not 2 mm")

    def _numbers(self, words: list[str]) -> list[float]:
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            return []
        k = len(self._names)
        given = k <= len(numbers) <= k + 1 and all(map(math.isfinite, numbers))
        return numbers if given and min(numbers[k:], default=1.0) > 0.0 else []

    def _line(self) -> str:
        """Return a line of standard input, an empty one at its end; raises StoppedError."""
        number = sys.stdin.fileno()
        while b"\n" not in self._read:
            if self._stop():
                raise StoppedError
            if select.select([number], [], [], _LOOK_S)[0]:
                more = os.read(number, _BYTES)
                if not more:
                    self._open = False
                    return ""
                self._read += more
        line, _, self._read = self._read.partition(b"\n")
        return line.decode(errors="replace")

    def _append(self, line: str) -> None:
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(f"{line}\n")
        except OSError as error:
            raise ProfileError(self._path, "", f"cannot be written: {error.strerror}") from None
