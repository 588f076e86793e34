"""Tensions of a planar robot with one cable more than directions: eqs. (2.13) to (2.19).

Where two directions are held by three cables, all tensions that carry a wrench lie on a line
t = t0 + k·u; those within bounds are a stretch of it, or none.
"""

from __future__ import annotations

import math
from enum import IntEnum

from cdpr_rt.exchange import FloatArray
from cdpr_rt.jit import jit


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
