"""Exchange of one cycle between the controller and n axes: feedback, command, measured tensions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import BoolArray, FloatArray, WordArray
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.fault import LOAD_CELL, LOAD_CELL_HIGH, Fault


class AxisFeedback:
    """State of n axes as latched by the drives at one SYNC; overwritten in place every cycle.

    Shapes are (n,). Angles are motor angles in the drive's own origin; `index_rad` is the position
    of the encoder index on that scale, valid if `index_known`.
    """

    def __init__(self, n: int) -> None:
        self.cycle = 0
        """Number of SYNCs since the cyclic exchange was started."""
        self.time_s = 0.0
        """Bus time of the SYNC, counted from the first cycle."""
        self.position_rad: FloatArray = np.zeros(n)
        self.torque_Nm: FloatArray = np.zeros(n)
        """Torque actual value (6077h)."""
        self.statusword: WordArray = np.zeros(n, np.uint16)
        self.valid: BoolArray = np.zeros(n, np.bool_)
        """Whether the axis answered this SYNC."""
        self.alive: BoolArray = np.zeros(n, np.bool_)
        """Whether the drive answered and was operational at the end of the last cycle."""
        self.rate_ok: BoolArray = np.zeros(n, np.bool_)
        """Whether the drive answers once per SYNC: to the last SYNC, and to nearly all before
        it."""
        self.index_rad: FloatArray = np.zeros(n)
        self.index_known: BoolArray = np.zeros(n, np.bool_)


class AxisCommand:
    """Command of one cycle to n axes; shapes are (n,)."""

    def __init__(self, n: int) -> None:
        self.torque_Nm: FloatArray = np.zeros(n)
        self.sent_torque_Nm: FloatArray = np.zeros(n)
        """Torque that was sent after quantisation to the drive's unit; written by the device."""


class Setpoint:
    """Desired motion of n axes at one instant; shapes are (n,), motor side, drive's origin."""

    def __init__(self, n: int) -> None:
        self.position_rad: FloatArray = np.zeros(n)
        self.velocity_rad_s: FloatArray = np.zeros(n)
        self.acceleration_rad_s2: FloatArray = np.zeros(n)
        self.arrays = (self.position_rad, self.velocity_rad_s, self.acceleration_rad_s2)


class AxisDevice(Protocol):
    """A group of n axes with one exchange per cycle.

    Order in a cycle: `sync`, `receive`, then the controller writes `command`, then `transmit`.
    """

    n: int
    period_s: float
    lockstep: bool
    """Whether the next SYNC goes out as soon as the last one has been answered."""
    commands_s: float
    """Longest time for which the commands of a cycle are on the wire, on the slowest bus."""
    feedback: AxisFeedback
    command: AxisCommand

    @property
    def clock(self) -> Clock:
        """The robot's time."""

    def sync(self) -> None:
        """Send the SYNC that opens the cycle."""

    def receive(self) -> int:
        """Wait for the answers, decode them into `feedback`; return how many axes answered."""

    def transmit(self, and_sync: bool = False, /) -> None:
        """Encode `command` and send it, to act from the next SYNC on.

        With `and_sync` that SYNC follows now, so that the drives work while the row is written. Set
        it only in lockstep, and only if nothing else is sent before the next cycle's `sync`.
        """

    def faults(self) -> Sequence[Fault]:
        """Return the faults that must stop the drives, one for each failed axis.

        The fault of a bus has axis -1. The call is fast.
        """


# Measured cable tensions as arrays, independent of the device that measures them.


class TensionFault(IntEnum):
    """Reason why a tension is not valid."""

    NONE = 0
    NO_READING = 1
    """No reading has arrived yet."""
    STALE = 2
    """The last reading is too old: the sensor has stopped answering."""
    OVER_RANGE = 3
    BROKEN_WIRE = 4

    @property
    def label(self) -> str:
        """Name as text."""
        return self.name.lower().replace("_", " ")


class TensionFeedback:
    """Tensions of n cables as last measured; overwritten in place by `TensionExchange.update`.

    Shapes are (n,). Times are those of the robot's clock.
    """

    def __init__(self, n: int) -> None:
        self.tension_N: FloatArray = np.zeros(n)
        self.time_s: FloatArray = np.full(n, -np.inf)
        """Time at which the reading was requested."""
        self.age_s: FloatArray = np.full(n, np.inf)
        self.valid: BoolArray = np.zeros(n, np.bool_)
        self.fault: NDArray[np.uint8] = np.full(n, TensionFault.NO_READING, np.uint8)
        """`TensionFault`, NONE if `valid`."""
        self.upward: FloatArray = np.zeros(4)
        """First 1 for a valid reading of the inclinometer, -1 for an invalid one, 0 without an
        inclinometer; then the upward direction in the platform's frame, (3,)."""


