"""The cables' lengths as they follow from a platform that stands at home, pulled tight."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.programs.platform.platform_program import PlatformParts

_CAME_IN_m = 0.003
"""By how much more than twice its stretch a cable that was tight may come in, pulled harder: what
friction had kept it from before, it stretches now."""


class LengthsAtHome:
    """Lengths (n,) at home, by the tensions that load cells measure, or that motors are asked for.

    Where no cell measures, the angle at the pretension is the one that the control's `pull_fit`
    finds, without friction and cogging; else the middle of those from above and from below, in
    which friction cancels out. Cogging that is known is corrected once the index is.
    """

    def __init__(self, parts: PlatformParts, cable_m: FloatArray, pretension_N: FloatArray) -> None:
        """Take the pretension at home, (n,)."""
        n = cable_m.size
        self._parts, self._cable = parts, np.array(cable_m)
        self._rising_rad = np.zeros(n)
        self._rad = np.full(n, np.nan)
        """Angles at which lengths were taken, nan once they have been corrected."""
        self._N, self._pretension_N = np.zeros(n), np.array(pretension_N)
        """Tensions that stretched them then, and the pretension."""
        self._sure = np.zeros(n, np.bool_)
        """Which of these are not those that a motor's cogging and friction have made."""
        parts.control.pull_fit.prepare(pretension_N)

    def forget(self) -> None:
        """Have nothing to correct any more."""
        self._rad[:] = np.nan

    def keep_rising(self, feedback: AxisFeedback) -> None:
        """Keep the angles at the pretension, which is come to from below."""
        self._rising_rad[:] = feedback.position_rad

    def slack_before(self, feedback: AxisFeedback, harder: float) -> str:
        """Return which cable was not tight as angles were kept, now pulled `harder`, "" for none.

        A tight one comes in by its stretch. Where the lengths may contradict each other they tell.
        """
        parts, pull_N = self._parts, self._pretension_N
        if self._cable.size > parts.model.size:
            return ""
        in_m = (self._rising_rad - feedback.position_rad) * self._cable
        stretch_m = parts.control.lengths_at_home(pull_N)
        stretch_m -= parts.control.lengths_at_home(harder * pull_N)
        allowed_m = 2.0 * stretch_m + _CAME_IN_m
        i = int((in_m - allowed_m).argmax())
        if in_m[i] <= allowed_m[i]:
            return ""
        return (
            f"{parts.names[i]}: came in by {1e3 * in_m[i]:.1f} mm as it was pulled with "
            f"{harder * pull_N[i]:.0f} N in place of {pull_N[i]:.0f} N, {1e3 * allowed_m[i]:.1f} "
            "mm allowed: what it was pulled with before did not overcome its winch's friction, or "
            "the platform has moved on its stand; take up slack by hand, or hold the platform"
        )

    def take(self, feedback: AxisFeedback) -> FloatArray:
        """Return the lengths (n,) at the pretension, which is come to from above."""
        control, estimate = self._parts.control, self._parts.estimator.estimate
        measured, fitted_rad = estimate.tension_measured, control.pull_fit.end()
        middle_rad = 0.5 * (feedback.position_rad + self._rising_rad)
        found = np.isfinite(fitted_rad)
        self._sure[:] = measured | found
        self._rad[:] = np.where(found, fitted_rad, middle_rad)
        self._rad[measured] = feedback.position_rad[measured]
        self._N[:] = np.where(measured, estimate.tension_N, self._pretension_N)
        turned_m = self._cable * (feedback.position_rad - self._rad)
        return np.asarray(control.lengths_at_home(self._N) + turned_m)

    def correct(self, feedback: AxisFeedback) -> None:
        """Correct lengths for cogging and friction that are known, once the index is.

        These torques were part of the tensions by which the cables stretched.
        """
        parts, control, known = self._parts, self._parts.control, self._parts.compensation
        if known is None or np.isnan(self._rad).any():
            return
        torque_error_N = known.standing_Nm(self._rad, feedback) / self._cable
        torque_error_N[self._sure] = 0.0
        stretch_error_m = control.lengths_at_home(self._N + torque_error_N)
        stretch_error_m -= control.lengths_at_home(self._N)
        self.forget()
        length_m = parts.estimator.estimate.cable_length_m + stretch_error_m
        parts.estimator.set_lengths(feedback.position_rad, length_m)
        control.take_lengths(length_m, feedback)
