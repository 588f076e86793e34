"""A device that measures the platform's pose from outside, and its record of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdpr_sim_bus.record_file import RecordFile
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.logs.platform_record import rotation_of
from cdpr_sim_bus.robot.robot_plant import ScannerPlant

_SAME_TIME_S = 1e-9
_FIELDS = [("time_s", "<f8"), ("position_m", "<f8", (3,)), ("rotation", "<f8", (3, 3))]


class PoseScanner:
    """Appends a measured pose to a file at its rate, at the first instant after it that is told.

    Position and rotation have errors of a normal distribution, each coordinate and each reading
    its own; those of the rotation are a rotation vector in the room. In a plane it measures x, y
    and the angle. A file that cannot be written on ends the record, not the robot.
    """

    def __init__(self, path: Path, robot: CableRobot, plant: ScannerPlant, seed: int) -> None:
        """Create the file; raises OSError."""
        self._robot = robot
        self._plant = plant
        self._chance = np.random.default_rng([seed, 3])
        self._planar = bool(robot.platform["planar"][0])
        self._due_s = 0.0
        self._row = np.zeros(1, np.dtype(_FIELDS))
        header = {
            "format": "cdpr-rt scanner log 1",
            "position_sigma_m": plant.position_sigma_m,
            "rotation_sigma_rad": plant.rotation_sigma_rad,
            "record_bytes": self._row.itemsize,
            "fields": _FIELDS,
        }
        self._file = RecordFile(path, header)

    def append(self, _sync_index: int, time_s: float, _truth: tuple[float, ...]) -> None:
        """Measure the pose where it is time to."""
        if time_s < self._due_s - _SAME_TIME_S:
            return
        period_s = 1.0 / self._plant.rate_Hz
        self._due_s += period_s
        if self._due_s <= time_s:  # nobody told the time for a while, which is not made up for
            self._due_s = time_s + period_s
        shift = self._chance.normal(0.0, self._plant.position_sigma_m, 3)
        turn = self._chance.normal(0.0, self._plant.rotation_sigma_rad, 3)
        if self._planar:
            shift[2] = turn[0] = turn[1] = 0.0
        self._row["time_s"] = time_s
        self._row["position_m"] = self._robot.position_m + shift
        self._row["rotation"] = rotation_of(turn) @ self._robot.rotation
        self._file.write(self._row.tobytes())

    def flush(self) -> None:
        """Do nothing: records do not wait."""

    def close(self) -> None:
        """Close the file."""
        self._file.close()
