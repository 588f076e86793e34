"""Memory of one motor and its inner loops: a record that the compiled kernels modify in place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdpr_sim_bus.robot.plant import MAX_COGGING_TERMS, LoadPlant, Plant

CONTROL_STEP_S = 5e-5
"""Period of the inner loops, and the longest step of the physics."""
DELAY_SLOTS = 256
CREEPS = 2
"""Parts of a cable's creep, each with its own time constant."""
LINE_COUNTS = 4
"""Counts per line of the encoder's disc."""

LOAD_KINDS = ("none", "hung_mass", "fixed_anchor", "platform")
"""Names of `load_kind`, by its value. The last one is for motors of a `CableRobot`."""
_F8 = np.float64
_PHYSICS = [
    # parameters
    ("inertia", _F8),  # kg m2, rotor and load
    ("torque_gain", _F8),  # true over nominal torque constant
    ("current_rate", _F8),  # rad/s, bandwidth of the current loop
    ("coulomb", _F8),
    ("breakaway", _F8),
    ("stribeck", _F8),
    ("viscous", _F8),
    ("sigma0", _F8),
    ("sigma1", _F8),
    ("asymmetry", _F8),
    ("cogging_per_K", _F8),
    ("friction_per_K", _F8),
    ("heating_rate", _F8),  # 1/s
    ("rise_limit", _F8),  # K
    ("steps_per_control", np.int64),
    ("n_torque", np.int64),  # the torque-additive harmonics come first,
    ("n_cogging", np.int64),  # then the current-offset ones
    ("order", _F8, (MAX_COGGING_TERMS,)),
    ("amplitude", _F8, (MAX_COGGING_TERMS,)),
    ("phase", _F8, (MAX_COGGING_TERMS,)),
    ("ripple_order", _F8),  # periods per turn of the sixth torque ripple; twelfth: double
    ("ripple_phase", _F8),
    ("sixth", _F8),  # shares of the torque
    ("twelfth", _F8),
    ("rubbing", _F8),  # share of the dry friction that varies once a turn
    ("rubbing_phase", _F8),
    # injected faults
    ("torque_bias", _F8),  # Nm, at the nominal torque constant, that the sensors do not show
    ("torque_cap", _F8),  # Nm, most that the power stage gives
    ("torque_stuck", _F8),  # Nm, demand that it follows instead of the servo's; NaN: none
    # state
    ("time", _F8),  # s, bus time
    ("angle", _F8),  # rad, mechanical, over all turns
    ("velocity", _F8),  # rad/s
    ("bristle", _F8),  # rad
    ("current", _F8),  # true current, in Nm at the nominal torque constant
    ("sensed", _F8),  # the same as measured by the drive's sensors
    ("rise", _F8),  # K above ambient
    ("true_gain", _F8),  # torque gain with its ripple in the last step
    ("cogging_Nm", _F8),  # cogging in the last step
    ("friction_Nm", _F8),
]
_CABLE = [
    # parameters
    ("load_kind", np.int64),
    ("cable_gain", _F8),  # m/rad, cable paid out per motor angle, signed
    ("cable_stiffness", _F8),  # N/m
    ("cable_damping", _F8),  # N s/m
    ("cable_start", _F8),  # m, elongation at power-up, negative if slack
    ("angle_start", _F8),  # rad, motor angle at power-up
    ("floor", _F8),  # m, position of a mass that stands on it
    ("gravity", _F8),
    ("winch_friction", _F8),  # Nm
    ("friction_share", _F8),  # Nm per N
    ("brake", _F8),  # Nm; 0 released
    ("rigidity", _F8),  # N, EA of a cable that leads to a platform
    ("weight", _F8),  # N/m, of that cable
    ("damping_time", _F8),  # s, its damping over its stiffness
    ("creep_share", _F8, (CREEPS,)),  # of its elastic strain
    ("creep_rate", _F8, (CREEPS,)),  # 1/s
    ("gear_yield", _F8),  # m/N, compliance of gear and belt at the drum
    ("drum_gain", _F8),  # turn of its drum per motor angle
    ("run_out", _F8),  # m, of the drum
    ("run_out_phase", _F8),  # rad, at power-up
    ("lag", _F8),  # m, of the carriage that guides the cable, per radian of the drum
    ("carriage_offset", _F8),  # m, off its cable at power-up
    ("carriage_distance", _F8),  # m, from the drum
    # its far end, written by the platform's physics before every step
    ("far_distance", _F8),  # m, from exit to anchor point
    ("far_rate", _F8),  # m/s
    ("far_level", _F8),  # horizontal share of the distance
    ("far_wound", _F8),  # m, part of it on the pulley
    ("far_drop", _F8),  # m, from the start of the free cable to the anchor point, along gravity
    # state
    ("mass", _F8),  # kg
    ("mass_position", _F8),  # m, downward from power-up
    ("mass_velocity", _F8),  # m/s
    ("tension", _F8),  # N; halfway along a cable with weight that leads to a platform
    ("hung_load", _F8),  # N, half of the cable's weight, borne by its far end
    ("winch_tension", _F8),  # N, at the winch
    ("creep", _F8, (CREEPS,)),  # strain of a cable that leads to a platform
    ("load_friction", _F8),  # Nm, level of the additional dry friction of the load
]
_ENCODER = [
    ("counts_per_rad", _F8),
    ("counts_per_turn", np.int64),
    ("noise", _F8),  # counts
    ("eccentricity", _F8),  # counts
    ("eccentric_phase", _F8),  # rad
    ("eccentric_zero", _F8),  # counts, its error at the index
    ("interpolation", _F8),  # counts
    ("delay", _F8),  # s
    ("jitter", _F8),  # s, largest deviation from it
    ("random", np.uint64),
    ("zero", np.int64),  # disc position at power-up, the counter's zero
    ("disc", np.int64),  # disc position now, noise-free
    ("index", np.int64),  # disc position of the index pulse
    ("index_present", np.int64),
    ("frozen", np.int64),  # injected fault: 1 if the counter stays at `frozen_count`
    ("frozen_count", np.int64),
    ("rise_count", np.int64),  # counter at the last rising edge of the index pulse
    ("fall_count", np.int64),
    ("slot", np.int64),
    ("slot_time", _F8, (DELAY_SLOTS,)),
    ("slot_angle", _F8, (DELAY_SLOTS,)),
    ("switch_negative", _F8),  # rad; ±inf if there is no such switch
    ("switch_positive", _F8),
    ("home_from", _F8),
    ("home_to", _F8),
]
_SERVO = [
    # configuration; counts are encoder counts from power-up
    ("velocity_gain", _F8),  # Nm s/rad
    ("integral_rate", _F8),  # 1/s
    ("position_gain", _F8),  # 1/s
    ("observer_rate", _F8),  # rad/s
    ("display_rate", _F8),  # rad/s, filter of the displayed velocity
    ("torque_unit", _F8),  # Nm, of one unit of target and measured torque
    ("limit_positive", _F8),  # Nm
    ("limit_negative", _F8),  # Nm, a positive number
    ("torque_slope", _F8),  # Nm/s
    ("torque_offset", _F8),  # Nm, feed-forward of the position and velocity loops
    ("speed_limit", _F8),  # counts/s
    ("acceleration", _F8),  # counts/s2
    ("deceleration", _F8),
    ("profile_velocity", _F8),  # counts/s
    ("interpolation_left", _F8),  # s until the reference must be at the target
    ("target_window", _F8),
    ("target_window_time", _F8),
    ("standstill_velocity", _F8),
    ("standstill_time", _F8),
    ("following_window", _F8),
    ("following_time", _F8),
    ("rated_current", _F8),  # Nm at the nominal torque constant
    ("i2t_rate", _F8),
    ("overcurrent", _F8),  # Nm at the nominal torque constant
    ("overspeed", _F8),  # counts/s
    # state
    ("kind", np.int64),
    ("observed_position", _F8),
    ("observed_velocity", _F8),
    ("displayed_velocity", _F8),
    ("reference_position", _F8),
    ("reference_velocity", _F8),
    ("reference_acceleration", _F8),
    ("integral", _F8),  # rad/s
    ("torque_demand", _F8),  # Nm
    ("i2t", _F8),
    ("in_target_since", _F8),
    ("standing_since", _F8),
    ("following_since", _F8),
]
MOTOR_DTYPE = np.dtype([*_PHYSICS, *_CABLE, *_ENCODER, *_SERVO])

