"""Log of a robot's true pose and tensions; for reports and tests alone.

There is one record at every SYNC, and some where none comes, as in a truth log. Records have the
little-endian layout named in the header of their `RecordFile`. Each is written at once, whole, so
that the last one can be read while the robot runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdpr_sim_bus.jit import jit
from cdpr_sim_bus.record_file import RecordFile
from cdpr_sim_bus.robot.cable_robot import CableRobot


class PoseLog:
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
        self._file = RecordFile(path, header)
        fill_record(self._row, robot.platform, robot.motors)

    def append(self, sync_index: int, time_s: float, _truth: tuple[float, ...]) -> None:
        """Append the true state of the robot; that of its first motor is included."""
        row = self._row[0]
        row["sync_index"], row["time_s"] = sync_index, time_s
        fill_record(self._row, self._robot.platform, self._robot.motors)
        self._file.write(self._bytes)

    def flush(self) -> None:
        """Do nothing: records do not wait."""

    def close(self) -> None:
        """Close the file."""
        self._file.close()


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
        row.tension_N[i] = m.tension
        row.motor_rad[i] = m.angle
        row.torque_Nm[i] = m.true_gain * m.current
