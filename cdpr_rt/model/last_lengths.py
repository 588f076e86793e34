"""Cable lengths at the last stop, for a start away from home."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles.platform import FURTHEST_m
from cdpr_profiles.user_folders import can_write
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.estimate import AxisEstimate
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.state_file import StateFileError, read_state, write_state

_FIELDS = ("cable_length_m", "cable_at_index_m")
_FLAGS = ("fallen", "displaced")
_INDEX_TURNS = 0.05
"""Allowed error of an index position, as a share of a motor turn; a latched count is far more
exact."""
_MOST_OF_LONGEST = 2.0
"""Ratio of the longest possible length, after lowering anywhere, to the longest in use."""


@dataclass(frozen=True)
class StoppedLengths:
    """Unstretched cable lengths (n,) at the time when the power was removed."""

    cable_length_m: FloatArray
    cable_at_index_m: FloatArray
    """Length with the motor at its index, nan if the index was not known."""
    date: str
    """ISO 8601, UTC."""
    position_rad: FloatArray
    """Motor angles at `cable_length_m`; nan after a restart until they are known again."""

    def at(self, position_rad: FloatArray, cable_m: FloatArray) -> FloatArray:
        """Return the lengths (n,) at other angles (n,); `cable_m` (n,) is paid out per radian."""
        return self.cable_length_m + cable_m * (position_rad - self.position_rad)


class LastLengths:
    """Cable lengths of the last stop, kept in memory and in a file for the next start."""

    def __init__(self, path: Path | None = None) -> None:
        self.path = path
        self.geometry = ""
        """Identity of the calibration to which the lengths belong, empty for the robot's file."""
        self.lengths: StoppedLengths | None = None
        self.why = "the lengths at its last stop are not known"
        """Reason why no lengths are known, "" if they are."""
        self.displaced = False
        """Whether the platform has since been released away from home."""
        self.contradicted = ""
        """Observation that contradicts the lengths in use, so that they are not stored; else
        empty."""
        self.fallen = False
        """Whether the platform may have been hanging when the power or a drive was suddenly
        lost."""
        self.broken: dict[int, str] = {}
        """Cables that seemed broken since all were last tight, by axis, with the reason."""

    def load(self, n: int, longest_m: float) -> None:
        """Read the file of a robot with n axes; if it is damaged, no lengths are known.

        `longest_m` is the greatest length of a cable in use. A file with more than twice that is
        damaged.
        """
        if self.path is None:
            return
        most_m = min(_MOST_OF_LONGEST * longest_m, FURTHEST_m)
        try:
            held = read_state(self.path)
            if held is not None:
                self._take(held, n, most_m)
        except StateFileError as error:
            self.why, self.fallen = str(error), True
        except (KeyError, TypeError, ValueError):
            self.why = (
                f"{self.path}: is damaged: it needs the lengths of {n} cables in metres, up to "
                f"{most_m:.4g}"
            )
            self.fallen = True

    def _take(self, held: dict[str, Any], n: int, most_m: float) -> None:
        if held["stopped"] is not True:
            self.why = f"{self.path}: the robot was moving when this was last written"
            self.fallen = True
            return
        self.fallen, self.displaced = (held.get(key, False) is not False for key in _FLAGS)
        if not held.keys() & set(_FIELDS):
            return  # the robot was never tightened
        if held.get("geometry", "") != self.geometry:
            self.why = (
                f"{self.path}: the robot was stopped with a calibration other than the one in force"
            )
            return
        lengths, at_index = (np.array([_length_m(x, most_m) for x in held[key]]) for key in _FIELDS)
        if lengths.shape != (n,) or at_index.shape != (n,) or not (lengths > 0.0).all():
            raise ValueError
        nowhere = np.full(n, math.nan)
        self.lengths = StoppedLengths(lengths, at_index, str(held["date"]), nowhere)

    def require_writable(self) -> None:
        """Raise StateFileError if the file for the lengths of the next stop cannot be written."""
        if self.path is not None and not can_write(self.path.parent):
            raise StateFileError(
                f"{self.path.parent}: is not writable, but must store the cable lengths at the "
                "next stop; make it writable, or start `cdpr run` with XDG_STATE_HOME set to a "
                "writable folder"
            )

    def begin_to_move(self, position_rad: FloatArray) -> None:
        """Record that the motors (n,) have not turned since the stop but may turn from now on.

        Raises StateFileError.
        """
        if self.lengths is not None:
            self.lengths = replace(self.lengths, position_rad=position_rad.copy())
        self._write({"stopped": False})

    def take(self) -> StoppedLengths | None:
        """Return the lengths and forget them, because the cables will be wound from now on."""
        lengths, self.lengths = self.lengths, None
        self.why = "the robot has moved since"
        return lengths

    def keep(self, estimate: AxisEstimate, feedback: AxisFeedback) -> None:
        """Store the lengths at which the robot has stopped, if known; raises StateFileError.

        If they are unknown, and no cable has moved, those of the previous stop remain valid.
        """
        if estimate.length_known.all() and not self.contradicted:
            turned = feedback.index_rad - feedback.position_rad
            at_index = np.where(
                feedback.index_known,
                estimate.cable_length_m + estimate.cable_m_per_rad * turned,
                math.nan,
            )
            date = datetime.now(UTC).isoformat(timespec="seconds")
            here = feedback.position_rad.copy()
            self.lengths = StoppedLengths(estimate.cable_length_m.copy(), at_index, date, here)
        table: dict[str, Any] = {
            "stopped": True,
            "fallen": self.fallen,
            "displaced": self.displaced,
        }
        if self.lengths is not None:
            table |= {"date": self.lengths.date, "geometry": self.geometry}
            table |= {key: _plain(getattr(self.lengths, key)) for key in _FIELDS}
        self._write(table)

    def _write(self, held: dict[str, Any]) -> None:
        if self.path is not None:
            write_state(self.path, held)


