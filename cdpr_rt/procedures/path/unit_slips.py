"""Paths in wrong units: 25.4 or 1000 times as large, or as small, as the robot's workspace has it.

A slip is only called one where the path fits once it is undone.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.path.description import PathDescription, PathError

_FACTORS: Final = {
    1.0 / 25.4: "25.4 times too large: mm that are read as inches (G20 for G21)",
    1.0 / 1000.0: "1000 times too large: mm that are read as m",
    25.4: "25.4 times too small: inches that are read as mm (G21 for G20)",
    1000.0: "1000 times too small: m that are read as mm",
}
_SMALL: Final = 0.04
"""A path not larger than this share of the workspace may be one in wrong units."""


def size_fault(path: PathDescription, low_m: FloatArray, high_m: FloatArray) -> None:
    """Raise PathError where a path only fits the workspace's box with its units undone."""
    k = path.coordinates.positions
    points = path.points[:, :k]
    inside = ((points >= low_m) & (points <= high_m)).all(axis=1)
    if inside.all():
        return
    size, room = np.ptp(points, axis=0), high_m - low_m
    line = path.lines[int((~inside).argmax())]
    for factor, text in _FACTORS.items():
        scaled = factor * points
        if ((scaled >= low_m) & (scaled <= high_m)).all():
            raise PathError(path.source, line, f"the path is {text}")
    if (size > room).any():
        for factor, text in _FACTORS.items():
            if factor < 1.0 and (factor * size <= room).all():
                raise PathError(
                    path.source, line,
                    f"the path is {_told(size)}, the workspace {_told(room)}; perhaps {text}",
                )  # fmt: skip
        raise PathError(
            path.source, line, f"the path is {_told(size)}; allowed: {_told(room)}, the workspace"
        )


def size_note(path: PathDescription, low_m: FloatArray, high_m: FloatArray) -> str:
    """Return the likely mistake of unit by the size of a path that is inside, "" for none."""
    points = path.points[:, : path.coordinates.positions]
    size, room = np.ptp(points, axis=0), high_m - low_m
    if not size.any() or (size > _SMALL * room).any():
        return ""
    return (
        f"the whole path is only {_told(size)}, of {_told(room)} of workspace: are its units right?"
    )


def _told(size_m: FloatArray) -> str:
    return " x ".join(f"{1e3 * value:.4g}" for value in size_m) + " mm"
