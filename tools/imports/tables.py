"""Tables of numbers in files of other programs: CSV, OptiTrack and Vicon exports.

Every reader returns a `Table`. Its format is recognised by the beginning of the file.
"""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from cdpr_profiles.bounded_input import read_bytes
from cdpr_profiles.errors import ProfileError, brief, value_text
from cdpr_rt.arrays import FloatArray, IntArray

_MOST_BYTES: Final = 1 << 30
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
    data = read_bytes(path, _MOST_BYTES)
    text = _text(data)
    first = next((line.strip() for line in text.splitlines() if line.strip()), "")
    digest = hashlib.sha256(data).hexdigest()
    if first.startswith(_OPTITRACK):
        return _read_optitrack(path, text, digest)
    if first.rstrip(",;") in _VICON:
        return _read_vicon(path, text, digest)
    rows = list(_rows(path, text))
    if not rows:
        raise ProfileError(path, "", "contains no lines; allowed: a line of names, then numbers")
    (_, names), *rows = rows
    return _table(path, digest, names, rows, {})


def _text(data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _rows(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of each line that is neither empty nor a comment."""
    lines = text.splitlines()
    kept = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    # the names decide: decimal commas would outnumber semicolons
    named = [line for line in kept[:_SAMPLE_LINES] if any(one in line for one in _DELIMITERS)]
    sample = "".join(named[:1])
    delimiter = max(_DELIMITERS, key=sample.count)
    try:
        for number, line in enumerate(lines, 1):
            if line.strip() and not line.lstrip().startswith("#"):
                yield (
                    number,
                    [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))],
                )
    except csv.Error as error:
        raise ProfileError(path, f"line {number}", f"is not a CSV line: {error}") from None


def _table(
    path: Path,
    digest: str,
    names: Sequence[str],
    rows: Sequence[tuple[int, list[str]]],
    units: dict[str, str],
) -> Table:
    """Return the table of lines of cells; raises ProfileError."""
    twice = {name for name in names if name and list(names).count(name) > 1}
    if twice:
        problem = f"columns {sorted(twice)}; allowed: a different name for each column"
        raise ProfileError(path, "", problem)
    if not rows:
        raise ProfileError(path, "", "contains no rows of numbers below the names")
    cells = np.full((len(rows), len(names)), np.nan)
    for i, (line, row) in enumerate(rows):
        if len(row) > len(names) and any(row[len(names) :]):
            problem = f"{len(row)} cells; allowed: up to {len(names)}, one for each column"
            raise ProfileError(path, f"line {line}", problem)
        for j, cell in enumerate(row[: len(names)]):
            if cell:
                cells[i, j] = _number(path, line, names[j], cell)
    columns = {name: cells[:, j] for j, name in enumerate(names) if name}
    lines = np.array([line for line, _ in rows])
    return Table(path, digest, columns, lines, units)


def _number(path: Path, line: int, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        hint = "a number with a decimal point" if "," in cell else "a number or an empty cell"
        problem = f"value {value_text(cell)}; allowed: {hint}"
        raise ProfileError(path, f"line {line}: {name}", problem) from None
    return value if math.isfinite(value) else math.nan


def _read_optitrack(path: Path, text: str, digest: str) -> Table:
    """Read an export of OptiTrack Motive: columns such as "Platform Position X".

    Names stand above the line "Frame,Time (Seconds),...": a line `Name` and, directly above the
    axes, one with Rotation or Position. The first line states the unit of length.
    """
    rows = list(_rows(path, text))
    head = next((i for i, (_, row) in enumerate(rows) if row[:1] == ["Frame"]), None)
    named = [row for _, row in rows[:head] if "Name" in row[:2]] if head is not None else []
    if head is None or not named:
        raise ProfileError(
            path, "", "no lines `Name` and `Frame`: export from Motive with all header rows"
        )
    bodies, kinds, axes = named[0], rows[head - 1][1], rows[head][1]
    names, units = [], {}
    facts = dict(zip(rows[0][1][::2], rows[0][1][1::2], strict=False))
    length = _LENGTHS.get(facts.get("Length Units", "Meters").lower(), "m")
    for j, axis in enumerate(axes):
        above = [part[j] for part in (bodies, kinds) if j > 1 and j < len(part) and part[j]]
        name = " ".join([*above, axis]) if j > 1 else (TIME if j == 1 else axis)
        names.append(name)
        if "Position" in above:
            units[name] = length
    return _table(path, digest, names, rows[head + 1 :], units | {TIME: "s"})


def _read_vicon(path: Path, text: str, digest: str) -> Table:
    """Read an export of Vicon Nexus or Tracker: columns such as "Platform TX".

    The second line is the rate in Hz, the third the names of the objects, then the line
    "Frame,Sub Frame,..." and one of units. Only the file's first block is read.
    """
    rows = list(_rows(path, text))
    head = next((i for i, (_, row) in enumerate(rows) if row[:1] == ["Frame"]), None)
    try:
        rate = float(rows[1][1][0])
    except (IndexError, ValueError):
        rate = math.nan
    if head is None or head < 2 or head + 2 > len(rows) or not rate > 0.0:
        raise ProfileError(
            path, "line 2", "allowed: the rate in Hz, then names, the line `Frame` and units"
        )
    above, axes, stated = rows[head - 1][1], rows[head][1], rows[head + 1][1]
    names, body = [], ""
    for j, axis in enumerate(axes):
        body = above[j].split(":")[-1] if j < len(above) and above[j] else body
        names.append(f"{body} {axis}".strip() if j > 1 else axis)
    end = next((i for i in range(head + 2, len(rows)) if len(rows[i][1]) < 2), len(rows))
    units = {name: unit for name, unit in zip(names, stated, strict=False) if unit}
    table = _table(path, digest, names, rows[head + 2 : end], units)
    seconds = (table.columns["Frame"] - 1.0) / rate
    return Table(path, digest, {TIME: seconds, **table.columns}, table.lines, units | {TIME: "s"})
