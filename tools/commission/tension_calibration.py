"""Make the calibration file of a winch, from hung masses or a cable fastened to a load cell."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cdpr_profiles import Winch
from cdpr_profiles.motor_bounds import MOST_GAIN_ERROR
from cdpr_profiles.winch_calibration import WinchCalibration
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.pid import Pid, PidGains
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.exchange import Setpoint, TensionExchange
from cdpr_rt.errors import InvalidRequestError, RawLogError, TripError
from cdpr_rt.identification.rawlog import RawLog, RawLogWriter, column_names, read_raw_log
from cdpr_rt.identification.tension_gain import (
    LEAST_LEVELS,
    LEAST_SPAN,
    CalibrationRefusedError,
    TorquePoint,
    identify_tension_gain,
)
from cdpr_rt.loop.operating import Notifier, Operator, Tolerance
from cdpr_rt.motion.trajectory import Hold, Motion, TrapezoidalMove
from cdpr_tools.composition.session import Session

# Calibrate a winch with a load cell: its fastened cable is wound in and paid out again.

COLUMNS = ["time_s", "winding_in", "torque_sent_Nm", "position_rad", "tension_N", "read_s"]
_TORQUE_SHARE = 0.9
# torque limit relative to the torque that a tension needs by the geometry
_LIMIT_RATIO, _LIMIT_MORE_Nm = 1.3, 0.4
_TOO_MUCH = 1.25
# phase that the latency may cost at the crossover of the damping on the rotor alone
_DAMPING_PHASE = 0.5
_NATURAL_HZ = 12.0
_SPEED_FILTER_S = 0.002
_LONGEST_S, _END_S = 3600.0, 1e-3
TOLERANCE = Tolerance(math.inf, 60.0)
"""Limits for a rotor on an elastic cable, which may be far behind its set-point."""
_TURNED_RAD, _TURNED_SHARE = 0.15, 0.1


@dataclass(frozen=True)
class AnchorPlan:
    """The tensions between which to wind in and pay out, and the speed; on the motor side."""

    lowest_N: float
    highest_N: float
    speed_rad_s: float
    most_travel_rad: float
    """If the highest tension is not reached within this travel, the cable is not fastened."""


def plan_anchor(
    winch: Winch, lowest_N: float, highest_N: float, speed_m_s: float, most_travel_m: float
) -> AnchorPlan:
    """Return the plan; raises InvalidRequestError for tensions that the motor cannot reach."""
    gain = abs(winch.cable_m_per_motor_rad)
    most = _TORQUE_SHARE * winch.motor.rated_torque_Nm / gain
    if not 0.0 < lowest_N < highest_N <= most:
        raise InvalidRequestError(
            f"--lowest-n {lowest_N:g}, --highest-n {highest_N:g}; the first must be "
            f"above 0 and below the second, and the second at most {most:.0f} N "
            f"({100 * _TORQUE_SHARE:g} % of the motor's rated torque)"
        )
    return AnchorPlan(lowest_N, highest_N, speed_m_s / gain, most_travel_m / gain)


class _Pull:
    """The motion: constant speed in one direction until it is reversed; it may end at any time."""

    duration_s = _LONGEST_S

    def __init__(self, start_rad: FloatArray, speed_rad_s: float) -> None:
        self._from_rad, self._since_s = np.array(start_rad, float), 0.0
        self._speed_rad_s = speed_rad_s
        self._now_s = 0.0

    @property
    def travel_rad(self) -> float:
        """Travel of the set-point in the present direction."""
        return abs(self._speed_rad_s) * (self._now_s - self._since_s)

    def turn_back(self) -> None:
        """Reverse the motion from here on."""
        self._from_rad = self._from_rad + self._speed_rad_s * (self._now_s - self._since_s)
        self._since_s, self._speed_rad_s = self._now_s, -self._speed_rad_s

    def fill(self, time_s: float, setpoint: Setpoint) -> None:
        """Write the set-point at `time_s`."""
        self._now_s = time_s
        travelled_rad = self._speed_rad_s * (time_s - self._since_s)
        setpoint.position_rad[:] = self._from_rad + travelled_rad
        setpoint.velocity_rad_s[:] = self._speed_rad_s
        setpoint.acceleration_rad_s2[:] = 0.0

    def brake(self, time_s: float) -> Motion:
        """Return a motion that ends immediately: without torque the cable slackens."""
        now = Setpoint(self._from_rad.size)
        self.fill(time_s, now)
        return Hold(now.position_rad, _END_S)


class _Recording:
    """Writes a row for each reading of the load cell, and decides when to turn and when to end."""

    def __init__(
        self,
        session: Session,
        plan: AnchorPlan,
        pull: _Pull,
        cell: TensionExchange,
        log: RawLogWriter,
    ) -> None:
        self._device = session.device
        self._per_rad_m = abs(session.winch.cable_m_per_motor_rad)
        self._plan, self._pull, self._log = plan, pull, log
        self._exchange = cell
        self._sums = np.zeros(3)
        self._row = np.zeros((1, len(COLUMNS)))
        self._read_s = -math.inf
        self._winding_in = True

    def cycle(self) -> bool:
        """Process a cycle; return whether paying out has reached the lowest tension."""
        feedback, tension = self._device.feedback, self._exchange.feedback
        self._sums += (1.0, self._device.command.torque_Nm[0], feedback.position_rad[0])
        self._exchange.update()
        if not tension.valid[0]:
            raise TripError(self._exchange.reason())
        if tension.time_s[0] == self._read_s:
            return False
        self._read_s = float(tension.time_s[0])
        return self._take(float(tension.tension_N[0]), feedback.time_s)

    def _take(self, tension_N: float, time_s: float) -> bool:
        plan, pull = self._plan, self._pull
        if tension_N > _TOO_MUCH * plan.highest_N:
            raise TripError(f"{self._exchange.cables[0]}: {tension_N:.1f} N")
        _, mean_Nm, mean_rad = self._sums / self._sums[0]
        self._sums[:] = 0.0
        if tension_N >= plan.lowest_N:
            self._row[0] = (time_s, self._winding_in, mean_Nm, mean_rad, tension_N, self._read_s)
            self._log.write(self._row)
        if not self._winding_in:
            return tension_N <= plan.lowest_N
        if pull.travel_rad > plan.most_travel_rad:
            raise TripError(
                f"wound in by {1e3 * pull.travel_rad * self._per_rad_m:.0f} mm and the tension is "
                f"{tension_N:.1f} N; is the end of the cable fastened? (--travel-mm)"
            )
        if tension_N >= plan.highest_N:
            self._winding_in = False
            pull.turn_back()
        return False


def soft_loop(
    winch: Winch, period_s: float, natural_Hz: float, filter_s: float, limit_Nm: float,
    mass_kg: float = 0.0,
) -> Pid:  # fmt: skip
    """Return a soft position loop for a rotor on an elastic cable, perhaps with a mass on it.

    The proportional gain sets the natural frequency of rotor and mass together. The damping is as
    high as the latency allows on the rotor alone: above the cable's resonance only the rotor moves.
    Without integral action a mass is lifted gently and nothing winds up while it stands.
    """
    inertia = winch.motor.rotor_inertia_kg_m2
    together = inertia + mass_kg * winch.cable_m_per_motor_rad**2
    proportional = together * (math.tau * natural_Hz) ** 2
    gains = PidGains(proportional, 0.0, inertia * _DAMPING_PHASE / winch.latency_s, filter_s)
    return Pid([gains], np.array([limit_Nm]), period_s)


def limit_Nm(winch: Winch, tension_N: float, more_Nm: float) -> float:
    """Return the torque limit: above what the tension needs by the geometry, at most the rated."""
    needed_Nm = tension_N * abs(winch.cable_m_per_motor_rad)
    return min(_LIMIT_RATIO * needed_Nm + more_Nm, winch.motor.rated_torque_Nm)


def measure_anchored(
    session: Session, out: Notifier, path: Path, plan: AnchorPlan, cell: TensionExchange
) -> Path:
    """Wind in to the highest tension and pay out again, recording readings into `path`.

    `cell` is the load cell of this cable. Raises TripError if it does not answer, the cable gives
    way or the rotor runs away; the torque is zero afterwards.
    """
    winch, device = session.winch, session.device
    meta: dict[str, Any] = {
        "what": "anchored",
        "identity": session.identity,
        "wind_in": -winch.cable_sign,
        "pole_pairs": winch.motor.poles // 2,
        "cable": cell.cables[0],
        "speed_rad_s": plan.speed_rad_s,
    }
    session.enable()
    pull = _Pull(device.feedback.position_rad, -winch.cable_sign * plan.speed_rad_s)
    log = RawLogWriter(path, COLUMNS, meta)
    try:
        recording = _Recording(session, plan, pull, cell, log)
        out.note(f"winding in to {plan.highest_N:g} N and paying out to {plan.lowest_N:g} N")
        limit = limit_Nm(winch, plan.highest_N, _LIMIT_MORE_Nm)
        loop = soft_loop(winch, device.period_s, _NATURAL_HZ, _SPEED_FILTER_S, limit)
        session.follow(loop, pull, until=recording.cycle)
    finally:
        log.close()
    session.disable()
    return path


def anchored_points(path: Path) -> tuple[list[TorquePoint], int]:
    """Return the points of a recording in order of time, and the motor's pole pairs.

    Raises RawLogError for another kind of recording, CalibrationRefusedError if the cable was
    never taut.
    """
    log = read_raw_log(path)
    try:
        wind_in, order = int(log.header["wind_in"]), int(log.header["pole_pairs"])
    except (KeyError, TypeError, ValueError) as error:
        raise RawLogError(f"{path}: not a recording of a fastened cable ({error})") from None
    columns = [log.column(c) for c in ("tension_N", "torque_sent_Nm", "winding_in", "position_rad")]
    angle = columns[-1]
    reversal = angle[np.argmax(wind_in * angle)]
    apart = min(_TURNED_RAD, _TURNED_SHARE * float(np.ptp(angle)))
    points = [
        TorquePoint(float(tension), wind_in * float(torque), bool(side), float(at))
        for tension, torque, side, at in zip(*columns, strict=True)
        # until the rotor moves the other way, friction is anywhere between its two values
        if side or abs(at - reversal) > apart
    ]
    if max(point.tension_N for point in points) <= 0.0:
        raise CalibrationRefusedError(f"{path}: the load cell saw no tension; is the cable slack?")
    return points, order


# Raise and lower a hung mass, and compute the mean torques over whole motor turns.

_DWELL_S = 1.0
_RAMP_S = 0.5
# travel beyond the measured turns, so that they begin and end at full speed
_MARGIN_RAD = 1.0
# decides how far the rotor turns before the mass lifts: error × gain must reach the weight
_HOIST_NATURAL_HZ = 2.5
_FILTER_S = 1e-3
_UNEVEN_SHARE, _UNEVEN_Nm = 0.04, 0.02


@dataclass(frozen=True)
class HoistPlan:
    """Travel and speed of raising and lowering a mass, on the motor side."""

    speed_rad_s: float
    lead_in_rad: float
    """Travel before the measured turns, to take up the slack and lift the mass off."""
    turns: int = 2
    """Whole motor turns measured in each direction; over whole turns, cogging does no work."""

    @property
    def travel_rad(self) -> float:
        """Return the travel of the set-point."""
        return self.lead_in_rad + self.turns * math.tau + _MARGIN_RAD

    @property
    def duration_s(self) -> float:
        """Return the time for raising and lowering."""
        return 2.0 * (self.travel_rad / self.speed_rad_s + _RAMP_S) + _DWELL_S


class Hoist:
    """The motion: up at constant speed, a rest, and down again to the start.

    `wind_in` is the sign of the motor angle that winds the cable in. To stop, it lowers the mass,
    because without torque the mass would drop.
    """

    def __init__(self, plan: HoistPlan, start_rad: FloatArray, wind_in: int) -> None:
        speed = np.full(np.shape(start_rad), wind_in * plan.speed_rad_s)
        cruise = plan.travel_rad / plan.speed_rad_s - _RAMP_S
        up = TrapezoidalMove(start_rad, speed, cruise, _RAMP_S)
        self._parts = (
            up,
            Hold(up.end_rad(), _DWELL_S),
            TrapezoidalMove(up.end_rad(), -speed, cruise, _RAMP_S),
        )
        self._start_rad = np.array(start_rad, float)
        self._speed_rad_s = plan.speed_rad_s
        self.duration_s = sum(part.duration_s for part in self._parts)

    def fill(self, time_s: float, setpoint: Setpoint) -> None:
        """Write the set-point at `time_s`."""
        *before, last = self._parts
        for part in before:
            if time_s < part.duration_s:
                part.fill(time_s, setpoint)
                return
            time_s -= part.duration_s
        last.fill(time_s, setpoint)

    def brake(self, time_s: float) -> Motion:
        """Return the motion that lowers the mass to the start."""
        now = Setpoint(self._start_rad.size)
        self.fill(time_s, now)
        return _Lowering(now.position_rad, self._start_rad, self._speed_rad_s)


class _Lowering:
    """Motion from the current set-point back to the start, in the second half of its duration."""

    def __init__(self, here_rad: FloatArray, start_rad: FloatArray, speed_rad_s: float) -> None:
        travel = start_rad - here_rad
        cruise = max(0.0, float(np.abs(travel).max()) / speed_rad_s - _RAMP_S)
        self._leg = TrapezoidalMove(here_rad, travel / (cruise + _RAMP_S), cruise, _RAMP_S)
        self.duration_s = 2.0 * self._leg.duration_s

    def fill(self, time_s: float, setpoint: Setpoint) -> None:
        self._leg.fill(time_s - self._leg.duration_s, setpoint)

    def brake(self, time_s: float) -> Motion:
        del time_s
        return self


def hoist_points(log: RawLog) -> list[TorquePoint]:
    """Return the torques for raising and for lowering from the recording of a hoist.

    The mean torque comes from the work over whole turns, to which cogging and speed ripple do not
    contribute. Raises CalibrationRefusedError if the mass did not hang all the time, RawLogError
    for another kind of recording.
    """
    header = log.header
    try:
        wind_in, turns = int(header["wind_in"]), int(header["turns"])
        speed, tension = float(header["speed_rad_s"]), float(header["tension_N"])
    except (KeyError, TypeError, ValueError) as error:
        raise RawLogError(f"{log.path}: not a recording of a hoist ({error})") from None
    angle = wind_in * log.column("position_rad")
    torque = wind_in * log.column("torque_sent_Nm")
    wanted = wind_in * log.column("setpoint_velocity_rad_s")
    work = np.concatenate(([0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle))))
    points = []
    for winding_in in (True, False):
        side = 1.0 if winding_in else -1.0
        steady = np.flatnonzero(side * wanted > 0.999 * speed)
        if steady.size == 0:
            raise CalibrationRefusedError(
                f"{log.path}: the recording ends before the mass was moved"
            )
        travelled = np.maximum.accumulate(side * angle[steady])
        # the turns next to the top, where the mass had hung longest
        top = travelled[-1] if winding_in else travelled[0] + 0.5 * _MARGIN_RAD + turns * math.tau
        bounds = top - math.tau * np.arange(turns, -1, -1)
        if bounds[0] < travelled[0] or bounds[-1] > travelled[-1]:
            raise CalibrationRefusedError(
                f"{log.path}: the motor did not make {turns} turns at full speed; give a longer "
                "--lead-mm or a lower --speed-mm-s"
            )
        each = side * np.diff(np.interp(bounds, travelled, work[steady])) / math.tau
        _refuse_uneven(each, winding_in, header)
        points.append(TorquePoint(tension, float(each.mean()), winding_in))
    return points


def _refuse_uneven(each: FloatArray, winding_in: bool, header: dict[str, Any]) -> None:
    spread = float(each.max() - each.min())
    if spread > _UNEVEN_SHARE * abs(float(each.mean())) + _UNEVEN_Nm:
        shown = ", ".join(f"{value:.3f}" for value in each)
        raise CalibrationRefusedError(
            f"{header.get('mass_kg')} kg {'raised' if winding_in else 'lowered'}: the turns took "
            f"{shown} Nm; the mass did not always hang freely: take up the slack, or give a "
            "longer --lead-mm"
        )


# Calibrate a winch with masses that somebody hangs on its cable.

_MASSES_LIMIT_MORE_Nm = 0.6
_SPEED_RATIO, _LEAST_SPEED_RAD_S = 5.0, 30.0

Hang = Callable[[float, Clock], None]
"""Asks somebody to hang a mass (kg) on the cable, lets time pass, and returns when it hangs."""


def not_hung(mass_kg: float) -> InvalidRequestError:
    """Return the error for a mass that was not hung."""
    return InvalidRequestError(f"{mass_kg:g} kg were not hung; the drive has no power")


def plan_hoist(winch: Winch, speed_m_s: float, lead_m: float, turns: int) -> HoistPlan:
    """Return the plan for a cable speed and a lead-in along the cable."""
    per_rad = abs(winch.cable_m_per_motor_rad)
    return HoistPlan(speed_m_s / per_rad, lead_m / per_rad, turns)


def check_masses(winch: Winch, masses_kg: Sequence[float], gravity: float) -> None:
    """Raise InvalidRequestError for masses that are too heavy for the motor or not usable."""
    sound = all(math.isfinite(mass) and mass > 0.0 for mass in masses_kg)
    if not sound or len(masses_kg) < LEAST_LEVELS or len(_files(masses_kg)) < len(masses_kg):
        raise InvalidRequestError("--masses: give at least three different masses in kg: 2,5,10")
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
    session: Session,
    out: Notifier,
    folder: Path,
    plan: HoistPlan,
    masses_kg: Sequence[float],
    hang: Hang,
    gravity: float,
) -> list[Path]:
    """Raise and lower each mass, recording into `folder`; the drive has no power in between.

    Raises CalibrationRefusedError for an unusable recording.
    """
    recorded = []
    for mass_kg in masses_kg:
        have_hung(session, mass_kg, hang)
        path = folder / _file_name(mass_kg)
        with out.progress(f"raising and lowering {mass_kg:g} kg", plan.duration_s) as advance:
            _hoist(session, path, plan, mass_kg, gravity, advance)
        # check before the next mass is hung
        points = hoist_points(read_raw_log(path))
        _refuse_another_mass(points, mass_kg, gravity * abs(session.winch.cable_m_per_motor_rad))
        recorded.append(path)
    return recorded


def _refuse_another_mass(points: Sequence[TorquePoint], mass_kg: float, gain_m2_s2: float) -> None:
    """Raise CalibrationRefusedError if the torque does not fit the mass at all."""
    lifted_kg = sum(point.torque_Nm for point in points) / len(points) / gain_m2_s2
    if abs(lifted_kg - mass_kg) > MOST_GAIN_ERROR * mass_kg:
        raise CalibrationRefusedError(
            f"{mass_kg:g} kg should hang there, but the torque corresponds to "
            f"{lifted_kg:.1f} kg; is it the right mass, and are cable_sign, drum_radius_m "
            "and gear_ratio of the winch's profile right?"
        )


def have_hung(session: Operator, mass_kg: float, hang: Hang) -> None:
    """Ask for a mass to be hung; cycles continue meanwhile, so the winch stays supervised."""
    session.run_task(lambda: hang(mass_kg, session.device.clock))


def hoist_tolerance(plan: HoistPlan) -> Tolerance:
    """Return the following error and speed that are allowed for a mass swinging on its cable."""
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
    limit = limit_Nm(winch, mass_kg * gravity, _MASSES_LIMIT_MORE_Nm)
    controller = soft_loop(winch, device.period_s, _HOIST_NATURAL_HZ, _FILTER_S, limit, mass_kg)
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
        if session.device.faults() or abs(controller.effort_Nm[0]) < limit:
            raise
        raise TripError(
            f"{error}: {limit:.2f} Nm, the largest allowed torque, do not lift {mass_kg:g} "
            "kg; check that the cable runs freely and that the mass is right, or use "
            "lighter ones"
        ) from None
    finally:
        log.close()
    session.disable()


def mass_points(paths: Sequence[Path]) -> list[TorquePoint]:
    """Return the points of recorded hoists; raises RawLogError and CalibrationRefusedError."""
    return [point for path in paths for point in hoist_points(read_raw_log(path))]


FILE_NAME, PICTURE = "winch-calibration.toml", "winch-calibration.png"
_PULL = "pull.raw"


def raw_folder(folder: Path) -> Path:
    """Return the folder of a calibration's recordings."""
    return folder / "raw"


