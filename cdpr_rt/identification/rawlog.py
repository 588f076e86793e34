"""Raw measurement files: a JSON line that describes the columns, then rows of float64.

A file is readable at any length: after a crash, a full disk or an incomplete copy, all rows that
were written remain.
"""

from __future__ import annotations

import json
import mmap
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

from cdpr_profiles.bounded_input import parse_json, read_bytes
from cdpr_profiles.errors import ProfileError, brief
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.errors import RawLogError

_FORMAT = "cdpr-rt raw log"
RAW_LOG: Final = _FORMAT.encode()
"""At the beginning of each file."""
_VERSION = 1
_HEADER_BYTES = 4096
_MOST_BYTES = 1 << 30


@dataclass(frozen=True)
class RawLog:
    """A raw log in memory: `columns` names, `rows` (samples, columns) and the `header`."""

    path: Path
    header: dict[str, Any]
    rows: FloatArray
    complete: bool
    """Whether the file contains all rows that its writer counted at the end."""

    def column(self, name: str, axis: int = 0) -> FloatArray:
        """Return one column, (samples,); raises RawLogError when the file has no such column."""
        names: list[str] = self.header["columns"]
        wanted = name if name in names else f"{name}[{axis}]"
        if wanted not in names:
            there = brief(", ".join(names))
            raise RawLogError(
                f"{self.path}: no column {name!r} for axis {axis}; its columns: {there}"
            )
        return self.rows[:, names.index(wanted)]


class RawLogWriter:
    """Writes rows to a file as they arrive; raises RawLogError if the disk does not accept them."""

    def __init__(self, path: Path, columns: list[str], meta: dict[str, Any]) -> None:
        self.path = path
        self._meta = {"format": _FORMAT, "version": _VERSION, "columns": columns, **meta}
        self._width = len(columns)
        self._rows = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file: IO[bytes] = path.open("wb", buffering=0)
            self._write(self._header(None))
        except OSError as error:
            raise self._failed(error) from error

    def _failed(self, error: OSError) -> RawLogError:
        return RawLogError(f"{self.path}: cannot record: {error.strerror or error}")

    def _write(self, data: bytes | memoryview) -> None:
        view = memoryview(data)
        while view:
            view = view[self._file.write(view) :]

    def _header(self, rows: int | None) -> bytes:
        text = json.dumps({**self._meta, "rows": rows}).encode()
        if len(text) >= _HEADER_BYTES:
            raise RawLogError(f"{self.path}: header of {len(text)} bytes, {_HEADER_BYTES} allowed")
        return text.ljust(_HEADER_BYTES - 1) + b"\n"

    def write(self, rows: FloatArray) -> None:
        """Append `rows` (samples, columns), contiguous."""
        try:
            self._write(rows.data.cast("B"))
        except OSError as error:
            raise self._failed(error) from error
        self._rows += len(rows)

    def close(self) -> None:
        """Write the number of rows to the header and close the file."""
        try:
            self._file.seek(0)
            self._write(self._header(self._rows))
            self._file.close()
        except OSError as error:
            raise self._failed(error) from error


def read_raw_log(path: Path) -> RawLog:
    """Read a raw log; drop an incomplete last row.

    Raises RawLogError if the file is missing, is not a raw log, or holds no complete row.
    """
    try:
        data = read_bytes(path, _MOST_BYTES)
    except ProfileError as error:
        raise RawLogError(str(error)) from None
    return _raw_log(path, data)


def map_raw_log(path: Path) -> RawLog:
    """Return a raw log that may still be written, without reading its rows into memory.

    Raises RawLogError like `read_raw_log`, and OSError.
    """
    with path.open("rb") as file, suppress(ValueError):  # an empty file
        return _raw_log(path, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    raise RawLogError(f"{path}: contains no complete row of measurements")


def _raw_log(path: Path, data: bytes | mmap.mmap) -> RawLog:
    try:
        header = parse_json(data[:_HEADER_BYTES], path)
        columns = header["columns"]
        known = header["format"] == _FORMAT and header["version"] == _VERSION
        known = known and isinstance(columns, list) and all(isinstance(c, str) for c in columns)
    except (ProfileError, KeyError, TypeError):
        known, columns = False, []
    if not known or not columns or len(data) < _HEADER_BYTES:
        raise RawLogError(
            f"{path}: not a raw log of version {_VERSION}, or its header is truncated"
        )
    samples = (len(data) - _HEADER_BYTES) // (8 * len(columns))
    if samples == 0:
        raise RawLogError(f"{path}: contains no complete row of measurements")
    # without a copy, because the file of a sweep and the arrays computed from it are large
    values = np.frombuffer(data, "<f8", samples * len(columns), offset=_HEADER_BYTES)
    rows = values.reshape(samples, len(columns))
    return RawLog(path, header, rows, complete=header.get("rows") == samples)


AXIS_COLUMNS = (
    "setpoint_rad",
    "setpoint_velocity_rad_s",
    "position_rad",
    "torque_actual_Nm",
    "torque_sent_Nm",
    "effort_Nm",
    "compensation_Nm",
    "statusword",
    "valid",
    "index_rad",
    "index_known",
)


def column_names(n: int) -> list[str]:
    """Return the names of a raw log's columns for n axes."""
    return ["cycle", "time_s", *(f"{name}[{i}]" for i in range(n) for name in AXIS_COLUMNS)]


def raw_rows(rows: Row) -> FloatArray:
    """Return the rows of cycles (samples,) as rows of a raw log, (samples, columns)."""
    n, width = rows["position_rad"].shape[1], len(AXIS_COLUMNS)
    raw = np.empty((len(rows), 2 + n * width))
    raw[:, 0], raw[:, 1] = rows["cycle"], rows["time_s"]
    for k, name in enumerate(AXIS_COLUMNS):
        raw[:, 2 + k :: width] = rows[name]
    return raw
