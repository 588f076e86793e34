"""Log of the true motion; written for the report alone.

There is one record at every SYNC, and some where none comes, so that what a motor does whose master
has died is in it; these have `NO_SYNC` for a number. Records have the little-endian layout named in
the header of their `RecordFile`.
"""

from __future__ import annotations

import struct
from pathlib import Path

from cdpr_sim_bus.record_file import RecordFile

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


class TruthLog:
    """Appends records to a file; a file that cannot be written on ends the log, not the drive."""

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
        self._file = RecordFile(path, header)

    def append(self, sync_index: int, time_s: float, truth: tuple[float, ...]) -> None:
        """Append the true figures that a `motor.Sample` ends with."""
        angle, velocity, motor, cogging, friction, rise = truth
        _RECORD.pack_into(
            self._buffer, self._used, sync_index, time_s, angle - self._start_rad,
            angle - self._index_rad, velocity, motor, cogging, friction, rise,
        )  # fmt: skip
        self._used += _RECORD.size
        if self._used == len(self._buffer):
            self.flush()

    def flush(self) -> None:
        """Write what is buffered."""
        if self._used:
            self._file.write(memoryview(self._buffer)[: self._used])
            self._used = 0

    def close(self) -> None:
        """Flush and close the file."""
        self.flush()
        self._file.close()
