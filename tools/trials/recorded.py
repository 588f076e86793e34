"""The data of a trial: the recording of its cycles (MCAP), joined with the log of true poses."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray, rms
from cdpr_rt.service.recording_reader import Columns, RecordingReader
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.recordings.truth import PoseRecords, read_pose_log
from cdpr_tools.trials.directions import Directions, platform_of, rotations_of

TRUTH: Final = "truth.log"
FIELDS: Final = (
    "cycle",
    "time_s",
    "stream_buttons",
    "pose_setpoint",
    "position_rad",
    "torque_sent_Nm",
)
_OLDEST_S: Final = 0.01
"""Largest age of an angle that a simulated drive sends."""
_MISFIT_rad: Final = 0.005
_STANDING: Final = 1e-12


class Recorded:
    """One part of a trial, from its `begin` to its `end`, cycle by cycle.

    `cycles` are the recording's columns, `truth` the records of the same SYNCs. `marks` are the
    events that the trial wrote into the recording, oldest first. `directions` are the controlled
    directions of the platform. Raises RecordingError, ProfileError and BadInputError for missing
    files or files of another kind, WorkFailedError for files that do not belong together.
    """

    def __init__(self, folder: Path) -> None:
        paths = sorted(folder.glob("*.mcap"))
        if not paths:
            raise BadInputError(f"{folder}: holds no recording (*.mcap)")
        columns, self.marks = _read(paths)
        self.folder = folder
        begin, end = self._only("begin"), self._only("end")
        platform = platform_of(load_robot(begin["robot"]))
        # targets were relative to the home orientation of the calibration that was in force
        home_rad = tuple(begin.get("home_rotation_rad", platform.home_rotation_rad))
        self.directions = Directions.of(replace(platform, home_rotation_rad=home_rad))
        cycle = columns["cycle"]
        kept = (cycle >= begin["cycle"]) & (cycle <= end["cycle"])
        self.cycles: Columns = {name: column[kept] for name, column in columns.items()}
        cycle = self.cycles["cycle"]
        if cycle.size < 2 or not (np.diff(cycle) == 1).all():
            raise WorkFailedError(f"{folder}: the recording has gaps, or no cycles")
        self.first = int(cycle[0])
        self.truth: PoseRecords = _joined(
            read_pose_log(folder / TRUTH), cycle + begin["sync_offset"] - 1
        )
        self._require_alignment()

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Bus time since the trial began, (k,)."""
        return np.asarray(self.cycles["time_s"] - self.cycles["time_s"][0])

    @property
    def period_s(self) -> float:
        """Time from one cycle to the next."""
        return float(self.time_s[1])

    @property
    def true_m(self) -> FloatArray:
        """True position of the platform's origin, (c, k)."""
        return np.asarray(self.truth["position_m"][:, : self.directions.k])

    @property
    def setpoint_m(self) -> FloatArray:
        """Set-point of that position, from the recording, (c, k)."""
        return np.asarray(self.cycles["pose_setpoint"][:, : self.directions.k])

    @cached_property
    def true_places(self) -> FloatArray:
        """True places of the platform, with the controlled angles, (c, d)."""
        return self.directions.places(self.truth["position_m"], self.truth["rotation"])

    @cached_property
    def setpoint_places(self) -> FloatArray:
        """Set-points as places, with the controlled angles, (c, d)."""
        return self.directions.places(self.setpoint_m, self._setpoint_rotations)

    @cached_property
    def turned_off_rad(self) -> FloatArray:
        """Rotation vectors from the set-point to the true orientation, (c, 3).

        (c, 0) if the platform's angles are not controlled.
        """
        if not self.directions.turns:
            return np.zeros((len(self.truth), 0))
        return self.directions.turn_between(self._setpoint_rotations, self.truth["rotation"])

    @cached_property
    def _setpoint_rotations(self) -> FloatArray:
        return rotations_of(self.cycles["pose_setpoint"][:, 3:])

    def row(self, cycle: int) -> int:
        """Return the row of a cycle."""
        return min(max(cycle - self.first, 0), len(self.truth) - 1)

    def marked(self, what: str) -> list[dict[str, Any]]:
        """Return the marks of one kind."""
        return [mark for mark in self.marks if mark["mark"] == what]

    def _only(self, what: str) -> dict[str, Any]:
        found = self.marked(what)
        if len(found) != 1:
            raise WorkFailedError(f"{self.folder}: the trial was not finished (no {what!r} in it)")
        return found[0]

    def _require_alignment(self) -> None:
        """Raise WorkFailedError if the recorded motor angles are not those of the log.

        A drive's angle is slightly old when SYNC latches it, but never from the future. Its age is
        the angle error divided by the speed. Motors that swing fast have larger errors.
        """
        measured, true = self.cycles["position_rad"], self.truth["motor_rad"]
        speed = np.gradient(true, self.period_s, axis=0)
        speed -= speed.mean(axis=0)
        off = (true - measured) - (true - measured).mean(axis=0)
        moved = max(float(np.sum(speed**2)), _STANDING)
        age_s = float(np.sum(speed * off)) / moved
        rest = rms((off - age_s * speed).ravel())
        uncertain_s = 0.25 * self.period_s + 5.0 * rest / np.sqrt(moved)
        old = -uncertain_s <= age_s <= _OLDEST_S + uncertain_s
        swings_rad = age_s**2 * rms(np.gradient(speed, self.period_s, axis=0).ravel())
        if not old or not rest < _MISFIT_rad + swings_rad:
            raise WorkFailedError(
                f"{self.folder}: recording and {TRUTH} do not belong together: the motor angles "
                "differ at the same SYNCs"
            )


def _read(paths: list[Path]) -> tuple[Columns, list[dict[str, Any]]]:
    parts, marks = [], []
    for path in paths:
        reader = RecordingReader(path)
        parts += list(reader.cycles(FIELDS))
        marks += [event for event in reader.events if "mark" in event]
    if not parts:
        raise BadInputError(f"{paths[0]}: holds no cycles")
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}, marks


def _joined(truth: PoseRecords, index: NDArray[np.int64]) -> PoseRecords:
    """Return the records of the SYNCs `index`; raises WorkFailedError if some are missing."""
    first = int(truth["sync_index"][0]) if truth.size else 0
    rows = index.astype(np.int64) - first
    if rows[0] < 0 or rows[-1] >= truth.size or not (truth["sync_index"][rows] == index).all():
        raise WorkFailedError(
            f"{TRUTH}: does not contain the SYNCs {int(index[0])} to {int(index[-1])}"
        )
    return truth[rows]
