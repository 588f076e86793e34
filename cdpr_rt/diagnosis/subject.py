"""A robot under diagnosis, and findings about its file."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.supervisor import Limits
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.model.statics import statics_of
from cdpr_rt.platform.loop_design import DesignedLoop, designed_loop


@dataclass(frozen=True)
class Finding:
    """A fault or doubt about a key of a robot's file, and the change to make."""

    key: str
    text: str
    impossible: bool
    """Whether the robot cannot work with this file; otherwise it works with a restriction."""
    helps: str = ""
    """Another key, if the text proposes to change it."""


class Subject:
    """A robot with a platform, within `limits`, by default those of its file.

    Data of its winches are arrays over the axes, (n,). Slow results are computed once.
    """

    def __init__(self, robot: Robot, limits: Limits | None = None) -> None:
        assert robot.platform is not None
        self.robot, self.platform, self.axes = robot, robot.platform, robot.axes
        self.n = len(robot.axes)
        self.limits = limits or limits_of(robot)
        self.statics = statics_of(robot, self.limits)
        self.model = self.statics.model
        winches = [axis.winch for axis in robot.axes]
        self.arm_m = np.array([abs(winch.cable_m_per_motor_rad) for winch in winches])
        self.rated_Nm = np.array([winch.motor.rated_torque_Nm for winch in winches])
        self.rated_N = self.rated_Nm / self.arm_m
        """Tensions at the motors' rated torques."""
        self.torque_Nm = np.broadcast_to(self.limits.torque_Nm, (self.n,))
        self.speed_rad_s = np.broadcast_to(self.limits.speed_rad_s, (self.n,))
        self.stiffness_N = np.array([winch.cable.stiffness_N for winch in winches])
        """EA of the cables."""
        self.damping_s = np.array([winch.cable.damping_s for winch in winches])
        rotors = np.array([winch.motor.rotor_inertia_kg_m2 for winch in winches])
        self.rotor_kg = rotors / self.arm_m**2
        """The rotors' inertia, as masses on their cables."""

    @cached_property
    def loop(self) -> DesignedLoop:
        """The loop that is designed for the robot; raises GeometryError."""
        return designed_loop(self.model, self.axes, self.robot.sync_period_s)

    @cached_property
    def corner_targets(self) -> list[tuple[float, ...]]:
        """The targets on a grid that are nearest to the corners of the box of targets."""
        points = self.statics.points()
        targets = points[self.statics.is_target(points)]
        box = zip(self.platform.workspace_min_m, self.platform.workspace_max_m, strict=True)
        corners = itertools.product(*box) if len(targets) else ()
        return list({_nearest(targets, corner): None for corner in corners})


def _nearest(points: FloatArray, place: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(points[np.linalg.norm(points - place, axis=1).argmin()].tolist())


def point_text(position_m: Sequence[float] | FloatArray, digits: int = 2) -> str:
    """Return a position (k,), m, in brackets, to the centimetre or to `digits` digits."""
    # + 0.0: show no -0
    return "(" + ", ".join(f"{round(value, digits) + 0.0:.{digits}f}" for value in position_m) + ")"
