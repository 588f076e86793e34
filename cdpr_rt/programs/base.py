"""The interface of a program: what the loop runs in its cycles."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.errors import ControlError

REST_S: Final = 5.0
"""The longest that a set-point within its bounds takes to come to rest."""


class ProgramError(ControlError):
    """A command that a program refuses; the message names the key and value."""


class Program(Protocol):
    """A set-point over time and the controller that follows it.

    One program runs at a time. The next one goes on from the set-point and the torque that the
    last one left, so that neither steps. `update` allocates nothing, does no I/O and knows no
    clock: time passes by one period a call.
    """

    name: str
    controller: Controller
    """The controller whose effort and compensation are recorded."""
    needs_lease: bool
    """Whether it runs only while the client that started it holds the right to move."""

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the present set-point and torque, (n,) each, as the last cycle left them."""

    def preparation(self, arguments: Mapping[str, Any]) -> Callable[[], None] | None:
        """Return what has to be done before a command with these arguments, None for nothing.

        It may take its time, as reading a file does, and is called in another thread; what it
        raises refuses the command.
        """

    def check(self, arguments: Mapping[str, Any]) -> Any:
        """Return what `apply` takes; raises ProgramError for what is refused, and changes nothing.

        The program need not run.
        """

    def apply(self, checked: Any) -> None:
        """Apply a command that has been checked since the last cycle."""

    def command(self, arguments: Mapping[str, Any]) -> None:
        """Check a command and apply it; raises ProgramError and changes nothing then."""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""

    def stop(self) -> None:
        """Begin to brake to a standstill; `update` goes on being called until `at_rest`."""

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still and nothing is left to do."""

    @property
    def rest_s(self) -> float:
        """Return the longest that it takes until it is at rest after a stop."""

    @property
    def pose(self) -> FloatArray | None:
        """Return the platform's pose as this program knows it, (7,), None where it knows none."""

    @property
    def pose_setpoint(self) -> FloatArray | None:
        """Return where the platform is to be, (7,), None where it does not say."""

    @property
    def stream_age_s(self) -> float:
        """Return the age of the newest sample that it follows, nan where it follows none."""

    @property
    def stream_buttons(self) -> int:
        """Return the buttons of the sample that it plays, 0 where it follows none."""

    def progress(self) -> dict[str, Any]:
        """Return what the status shows of it, such as the part done; not called in every cycle."""
