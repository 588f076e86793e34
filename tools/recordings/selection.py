"""Select the files, fields and time range of recordings that a command works on."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from pyarrow import csv, parquet

from cdpr_profiles.bounded_input import replacing
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import FIELDS, column_names
from cdpr_rt.service.recording_file import RecordingError
from cdpr_rt.service.recording_reader import Columns, RecordingReader
from cdpr_tools.daemon.paths import default_recordings
from cdpr_tools.errors import (
    BadInputError,
    WorkFailedError,
    os_error_as,
    raised_as,
)
from cdpr_tools.saving import require_free

ELAPSED = "elapsed_s"
"""Name of an added column: seconds since the first row, over all files."""

_BYTES_PER_S = 3e6
_MOST_BYTES = 1_000_000_000
_NAME = re.compile(r"(.+)-([0-9]{8}T[0-9]{6}Z)-[0-9]{3,}")
"""Robot and date in the name of a recording."""


def files_of(paths: Sequence[Path]) -> list[Path]:
    """Return the recordings that `paths` name: files, all in a folder, or those of a session.

    Sessions are searched by name in the folder where `cdpr run` records. Raises BadInputError.
    """
    found: list[Path] = []
    for path in paths:
        with os_error_as(BadInputError, f"{path}: cannot be read"):
            inside = sorted(path.glob("*.mcap")) if path.is_dir() else [path]
            if not path.exists() and path.name == str(path):
                inside = sorted(default_recordings().glob(f"{path.name}-*.mcap")) or inside
        if not inside:
            raise BadInputError(f"{path}: no recordings (*.mcap) in this folder")
        found += inside
    return found


def is_being_written(path: Path) -> bool:
    """Return whether a process that this user may inspect has the file open for writing."""
    target = str(path.resolve())
    for link in Path("/proc").glob("[0-9]*/fd/*"):
        with suppress(OSError):  # the process has ended, or is another user's
            if str(link.readlink()) == target:
                info = (link.parents[1] / "fdinfo" / link.name).read_text()
                flags = int(info.partition("flags:")[2].split()[0], 8)
                if flags & os.O_ACCMODE != os.O_RDONLY:
                    return True
    return False


def sessions(files: Sequence[Path]) -> dict[str, list[Path]]:
    """Return the files of each session by its name (ROBOT-DATE), the newest session last.

    A session is one run of a daemon. A file with any other name is a session alone and comes first.
    """
    found: dict[tuple[str, str], list[Path]] = {}
    for path in files:
        name = _NAME.fullmatch(path.stem)
        found.setdefault((name[2], name[1]) if name else ("", path.stem), []).append(path)
    return {
        f"{robot}-{date}" if date else robot: sorted(found[date, robot])
        for date, robot in sorted(found)
    }


def fields_of(text: str | None) -> list[str] | None:
    """Return the names in a comma-separated list, None for all. Raises BadInputError."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in FIELDS:
            raise BadInputError(f"--fields {name}: allowed: {', '.join(FIELDS)}")
    if not names:
        raise BadInputError("--fields: is empty; allowed: names separated by commas")
    return names


@dataclass
class _Time:
    """Bus time on one scale; if cycles restart, the time stamps give the length of the gap."""

    offset_s: float | None = None
    last_s: float = 0.0
    last_ns: int = 0

    def __call__(self, time_s: FloatArray, stamp_ns: FloatArray) -> FloatArray:
        elapsed = np.empty_like(time_s)
        starts = [0, *(np.flatnonzero(np.diff(time_s) < 0.0) + 1), time_s.size]
        for a, b in pairwise(starts):
            if self.offset_s is None:
                self.offset_s = -float(time_s[a])
            elif time_s[a] + self.offset_s <= self.last_s:
                gap_s = 1e-9 * max(0, int(stamp_ns[a]) - self.last_ns)
                self.offset_s = self.last_s + gap_s - float(time_s[a])
            elapsed[a:b] = time_s[a:b] + self.offset_s
            self.last_s, self.last_ns = float(elapsed[b - 1]), int(stamp_ns[b - 1])
        return elapsed


