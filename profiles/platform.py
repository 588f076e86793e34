"""The platform of a cable robot and where its cables run: what makes winches a robot."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated

from pydantic import AfterValidator, Field

from profiles.reader import Profile

FURTHEST_m = 1000.0
"""Beyond this no robot reaches."""


def _in_metres(value: float) -> float:
    if abs(value) > FURTHEST_m:
        raise ValueError(f"value {value:g}; allowed: -{FURTHEST_m:g} to {FURTHEST_m:g}, in metres")
    return value


_Coordinate = Annotated[float, AfterValidator(_in_metres)]
Point = Annotated[tuple[_Coordinate, ...], Field(min_length=2, max_length=3)]
_FEWEST = {2: 3, 3: 6}


class PlatformFile(Profile):
    """The table [platform] of a robot's file; two coordinates are a vertical plane, y upward.

    All points are in m. Three coordinates are a room, z upward.
    """

    mass_kg: float = Field(gt=0, le=10_000)
    home_m: Point
    """Where its origin is at rest, on its stand: when the robot is started, and at its end."""
    home_tolerance_m: float = Field(default=0.05, gt=0, le=1)
    """How far from there it may really be."""
    workspace_min_m: Point
    workspace_max_m: Point
    """The box in which targets may lie."""
    speed_m_s: float = Field(gt=0, le=20)
    acceleration_m_s2: float = Field(gt=0, le=100)
    """Along each direction."""


@dataclass(frozen=True)
class Platform:
    """A platform on the cables of a robot's axes; points in the order of the axes.

    `exit_points_m` are in the room, `anchor_points_m` in the platform's frame, whose origin is what
    `home_m` and targets speak of.
    """

    mass_kg: float
    home_m: tuple[float, ...]
    home_tolerance_m: float
    workspace_min_m: tuple[float, ...]
    workspace_max_m: tuple[float, ...]
    speed_m_s: float
    acceleration_m_s2: float
    exit_points_m: tuple[tuple[float, ...], ...]
    anchor_points_m: tuple[tuple[float, ...], ...]

    @property
    def is_planar(self) -> bool:
        """Whether it moves in a plane."""
        return len(self.home_m) == 2

    @property
    def longest_cable_m(self) -> float:
        """The longest that a cable is with the platform at home or in its box, turned anyhow."""
        corners = product(*zip(self.workspace_min_m, self.workspace_max_m, strict=True))
        ways = product(self.exit_points_m, (*corners, self.home_m))
        return max(math.dist(*way) for way in ways) + max(
            math.hypot(*anchor) for anchor in self.anchor_points_m
        )


def platform_faults(
    file: PlatformFile | None,
    exits: Sequence[tuple[float, ...] | None],
    anchors: Sequence[tuple[float, ...] | None],
) -> Iterator[tuple[str, str]]:
    """Yield (key, problem) for points that are missing, too many, or of another dimension."""
    if file is None:
        for i, points in enumerate(zip(exits, anchors, strict=True)):
            if points != (None, None):
                yield f"axes[{i}]", "exit_point_m, anchor_point_m: allowed: along with [platform]"
        return
    size = len(file.home_m)
    for name, points_m in (("exit_point_m", exits), ("anchor_point_m", anchors)):
        for i, given in enumerate(points_m):
            if given is None:
                yield f"axes[{i}].{name}", "missing; allowed: one for each axis of a platform"
            elif len(given) != size:
                problem = f"{len(given)} coordinates; allowed: {size}, as platform.home_m has"
                yield f"axes[{i}].{name}", problem
    if len(exits) < _FEWEST[size]:
        yield "axes", f"{len(exits)}; allowed: {_FEWEST[size]} and more for a platform"
    yield from _box_faults(file)


def _box_faults(file: PlatformFile) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with the box; the stand may be under it, not beside or above it."""
    size = len(file.home_m)
    for key in ("workspace_min_m", "workspace_max_m"):
        point = getattr(file, key)
        if len(point) != size:
            yield f"platform.{key}", f"{len(point)} coordinates; allowed: {size}, as home_m has"
            return
    box = zip(file.workspace_min_m, file.home_m, file.workspace_max_m, strict=True)
    for i, (low, home, high) in enumerate(box):
        if not low < high:
            yield f"platform.workspace_max_m[{i}]", f"value {high:g}; allowed: above {low:g}"
        elif i == size - 1 and home > high:
            problem = f"value {home:g}; allowed: up to {high:g} (the last coordinate is upward)"
            yield f"platform.home_m[{i}]", problem
        elif i < size - 1 and not low <= home <= high:
            yield f"platform.home_m[{i}]", f"value {home:g}; allowed: {low:g} to {high:g}"
