"""Log of the true motion, written for the report alone; and the file of records that logs are.

There is one record at every SYNC, and some where none comes, so that what a motor does whose master
has died is in it; these have `NO_SYNC` for a number. Records have the little-endian layout named in
the header of their `RecordFile`.
"""

from __future__ import annotations

import json
import struct
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from typing_extensions import override

HEADER_BYTES = 1024
NO_SYNC = 0xFFFFFFFF
"""In place of the SYNC's number in a record that belongs to none."""


class RecordFile:
    """A file that begins by describing its records: what was true, or measured from outside.

    One line of JSON, padded with spaces to HEADER_BYTES, newline included; then records.

    A file that cannot be written on ends, and says so; whoever writes goes on.
    """

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        """Create the file; raises OSError."""
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
            print(f"log {self._file.name}: {error.strerror}; it ends here", file=sys.stderr)
            self._file.close()

    def flush(self) -> None:
        """Write what waits: nothing, unless a subclass has records wait."""

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
        super().__init__(path, header)

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

    @override
    def flush(self) -> None:
        """Write what is buffered."""
        if self._used:
            self.write(memoryview(self._buffer)[: self._used])
            self._used = 0
