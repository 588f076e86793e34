"""Physical bounds of the parameters that are identified for a motor or its winch.

They do not judge the quality of a parameter. A parameter beyond them is impossible for such a
motor, and compensation with it would move the motor.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cdpr_profiles.motor import Motor

COMPENSATION_SHARE: Final = 0.25
"""Cogging and dry friction together, as a share of rated torque; 0.02 to 0.1 is usual."""
BIAS_SHARE: Final = 0.02
"""Mean torque over a turn and both directions, as a share of rated torque.

Cogging has zero mean, and the friction of the two directions differs less than this. A mean torque
up to this share does not overcome dry friction.
"""
VISCOUS_SHARE: Final = 0.2
"""Viscous friction at rated speed, as a share of rated torque; 0.1 is usual."""
LEAST_INERTIA_RATIO: Final = 0.5
"""Inertia divided by the rotor's; below 1 because the torque constant may be wrong."""
MOST_INERTIA_RATIO: Final = 50.0
MOST_SPEED_RATIO: Final = 2.0
"""An axis' speed limit divided by the motor's rated speed."""
LEAST_STRIBECK_RAD_S: Final = 1e-4
MOST_GAIN_ERROR: Final = 0.5
"""Relative difference between torque per tension and drum radius over gear ratio."""
WINCH_FRICTION_SHARE: Final = 0.5
"""Bias and friction of a winch without tension, as a share of rated torque."""

Faults = Iterator[tuple[str, str]]
"""(key, problem) for each value outside its bounds."""


@dataclass(frozen=True)
class MotorBounds:
    """Bounds of the identified parameters of a motor, SI."""

    motor: Motor
    torque_Nm: float = math.inf
    """Torque limit of the motor's axis."""

    @property
    def compensation_Nm(self) -> float:
        """Largest torque that may be added to a controller's torque."""
        return min(COMPENSATION_SHARE * self.motor.rated_torque_Nm, self.torque_Nm)

    def compensation(self, key: str, torque_Nm: float) -> Faults:
        """Yield a fault for a torque that is too large to be cogging and dry friction."""
        of = f"{100 * COMPENSATION_SHARE:g} % of the rated torque of {self.motor.model}"
        if self.torque_Nm < COMPENSATION_SHARE * self.motor.rated_torque_Nm:
            of = "the axis' torque limit"
        yield from within(key, torque_Nm, -self.compensation_Nm, self.compensation_Nm, f"Nm, {of}")

    def bias(self, key: str, torque_Nm: float) -> Faults:
        """Yield a fault for a bias that would turn the motor without a command."""
        yield from self._within_share(key, torque_Nm, BIAS_SHARE)

    def viscous(self, key: str, viscous_Nms_rad: float) -> Faults:
        """Yield a fault for viscous friction that is too large for the motor."""
        most = VISCOUS_SHARE * self.motor.rated_torque_Nm / self.motor.rated_speed_rad_s
        of = f"Nm s/rad, {100 * VISCOUS_SHARE:g} % of the rated torque at rated speed"
        yield from within(key, viscous_Nms_rad, -most, most, of)

    def stribeck_speed(self, key: str, speed_rad_s: float) -> Faults:
        """Yield a fault for a Stribeck speed beyond the motor's rated speed."""
        most = self.motor.rated_speed_rad_s
        yield from within(key, speed_rad_s, LEAST_STRIBECK_RAD_S, most, "rad/s, the rated speed")

    def inertia(self, key: str, inertia_kg_m2: float) -> Faults:
        """Yield a fault for an inertia far from the rotor's."""
        rotor = self.motor.rotor_inertia_kg_m2
        low, high = LEAST_INERTIA_RATIO * rotor, MOST_INERTIA_RATIO * rotor
        of = f"kg m2, {LEAST_INERTIA_RATIO:g} to {MOST_INERTIA_RATIO:g} times the rotor's inertia"
        yield from within(key, inertia_kg_m2, low, high, of)

    def tension_gain(self, key: str, gain_m: float, nominal_m: float) -> Faults:
        """Yield a fault for a torque per tension far from drum radius over gear ratio."""
        low, high = 1.0 - MOST_GAIN_ERROR, 1.0 + MOST_GAIN_ERROR
        of = f"m, {low:g} to {high:g} times drum_radius_m / gear_ratio of the winch"
        yield from within(key, gain_m, low * nominal_m, high * nominal_m, of)

    def winch_friction(self, key: str, torque_Nm: float) -> Faults:
        """Yield a fault for a bias or friction too large for a winch without tension."""
        yield from self._within_share(key, torque_Nm, WINCH_FRICTION_SHARE)

    def _within_share(self, key: str, torque_Nm: float, share: float) -> Faults:
        bound = share * self.motor.rated_torque_Nm
        of = f"Nm, {100 * share:g} % of the rated torque of {self.motor.model}"
        yield from within(key, torque_Nm, -bound, bound, of)


def within(key: str, value: float, low: float, high: float, of: str) -> Faults:
    """Yield a fault for a value outside `low` to `high`; `of` is the unit and the reason."""
    if not low <= value <= high:
        yield key, f"value {value:.6g}; allowed: {low:.4g} to {high:.4g} {of}"
