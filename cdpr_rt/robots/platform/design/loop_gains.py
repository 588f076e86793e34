"""What a platform's loop goes by in a cycle, what it keeps, and how late it acts.

The drives' delay is assumed, the same for all robots: it is not read from their profiles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

OBSERVER_rad_s = 2.0 * math.pi * 400.0
DAMPING_RATIO = 0.55
DRIVE_LATENCY_s, _LATENCY_CYCLES = 0.8e-3, 1.5
"""Assumed delay of any drive, whatever its profile has; cycles of transfer and of holding."""


@dataclass(frozen=True)
class LoopGains:
    """What the loop goes by in a cycle; see `loop_kernel.SETTINGS`."""

    bandwidth_rad_s: float
    """Of each mode of the platform, or less where the damping would ask for too much."""
    damping_N_s_m: float
    """The most that is asked of a cable in each mode."""
    smooth: float
    """Share of the low-passed velocity in the velocity that is damped."""
    smoother_rad_s: float
    """Double pole of the low-pass."""
    null_damping_N_s_m: float
    """Damping of cables that pull against each other."""
    integral_share: float
    """Rate of the integral part over 2 ζ ω of the slowest mode, at most."""
    integral_1_s: float
    rotor_kg: float
    """Mass of a rotor, as its cable feels it."""
    follows_pose: bool = False
    """Whether tensions are planned for where the platform is, not for where it is wanted."""


@dataclass(frozen=True)
class LoopMargins:
    """What a loop keeps at one of several poses, the worst over the stiffness."""

    modulus: float
    frequency_Hz: float
    """Where that is."""
    slowest_rad_s: float
    fastest_rad_s: float
    """Of the platform's modes in closed loop, without delays."""

    @property
    def gain(self) -> float:
        """By how much the gain may at least grow, or shrink to its inverse: 1/(1 - μ)."""
        return 1.0 / (1.0 - self.modulus)

    @property
    def phase_rad(self) -> float:
        """By how much the phase may at least be off: 2 asin(μ/2)."""
        return 2.0 * math.asin(0.5 * self.modulus)


def latency_s(period_s: float) -> float:
    """Return how late the loop acts: an assumed drive, transfer, and half a cycle of holding."""
    return DRIVE_LATENCY_s + _LATENCY_CYCLES * period_s
