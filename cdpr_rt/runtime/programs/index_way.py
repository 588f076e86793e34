"""A way on which every motor of a platform passes its index."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.robots.planar_kinematics import PlanarGeometry
from profiles.platform import Platform

_MORE = 1.05
"""Than a turn of each motor."""
_STEPS = 16


def index_way(
    platform: Platform, cable_m: FloatArray, may_stand: Callable[[FloatArray], bool]
) -> list[FloatArray]:
    """Return positions (2,) to go to one after the other from home, each motor turning once.

    Upward as far as it takes, and where that is not enough to the sides as well; nowhere but where
    the platform `may_stand` within its workspace. `cable_m` (n,) is paid out per radian.
    """
    geometry = PlanarGeometry(np.array(platform.exit_points_m), np.array(platform.anchor_points_m))
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    home = np.array(platform.home_m)
    wanted = _MORE * math.tau * np.abs(cable_m)
    shortest = longest = geometry.lengths(home)
    way: list[FloatArray] = []
    top = np.array([home[0], high[1]])
    for target in (top, np.array([low[0], high[1]]), np.array([high[0], high[1]])):
        start = way[0] if way else home
        for k in range(1, _STEPS + 1):
            there = start + k / _STEPS * (target - start)
            inside = bool((there >= low).all()) or not way
            if not inside or not may_stand(there):
                break
            rho = geometry.lengths(there)
            shortest, longest = np.minimum(shortest, rho), np.maximum(longest, rho)
            enough = bool((longest - shortest >= wanted).all())
            if enough or k == _STEPS or not may_stand(there + (target - start) / _STEPS):
                way.append(there)
                break
        if (longest - shortest >= wanted).all():
            break
    return way
