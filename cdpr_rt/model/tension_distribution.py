"""Tension distribution for any robot with at least as many cables as controlled directions.

It finds tensions t (n,) with W t + w_e = 0, eq. (3.80), and low <= t <= high: W (d, n) is the
wrench matrix, w_e (d,) the wrench of all else on the platform.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.model.null_space import null_space
from cdpr_rt.model.tension_qp import (
    NOTHING,
    furthest_outside,
    gram_schmidt,
    nearest_wrench,
    project,
    start,
)


class TensionOutcome(IntEnum):
    """Outcome of one call of a tension distribution."""

    FEASIBLE = 0
    """The tensions carry the wrench within their bounds."""
    SUBSTITUTED = 1
    """As FEASIBLE, but found by minimum deviation, because the chosen method found no tensions."""
    NEAREST = 2
    """No tensions within the bounds carry the wrench; the result exerts the nearest wrench."""
    SINGULAR = 3
    """The wrench matrix is rank deficient; the result exerts the nearest wrench."""
    REFUSED = 4
    """An argument is not finite or has a wrong size, or bounds are reversed; nothing is written."""


# Tensions without a search: Pott's closed form (2009) and its improvement (2013).


@jit
def closed_form(
    space: FloatArray,
    r: int,
    bounds: FloatArray,
    t: FloatArray,
    scratch: FloatArray,
) -> bool:
    """Write the tensions t_m - W^+(w_e + W t_m) (n,) nearest to wanted ones t_m.

    While tensions are outside their bounds, the one furthest outside is fixed at its bound, and the
    others are computed again. This ends when no null direction is left. `space` (n + 1, n) with `r`
    null directions and `bounds` (3, n) are those of `null_space`. `scratch` (4, m, m), m >= n and
    8, is overwritten. Returns False if this finds no tensions within bounds, although some may
    exist.
    """
    Q, x, column, c, free = scratch[0], scratch[1, 0], scratch[1, 1], scratch[1, 2], scratch[1, 3]
    tolerance = start(space, r, bounds, x)
    for fixed in range(r + 1):
        cable, violation = furthest_outside(space, r, bounds, x, t, tolerance)
        if cable < 0:
            return True
        if fixed == r:
            return False
        for k in range(r):
            column[k] = space[1 + k, cable]
        # the direction that changes this cable's tension, but no fixed tension
        length = gram_schmidt(column, r, Q, fixed, c, free)
        if length <= NOTHING:
            return False
        for k in range(r):
            Q[k, fixed] = free[k] / length
            x[k] += violation / length * Q[k, fixed]
    return False


# The polygon of all tensions within bounds, for two redundant cables. With t = t0 + N' lambda and
# two null directions, each bound is a half plane of lambda, and the tensions within bounds are a
# convex polygon: Gouttefarde, Lamaury, Reichert and Bruckmann (2015), "A versatile tension
# distribution algorithm for n-DOF parallel robots driven by n+2 cables". Its vertices are visited
# counter-clockwise. With one redundant cable it is a segment, with none a point.

_PARALLEL = 1e-12
"""A cable does not bound a line if its tension changes by less than this per newton along the
line."""
_THIN = 1e-12
"""Area, as a share of the squared perimeter, below which a polygon counts as a segment."""


@jit
def centroid(
    space: FloatArray, r: int, bounds: FloatArray, t: FloatArray, scratch: FloatArray
) -> bool:
    """Replace `t` (n,), any tensions within bounds, by the centroid of all of them.

    `space` (n + 1, n) with `r` null directions and `bounds` (3, n) are those of `null_space`.
    `scratch` (4, m, m), m >= n and 8, is overwritten. If r is above 2, it leaves `t` unchanged and
    returns False.
    """
    n = space.shape[1]
    if r > 2:
        return False
    if r == 0:
        return True
    x, chosen = scratch[0, 0], scratch[0, 1]
    x[0] = x[1] = chosen[1] = 0.0
    for k in range(r):
        for i in range(n):
            x[k] += space[1 + k, i] * (t[i] - space[0, i])
    if r == 1:
        chosen[0] = _middle_of_segment(space, bounds)
    else:
        size = scratch.shape[1] ** 2
        X, Y, entered = scratch[1].reshape(size), scratch[2].reshape(size), scratch[3].reshape(size)
        first, last = _walk(space, bounds, x, X, Y, entered)
        chosen[0], chosen[1] = x[0], x[1]
        if last > first:
            _centre_of_area(X[first:last], Y[first:last], chosen)
    for i in range(n):
        t[i] = space[0, i]
        for k in range(r):
            t[i] += space[1 + k, i] * chosen[k]
    return True


@jit
def _middle_of_segment(space: FloatArray, bounds: FloatArray) -> float:
    """Return the lambda in the middle of the segment."""
    least, most = -math.inf, math.inf
    for i in range(space.shape[1]):
        u = space[1, i]
        if abs(u) > _PARALLEL:
            a, b = (bounds[0, i] - space[0, i]) / u, (bounds[1, i] - space[0, i]) / u
            least, most = max(least, min(a, b)), min(most, max(a, b))
    return 0.5 * (least + most)


@jit
def _walk(
    space: FloatArray,
    bounds: FloatArray,
    x: FloatArray,
    X: FloatArray,
    Y: FloatArray,
    entered: FloatArray,
) -> tuple[int, int]:
    """Write vertices of the polygon about `x` (2,); return the range of their indices.

    The walk starts at `x`, goes along the first axis to the border, then from edge to edge. Half
    plane 2i is the lower bound of cable i, 2i + 1 its upper bound. `entered` (2n,) stores the
    vertex at which the walk entered each edge. The first edge that is entered twice closes the
    polygon, because the walk may begin on a line that only touches it.
    """
    n = space.shape[1]
    for h in range(2 * n):
        entered[h] = -1.0
    px, py = x[0], x[1]
    edge, px, py = _follow(space, bounds, px, py, 1.0, 0.0)
    count = 0
    while edge >= 0:
        entered[edge] = count
        i = edge // 2
        length = math.hypot(space[1, i], space[2, i])
        side = 1.0 if edge % 2 == 0 else -1.0  # the inside is to the left
        ex, ey = side * space[2, i] / length, -side * space[1, i] / length
        edge, px, py = _follow(space, bounds, px, py, ex, ey)
        X[count], Y[count] = px, py
        count += 1
        if edge >= 0 and entered[edge] >= 0.0:
            return int(entered[edge]), count
    return 0, 0


@jit
def _follow(
    space: FloatArray,
    bounds: FloatArray,
    px: float,
    py: float,
    ex: float,
    ey: float,
) -> tuple[int, float, float]:
    """Return the first half plane whose border the ray from p along e meets, and the distance."""
    edge, reach = -1, math.inf
    for i in range(space.shape[1]):
        rate = space[1, i] * ex + space[2, i] * ey
        if abs(rate) <= _PARALLEL:
            continue
        bound = bounds[0, i] if rate < 0.0 else bounds[1, i]
        way = (bound - space[0, i] - space[1, i] * px - space[2, i] * py) / rate
        if way < reach:
            edge, reach = (2 * i if rate < 0.0 else 2 * i + 1), way
    if edge < 0:
        return edge, px, py
    reach = max(reach, 0.0)
    return edge, px + reach * ex, py + reach * ey


@jit
def _centre_of_area(X: FloatArray, Y: FloatArray, chosen: FloatArray) -> None:
    """Write the centroid of the polygon, or of its perimeter if it has no area (a slack cable)."""
    area, cx, cy, perimeter, sx, sy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(X.size):
        m = k + 1 if k + 1 < X.size else 0
        ax, ay, bx, by = X[k] - X[0], Y[k] - Y[0], X[m] - X[0], Y[m] - Y[0]
        cross = ax * by - bx * ay
        area += cross
        cx += cross * (ax + bx) / 3.0
        cy += cross * (ay + by) / 3.0
        length = math.hypot(bx - ax, by - ay)
        perimeter += length
        sx += 0.5 * length * (ax + bx)
        sy += 0.5 * length * (ay + by)
    if area > _THIN * perimeter * perimeter:
        chosen[0], chosen[1] = X[0] + cx / area, Y[0] + cy / area
    elif perimeter > 0.0:
        chosen[0], chosen[1] = X[0] + sx / perimeter, Y[0] + sy / perimeter


# Kernel of tension distribution: the tensions of one method, checked, or the nearest ones. It is
# a single call, because a call from Python costs as much as a third of its computation.

CENTROID: Final = 0
"""The centroid of the polygon of all tensions within bounds."""
MINIMUM_DEVIATION: Final = 1
"""The tensions within bounds nearest to the wanted ones; continuous in W, w_e and bounds."""
CLOSED_FORM: Final = 2
"""Pott's closed form about the wanted tensions; if it fails, the tensions nearest to these."""

