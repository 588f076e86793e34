"""Kernel of a platform of whose n cables one was cut: it swings, and is let down until it lies.

A rigid body on elastic cables, each wound by a rotor whose motor pulls as it is told and gives way
to what is more, above level ground.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.winch_speed_loop import FILTER_S, control_speed
from cdpr_rt.jit import jit
from cdpr_rt.robots.kinematics.cable_kernel import (
    ARC,
    CABLE_ROWS,
    FREE,
    hang,
    run_cables,
    tension_rise,
)
from cdpr_rt.robots.kinematics.pose import exponential
from cdpr_rt.robots.platform.body_kernel import write_mass_matrix, write_wrench
from cdpr_rt.robots.platform.loop_kernel import factor, solve

WINCHES = np.dtype(
    [
        ("stiffness_N_m", "<f8"),  # of its cable
        ("damping_N_s_m", "<f8"),
        ("rotor_kg", "<f8"),  # as the cable feels it
        ("held_N", "<f8"),  # which it pulls with until the platform is let down
        ("weight_N", "<f8"),  # with which that begins
        ("low_N", "<f8"),
        ("high_N", "<f8"),
        ("gain_N_s_m", "<f8"),  # of its speed loop
        ("friction_N", "<f8"),  # dry, of the winch, at the cable
    ]
)
"""A record for each cable, (n,)."""
PARAMETERS = np.dtype(
    [
        ("period_s", "<f8"),
        ("steps", "<i8"),  # in a cycle
        ("held_cycles", "<i8"),  # until the platform is let down
        ("cut", "<i8"),  # which cable carries nothing
        ("misled_N", "<f8"),  # force away from its exit point meanwhile
        ("paying_out_m_s", "<f8"),
        ("fastest_in_m_s", "<f8"),
        ("integral_rate_1_s", "<f8"),
        ("up", "<i8"),  # which coordinate is against gravity
        ("ground_m", "<f8"),
        ("foot_N_m", "<f8"),
        ("foot_N_s_m", "<f8"),
        ("friction", "<f8"),
    ]
)
"""One record, (1,)."""
_SLIDING_m_s = 0.01
_STILL_m_s, _STILL_S = 0.02, 0.5


@jit
def fall(
    parameters: Any,
    winches: Any,
    body: FloatArray,
    free: FloatArray,
    geometry: FloatArray,
    feet: FloatArray,
    start: FloatArray,
    path: FloatArray,
) -> int:
    """Write the poses (c, 4, 3) after each of c cycles into `path`; return how many it took.

    The platform rests at `start` (4, 3). `body` is that of `body_kernel`, `free` (6,) has 1 for
    each component of the twist that there is, 0 otherwise; `geometry` (13, n) is that of
    `cable_kernel`, `feet` (k, 3) are what can touch the ground, m, in the platform's frame.
    """
    c, n = parameters[0], winches.size
    h, weight = c.period_s / c.steps, c.period_s / (c.period_s + FILTER_S)
    pose, twist, cables = start.copy(), np.zeros(6), np.empty((CABLE_ROWS, n))
    length, rate, tension, pull = np.empty(n), np.zeros(n), np.zeros(n), winches["held_N"].copy()
    last, speed, integral, torque = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    jumped = np.zeros(n, np.bool_)
    out, as_cable, scratch = np.full(n, c.paying_out_m_s), np.ones(n), np.zeros((4, 6, 6))
    run_cables(geometry, pose, cables)
    for i in range(n):
        middle_N = pull[i] - tension_rise(geometry, cables, i)
        length[i] = cables[FREE, i] + cables[ARC, i] - middle_N / winches[i].stiffness_N_m
    still = 0
    for cycle in range(path.shape[0]):
        if cycle == c.held_cycles:
            for i in range(n):
                last[i], speed[i] = length[i], rate[i]
                integral[i] = -max(winches[i].weight_N, winches[i].low_N)
        if cycle >= c.held_cycles:
            control_speed(
                c.period_s, weight, winches["low_N"], winches["high_N"], out, c.fastest_in_m_s,
                as_cable, winches["gain_N_s_m"], c.integral_rate_1_s, length, last, jumped,
                speed, integral, pull, torque,
            )  # fmt: skip
        standing = False
        for _ in range(c.steps):
            run_cables(geometry, pose, cables)
            _wind(h, winches, geometry, cables, twist, pull, length, rate, tension)
            tension[c.cut] = -c.misled_N if cycle < c.held_cycles else 0.0
            standing = _step(
                h, c, body, free, geometry, cables, tension, feet, pose, twist, scratch
            )
        path[cycle] = pose
        slow = math.sqrt(twist[0] ** 2 + twist[1] ** 2 + twist[2] ** 2) < _STILL_m_s
        still = still + 1 if standing and slow else 0
        if still * c.period_s > _STILL_S:
            return cycle + 1
    return len(path)


@jit
def _wind(
    h: float,
    winches: Any,
    geometry: FloatArray,
    cables: FloatArray,
    twist: FloatArray,
    pull: FloatArray,
    length: FloatArray,
    rate: FloatArray,
    tension: FloatArray,
) -> None:
    """Write the tensions (n,) in the cables' middle, and advance their rotors by `h` s."""
    for i in range(winches.size):
        w = winches[i]
        stretch, growing = cables[FREE, i] + cables[ARC, i] - length[i], -rate[i]
        for k in range(6):
            growing += cables[k, i] * twist[k]
        carried = w.stiffness_N_m * stretch + w.damping_N_s_m * growing
        tension[i] = max(carried, 0.0) if stretch > 0.0 else 0.0
        at_winch = tension[i] + tension_rise(geometry, cables, i)
        unbraked = rate[i] + h * (at_winch - pull[i]) / w.rotor_kg
        braked = max(abs(unbraked) - h * w.friction_N / w.rotor_kg, 0.0)
        rate[i] = math.copysign(braked, unbraked)
        length[i] += h * rate[i]


