"""Whether a plan's samples keep a robot's limits and are held; for a thread beside the loop's."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.programs.platform.paths import path_playback as playback
from cdpr_rt.robots.interface import RobotModel

_AT_ONCE: Final = 100
"""Samples that are looked at in one go: a kernel does not let the loop's thread in meanwhile."""
_HELD_EVERY: Final = 20
"""Of these samples one is looked at for whether the cables hold it."""
_HELD_AT_ONCE: Final = 10


def first_fault(model: RobotModel, samples: FloatArray, period_s: float) -> int:
    """Return the first of the samples (c, 3, d) that breaks the robot's limits, -1 for none.

    Of place, speed and acceleration, there and between; then whether cables hold it at rest.
    """
    platform = model.platform
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    limits = (model.speed, model.acceleration, model.jerk, low, high, model.angle_rad)
    for begin in range(0, len(samples), _AT_ONCE):
        bad = playback.first_fault(samples, begin, begin + _AT_ONCE, period_s, *limits)
        if bad >= 0:
            return int(bad)
    held = model.workspace(0.0)
    chosen = samples[::_HELD_EVERY, 0]
    for begin in range(0, len(chosen), _HELD_AT_ONCE):
        poses = model.poses(chosen[begin : begin + _HELD_AT_ONCE])
        slack = held.capacity_margins(poses, 0.0) < 0.0
        if slack.any():
            return _HELD_EVERY * (begin + int(slack.argmax()))
    return -1
