"""Base classes of programs: what the loop runs in its cycles."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, Final

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.arguments import CommandArguments, ProgramError

REST_S: Final = 5.0
"""The longest that a set-point within its bounds takes to come to rest."""


class Program(ABC):
    """A set-point over time and the controller that follows it.

    One program runs at a time. The next one goes on from the set-point and the torque that the
    last one left, so that neither steps. `update` allocates nothing, does no I/O and knows no
    clock: time passes by one period a call. What is not abstract is that of a program without
    arguments, platform and stream.
    """

    name: str
    controller: Controller
    """The controller whose effort and compensation are recorded."""
    needs_lease: bool
    """Whether it runs only while the client that started it holds the right to move."""

    @abstractmethod
    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque, (n,) each, as the last cycle left them."""

    def preparation(self, _arguments: Mapping[str, Any]) -> Callable[[], None] | None:
        """Return the preparation of a command with these arguments, None for nothing.

        It may take its time, as reading a file does, and is called in another thread; what it
        raises refuses the command.
        """
        return None

    def check(self, arguments: Mapping[str, Any]) -> Any:
        """Return checked arguments for `apply`; raises ProgramError, and changes nothing.

        The program need not run.
        """
        return CommandArguments(self.name, arguments, ())

    def apply(self, checked: Any) -> None:  # noqa: B027
        """Apply a command that has been checked since the last cycle."""

    def command(self, arguments: Mapping[str, Any]) -> None:
        """Check a command and apply it; raises ProgramError and changes nothing then."""
        self.apply(self.check(arguments))

    @abstractmethod
    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""

    @abstractmethod
    def stop(self) -> None:
        """Begin to brake to a standstill; `update` goes on being called until `at_rest`."""

    @property
    @abstractmethod
    def at_rest(self) -> bool:
        """Whether the set-point stands still and nothing is left to do."""

    @property
    def rest_s(self) -> float:
        """Longest time from a stop until it is at rest, s."""
        return REST_S

    @property
    def pose(self) -> FloatArray | None:
        """Pose of the platform as this program knows it, (7,), None where it knows none."""
        return None

    @property
    def pose_setpoint(self) -> FloatArray | None:
        """Pose where the platform is to be, (7,), None where it does not say."""
        return None

    @property
    def stream_age_s(self) -> float:
        """Age of the newest sample that it follows, s, nan where it follows none."""
        return math.nan

    @property
    def stream_buttons(self) -> int:
        """Buttons of the sample that it plays, 0 where it follows none."""
        return 0

    def progress(self) -> dict[str, Any]:
        """Return progress for the status, such as the part done; not called in every cycle."""
        return {}


class CommandedProgram(Program):
    """Base class of programs that take commands while they run, and brake on `stop`.

    Subclasses override `check` and `_apply`.
    """

    _stopping = False
    _at_rest = True

    def apply(self, checked: Any) -> None:
        """Apply a command that has been checked."""
        self._at_rest = False
        self._apply(checked)

    def command(self, arguments: Mapping[str, Any]) -> None:
        """Check a command and apply it; raises ProgramError and changes nothing then."""
        checked = self.check(arguments)
        if self._stopping:
            raise ProgramError(f"{self.name}: it is being stopped; start it anew")
        self.apply(checked)

    def stop(self) -> None:
        """Begin to brake to a standstill."""
        self._stopping = True
        self._at_rest = False

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still and nothing is left to do."""
        return self._at_rest

    def _apply(self, _checked: Any) -> None:
        """Do what a command's checked arguments ask for."""
