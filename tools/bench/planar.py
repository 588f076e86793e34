"""What one cycle of the planar robot's control costs, beside the same in plain NumPy."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.robots.planar_control import PlanarControl
from cdpr_rt.robots.planar_kinematics import GeometryError
from profiles import Robot, load_robot
from profiles.platform import Platform
from tools.bench.planar_obvious import ObviousPlanarControl

ROBOT = "planar-3"
TARGET_RATIO = 10.0
"""By how much the obvious way is wanted to cost more."""
_BLOCK = 500
_PERCENTILES = {"p50": 50.0, "p99.9": 99.9, "worst": 100.0}
_ROUND_S, _WIDTH_m = 4.0, 0.4
_NOISE_rad = 3e-4


def measure(cycles: int) -> dict[str, Any]:
    """Run both for `cycles` cycles in blocks that take turns and return the figures.

    Both are given the same set-points and the same angles of the motors, with the encoders' noise;
    `difference_Nm` is how far their torques are apart at most.
    """
    robot = load_robot(ROBOT)
    ours, obvious = planar_controls(robot)
    motion = Motion(robot, ours, cycles + _BLOCK)
    spent: dict[str, list[int]] = {"ours": [], "obvious": []}
    difference = 0.0
    for first in range(0, cycles + _BLOCK, _BLOCK):
        taken, torques = run_block(ours, motion, first, _BLOCK)
        taken_too, torques_too = run_block(obvious, motion, first, _BLOCK)
        difference = max(difference, float(np.abs(torques - torques_too).max()))
        if first > 0:  # the first block warms both up
            spent["ours"] += taken
            spent["obvious"] += taken_too
    figures: dict[str, Any] = {
        name: {key: float(np.percentile(ns, q)) / 1e3 for key, q in _PERCENTILES.items()}
        for name, ns in spent.items()
    }
    ratio = figures["obvious"]["p50"] / figures["ours"]["p50"]
    return {
        "robot": ROBOT,
        "cycles": len(spent["ours"]),
        "update_us": figures,
        "obvious_over_ours": ratio,
        "target": TARGET_RATIO,
        "reached": ratio >= TARGET_RATIO,
        "difference_Nm": difference,
    }


def planar_controls(robot: Robot) -> tuple[PlanarControl, ObviousPlanarControl]:
    """Return both controls of a planar robot, its platform standing in the middle of its box."""
    platform = _platform(robot)
    control = PlanarControl(
        platform,
        list(robot.axes),
        np.full(3, 20.0),
        np.full(3, 150.0),
        np.full(3, 4.5),
        robot.sync_period_s,
    )
    feedback = AxisFeedback(3)
    control.take_lengths(_lengths(platform, _middle(platform)), feedback)
    control.begin(feedback)
    control.stand_still()
    return control, ObviousPlanarControl(platform, robot.axes, control)


class Motion:
    """A platform that goes round and round from the middle of its box: arrays over k cycles."""

    def __init__(self, robot: Robot, control: PlanarControl, cycles: int) -> None:
        platform = _platform(robot)
        omega = 2.0 * math.pi / _ROUND_S
        t = robot.sync_period_s * np.arange(1, cycles + 1)[:, None]
        pace = omega * np.array([1.0, 2.0])  # a figure that begins and ends at rest
        half = 0.5 * _WIDTH_m
        self.position_m = _middle(platform) + half * (1.0 - np.cos(pace * t))
        self.velocity_m_s = half * pace * np.sin(pace * t)
        self.acceleration_m_s2 = half * pace**2 * np.cos(pace * t)
        cable = np.array([axis.winch.cable_m_per_motor_rad for axis in robot.axes])
        start = control.free_lengths_at_zero_m
        noise = np.random.default_rng(1).normal(0.0, _NOISE_rad, (cycles, 3))
        lengths = np.array([_lengths(platform, p) for p in self.position_m])
        self.angle_rad = (lengths - start) / cable + noise


def run_block(
    control: PlanarControl | ObviousPlanarControl, motion: Motion, first: int, cycles: int
) -> tuple[list[int], FloatArray]:
    """Run a part of the motion; return what each update took, ns, and the torques (cycles, 3)."""
    feedback, setpoint, torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
    spent, torques = [], np.zeros((cycles, 3))
    for k in range(cycles):
        row = first + k
        control.position_m[:] = motion.position_m[row]
        control.velocity_m_s[:] = motion.velocity_m_s[row]
        control.acceleration_m_s2[:] = motion.acceleration_m_s2[row]
        feedback.position_rad[:] = motion.angle_rad[row]
        begun = time.perf_counter_ns()
        control.update(feedback, setpoint, torque)
        spent.append(time.perf_counter_ns() - begun)
        torques[k] = torque
    return spent, torques


def _platform(robot: Robot) -> Platform:
    if robot.platform is None:
        raise GeometryError(f"{robot.name}: no [platform]; allowed: a planar robot's")
    return robot.platform


def _middle(platform: Platform) -> FloatArray:
    return 0.5 * np.add(platform.workspace_min_m, platform.workspace_max_m)


def _lengths(platform: Platform, position_m: FloatArray) -> FloatArray:
    ways = position_m + np.array(platform.anchor_points_m) - np.array(platform.exit_points_m)
    return np.asarray(np.linalg.norm(ways, axis=1))
