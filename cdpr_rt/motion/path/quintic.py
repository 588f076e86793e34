"""Kernel of the polynomial of fifth order between two nodes with two derivatives each."""

from __future__ import annotations

from cdpr_rt.jit import jit


@jit
def quintic(
    p0: float, v0: float, a0: float, p1: float, v1: float, a1: float, h: float, u: float
) -> tuple[float, float, float, float]:
    """Return value and three derivatives at the share `u` of an interval of length `h`.

    At its begin and end the value is p, the first derivative v and the second a (Hermite).
    """
    v0, v1, a0, a1 = h * v0, h * v1, h * h * a0, h * h * a1
    gap, slope, bend = p1 - p0 - v0 - 0.5 * a0, v1 - v0 - a0, a1 - a0
    c3 = 10.0 * gap - 4.0 * slope + 0.5 * bend
    c4 = -15.0 * gap + 7.0 * slope - bend
    c5 = 6.0 * gap - 3.0 * slope + 0.5 * bend
    return (
        p0 + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5)))),
        (v0 + u * (a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / h,
        (a0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / h**2,
        (6.0 * c3 + u * (24.0 * c4 + u * 60.0 * c5)) / h**3,
    )
