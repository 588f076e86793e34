"""Programs `hold`, `idle` and `jog` of axes whose cables carry one platform."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.axis_program import AxisProgram, BumplessController
from cdpr_rt.programs.base import Program, ProgramError
from cdpr_rt.programs.idle import IdleProgram
from cdpr_rt.programs.jog import JogProgram
from cdpr_rt.programs.model import AxesModel
from cdpr_rt.programs.path import PathProgram
from cdpr_rt.programs.platform_program import PlatformParts, PlatformProgram
from cdpr_rt.programs.standing import hangs


class PlatformHold(Program):
    """Brakes and holds the platform, or each axis alone if the cables are slack.

    A set-point that is on a path stays on it.
    """

    name = "hold"
    needs_lease = False

    def __init__(
        self, parts: PlatformParts, model: AxesModel, loop: BumplessController, path: PathProgram
    ) -> None:
        self._parts, self._path = parts, path
        self._axes = AxisProgram(model, loop)
        self._platform = PlatformProgram(parts, model.torque_Nm)
        self._active: Program = self._axes
        self.controller = self._active.controller

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last cycle's set-point and torque, (n,) each."""
        if self._parts.tight and self._path.is_on_path(feedback.cycle):
            self._active = self._path
            self._path.stop()
        else:
            self._active = self._platform if self._parts.tight else self._axes
            self._active.start(feedback, setpoint, torque_Nm)
        self.controller = self._active.controller

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        self._active.update(feedback, setpoint, torque_Nm)

    def stop(self) -> None:
        """Begin to brake to a standstill."""
        self._active.stop()

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still."""
        return self._active.at_rest

    @property
    def pose(self) -> FloatArray | None:
        """Return the pose of the platform, (7,), None if it is not known."""
        return self._active.pose

    @property
    def pose_setpoint(self) -> FloatArray | None:
        """Return the commanded pose of the platform, (7,), None if it is not known."""
        return self._active.pose_setpoint

    def progress(self) -> dict[str, Any]:
        """Return whether the program holds the platform or single axes, and the position."""
        parts = self._parts
        progress = {"tight": parts.tight, **self._active.progress()}
        left = self._path.left()
        return progress if left is None else {**progress, "path": left}


class PlatformIdle(IdleProgram):
    """Fades the torque out; the command is rejected while the platform hangs on its cables."""

    def __init__(self, parts: PlatformParts, model: AxesModel) -> None:
        super().__init__(model)
        self._parts = parts

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last set-point and torque; mark the cables as slack."""
        self._parts.slacken()
        super().start(feedback, setpoint, torque_Nm)

    def check(self, arguments: Mapping[str, Any]) -> Any:
        """Raise ProgramError if there is an argument, or if the platform would fall."""
        super().check(arguments)
        if self._parts.tight:
            raise ProgramError("idle: the platform hangs on its cables; lower it first")
        if hangs(self._parts):
            carried_N = float(np.nansum(self._parts.estimator.estimate.tension_N))
            raise ProgramError(
                f"idle: its cables carry {carried_N:.0f} N, so the platform may hang on them; "
                "lower it first"
            )


class PlatformJog(JogProgram):
    """Turns single winches; marks the cables as slack."""

    def __init__(self, parts: PlatformParts, model: AxesModel, loop: BumplessController) -> None:
        super().__init__(model, loop)
        self._parts = parts

    def check(self, arguments: Mapping[str, Any]) -> Any:
        """Return checked arguments for `apply`; raises ProgramError, also if cables carry the
        platform.
        """
        if self._parts.tight:
            raise ProgramError("jog: the platform hangs on its cables; lower it first")
        return super().check(arguments)

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last set-point and torque; brake until speeds are commanded."""
        self._parts.slacken()
        self._parts.last_stop.take()
        super().start(feedback, setpoint, torque_Nm)

    def progress(self) -> dict[str, Any]:
        """Return also that the cables are not known to be tight."""
        return {"tight": False, **super().progress()}
