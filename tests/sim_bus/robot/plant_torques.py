"""Torques by the formulas of a plant file, as a reference for the kernels."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdpr_sim_bus.robot.plant import Plant


def cogging_Nm(
    plant: Plant, angle_rad: ArrayLike, *, energised: bool = True, rise_K: float = 0.0
) -> NDArray[np.float64]:
    """Return the torque that holds the rotor against cogging at mechanical angles.

    `angle_rad` is relative to the mechanical zero, and the index is at `encoder.index_deg`:
    c = Σ A sin(order·θ + phase). The offset ripple acts only while energised.
    """
    angle = np.asarray(angle_rad, dtype=np.float64)
    total = np.zeros_like(angle)
    for term in plant.cogging:
        wave = term.amplitude_Nm * np.sin(term.order * angle + np.deg2rad(term.phase_deg))
        if term.kind == "torque":
            total += (1.0 + plant.thermal.cogging_per_K * rise_K) * wave
        elif energised:
            total += (1.0 + plant.motor.torque_constant_error) * wave
    return total


def friction_Nm(
    plant: Plant,
    velocity_rad_s: ArrayLike,
    *,
    angle_rad: ArrayLike | None = None,
    rise_K: float = 0.0,
) -> NDArray[np.float64]:
    """Return the friction torque that opposes steady motion at the given velocities.

    Without angles, it is the average over a turn.
    """
    v = np.asarray(velocity_rad_s, dtype=np.float64)
    f = plant.friction
    sign = np.sign(v)
    level = f.coulomb_Nm + (f.breakaway_Nm - f.coulomb_Nm) * np.exp(-((v / f.stribeck_rad_s) ** 2))
    dry = sign * (1.0 + 0.5 * f.direction_asymmetry * sign) * level
    if angle_rad is not None:
        angle = np.asarray(angle_rad, dtype=np.float64)
        dry *= 1.0 + f.angle_share * np.sin(angle + np.deg2rad(f.angle_phase_deg))
    scale = 1.0 + plant.thermal.friction_per_K * rise_K
    return np.asarray(scale * (dry + f.viscous_Nms_rad * v))
