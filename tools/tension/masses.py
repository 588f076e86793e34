"""Calibrate a winch by masses that somebody hangs on its cable."""

from __future__ import annotations

import math
import os
import signal
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import typer

from cdpr_rt.clock import Clock
from cdpr_rt.errors import TripError
from cdpr_rt.raw_rows import column_names
from cdpr_rt.rawlog import RawLogWriter, read_raw_log
from cdpr_rt.tension_gain import (
    LEAST_LEVELS,
    LEAST_SPAN,
    CalibrationRefusedError,
    TorquePoint,
)
from profiles import Winch
from profiles.motor_bounds import FARTHEST_FROM_NOMINAL
from sim_bus.physics_board import PhysicsBoard
from tools.errors import BadInputError
from tools.output import Output
from tools.session import Session, Tolerance
from tools.tension.hoist import Hoist, HoistPlan, hoist_controller, hoist_points

_TORQUE_SHARE = 0.9
# beyond what the geometry says the heaviest mass needs
_LIMIT_RATIO, _LIMIT_MORE_Nm = 1.3, 0.6
_SPEED_RATIO, _LEAST_SPEED_RAD_S = 5.0, 30.0

Hang = Callable[[float, Clock], None]
"""Sees to it that a mass hangs on the cable, in kg, while time goes on; returns when it does."""


def plan_hoist(winch: Winch, speed_m_s: float, lead_m: float, turns: int) -> HoistPlan:
    """Return the plan for a cable speed and a lead-in along the cable."""
    per_rad = abs(winch.cable_m_per_motor_rad)
    return HoistPlan(speed_m_s / per_rad, lead_m / per_rad, turns)


def check_masses(winch: Winch, masses_kg: Sequence[float], gravity: float) -> None:
    """Raise BadInputError for masses that are too heavy for the motor or of no use."""
    sound = all(math.isfinite(mass) and mass > 0.0 for mass in masses_kg)
    if not sound or len(masses_kg) < LEAST_LEVELS or len(_files(masses_kg)) < len(masses_kg):
        raise BadInputError("--masses: at least three different masses in kg, as 2,5,10")
    if max(masses_kg) < LEAST_SPAN * min(masses_kg):
        raise BadInputError(
            f"--masses: {min(masses_kg):g} to {max(masses_kg):g} kg; the heaviest must be at least "
            f"{LEAST_SPAN:g} times the lightest"
        )
    gain = abs(winch.cable_m_per_motor_rad)
    most = _TORQUE_SHARE * winch.motor.rated_torque_Nm / (gain * gravity)
    if max(masses_kg) > most:
        raise BadInputError(
            f"--masses: {max(masses_kg):g} kg; allowed: up to {most:.1f} kg, which takes "
            f"{100 * _TORQUE_SHARE:g} % of the motor's rated torque"
        )


def _files(masses_kg: Sequence[float]) -> set[str]:
    return {_file_name(mass_kg) for mass_kg in masses_kg}


def _file_name(mass_kg: float) -> str:
    return f"mass-{mass_kg:g}kg.raw"


def by_prompt(mass_kg: float, clock: Clock) -> None:
    """Ask the person at the winch; the drive has no power, so Ctrl-C may end it here at once.

    Only Enter alone raises the mass: who types a word wants something else.
    """
    ending = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, signal.default_int_handler) for number in ending}
    question = (
        f"Hang {mass_kg:g} kg on the cable, standing on its support, take up the slack, and "
        "press Enter (Ctrl-C ends)"
    )
    try:
        # a person takes their time; the safety I/O is asked meanwhile
        while clock.aside(partial(_typed, question)):
            typer.echo("Enter alone, please.", err=True)
    except (EOFError, KeyboardInterrupt):
        raise _nobody(mass_kg) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _nobody(mass_kg: float) -> BadInputError:
    return BadInputError(f"nobody has hung {mass_kg:g} kg; the drive is without power")


def _typed(question: str) -> str:
    """Ask, and return the line that is typed; raises EOFError where no more can come.

    Not by `input`: a thread that is still there when the process ends would hold the buffer's lock.
    """
    typer.echo(f"{question}: ", nl=False, err=True)
    line = b""
    while not line.endswith(b"\n"):
        byte = os.read(sys.stdin.fileno(), 1)
        if not byte:
            raise EOFError
        line += byte
    return line.decode(errors="replace").strip()


def on_board(board: Path) -> Hang:
    """Return what hangs masses on the first cable of a simulator, by its physics board."""

    def hang(mass_kg: float, _: Clock) -> None:
        with PhysicsBoard.attach(board) as shared:
            shared.axis(0).hung_mass_kg = mass_kg

    return hang


def measure_masses(
    session: Session,
    out: Output,
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
        _have_hung(session, mass_kg, hang)
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
    if abs(lifted_kg - mass_kg) > FARTHEST_FROM_NOMINAL * mass_kg:
        raise CalibrationRefusedError(
            f"{mass_kg:g} kg were asked for, and the torque is that of {lifted_kg:.1f} kg by the "
            "geometry; does that mass hang there, and are cable_sign, drum_radius_m and "
            "gear_ratio of the winch's profile right?"
        )


def _have_hung(session: Session, mass_kg: float, hang: Hang) -> None:
    """Have a mass hung; cycles go on meanwhile, so that what guards the winch is asked."""
    try:
        session.beside(lambda: hang(mass_kg, session.device.clock))
    except KeyboardInterrupt:  # which comes where the cycles run
        raise _nobody(mass_kg) from None


def hoist_tolerance(plan: HoistPlan) -> Tolerance:
    """Return by how much a mass may swing on its cable."""
    speed = max(_SPEED_RATIO * plan.speed_rad_s, _LEAST_SPEED_RAD_S)
    return Tolerance(plan.lead_in_rad + math.tau, speed)


def _hoist(
    session: Session,
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
