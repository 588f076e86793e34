"""Raise and lower a hung mass, and what torque that took over whole motor turns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.pid import Pid, PidGains
from cdpr_rt.core.exchange import Setpoint
from cdpr_rt.errors import RawLogError
from cdpr_rt.identification.rawlog import RawLog
from cdpr_rt.identification.tension_gain import CalibrationRefusedError, TorquePoint
from cdpr_rt.motion.trajectory import Hold, Motion, TrapezoidalMove

_DWELL_S = 1.0
_RAMP_S = 0.5
# beyond the measured turns, so that they end and begin at full speed
_MARGIN_RAD = 1.0
# the rotor turns so far before the mass leaves its support: error × gain must reach the weight
_NATURAL_HZ = 2.5
# phase that the latency may take where the derivative crosses over on the rotor alone
_DAMPING_PHASE = 0.5
_FILTER_S = 1e-3
_UNEVEN_SHARE, _UNEVEN_Nm = 0.04, 0.02


@dataclass(frozen=True)
class HoistPlan:
    """Travel and speed of raising and lowering a mass, on the motor side."""

    speed_rad_s: float
    lead_in_rad: float
    """Wound in before the measured turns: slack, and what it takes to lift the mass off."""
    turns: int = 2
    """Whole motor turns that are measured each way: cogging takes no work over them."""

    @property
    def travel_rad(self) -> float:
        """Return how far the set-point goes."""
        return self.lead_in_rad + self.turns * math.tau + _MARGIN_RAD

    @property
    def duration_s(self) -> float:
        """Return how long it takes up and down."""
        return 2.0 * (self.travel_rad / self.speed_rad_s + _RAMP_S) + _DWELL_S


class Hoist:
    """The motion: up at constant speed, a rest, and down again to where it began.

    `wind_in` is the sign of the motor angle that winds the cable in. It is stopped by lowering the
    mass, for without torque it would drop.
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
        """Return the motion that lowers the mass to where it was."""
        now = Setpoint(self._start_rad.size)
        self.fill(time_s, now)
        return _Lowering(now.position_rad, self._start_rad, self._speed_rad_s)


class _Lowering:
    """From where the set-point is back to the start; it is entered at half its time."""

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


def hoist_controller(
    inertia_kg_m2: float,
    mass_inertia_kg_m2: float,
    latency_s: float,
    period_s: float,
    limit_Nm: float,
) -> Pid:
    """Return a soft position loop for a rotor with a mass on an elastic cable.

    Proportional for a natural frequency of the whole, damped as far as latency allows on the rotor
    alone, which is all that feels the derivative above the cable's resonance; no integral action,
    so that the mass is lifted gently and nothing winds up while it stands.
    """
    derivative = inertia_kg_m2 * _DAMPING_PHASE / latency_s
    together = inertia_kg_m2 + mass_inertia_kg_m2
    proportional = together * (math.tau * _NATURAL_HZ) ** 2
    gains = PidGains(proportional, 0.0, derivative, _FILTER_S)
    return Pid([gains], np.array([limit_Nm]), period_s)


def hoist_points(log: RawLog) -> list[TorquePoint]:
    """Return the torque of raising and of lowering from the recording of a hoist.

    The mean torque is the work over whole turns, to which neither cogging nor speed ripple adds.
    Raises CalibrationRefusedError where the mass did not hang all the time, RawLogError for a
    recording of something else.
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
        # the turns next to the top, where the mass hung for longest
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
            f"{shown} Nm; the mass did not hang freely all the time: take up the slack, or give a "
            "longer --lead-mm"
        )