def off_index_m(
    last: StoppedLengths, length_m: FloatArray, feedback: AxisFeedback, cable_m: FloatArray
) -> FloatArray:
    """Return how much longer cables are than their motors' indices show, (n,).

    The difference is known up to whole motor turns. It is nan if an index is not known now or was
    not known at the stop. `cable_m` (n,) is paid out per radian.
    """
    at_index = length_m + cable_m * (feedback.index_rad - feedback.position_rad)
    turn = math.tau * np.abs(cable_m)
    off = np.remainder(at_index - last.cable_at_index_m + 0.5 * turn, turn) - 0.5 * turn
    return np.where(feedback.index_known, off, math.nan)


def index_disagreement(
    off_m: FloatArray, cable_m: FloatArray, allowed_m: float, names: Sequence[str]
) -> str:
    """Return a text that names the axes whose index is too far off, by `off_index_m` (n,), or "".

    The limit is `allowed_m` plus a share of a motor turn. A difference above half a turn cannot
    occur.
    """
    off_m = np.nan_to_num(np.abs(off_m))
    allowed = np.minimum(allowed_m, _INDEX_TURNS * math.tau * np.abs(cable_m))
    worst = int((off_m - allowed).argmax())
    if off_m[worst] <= allowed[worst]:
        return ""
    return (
        f"{names[worst]}: its motor's index is {1e3 * off_m[worst]:.1f} mm from its "
        f"place at the last stop, {1e3 * allowed[worst]:.1f} mm allowed: lower the "
        "platform, and tighten from home"
    )


def _length_m(value: Any, most_m: float) -> float:
    """Return a length, nan for None; raises TypeError and ValueError for anything else."""
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    if not abs(value) <= most_m:
        raise ValueError
    return float(value)


def _plain(values: FloatArray) -> list[float | None]:
    return [float(x) if math.isfinite(x) else None for x in values]
