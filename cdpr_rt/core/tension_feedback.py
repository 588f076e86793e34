"""Measured cable tensions as arrays beside the axis feedback, whoever measures them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.clock import Clock


class TensionFault(IntEnum):
    """Reason why a tension is not valid."""

    NONE = 0
    NO_READING = 1
    """Nothing was read yet."""
    STALE = 2
    """The last reading is too old: the sensor does not answer any more."""
    OVER_RANGE = 3
    BROKEN_WIRE = 4

    @property
    def label(self) -> str:
        """Name in words."""
        return self.name.lower().replace("_", " ")


class TensionFeedback:
    """Tensions of n cables as last measured; overwritten in place by `TensionExchange.update`.

    Shapes are (n,). Times are those of the robot's clock.
    """

    def __init__(self, n: int) -> None:
        self.tension_N: FloatArray = np.zeros(n)
        self.time_s: FloatArray = np.full(n, -np.inf)
        """When the reading was asked for."""
        self.age_s: FloatArray = np.full(n, np.inf)
        self.valid: BoolArray = np.zeros(n, np.bool_)
        self.fault: NDArray[np.uint8] = np.full(n, TensionFault.NO_READING, np.uint8)
        """`TensionFault`, NONE where `valid`."""


class TensionExchange:
    """Hands readings from the task that samples to the cycle, which may come in between."""

    def __init__(self, cables: Sequence[str], stale_after_s: float, clock: Clock) -> None:
        n = len(cables)
        self.n = n
        self.cables = tuple(cables)
        self.stale_after_s = stale_after_s
        self.feedback = TensionFeedback(n)
        self._clock = clock
        self._fault = self.feedback.fault.copy()
        self._stale: BoolArray = np.zeros(n, np.bool_)

    def publish(self, cable: int, tension_N: float, time_s: float, fault: TensionFault) -> None:
        """Store one reading; a reading with a fault keeps its value for who wants to look."""
        feedback = self.feedback
        feedback.tension_N[cable] = tension_N
        feedback.time_s[cable] = time_s
        self._fault[cable] = fault

    def update(self) -> None:
        """Bring `feedback` up to date; for the cycle: no array made."""
        feedback = self.feedback
        np.subtract(self._clock.now_s, feedback.time_s, out=feedback.age_s)
        np.copyto(feedback.fault, self._fault)
        np.greater(feedback.age_s, self.stale_after_s, out=self._stale)
        # before the first reading the fault says so, and age is without end
        np.logical_and(
            self._stale, np.isfinite(feedback.age_s, out=feedback.valid), out=self._stale
        )
        np.putmask(feedback.fault, self._stale, TensionFault.STALE)
        np.equal(feedback.fault, TensionFault.NONE, out=feedback.valid)

    def reason(self) -> str:
        """Return why the tensions cannot be relied on, after `update`, or an empty text."""
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
    """Brakes a motion whose tensions are too high or not known any more (a watch of the loop).

    `stop_above_N` is what no cable may exceed.
    """

    def __init__(self, exchange: TensionExchange, stop_above_N: float = math.inf) -> None:
        self._exchange = exchange
        self._stop_above_N = stop_above_N

    def alarm(self) -> str:
        """Nothing here takes the torque at once: slack cables drop the platform."""
        return ""

    def stop_reason(self) -> str:
        """Return why the motion must be braked, or an empty text."""
        exchange = self._exchange
        exchange.update()
        reason = exchange.reason()
        if reason:
            return reason
        most = int(exchange.feedback.tension_N.argmax())
        tension = float(exchange.feedback.tension_N[most])
        if tension <= self._stop_above_N:
            return ""
        return f"{exchange.cables[most]}: {tension:.1f} N, {self._stop_above_N:g} N allowed"
