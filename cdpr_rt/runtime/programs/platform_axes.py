"""What the programs of single axes are where the axes hold a platform together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.robots.planar_kernel import G_m_s2
from cdpr_rt.runtime.programs.axis_program import AxisProgram, Loop
from cdpr_rt.runtime.programs.base import REST_S, Program, ProgramError
from cdpr_rt.runtime.programs.idle import IdleProgram
from cdpr_rt.runtime.programs.jog import JogProgram
from cdpr_rt.runtime.programs.model import RobotModel
from cdpr_rt.runtime.programs.platform_program import PlatformParts, PlatformProgram

_HANGING = 0.8
"""Of the weight: cables that pull with less, all together, do not carry it."""


class PlatformHold:
    """Keeps the platform where it comes to rest; each axis by itself where cables are not tight."""

    name = "hold"
    needs_lease = False
    rest_s = REST_S

    def __init__(self, parts: PlatformParts, model: RobotModel, loop: Loop) -> None:
        self._parts = parts
        self._axes = AxisProgram(model, loop)
        self._platform = PlatformProgram(parts, model.torque_Nm)
        self._now: Program = self._axes
        self.controller = self._now.controller

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque, (n,) each, as the last cycle left them."""
        self._now = self._platform if self._parts.tight else self._axes
        self.controller = self._now.controller
        self._now.start(feedback, setpoint, torque_Nm)

    def check(self, wanted: Mapping[str, Any]) -> None:
        """Raise ProgramError where `command` would, of a program that need not run."""
        self._axes.check(wanted)

    def command(self, wanted: Mapping[str, Any]) -> None:
        """Raise ProgramError where anything is wanted."""
        self.check(wanted)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        self._now.update(feedback, setpoint, torque_Nm)

    def stop(self) -> None:
        """Begin to brake to a standstill."""
        self._now.stop()

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still."""
        return self._now.at_rest

    @property
    def pose(self) -> FloatArray | None:
        """Return where the platform is, (7,), None where that is not known."""
        return self._now.pose

    @property
    def pose_setpoint(self) -> FloatArray | None:
        """Return where the platform is to be, (7,), None where that is not known."""
        return self._now.pose_setpoint

    @property
    def stream_age_s(self) -> float:
        """There is no stream."""
        return self._now.stream_age_s

    @property
    def stream_buttons(self) -> int:
        """There is no stream."""
        return 0

    def progress(self) -> dict[str, Any]:
        """Return what is held, the axes or the platform, and where that is."""
        return {"tight": self._parts.tight, **self._now.progress()}


class PlatformIdle(IdleProgram):
    """Lets the torque fade away, where no platform hangs on it."""

    def __init__(self, parts: PlatformParts, model: RobotModel) -> None:
        super().__init__(model)
        self._parts = parts

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; cables are not tight any more."""
        self._parts.slacken()
        super().start(feedback, setpoint, torque_Nm)

    def check(self, wanted: Mapping[str, Any]) -> None:
        """Raise ProgramError where `command` would, or where the platform would fall."""
        super().check(wanted)
        if self._parts.tight:
            raise ProgramError("idle: the platform hangs on its cables; lower it first")
        carried_N = float(np.nansum(self._parts.estimator.estimate.tension_N))
        if carried_N > _HANGING * self._parts.platform.mass_kg * G_m_s2:
            raise ProgramError(
                f"idle: its cables pull with {carried_N:.0f} N, the platform may hang on them; "
                "lower it first"
            )


class PlatformJog(JogProgram):
    """Turns single winches; cables count as not tight from then on."""

    def __init__(self, parts: PlatformParts, model: RobotModel, loop: Loop) -> None:
        super().__init__(model, loop)
        self._parts = parts

    def check(self, wanted: Mapping[str, Any]) -> None:
        """Raise ProgramError where `command` would, or where the platform hangs on its cables."""
        super().check(wanted)
        if self._parts.tight:
            raise ProgramError("jog: the platform hangs on its cables; lower it first")

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque; brakes until speeds are wanted."""
        self._parts.slacken()
        self._parts.last.take()
        super().start(feedback, setpoint, torque_Nm)
