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


def read_path(path: Path, coordinates: Coordinates, settings: GcodeSettings) -> PathDescription:
    """Return the path that a file describes; raises PathError and ProfileError.

    .toml and .csv hold way points, .nc, .ngc, .gcode, .tap and .cnc G-code, which alone makes use
    of `settings`.
    """
    suffix = path.suffix.lower()
    if suffix == ".toml":
        return read_toml_points(path, coordinates)
    if suffix not in (".csv", *GCODE):
        raise PathError(path, 0, f"allowed: a file .toml, .csv or {' '.join(GCODE)}")
    text = read_text(path, MOST_BYTES)
    if suffix == ".csv":
        return read_csv_points(text, str(path), coordinates)
    return read_gcode(text, str(path), coordinates, settings)
