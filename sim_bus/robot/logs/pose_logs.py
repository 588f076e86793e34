"""Logs of where a robot's platform truly is: a file, a scanner's readings, the physics board.

Of files there is one record at every SYNC, and some where none comes, as in a truth log. Records
have the little-endian layout named in the header of their `RecordFile`. Each is written at once,
whole, so that the last one can be read while the robot runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdpr_sim_bus.jit import jit
from cdpr_sim_bus.physics_board import BoardPlatform, PlatformState
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.logs.platform_record import rotation_of
from cdpr_sim_bus.robot.logs.truth_log import RecordFile
from cdpr_sim_bus.robot.robot_plant import ScannerPlant


class PoseLog(RecordFile):
    """Appends records to a file; a file that cannot be written on ends the log, not the robot."""

    def __init__(self, path: Path, robot: CableRobot) -> None:
        """Create the file; raises OSError."""
        n = robot.n
        self._robot = robot
        fields = [
            ("sync_index", "<u4"),
            ("time_s", "<f8"),
            ("position_m", "<f8", (3,)),
            ("velocity_m_s", "<f8", (3,)),
            ("rotation", "<f8", (3, 3)),
            ("tension_N", "<f8", (n,)),
            ("motor_rad", "<f8", (n,)),
            ("torque_Nm", "<f8", (n,)),
        ]
        self._row = np.zeros(1, np.dtype(fields))
        self._bytes = self._row.view(np.uint8).data
        header = {
            "format": "cdpr-rt pose log 1",
            "record_bytes": self._row.itemsize,
            "fields": fields,
        }
        super().__init__(path, header)
        fill_record(self._row, robot.platform, robot.motors)

    def append(self, sync_index: int, time_s: float, _truth: tuple[float, ...]) -> None:
        """Append the true state of the robot; that of its first motor is included."""
        row = self._row[0]
        row["sync_index"], row["time_s"] = sync_index, time_s
        fill_record(self._row, self._robot.platform, self._robot.motors)
        self.write(self._bytes)


@jit
def fill_record(rows: Any, platform: Any, motors: Any) -> None:
    """Write pose, tensions and motors to a record: position and velocity are of the origin."""
    row, p = rows[0], platform[0]
    R, w = p.rotation, p.spin
    x = R[0, 0] * p.com[0] + R[0, 1] * p.com[1] + R[0, 2] * p.com[2]
    y = R[1, 0] * p.com[0] + R[1, 1] * p.com[1] + R[1, 2] * p.com[2]
    z = R[2, 0] * p.com[0] + R[2, 1] * p.com[1] + R[2, 2] * p.com[2]
    row.position_m[0] = p.position[0] - x
    row.position_m[1] = p.position[1] - y
    row.position_m[2] = p.position[2] - z
    row.velocity_m_s[0] = p.velocity[0] - (w[1] * z - w[2] * y)
    row.velocity_m_s[1] = p.velocity[1] - (w[2] * x - w[0] * z)
    row.velocity_m_s[2] = p.velocity[2] - (w[0] * y - w[1] * x)
    for k in range(3):
        for j in range(3):
            row.rotation[k, j] = R[k, j]
    for i in range(p.cables):
        m = motors[i]
        row.tension_N[i] = m.winch_tension
        row.motor_rad[i] = m.angle
        row.torque_Nm[i] = m.true_gain * m.current


_SAME_TIME_S = 1e-9
_FIELDS = [("time_s", "<f8"), ("position_m", "<f8", (3,)), ("rotation", "<f8", (3, 3))]


class PoseScanner(RecordFile):
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
        super().__init__(path, header)

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
        self.write(self._row.tobytes())


class BoardPose:
    """A log that keeps the newest pose only, on the board; that of power-up at first."""

    def __init__(self, robot: CableRobot, board: BoardPlatform) -> None:
        self._robot, self._board = robot, board
        self.append(0, 0.0, ())

    def append(self, _sync_index: int, time_s: float, _truth: tuple[float, ...]) -> None:
        """Publish pose and motion of the platform's frame as they are now."""
        p, robot = self._robot.platform[0], self._robot
        lever = np.cross(p["spin"], p["rotation"] @ p["com"])
        self._board.publish(
            PlatformState(
                time_s,
                tuple(robot.position_m.tolist()),
                tuple(robot.rotation.ravel().tolist()),
                tuple((p["velocity"] - lever).tolist()),
                tuple(p["spin"].tolist()),
            )
        )

    def flush(self) -> None:
        """Do nothing: nothing waits."""

    def close(self) -> None:
        """Do nothing: the board is its owner's to close."""
