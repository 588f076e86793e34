"""Log of a robot's true pose and tensions, one record at every SYNC; for reports and tests alone.

The file begins with one line of JSON, padded with spaces to HEADER_BYTES, newline included; then
follow records of the little-endian layout named in it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from sim_bus.cable_robot import CableRobot

HEADER_BYTES = 1024
_BUFFERED = 256


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
        ]
        self._rows = np.zeros(_BUFFERED, np.dtype(fields))
        self._used = 0
        self._file = path.open("wb", buffering=0)
        header = {
            "format": "cdpr-rt pose log 1",
            "record_bytes": self._rows.itemsize,
            "fields": fields,
        }
        self._write(json.dumps(header).encode().ljust(HEADER_BYTES - 1) + b"\n")

    def append(self, sync_index: int, time_s: float, _truth: tuple[float, ...]) -> None:
        """Append what is true of the robot now; what its first motor tells of itself is in it."""
        robot, row = self._robot, self._rows[self._used]
        row["sync_index"], row["time_s"] = sync_index, time_s
        row["position_m"], row["rotation"] = robot.position_m, robot.rotation
        row["velocity_m_s"] = robot.platform["velocity"][0]
        row["tension_N"] = robot.motors["tension"]
        row["motor_rad"] = robot.motors["angle"]
        self._used += 1
        if self._used == _BUFFERED:
            self.flush()

    def flush(self) -> None:
        """Write what is buffered."""
        if self._used:
            self._write(self._rows[: self._used].tobytes())
            self._used = 0

    def close(self) -> None:
        """Flush and close the file."""
        self.flush()
        self._file.close()

    def _write(self, data: bytes) -> None:
        if self._file.closed:
            return
        try:
            self._file.write(data)
        except OSError as error:
            print(f"pose log {self._file.name}: {error.strerror}; it ends here", file=sys.stderr)
            self._file.close()
