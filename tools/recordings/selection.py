"""Which files, fields and stretch of time of a recording a command works on."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import FIELDS
from cdpr_rt.service.recordings.recording_file import RecordingError
from cdpr_rt.service.recordings.recording_reader import Columns, RecordingReader
from cdpr_tools.errors import BadInputError, os_error_as, raised_as

ELAPSED = "elapsed_s"
"""The column that is added: seconds since the first row, over all files."""

_BYTES_PER_S = 3e6


def files_of(paths: Sequence[Path]) -> list[Path]:
    """Return the recordings that `paths` name: files, or all in a folder. Raises BadInputError."""
    found: list[Path] = []
    for path in paths:
        with os_error_as(BadInputError, f"{path}: cannot be read"):
            inside = sorted(path.glob("*.mcap")) if path.is_dir() else [path]
        if not inside:
            raise BadInputError(f"{path}: no recordings (*.mcap) in this folder")
        found += inside
    return found


def fields_of(text: str | None) -> list[str] | None:
    """Return the names in a list with commas, None for all. Raises BadInputError."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in FIELDS:
            raise BadInputError(f"--fields {name}: allowed: {', '.join(FIELDS)}")
    if not names:
        raise BadInputError("--fields: names none; allowed: names with commas between them")
    return names


@dataclass
class _Time:
    """Bus time as one scale; where cycles began anew, the gap is that of the stamps."""

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
    """The rows of several files between two instants; `readers` tell the rest afterwards."""

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
        """Called with how far reading has come, out of `reading_s`."""
        self.ends_s = 0.0
        """When the last row was, be it selected or not; known once all have been read."""
        if until_s <= from_s:
            raise BadInputError(f"--until {until_s:g}: allowed: more than --from {from_s:g}")

    @property
    def reading_s(self) -> float:
        """About how long it takes to read all of it."""
        paths = (reader.path for reader in self.readers)
        return sum(path.stat().st_size for path in paths if path.is_file()) / _BYTES_PER_S

    def rows(self) -> Iterator[Columns]:
        """Yield the rows with `ELAPSED`, some hundred at a time.

        Raises BadInputError for a file that is no recording.
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
        """Raise BadInputError where a file is not of the robot of those before it."""
        robot = (reader.metadata.get("robot"), reader.metadata.get("axes"))
        first = self._robot = self._robot or robot
        if robot != first:
            said = "{}: of {} with {} axes, and those before it of {} with {}"
            raise BadInputError(
                said.format(reader.path, *robot, *first) + "; allowed: recordings of one robot"
            )

    def columns(self) -> Columns:
        """Return all of them as whole columns; raises BadInputError where there are none."""
        parts = list(self.rows())
        if not parts:
            names = ", ".join(str(reader.path) for reader in self.readers)
            raise BadInputError(f"{names}: no cycles in what was asked for")
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _readable(reader: RecordingReader, fields: Collection[str] | None) -> Iterator[Columns]:
    with raised_as(BadInputError, RecordingError):
        yield from reader.cycles(fields)
