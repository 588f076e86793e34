"""The baseline loop under a platform: the same bus work, its control in plain NumPy and SciPy.

It begins as one does at home: tensions are raised slowly until the cables are tight, and their
lengths taken for those at home. Then the platform goes to and fro through the middle of its box.

Run as a program, with the argument and the output of `loop_baseline`, and "robot" besides.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from cdpr_profiles import load_robot
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.robots.feasibility.checks import LONGEST_PERIOD_s
from cdpr_rt.robots.platform.design.loop_gains import LoopGains
from cdpr_tools.bench.control.baseline import BaselineCableControl
from cdpr_tools.bench.control.measure import controls
from cdpr_tools.bench.daemon.loop_baseline import BaselineLoop, run

_TIGHTEN_S, _GO_S, _ROUND_S = 3.0, 4.0, 4.0
_CARRIED, _BOX_SHARE = 0.5, 0.25
_CALMING_1_s = 40.0
"""Damping of a motor that takes up slack, over its inertia."""


class PoseBaseline(BaselineLoop):
    """Control of a platform's pose, as `BaselineCableControl` computes it."""

    warm_up_s = _TIGHTEN_S + _GO_S + 1.0

    def __init__(self, given: Mapping[str, Any]) -> None:
        super().__init__(given)
        # no loop is designed for longer cycles: gains are less by as much as this one is longer
        robot, designed_s = load_robot(given["robot"]), min(self.period_s, LONGEST_PERIOD_s)
        ours, _ = controls(replace(robot, sync_period_s=designed_s))
        gains = _weaker(ours.gains, designed_s / self.period_s)
        axes, torque_Nm = list(robot.axes), ours.torque_Nm
        self.pose = BaselineCableControl(ours.model, axes, torque_Nm, self.period_s, gains)
        model, platform = ours.model, ours.model.platform
        self.feedback, self.setpoint = AxisFeedback(self.n), Setpoint(self.n)
        self.pretension_N, self.tight_rad = np.zeros((2, self.n))
        W = model.kinematics.wrench_matrix(model.home_pose)
        least = model.least_tensions(ours.low_N, ours.high_N)
        least.solve(W, _CARRIED * model.weight(), self.pretension_N)
        self.lengths_m = ours.lengths_at_home(self.pretension_N)
        box = np.array([platform.workspace_min_m, platform.workspace_max_m])
        turns = np.zeros(model.size - model.positions)
        self.middle = np.concatenate([box.mean(axis=0), turns])
        self.half = np.concatenate([_BOX_SHARE * (box[1] - box[0]), turns])
        self.tight = False

    def control(self, k: int, _start: Any, _speed_rad_s: float) -> None:
        """Tighten, then follow the set-point of this cycle; no torque where a limit is exceeded."""
        t, torque, pose = k * self.period_s, np.zeros(self.n), self.pose
        if t < _TIGHTEN_S:
            pull = self.pretension_N * min(2.0 * t / _TIGHTEN_S, 1.0)
            torque = -pose.c * pull - _CALMING_1_s * pose.rotor * self.velocity
            self.command(k, self.position, torque)
            return
        if not self.tight:
            self.tight, self.tight_rad = True, np.array(self.position)
            pose.begin(self.lengths_m)
            self.home = np.array(pose.position)
        self._lead(t - _TIGHTEN_S)
        self.feedback.position_rad[:] = self.position - self.tight_rad
        pose.update(self.feedback, self.setpoint, torque)
        self.command(k, self.setpoint.position_rad + self.tight_rad, torque)

    def _lead(self, t: float) -> None:
        """Write the set-point `t` seconds after the cables were tight."""
        begin, way, round_s = self.home, self.middle - self.half - self.home, 2.0 * _GO_S
        if t >= _GO_S:
            t, begin, way, round_s = t - _GO_S, self.middle - self.half, 2.0 * self.half, _ROUND_S
        pace = 2.0 * math.pi / round_s
        self.pose.position = begin + 0.5 * way * (1.0 - math.cos(pace * t))
        self.pose.velocity = 0.5 * way * pace * math.sin(pace * t)
        self.pose.acceleration = 0.5 * way * pace**2 * math.cos(pace * t)


def _weaker(gains: LoopGains, share: float) -> LoopGains:
    return replace(
        gains,
        bandwidth_rad_s=share * gains.bandwidth_rad_s,
        damping_N_s_m=share * gains.damping_N_s_m,
        null_damping_N_s_m=share * gains.null_damping_N_s_m,
    )


if __name__ == "__main__":
    print(json.dumps(run(json.loads(sys.argv[1]), PoseBaseline)))
