"""Base classes of programs, which the loop runs in its cycles."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.errors import ControlError
from cdpr_rt.jit import jit
from cdpr_rt.refusal import CommandRefusal, RefusalCode, shown

# Arguments of a command to a program: checked for type and range, rejected with a message.


class ProgramError(ControlError):
    """A program rejects a command; the message names the key and value."""


class CommandArguments:
    """The keys and values that came with a command; raises ProgramError for keys not `allowed`."""

    def __init__(self, program: str, arguments: Mapping[str, Any], allowed: Sequence[str]) -> None:
        self._program = program
        self._arguments = arguments
        for key in arguments:
            if key not in allowed:
                words = ", ".join(allowed) if allowed else "none: this program has no set-point"
                raise ProgramError(f"{program}: key {shown(key)}; allowed: {words}")

    def __contains__(self, key: str) -> bool:
        return key in self._arguments

    def one_of(self, *keys: str) -> str:
        """Return which of the keys was given; raises ProgramError unless it is exactly one."""
        given = [key for key in keys if key in self._arguments]
        if len(given) != 1:
            found = " and ".join(given) if given else "no argument"
            raise ProgramError(f"{self._program}: {found}; allowed: one of {', '.join(keys)}")
        return given[0]

    def number(self, key: str, low: float, high: float, default: float) -> float:
        """Return a number from `low` to `high`, the default if none was given."""
        value = self._arguments.get(key, default)
        return self._checked(key, None, value, low, high)

    def whole(self, key: str, low: int, high: int, default: int) -> int:
        """Return a whole number from `low` to `high`, the default if none was given."""
        value = self.number(key, low, high, default)
        if value != round(value):
            raise self._refused(key, value, f"a whole number from {low} to {high}")
        return round(value)

    def axes(
        self, key: str, limit: FloatArray, optional: bool = False, each: str = "an axis"
    ) -> FloatArray:
        """Return one number per axis, (n,), of magnitude up to `limit` (n,).

        With `optional`, the number of an axis may be null, which becomes nan in the result. `each`
        is the term that error messages use for one of the numbers, by default an axis.
        """
        value = self._arguments.get(key)
        if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != limit.size:
            raise self._refused(key, value, f"a list of {limit.size}, one number {each}")
        numbers = np.full(limit.size, math.nan)
        for i, entry in enumerate(value):
            if entry is not None or not optional:
                high = float(limit[i])
                numbers[i] = self._checked(key, i, entry, -high, high)
        return numbers

    def _checked(self, key: str, index: int | None, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            entry = key if index is None else f"{key}[{index}]"
            raise self._refused(entry, value, f"a number from {low:g} to {high:g}")
        if not low <= value <= high:  # this also rejects nan
            bounds = {"index": index, "low": low, "high": high}
            code = RefusalCode.OUT_OF_RANGE
            raise ProgramError(CommandRefusal(code, self._program, {key: value}, bounds))
        return float(value)

    def _refused(self, key: str, value: Any, allowed: str) -> ProgramError:
        return ProgramError(f"{self._program}: {key}: value {shown(value)}; allowed: {allowed}")


REST_S: Final = 5.0
"""The longest time in which a set-point within its bounds comes to rest."""


class Program(ABC):
    """A set-point over time and the controller that follows it.

    One program runs at a time. The next program continues from the set-point and torque of the last
    one, without a step in either. `update` allocates nothing, does no I/O and reads no clock: time
    advances by one period per call. The methods that are not abstract have defaults for a program
    without arguments, platform and stream.
    """

    name: str
    controller: Controller
    """The controller whose effort and compensation are recorded."""
    needs_lease: bool
    """Whether the program runs only while the client that started it has the right to move."""

    @abstractmethod
    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last cycle's set-point and torque, (n,) each."""

    def preparation(self, _arguments: Mapping[str, Any]) -> Callable[[], None] | None:
        """Return a function that prepares a command with these arguments, or None.

        The function may take long, for example to read a file, and is called in another thread. If
        it raises, the command is rejected.
        """
        return None

    def check(self, arguments: Mapping[str, Any]) -> Any:
        """Return checked arguments for `apply`; raises ProgramError. It changes nothing.

        The program need not be running.
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
        """Begin to brake to a standstill; `update` is still called until `at_rest`."""

    @property
    @abstractmethod
    def at_rest(self) -> bool:
        """Whether the set-point stands still and nothing is left to do."""

    @property
    def rest_s(self) -> float:
        """Longest time from a stop until the program is at rest, s."""
        return REST_S

    @property
    def pose(self) -> FloatArray | None:
        """Pose of the platform as this program knows it, (7,), None if unknown."""
        return None

    @property
    def pose_setpoint(self) -> FloatArray | None:
        """Commanded pose of the platform, (7,), None if the program commands none."""
        return None

    @property
    def stream_age_s(self) -> float:
        """Age of the newest sample of the stream, s; nan if the program follows no stream."""
        return math.nan

    @property
    def stream_buttons(self) -> int:
        """Buttons of the present sample of the stream; 0 if the program follows no stream."""
        return 0

    def progress(self) -> dict[str, Any]:
        """Return the progress for the status, such as the share done; not called in every cycle."""
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
            raise ProgramError(f"{self.name}: the program is stopping; start it again")
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
        """Carry out a command with checked arguments."""


# Bumpless transfer to a controller without an integral part.

_FADE_S = 0.2


@jit
def _fade(
    difference: FloatArray, share: float, first: bool, limit: FloatArray, torque: FloatArray
) -> None:
    for i in range(torque.size):
        if first:
            difference[i] -= torque[i]
        torque[i] = min(max(torque[i] + share * difference[i], -limit[i]), limit[i])


class BumplessTransfer:
    """Fades out the torque difference between the last controller and a new one over 0.2 s.

    torque = u + s·(torque_0 - u_0), s from 1 to 0; `limit_Nm` (n,) bounds the sum.
    """

    def __init__(self, controller: Controller, limit_Nm: FloatArray, period_s: float) -> None:
        self.controller = controller
        self._limit = np.array(limit_Nm, float)
        self._difference = np.zeros_like(self._limit)
        self._cycles = max(1, round(_FADE_S / period_s))
        self._cycle = 0

    def take_over(self, _feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Begin with the torques (n,) of the last cycle."""
        self.controller.reset()
        self._difference[:] = torque_Nm
        self._cycle = 0

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write the torques of this cycle, (n,)."""
        self.controller.update(feedback, setpoint, torque_Nm)
        share = 1.0 - self._cycle / self._cycles
        _fade(self._difference, share, self._cycle == 0, self._limit, torque_Nm)
        self._cycle = min(self._cycle + 1, self._cycles)

    @property
    def done(self) -> bool:
        """Whether the difference has faded out completely."""
        return self._cycle >= self._cycles
