"""Kernel of a platform's rotation in a plane that no cable controls.

The array `rotation` (9,) begins with constants of the platform: MASS, kg, INERTIA about the centre
of mass, kg m2, and the coordinates CENTRE_x, CENTRE_y of that centre in the platform's frame, m.
The other entries depend on the pose. MOMENT is the moment of the tensions about the centre of mass,
Nm, and STEEPNESS its decrease with the angle, Nm/rad. Three entries describe the swing with
constant cable lengths: STIFFNESS κ, Nm/rad, SWINGING, its inertia I_s, kg m2, and REACH, the
distance of the farthest anchor point from the centre of the swing, m.

With constant cable lengths the platform turns about the point at which the cables' lines almost
meet. Its centre of mass then moves by -B per radian, and B solves u_i·(b_i⊥ - B) = 0 in least
squares over all cables. Here u_i is the direction of a cable and b_i its anchor point, measured
from the centre of mass. So

    I_s = I + m |B|²        κ = Σ t_i (((b_i⊥ - B)·u_i⊥)² / ρ_i + u_i·b_i)
"""

from __future__ import annotations

import math

import numpy as np

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.model.cable_kernel import ANCHOR
from cdpr_rt.model.rigid_body import inertia_kg_m2

MASS, INERTIA, CENTRE_x, CENTRE_y, MOMENT, STEEPNESS, STIFFNESS, SWINGING, REACH, ROWS = range(10)

DAMPING_RATIO = 0.005
"""Damping ratio of the swing. Only air and cables damp it, because no winch turns."""
SWINGS_m = 2e-3
"""Amplitude of an anchor point from which a swing is reported."""
SHAPING_s = 0.06
"""Time over which the control averages its set-points, so that their acceleration does not step."""
_NEWTON_STEPS, _MOST_STEP_rad = 30, 0.2


@jit
def rotational_stiffness(
    geometry: FloatArray, tension: FloatArray, pose: FloatArray, rotation: FloatArray
) -> None:
    """Write the entries of `rotation` that depend on the pose, under tensions (n,)."""
    cx = pose[1, 0] * rotation[CENTRE_x] + pose[1, 1] * rotation[CENTRE_y]
    cy = pose[2, 0] * rotation[CENTRE_x] + pose[2, 1] * rotation[CENTRE_y]
    moment, steepness = 0.0, 0.0
    axx, axy, ayy, gx, gy = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(tension.size):
        x, y, ux, uy, rho = _arm(geometry, pose, cx, cy, i)
        across, along = x * uy - y * ux, x * ux + y * uy
        moment += tension[i] * across
        steepness += tension[i] * (along + along * along / rho)
        axx, axy, ayy = axx + ux * ux, axy + ux * uy, ayy + uy * uy
        gx, gy = gx + ux * across, gy + uy * across
    determinant = axx * ayy - axy * axy
    bx, by = (ayy * gx - axy * gy) / determinant, (axx * gy - axy * gx) / determinant
    stiffness, reach = 0.0, 0.0
    for i in range(tension.size):
        x, y, ux, uy, rho = _arm(geometry, pose, cx, cy, i)
        across = (x - by) * ux + (y + bx) * uy
        stiffness += tension[i] * (across * across / rho + x * ux + y * uy)
        reach = max(reach, math.hypot(x - by, y + bx))
    rotation[MOMENT], rotation[STEEPNESS], rotation[STIFFNESS] = moment, steepness, stiffness
    rotation[SWINGING] = rotation[INERTIA] + rotation[MASS] * (bx * bx + by * by)
    rotation[REACH] = reach


@jit
def turn(pose: FloatArray, angle: float) -> None:
    """Turn a pose about z."""
    cosine, sine = math.cos(angle), math.sin(angle)
    for k in range(3):
        a, b = pose[1, k], pose[2, k]
        pose[1, k], pose[2, k] = cosine * a - sine * b, sine * a + cosine * b


@jit
def turn_to_rest(
    geometry: FloatArray, tension: FloatArray, pose: FloatArray, rotation: FloatArray
) -> float:
    """Turn a pose until tensions (n,) exert no moment, by Newton's method; return the angle.

    If the tensions turn the platform over, STEEPNESS is 0 or less afterwards.
    """
    angle = 0.0
    for _ in range(_NEWTON_STEPS):
        rotational_stiffness(geometry, tension, pose, rotation)
        if not rotation[STEEPNESS] > 0.0:
            break
        step = rotation[MOMENT] / rotation[STEEPNESS]
        step = min(max(step, -_MOST_STEP_rad), _MOST_STEP_rad)
        turn(pose, step)
        angle += step
    return angle


@jit
def _arm(
    geometry: FloatArray, pose: FloatArray, cx: float, cy: float, i: int
) -> tuple[float, float, float, float, float]:
    """Return a cable's anchor relative to the centre of mass, its direction, and its length."""
    x = pose[1, 0] * geometry[ANCHOR, i] + pose[1, 1] * geometry[ANCHOR + 1, i]
    y = pose[2, 0] * geometry[ANCHOR, i] + pose[2, 1] * geometry[ANCHOR + 1, i]
    ux, uy = geometry[0, i] - pose[0, 0] - x, geometry[1, i] - pose[0, 1] - y
    rho = math.sqrt(ux * ux + uy * uy)
    return x - cx, y - cy, ux / rho, uy / rho, rho


def rotation_of(platform: Platform) -> FloatArray:
    """Return the array `rotation` (ROWS,) of a platform; entries that depend on the pose are 0."""
    rotation = np.zeros(ROWS)
    rotation[MASS] = platform.mass_kg
    rotation[INERTIA] = inertia_kg_m2(platform)[2, 2]
    rotation[[CENTRE_x, CENTRE_y]] = platform.centre_of_mass_m[:2]
    return rotation
