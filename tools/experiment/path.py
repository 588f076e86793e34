"""The targets of the experiment, and the places of the pattern in the robot's workspace.

Tremblay (thesis), section 2.6: 10 targets on a pattern of 600 x 300 mm, the right half first, the
end where it began. Which points of the pattern figure 2.8 takes is not in its text: assumed here
are its corners, the points of its edges a quarter of the width off the middle, and its centre.
In space the pattern stands upright along x, in the middle of the workspace's depth.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_tools.errors import BadInputError
from cdpr_tools.trials.directions import Directions, platform_of

WIDTH_M: Final = 0.6
HEIGHT_M: Final = 0.3

PLACES: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {"A": (0.0, 0.5), "B": (-0.2, 0.25), "C": (0.2, 0.75)}
)
"""Centre of the pattern, as shares of the workspace: off its middle, and up from its floor."""

_PATTERN: Final = (
    (0.25, 0.5), (0.5, 0.5), (0.5, -0.5), (0.25, -0.5), (0.0, 0.0),
    (-0.25, 0.5), (-0.5, 0.5), (-0.5, -0.5), (-0.25, -0.5), (0.0, 0.0),
)  # fmt: skip


def plane_of(k: int) -> tuple[int, int]:
    """Return which of a platform's k coordinates the pattern lies in: x, and the upward one."""
    return 0, k - 1


def place_of(directions: Directions, in_plane_m: FloatArray) -> FloatArray:
    """Return the platform's place (d,) at a point (2,) of the pattern's plane."""
    place = directions.middle.copy()
    place[list(plane_of(directions.k))] = in_plane_m
    return place


def centre_m(robot: Robot, place: str) -> FloatArray:
    """Return where the pattern's centre, start and end, lies at a place, (2,).

    Raises BadInputError where the robot's workspace has no room for the pattern there.
    """
    directions = Directions.of(platform_of(robot))
    if place not in PLACES:
        raise BadInputError(f"place: value {place!r}; allowed: {', '.join(PLACES)}")
    plane = list(plane_of(directions.k))
    low, high = directions.low_m[plane], directions.high_m[plane]
    across, up = PLACES[place]
    size = high - low
    centre = np.array([0.5 * (low[0] + high[0]) + across * size[0], low[1] + up * size[1]])
    half = 0.5 * np.array([WIDTH_M, HEIGHT_M])
    if np.any(centre - half < low) or np.any(centre + half > high):
        raise BadInputError(
            f"{robot.path}: [platform] workspace_min_m, workspace_max_m: "
            f"{low.tolist()} to {high.tolist()} m; place {place} of the pattern needs "
            f"{(centre - half).tolist()} to {(centre + half).tolist()} m"
        )
    return centre


def targets_m(centre: FloatArray) -> FloatArray:
    """Return the targets in their order, (10, 2), of the pattern about `centre` (2,)."""
    return np.asarray(centre + np.array(_PATTERN) * (WIDTH_M, HEIGHT_M))
