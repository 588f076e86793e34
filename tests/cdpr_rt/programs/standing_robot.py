"""Winches whose cables end at a fixed platform."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_profiles import load_robot
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.jit import jit
from cdpr_rt.model.robot_arrays import limits_of, winches_of
from cdpr_rt.model.standing_tensions import StandingTensions
from cdpr_rt.programs.base import Program
from cdpr_rt.programs.model import model_of
from cdpr_rt.programs.platform_program import PlatformParts
from cdpr_rt.programs.registry import build_programs, platform_parts, warm_up_programs

PERIOD_S = 1e-3
CABLE_m = np.full(3, -0.026)
COULOMB_Nm = 0.08
STIFFNESS_N_m = 1e4
ROBOT = load_robot("planar-3")
HOME_m = np.array([0.0, 1.3])


def home_pretension_N(parts: PlatformParts) -> np.ndarray:
    model, control = parts.model, parts.control
    most_N = np.full(control.low_N.size, 1e3)
    standing = StandingTensions(model, control.low_N, most_N, control.pull_fit.taken_up_N)
    return standing.at(model.home_pose)[0]


@jit
def _turn(
    torque_Nm: np.ndarray,
    cable_m: np.ndarray,
    slack_m: np.ndarray,
    inertia_kg_m2: float,
    angle: np.ndarray,
    speed: np.ndarray,
    tension_N: np.ndarray,
) -> None:
    """Advance the rotors by a cycle, in ten steps."""
    h = PERIOD_S / 10
    for i in range(angle.size):
        for _ in range(10):
            stretched_m = -(slack_m[i] + cable_m[i] * angle[i])
            tension_N[i] = max(STIFFNESS_N_m * stretched_m, 0.0)
            friction = COULOMB_Nm * math.tanh(speed[i] / 0.2)
            torque = torque_Nm[i] + cable_m[i] * tension_N[i] - friction - 2e-3 * speed[i]
            speed[i] += h / inertia_kg_m2 * torque
            angle[i] += h * speed[i]


class Standing:
    """Three rotors with friction; beyond its slack each cable is a spring."""

    def __init__(self) -> None:
        limits = limits_of(ROBOT)
        axes = ROBOT.axes
        model = model_of(axes, PERIOD_S, [2.3e-3] * 3, limits)
        self.block = SharedBlock.create(3, 1.0, 1000.0)
        self.estimator = Estimator(3, PERIOD_S, winches_of(axes))
        parts = platform_parts(ROBOT, limits, model, self.estimator)
        assert parts is not None
        self.parts = parts
        self.programs = build_programs(model, self.block, parts)
        warm_up_programs(self.programs, 3, parts)
        self.cable_m = model.cable_m_per_rad
        self.inertia = axes[0].winch.motor.rotor_inertia_kg_m2
        self.feedback, self.setpoint, self.torque = AxisFeedback(3), Setpoint(3), np.zeros(3)
        self.feedback.valid[:] = True
        self.angle, self.speed, self.tension_N = np.zeros((3, 3))
        self.slack_m = np.zeros(3)
        self.program: Program = self.programs["hold"]

    def loosen(self, slack_m: tuple[float, float, float]) -> None:
        """Start again without torque, with this slack."""
        self.parts.forget()
        self.estimator.reset()
        self.speed[:] = self.torque[:] = self.tension_N[:] = 0.0
        self.slack_m[:] = np.array(slack_m) - self.cable_m * self.angle
        self.switch("idle")
        self.run(0.05)
        self.switch("hold")

    def switch(self, name: str, wanted: Mapping[str, Any] | None = None) -> None:
        program = self.programs[name]
        program.check(wanted or {})
        program.start(self.feedback, self.setpoint, self.torque)
        program.command(wanted or {})
        self.program = program

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD_S)):
            self.feedback.cycle += 1
            self.feedback.position_rad[:] = np.round(self.angle * 8192 / 6.2832) * 6.2832 / 8192
            self.feedback.torque_Nm[:] = self.torque
            controller = self.program.controller
            self.estimator.update(
                self.feedback,
                motor_loss_Nm=controller.motor_loss_Nm,
                cogging_Nm=controller.cogging_Nm,
            )
            self.program.update(self.feedback, self.setpoint, self.torque)
            _turn(
                self.torque, self.cable_m, self.slack_m, self.inertia,
                self.angle, self.speed, self.tension_N,
            )  # fmt: skip

    def until_done(self, within_s: float) -> dict[str, Any]:
        for _ in range(round(within_s / 0.1)):
            self.run(0.1)
            told = self.program.progress()
            if told["done"] or told.get("trouble"):
                return told
        raise AssertionError(f"not done within {within_s} s: {told}")
