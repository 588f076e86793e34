"""The platform as a rigid body: its mass matrix, and the wrench of weight and inertia."""

from __future__ import annotations

import numpy as np

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.model.rigid_body import G_m_s2, inertia_kg_m2

MASS, CENTRE, INERTIA, GRAVITY, BODY = 0, 1, 4, 13, 16
"""Indices in a body's row: mass, kg; centre of mass, m, and inertia about it, kg m2, both in the
platform's frame; gravity, m/s2, in the room's."""


def body_of(platform: Platform) -> FloatArray:
    """Return the row (BODY,) of a platform."""
    row = np.zeros(BODY)
    row[MASS] = platform.mass_kg
    row[CENTRE : CENTRE + len(platform.centre_of_mass_m)] = platform.centre_of_mass_m
    row[INERTIA:GRAVITY] = inertia_kg_m2(platform).ravel()
    row[GRAVITY + len(platform.home_m) - 1] = -G_m_s2
    return row


@jit
def write_mass_matrix(
    body: FloatArray, pose: FloatArray, scratch: FloatArray, M: FloatArray
) -> None:
    """Write M (6, 6) of twists at a pose (4, 3), and its parts into `scratch` (4, 3).

    M = [m 1, -m [r]×; m [r]×, I - m [r]×²] with r = Q c the centre of mass from the origin, and
    I = Q I_c Q^T, which are `scratch[0]` and `scratch[1:]`.
    """
    Q, r, about = pose[1:4], scratch[0], scratch[1:4]
    m = body[MASS]
    for i in range(3):
        r[i] = 0.0
        for k in range(3):
            r[i] += Q[i, k] * body[CENTRE + k]
    for i in range(3):
        for j in range(3):
            entry = 0.0
            for k in range(3):
                for q in range(3):
                    entry += Q[i, k] * body[INERTIA + 3 * k + q] * Q[j, q]
            about[i, j] = entry
    square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    for i in range(3):
        for j in range(3):
            M[i, j] = m if i == j else 0.0
            M[3 + i, 3 + j] = about[i, j] - m * r[i] * r[j] + (m * square if i == j else 0.0)
            M[i, 3 + j] = M[3 + i, j] = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        M[j, 3 + i] = M[3 + i, j] = -m * r[k]
        M[k, 3 + i] = M[3 + i, k] = m * r[j]


@jit
def write_wrench(
    body: FloatArray,
    M: FloatArray,
    scratch: FloatArray,
    twist: FloatArray,
    acceleration: FloatArray,
    wrench: FloatArray,
) -> None:
    """Write the wrench (6,) of weight and inertia on a moving platform (Newton, Euler).

    -(M a) - (f, r × f + ω × I ω) + (m g, r × m g) with f = m ω × (ω × r). M and `scratch` are those
    that `write_mass_matrix` has written.
    """
    m, r, about = body[MASS], scratch[0], scratch[1:4]
    wx, wy, wz = twist[3], twist[4], twist[5]
    along = wx * r[0] + wy * r[1] + wz * r[2]
    square = wx * wx + wy * wy + wz * wz
    fx = m * (body[GRAVITY] - wx * along + square * r[0])
    fy = m * (body[GRAVITY + 1] - wy * along + square * r[1])
    fz = m * (body[GRAVITY + 2] - wz * along + square * r[2])
    lx = about[0, 0] * wx + about[0, 1] * wy + about[0, 2] * wz
    ly = about[1, 0] * wx + about[1, 1] * wy + about[1, 2] * wz
    lz = about[2, 0] * wx + about[2, 1] * wy + about[2, 2] * wz
    wrench[0], wrench[1], wrench[2] = fx, fy, fz
    wrench[3] = r[1] * fz - r[2] * fy - (wy * lz - wz * ly)
    wrench[4] = r[2] * fx - r[0] * fz - (wz * lx - wx * lz)
    wrench[5] = r[0] * fy - r[1] * fx - (wx * ly - wy * lx)
    for i in range(6):
        for k in range(6):
            wrench[i] -= M[i, k] * acceleration[k]