MotorArray = NDArray[np.void]


@dataclass(frozen=True)
class MotorRatings:
    """Nameplate values for which the drive is configured."""

    rated_torque_Nm: float = 3.00
    peak_torque_Nm: float = 11.55
    rated_current_Arms: float = 5.59
    peak_current_Arms: float = 22.8
    torque_constant_Nm_per_Arms: float = 0.561
    rated_speed_rad_s: float = 4947 * 2.0 * math.pi / 60.0


@dataclass(frozen=True)
class Transmission:
    """Transmission from the motor to the cable, from the winch's profile."""

    cable_m_per_rad: float = 0.104 / 4.0
    """Cable paid out per radian of the motor, signed."""
    cable_stiffness_N: float = 40_000.0
    """Axial stiffness EA of the cable."""
    gear_ratio: float = 4.0
    """Motor turns per turn of the drum."""
    cable_damping_s: float = 0.002
    """Ratio of the cable's damping to its stiffness."""


def build_motor(
    plant: Plant, ratings: MotorRatings, transmission: Transmission | None = None
) -> MotorArray:
    """Return the record of a motor at rest without power; shape (1,), dtype MOTOR_DTYPE."""
    motor: MotorArray = np.zeros(1, MOTOR_DTYPE)
    m: Any = motor[0]
    _set_physics(m, plant)
    _set_cable(m, plant, transmission or Transmission())
    _set_cogging(m, plant)
    _set_encoder(m, plant)
    _set_servo(m, plant, ratings)
    return motor