_FEASIBLE: Final = int(TensionOutcome.FEASIBLE)
_SUBSTITUTED: Final = int(TensionOutcome.SUBSTITUTED)
_NEAREST: Final = int(TensionOutcome.NEAREST)
_SINGULAR: Final = int(TensionOutcome.SINGULAR)
REFUSED: Final = int(TensionOutcome.REFUSED)


@jit
def distribute(
    method: int,
    W: FloatArray,
    w_e: FloatArray,
    scale: FloatArray,
    bounds: FloatArray,
    scaled: FloatArray,
    space: FloatArray,
    t: FloatArray,
    missing: FloatArray,
    scratch: FloatArray,
) -> int:
    """Write the tensions `t` (n,) for W (d, n) and w_e (d,), and -(W t + w_e) as `missing` (d,).

    `method` is one of the constants above. Rows of `bounds` (3, n) are lower bounds, upper bounds
    and wanted tensions. `scale` (d,) is the size of a wrench in each direction that counts as 1 N.
    `scaled` (d, n + 1), `space` (n + 1, n) and `scratch` (4, m, m), m >= n and 8, are overwritten.
    Returns the outcome.
    """
    n = space.shape[1]
    rank = null_space(W, w_e, scale, bounds, scaled, space, scratch) if t.size == n else -1
    if rank < 0:
        return REFUSED
    if rank < scale.size:
        for i in range(n):
            t[i] = 0.5 * (bounds[0, i] + bounds[1, i])
        nearest_wrench(scaled, bounds, scale, False, t, missing, scratch)
        return _SINGULAR
    r = n - rank
    own = found = method == CLOSED_FORM and closed_form(space, r, bounds, t, scratch)
    if not found:
        found = project(space, r, bounds, t, scratch)
        own = method == MINIMUM_DEVIATION
        if found and method == CENTROID:
            own = centroid(space, r, bounds, t, scratch)
    if not nearest_wrench(scaled, bounds, scale, found, t, missing, scratch):
        return _NEAREST
    return _SUBSTITUTED if found and not own else _FEASIBLE


