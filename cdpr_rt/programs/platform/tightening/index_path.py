"""A path of the platform on which every motor passes its index."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.interface import RobotModel

_TURNS = 1.05
"""What each motor must turn, with a margin over one turn."""
_STEPS = 16


def index_path(
    model: RobotModel, cable_m: FloatArray, feasible: Callable[[FloatArray], bool]
) -> list[FloatArray]:
    """Return positions (d,) to go to one after the other from home, each motor turning once.

    Straight up as far as needed, then to the sides, not turned; all of it within the workspace and
    where `feasible` says so. `cable_m` (n,) is paid out per radian.
    """
    platform, kinematics, k = model.platform, model.kinematics, model.positions
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    home, unturned = model.home, np.zeros(model.size - k)
    needed_m = _TURNS * math.tau * np.abs(cable_m)
    shortest = longest = kinematics.lengths(model.pose(home))
    path: list[FloatArray] = []
    sides = itertools.product(*np.stack([low, high])[:, :-1].T)
    for aside in (home[: k - 1], *map(np.array, sides)):
        target = np.array([*aside, high[-1], *unturned])
        start = path[0] if path else home
        for step in range(1, _STEPS + 1):
            there = start + step / _STEPS * (target - start)
            inside = bool((there[:k] >= low).all()) or not path
            if not inside or not feasible(there):
                break
            rho = kinematics.lengths(model.pose(there))
            shortest, longest = np.minimum(shortest, rho), np.maximum(longest, rho)
            enough = bool((longest - shortest >= needed_m).all())
            if enough or step == _STEPS or not feasible(there + (target - start) / _STEPS):
                path.append(there)
                break
        if (longest - shortest >= needed_m).all():
            break
    return path
