"""Kernel of the rotation of a platform in space that its cables do not control completely.

The pose and the tensions t in the middle of the n cables are those that agree best, in weighted
least squares, with

    lengths       ρ_i(pose) = l_i        standard deviation LENGTH_STD_m
    equilibrium   -J^T t + weight = 0    FORCE_SHARE of the weight, CENTRE_STD_m times the weight
    tensions      t_i = s_i              s_i is that of motors or load cells, see `say_tensions`
    inclinometer  Q s = (0, 0, 1)        TILT_STD_rad; s is its upward direction

Without load cells, the tensions add little: mainly how far cables pull against each other, which
cannot be seen in the lengths of stiff cables. Arrays of float64 besides those of `cable_kernel`:

    known      (7,)       WEIGHT, N; CENTRE of mass in the platform's frame, m; STD_N, standard
                          deviation of tensions estimated from motors; and the moments about x and
                          y, Nm, that the model does not explain, see `learn_moment`
    upward     (4,)       above 0 if an inclinometer's reading is valid; and its upward direction in
                          the platform's frame
    tensions   (4, n)     FOUND; SAID; their PRECISION, 1/σ²; OFFSET of load cells from motors
    normal     (6 + n, 6 + n)  normal equations, and `rows` (8, 6 + n), scratch
"""

from __future__ import annotations

import math

import numpy as np

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.model.cable_kernel import ANCHOR, ARC, FREE, hang, run_cables, tension_rise
from cdpr_rt.model.pose_search import move
from cdpr_rt.model.rigid_body import G_m_s2, in_space

WEIGHT, CENTRE, STD_N, MOMENT, KNOWN = 0, 1, 4, 5, 7
FOUND, SAID, PRECISION, OFFSET, TENSIONS = range(5)
LENGTH_STD_m = 2e-3
CELL_SHARE = 0.15
"""Standard deviation of a load cell's reading, as a share of the control's reserve of tension. That
reserve is the standard deviation of tensions estimated from the motors."""
FORCE_SHARE, CENTRE_STD_m, TILT_STD_rad = 0.004, 1e-3, 2e-3
"""Uncertainty of weight, centre of mass, and inclinometer."""
MOST_MOMENT = 0.1
"""Largest unexplained moment, over the weight and the reach of the anchor points. An inclinometer
that needs more contradicts the robot's file, for example because it is mounted another way."""
_MOST_TURN_rad, _LEAST_PIVOT = 0.2, 1e-12


@jit
def say_tensions(
    motor_N: FloatArray,
    measured_N: FloatArray,
    measured: BoolArray,
    geometry: FloatArray,
    cables: FloatArray,
    known: FloatArray,
    tensions: FloatArray,
    share: float,
) -> None:
    """Write the tensions in the middle of the cables, as measured by motors or load cells.

    The OFFSET between a load cell and its motor is low-passed by `share` per cycle. The fast part
    of a tension comes from the platform's swing, which must not become a motion of the estimate.
    """
    for i in range(motor_N.size):
        std_N, offset = known[STD_N], 0.0
        if measured[i]:
            std_N *= CELL_SHARE
            offset = measured_N[i] - tension_rise(geometry, cables, i) - motor_N[i]
            offset = tensions[OFFSET, i] + share * (offset - tensions[OFFSET, i])
        tensions[OFFSET, i], tensions[SAID, i] = offset, motor_N[i] + offset
        tensions[PRECISION, i] = 1.0 / (std_N * std_N)


