"""Whether winches of a platform that stands at home can pull more than they rub, and hold ropes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.devices.safety_io import load_safety_io
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.supervision.limits import Limits
from cdpr_rt.robots.feasibility.finding import Finding
from cdpr_rt.robots.platform.learning.motor_learning import (
    COGGING_SHARE,
    FRICTION_SHARE,
    MOST_SHARE,
)
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.standing_tensions import StandingTensions
from cdpr_rt.robots.statics import PlatformStatics, statics_of

_RUBS = 0.6
"""Share of what winches may take up that the pretension is to exceed: 1.3 times what usually turns
a winch without load."""
_RUBS_LITTLE = 0.5
"""Over what winches usually rub with, what some do."""
_TIMES = 1.1 ** np.arange(1, 15)
"""How much higher the highest tensions and torques are tried."""


def stand_findings(robot: Robot, limits: Limits, statics: PlatformStatics) -> Iterator[Finding]:
    """Look whether `tighten` can pull each cable on the stand by more than its winch rubs."""
    arm_m = np.array([abs(axis.winch.cable_m_per_motor_rad) for axis in robot.axes])
    rated_Nm = np.array([axis.winch.motor.rated_torque_Nm for axis in robot.axes])
    taken_up_N = (MOST_SHARE + COGGING_SHARE) * rated_Nm / arm_m
    needed_N = _RUBS * taken_up_N

    def pretension_N(model: PlatformModel, torque_Nm: FloatArray) -> FloatArray:
        planned_N = model.low_N + model.reserve_N
        standing = StandingTensions(model, planned_N, torque_Nm / arm_m, taken_up_N)
        return standing.at(model.home_pose)[0]

    torque_Nm = np.broadcast_to(limits.torque_Nm, arm_m.shape)
    pulled_N = pretension_N(statics.model, torque_Nm)
    weak = pulled_N < needed_N
    if not weak.any():
        return
    i = int((pulled_N / needed_N).argmin())
    names = ", ".join(robot.axes[j].name for j in np.flatnonzero(weak))
    text = (
        f"value {statics.high_N[i]:g}; on its stand the platform lets {names} be pulled with "
        f"{pulled_N[i]:.2g} N at least, and such winches usually rub with up to "
        f"{needed_N[i]:.2g} N: tighten may find cables slack, and end"
    )
    remedy = "winches that rub less, or a home where cables pull less against each other, help"
    for times in _TIMES:
        high_N = times * np.asarray(limits.tension_max_N)
        higher = replace(limits, tension_max_N=high_N, torque_Nm=times * torque_Nm)
        if (pretension_N(statics_of(robot, higher).model, times * torque_Nm) >= needed_N).all():
            most_Nm = float(np.max(high_N * arm_m))
            remedy = f"enough: {np.max(high_N):.0f}, which is {most_Nm:.2g} Nm at the motor; or "
            remedy += "winches that rub less"
            break
    yield Finding("limits.tension_max_N", f"{text}; {remedy}", impossible=False)


def unwinding(robot: Robot, statics: PlatformStatics) -> Iterator[Finding]:
    """Look whether slack cables may turn their drums without power by their own weight.

    A slack cable pulls at its exit with the weight of a piece as long as that is above its anchor.
    """
    platform = statics.platform
    hangs_N = 2.0 * np.maximum(statics.rises_N(np.array(platform.home_m)), 0.0)
    winches = [axis.winch for axis in robot.axes]
    rated_N = np.array([w.motor.rated_torque_Nm / abs(w.cable_m_per_motor_rad) for w in winches])
    rubs_N = _RUBS_LITTLE * FRICTION_SHARE * rated_N
    unwinds = (hangs_N > rubs_N) & ~_braked(robot)
    if not unwinds.any():
        return
    i = int(np.where(unwinds, hangs_N / rubs_N, 0.0).argmax())
    names = ", ".join(robot.axes[j].name for j in np.flatnonzero(unwinds))
    text = (
        f"without power the weight of a slack cable, up to {hangs_N[i]:.2g} N, may unwind the "
        f"drums of {names}, which may rub with no more than {rubs_N[i]:.2g} N; a brake for each "
        "(safety_io) keeps them"
    )
    yield Finding(f"axes[{i}].winch", text, impossible=False)


def _braked(robot: Robot) -> BoolArray:
    """Return which axes have a brake on the safety I/O, (n,)."""
    points = () if robot.safety_io is None else load_safety_io(robot.safety_io).axes
    nodes = {point.node_id for point in points if point.brake is not None}
    return np.array([axis.node_id in nodes for axis in robot.axes])