@jit
def _step(
    h: float,
    c: Any,
    body: FloatArray,
    free: FloatArray,
    geometry: FloatArray,
    cables: FloatArray,
    tension: FloatArray,
    feet: FloatArray,
    pose: FloatArray,
    twist: FloatArray,
    scratch: FloatArray,
) -> bool:
    """Advance twist and pose by `h` s, semi-implicitly; return whether a foot touches the ground.

    `scratch` (4, 6, 6) is overwritten.
    """
    M, about = scratch[0], scratch[1, :4, :3]
    rest, wrench, turned, before = scratch[2, 0], scratch[2, 1], scratch[3, :3, :3], scratch[3, 3:]
    write_mass_matrix(body, pose, about, M)
    rest[:] = 0.0
    write_wrench(body, M, about, twist, rest, wrench)
    hang(geometry, pose, cables, wrench)
    for i in range(tension.size):
        for k in range(6):
            wrench[k] -= cables[k, i] * tension[i]
    standing = _stand(c, feet, pose, twist, wrench)
    for j in range(6):
        if free[j] == 0.0:
            wrench[j] = 0.0
            for k in range(6):
                M[j, k] = M[k, j] = 0.0
            M[j, j] = 1.0
    factor(M, 6)
    solve(M, wrench, 6)
    for k in range(6):
        twist[k] += h * wrench[k]
    for k in range(3):
        pose[0, k] += h * twist[k]
        rest[k] = h * twist[3 + k]
    exponential(rest[:3], turned)
    for i in range(3):
        for j in range(3):
            before[i, j] = pose[1 + i, j]
    for i in range(3):
        for j in range(3):
            pose[1 + i, j] = 0.0
            for k in range(3):
                pose[1 + i, j] += turned[i, k] * before[k, j]
    return standing


@jit
def _stand(
    c: Any, feet: FloatArray, pose: FloatArray, twist: FloatArray, wrench: FloatArray
) -> bool:
    """Add the wrench of the ground: under each foot a damped spring, and dry friction."""
    standing, up = False, c.up
    for j in range(feet.shape[0]):
        x, y, z = feet[j, 0], feet[j, 1], feet[j, 2]
        rx = pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z
        ry = pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z
        rz = pose[3, 0] * x + pose[3, 1] * y + pose[3, 2] * z
        arm, wx, wy, wz = (rx, ry, rz), twist[3], twist[4], twist[5]
        depth = c.ground_m - pose[0, up] - arm[up]
        if depth <= 0.0:
            continue
        standing = True
        velocity = (
            twist[0] + wy * rz - wz * ry,
            twist[1] + wz * rx - wx * rz,
            twist[2] + wx * ry - wy * rx,
        )
        load = max(c.foot_N_m * depth - c.foot_N_s_m * velocity[up], 0.0)
        square = velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2 - velocity[up] ** 2
        drag = c.friction * load / (math.sqrt(max(square, 0.0)) + _SLIDING_m_s)
        fx = load if up == 0 else -drag * velocity[0]
        fy = load if up == 1 else -drag * velocity[1]
        fz = load if up == 2 else -drag * velocity[2]
        wrench[0] += fx
        wrench[1] += fy
        wrench[2] += fz
        wrench[3] += ry * fz - rz * fy
        wrench[4] += rz * fx - rx * fz
        wrench[5] += rx * fy - ry * fx
    return standing
