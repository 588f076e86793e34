"""Log of the true motion, which only reports may read; and the record file of all such logs.

There is one record at every SYNC. Some records are written without SYNC, with `NO_SYNC` as number,
so that the log also shows a motor whose master has died. Records have the little-endian layout
named in the header of their `RecordFile`.
"""

from __future__ import annotations

import errno
import json
import struct
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from typing_extensions import override

from cdpr_profiles.bounded_input import may_replace
from cdpr_profiles.errors import printable
from cdpr_profiles.jit import bound, jit
from cdpr_sim_bus.physics_board import BoardPlatform, PlatformState
from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.motor_state import MotorArray
from cdpr_sim_bus.robot.platform import rotation_of
from cdpr_sim_bus.robot.robot_plant import ScannerPlant

HEADER_BYTES = 1024
NO_SYNC = 0xFFFFFFFF
"""Number in a record that belongs to no SYNC."""


class RecordFile:
    """A file of true or externally measured values whose header describes its records.

    The header is one line of JSON, padded with spaces to HEADER_BYTES, newline included; the
    records follow.

    If the file becomes unwritable, the record ends with a message and the writer continues.
    """

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        """Create the file, replacing an earlier one; raises OSError."""
        if not may_replace(path, b'{"format": "cdpr-rt'):
            raise FileExistsError(errno.EEXIST, "exists and is not a log of a simulator")
        self._file = path.open("wb", buffering=0)
        self.write(json.dumps(header).encode().ljust(HEADER_BYTES - 1) + b"\n")

    def write(self, data: bytes | memoryview) -> None:
        """Append records."""
        if self._file.closed:
            return
        try:
            while data:
                data = data[self._file.write(data) :]
        except OSError as error:
            name = printable(self._file.name)
            print(f"log {name}: {error.strerror}; it ends here", file=sys.stderr)
            self._file.close()

    def flush(self) -> None:
        """Write waiting records: none, unless a subclass buffers them."""

    def close(self) -> None:
        """Flush and close the file."""
        self.flush()
        self._file.close()


FIELDS = (
    ("sync_index", "<u4"),
    ("time_s", "<f8"),
    ("angle_rad", "<f8"),
    ("angle_from_index_rad", "<f8"),
    ("velocity_rad_s", "<f4"),
    ("motor_torque_Nm", "<f4"),
    ("cogging_Nm", "<f4"),
    ("friction_Nm", "<f4"),
    ("temperature_rise_K", "<f4"),
)
"""Name and numpy type of each field of a record, without padding between them."""
_RECORD = struct.Struct("<Idddfffff")
_BUFFERED = 512


class TruthLog(RecordFile):
    """Appends records to a file; if it cannot be written, the log ends and the drive continues."""

    def __init__(self, path: Path, node_id: int, index_rad: float, start_rad: float) -> None:
        """Create the file; `index_rad`, `start_rad` are mechanical angles. Raises OSError."""
        self._index_rad = index_rad
        self._start_rad = start_rad
        self._buffer = bytearray(_BUFFERED * _RECORD.size)
        self._used = 0
        header = {
            "format": "cdpr-rt truth log 1",
            "node_id": node_id,
            "index_rad": index_rad,
            "start_rad": start_rad,
            "record_bytes": _RECORD.size,
            "fields": FIELDS,
        }
        super().__init__(path, header)

    def append(self, sync_index: int, time_s: float, truth: tuple[float, ...]) -> None:
        """Append the true values at the end of a `motor.Sample`."""
        angle, velocity, motor, cogging, friction, rise = truth
        _RECORD.pack_into(
            self._buffer, self._used, sync_index, time_s, angle - self._start_rad,
            angle - self._index_rad, velocity, motor, cogging, friction, rise,
        )  # fmt: skip
        self._used += _RECORD.size
        if self._used == len(self._buffer):
            self.flush()

    @override
    def flush(self) -> None:
        """Write the buffered records."""
        if self._used:
            self.write(memoryview(self._buffer)[: self._used])
            self._used = 0


# Logs of the true pose of a robot's platform: a file, a scanner's readings, the physics board.
# Files have one record at every SYNC, and some without SYNC, as a truth log. Records have the
# little-endian layout named in the header of their `RecordFile`. Each is written whole and
# immediately, so that the last one can be read while the robot runs.


_STAMP = struct.Struct("<Id")
"""The first two fields of a record."""


def _motor_fields(n: int) -> list[tuple[str, str, tuple[int]]]:
    names = ("tension_N", "motor_rad", "torque_Nm", "motor_rad_s", "power_on")
    return [(name, "<f8", (n,)) for name in names]


