"""Velocity loops of the winches, saturated in cable tension."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.jit import bound, bound_to, jit

BANDWIDTH_rad_s = 100.0
FILTER_S = 0.005
_FASTEST_m_s = 5.0
FIXED_END_1_s = 60.0
"""Integral rate of a rotor without a load: the cable's end is fixed, or the cable is slack."""
HANGING_LOAD_1_s = 4.0
"""Integral rate under a load ten times the rotor's mass at the cable, without oscillation."""
UNKNOWN_POSE_m_s = 0.15
"""Speed at which the cables lower a platform of unknown pose."""
FASTEST_IN_m_s = 0.5
"""Highest speed at which they wind in slack during that lowering."""
DRUM_TENSION_SHARE = 0.25
"""Tension that keeps a cable on its drum during that lowering, as a share of the least tension."""
SPARE_m = 0.05
"""Cable paid out in addition to the length that reaches the stand: the largest lag of a
platform."""
PUSH_SHARE = 2.0
"""Push that turns a winch outwards against friction, as a multiple of its largest usual
friction."""
_USUAL_SHARE, _HURRY, _UNSEEN_S, _UNSEEN_CYCLES = 0.25, 30.0, 0.01, 5
"""Share of a push that turns most winches, and factor on the integral rate beyond it, until the
winch turns. Time for which a winch that does not turn is pushed fully, plus cycles until its
encoder could show a motion. A rotor whose encoder has failed accelerates unseen: this must be
short."""
_FULL_SHARE, _TURNS_SHARE = 0.95, 0.1
"""Share of the highest push that counts as full, and of the commanded speed that shows a motion."""
_NOISY_m_s, _NOISE_S = 0.5, 0.05
"""Noise of a cable's measured speed, averaged over this time, above which an encoder is not used:
its noise would be clipped to an average pull, which drags the platform. Noise is a deviation from
the filtered speed that changes its sign; that of an acceleration keeps it."""


@jit
def control_speed(
    period: float,
    weight: float,
    low: FloatArray,
    high: FloatArray,
    paying_out: FloatArray,
    cable: FloatArray,
    gain: FloatArray,
    left: FloatArray,
    unseen: FloatArray,
    stuck: BoolArray,
    noise: FloatArray,
    deviation: FloatArray,
    push: FloatArray,
    position: FloatArray,
    last: FloatArray,
    jumped: BoolArray,
    speed: FloatArray,
    integral: FloatArray,
    tension: FloatArray,
    torque: FloatArray,
    fastest_in: float,
    integral_rate: float,
) -> None:
    """Write tensions and torques of a cycle; arrays are those of `WinchSpeedLoop`, (n,)."""
    for i in range(position.size):
        raw = (position[i] - last[i]) / period
        last[i] = position[i]
        # a jump of the encoder lasts one cycle and is not a speed; a winch that runs away continues
        fast = abs(cable[i] * raw) >= _FASTEST_m_s
        if not fast or jumped[i]:
            speed[i] += weight * (raw - speed[i])
        jumped[i] = fast
        off = min(max(cable[i] * (raw - speed[i]), -_FASTEST_m_s), _FASTEST_m_s)
        swing = min(abs(off), abs(deviation[i])) if off * deviation[i] < 0.0 else 0.0
        deviation[i] = off
        if noise[i] <= _NOISY_m_s:
            noise[i] += period / (period + _NOISE_S) * (swing - noise[i])
        out = cable[i] * speed[i]
        rate = integral_rate
        if left[i] > 0.0:
            left[i] -= period * out
        if left[i] > 0.0:
            least = -push[i]
            if cable[i] * integral[i] > 0.0:  # it turns against its friction alone
                rate = FIXED_END_1_s
        else:
            # a loose cable must not be wound up ever faster
            least = low[i] * min(max(1.0 + out / fastest_in, 0.0), 1.0)
        if least < 0.0 and out < 0.5 * paying_out[i]:
            still = abs(out) < _TURNS_SHARE * paying_out[i]
            unseen[i] = unseen[i] + period if still and tension[i] <= _FULL_SHARE * least else 0.0
            stuck[i] |= unseen[i] > _UNSEEN_S + _UNSEEN_CYCLES * period
            if still and tension[i] < _USUAL_SHARE * least and cable[i] * integral[i] > 0.0:
                rate *= _HURRY
        else:
            unseen[i] = 0.0
        if stuck[i] or noise[i] > _NOISY_m_s:
            tension[i] = torque[i] = integral[i] = left[i] = 0.0
            continue
        error = paying_out[i] / cable[i] - speed[i]
        integral[i] += gain[i] * rate * period * error
        demand = gain[i] * error + integral[i]
        tension[i] = min(max(-demand / cable[i], least), max(high[i], least))
        torque[i] = -cable[i] * tension[i]
        integral[i] += torque[i] - demand