def remove_cable(motor: MotorArray) -> None:
    """Remove the cable of a motor that belongs to no robot."""
    m: Any = motor[0]
    m["load_kind"] = LOAD_KINDS.index("none")
    m["tension"] = m["winch_tension"] = m["load_friction"] = 0.0


def lengthen_cable(motor: MotorArray, metres: float) -> None:
    """Lengthen the cable of a motor that belongs to no robot."""
    m: Any = motor[0]
    m["cable_start"] -= metres


def mend_cable(motor: MotorArray, load: LoadPlant, slipped_m: float) -> None:
    """Reattach the cable of a motor that belongs to no robot, and undo its slip.

    If that would pull the load, the cable is just slack instead. A tight cable stays as it is.
    """
    m: Any = motor[0]
    kind, start = LOAD_KINDS.index(load.kind), float(m["cable_start"])
    reeled_m = float(m["cable_gain"] * (m["angle"] - m["angle_start"]))
    loose_m = reeled_m - float(m["mass_position"])
    if m["load_kind"] == kind:
        loose_m = max(loose_m, start)
    m["load_kind"] = kind
    m["cable_start"] = min(start + slipped_m, loose_m)


def _set_physics(m: Any, plant: Plant) -> None:
    friction, thermal = plant.friction, plant.thermal
    m["inertia"] = plant.inertia_kg_m2
    m["torque_gain"] = m["true_gain"] = 1.0 + plant.motor.torque_constant_error
    m["ripple_order"] = 6.0 * plant.ripple.pole_pairs
    m["ripple_phase"] = math.radians(plant.ripple.phase_deg)
    m["sixth"], m["twelfth"] = plant.ripple.sixth, plant.ripple.twelfth
    m["torque_cap"], m["torque_stuck"] = math.inf, math.nan
    m["current_rate"] = 2.0 * math.pi * plant.drive.current_loop_bandwidth_Hz
    m["coulomb"] = friction.coulomb_Nm
    m["breakaway"] = friction.breakaway_Nm
    m["stribeck"] = friction.stribeck_rad_s
    m["viscous"] = friction.viscous_Nms_rad
    m["sigma0"] = friction.sigma0_Nm_rad
    m["sigma1"] = friction.sigma1_Nms_rad
    m["asymmetry"] = friction.direction_asymmetry
    m["rubbing"] = friction.angle_share
    m["rubbing_phase"] = math.radians(friction.angle_phase_deg)
    m["cogging_per_K"] = thermal.cogging_per_K
    m["friction_per_K"] = thermal.friction_per_K
    m["heating_rate"] = 1.0 / thermal.time_constant_s
    m["rise_limit"] = thermal.rise_K
    m["angle"] = math.radians(plant.motor.initial_angle_deg)
    # A stiff bristle on a light rotor oscillates; steps of a fifth of a radian of phase resolve it.
    ringing = math.sqrt(friction.sigma0_Nm_rad / plant.inertia_kg_m2) * CONTROL_STEP_S
    m["steps_per_control"] = min(20, max(1, math.ceil(ringing / 0.2)))


