"""Where a platform comes to rest when one of its cables breaks: a static estimate."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import NonlinearConstraint, minimize

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.kinematics.cable_kernel import ARC, CABLE_ROWS, FREE, run_cables
from cdpr_rt.robots.platform_model import cable_kinematics
from cdpr_rt.robots.rigid_body import free_directions, home_rotation, in_space, rotation

_FURTHEST_RAD = 0.9 * np.pi
"""A platform may turn over; half a turn has no single rotation vector."""
_STEPS, _DONE_m = 200, 1e-9


@dataclass(frozen=True)
class Swing:
    """How far a platform swings that was at rest at a position when a cable broke."""

    cable: int
    position_m: tuple[float, ...]
    swing_m: float
    """Distance of the origin's new position from there."""
    turn_rad: float
    to_m: tuple[float, ...]


def worst_swings(platform: Platform) -> list[Swing]:
    """Return for each cable the largest swing from any corner of the box of targets."""
    corners = list(product(*zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)))
    cables = range(len(platform.exit_points_m))
    return [
        max((swing_of(platform, i, corner) for corner in corners), key=lambda swing: swing.swing_m)
        for i in cables
    ]


def swing_of(platform: Platform, cable: int, position_m: tuple[float, ...]) -> Swing:
    """Return where the platform comes to rest on the other cables.

    That is the least height of its centre of mass at which no other cable is longer than it was:
    rho(p, Q) <= rho, tension being what the constraint costs. Cables do not stretch, winches do
    not turn, and what it passes on the way is not looked at; it swings through to about as far on
    the other side before it comes to rest.
    """
    size, geometry = len(platform.home_m), cable_kinematics(platform).geometry
    start, Q0 = in_space(position_m), home_rotation(platform)
    kept = [i for i in range(len(platform.exit_points_m)) if i != cable]
    mass_m = in_space(platform.centre_of_mass_m)
    chosen = list(free_directions(platform))
    limits = [(-np.inf, np.inf) if i < 3 else (-_FURTHEST_RAD, _FURTHEST_RAD) for i in chosen]
    cables = np.empty((CABLE_ROWS, geometry.shape[1]))

    def pose(x: FloatArray) -> FloatArray:
        moved = np.zeros(6)
        moved[chosen] = x
        return np.vstack([start + moved[:3], rotation(moved[3:]) @ Q0])

    def height(x: FloatArray) -> float:
        there = pose(x)
        return float((there[0] + there[1:] @ mass_m)[size - 1])

    def lengths(x: FloatArray) -> FloatArray:
        run_cables(geometry, pose(x), cables)
        return np.asarray((cables[FREE] + cables[ARC])[kept])

    rho = lengths(np.zeros(len(chosen)))
    found = minimize(
        height,
        np.zeros(len(chosen)),
        method="SLSQP",
        bounds=limits,
        constraints=NonlinearConstraint(lambda x: rho - lengths(x), 0.0, np.inf),
        options={"maxiter": _STEPS, "ftol": _DONE_m},
    )
    p = pose(found.x)[0]
    turn = float(np.linalg.norm([x for i, x in zip(chosen, found.x, strict=True) if i >= 3]))
    swing_m = float(np.linalg.norm(p - start))
    return Swing(cable, tuple(position_m), swing_m, turn, tuple(p[:size].tolist()))