def pull_file(folder: Path) -> Path:
    """Return the file of the recording of a fastened cable."""
    return raw_folder(folder) / _PULL


def recorded_winch(folder: Path) -> str:
    """Return the winch whose recordings a folder holds; raises InvalidRequestError, RawLogError."""
    return str(_identity(_recordings(folder)[0])["winch"])


def discard(folder: Path) -> None:
    """Remove only the recordings and the result of an earlier calibration."""
    for path in (*_found(folder), folder / FILE_NAME, folder / PICTURE):
        path.unlink(missing_ok=True)


def _found(folder: Path) -> list[Path]:
    return sorted(raw_folder(folder).glob("mass-*.raw")) + sorted(raw_folder(folder).glob(_PULL))


def _recordings(folder: Path) -> list[Path]:
    found = _found(folder)
    if not found:
        raise InvalidRequestError(f"{folder}: contains no recordings of a calibration (raw/...)")
    return found


def _identity(path: Path) -> Mapping[str, Any]:
    whose = read_raw_log(path).header.get("identity")
    if (
        not isinstance(whose, dict)
        or not {"winch", "motor"} <= whose.keys()
        or not isinstance(whose.get("serial"), int)
    ):
        raise RawLogError(f"{path}: does not name its winch")
    return whose


def calibrate(folder: Path, winch: Winch) -> tuple[WinchCalibration, list[TorquePoint]]:
    """Identify the calibration from the recordings in `folder` and write its file there.

    Returns it with the points it was fitted to. If the recordings do not support a calibration,
    raises CalibrationRefusedError and writes nothing.
    """
    recorded = _recordings(folder)
    whose = _identity(recorded[0])
    nominal = abs(winch.cable_m_per_motor_rad)
    method: Literal["masses", "sensors"]
    if recorded[0].name == _PULL:
        method = "sensors"
        points, order = anchored_points(recorded[0])
        found = identify_tension_gain(points, nominal, order)
    else:
        method = "masses"
        points = mass_points(recorded)
        found = identify_tension_gain(points, nominal)
    calibration = WinchCalibration(
        winch=str(whose["winch"]),
        motor=str(whose["motor"]),
        drive_serial=whose["serial"],
        date=datetime.now(UTC).replace(microsecond=0),
        method=method,
        gain_m=found.gain_m.value,
        gain_half_width_m=found.gain_m.half_width,
        nominal_gain_m=nominal,
        bias_Nm=found.bias_Nm.value,
        bias_half_width_Nm=found.bias_Nm.half_width,
        friction_Nm=found.friction_Nm.value,
        friction_half_width_Nm=found.friction_Nm.half_width,
        friction_per_N_m=found.friction_per_N_m.value,
        friction_per_N_half_width_m=found.friction_per_N_m.half_width,
        residual_rms_Nm=found.residual_rms_Nm,
        lowest_tension_N=found.lowest_N,
        highest_tension_N=found.highest_N,
        raw_data=tuple(str(path.relative_to(folder)) for path in recorded),
    )
    for key, problem in calibration.faults(winch):
        raise CalibrationRefusedError(f"{key}: {problem}")
    calibration.save(folder / FILE_NAME)
    return calibration, points