class Selection:
    """The rows of several files between two times; after reading, `readers` have the other data."""

    def __init__(
        self,
        paths: Sequence[Path],
        fields: Collection[str] | None = None,
        from_s: float = 0.0,
        until_s: float = float("inf"),
    ) -> None:
        self.readers = [RecordingReader(path) for path in files_of(paths)]
        self._fields = fields
        self._from_s, self._until_s = from_s, until_s
        self._robot: tuple[str | None, str | None] | None = None
        self.advance: Callable[[float], None] = lambda _seconds: None
        """Called with the progress of reading, from 0 to `reading_s`."""
        self.ends_s = 0.0
        """Time of the last row, selected or not; known after all rows have been read."""
        if until_s <= from_s:
            raise BadInputError(f"--until {until_s:g}: allowed: more than --from {from_s:g}")

    @property
    def reading_s(self) -> float:
        """Approximate time to read all files."""
        paths = (reader.path for reader in self.readers)
        return sum(path.stat().st_size for path in paths if path.is_file()) / _BYTES_PER_S

    def rows(self) -> Iterator[Columns]:
        """Yield the rows with `ELAPSED`, some hundreds at a time.

        Raises BadInputError for a file that is not a recording.
        """
        needed = None if self._fields is None else {*self._fields, "time_s", "stamp_ns"}
        time = _Time()
        for reader in self.readers:
            for columns in _readable(reader, needed):
                self._check_robot(reader)
                done = sum(one.position for one in self.readers)
                self.advance(done / _BYTES_PER_S)
                elapsed = time(columns["time_s"], columns["stamp_ns"])
                self.ends_s = float(elapsed[-1])
                in_range = (elapsed >= self._from_s) & (elapsed <= self._until_s)
                if in_range.any():
                    chosen = {name: columns[name][in_range] for name in self._fields or columns}
                    yield {ELAPSED: elapsed[in_range], **chosen}

    def _check_robot(self, reader: RecordingReader) -> None:
        """Raise BadInputError if a file is not of the same robot as the files before it."""
        robot = (reader.metadata.get("robot"), reader.metadata.get("axes"))
        first = self._robot = self._robot or robot
        if robot != first:
            said = "{}: records {} with {} axes, but earlier files record {} with {}"
            raise BadInputError(
                said.format(reader.path, *robot, *first) + "; allowed: recordings of one robot"
            )

    def columns(self) -> Columns:
        """Return all rows as whole columns; raises BadInputError for no row or too many."""
        parts, size = [], 0
        for part in self.rows():
            size += sum(column.nbytes for column in part.values())
            if size > _MOST_BYTES:
                raise BadInputError(
                    f"{self.readers[0].path}: more than {_MOST_BYTES / 1e9:g} GB of "
                    "columns; choose "
                    "less with --from and --until"
                )
            parts.append(part)
        if not parts:
            names = ", ".join(str(reader.path) for reader in self.readers)
            raise BadInputError(f"{names}: no cycles in the selected time")
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _readable(reader: RecordingReader, fields: Collection[str] | None) -> Iterator[Columns]:
    with raised_as(BadInputError, RecordingError):
        yield from reader.cycles(fields)


# Recordings as tables for other programs: CSV or Parquet.

FORMATS = (".csv", ".parquet")


def check_target(path: Path, overwrite: bool) -> None:
    """Raise BadInputError if `path` is not a valid target."""
    if path.suffix not in FORMATS:
        raise BadInputError(f"--out {path}: allowed: a name that ends in {' or '.join(FORMATS)}")
    require_free("--out", path, overwrite)


def export(selection: Selection, path: Path) -> int:
    """Write the rows to `path`, one column for each field and axis; return their number.

    Raises BadInputError if there are no rows, WorkFailedError if the file cannot be written.
    """
    with os_error_as(WorkFailedError, f"{path}: cannot be written"):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            return _write(selection, file, path.suffix)


def write_csv(selection: Selection, file: IO[bytes]) -> int:
    """Write the rows as CSV; return their number. Raises BadInputError for no row."""
    return _write(selection, file, ".csv")


def _write(selection: Selection, file: IO[bytes], suffix: str) -> int:
    count, writer = 0, None
    try:
        for columns in selection.rows():
            table = _table(columns, selection.readers[0].axes)
            if writer is None and suffix == ".csv":
                writer = csv.CSVWriter(file, table.schema)
            elif writer is None:
                writer = parquet.ParquetWriter(file, table.schema, compression="zstd")
            writer.write_table(table)
            count += table.num_rows
        if writer is None:
            names = ", ".join(str(reader.path) for reader in selection.readers)
            raise BadInputError(f"{names}: no cycles in the selected time")
        if suffix == ".parquet":
            described = json.dumps(selection.readers[-1].description)
            writer.add_key_value_metadata({"description": described})
        writer.close()
    except BaseException:
        if writer is not None:
            with suppress(Exception):  # otherwise it fails later because the file is closed
                writer.close()
        raise
    return count


def _table(columns: Columns, axes: Sequence[str]) -> Any:
    """Return flat columns, `tension_N[left]` and so on for arrays; unknown values are null."""
    flat: dict[str, Any] = {}
    for field, values in columns.items():
        parts = values.T if values.ndim == 2 else [values]
        for name, part in zip(column_names(field, values.shape, axes), parts, strict=True):
            flat[name] = pa.array(part, from_pandas=True)
    return pa.table(flat)
