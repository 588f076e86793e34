"""Elastic catenaries: a point mass in equilibrium on three cables, a cable between two points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import fsolve

from cdpr_profiles.platform import Platform

G_m_s2 = 9.80665


class Standing(NamedTuple):
    """An equilibrium of a point mass."""

    position_m: NDArray[np.float64]
    winch_N: NDArray[np.float64]
    """Tensions at the exits, (3,)."""
    platform_N: NDArray[np.float64]
    """Tensions at the mass."""


def standing(
    exits_m: ArrayLike,
    mass_kg: float,
    weight_N_m: float,
    stiffness_N: float,
    *,
    lengths_m: ArrayLike | None = None,
    position_m: ArrayLike | None = None,
    guess_m: ArrayLike = (0.0, 0.0, 0.0),
) -> Standing:
    """Return the equilibrium of a mass on three cables, given unstretched lengths or its position.

    Irvine, Cable Structures (1981): a cable of unstretched length L has the horizontal force H and
    the vertical force V at its lower end. Its upper end is at the horizontal distance
    H L/EA + H/w (asinh((V + wL)/H) - asinh(V/H)) and at the height
    (V L + w L²/2)/EA + (√(H² + (V + wL)²) - √(H² + V²))/w.
    """
    exits, w, EA = np.asarray(exits_m, float), weight_N_m, stiffness_N

    def parts(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        H, V = x[:3], x[3:6]
        if position_m is None:
            return H, V, np.asarray(lengths_m, float), x[6:]
        return H, V, x[6:], np.asarray(position_m, float)

    def off(x: NDArray[np.float64]) -> NDArray[np.float64]:
        H, V, L, p = parts(x)
        way = exits - p
        across = np.linalg.norm(way[:, :2], axis=1)
        top = V + w * L
        beside = H * L / EA + H / w * (np.arcsinh(top / H) - np.arcsinh(V / H))
        above = (V * L + 0.5 * w * L**2) / EA + (np.hypot(H, top) - np.hypot(H, V)) / w
        force = np.array([*(H / across @ way[:, :2]), V.sum() - mass_kg * G_m_s2])
        return np.concatenate([beside - across, above - way[:, 2], force / mass_kg])

    way = exits - np.asarray(guess_m if position_m is None else position_m, float)
    far = np.linalg.norm(way, axis=1)
    pulls = np.linalg.solve((way / far[:, None]).T, [0.0, 0.0, mass_kg * G_m_s2])
    beside = pulls * np.linalg.norm(way[:, :2], axis=1) / far
    rest = np.asarray(guess_m, float) if position_m is None else far
    x, _, found, why = fsolve(
        off, np.concatenate([beside, pulls * way[:, 2] / far, rest]), full_output=True, xtol=1e-12
    )
    assert found == 1, why
    H, V, L, p = parts(x)
    return Standing(p, np.hypot(H, V + w * L), np.hypot(H, V))


class Cable(NamedTuple):
    """An elastic catenary between two points."""

    length_m: float
    """Unstretched length."""
    pull_N: NDArray[np.float64]
    """Force on the anchor point, (3,)."""


def cable_with(
    exit_m: ArrayLike, anchor_m: ArrayLike, weight_N_m: float, stiffness_N: float, exit_N: float
) -> Cable:
    """Return the cable whose tension at its exit is `exit_N`. The exit may be below the anchor.

    The formulae are those of `standing`.
    """
    way, w, EA = np.subtract(exit_m, anchor_m), weight_N_m, stiffness_N
    across, above = float(np.hypot(*way[:2])), float(way[2])
    far = float(np.linalg.norm(way))

    def off(x: NDArray[np.float64]) -> list[float]:
        H, V, L = x
        top = V + w * L
        beside = H * L / EA + H / w * (np.arcsinh(top / H) - np.arcsinh(V / H))
        rise = (V * L + 0.5 * w * L**2) / EA + (np.hypot(H, top) - np.hypot(H, V)) / w
        return [beside - across, rise - above, (np.hypot(H, top) - exit_N) / w]

    guess = [exit_N * across / far, exit_N * above / far - 0.5 * w * far, far]
    x, info, _, why = fsolve(off, guess, full_output=True, xtol=1e-13)
    assert np.abs(info["fvec"]).max() < 1e-6, why
    H, V, L = x
    return Cable(float(L), np.array([*(H / across * way[:2]), V]))


def cables_on(
    platform: Platform, position_m: ArrayLike, stiffness_N: ArrayLike, exit_N: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the cable lengths (n,) of an upright platform and the wrench (6,) of its cables."""
    lengths_m, wrench, arms = [], np.zeros(6), np.array(platform.anchor_points_m)
    each = zip(platform.exit_points_m, arms, platform.cable_weights_N_m, strict=True)
    pulls = zip(each, np.asarray(stiffness_N, float), np.asarray(exit_N, float), strict=True)
    for (exit_m, arm, weight_N_m), EA, pull_N in pulls:
        cable = cable_with(exit_m, np.add(position_m, arm), weight_N_m, EA, pull_N)
        lengths_m.append(cable.length_m)
        wrench += np.concatenate([cable.pull_N, np.cross(arm, cable.pull_N)])
    return np.array(lengths_m), wrench
