"""Calibrate a winch by masses that somebody hangs on its cable."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cdpr_profiles import Winch
from cdpr_profiles.limits.motor_bounds import MOST_GAIN_ERROR
from cdpr_rt.core.clock import Clock
from cdpr_rt.errors import InvalidRequestError, TripError
from cdpr_rt.identification.rawlog import RawLogWriter, column_names, read_raw_log
from cdpr_rt.identification.tension_gain import (
    LEAST_LEVELS,
    LEAST_SPAN,
    CalibrationRefusedError,
    TorquePoint,
)
from cdpr_rt.procedures.tension.hoist import Hoist, HoistPlan, hoist_controller, hoist_points
from cdpr_rt.procedures.winch_operator import Notifier, Tolerance, WinchOperator
from cdpr_rt.runtime.operating import Operator

_TORQUE_SHARE = 0.9
# beyond what the geometry says the heaviest mass needs
_LIMIT_RATIO, _LIMIT_MORE_Nm = 1.3, 0.6
_SPEED_RATIO, _LEAST_SPEED_RAD_S = 5.0, 30.0

Hang = Callable[[float, Clock], None]
"""Sees to it that a mass hangs on the cable, in kg, while time goes on; returns when it does."""


def not_hung(mass_kg: float) -> InvalidRequestError:
    """Return the error of a mass that was not hung."""
    return InvalidRequestError(f"nobody has hung {mass_kg:g} kg; the drive is without power")


def plan_hoist(winch: Winch, speed_m_s: float, lead_m: float, turns: int) -> HoistPlan:
    """Return the plan for a cable speed and a lead-in along the cable."""
    per_rad = abs(winch.cable_m_per_motor_rad)
    return HoistPlan(speed_m_s / per_rad, lead_m / per_rad, turns)


def check_masses(winch: Winch, masses_kg: Sequence[float], gravity: float) -> None:
    """Raise InvalidRequestError for masses that are too heavy for the motor or of no use."""
    sound = all(math.isfinite(mass) and mass > 0.0 for mass in masses_kg)
    if not sound or len(masses_kg) < LEAST_LEVELS or len(_files(masses_kg)) < len(masses_kg):
        raise InvalidRequestError("--masses: at least three different masses in kg, as 2,5,10")
    if max(masses_kg) < LEAST_SPAN * min(masses_kg):
        raise InvalidRequestError(
            f"--masses: {min(masses_kg):g} to {max(masses_kg):g} kg; the heaviest must be at least "
            f"{LEAST_SPAN:g} times the lightest"
        )
    gain = abs(winch.cable_m_per_motor_rad)
    most = _TORQUE_SHARE * winch.motor.rated_torque_Nm / (gain * gravity)
    if max(masses_kg) > most:
        raise InvalidRequestError(
            f"--masses: {max(masses_kg):g} kg; allowed: up to {most:.1f} kg, which takes "
            f"{100 * _TORQUE_SHARE:g} % of the motor's rated torque"
        )


def _files(masses_kg: Sequence[float]) -> set[str]:
    return {_file_name(mass_kg) for mass_kg in masses_kg}


def _file_name(mass_kg: float) -> str:
    return f"mass-{mass_kg:g}kg.raw"


def measure_masses(
    session: WinchOperator,
    out: Notifier,
    folder: Path,
    plan: HoistPlan,
    masses_kg: Sequence[float],
    hang: Hang,
    gravity: float,
) -> list[Path]:
    """Raise and lower each mass, recording into `folder`; the drive has no power in between.

    Raises CalibrationRefusedError for a recording that is of no use.
    """
    recorded = []
    for mass_kg in masses_kg:
        have_hung(session, mass_kg, hang)
        path = folder / _file_name(mass_kg)
        with out.progress(f"raising and lowering {mass_kg:g} kg", plan.duration_s) as advance:
            _hoist(session, path, plan, mass_kg, gravity, advance)
        # refused before the next mass is hung
        points = hoist_points(read_raw_log(path))
        _refuse_another_mass(points, mass_kg, gravity * abs(session.winch.cable_m_per_motor_rad))
        recorded.append(path)
    return recorded


def _refuse_another_mass(points: Sequence[TorquePoint], mass_kg: float, gain_m2_s2: float) -> None:
    """Raise CalibrationRefusedError where the torque is nowhere near that of the mass."""
    lifted_kg = sum(point.torque_Nm for point in points) / len(points) / gain_m2_s2
    if abs(lifted_kg - mass_kg) > MOST_GAIN_ERROR * mass_kg:
        raise CalibrationRefusedError(
            f"{mass_kg:g} kg were asked for, and the torque is that of {lifted_kg:.1f} kg by the "
            "geometry; does that mass hang there, and are cable_sign, drum_radius_m and "
            "gear_ratio of the winch's profile right?"
        )


def have_hung(session: Operator, mass_kg: float, hang: Hang) -> None:
    """Ask for a mass to be hung; cycles go on meanwhile, and the winch stays supervised."""
    session.run_task(lambda: hang(mass_kg, session.device.clock))


def hoist_tolerance(plan: HoistPlan) -> Tolerance:
    """Return by how much a mass may swing on its cable."""
    speed = max(_SPEED_RATIO * plan.speed_rad_s, _LEAST_SPEED_RAD_S)
    return Tolerance(plan.lead_in_rad + math.tau, speed)


def _hoist(
    session: WinchOperator,
    path: Path,
    plan: HoistPlan,
    mass_kg: float,
    gravity: float,
    on_progress: Callable[[float], None],
) -> None:
    winch, device = session.winch, session.device
    per_rad = winch.cable_m_per_motor_rad
    weight = mass_kg * gravity * abs(per_rad)
    limit = min(_LIMIT_RATIO * weight + _LIMIT_MORE_Nm, winch.motor.rated_torque_Nm)
    controller = hoist_controller(
        winch.motor.rotor_inertia_kg_m2,
        mass_kg * per_rad**2,
        winch.latency_s,
        device.period_s,
        limit,
    )
    meta: dict[str, Any] = {
        "what": "hoist",
        "identity": session.identity,
        "period_s": device.period_s,
        "mass_kg": mass_kg,
        "gravity_m_s2": gravity,
        "tension_N": mass_kg * gravity,
        "wind_in": -winch.cable_sign,
        "speed_rad_s": plan.speed_rad_s,
        "lead_in_rad": plan.lead_in_rad,
        "turns": plan.turns,
    }
    session.enable()
    motion = Hoist(plan, device.feedback.position_rad, -winch.cable_sign)
    log = RawLogWriter(path, column_names(device.n), meta)
    try:
        session.follow(controller, motion, log, on_progress)
    except TripError as error:
        if session.device.alarm() or abs(controller.effort_Nm[0]) < limit:
            raise
        raise TripError(
            f"{error}: {limit:.2f} Nm, the most that was allowed, do not lift {mass_kg:g} kg; see "
            "that the cable runs free and that no heavier mass hangs there, or take lighter ones"
        ) from None
    finally:
        log.close()
    session.disable()


def mass_points(paths: Sequence[Path]) -> list[TorquePoint]:
    """Return the points of recorded hoists; raises RawLogError and CalibrationRefusedError."""
    return [point for path in paths for point in hoist_points(read_raw_log(path))]