class TensionExchange:
    """Passes readings from the sampling task to the cycle, which may run during a reading."""

    def __init__(self, cables: Sequence[str], stale_after_s: float, clock: Clock) -> None:
        n = len(cables)
        self.n = n
        self.cables = tuple(cables)
        self.stale_after_s = stale_after_s
        self.feedback = TensionFeedback(n)
        self._clock = clock
        self._fault = self.feedback.fault.copy()
        self._tilted_s = -math.inf
        self._stale: BoolArray = np.zeros(n, np.bool_)

    def publish(self, cable: int, tension_N: float, time_s: float, fault: TensionFault) -> None:
        """Store one reading; a reading with a fault keeps its value for diagnosis."""
        feedback = self.feedback
        feedback.tension_N[cable] = tension_N
        feedback.time_s[cable] = time_s
        self._fault[cable] = fault

    def publish_upward(self, upward: FloatArray | None, time_s: float) -> None:
        """Store an inclinometer's upward direction (3,), or None if there is no reading yet."""
        if upward is None:
            self.feedback.upward[0] = -1.0
        else:
            self.feedback.upward[1:], self._tilted_s = upward, time_s

    def update(self) -> None:
        """Update `feedback`; called in the cycle, so it allocates no array."""
        feedback = self.feedback
        if feedback.upward[0] != 0.0:
            fresh = self._clock.now_s - self._tilted_s <= self.stale_after_s
            feedback.upward[0] = 1.0 if fresh else -1.0
        np.subtract(self._clock.now_s, feedback.time_s, out=feedback.age_s)
        np.copyto(feedback.fault, self._fault)
        np.greater(feedback.age_s, self.stale_after_s, out=self._stale)
        # before the first reading the fault is already set, and the age is infinite
        np.logical_and(
            self._stale, np.isfinite(feedback.age_s, out=feedback.valid), out=self._stale
        )
        np.putmask(feedback.fault, self._stale, TensionFault.STALE)
        np.equal(feedback.fault, TensionFault.NONE, out=feedback.valid)

    def reason(self) -> str:
        """Return the reason why the tensions are unreliable after `update`, or ""."""
        feedback = self.feedback
        if feedback.valid.all():
            return ""
        i = int(np.argmin(feedback.valid))
        fault = TensionFault(int(feedback.fault[i]))
        text = f"{self.cables[i]}: tension sensor: {fault.label}"
        if fault is TensionFault.STALE:
            return (
                f"{text}, last read {feedback.age_s[i]:.2f} s ago, {self.stale_after_s:g} s allowed"
            )
        if fault is TensionFault.OVER_RANGE:
            return f"{text} ({feedback.tension_N[i]:.1f} N)"
        return text


class TensionWatch:
    """Watch of the loop that brakes a winch whose tension is too high or unknown.

    No cable may exceed `stop_above_N`.
    """

    def __init__(self, exchange: TensionExchange, stop_above_N: float = math.inf) -> None:
        self._exchange = exchange
        self._stop_above_N = stop_above_N

    def fault(self) -> Fault | None:
        """Return the fault that must brake the motion, or None.

        The fault never removes the torque immediately, because the platform would fall on slack
        cables.
        """
        exchange = self._exchange
        exchange.update()
        feedback = exchange.feedback
        if reason := exchange.reason():
            return self._fault(int(np.argmin(feedback.valid)), LOAD_CELL, detail=reason)
        most = int(feedback.tension_N.argmax())
        tension_N = float(feedback.tension_N[most])
        if tension_N <= self._stop_above_N:
            return None
        return self._fault(most, LOAD_CELL_HIGH, tension_N, self._stop_above_N)

    def _fault(
        self, cable: int, code: str, value: float = math.nan, allowed: float = math.nan,
        detail: str = "",
    ) -> Fault:  # fmt: skip
        cables = self._exchange.cables
        axis = cable if len(cables) == 1 else -1  # several cables do not belong to a single winch
        source = f"load cell {cables[cable]}"
        return Fault(Limit.SAFETY_STOP, axis, code, source, value, allowed, detail)
