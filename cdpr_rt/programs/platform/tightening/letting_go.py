"""Whether cables are tight while what presses a platform on its stand is let go."""

from __future__ import annotations

import math

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.programs.platform.platform_program import PlatformParts, distance_m

_AGREE_m = 0.002
"""By how much lengths that were just taken may disagree, besides what friction stretches."""
_OFF_HOME_m = 0.006
"""How far from home lengths that were just taken there may have the platform, and nobody is told:
friction on its stand makes up to 4 mm, which ends as winches turn."""
_RUNS_IN_m_s = 0.2
"""Speed that no winch has whose cable is tight while the platform stands."""
_REMEDY = (
    "take up slack by hand, have the platform held, or have the cables pulled with more than their "
    "winches rub: see `cdpr robot show`"
)


class LettingGo:
    """Tells cables that were taken for tight, and are slack, by their speeds and lengths.

    Lengths that were taken where the platform stands agree there, whatever the geometry's errors.
    While tensions change to those that hold it, friction of the winches accounts for what they may
    disagree by; so does no slack cable, which is reeled in meanwhile.
    """

    def __init__(self, parts: PlatformParts, cable_m: FloatArray, pretension_N: FloatArray) -> None:
        """Take the pretension at home, (n,)."""
        self._parts, self._cable = parts, cable_m
        control = parts.control
        rubbed_N = pretension_N + control.pull_fit.taken_up_N
        stretch_m = control.lengths_at_home(pretension_N) - control.lengths_at_home(rubbed_N)
        self._allowed_m = min(parts.home_lengths_allowed_m, _AGREE_m + float(stretch_m.max()))
        self._inwards_m_s = np.zeros(cable_m.size)

    def runs_in(self) -> str:
        """Return which winch reels in its cable as none does that is tight, "" for none."""
        velocity_rad_s = self._parts.estimator.estimate.velocity_rad_s
        np.multiply(velocity_rad_s, self._cable, out=self._inwards_m_s)
        i = int(self._inwards_m_s.argmin())
        if self._inwards_m_s[i] >= -_RUNS_IN_m_s:
            return ""
        return (
            f"{self._parts.names[i]}: its winch runs in with {-self._inwards_m_s[i]:.2f} m/s, "
            f"{_RUNS_IN_m_s:g} m/s allowed: its cable was slack; {_REMEDY}"
        )

    def disagree(self) -> str:
        """Return by how much lengths taken at home disagree, if too much, and whose most."""
        control = self._parts.control
        if control.residual_m <= self._allowed_m:
            return ""
        most = (
            f", most that of {self._parts.names[control.suspect]}" if control.suspect >= 0 else ""
        )
        return (
            f"the cables' lengths, just taken at home, disagree by {1e3 * control.residual_m:.1f} "
            f"mm{most}; {1e3 * self._allowed_m:.1f} mm allowed, which friction may make: a cable "
            f"was slack, or the platform has moved on its stand; {_REMEDY}"
        )

    def off_home(self) -> str:
        """Return how far from home lengths taken there have the platform, "" for not far.

        Cables that all sag more than is believed do not contradict each other: what heavy ones are
        pulled with may not overcome what their winches rub.
        """
        parts = self._parts
        here, home, k = parts.control.estimated, parts.model.home, parts.model.positions
        off_m = distance_m(here, home, parts.scale_m)
        if off_m <= _OFF_HOME_m:
            return ""
        off = f"{1e3 * float(np.linalg.norm(here[:k] - home[:k])):.0f} mm from there"
        if here.size > k:
            off += f", turned by {math.degrees(np.linalg.norm(here[k:])):.1f} deg"
        return (
            f"by the cables' lengths, taken at home, the platform is {off}: targets will be "
            f"as far off, or further; cables sagged or were slack, or it has moved; {_REMEDY}"
        )