def _set_cable(m: Any, plant: Plant, transmission: Transmission) -> None:
    load = plant.load
    m["load_kind"] = LOAD_KINDS.index(load.kind)
    if load.kind == "none":
        return
    gain = transmission.cable_m_per_rad * (1.0 + load.drum_radius_error)
    stiffness = (load.cable_stiffness_N or transmission.cable_stiffness_N) / load.cable_m
    if load.kind == "fixed_anchor" and load.anchor_stiffness_N_m is not None:
        stiffness = 1.0 / (1.0 / stiffness + 1.0 / load.anchor_stiffness_N_m)
    hangs = load.kind == "hung_mass" and load.height_m > 0.0
    tension = load.mass_kg * load.gravity_m_s2 if hangs else load.pretension_N
    m["cable_gain"] = gain
    m["cable_stiffness"] = stiffness
    m["cable_damping"] = load.cable_damping_s * stiffness
    m["cable_start"] = tension / stiffness - load.slack_m
    m["angle_start"] = m["angle"]
    m["floor"] = load.height_m
    m["gravity"] = load.gravity_m_s2
    m["winch_friction"] = load.winch_friction_Nm
    m["friction_share"] = load.friction_share * abs(gain)
    m["mass"] = load.mass_kg
    m["tension"] = m["winch_tension"] = tension
    m["load_friction"] = load.winch_friction_Nm + float(m["friction_share"]) * tension


def _set_cogging(m: Any, plant: Plant) -> None:
    terms = sorted(plant.cogging, key=lambda term: term.kind != "torque")
    m["n_cogging"] = len(terms)
    m["n_torque"] = sum(term.kind == "torque" for term in terms)
    for k, term in enumerate(terms):
        m["order"][k] = term.order
        m["amplitude"][k] = term.amplitude_Nm
        m["phase"][k] = math.radians(term.phase_deg)


def _set_encoder(m: Any, plant: Plant) -> None:
    encoder, limits = plant.encoder, plant.limits
    scale = encoder.counts_per_turn / (2.0 * math.pi)
    m["counts_per_rad"] = scale
    m["counts_per_turn"] = encoder.counts_per_turn
    m["noise"] = encoder.noise_counts
    phase = math.radians(encoder.eccentricity_phase_deg)
    m["eccentricity"] = encoder.eccentricity_rad * scale
    m["eccentric_phase"] = phase - math.radians(encoder.index_deg)
    m["eccentric_zero"] = m["eccentricity"] * math.sin(phase)
    m["interpolation"] = encoder.interpolation_error * LINE_COUNTS
    m["delay"] = plant.drive.feedback_delay_s
    m["jitter"] = plant.drive.feedback_jitter_s
    m["random"] = plant.seed
    m["zero"] = m["disc"] = math.floor(float(m["angle"]) * scale + 0.5)
    m["index"] = math.floor(math.radians(encoder.index_deg) * scale + 0.5)
    m["index_present"] = encoder.index_present
    m["slot_time"][:] = -math.inf
    m["slot_angle"][:] = m["angle"]
    m["switch_negative"] = _angle(limits.negative_deg, -math.inf)
    m["switch_positive"] = _angle(limits.positive_deg, math.inf)
    has_home = limits.home_from_deg is not None or limits.home_to_deg is not None
    m["home_from"] = _angle(limits.home_from_deg, -math.inf if has_home else math.inf)
    m["home_to"] = _angle(limits.home_to_deg, math.inf if has_home else -math.inf)


def _angle(degrees: float | None, absent: float) -> float:
    return absent if degrees is None else math.radians(degrees)


def _set_servo(m: Any, plant: Plant, ratings: MotorRatings) -> None:
    drive = plant.drive
    # At the velocity loop's crossover, observer, current loop and integrator cause half of the
    # phase lag. These ratios leave a phase margin of about 50 degrees.
    crossover = 2.0 * math.pi * min(50.0, drive.current_loop_bandwidth_Hz / 10.0)
    m["velocity_gain"] = plant.inertia_kg_m2 * crossover
    m["integral_rate"] = crossover / 4.0
    m["position_gain"] = crossover / 5.0
    m["observer_rate"] = 6.0 * crossover
    m["display_rate"] = crossover
    nominal = ratings.torque_constant_Nm_per_Arms
    m["torque_unit"] = 1e-3 * ratings.rated_torque_Nm
    m["limit_positive"] = m["limit_negative"] = ratings.peak_torque_Nm
    m["rated_current"] = ratings.rated_current_Arms * nominal
    m["overcurrent"] = drive.overcurrent_Arms * nominal
    m["i2t_rate"] = 1.0 / drive.i2t_time_constant_s
    speed = ratings.rated_speed_rad_s * float(m["counts_per_rad"])
    m["speed_limit"] = m["profile_velocity"] = speed
    m["overspeed"] = drive.overspeed_ratio * speed
    m["acceleration"] = m["deceleration"] = m["torque_slope"] = math.inf
    m["following_window"] = m["target_window"] = math.inf
    m["in_target_since"] = m["standing_since"] = m["following_since"] = math.inf
