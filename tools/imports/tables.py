"""Tables of numbers in files of other programs: CSV, and exports of OptiTrack, Vicon and Qualisys.

Every reader returns a `Table`. Its format is recognised by the beginning of the file.
"""

from __future__ import annotations

import codecs
import csv
import hashlib
import io
import math
import re
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from itertools import chain, islice, takewhile, zip_longest
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_profiles.bounded_input import read_bytes
from cdpr_profiles.errors import ProfileError, brief, value_text
from cdpr_rt.arrays import BoolArray, FloatArray, IntArray

MOST_BYTES: Final = 1 << 28
"""Largest size of a recording by another program."""
_Row = tuple[int, list[str]]
"""Number of a line in the file, and its cells."""
_DELIMITERS: Final = (",", ";", "\t", "|")
_SAMPLE_LINES: Final = 50
_OPTITRACK: Final = "Format Version"
_VICON: Final = ("Objects", "Segments", "Trajectories", "Joints", "Model Outputs")
_QUALISYS: Final = "NO_OF_FRAMES"
_QUALISYS_FACT: Final = re.compile(r"[A-Z]{2,}(_[A-Z]+)*")
TIME: Final = "time_s"
"""Name of the column with the time in formats that contain frame numbers instead."""
_NUMBER_FIRST: Final = re.compile(r"[\"']?\s*[-+]?[.,]?[0-9]")
_DATE: Final = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}[T ]")
_COMMENTS: Final = ("#", "%")
_EMPTY: Final = frozenset(("na", "n/a", "#n/a", "null", "none", "-", "--"))
"""Texts for a missing number, in lower case, besides nan and inf."""
_UNITS: Final = frozenset((
    "s", "sec", "ms", "us", "µs", "ns", "m", "cm", "mm", "rad", "deg", "°", "turns", "rev",
    "counts", "nm", "mnm", "a", "a_rms", "a_peak", "ma", "n", "kn", "kgf", "%", "‰", "rad/s",
    "deg/s", "rpm", "hz",
))  # fmt: skip
"""Units in a line below the names, in lower case."""
_UNIT_IN_NAME: Final = re.compile(r"[\[(]\s*([^\[\]()]*?)\s*[\])]$")
_QUATERNION: Final = "Quaternion"
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
    faults: dict[str, ProfileError] = field(default_factory=dict)
    """The first cell of each column that is not a number."""

    def some(self, rows: BoolArray) -> Table:
        """Return the table with the chosen rows only."""
        columns = {name: values[rows] for name, values in self.columns.items()}
        return replace(self, columns=columns, lines=self.lines[rows])

    def column(self, name: str) -> FloatArray:
        """Return a column, (rows,); raises ProfileError with the names of all columns."""
        if name not in self.columns:
            raise ProfileError(
                self.path,
                f"line {int(self.lines[0]) - 1}",
                f"no column {name!r}; its columns: {brief(', '.join(self.columns))}",
            )
        if name in self.faults:
            raise self.faults[name]
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
    if first.startswith(_QUALISYS):
        return _read_qualisys(path, rows, digest)
    return _read_csv(path, rows, digest, _last_comment(data, encoding))


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
    for number, line in _all_lines(data, encoding):
        if line.strip() and not line.lstrip().startswith(_COMMENTS):
            yield number, line


def _all_lines(data: bytes, encoding: str) -> Iterator[tuple[int, str]]:
    text = io.TextIOWrapper(io.BytesIO(data), encoding, errors="replace")
    for number, line in enumerate(text, 1):
        yield number, line.rstrip("\n")


def _last_comment(data: bytes, encoding: str) -> str:
    """Return the last comment in the first lines before a number: some programs write names so."""
    found = ""
    for _, line in islice(_all_lines(data, encoding), _SAMPLE_LINES):
        text = line.strip()
        if text.startswith(_COMMENTS):
            found = text.lstrip("#% ")
        elif text:
            break
    return found


