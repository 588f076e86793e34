"""Reading a path's file, whose name says what it is."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from cdpr_profiles.reading.bounded_input import read_text
from cdpr_rt.motion.path.description import Coordinates, PathDescription, PathError
from cdpr_rt.motion.path.gcode import GcodeSettings, read_gcode
from cdpr_rt.motion.path.way_points import read_csv_points, read_toml_points

MOST_BYTES: Final = 1 << 24
GCODE: Final = (".nc", ".ngc", ".gcode", ".tap", ".cnc")
_POINTS: Final = (".toml", ".csv")


def require_kind(path: Path) -> str:
    """Return the file's suffix in small letters; raises PathError where it is none of a path's."""
    suffix = path.suffix.lower()
    if suffix not in (*_POINTS, *GCODE):
        raise PathError(
            path,
            0,
            f"no kind of path's file; allowed: way points {' '.join(_POINTS)}, "
            f"G-code {' '.join(GCODE)}",
        )
    return suffix


def read_path(path: Path, coordinates: Coordinates, settings: GcodeSettings) -> PathDescription:
    """Return the path that a file describes; raises PathError and ProfileError.

    .toml and .csv hold way points, .nc, .ngc, .gcode, .tap and .cnc G-code, which alone makes use
    of `settings`.
    """
    suffix = require_kind(path)
    if suffix == ".toml":
        return read_toml_points(path, coordinates)
    text = read_text(path, MOST_BYTES)
    if suffix == ".csv":
        return read_csv_points(text, str(path), coordinates)
    return read_gcode(text, str(path), coordinates, settings)