_BY_NAME = {
    "minimum-norm": MINIMUM_DEVIATION,  # deviation from zero
    "minimum-deviation": MINIMUM_DEVIATION,
    "closed-form": CLOSED_FORM,
    "polygon-centroid": CENTROID,
}
METHODS = tuple(_BY_NAME)
_OUTCOMES = tuple(TensionOutcome)  # members of an enumeration are slow to look up


class TensionSolver:
    """Tensions that carry a wrench within their bounds, by one method.

    It has no memory: the same W, w_e and bounds always give the same tensions. `low`, `high` and
    `wanted` (n,), N, may be changed in place between calls, for example for a cut cable (0 to 0).
    By default the wanted tensions are the middle of the bounds.
    """

    def __init__(
        self,
        method: str,
        low_N: FloatArray,
        high_N: FloatArray,
        wrench_scale: FloatArray,
        wanted_N: FloatArray | None = None,
    ) -> None:
        """Take the bounds (n,) and, for the d <= n controlled directions, `wrench_scale` (d,).

        `method` is one of `METHODS`; "minimum-deviation" takes `wanted_N` (n,). `wrench_scale` is
        the size of a wrench in each direction that counts as 1 N, for use if no tensions carry the
        wrench: 1 for a force and a characteristic length, m, for a moment.
        """
        low, high = np.array(low_N, float), np.array(high_N, float)
        if wanted_N is None:
            wanted_N = np.zeros(low.size) if method == "minimum-norm" else 0.5 * (low + high)
        self._bounds = np.array([low, high, wanted_N])
        self.low, self.high, self.wanted = self._bounds
        self.wrench_scale = np.array(wrench_scale, float)
        self._method, directions, n = _BY_NAME[method], self.wrench_scale.size, low.size
        self.missing = np.zeros(directions)
        """-(W t + w_e), N and Nm: the part of the wrench that the last tensions do not carry."""
        self._scaled, self._space = np.zeros((directions, n + 1)), np.zeros((n + 1, n))
        size = max(n, 8)
        self._scratch = np.zeros((4, size, size))

    def solve(self, W: FloatArray, w_e: FloatArray, t_out: FloatArray) -> TensionOutcome:
        """Write the tensions (n,) for W (d, n) and w_e (d,) into `t_out`.

        All arrays are float64 in C order; the first call with another layout compiles the kernel
        again. Afterwards `missing` belongs to these tensions.
        """
        outcome = distribute(
            self._method, W, w_e, self.wrench_scale, self._bounds, self._scaled, self._space,
            t_out, self.missing, self._scratch,
        )  # fmt: skip
        return _OUTCOMES[outcome]