def _rows(path: Path, data: bytes, encoding: str) -> Iterator[_Row]:
    """Yield the lines as cells, split at the delimiter of the names, or at spaces."""
    delimiter = _delimiter([line for _, line in islice(_lines(data, encoding), _SAMPLE_LINES)])
    for number, line in _lines(data, encoding):
        try:
            yield number, _split(line, delimiter)
        except csv.Error as error:
            raise ProfileError(path, f"line {number}", f"is not a CSV line: {error}") from None


def _split(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line; raises csv.Error."""
    cells = next(csv.reader([line], delimiter=delimiter)) if delimiter else line.split()
    return [cell.strip() for cell in cells]


def _delimiter(lines: list[str]) -> str:
    """Return the delimiter that is most frequent in the line above the numbers, "" for spaces.

    Decimal commas would outnumber semicolons in lines of numbers.
    """
    names = list(takewhile(lambda line: not _NUMBER_FIRST.match(line), lines))
    for line in [*reversed(names), *lines]:
        if any(one in line for one in _DELIMITERS):
            return max(_DELIMITERS, key=line.count)
    return ""


def _cells(row: list[str]) -> list[str]:
    """Return a line's cells without empty ones at its end."""
    count = max((j for j, cell in enumerate(row, 1) if cell), default=0)
    return row[:count]


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return cell.lower() in _EMPTY or _DATE.match(cell) is not None
    return True


def _read_csv(path: Path, rows: Iterator[_Row], digest: str, comment: str) -> Table:
    """Read a CSV file: a line of names, perhaps one of units, and rows of numbers.

    Names may end with a unit in brackets. Other lines may stand above. Without a line of names, a
    comment above the numbers may contain them.
    """
    head: list[list[str]] = []
    first: _Row | None = None
    for line, row in rows:
        cells = _cells(row)
        numbers = sum(map(_is_number, cells))
        alike = any(len(above) == len(cells) for above in head)
        is_fact = len(cells) == 2 and cells[0][:1].isalpha()  # such as Rate,1000
        if 2 * numbers > len(cells) or (numbers and alike and not is_fact):
            first = line, row
            break
        head.append(cells)
        if len(head) > _SAMPLE_LINES:
            break
    if not head and first is None:
        raise ProfileError(path, "", "contains no lines; allowed: a line of names, then numbers")
    if first is None:
        raise ProfileError(path, "", "contains no rows of numbers below the line of names")
    width = len(_cells(first[1]))
    named = [cells for cells in head if len(cells) >= width]
    names, units = (named or [[]])[-1], {}
    if len(named) > 1 and _are_units(names):
        names, stated = named[-2], [cell.strip("[]() ") for cell in names]
        units = {name: unit for name, unit in zip(names, stated, strict=False) if unit}
    if not names:
        names = _split(comment, _delimiter([comment])) if comment else []
        if len(names) != width:
            problem = "no line of names above the numbers; write one, such as time_s,angle,torque"
            raise ProfileError(path, f"line {first[0]}", problem)
    for name in names if not units else ():
        unit = _UNIT_IN_NAME.search(name)
        if unit is not None and unit[1].lower() in _UNITS:
            units[name] = unit[1]
    return _table(path, digest, names, chain([first], rows), units)


def _are_units(cells: list[str]) -> bool:
    """Return whether most cells are units, perhaps in brackets."""
    told = [cell.strip("[]() ").lower() for cell in cells if cell]
    bracketed = sum(cell[:1] in "[(" for cell in cells if cell)
    return 2 * max(sum(one in _UNITS for one in told), bracketed) > len(told)


def _table(
    path: Path, digest: str, names: Sequence[str], rows: Iterable[_Row], units: dict[str, str]
) -> Table:
    """Return the table of lines of cells; raises ProfileError."""
    twice = {name for name in names if name and list(names).count(name) > 1}
    if twice:
        problem = f"columns {sorted(twice)}; allowed: a different name for each column"
        raise ProfileError(path, "", problem)
    numbers, lines, read = array("d"), array("q"), _Numbers(path)
    faults: dict[str, ProfileError] = {}
    for line, row in rows:
        if len(row) > len(names) and any(row[len(names) :]):
            problem = f"{len(row)} cells; allowed: up to {len(names)}, one for each column"
            raise ProfileError(path, f"line {line}", problem)
        lines.append(line)
        for name, cell in zip_longest(names, row[: len(names)], fillvalue=""):
            value = math.nan
            if cell and name not in faults:
                try:
                    value = read(line, name, cell)
                except ProfileError as fault:  # of no matter if the column is not used
                    faults[name] = fault
            numbers.append(value)
    if not lines:
        raise ProfileError(path, "", "contains no rows of numbers below the line of names")
    cells = np.array(numbers).reshape(len(lines), len(names))
    columns = {name: cells[:, j] for j, name in enumerate(names) if name}
    return Table(path, digest, columns, np.array(lines), units, faults)


class _Numbers:
    """Reads the numbers of a file, which all have the same decimal mark."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._mark = ""

    def __call__(self, line: int, name: str, cell: str) -> float:
        """Return a number, or the time of day of a date in s; nan for a text such as NA.

        Raises ProfileError.
        """
        if cell.lower() in _EMPTY:
            return math.nan
        if _DATE.match(cell):
            return self._time_of_day(line, name, cell)
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

    def _time_of_day(self, line: int, name: str, cell: str) -> float:
        try:
            stamp = datetime.fromisoformat(cell)
        except ValueError:
            problem = f"value {value_text(cell)}; allowed: a date such as 2026-01-31T12:00:00.5Z"
            raise ProfileError(self._path, f"line {line}: {name}", problem) from None
        return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()


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

    Names stand above the line "Frame,Time (Seconds),...": a line `Name`, which exports before
    version 1.23 do not mark, and, directly above the axes, one with Rotation or Position. The first
    line states the unit of length.
    """
    head = _head(rows)
    filled = [row for row in head[1:] if any(row)]
    marked = [i for i, row in enumerate(filled) if "Name" in row[:2]]
    at = marked[0] if marked else 1
    if not marked and len(filled) != len(("types", "names", "IDs", "kinds", "axes")):
        raise ProfileError(
            path, "", "no lines `Name` and `Frame`: export from Motive with all header rows"
        )
    types, bodies, kinds, axes = filled[at - 1], filled[at], filled[-2], filled[-1]
    names: list[str] = []
    units = {}
    facts = dict(zip(head[0][::2], head[0][1::2], strict=False))
    stated = facts.get("Length Units", "not stated")
    length = _LENGTHS.get(stated.lower(), stated)
    kind = facts.get("Rotation Type", _QUATERNION if "W" in axes else "order not stated")
    faults: dict[str, ProfileError] = {}
    for j, axis in enumerate(axes):
        above = [part[j] for part in (bodies, kinds) if j > 1 and j < len(part) and part[j]]
        name = " ".join([*above, axis]).strip() if j > 1 else (TIME if j == 1 else axis)
        if name in names:  # a marker of a body, measured and as fitted
            name += f" ({types[j] if j < len(types) else j})"
        names.append(name)
        if "Position" in above:
            units[name] = length
        elif "Rotation" in above and kind != _QUATERNION:
            problem = f"has Euler angles ({kind}); export from Motive with quaternions"
            faults[name] = ProfileError(path, name, problem)
    table = _table(path, digest, names, rows, units | {TIME: "s"})
    return replace(table, faults=table.faults | faults)


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
    columns = {TIME: seconds, **table.columns}
    return replace(table, columns=columns, units=units | {TIME: "s"})


def _read_qualisys(path: Path, rows: Iterator[_Row], digest: str) -> Table:
    """Read an export of Qualisys Track Manager: columns such as "Platform X", in mm.

    Lines of facts such as FREQUENCY stand above the names. Exports may lack all names, or those of
    the bodies. The rotation matrix of a body becomes its rotation vector "Platform RX", "Platform
    RY", "Platform RZ", in rad. A hidden body is at 0, 0, 0.
    """
    facts: dict[str, list[str]] = {}
    first: _Row = (0, [])
    for first in rows:
        name, *values = first[1]
        if not values or not _QUALISYS_FACT.fullmatch(name):
            break
        facts[name] = _cells(values)
    head = first[1]
    if all(map(_is_number, _cells(head))):  # without a line of names
        rows, head = chain([first], rows), [*"XYZ"]
    names = _qualisys_names(head, [*facts.get("MARKER_NAMES", []), *facts.get("BODY_NAMES", [])])
    if not any(name.endswith(" X") for name in names):
        problem = "no names of markers or bodies; export with column headers and time"
        raise ProfileError(path, f"line {first[0]}", problem)
    table = _table(path, digest, names, rows, {})
    columns, units, faults = table.columns, {TIME: "s"}, table.faults
    if TIME not in columns:
        count = columns.get("Frame", np.arange(1.0, table.lines.size + 1.0))
        columns[TIME] = (count - 1.0) / _rate(path, facts.get("FREQUENCY", []))
    for name in names:
        body, _, axis = name.rpartition(" ")
        if axis in ("Roll", "Pitch", "Yaw"):
            problem = f"is an Euler angle of unknown order; allowed: {body} RX, RY and RZ"
            faults[name] = ProfileError(path, name, problem)
        place = [f"{body} {one}" for one in "XYZ"]
        if axis != "X" or not columns.keys() >= {*place}:
            continue
        seen = np.any([columns[one] for one in place], axis=0)
        matrix = [columns[one] for i in range(9) if (one := f"{body} Rot[{i}]") in columns]
        if len(matrix) == 9:
            turned = [f"{body} R{one}" for one in "XYZ"]
            vectors = _rotation_vectors(np.array(matrix).T, seen)
            columns |= dict(zip(turned, vectors.T, strict=True))
            units |= dict.fromkeys(turned, "rad")
        units |= dict.fromkeys(place, "mm")
        for one in place:
            columns[one] = np.where(seen, columns[one], np.nan)
    return replace(table, units=units)


def _qualisys_names(head: list[str], bodies: list[str]) -> list[str]:
    """Return the name of each column: its body and its axis.

    `head` is the line of names: the first name of a body contains it, or the names apply to each of
    `bodies`, with an empty column between them.
    """
    if head[:1] == ["X"]:
        of_one = [*head, ""] if len(head) > len("XYZ") else head
        return [cell and f"{body} {cell}" for body in bodies for cell in of_one]
    names, body = [], ""
    for cell in head:
        *above, axis = cell.rsplit(" ", 1)
        body = above[0] if above else body
        names.append(TIME if cell == "Time" else f"{body} {axis}".strip() if cell else "")
    return names


def _rate(path: Path, stated: list[str]) -> float:
    """Return the rate of a Qualisys export in Hz."""
    try:
        rate = float(stated[0])
    except (IndexError, ValueError):
        rate = math.nan
    if not 0.0 < rate < math.inf:
        problem = f"value {value_text(' '.join(stated))}; allowed: the rate in Hz, or a column Time"
        raise ProfileError(path, "FREQUENCY", problem)
    return rate


def _rotation_vectors(matrices: FloatArray, seen: BoolArray) -> FloatArray:
    """Return the rotation vectors (k, 3) of matrices (k, 9), column by column; nan if not seen."""
    vectors = np.full((len(matrices), 3), np.nan)
    whole = seen & (np.linalg.norm(matrices, axis=1) > 1.0)
    by_row = matrices[whole].reshape(-1, 3, 3).transpose(0, 2, 1)
    if whole.any():
        vectors[whole] = Rotation.from_matrix(by_row).as_rotvec()
    return vectors