class PoseLog(RecordFile):
    """Appends records to a file; if it cannot be written, the log ends and the robot continues."""

    def __init__(self, path: Path, robot: CableRobot) -> None:
        """Create the file; raises OSError."""
        n = robot.n
        fields = [
            ("sync_index", "<u4"),
            ("time_s", "<f8"),
            ("position_m", "<f8", (3,)),
            ("velocity_m_s", "<f8", (3,)),
            ("rotation", "<f8", (3, 3)),
            *_motor_fields(n),
        ]
        self._row = np.zeros(1, np.dtype(fields))
        self._bytes = memoryview(self._row.view(np.uint8).data)
        # views: otherwise the kernel would be compiled again for each number of motors
        parts = [self._row[field[0]][0] for field in fields[2:]]
        self._fill = bound(fill_record, robot.platform, robot.motors, *parts, then=())
        header = {
            "format": "cdpr-rt pose log 1",
            "record_bytes": self._row.itemsize,
            "fields": fields,
        }
        super().__init__(path, header)

    def append(self, sync_index: int, time_s: float, _truth: tuple[float, ...]) -> None:
        """Append the true state of the robot, including its first motor."""
        _STAMP.pack_into(self._bytes, 0, sync_index, time_s)
        self._fill()
        self.write(self._bytes)


@jit
def fill_record(
    platform: Any,
    motors: Any,
    position: Any,
    velocity: Any,
    rotation: Any,
    tension: Any,
    angle: Any,
    torque: Any,
    speed: Any,
    power: Any,
) -> None:
    """Write pose, tensions and motors to a record; position and velocity refer to the origin."""
    p = platform[0]
    R, w = p.rotation, p.spin
    x = R[0, 0] * p.com[0] + R[0, 1] * p.com[1] + R[0, 2] * p.com[2]
    y = R[1, 0] * p.com[0] + R[1, 1] * p.com[1] + R[1, 2] * p.com[2]
    z = R[2, 0] * p.com[0] + R[2, 1] * p.com[1] + R[2, 2] * p.com[2]
    position[0] = p.position[0] - x
    position[1] = p.position[1] - y
    position[2] = p.position[2] - z
    velocity[0] = p.velocity[0] - (w[1] * z - w[2] * y)
    velocity[1] = p.velocity[1] - (w[2] * x - w[0] * z)
    velocity[2] = p.velocity[2] - (w[0] * y - w[1] * x)
    for k in range(3):
        for j in range(3):
            rotation[k, j] = R[k, j]
    for i in range(p.cables):
        m = motors[i]
        tension[i] = m.winch_tension
        angle[i] = m.angle
        torque[i] = m.true_gain * m.current
        speed[i] = m.velocity
        power[i] = 0.0 if m.kind == servo.OFF else 1.0


class MotorsLog(RecordFile):
    """A pose log of motors without a platform: it has all but the pose."""

    def __init__(self, path: Path, motors: Sequence[MotorArray]) -> None:
        """Create the file; raises OSError."""
        self._motors = motors
        fields = [("sync_index", "<u4"), ("time_s", "<f8"), *_motor_fields(len(motors))]
        self._row = np.zeros(1, np.dtype(fields))
        header = {
            "format": "cdpr-rt pose log 1",
            "record_bytes": self._row.itemsize,
            "fields": fields,
        }
        super().__init__(path, header)

    def append(self, sync_index: int, time_s: float, _truth: tuple[float, ...]) -> None:
        """Append the true state of the motors."""
        row = self._row[0]
        row["sync_index"], row["time_s"] = sync_index, time_s
        for i, motor in enumerate(self._motors):
            m = motor[0]
            row["tension_N"][i] = m["winch_tension"]
            row["motor_rad"][i], row["motor_rad_s"][i] = m["angle"], m["velocity"]
            row["torque_Nm"][i] = m["true_gain"] * m["current"]
            row["power_on"][i] = m["kind"] != servo.OFF
        self.write(self._row.tobytes())


_SAME_TIME_S = 1e-9
_FIELDS = [("time_s", "<f8"), ("position_m", "<f8", (3,)), ("rotation", "<f8", (3, 3))]


class PoseScanner(RecordFile):
    """Appends a measured pose to a file when a measurement is due, at the next call of `append`.

    Position and rotation have normally distributed errors, independent for each coordinate and
    reading; the rotation error is a rotation vector in the room. In a plane it measures x, y
    and the angle. If the file cannot be written, the record ends and the robot continues.
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
        """Measure the pose if a measurement is due."""
        if time_s < self._due_s - _SAME_TIME_S:
            return
        period_s = 1.0 / self._plant.rate_Hz
        self._due_s += period_s
        if self._due_s <= time_s:  # `append` was not called in time: skip the missed readings
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
    """A log that keeps only the newest pose, on the board; at first the pose at power-up."""

    def __init__(self, robot: CableRobot, board: BoardPlatform) -> None:
        self._robot, self._board = robot, board
        self.append(0, 0.0, ())

    def append(self, _sync_index: int, time_s: float, _truth: tuple[float, ...]) -> None:
        """Publish the present pose and motion of the platform's frame."""
        robot = self._robot
        self._board.publish(
            PlatformState(
                time_s,
                tuple(robot.position_m.tolist()),
                tuple(robot.rotation.ravel().tolist()),
                tuple(robot.velocity_m_s.tolist()),
                tuple(robot.platform[0]["spin"].tolist()),
            )
        )

    def flush(self) -> None:
        """Do nothing: no data wait."""

    def close(self) -> None:
        """Do nothing: the owner of the board closes it."""
