"""Tables of numbers in files of other programs: CSV, OptiTrack and Vicon exports.

Every reader returns a `Table`. Its format is recognised by the beginning of the file.
"""

from __future__ import annotations

import codecs
import csv
import hashlib
import io
import math
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice, takewhile, zip_longest
from pathlib import Path
from typing import Final

import numpy as np

from cdpr_profiles.bounded_input import read_bytes
from cdpr_profiles.errors import ProfileError, brief, value_text
from cdpr_rt.arrays import FloatArray, IntArray

MOST_BYTES: Final = 1 << 28
"""Largest size of a recording by another program."""
_Row = tuple[int, list[str]]
"""Number of a line in the file, and its cells."""
_DELIMITERS: Final = (",", ";", "\t")
_SAMPLE_LINES: Final = 50
_OPTITRACK: Final = "Format Version"
_VICON: Final = ("Objects", "Segments", "Trajectories", "Joints", "Model Outputs")
TIME: Final = "time_s"
"""Name of the column with the time in formats that contain frame numbers instead."""
_LENGTHS: Final = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}


@dataclass(frozen=True)
class Table:
    """Named columns of numbers, nan for empty cells, and the line of the file of each row.

    `units` holds those that the file states.
    """

    path: Path
    sha256: str
    columns: dict[str, FloatArray]
    lines: IntArray
    units: dict[str, str] = field(default_factory=dict)

    def column(self, name: str) -> FloatArray:
        """Return a column, (rows,); raises ProfileError with the names of all columns."""
        if name not in self.columns:
            raise ProfileError(
                self.path,
                f"line {int(self.lines[0]) - 1}",
                f"no column {name!r}; its columns: {brief(', '.join(self.columns))}",
            )
        return self.columns[name]

    def fault(self, name: str, row: int, problem: str) -> ProfileError:
        """Return the error for one cell."""
        return ProfileError(self.path, f"line {int(self.lines[row])}: {name}", problem)


def read_table(path: Path) -> Table:
    """Read a file; raises ProfileError with file, line, column and what is allowed."""
    data = read_bytes(path, MOST_BYTES)
    digest = hashlib.sha256(data).hexdigest()
    encoding = _encoding(data)
    first = next((line.strip() for _, line in _lines(data, encoding)), "")
    rows = _rows(path, data, encoding)
    if first.startswith(_OPTITRACK):
        return _read_optitrack(path, rows, digest)
    if first.rstrip(",;") in _VICON:
        return _read_vicon(path, rows, digest)
    _, names = next(rows, (0, []))
    if not names:
        raise ProfileError(path, "", "contains no lines; allowed: a line of names, then numbers")
    return _table(path, digest, names, rows, {})


