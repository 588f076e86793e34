"""Winches that reel in or pay out at a speed, pulling no less and no more than they may."""

from __future__ import annotations

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray
from cdpr_rt.jit import jit

_BANDWIDTH_rad_s = 100.0
_FILTER_S = 0.005
_FASTEST_m_s = 5.0
STANDING_1_s = 60.0
"""Of the integral part, where the cables' ends stand still."""
HANGING_1_s = 4.0
"""The same where what hangs on them is ten times heavier than the rotor is at the cable: it
follows the winches without swinging."""


@jit
def _reel(
    period: float,
    weight: float,
    low: FloatArray,
    high: FloatArray,
    paying_out: FloatArray,
    most_in: float,
    cable: FloatArray,
    gain: FloatArray,
    integral_rate: float,
    position: FloatArray,
    last: FloatArray,
    speed: FloatArray,
    integral: FloatArray,
    tension: FloatArray,
    torque: FloatArray,
) -> None:
    for i in range(position.size):
        pace = (position[i] - last[i]) / period
        last[i] = position[i]
        # an encoder that jumps tells no speed
        if abs(cable[i] * pace) < _FASTEST_m_s:
            speed[i] += weight * (pace - speed[i])
        out = cable[i] * speed[i]
        # a cable that has come loose is not to be wound up ever faster
        least = low[i] * min(max(1.0 + out / most_in, 0.0), 1.0)
        error = paying_out[i] / cable[i] - speed[i]
        integral[i] += gain[i] * integral_rate * period * error
        wanted = gain[i] * error + integral[i]
        tension[i] = min(max(-wanted / cable[i], least), max(high[i], least))
        torque[i] = -cable[i] * tension[i]
        integral[i] += torque[i] - wanted


class Reel:
    """A velocity loop for each winch, saturated in tension; arrays are (n,), speeds of cable.

    What is slack comes in at its speed, what is tight is pulled by just what it may be; what pulls
    at a winch is let out at its speed, held back by no more than it may be.
    """

    def __init__(
        self,
        inertia_kg_m2: FloatArray,
        cable_m: FloatArray,
        period_s: float,
    ) -> None:
        n = len(cable_m)
        self._period_s = period_s
        self._weight = period_s / (period_s + _FILTER_S)
        self._cable = np.array(cable_m, float)
        self._gain = np.broadcast_to(inertia_kg_m2, (n,)) * _BANDWIDTH_rad_s
        self.low_N = np.zeros(n)
        """What each cable is pulled with at the least, and"""
        self.high_N = np.zeros(n)
        """at the most."""
        self.paying_out_m_s = np.zeros(n)
        """Negative reels in."""
        self.most_in_m_s = 0.1
        """A cable that comes in as fast is not pulled by the least any more."""
        self.integral_rate_1_s = STANDING_1_s
        self.tension_N = np.zeros(n)
        """What the winches pull with now."""
        self.speed_rad_s = np.zeros(n)
        """How fast the motors turn."""
        self._last = np.zeros(n)
        self._integral = np.zeros(n)

    def begin(self, feedback: AxisFeedback, speed_rad_s: FloatArray, torque_Nm: FloatArray) -> None:
        """Go on from the last cycle's torques, at the motors' present speeds."""
        self._last[:] = feedback.position_rad
        self.speed_rad_s[:] = speed_rad_s
        self._integral[:] = torque_Nm

    def update(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Write the torques of this cycle."""
        _reel(
            self._period_s,
            self._weight,
            self.low_N,
            self.high_N,
            self.paying_out_m_s,
            self.most_in_m_s,
            self._cable,
            self._gain,
            self.integral_rate_1_s,
            feedback.position_rad,
            self._last,
            self.speed_rad_s,
            self._integral,
            self.tension_N,
            torque_Nm,
        )
