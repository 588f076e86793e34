"""Poses at random in a box, for images without a robot."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cdpr_sim_bus.physics_board import PlatformState
from cdpr_sim_bus.robot.logs.platform_record import rotation_of

_STILL = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Box:
    """Where a platform may be, and how far it may be turned about any axis."""

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    turn_deg: float


def random_poses(box: Box, count: int, seed: int) -> Iterator[PlatformState]:
    """Yield platforms at rest: positions evenly in the box, rotations up to its angle."""
    chance = np.random.default_rng([seed, 13])
    for k in range(count):
        position = chance.uniform(box.low_m, box.high_m)
        axis = chance.standard_normal(3)
        turn = axis / np.linalg.norm(axis) * chance.uniform(0.0, math.radians(box.turn_deg))
        yield PlatformState(
            *(float(k), tuple(position.tolist()), tuple(rotation_of(turn).ravel().tolist())),
            *(_STILL, _STILL),
        )