def _encoding(data: bytes) -> str:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):  # "Unicode text" of Excel
        return "utf-16"
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _lines(data: bytes, encoding: str) -> Iterator[tuple[int, str]]:
    """Yield number and text of each line that is neither empty nor a comment."""
    text = io.TextIOWrapper(io.BytesIO(data), encoding, errors="replace")
    for number, line in enumerate(text, 1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line.rstrip("\n")


def _rows(path: Path, data: bytes, encoding: str) -> Iterator[_Row]:
    """Yield the lines as cells, split at the delimiter that is most frequent in the names."""
    kept = (line for _, line in islice(_lines(data, encoding), _SAMPLE_LINES))
    # the names decide: decimal commas would outnumber semicolons
    sample = next((line for line in kept if any(one in line for one in _DELIMITERS)), "")
    delimiter = max(_DELIMITERS, key=sample.count)
    for number, line in _lines(data, encoding):
        try:
            cells = next(csv.reader([line], delimiter=delimiter))
        except csv.Error as error:
            raise ProfileError(path, f"line {number}", f"is not a CSV line: {error}") from None
        yield number, [cell.strip() for cell in cells]


def _table(
    path: Path, digest: str, names: Sequence[str], rows: Iterable[_Row], units: dict[str, str]
) -> Table:
    """Return the table of lines of cells; raises ProfileError."""
    twice = {name for name in names if name and list(names).count(name) > 1}
    if twice:
        problem = f"columns {sorted(twice)}; allowed: a different name for each column"
        raise ProfileError(path, "", problem)
    numbers, lines, read = array("d"), array("q"), _Numbers(path)
    for line, row in rows:
        if len(row) > len(names) and any(row[len(names) :]):
            problem = f"{len(row)} cells; allowed: up to {len(names)}, one for each column"
            raise ProfileError(path, f"line {line}", problem)
        lines.append(line)
        for name, cell in zip_longest(names, row[: len(names)], fillvalue=""):
            numbers.append(read(line, name, cell) if cell else math.nan)
    if not lines:
        raise ProfileError(path, "", "contains no rows of numbers below the names")
    cells = np.array(numbers).reshape(len(lines), len(names))
    columns = {name: cells[:, j] for j, name in enumerate(names) if name}
    return Table(path, digest, columns, np.array(lines), units)


class _Numbers:
    """Reads the numbers of a file, which all have the same decimal mark."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._mark = ""

    def __call__(self, line: int, name: str, cell: str) -> float:
        """Return a number, nan if it is not finite; raises ProfileError."""
        mark = next((one for one in ".," if one in cell), self._mark)
        try:
            value = float(cell.replace(",", ".") if mark == "," else cell)
        except ValueError:
            problem = f"value {value_text(cell)}; allowed: a number or an empty cell"
            raise ProfileError(self._path, f"line {line}: {name}", problem) from None
        if self._mark not in ("", mark):
            problem = (
                f"value {value_text(cell)}: earlier numbers have {self._mark!r} as decimal mark"
            )
            raise ProfileError(
                self._path, f"line {line}: {name}", f"{problem}; write one decimal mark everywhere"
            )
        self._mark = mark
        return value if math.isfinite(value) else math.nan


def _head(rows: Iterator[_Row]) -> list[list[str]]:
    """Return the lines up to the one that begins with `Frame`; empty if it is missing."""
    head = []
    for _, row in rows:
        head.append(row)
        if row[:1] == ["Frame"]:
            return head
    return []


def _read_optitrack(path: Path, rows: Iterator[_Row], digest: str) -> Table:
    """Read an export of OptiTrack Motive: columns such as "Platform Position X".

    Names stand above the line "Frame,Time (Seconds),...": a line `Name` and, directly above the
    axes, one with Rotation or Position. The first line states the unit of length.
    """
    head = _head(rows)
    named = [row for row in head if "Name" in row[:2]]
    if not named:
        raise ProfileError(
            path, "", "no lines `Name` and `Frame`: export from Motive with all header rows"
        )
    bodies, kinds, axes = named[0], head[-2], head[-1]
    names, units = [], {}
    facts = dict(zip(head[0][::2], head[0][1::2], strict=False))
    length = _LENGTHS.get(facts.get("Length Units", "Meters").lower(), "m")
    for j, axis in enumerate(axes):
        above = [part[j] for part in (bodies, kinds) if j > 1 and j < len(part) and part[j]]
        name = " ".join([*above, axis]) if j > 1 else (TIME if j == 1 else axis)
        names.append(name)
        if "Position" in above:
            units[name] = length
    return _table(path, digest, names, rows, units | {TIME: "s"})


def _read_vicon(path: Path, rows: Iterator[_Row], digest: str) -> Table:
    """Read an export of Vicon Nexus or Tracker: columns such as "Platform TX".

    The second line is the rate in Hz, the third the names of the objects, then the line
    "Frame,Sub Frame,..." and one of units. Only the file's first block is read.
    """
    head = _head(rows)
    _, stated = next(rows, (0, []))
    try:
        rate = float(head[1][0])
    except (IndexError, ValueError):
        rate = math.nan
    if len(head) < 3 or not stated or not rate > 0.0:
        raise ProfileError(
            path, "line 2", "allowed: the rate in Hz, then names, the line `Frame` and units"
        )
    above, axes = head[-2], head[-1]
    names, body = [], ""
    for j, axis in enumerate(axes):
        body = above[j].split(":")[-1] if j < len(above) and above[j] else body
        names.append(f"{body} {axis}".strip() if j > 1 else axis)
    block = takewhile(lambda row: len(row[1]) > 1, rows)
    units = {name: unit for name, unit in zip(names, stated, strict=False) if unit}
    table = _table(path, digest, names, block, units)
    seconds = (table.columns["Frame"] - 1.0) / rate
    return Table(path, digest, {TIME: seconds, **table.columns}, table.lines, units | {TIME: "s"})
