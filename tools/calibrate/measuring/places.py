"""Where a calibration takes the platform: poses that tell most, in batches, with short ways."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.robots.platform_model import platform_model_of
from cdpr_rt.robots.reach.reachable import SHARE, Reach
from cdpr_tools.errors import BadInputError
from cdpr_tools.robots.poses.choice import Choose, choose

BATCH = 10
"""Poses after which is looked what they tell."""


@dataclass(frozen=True)
class Places:
    """Places (m, d) in the order in which they tell most, and that from which all are reached."""

    middle: FloatArray
    """(d,); the ways from here to all places, and back, are known to be free and held."""
    chosen: FloatArray

    def batches(self) -> Iterator[FloatArray]:
        """Yield them a batch at a time, each place of it the nearest to the one before."""
        here = self.middle
        scale = np.ptp(self.chosen, axis=0) + 1e-9
        for first in range(0, len(self.chosen), BATCH):
            left = list(self.chosen[first : first + BATCH])
            batch = []
            while left:
                far = [float(np.linalg.norm((place - here) / scale)) for place in left]
                here = left.pop(int(np.argmin(far)))
                batch.append(here)
            yield np.array(batch)


def chosen_places(robot: Robot, count: int, seed: int, by: Choose = Choose.INFORMATION) -> Places:
    """Return `count` places of a robot, reached straight from the middle of its targets.

    Raises BadInputError for a robot of which hardly a place is reached.
    """
    model = platform_model_of(robot)
    platform, k = model.platform, model.positions
    middle = np.array(model.home, float)
    middle[:k] = (np.array(platform.workspace_min_m) + np.array(platform.workspace_max_m)) / 2.0
    middle[k:] = 0.0
    try:
        chosen = choose(Reach(model, middle), count, seed, by, None, SHARE)
    except GeometryError as error:
        raise BadInputError(f"{robot.path}: {error}") from None
    return Places(middle, chosen.positions)
