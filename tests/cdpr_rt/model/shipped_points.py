"""The points of two shipped robots: Tremblay (thesis), table D.1; CoGiRo as published."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.pose import Pose


class Points(NamedTuple):
    """Exit and anchor points (n, 3), and the middle of the room between them."""

    exit_points_m: FloatArray
    anchor_points_m: FloatArray
    home: Pose


def _points(name: str, home_m: tuple[float, float, float]) -> Points:
    platform = load_robot(name).platform
    assert platform is not None
    return Points(
        np.array(platform.exit_points_m), np.array(platform.anchor_points_m), Pose(np.array(home_m))
    )


SPATIAL_8 = _points("spatial-8", (0.0, 0.0, 1.8))
COGIRO = _points("suspended-8", (0.0, 0.0, 2.375))
