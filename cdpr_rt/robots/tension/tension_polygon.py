"""The polygon of all tensions within bounds, for two cables more than directions.

With t = t0 + N' lambda and two null directions, each bound is a half plane of lambda, and the
tensions within bounds are a convex polygon: Gouttefarde, Lamaury, Reichert and Bruckmann (2015),
"A versatile tension distribution algorithm for n-DOF parallel robots driven by n+2 cables". Its
vertices are walked counter-clockwise. With one cable more it is a segment, with none a point.
"""

from __future__ import annotations

import math

from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit

ONE_NORM, TWO_NORM, CENTROID = 0, 1, 2
"""Point of the polygon: least sum of tensions, least sum of squares, or the centroid."""
_PARALLEL = 1e-12
"""A cable whose tension changes by less, for a newton along a line, does not bound that line."""
_THIN = 1e-12
"""Area, as a share of the perimeter's square, from which on a polygon counts as a segment."""


@jit
def choose(
    space: FloatArray,
    r: int,
    bounds: FloatArray,
    point: int,
    t: FloatArray,
    scratch: FloatArray,
) -> bool:
    """Replace `t` (n,), any tensions within bounds, by those at a point of the polygon.

    `space` (n + 1, n) is that of `null_space` with `r` null directions, as are `bounds` (3, n).
    `scratch` (4, m, m), m >= n and 8, is overwritten. Returns False, and leaves `t`, where r is
    above 2.
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
        chosen[0] = _of_segment(space, bounds, point)
    else:
        size = scratch.shape[1] ** 2
        X, Y, entered = scratch[1].reshape(size), scratch[2].reshape(size), scratch[3].reshape(size)
        first, last = _walk(space, bounds, x, X, Y, entered)
        chosen[0], chosen[1] = x[0], x[1]
        if last > first:
            _of_polygon(space, X[first:last], Y[first:last], point, chosen)
    for i in range(n):
        t[i] = space[0, i]
        for k in range(r):
            t[i] += space[1 + k, i] * chosen[k]
    return True


@jit
def _of_segment(space: FloatArray, bounds: FloatArray, point: int) -> float:
    """Return the lambda of a point of the segment."""
    least, most, total = -math.inf, math.inf, 0.0
    for i in range(space.shape[1]):
        u = space[1, i]
        total += u
        if abs(u) > _PARALLEL:
            a, b = (bounds[0, i] - space[0, i]) / u, (bounds[1, i] - space[0, i]) / u
            least, most = max(least, min(a, b)), min(most, max(a, b))
    if point == ONE_NORM:
        return least if total >= 0.0 else most
    if point == TWO_NORM:
        return min(max(0.0, least), most)
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
    """Write vertices of the polygon about `x` (2,); return from which to before which they are.

    From `x` along the first axis to the border, then from edge to edge; half plane 2i is cable i's
    lower bound, 2i + 1 its upper one. `entered` (2n,) keeps at which vertex an edge was entered:
    the first edge that comes again closes the polygon, since the walk may begin on a line that only
    touches it.
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
    """Return the first half plane whose border is met from p along e, and where."""
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
def _of_polygon(
    space: FloatArray, X: FloatArray, Y: FloatArray, point: int, chosen: FloatArray
) -> None:
    """Write the lambda (2,) of a point of the polygon with vertices X, Y (m,)."""
    if point == ONE_NORM:
        gx, gy = space[1].sum(), space[2].sum()
        least = math.inf
        for k in range(X.size):
            value = gx * X[k] + gy * Y[k]
            if value < least:
                least, chosen[0], chosen[1] = value, X[k], Y[k]
    elif point == TWO_NORM:
        _nearest_to_origin(X, Y, chosen)
    else:
        _centroid(X, Y, chosen)


@jit
def _nearest_to_origin(X: FloatArray, Y: FloatArray, chosen: FloatArray) -> None:
    """Write the point of the polygon nearest to the origin, t0 being orthogonal to N."""
    inside, least = True, math.inf
    for k in range(X.size):
        m = k + 1 if k + 1 < X.size else 0
        ex, ey = X[m] - X[k], Y[m] - Y[k]
        inside = inside and X[k] * ey - Y[k] * ex >= 0.0
        square = ex * ex + ey * ey
        share = -(X[k] * ex + Y[k] * ey) / square if square > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        qx, qy = X[k] + share * ex, Y[k] + share * ey
        if qx * qx + qy * qy < least:
            least, chosen[0], chosen[1] = qx * qx + qy * qy, qx, qy
    if inside:
        chosen[0] = chosen[1] = 0.0


@jit
def _centroid(X: FloatArray, Y: FloatArray, chosen: FloatArray) -> None:
    """Write the centre of area, or the perimeter's of a polygon without any (a slack cable's)."""
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
