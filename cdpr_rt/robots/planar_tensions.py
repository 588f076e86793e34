"""Tensions of a planar robot with one cable more than directions: eqs. (2.13) to (2.19).

Where two directions are held by three cables, all tensions that carry a wrench lie on a line
t = t0 + k·u; those within bounds are a stretch of it, or none.
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.robots.planar_kinematics import GeometryError

_FAST = 0.85
"""Share of the reserve that a loop may use at once."""
_STOPS = 32


class TensionOutcome(IntEnum):
    """Whether tensions within their bounds carry the wrench."""

    FEASIBLE = 0
    NO_TENSION = 1
    """No tensions within the bounds carry it; those that miss them least are given."""
    SINGULAR = 2
    """The cables cannot hold one direction whatever their tensions."""


@jit
def line_of_tensions(J: FloatArray, wrench: FloatArray, t0: FloatArray, u: FloatArray) -> bool:
    """Write t0 = -W⁺w_e and the unit vector u of the kernel, W = -Jᵀ, all (3,); J is (3, 2).

    W = RᵀQᵀ by two Householder reflections, so that u is the third column of Q, eq. (2.18), and
    t0 the solution without a part along it, eq. (2.17). `u` points where tensions grow. False
    where W has not full rank.
    """
    # Q is built in place by Gram and Schmidt, twice: as exact as Householder for two columns
    q1x, q1y, q1z = -J[0, 0], -J[1, 0], -J[2, 0]
    r11 = math.sqrt(q1x * q1x + q1y * q1y + q1z * q1z)
    if not r11 > 1e-9:
        return False
    q1x, q1y, q1z = q1x / r11, q1y / r11, q1z / r11
    q2x, q2y, q2z = -J[0, 1], -J[1, 1], -J[2, 1]
    r21 = 0.0
    for _ in range(2):
        c = q1x * q2x + q1y * q2y + q1z * q2z
        r21 += c
        q2x, q2y, q2z = q2x - c * q1x, q2y - c * q1y, q2z - c * q1z
    r22 = math.sqrt(q2x * q2x + q2y * q2y + q2z * q2z)
    if not r22 > 1e-9:
        return False
    q2x, q2y, q2z = q2x / r22, q2y / r22, q2z / r22
    u[0] = q1y * q2z - q1z * q2y
    u[1] = q1z * q2x - q1x * q2z
    u[2] = q1x * q2y - q1y * q2x
    # Rᵀ z = -w_e, then t0 = Q z
    z1 = -wrench[0] / r11
    z2 = (-wrench[1] - r21 * z1) / r22
    t0[0] = q1x * z1 + q2x * z2
    t0[1] = q1y * z1 + q2y * z2
    t0[2] = q1z * z1 + q2z * z2
    if u[0] + u[1] + u[2] < 0.0:
        for i in range(3):
            u[i] = -u[i]
    return True


@jit
def bounds_of_k(
    t0: FloatArray, u: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[float, float]:
    """Return between which k all of t0 + k·u lie within their bounds; the first larger: none."""
    least, most = -math.inf, math.inf
    for i in range(t0.size):
        a, b = low[i] - t0[i], high[i] - t0[i]
        if abs(u[i]) < 1e-9:  # this cable's tension is what it is
            if a > 0.0 or b < 0.0:
                return math.inf, -math.inf
            continue
        first, last = (a / u[i], b / u[i]) if u[i] > 0.0 else (b / u[i], a / u[i])
        least, most = max(least, first), min(most, last)
    return least, most


@jit
def least_violation(
    t0: FloatArray, u: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[float, float]:
    """Return the k at which the tension furthest outside its bounds is least so, and by how much.

    How far outside is a convex function of k: the golden section finds its minimum.
    """
    span = 1.0
    for i in range(t0.size):
        span = max(span, abs(t0[i]), abs(low[i]), abs(high[i]))
    left, right = -1e3 * span, 1e3 * span
    ratio = 0.6180339887498949
    x, y = right - ratio * (right - left), left + ratio * (right - left)
    fx, fy = _outside(t0, u, low, high, x), _outside(t0, u, low, high, y)
    for _ in range(80):
        if fx <= fy:
            right, y, fy = y, x, fx
            x = right - ratio * (right - left)
            fx = _outside(t0, u, low, high, x)
        else:
            left, x, fx = x, y, fy
            y = left + ratio * (right - left)
            fy = _outside(t0, u, low, high, y)
    k = 0.5 * (left + right)
    return k, _outside(t0, u, low, high, k)


@jit
def _outside(t0: FloatArray, u: FloatArray, low: FloatArray, high: FloatArray, k: float) -> float:
    worst = -math.inf
    for i in range(t0.size):
        t = t0[i] + k * u[i]
        worst = max(worst, low[i] - t, t - high[i])
    return worst


@jit
def distribute(
    J: FloatArray,
    wrench: FloatArray,
    low: FloatArray,
    high: FloatArray,
    share: float,
    t: FloatArray,
    room: FloatArray,
) -> tuple[int, float]:
    """Write tensions that carry `wrench` (2,), the force of all else on the platform: eq. (2.16).

    `J` (3, 2) is the Jacobian, `low` and `high` (3,) are the bounds, `room` (2, 3) is overwritten.
    Of the stretch of k within the bounds, `share` (0 to 1) of the way from the least tensions to
    the greatest is taken: least is least friction, and k is continuous over the workspace.
    Returns a `TensionOutcome` and by how much a tension is outside, N; where no tensions within
    the bounds carry the wrench those that still carry it and miss the bounds least are written.
    """
    t0, u = room[0], room[1]
    if not line_of_tensions(J, wrench, t0, u):
        for i in range(3):
            t[i] = low[i]
        return 2, math.inf
    least, most = bounds_of_k(t0, u, low, high)
    outcome, outside = 0, 0.0
    k = least + share * (most - least)
    if least > most or not math.isfinite(least) or not math.isfinite(most):
        outcome = 1
        k, outside = least_violation(t0, u, low, high)
    for i in range(3):
        t[i] = t0[i] + k * u[i]
    return outcome, outside


@jit
def carry(
    J: FloatArray,
    wrench: FloatArray,
    force: FloatArray,
    low: FloatArray,
    high: FloatArray,
    reserve: float,
    pace: float,
    lift: float,
    t: FloatArray,
    carried: FloatArray,
    u: FloatArray,
    room: FloatArray,
) -> tuple[int, float, float, float]:
    """Write tensions that carry `wrench` (2,) and exert `force` (2,) besides, as far as they can.

    `low` and `high` (3,) lie within the true bounds by `reserve`, N: between them are the least
    tensions that carry the wrench alone. A loop asks for the force, most of which friction takes
    before it gets to the cables; it may use half of the reserve. Where it needs more, k is lifted,
    by a share `pace` of what is missing in each cycle from the last cycle's `lift` on: slowly,
    since a k that followed the loop's every swing would be a loop of its own. What does not fit
    until then is left out. `t` (3,) are the tensions, `carried` (3,) those without the force, `u`
    (3,) the unit vector of the kernel; `room` (4, 3) is overwritten. Returns a `TensionOutcome`
    for the wrench, by how much a tension is outside low and high, N, the share of the force that
    is exerted, and the lift.
    """
    t0, more, least_t, most_t = room[0], room[1], room[2], room[3]
    for k in range(2):
        force[k] = -force[k]  # as if all else exerted it on the platform
    singular = not line_of_tensions(J, force, more, u)
    for k in range(2):
        force[k] = -force[k]
    if singular or not line_of_tensions(J, wrench, t0, u):
        for i in range(3):
            t[i] = carried[i] = low[i]
            u[i] = 0.0
        return 2, math.inf, 0.0, 0.0
    first, last = bounds_of_k(t0, u, low, high)
    if not first <= last:
        at, outside = least_violation(t0, u, low, high)
        for i in range(3):
            carried[i] = t0[i] + at * u[i]
            t[i] = min(max(carried[i] + more[i], low[i] - reserve), high[i] + reserve)
        return 1, outside, 0.0, 0.0
    for i in range(3):
        least_t[i], most_t[i] = low[i] - 0.5 * reserve, high[i] + 0.5 * reserve
        t[i] = t0[i] + more[i]
    a, b = bounds_of_k(t, u, least_t, most_t)
    wanted = min(max(0.0, a - first), last - first) if a <= b else 0.0
    lift = min(lift + pace * (wanted - lift), last - first)
    share = 1.0
    for i in range(3):
        carried[i] = t0[i] + (first + lift) * u[i]
        least, most = low[i] - _FAST * reserve, high[i] + _FAST * reserve
        if carried[i] + more[i] < least:
            share = min(share, (carried[i] - least) / -more[i])
        elif carried[i] + more[i] > most:
            share = min(share, (most - carried[i]) / more[i])
    for i in range(3):
        t[i] = carried[i] + share * more[i]
    return 0, 0.0, share, lift


@jit
def stand(
    p: FloatArray,
    a: FloatArray,
    b: FloatArray,
    wrenches: FloatArray,
    low: FloatArray,
    high: FloatArray,
    J: FloatArray,
    t: FloatArray,
    room: FloatArray,
) -> tuple[int, float]:
    """Try whether tensions within bounds carry each of the `wrenches` (k, 2) at position `p` (2,).

    `a` and `b` (3, 2) are exit and anchor points; `J` (3, 2) and `room` (2, 3) are overwritten.
    Returns a `TensionOutcome` and by how much a tension is outside, N, of the worst of them, whose
    tensions are in `t` (3,) then.
    """
    for i in range(3):
        x, y = p[0] + b[i, 0] - a[i, 0], p[1] + b[i, 1] - a[i, 1]
        rho = math.sqrt(x * x + y * y)
        if not rho > 0.0:
            return 2, math.inf
        J[i, 0], J[i, 1] = x / rho, y / rho
    t0, u = room[0], room[1]
    worst = 0.0
    for k in range(wrenches.shape[0]):
        if not line_of_tensions(J, wrenches[k], t0, u):
            return 2, math.inf
        least, most = bounds_of_k(t0, u, low, high)
        if least <= most:
            continue
        at, outside = least_violation(t0, u, low, high)
        if outside > worst:
            worst = outside
            for i in range(3):
                t[i] = t0[i] + at * u[i]
    return (1 if worst > 0.0 else 0), worst


@jit
def first_obstacle(
    start: FloatArray,
    end: FloatArray,
    a: FloatArray,
    b: FloatArray,
    wrenches: FloatArray,
    low: FloatArray,
    high: FloatArray,
    p: FloatArray,
    J: FloatArray,
    t: FloatArray,
    room: FloatArray,
) -> tuple[int, float]:
    """Go along the straight line to `end` and stop at the first `p` (2,) where nothing can stand.

    A start where nothing can is left first. Otherwise as `stand`.
    """
    inside = False
    outcome, outside = 0, 0.0
    for k in range(_STOPS + 1):
        for i in range(2):
            p[i] = start[i] + (end[i] - start[i]) * k / _STOPS
        outcome, outside = stand(p, a, b, wrenches, low, high, J, t, room)
        inside = inside or outcome == 0
        if inside and outcome != 0:
            return outcome, outside
    return outcome, outside


class PlanarTensions:
    """Tensions for a planar robot with three cables, and where in the plane there are any."""

    def __init__(self, low_N: FloatArray, high_N: FloatArray, share: float = 0.0) -> None:
        """Take bounds (3,), each lower one below its upper one; raises GeometryError."""
        self.low = np.array(low_N, float)
        self.high = np.array(high_N, float)
        if self.low.shape != (3,) or self.high.shape != (3,):
            raise GeometryError(
                f"tension bounds {self.low.shape}, {self.high.shape}; allowed: (3,): eq. (2.18) is "
                "for three cables"
            )
        if not ((self.low >= 0.0).all() and (self.low < self.high).all()):
            raise GeometryError(
                f"tension bounds {self.low} to {self.high} N; allowed: 0 and more, each below"
            )
        self.share = share
        self._room = np.zeros((2, 3))

    def distribute(self, J: FloatArray, wrench_N: FloatArray) -> tuple[FloatArray, str]:
        """Return tensions (3,) for one Jacobian (3, 2), and what is missing, or an empty text."""
        t = np.zeros(3)
        outcome, outside = distribute(
            np.ascontiguousarray(J), np.asarray(wrench_N, float), self.low, self.high,
            self.share, t, self._room,
        )  # fmt: skip
        return t, self.missing(outcome, outside, t)

    def missing(self, outcome: int, outside_N: float, t: FloatArray) -> str:
        """Return in words why tensions are not feasible, an empty text where they are."""
        if outcome == TensionOutcome.FEASIBLE:
            return ""
        if outcome == TensionOutcome.SINGULAR:
            return "the cables cannot hold one direction, whatever their tensions"
        below, above = self.low - t, t - self.high
        i = int(np.argmax(np.maximum(below, above)))
        return (
            f"cable {i} would need {t[i]:.1f} N, {self.low[i]:g} to {self.high[i]:g} N allowed: "
            f"{outside_N:.1f} N outside"
        )
