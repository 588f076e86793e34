"""Log of the true motion, one record at every SYNC; written for the report alone.

The file begins with one line of JSON, padded with spaces to HEADER_BYTES, newline included; then
follow records of the little-endian layout named in it.
"""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path

HEADER_BYTES = 1024
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
        self._file = path.open("wb", buffering=0)
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
        self._write(json.dumps(header).encode().ljust(HEADER_BYTES - 1) + b"\n")

    def append(self, sync_index: int, time_s: float, truth: tuple[float, ...]) -> None:
        """Append the true figures that a `motor.Sample` ends with."""
        angle, velocity, motor, cogging, friction, rise = truth
        _RECORD.pack_into(
            self._buffer,
            self._used,
            sync_index,
            time_s,
            angle - self._start_rad,
            angle - self._index_rad,
            velocity,
            motor,
            cogging,
            friction,
            rise,
        )
        self._used += _RECORD.size
        if self._used == len(self._buffer):
            self.flush()

    def flush(self) -> None:
        """Write what is buffered."""
        if self._used:
            self._write(memoryview(self._buffer)[: self._used])
            self._used = 0

    def close(self) -> None:
        """Flush and close the file."""
        self.flush()
        self._file.close()

    def _write(self, data: bytes | memoryview) -> None:
        if self._file.closed:
            return
        try:
            while data:
                data = data[self._file.write(data) :]
        except OSError as error:
            print(f"truth log {self._file.name}: {error.strerror}; it ends here", file=sys.stderr)
            self._file.close()