@jit
def learn_moment(
    pose: FloatArray,
    known: FloatArray,
    upward: FloatArray,
    rows: FloatArray,
    share: float,
    most_Nm: float,
) -> float:
    """Correct the unexplained MOMENT by a `share` of the value that explains the inclinometer.

    Its components stay within `most_Nm`, so that a wrong reading has a bounded effect. `rows` are
    those of the last step. In motion, the estimate follows the equilibrium quickly and the
    inclinometer slowly: if it followed a swing, the control would excite the swing. Returns the
    angle between the estimate and the reading, which is the angle of the swing.
    """
    x, y, _ = _turned(pose, upward[1], upward[2], upward[3])
    about_x, about_y = -share * rows[3, 3] * y, share * rows[4, 4] * x
    known[MOMENT] = min(max(known[MOMENT] + about_x, -most_Nm), most_Nm)
    known[MOMENT + 1] = min(max(known[MOMENT + 1] + about_y, -most_Nm), most_Nm)
    return math.hypot(x, y)


@jit
def turn_to_equilibrium(
    geometry: FloatArray,
    lengths: FloatArray,
    pose: FloatArray,
    cables: FloatArray,
    known: FloatArray,
    upward: FloatArray,
    tensions: FloatArray,
    normal: FloatArray,
    rows: FloatArray,
    share: float,
) -> float:
    """Turn a pose, and change the tensions FOUND, by a `share` of one Gauss-Newton step.

    Returns the angle of the whole step, rad; nan if the equations are singular. The position does
    not change here: another kernel finds it from the lengths (n,) at this rotation. Writes
    `cables`.
    """
    run_cables(geometry, pose, cables)
    size, gradient = normal.shape[0], rows[6]
    for j in range(size):
        gradient[j] = 0.0
        for k in range(j + 1):
            normal[j, k] = 0.0
    _add_equilibrium(geometry, pose, cables, known, tensions[FOUND], rows, normal)
    precision = 1.0 / LENGTH_STD_m**2
    for i in range(size - 6):
        error = cables[FREE, i] + cables[ARC, i] - lengths[i]
        for j in range(6):
            gradient[j] -= precision * cables[j, i] * error
            for k in range(j + 1):
                normal[j, k] += precision * cables[j, i] * cables[k, i]
        weight = tensions[PRECISION, i]
        gradient[6 + i] -= weight * (tensions[FOUND, i] - tensions[SAID, i])
        normal[6 + i, 6 + i] += weight
    if upward[0] > 0.0:
        _add_tilt(pose, upward, gradient, normal)
    if not _solve(normal, gradient):
        return math.nan
    angle = math.sqrt(gradient[3] ** 2 + gradient[4] ** 2 + gradient[5] ** 2)
    share *= min(1.0, _MOST_TURN_rad / angle) if angle > 0.0 else 1.0
    for k in range(size):
        gradient[k] *= 0.0 if k < 3 else share
    move(pose, gradient)
    for i in range(size - 6):
        tensions[FOUND, i] += gradient[6 + i]
    return angle


