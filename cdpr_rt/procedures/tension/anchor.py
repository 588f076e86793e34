"""Calibrate a winch by a load cell: its cable made fast, wound in and paid out again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles import Winch
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.pid import Pid, PidGains
from cdpr_rt.core.exchange import Setpoint
from cdpr_rt.core.tension_feedback import TensionExchange
from cdpr_rt.errors import InvalidRequestError, RawLogError, TripError
from cdpr_rt.identification.rawlog import RawLogWriter, read_raw_log
from cdpr_rt.identification.tension_gain import CalibrationRefusedError, TorquePoint
from cdpr_rt.motion.trajectory import Hold, Motion
from cdpr_rt.procedures.winch_operator import Notifier, Tolerance, WinchOperator

COLUMNS = ["time_s", "winding_in", "torque_sent_Nm", "position_rad", "tension_N", "read_s"]
_TORQUE_SHARE = 0.9
# beyond what the geometry says the highest tension needs
_LIMIT_RATIO, _LIMIT_MORE_Nm = 1.3, 0.4
_TOO_MUCH = 1.25
# phase that the latency may take where the damping crosses over on the rotor alone
_DAMPING_PHASE = 0.5
_NATURAL_HZ = 12.0
_SPEED_FILTER_S = 0.002
_LONGEST_S, _END_S = 3600.0, 1e-3
TOLERANCE = Tolerance(math.inf, 60.0)
"""Limits of a rotor on an elastic cable, whose set-point may be far ahead of it."""
_TURNED_RAD, _TURNED_SHARE = 0.15, 0.1


@dataclass(frozen=True)
class AnchorPlan:
    """Between which tensions to wind in and pay out, and how fast; on the motor side."""

    lowest_N: float
    highest_N: float
    speed_rad_s: float
    most_travel_rad: float
    """Wound in so far without the highest tension, the cable is not made fast."""


def plan_anchor(
    winch: Winch, lowest_N: float, highest_N: float, speed_m_s: float, most_travel_m: float
) -> AnchorPlan:
    """Return the plan; raises InvalidRequestError for tensions the motor cannot give."""
    gain = abs(winch.cable_m_per_motor_rad)
    most = _TORQUE_SHARE * winch.motor.rated_torque_Nm / gain
    if not 0.0 < lowest_N < highest_N <= most:
        raise InvalidRequestError(
            f"--lowest-n {lowest_N:g}, --highest-n {highest_N:g}; allowed: rising and up to "
            f"{most:.0f} N, which takes {100 * _TORQUE_SHARE:g} % of the motor's rated torque"
        )
    return AnchorPlan(lowest_N, highest_N, speed_m_s / gain, most_travel_m / gain)


class _Pull:
    """The motion: one way at constant speed until it is turned back; it may be ended anywhere."""

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
        """Go the other way from here on."""
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
        """Return the motion that ends at once: the torque goes, and the cable with it."""
        now = Setpoint(self._from_rad.size)
        self.fill(time_s, now)
        return Hold(now.position_rad, _END_S)


class _Recording:
    """Writes a row for each reading of the load cell, and says where to turn and to end."""

    def __init__(
        self,
        session: WinchOperator,
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
        """Take in a cycle; return whether the lowest tension has been paid out to."""
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
                f"{tension_N:.1f} N; is the cable made fast? (--travel-mm)"
            )
        if tension_N >= plan.highest_N:
            self._winding_in = False
            pull.turn_back()
        return False


def _controller(session: WinchOperator, plan: AnchorPlan) -> Pid:
    """Return a soft position loop, damped as far as latency allows on the rotor alone."""
    winch = session.winch
    inertia = winch.motor.rotor_inertia_kg_m2
    proportional = inertia * (math.tau * _NATURAL_HZ) ** 2
    derivative = inertia * _DAMPING_PHASE / winch.latency_s
    needed_Nm = plan.highest_N * abs(winch.cable_m_per_motor_rad)
    limit_Nm = min(_LIMIT_RATIO * needed_Nm + _LIMIT_MORE_Nm, winch.motor.rated_torque_Nm)
    gains = PidGains(proportional, 0.0, derivative, _SPEED_FILTER_S)
    return Pid([gains], np.array([limit_Nm]), session.device.period_s)


def measure_anchored(
    session: WinchOperator,
    out: Notifier,
    path: Path,
    plan: AnchorPlan,
    cell: TensionExchange,
) -> Path:
    """Wind in to the highest tension and pay out again, recording readings into `path`.

    `cell` has the one load cell of this cable. Raises TripError when it does not answer, the cable
    gives way or the rotor runs away; the torque is zero afterwards.
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
        session.follow(_controller(session, plan), pull, until=recording.cycle)
    finally:
        log.close()
    session.disable()
    return path


def anchored_points(path: Path) -> tuple[list[TorquePoint], int]:
    """Return the points of a recording in the order of time, and the motor's pole pairs.

    Raises RawLogError for a recording of something else, CalibrationRefusedError where the cable
    was never taut.
    """
    log = read_raw_log(path)
    try:
        wind_in, order = int(log.header["wind_in"]), int(log.header["pole_pairs"])
    except (KeyError, TypeError, ValueError) as error:
        raise RawLogError(f"{path}: not a recording of a pulled cable ({error})") from None
    columns = [log.column(c) for c in ("tension_N", "torque_sent_Nm", "winding_in", "position_rad")]
    angle = columns[-1]
    reversal = angle[np.argmax(wind_in * angle)]
    apart = min(_TURNED_RAD, _TURNED_SHARE * float(np.ptp(angle)))
    points = [
        TorquePoint(float(tension), wind_in * float(torque), bool(side), float(at))
        for tension, torque, side, at in zip(*columns, strict=True)
        # until the rotor slides the other way, friction is anywhere between both sides
        if side or abs(at - reversal) > apart
    ]
    if max(point.tension_N for point in points) <= 0.0:
        raise CalibrationRefusedError(f"{path}: the load cell saw no tension; is the cable slack?")
    return points, order
