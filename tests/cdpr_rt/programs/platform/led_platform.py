"""A platform that is where its set-point is, and a hand that leads it."""

from __future__ import annotations

import numpy as np

from cdpr_profiles import load_robot
from cdpr_profiles.platform import Platform
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.shared_block import SAMPLE, SharedBlock
from cdpr_rt.motion.pose_stream import PoseStream
from cdpr_rt.programs.platform.platform_program import PlatformParts
from cdpr_rt.programs.platform.pose import PoseProgram
from cdpr_rt.robots.platform.cable_control import CableControl
from cdpr_rt.robots.platform_model import platform_model
from cdpr_rt.robots.robot_arrays import winches_of
from tests.cdpr_rt.programs.ideal_platform import SteppedPlatform

PERIOD_S = 1e-3
ROBOT = load_robot("planar-3")
SPEED_m_s, ACCELERATION_m_s2 = 0.5, 2.0


class LedPlatform(SteppedPlatform):
    """A platform that is where its set-point is, and a hand whose packets come at once."""

    def __init__(self, platform: Platform | None = None) -> None:
        self.platform = platform or ROBOT.platform
        assert self.platform is not None
        model = platform_model(self.platform, np.full(3, 20.0), np.full(3, 150.0))
        axes = list(ROBOT.axes)
        self.control = CableControl(model, axes, np.full(3, 4.5), PERIOD_S)
        self.parts = PlatformParts(
            model, self.control, Estimator(3, PERIOD_S, winches_of(axes)), PERIOD_S
        )
        self.block = SharedBlock.create(3, 1.0, 1000.0)
        self.program = PoseProgram(self.parts, np.full(3, 4.5), PoseStream(self.block, PERIOD_S))
        self.feedback, self.setpoint, self.torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
        self.feedback.valid[:] = True
        self.sample = np.zeros((), SAMPLE)
        self.sample["quaternion"], self.sample["session"] = (1.0, 0.0, 0.0, 0.0), 1
        self.restart()

    def restart(self, position_m: np.ndarray | None = None) -> None:
        """Begin anew, in the middle of the box or elsewhere."""
        assert self.platform is not None
        middle = 0.5 * np.add(self.platform.workspace_min_m, self.platform.workspace_max_m)
        middle = middle if position_m is None else position_m
        ways = middle + np.array(self.platform.anchor_points_m) - self.platform.exit_points_m
        self.feedback.position_rad[:] = 0.0
        self.parts.estimator.set_lengths(np.zeros(3), np.linalg.norm(ways, axis=1))
        self.parts.estimator.update(self.feedback)
        self.parts.cycle = -2
        self.parts.tight = True
        self.program.start(self.feedback, self.setpoint, self.torque)
        self.control.setpoint.stand_at(middle)
        self.program.command({})
        self.stretch_rad = np.zeros(3)
        self.path = [self.control.position.copy()]
        self.paces = [np.zeros(2)]
        self.shaped = [self.control.shaped.copy()]
        self.now_ms = 0

    def cycle(self) -> None:
        self.feedback.cycle += 1
        self.now_ms += 1
        self.program.update(self.feedback, self.setpoint, self.torque)
        self.feedback.position_rad[:] = self.setpoint.position_rad + self.stretch_rad
        self.path.append(self.control.position.copy())
        self.paces.append(self.control.velocity.copy())
        self.shaped.append(self.control.shaped.copy())

    def post(self, x: float, y: float, scale: float = 1.0, buttons: int = 0) -> None:
        """Post where the hand is now."""
        self.sample["sequence"] += 1
        self.sample["sent_ns"] = 1_000_000 * self.now_ms
        self.sample["position_m"] = (x, y, 0.0)
        self.sample["scale"], self.sample["buttons"] = scale, buttons
        self.block.post_sample(self.sample[()])

    def lead(self, hand: np.ndarray, scale: float = 1.0, buttons: int = 0, each: int = 20) -> None:
        """Move the hand along positions (k, 2), one every `each` cycles."""
        for x, y in hand:
            self.post(float(x), float(y), scale, buttons)
            for _ in range(each):
                self.cycle()

    def check_motion(self) -> None:
        """Nothing steps: velocity and acceleration keep their bounds, in the shaped motion too."""
        paces = np.array(self.paces)
        assert np.abs(paces).max() <= SPEED_m_s * (1 + 1e-9)
        most = ACCELERATION_m_s2 * PERIOD_S
        assert np.abs(np.diff(paces, axis=0)).max() <= most * (1 + 1e-9) + 1e-12
        shaped = np.diff(np.array(self.shaped), axis=0) / PERIOD_S
        assert np.abs(shaped).max() <= SPEED_m_s * (1 + 1e-6)
        assert np.abs(np.diff(shaped, axis=0)).max() <= most * (1 + 1e-6)