@jit
def _add_equilibrium(
    geometry: FloatArray,
    pose: FloatArray,
    cables: FloatArray,
    known: FloatArray,
    tension: FloatArray,
    rows: FloatArray,
    normal: FloatArray,
) -> None:
    """Add the balance of forces and moments; its derivatives are written to `rows`.

    The derivatives neglect the small effect of the pulleys.
    """
    size, weight, gradient, wrench = normal.shape[0], known[WEIGHT], rows[6], rows[7]
    for j in range(6):
        wrench[j] = 0.0
        for k in range(size):
            rows[j, k] = 0.0
    x, y, z = _turned(pose, known[CENTRE], known[CENTRE + 1], known[CENTRE + 2])
    wrench[2] -= weight
    wrench[3] += known[MOMENT] - weight * y
    wrench[4] += known[MOMENT + 1] + weight * x
    # derivatives by a rotation, which changes the vector by φ × (x, y, z)
    rows[3, 3], rows[3, 5] = rows[3, 3] + weight * z, rows[3, 5] - weight * x
    rows[4, 4], rows[4, 5] = rows[4, 4] + weight * z, rows[4, 5] - weight * y
    hang(geometry, pose, cables, wrench)
    for i in range(tension.size):
        t, free = tension[i], cables[FREE, i]
        ux, uy, uz = cables[0, i], cables[1, i], cables[2, i]
        rx, ry, rz = _turned(
            pose, geometry[ANCHOR, i], geometry[ANCHOR + 1, i], geometry[ANCHOR + 2, i]
        )
        for k in range(6):
            wrench[k] -= t * cables[k, i]
            rows[k, 6 + i] = -cables[k, i]
            # velocity v of the anchor point, change d of the direction
            vx, vy, vz = 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2)
            if k == 3:
                vy, vz = -rz, ry
            elif k == 4:
                vx, vz = rz, -rx
            elif k == 5:
                vx, vy = -ry, rx
            along = ux * vx + uy * vy + uz * vz
            dx, dy = (vx - along * ux) / free, (vy - along * uy) / free
            dz = (vz - along * uz) / free
            rows[0, k] -= t * dx
            rows[1, k] -= t * dy
            rows[2, k] -= t * dz
            rows[3, k] -= t * (ry * dz - rz * dy)
            rows[4, k] -= t * (rz * dx - rx * dz)
            rows[5, k] -= t * (rx * dy - ry * dx)
            if k >= 3:
                rows[3, k] -= t * (vy * uz - vz * uy)
                rows[4, k] -= t * (vz * ux - vx * uz)
                rows[5, k] -= t * (vx * uy - vy * ux)
    for j in range(6):
        std = weight * (FORCE_SHARE if j < 3 else CENTRE_STD_m)
        precision = 1.0 / (std * std)
        for a in range(size):
            entry = precision * rows[j, a]
            gradient[a] -= entry * wrench[j]
            for b in range(a + 1):
                normal[a, b] += entry * rows[j, b]


@jit
def _add_tilt(
    pose: FloatArray, upward: FloatArray, gradient: FloatArray, normal: FloatArray
) -> None:
    """Add the inclinometer's reading s: Q s is upward."""
    x, y, z = _turned(pose, upward[1], upward[2], upward[3])
    precision = 1.0 / TILT_STD_rad**2
    # a rotation φ changes x by φ_y z - φ_z y, and y by φ_z x - φ_x z
    gradient[3] += precision * z * y
    gradient[4] -= precision * z * x
    normal[3, 3] += precision * z * z
    normal[4, 4] += precision * z * z
    normal[5, 3] -= precision * x * z
    normal[5, 4] -= precision * y * z
    normal[5, 5] += precision * (x * x + y * y)


@jit
def _turned(pose: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a vector of the platform's frame in the room's frame."""
    return (
        pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z,
        pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z,
        pose[3, 0] * x + pose[3, 1] * y + pose[3, 2] * z,
    )


@jit
def _solve(normal: FloatArray, x: FloatArray) -> bool:
    """Solve N x = g in place by Cholesky's method; on entry `x` is g. False if N is singular."""
    for j in range(x.size):
        pivot = normal[j, j]
        for k in range(j):
            pivot -= normal[j, k] ** 2
        if not pivot > _LEAST_PIVOT * normal[j, j]:
            return False
        root = math.sqrt(pivot)
        normal[j, j] = root
        for i in range(j + 1, x.size):
            entry = normal[i, j]
            for k in range(j):
                entry -= normal[i, k] * normal[j, k]
            normal[i, j] = entry / root
    for j in range(x.size):
        entry = x[j]
        for k in range(j):
            entry -= normal[j, k] * x[k]
        x[j] = entry / normal[j, j]
    for j in range(x.size - 1, -1, -1):
        entry = x[j]
        for k in range(j + 1, x.size):
            entry -= normal[k, j] * x[k]
        x[j] = entry / normal[j, j]
    return True


def known_of(platform: Platform, reserve_N: float) -> FloatArray:
    """Return the array `known` of a platform, (KNOWN,).

    The standard deviation of tensions estimated from motors is the control's reserve.
    """
    known = np.zeros(KNOWN)
    known[WEIGHT] = platform.mass_kg * G_m_s2
    known[CENTRE : CENTRE + 3] = in_space(platform.centre_of_mass_m)
    known[STD_N] = reserve_N
    return known
