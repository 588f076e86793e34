"""Way points as a path: a TOML file for people, a CSV file for programs and spreadsheets."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from pydantic import Field

from cdpr_profiles.bounded_input import read_bytes, read_text
from cdpr_profiles.errors import ProfileError, brief, value_text
from cdpr_profiles.reader import Profile, read_toml_model
from cdpr_rt.motion.gcode import GcodeSettings, read_gcode
from cdpr_rt.motion.path_description import (
    Coordinates,
    LONGEST_DWELL_s,
    Move,
    PathDescription,
    PathError,
)

_HEADS: Final = re.compile(r"^\s*\[\[\s*points\s*\]\]", re.MULTILINE)
_UNITS: Final = {
    "m": ("m", 1.0), "mm": ("m", 1e-3), "rad": ("rad", 1.0), "deg": ("rad", math.radians(1.0)),
}  # fmt: skip
_SPEEDS: Final = {"speed_m_s": 1.0, "speed_mm_s": 1e-3}
_BOM: Final = "\ufeff"
"""Byte order mark, with which spreadsheets begin texts in UTF-8."""
_BLENDS: Final = {"blend_m": 1.0, "blend_mm": 1e-3}
_Speed = Annotated[float, Field(gt=0, le=100)]
_Blend = Annotated[float, Field(ge=0, le=10)]


class _PointTable(Profile):
    """One way point; missing values are those of the previous one, or of home."""

    position_m: tuple[float, ...]
    rotation_rad: tuple[float, ...] | None = None
    speed_m_s: _Speed | None = None
    blend_m: _Blend | None = None
    dwell_s: float = Field(default=0.0, ge=0, le=LONGEST_DWELL_s)
    wait: bool = False


class _PathTable(Profile):
    """A path through way points; speed and blending radius are defaults for the points."""

    speed_m_s: _Speed | None = None
    blend_m: _Blend = 0.0
    points: tuple[_PointTable, ...] = Field(min_length=2)


def read_toml_points(path: Path, coordinates: Coordinates) -> PathDescription:
    """Return the path through the tables [[points]] of a TOML file; raises ProfileError."""
    table = read_toml_model(path, _PathTable)
    text = read_text(path, 1 << 20)
    if not text.endswith("\n"):
        raise PathError(path, text.count("\n") + 1, "does not end with a newline: is it truncated?")
    lines = [text.count("\n", 0, head.start()) + 1 for head in _HEADS.finditer(text)]
    lines += [0] * (len(table.points) - len(lines))  # the array may be in one line
    k, d = coordinates.positions, len(coordinates.names)
    found: PathDescription | None = None
    rotation = np.zeros(d - k)
    for i, (point, line) in enumerate(zip(table.points, lines, strict=False)):
        _require_count(path, f"points[{i}].position_m", point.position_m, k)
        if point.rotation_rad is not None:
            _require_count(path, f"points[{i}].rotation_rad", point.rotation_rad, d - k)
            rotation = np.array(point.rotation_rad)
        end = np.concatenate([point.position_m, rotation])
        if found is None:
            found = PathDescription(str(path), coordinates, end, line)
            if not (point.dwell_s or point.wait):
                continue
        speed = point.speed_m_s or table.speed_m_s or math.inf
        blend_m = table.blend_m if point.blend_m is None else point.blend_m
        found.add(Move(line, end, speed, blend_m, point.dwell_s, point.wait))
    assert found is not None  # there are two points at least
    return found


def _require_count(path: Path, key: str, values: tuple[float, ...], count: int) -> None:
    if len(values) != count:
        allowed = f"{count} numbers for this robot"
        raise ProfileError(path, key, f"value {value_text(values)}; allowed: {allowed}")


def read_csv_points(
    text: str, source: str, coordinates: Coordinates, *, all_columns: bool = False
) -> PathDescription:
    """Return the path through the rows of a CSV file, whose first line names its columns.

    Columns are coordinates with their unit (x_m or x_mm, rx_rad or rx_deg, ...), speed_m_s,
    blend_m, dwell_s, wait (0 or 1). An empty cell repeats the row before, and so does a coordinate
    without a column, unless `all_columns` are required. Raises PathError.
    """
    if not text.endswith("\n"):
        last = text.count("\n") + 1
        raise PathError(source, last, "does not end with a newline: is it truncated?")
    rows = csv.reader(text.removeprefix(_BOM).split("\n"))
    columns: list[tuple[str, float]] = []
    found: PathDescription | None = None
    d, k = len(coordinates.names), coordinates.positions
    kept = dict.fromkeys(coordinates.names[k:], 0.0) | {"speed": math.inf, "blend": 0.0}
    for line, row in _rows(rows, source):
        if not any(cell.strip() for cell in row) or row[0].lstrip().startswith("#"):
            continue
        if not columns:
            columns = [_column(source, line, cell.strip(), coordinates) for cell in row]
            named = {what for what, _ in columns}
            if all_columns and (left := [one for one in coordinates.names if one not in named]):
                allowed = ", ".join(coordinates.names)
                problem = f"column {left[0]} is missing; allowed: {allowed}, each with its unit"
                raise PathError(source, line, problem)
            continue
        kept |= {"dwell": 0.0, "wait": 0.0}
        kept |= _cells(source, line, row, columns)
        missing = [name for name in coordinates.names if name not in kept]
        if missing:
            raise PathError(source, line, f"{missing[0]}: is missing; allowed: a number")
        end = np.array([kept[name] for name in coordinates.names[:d]])
        if found is None:
            found = PathDescription(source, coordinates, end, line)
            if not (kept["dwell"] or kept["wait"]):
                continue
        found.add(Move(line, end, kept["speed"], kept["blend"], kept["dwell"], kept["wait"] != 0.0))
    if found is None or not found.moves:
        raise PathError(source, 0, "contains fewer than two way points")
    return found


def _rows(rows: Any, source: str) -> Iterator[tuple[int, list[str]]]:
    """Yield rows with their lines; raises PathError for invalid CSV."""
    try:
        for row in rows:
            yield rows.line_num, row
    except csv.Error as error:
        raise PathError(source, rows.line_num, str(error)) from None


def _column(source: str, line: int, name: str, coordinates: Coordinates) -> tuple[str, float]:
    """Return the quantity of a column and the factor to its SI unit."""
    for key, factors in (("speed", _SPEEDS), ("blend", _BLENDS)):
        if name in factors:
            return key, factors[name]
    if name in ("dwell_s", "wait"):
        return name.removesuffix("_s"), 1.0
    what, _, unit = name.rpartition("_")
    if what in coordinates.names and unit in _UNITS:
        kind, factor = _UNITS[unit]
        if (kind == "m") == (coordinates.names.index(what) < coordinates.positions):
            return what, factor
    k = coordinates.positions
    lengths = ", ".join(f"{one}_m" for one in coordinates.names[:k])
    angles = "".join(f", {one}_rad" for one in coordinates.names[k:])
    raise PathError(
        source, line, f"column {name!r}; allowed: {lengths}{angles} (or _mm, _deg), speed_m_s, "
        "blend_m, dwell_s, wait"
    )  # fmt: skip


_BOUNDS: Final = {
    "speed": (1e-6, 100.0), "blend": (0.0, 10.0), "dwell": (0.0, LONGEST_DWELL_s), "wait": (0, 1),
}  # fmt: skip


def _cells(
    source: str, line: int, row: list[str], columns: list[tuple[str, float]]
) -> dict[str, float]:
    """Return the values of a row, in SI units."""
    if len(row) != len(columns):
        raise PathError(source, line, f"{len(row)} cells; allowed: {len(columns)}, as in line 1")
    values = {}
    for cell, (key, factor) in zip(row, columns, strict=True):
        if not cell.strip():
            continue
        try:
            value = factor * float(cell)
        except ValueError:
            raise PathError(source, line, f"{key}: value {cell[:40]!r} is not a number") from None
        low, high = _BOUNDS.get(key, (-1e6, 1e6))
        if not low <= value <= high:
            raise PathError(
                source, line, f"{key}: value {brief(cell, 40)}; allowed: {low:g} to {high:g}"
            )
        values[key] = value
    return values


# Reading a path's file; the suffix gives its kind.

MOST_BYTES: Final = 1 << 24
GCODE: Final = (".nc", ".ngc", ".gcode", ".tap", ".cnc")
_POINTS: Final = (".toml", ".csv")


def require_kind(path: Path) -> str:
    """Return the file's suffix in lower case; raises PathError if it is not the suffix of a
    path.
    """
    suffix = path.suffix.lower()
    if suffix not in (*_POINTS, *GCODE):
        raise PathError(
            path,
            0,
            f"not a path file; allowed: way points {' '.join(_POINTS)}, G-code {' '.join(GCODE)}",
        )
    return suffix


def read_source(path: Path, most_bytes: int = MOST_BYTES) -> str:
    """Return the text of a path's file; raises PathError and ProfileError.

    G-code that is not UTF-8 is read as Latin-1, as in comments of older CAM programs.
    """
    if require_kind(path) in _POINTS:
        return read_text(path, most_bytes)
    data = read_bytes(path, most_bytes)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def read_path(path: Path, coordinates: Coordinates, settings: GcodeSettings) -> PathDescription:
    """Return the path that a file describes; raises PathError and ProfileError.

    .toml and .csv contain way points; .nc, .ngc, .gcode, .tap and .cnc contain G-code. Only G-code
    uses `settings`.
    """
    suffix = require_kind(path)
    if suffix == ".toml":
        return read_toml_points(path, coordinates)
    text = read_source(path)
    if suffix == ".csv":
        return read_csv_points(text, str(path), coordinates)
    return read_gcode(text, str(path), coordinates, settings)
