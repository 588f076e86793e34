"""Kinds of cable robots that `cdpr robot new` describes; a shipped robot is the pattern of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.platform import Platform

KINDS = {
    "planar-3": "in a plane, x and y: 3 cables, two to hold and one to pull tight; it turns freely",
    "planar-4": "in a plane, x, y and angle: 4 cables, one more than directions, to pull tight",
    "point-4": "a point in space, x, y, z: 4 cables from above; 3 would do for a small place",
    "suspended-6": "a platform in space on 6 cables from above, as few as its 6 directions take",
    "suspended-8": "a platform in space on 8 cables from above: a larger place, and larger angles",
    "spatial-8": "a platform in space, 8 cables from above and below: pulled tight from all sides",
}
"""By name: what it is, and why it takes so many cables."""
SKETCH = r"""
planar-3       planar-4       point-4        suspended-6, -8   spatial-8
o         o    o         o    o         o    o  o     o  o     o  o     o  o
 \       /      \       /      \       /      \  \   /  /       \  \   /  /
  \#####/        \#####/        \     /         \#####/           \#####/
   #####          #####          \   /           #####             #####
     |           /     \           *                            /  /   \  \
     o          o       o                                       o  o     o  o
"""
"""What they look like: o winches, # platforms."""
_BUS_DRIVES = 4
"""What a bus of 1 Mbit/s carries at 1 kHz."""
_APART_m = 0.15
"""Least distance of two exit points that are proposed: two winches side by side."""


@dataclass(frozen=True)
class RobotKind:
    """A kind of robot, with the shipped robot whose figures are its defaults."""

    name: str
    robot: Robot
    platform: Platform

    @property
    def cables(self) -> int:
        """How many cables it has."""
        return len(self.robot.axes)

    @property
    def size(self) -> int:
        """How many coordinates a point has."""
        return len(self.platform.home_m)

    @property
    def buses(self) -> int:
        """How many buses its drives take."""
        return -(-self.cables // _BUS_DRIVES)

    @property
    def is_point(self) -> bool:
        """Whether all its cables meet in one point."""
        return len(set(self.platform.anchor_points_m)) == 1

    @property
    def controls_angles(self) -> bool:
        """Whether its cables control angles."""
        return len(self.platform.controlled) > self.size

    @property
    def turns_freely(self) -> bool:
        """Whether its platform has angles, and its cables control none of them."""
        return not self.controls_angles and not self.is_point

    @property
    def sides(self) -> str:
        """What the numbers of a frame's size are."""
        return "width, height" if self.size == 2 else "width, depth, height"

    @property
    def frame_m(self) -> tuple[float, ...]:
        """Size of its frame: what exit points span, upward from the floor."""
        exits = np.array(self.platform.exit_points_m)
        spans = exits.max(axis=0) - exits.min(axis=0)
        return (*(float(span) for span in spans[:-1]), float(exits[:, -1].max()))

    @property
    def side_m(self) -> float:
        """Greatest distance of two anchor points."""
        return max(math.dist(*pair) for pair in combinations(self.platform.anchor_points_m, 2))

    def exits_m(self, frame_m: tuple[float, ...]) -> list[tuple[float, ...]]:
        """Return the exit points with the frame stretched to another size, to the mm.

        Where two would come too near to each other, they go apart within the frame.
        """
        exits = np.array(self.platform.exit_points_m) * np.array(frame_m) / self.frame_m
        low, high = exits.min(axis=0), exits.max(axis=0)
        for i, j in combinations(range(self.cables), 2):
            way = exits[j] - exits[i]
            if (distance := float(np.linalg.norm(way))) < _APART_m:
                pair = 0.5 * (exits[i] + exits[j]) + np.outer([-0.5, 0.5], way) * (
                    _APART_m / distance
                )
                pair += np.maximum(low - pair.min(axis=0), 0.0)
                exits[[i, j]] = pair + np.minimum(high - pair.max(axis=0), 0.0)
        return [tuple(round(float(x), 3) + 0.0 for x in point) for point in exits]

    def scale(self, frame_m: tuple[float, ...]) -> float:
        """Return how much larger the frame is than the shipped robot's, by its least stretch."""
        return min(size_m / usual_m for size_m, usual_m in zip(frame_m, self.frame_m, strict=True))


def kind_of(name: str) -> RobotKind:
    """Return the kind of this name, one of KINDS."""
    robot = load_robot(name)
    assert robot.platform is not None
    return RobotKind(name, robot, robot.platform)
