"""What one cycle of a platform's control costs, beside the same in plain NumPy and SciPy."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.errors import GeometryError
from cdpr_rt.robots.platform.cable_control import CableControl
from cdpr_rt.robots.platform_model import platform_model_of
from cdpr_rt.robots.robot_arrays import limits_of
from cdpr_tools.bench.control.baseline import BaselineCableControl
from cdpr_tools.bench.timing import verdict
from cdpr_tools.output import Output

TARGET_RATIO, TARGET_us = 20.0, 100.0
"""Least ratio of the baseline's median cost to ours, and most of ours at p99."""
_BLOCK = 500
_PERCENTILES = {"p50": 50.0, "p99": 99.0, "worst": 100.0}
_ROUND_S = 4.0
_NOISE_rad = 3e-4


def measure(name: str, cycles: int, out: Output) -> dict[str, Any]:  # noqa: ARG001  # as all have it
    """Run both for `cycles` cycles in blocks that take turns and return the figures.

    Both are given the same set-points and the same angles of the motors, with the encoders' noise;
    `difference_Nm` is how far their torques are apart at most. Raises GeometryError for a robot
    without a platform, or one that the baseline cannot compute.
    """
    robot = load_robot(name)
    ours, baseline = controls(robot)
    motion = PeriodicMotion(robot, ours, cycles + _BLOCK)
    spent: dict[str, list[int]] = {"ours": [], "obvious": []}
    difference = 0.0
    for first in range(0, cycles + _BLOCK, _BLOCK):
        taken, torques = run_block(ours, motion, first, _BLOCK)
        taken_too, torques_too = run_block(baseline, motion, first, _BLOCK)
        difference = max(difference, float(np.abs(torques - torques_too).max()))
        if first > 0:  # the first block warms both up
            spent["ours"] += taken
            spent["obvious"] += taken_too
    figures: dict[str, Any] = {
        way: {key: float(np.percentile(ns, q)) / 1e3 for key, q in _PERCENTILES.items()}
        for way, ns in spent.items()
    }
    ratio = figures["obvious"]["p50"] / figures["ours"]["p50"]
    return {
        "robot": name,
        "cables": len(robot.axes),
        "directions": ours.model.size,
        "cycles": len(spent["ours"]),
        "update_us": figures,
        "obvious_over_ours": ratio,
        "targets": {"ratio": TARGET_RATIO, "p99_us": TARGET_us},
        "reached": {
            "ratio": ratio >= TARGET_RATIO,
            "p99_us": figures["ours"]["p99"] <= TARGET_us,
        },
        "difference_Nm": difference,
    }


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as a table, a line for each implementation."""
    lines = [
        f"{figures['robot']}: {figures['cables']} cables, {figures['directions']} directions, "
        f"{figures['cycles']} updates of each",
        f"{'update of one cycle, us':32}{'p50':>10}{'p99':>10}{'worst':>10}",
    ]
    for name, text in (("ours", "ours, compiled"), ("obvious", "the same in NumPy and SciPy")):
        us = figures["update_us"][name]
        lines.append(f"{text:32}{us['p50']:10.1f}{us['p99']:10.1f}{us['worst']:10.1f}")
    targets, reached = figures["targets"], figures["reached"]
    return [
        *lines,
        f"NumPy / ours at p50: {figures['obvious_over_ours']:.1f}, wanted at least "
        f"{targets['ratio']:g}: {verdict(reached['ratio'])}",
        f"ours at p99, wanted at most {targets['p99_us']:g} us: {verdict(reached['p99_us'])}",
        f"torques differ by at most {figures['difference_Nm']:.1e} Nm",
    ]


def controls(robot: Robot) -> tuple[CableControl, BaselineCableControl]:
    """Return both controls of a robot, its platform standing in the middle of its box."""
    if robot.platform is None:
        raise GeometryError(f"{robot.path}: {NO_PLATFORM}")
    model, axes, n = platform_model_of(robot), list(robot.axes), len(robot.axes)
    torque_Nm = np.broadcast_to(limits_of(robot).torque_Nm, (n,)).astype(float)
    ours = CableControl(model, axes, torque_Nm, robot.sync_period_s)
    baseline = BaselineCableControl(model, axes, torque_Nm, robot.sync_period_s, ours.gains)
    lengths = model.kinematics.lengths(model.pose(_middle(ours)))
    feedback = AxisFeedback(n)
    ours.take_lengths(lengths, feedback)
    ours.begin(feedback)
    ours.stand_still()
    baseline.begin(lengths)
    return ours, baseline


class PeriodicMotion:
    """A platform that goes round and round from the middle of its box: arrays over k cycles."""

    def __init__(self, robot: Robot, control: CableControl, cycles: int) -> None:
        model = control.model
        d, k = model.size, model.positions
        # a figure that begins and ends at rest, at half the robot's acceleration at most
        pace = 2.0 * math.pi / _ROUND_S * np.array([1.0, 2.0, 1.0, 1.0, 2.0, 1.0])[:d]
        platform = model.platform
        box = np.subtract(platform.workspace_max_m, platform.workspace_min_m)
        most = np.concatenate([0.2 * box, np.full(d - k, 0.3 * model.angle_rad)])
        half = np.minimum(most, 0.5 * model.acceleration / pace**2)
        t = robot.sync_period_s * np.arange(1, cycles + 1)[:, None]
        self.position = _middle(control) + half * (1.0 - np.cos(pace * t))
        self.velocity = half * pace * np.sin(pace * t)
        self.acceleration = half * pace**2 * np.cos(pace * t)
        cable = np.array([axis.winch.cable_m_per_motor_rad for axis in robot.axes])
        noise = np.random.default_rng(1).normal(0.0, _NOISE_rad, (cycles, len(cable)))
        lengths = np.array([model.kinematics.lengths(model.pose(q)) for q in self.position])
        start = model.kinematics.lengths(model.pose(_middle(control)))
        self.angle_rad = (lengths - start) / cable + noise


def run_block(
    control: CableControl | BaselineCableControl, motion: PeriodicMotion, first: int, cycles: int
) -> tuple[list[int], FloatArray]:
    """Run a part of the motion; return what each update took, ns, and the torques (cycles, n)."""
    n = motion.angle_rad.shape[1]
    feedback, setpoint, torque = AxisFeedback(n), Setpoint(n), np.zeros(n)
    spent, torques = [], np.zeros((cycles, n))
    for k in range(cycles):
        row = first + k
        control.position[:] = motion.position[row]
        control.velocity[:] = motion.velocity[row]
        control.acceleration[:] = motion.acceleration[row]
        feedback.position_rad[:] = motion.angle_rad[row]
        begun = time.perf_counter_ns()
        control.update(feedback, setpoint, torque)
        spent.append(time.perf_counter_ns() - begun)
        torques[k] = torque
    return spent, torques


def _middle(control: CableControl) -> FloatArray:
    platform = control.model.platform
    middle = 0.5 * np.add(platform.workspace_min_m, platform.workspace_max_m)
    return np.concatenate([middle, np.zeros(control.model.size - len(middle))])
