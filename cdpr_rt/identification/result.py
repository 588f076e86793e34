"""Result of the harmonic model's identification."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.compensation import FrictionFeedforward
from cdpr_rt.identification.remainder import at_angle
from cdpr_rt.identification.windows import TWO_PI, FrictionShape

# An identified value with its confidence interval.


@dataclass(frozen=True)
class ConfidenceInterval:
    """value ± half_width contains the true value with 95 % confidence, both in the value's unit."""

    value: float
    half_width: float


@dataclass(frozen=True)
class Harmonic:
    """One order of the cogging: cosine·cos(order·θ) + sine·sin(order·θ), θ from the index."""

    order: int
    cosine_Nm: float
    sine_Nm: float
    amplitude_Nm: ConfidenceInterval
    phase_deg: ConfidenceInterval
    """Phase of amplitude·sin(order·θ + phase)."""
    per_pole_pair: float
    hint: str


@dataclass(frozen=True)
class HarmonicResult:
    """The identified motor; torques in the unit of sent torques, angles from the index."""

    harmonics: tuple[Harmonic, ...]
    friction: FrictionFeedforward
    shape: FrictionShape
    coulomb_forward_Nm: ConfidenceInterval
    coulomb_backward_Nm: ConfidenceInterval
    viscous_Nms_rad: ConfidenceInterval
    inertia_kg_m2: ConfidenceInterval
    inertia_measured: bool
    """Whether the inertia was measured; otherwise no run was fast enough and the given value was
    kept."""
    latency_s: ConfidenceInterval
    lag_rad: ConfidenceInterval
    """Static part of the lag: half the shift between the curves of the two directions."""
    pole_pairs: int
    slots: int | None
    """Slots of the stator, if known."""
    directions: tuple[int, ...]
    """Measured directions, 1 and -1. The friction of the other is assumed to be the same."""
    coverage: float
    """Share of the turn on which the rotor was sliding."""
    cogging_trend_1_s: float
    """Relative change of the cogging per second, as the motor warms up."""
    dropped_fraction: float
    """Share of the samples in pieces, between jumps of the time, that are too short for a fit."""
    excluded_fraction: float
    """Share of the windows in which the rotor stood still or turned against the ramp."""
    residual_rms_Nm: float
    error_by_orders_Nm: FloatArray
    """Residual (rms) with the 0, 1, 2, ... most significant orders, (k + 1,)."""
    remainder_Nm: FloatArray
    """Cogging that the orders leave, as samples over the turn; see `remaining_curve`."""

    @property
    def orders(self) -> tuple[int, ...]:
        """The identified orders, increasing."""
        return tuple(h.order for h in self.harmonics)

    @property
    def amplitudes_Nm(self) -> tuple[float, ...]:
        """The amplitude of each order."""
        return tuple(h.amplitude_Nm.value for h in self.harmonics)

    def cogging_Nm(self, angle_rad: FloatArray) -> FloatArray:
        """Return the torque that holds the rotor against the cogging, without lag."""
        out = at_angle(self.remainder_Nm, angle_rad)
        for h in self.harmonics:
            out += h.cosine_Nm * np.cos(h.order * angle_rad)
            out += h.sine_Nm * np.sin(h.order * angle_rad)
        return out

    def tables(self, m: int) -> FloatArray:
        """Return the cogging on m samples over the turn for both directions, (2, m)."""
        angle = np.linspace(0.0, TWO_PI, m, endpoint=False)
        lag = self.lag_rad.value
        return np.vstack([self.cogging_Nm(angle - lag), self.cogging_Nm(angle + lag)])


def likely_cause(order: int, pole_pairs: int, slots: int | None = None) -> str:
    """Return the usual cause of a cogging of this order, as text; `slots` is None if unknown."""
    poles = 2 * pole_pairs
    known = {
        2: "twice per turn: oval stator, bent shaft or coupling",
        1: "once per turn: eccentric rotor, encoder or coupling",
        poles: "twice per pole pair: unequal gains of the current sensors, or magnets",
        pole_pairs: "once per pole pair: offset of a current sensor, or unequal magnets",
    }
    if order in known:
        return known[order]
    by_slots = [
        (math.lcm(slots, poles), f"{slots} slots and {poles} poles: slots against magnets"),
        (slots, f"the {slots} slots: unequal magnets"),
        (poles, f"the {poles} poles: unequal slots"),
        (pole_pairs, "the pole pairs: unequal poles, or the back EMF's shape"),
    ] if slots else [
        (6 * pole_pairs, "six per pole pair: slots against magnets, or the back EMF's shape"),
        (pole_pairs, "the pole pairs: slots against magnets"),
    ]  # fmt: skip
    for period, cause in by_slots:
        if order % period == 0:
            return f"a multiple of {cause}"
    also = " or slots" if slots else ""
    return f"no multiple of the pole pairs{also}: unequal slots or magnets, or a coupled part"
