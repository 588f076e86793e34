"""Model of a cable: rigid, elastic, or an elastic catenary."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import GeometryError
from cdpr_rt.jit import jit

_MOST_ITERATIONS = 100
_SOLVED = 1e-14


@dataclass(frozen=True)
class CableModel:
    """Stiffness EA and weight of the cables: how long one is that is not stretched.

    With neither it is straight and rigid, with a stiffness straight and elastic, with a weight an
    elastic catenary. The part of it on a pulley is stretched alike and has no weight.
    """

    stiffness_N: float = math.inf
    """EA: tension over strain."""
    weight_N_m: float = 0.0
    """Weight per unstretched length."""

    def __post_init__(self) -> None:
        if not self.stiffness_N > 0.0:
            raise GeometryError(f"cable stiffness {self.stiffness_N:g} N; allowed: above 0")
        if not 0.0 <= self.weight_N_m < math.inf:
            raise GeometryError(f"cable weight {self.weight_N_m:g} N/m; allowed: 0 and above")

    @property
    def is_rigid(self) -> bool:
        """Whether tension does not matter."""
        return self.weight_N_m == 0.0 and self.stiffness_N == math.inf


@jit
def unstretched_length(
    across: float, height: float, tension: float, compliance: float, weight: float
) -> float:
    """Return the length without tension of a cable between two points; nan where none will do.

    Of the end where `tension` acts, the other end is `across` beside it, and it is `height` above
    the other one. Elastic catenary: with H, V the components of `tension` t, T' = √(H² + (V - wL)²)
    the tension at the other end, k = 2/(t + T'), x = wL/(t + T'), compliance c = 1/EA

        across = H L (c + k artanh(x)/x)        height = (V - wL/2) L (c + k)

    which is (3.81) to (3.84) with stretch and with ends at any height. Both have H and V in terms
    of L, and H² + V² = t² then is a quadratic equation of L², whose smaller root is the taut
    cable; the two brackets, hardly dependent on L, follow by iteration. Without weight it is
    straight: L = √(across² + height²)/(1 + t/EA).
    """
    straight = math.sqrt(across * across + height * height)
    if weight == 0.0:
        return straight / (1.0 + tension * compliance)
    if not tension > 0.0:
        return math.nan
    beside = above = compliance + 1.0 / tension
    length = 0.0
    for _ in range(_MOST_ITERATIONS):
        h, v = across / beside, height / above
        middle = tension * tension - weight * v
        square = h * h + v * v
        discriminant = middle * middle - weight * weight * square
        if not (middle > 0.0 and discriminant >= 0.0):
            return math.nan
        before = length
        length = math.sqrt(2.0 * square / (middle + math.sqrt(discriminant)))
        if abs(length - before) <= _SOLVED * length:
            return length
        horizontal, vertical = h / length, v / length - 0.5 * weight * length
        ends = tension + math.sqrt(horizontal * horizontal + vertical * vertical)
        x = weight * length / ends
        beside = compliance + 2.0 / ends * (math.atanh(x) / x if x > 1e-5 else 1.0 + x * x / 3.0)
        above = compliance + 2.0 / ends
    return math.nan


@jit
def write_unstretched_lengths(
    direction: FloatArray,
    free: FloatArray,
    arc: FloatArray,
    up: FloatArray,
    tension: FloatArray,
    compliance: float,
    weight: float,
    lengths: FloatArray,
) -> None:
    """Write the `lengths` (n,) without tension of cables under `tension` (n,) at the platform.

    `direction` (3, n) and `free` (n,) are those of the free parts as straight lines, `arc` (n,)
    lengths on pulleys, `up` the unit vector against gravity.
    """
    for i in range(lengths.size):
        x, y, z = direction[0, i], direction[1, i], direction[2, i]
        sine = x * up[0] + y * up[1] + z * up[2]
        x, y, z = x - sine * up[0], y - sine * up[1], z - sine * up[2]
        across = free[i] * math.sqrt(x * x + y * y + z * z)
        lengths[i] = unstretched_length(
            across, free[i] * sine, tension[i], compliance, weight
        ) + arc[i] / (1.0 + tension[i] * compliance)
