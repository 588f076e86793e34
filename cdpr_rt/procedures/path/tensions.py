"""The tensions that a planned path takes, by the robot's own distribution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.motion.path.time_scaling import TimedPath
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.rigid_body import G_m_s2
from cdpr_rt.robots.wrenches.path_wrenches import InertialWrenches

_MOST: Final = 20_000


@dataclass(frozen=True)
class PathTensions:
    """Tensions at some of a plan's samples, evenly chosen where there are too many."""

    sample: IntArray
    """Which, (m,)."""
    tension_N: FloatArray
    """(m, n)"""
    low_N: FloatArray
    """Bounds that are planned with: the file's, with the control's reserve, (n,)."""
    high_N: FloatArray
    carried: BoolArray
    """Whether tensions are within these bounds, (m,)."""


def path_tensions(model: PlatformModel, timed: TimedPath) -> PathTensions:
    """Return the tensions along a plan, within what the motors' torque leaves."""
    step = -(-len(timed.samples) // _MOST)
    chosen = np.arange(0, len(timed.samples), step)
    q, v, a = (np.ascontiguousarray(timed.samples[chosen, i]) for i in range(3))
    low, high = model.low_N + model.reserve_N, model.torque_limited_N - model.reserve_N
    weight = np.zeros(6)
    weight[model.positions - 1] = -model.platform.mass_kg * G_m_s2
    others = weight[list(model.kinematics.directions)] - InertialWrenches(model, q).of(v, a)
    tension, carried = model.planned_tensions(model.poses(q), others)
    return PathTensions(chosen, tension, low, high, carried)
