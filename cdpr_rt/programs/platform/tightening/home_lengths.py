"""Cable lengths taken at home, and corrected once the motors' cogging and friction are known."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.programs.platform.platform_program import PlatformParts


class HomeLengths:
    """The lengths of cables that are tight while the platform stands at home.

    They follow from home's pose and the tensions that stretch the cables. Where no load cell
    measures these, they are the torques', of which cogging and friction are a part.
    """

    def __init__(self, parts: PlatformParts, cable_m_per_rad: FloatArray) -> None:
        self._parts, self._control = parts, parts.control
        self._cable = cable_m_per_rad
        self._position_rad = np.full(cable_m_per_rad.size, np.nan)
        """Angles at which they were taken, nan once they have been corrected."""
        self._tension_N = np.zeros(cable_m_per_rad.size)
        self._measured = np.zeros(cable_m_per_rad.size, np.bool_)

    def forget(self) -> None:
        """Have nothing to correct: lengths are known otherwise."""
        self._position_rad[:] = np.nan

    def take(
        self, feedback: AxisFeedback, rising_rad: FloatArray, pretension_N: FloatArray
    ) -> FloatArray:
        """Return the lengths (n,) at the motors' present angles.

        The tension has come down to `pretension_N` (n,) again, through which it rose at the angles
        `rising_rad` (n,): halfway between, friction cancels out.
        """
        estimate = self._parts.estimator.estimate
        self._measured[:] = estimate.tension_measured
        middle_rad = 0.5 * (feedback.position_rad + rising_rad)
        self._position_rad[:] = np.where(self._measured, feedback.position_rad, middle_rad)
        self._tension_N[:] = np.where(self._measured, estimate.tension_N, pretension_N)
        hysteresis = self._cable * (feedback.position_rad - self._position_rad)
        return np.asarray(self._control.lengths_at_home(self._tension_N) + hysteresis)

    def correct(self, feedback: AxisFeedback) -> None:
        """Correct lengths taken for cogging and friction, once the motors' indices are known."""
        parts, control, compensation = self._parts, self._control, self._parts.compensation
        if compensation is None or np.isnan(self._position_rad).any():
            return
        torque_Nm = compensation.standing_Nm(self._position_rad, feedback)
        error_N = np.where(self._measured, 0.0, torque_Nm / self._cable)
        stretch_error_m = control.lengths_at_home(self._tension_N + error_N)
        stretch_error_m -= control.lengths_at_home(self._tension_N)
        self._position_rad[:] = np.nan
        length_m = parts.estimator.estimate.cable_length_m + stretch_error_m
        parts.estimator.set_lengths(feedback.position_rad, length_m)
        control.take_lengths(length_m, feedback)