class WinchSpeedLoop:
    """A PI velocity loop for each winch, its tension limited to [low_N, high_N]; arrays are (n,).

    A slack cable is reeled in at the commanded speed, a tight one pulled with `high_N`; a loaded
    cable is paid out at the commanded speed, held with at most `high_N`. While `left_m` of a cable
    is above 0, its motor also pays out without a load, against friction of up to `push_N`. A winch
    that is pushed outwards as hard as it may be and does not turn is `stuck`. It gets no torque
    from then on: its encoder may have failed, and its motor would run away. A winch whose encoder
    shows mostly noise gets none either.
    Anti-windup by back-calculation.
    """

    def __init__(
        self,
        inertia_kg_m2: FloatArray,
        cable_m: FloatArray,
        period_s: float,
    ) -> None:
        n = len(cable_m)
        self._period_s = period_s
        self._weight = period_s / (period_s + FILTER_S)
        self._cable = np.array(cable_m, float)
        self._gain = np.broadcast_to(inertia_kg_m2, (n,)) * BANDWIDTH_rad_s
        self.low_N = np.zeros(n)
        """Lowest tension."""
        self.high_N = np.zeros(n)
        """Highest tension."""
        self.paying_out_m_s = np.zeros(n)
        """Commanded cable speed; negative reels in."""
        self.fastest_in_m_s = 0.1
        """Reeling-in speed at which `low_N` has faded to zero."""
        self.integral_rate_1_s = FIXED_END_1_s
        self.left_m = np.zeros(n)
        """Length of cable still to be paid out, whether a load pulls it or not."""
        self.push_N = np.zeros(n)
        """The largest force at the cable with which a motor pushes `left_m` out."""
        self.tension_N = np.zeros(n)
        """Commanded tension of the last cycle; negative if the motor pushes outwards."""
        self.speed_rad_s = np.zeros(n)
        """Filtered motor speed."""
        self.stuck = np.zeros(n, np.bool_)
        """Whether each winch was pushed outwards fully and has not turned for that time."""
        self._unseen_s = np.zeros(n)
        self._noise_m_s, self._deviation_m_s = np.zeros((2, n))
        self._last, self._jumped = np.zeros(n), np.zeros(n, np.bool_)
        self._integral = np.zeros(n)
        self._kernel = bound_to(self._bind)

    def begin(self, feedback: AxisFeedback, speed_rad_s: FloatArray, torque_Nm: FloatArray) -> None:
        """Begin with the last cycle's torques at the motors' present speeds, (n,) each."""
        self._last[:], self._jumped[:] = feedback.position_rad, False
        self._unseen_s[:] = self._noise_m_s[:] = self._deviation_m_s[:] = 0.0
        self.stuck[:] = False
        self.speed_rad_s[:] = speed_rad_s
        self._integral[:] = torque_Nm

    @property
    def noisy(self) -> BoolArray:
        """Whether the encoder of each winch has shown mostly noise since `begin`, (n,)."""
        return self._noise_m_s > _NOISY_m_s

    def update(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Write the torques of this cycle."""
        control = self._kernel(feedback, torque_Nm)
        control(self.fastest_in_m_s, self.integral_rate_1_s)

    def _bind(
        self, feedback: AxisFeedback, torque_Nm: FloatArray
    ) -> Callable[[float, float], None]:
        return bound(
            control_speed, self._period_s, self._weight, self.low_N, self.high_N,
            self.paying_out_m_s, self._cable, self._gain, self.left_m, self._unseen_s, self.stuck,
            self._noise_m_s, self._deviation_m_s, self.push_N, feedback.position_rad, self._last,
            self._jumped, self.speed_rad_s, self._integral, self.tension_N, torque_Nm,
            then=(0.0, 0.0),
        )  # fmt: skip
