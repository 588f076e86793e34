"""Taking up the slack of a robot's cables, and learning where its platform is."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.jit import jit
from cdpr_rt.runtime.programs.platform_program import PlatformParts, PlatformProgram

_RISE_N_s = 15.0
_FALL_S = 0.2
_SPEED_m_s = 0.03
_BANDWIDTH_rad_s = 60.0
_INTEGRAL_RATE = 15.0
_STILL_rad_s = 0.05
_STILL_S = 0.5
_FILTER_S = 0.02
_MOST_m = 1.0
_MOST_S = 60.0


@jit
def _reel(
    period: float,
    tension: FloatArray,
    cable: FloatArray,
    position: FloatArray,
    last: FloatArray,
    speed: FloatArray,
    gain: float,
    integral: FloatArray,
    torque: FloatArray,
) -> float:
    """Reel each cable in at a low speed, pulling no harder than wanted; return the fastest speed.

    A velocity loop, saturated at the torque of the tension: what is slack comes in slowly, what is
    tight is pulled by just that.
    """
    fastest = 0.0
    weight = period / (period + _FILTER_S)
    for i in range(tension.size):
        speed[i] += weight * ((position[i] - last[i]) / period - speed[i])
        last[i] = position[i]
        fastest = max(fastest, abs(speed[i]))
        most = -cable[i] * tension[i]
        error = -np.sign(cable[i]) * _SPEED_m_s / abs(cable[i]) - speed[i]
        integral[i] += gain * _INTEGRAL_RATE * period * error
        wanted = gain * error + integral[i]
        torque[i] = max(min(wanted, max(most, 0.0)), min(most, 0.0))
        integral[i] += torque[i] - wanted
    return fastest


class TightenProgram(PlatformProgram):
    """Pulls slack cables gently until all are tight and stand still; then keeps the platform.

    Where cable lengths are not known, the platform is taken to be at home then: it has to stand
    there. A cable that does not become tight ends it: the axes stay where they are.
    """

    name = "tighten"
    needs_lease = True

    def __init__(self, parts: PlatformParts, torque_Nm: FloatArray, cable_m: FloatArray) -> None:
        super().__init__(parts, torque_Nm)
        self._cable = np.array(cable_m)
        self._limit = np.array(torque_Nm)
        self._least = np.array(parts.control.least_N)
        self._gain = parts.control.inertia_kg_m2 * _BANDWIDTH_rad_s
        self._integral = np.zeros(3)
        self._speed_rad_s = np.zeros(3)
        self._last = np.zeros(3)
        self._begun = np.zeros(3)
        self._pull = np.zeros(3)
        self._still = 0
        self._cycles = 0
        self._tight = False
        self._why = ""

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the torque of the last cycle, whatever it pulled."""
        super().start(feedback, setpoint, torque_Nm)
        self._last[:] = self._begun[:] = feedback.position_rad
        self._speed_rad_s[:] = 0.0
        self._integral[:] = torque_Nm
        self._pull[:] = np.clip(-torque_Nm / self._cable, 0.0, self._least)
        self._still = self._cycles = 0
        self._tight = False
        self._why = ""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (3,) each, in place."""
        if self._tight:
            super().update(feedback, setpoint, torque_Nm)
            return
        period = self._parts.period_s
        step = -self._least * period / _FALL_S if self._stopping else _RISE_N_s * period
        np.clip(self._pull + step, 0.0, self._least, out=self._pull)
        fastest = _reel(
            period, self._pull, self._cable, feedback.position_rad, self._last,
            self._speed_rad_s, self._gain, self._integral, torque_Nm,
        )  # fmt: skip
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = setpoint.acceleration_rad_s2[:] = 0.0
        self._cycles += 1
        pulling = bool((self._pull >= self._least).all())
        self._still = self._still + 1 if pulling and fastest < _STILL_rad_s else 0
        if self._stopping:
            self._at_rest = not self._pull.any()
        elif self._still * period >= _STILL_S:
            self._finish(feedback, setpoint, torque_Nm)
        elif not self._why:
            self._why = self._trouble(feedback)
            self._stopping = bool(self._why)

    def progress(self) -> dict[str, Any]:
        """Return how hard the cables are pulled, and what stands in the way."""
        return {
            **super().progress(),
            "tight": self._tight,
            "done": float(self._tight),
            "pull_N": self._pull.tolist(),
            "trouble": self._why,
        }

    def _trouble(self, feedback: AxisFeedback) -> str:
        way = np.abs((feedback.position_rad - self._begun) * self._cable)
        most = int(way.argmax())
        if way[most] > _MOST_m:
            return f"cable {most}: {way[most]:.2f} m reeled in and not tight, {_MOST_m:g} m allowed"
        if self._cycles * self._parts.period_s > _MOST_S:
            return f"not tight within {_MOST_S:g} s"
        return ""

    def _finish(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        parts, control = self._parts, self._control
        if not parts.known:
            control.set_home(feedback, self._least)
            parts.estimator.set_lengths(feedback.position_rad, control.free_lengths_m)
        self._tight = parts.tight = True
        super().start(feedback, setpoint, torque_Nm)
        self._parts.cycle = feedback.cycle
