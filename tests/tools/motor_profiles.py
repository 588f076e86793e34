"""Cogging profiles of simulated motors as a perfect commissioning would write them."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from cdpr_drivers.robot.commissioned import folder_of
from cdpr_profiles import Robot, Winch
from cdpr_rt.identification.cogging_profile import (
    CoggingProfile,
    DriveIdentity,
    StoredFriction,
    StoredMethod,
)
from cdpr_sim_bus.robot.plant import Plant

SAMPLES = 512


def cogging_Nm(plant: Plant, from_index_rad: np.ndarray) -> np.ndarray:
    """Return the torque in the drive's units that cancels the cogging of a plant."""
    angle = from_index_rad + math.radians(plant.encoder.index_deg)
    total = np.zeros_like(angle)
    for term in plant.cogging:
        total += term.amplitude_Nm * np.sin(term.order * angle + math.radians(term.phase_deg))
    return total / (1.0 + plant.motor.torque_constant_error)


def profile_of(winch: Winch, plant: Plant, serial: int) -> CoggingProfile:
    """Return the true profile of a simulated motor, for the drive with this serial number."""
    angle = np.linspace(0.0, math.tau, SAMPLES, endpoint=False)
    table = cogging_Nm(plant, angle).tolist()
    f, gain = plant.friction, 1.0 + plant.motor.torque_constant_error
    half = 0.5 * f.direction_asymmetry
    forward, backward = (1.0 + half) / gain, (1.0 - half) / gain
    falls = f.breakaway_Nm - f.coulomb_Nm
    method = StoredMethod(
        table_Nm=(table, table),
        friction=StoredFriction(
            coulomb_forward_Nm=f.coulomb_Nm * forward,
            coulomb_backward_Nm=f.coulomb_Nm * backward,
            stribeck_forward_Nm=falls * forward,
            stribeck_backward_Nm=falls * backward,
            stribeck_speed_rad_s=f.stribeck_rad_s,
            viscous_Nms_rad=f.viscous_Nms_rad / gain,
        ),
        look_ahead_s=winch.latency_s,
        observer_s=0.003,
    )
    drive = winch.drive
    return CoggingProfile(
        motor=winch.motor.model,
        drive=drive.name,
        identity=DriveIdentity(
            vendor_id=drive.vendor_id,
            product_code=drive.product_code,
            revision=drive.revision or 0,
            serial=serial,
            encoder_counts_per_turn=plant.encoder.counts_per_turn,
        ),
        created=datetime(2024, 5, 1, tzinfo=UTC),
        raw_data=[],
        inertia_kg_m2=plant.motor.inertia_kg_m2,
        harmonics=[],
        residual_rms_Nm=0.0,
        repaired_fraction=0.0,
        coverage=1.0,
        thesis=method,
        harmonic=method,
    )


def leave_profiles(robot: Robot, plants: list[Plant], folder: Path) -> Path:
    """Write the profile of each motor of a simulated robot like `cdpr commission`."""
    for i, (axis, plant) in enumerate(zip(robot.axes, plants, strict=True)):
        own = folder / folder_of(axis)
        own.mkdir(parents=True)
        profile_of(axis.winch, plant, i + 1).save(own / "cogging-profile.json")
    return folder
