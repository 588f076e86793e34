"""Calibrate a winch by a load cell: its cable made fast, wound in and paid out again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_rt.errors import RawLogError, TripError
from cdpr_rt.rawlog import RawLogWriter, read_raw_log
from cdpr_rt.runtime.states import Reaction
from cdpr_rt.tension_gain import CalibrationRefusedError, TorquePoint
from drivers.modbus.tension import TensionSampler
from profiles import Winch
from tools.errors import BadInputError
from tools.output import Output
from tools.session import WinchSession

COLUMNS = ["time_s", "winding_in", "torque_sent_Nm", "position_rad", "tension_N", "read_s"]
_TORQUE_SHARE = 0.9
# beyond what the geometry says the highest tension needs
_LIMIT_RATIO, _LIMIT_MORE_Nm = 1.3, 0.4
_TOO_MUCH = 1.25
# phase that the latency may take where the damping crosses over on the rotor alone
_DAMPING_PHASE = 0.5
_NATURAL_HZ = 12.0
_SPEED_FILTER_S = 0.002
_FASTEST_RAD_S = 60.0
_LONGEST_S = 3600.0
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
    """Return the plan; raises BadInputError for tensions the motor cannot give."""
    gain = abs(winch.cable_m_per_motor_rad)
    most = _TORQUE_SHARE * winch.motor.rated_torque_Nm / gain
    if not 0.0 < lowest_N < highest_N <= most:
        raise BadInputError(
            f"--lowest-n {lowest_N:g}, --highest-n {highest_N:g}; allowed: rising and up to "
            f"{most:.0f} N, which takes {100 * _TORQUE_SHARE:g} % of the motor's rated torque"
        )
    return AnchorPlan(lowest_N, highest_N, speed_m_s / gain, most_travel_m / gain)


class _Puller:
    """Moves the rotor at constant speed against the cable, one cycle at a time."""

    def __init__(self, session: WinchSession, plan: AnchorPlan) -> None:
        device, winch = session.device, session.winch
        self._device = device
        self._executive = session.executive
        self._setpoint = session.executive.setpoint
        self._period_s = device.period_s
        inertia = winch.motor.rotor_inertia_kg_m2
        self._damping_Nms_rad = inertia * _DAMPING_PHASE / session.latency_s
        self._stiffness_Nm_rad = inertia * (math.tau * _NATURAL_HZ) ** 2
        needed = plan.highest_N * abs(winch.cable_m_per_motor_rad)
        self._limit_Nm = min(_LIMIT_RATIO * needed + _LIMIT_MORE_Nm, winch.motor.rated_torque_Nm)
        self._speed_rad_s = 0.0
        self._last_rad = self._wanted_rad = float(device.feedback.position_rad[0])
        self._start_rad = self._last_rad
        self.wanted_rad_s = 0.0

    @property
    def travel_rad(self) -> float:
        """How far the set-point has gone."""
        return abs(self._wanted_rad - self._start_rad)

    def cycle(self) -> float:
        """Write this cycle's torque and return it."""
        feedback, command = self._device.feedback, self._device.command
        position, period = float(feedback.position_rad[0]), self._period_s
        share = period / (period + _SPEED_FILTER_S)
        self._speed_rad_s += share * ((position - self._last_rad) / period - self._speed_rad_s)
        self._last_rad = position
        self._wanted_rad += self.wanted_rad_s * period
        torque = self._stiffness_Nm_rad * (self._wanted_rad - position)
        torque += self._damping_Nms_rad * (self.wanted_rad_s - self._speed_rad_s)
        command.torque_Nm[0] = min(self._limit_Nm, max(-self._limit_Nm, torque))
        supervisor = self._executive.supervisor
        estimator = self._executive.estimator
        estimator.update(feedback)
        supervisor.check(feedback, estimator.estimate, self._setpoint, command.torque_Nm)
        if supervisor.reaction > Reaction.CLAMP:
            raise TripError(f"{supervisor.reason()}; is the cable made fast?")
        return float(command.torque_Nm[0])


class _Recording:
    """Pulls until a tension is reached, writing a row for each reading of the load cell."""

    def __init__(self, session: WinchSession, plan: AnchorPlan, sampler: TensionSampler) -> None:
        self._session = session
        self._plan = plan
        self._exchange = sampler.exchange
        self._wind_in = -session.winch.cable_sign
        self._puller = _Puller(session, plan)
        self._sums = np.zeros(3)
        self._row = np.zeros((1, len(COLUMNS)))
        self._read_s = -math.inf

    def pull(self, winding_in: bool, log: RawLogWriter) -> None:
        """Wind in to the highest tension, or pay out to the lowest."""
        side = self._wind_in if winding_in else -self._wind_in
        self._puller.wanted_rad_s = side * self._plan.speed_rad_s
        what = "the highest tension" if winding_in else "the lowest tension"
        self._session.executive.step(lambda: self._cycle(winding_in, log), _LONGEST_S, what)

    def _cycle(self, winding_in: bool, log: RawLogWriter) -> bool:
        torque = self._puller.cycle()
        feedback, told = self._session.device.feedback, self._exchange.feedback
        self._sums += (1.0, torque, feedback.position_rad[0])
        self._exchange.update()
        if not told.valid[0]:
            raise TripError(self._exchange.reason())
        if told.time_s[0] == self._read_s:
            return False
        self._read_s = float(told.time_s[0])
        tension = float(told.tension_N[0])
        if tension > _TOO_MUCH * self._plan.highest_N:
            raise TripError(f"{self._exchange.cables[0]}: {tension:.1f} N")
        _, mean_Nm, mean_rad = self._sums / self._sums[0]
        self._sums[:] = 0.0
        if tension >= self._plan.lowest_N:
            self._row[0] = (feedback.time_s, winding_in, mean_Nm, mean_rad, tension, self._read_s)
            log.write(self._row)
        if winding_in and self._puller.travel_rad > self._plan.most_travel_rad:
            raise TripError(
                f"wound in by {1e3 * self._travel_m():.0f} mm and the tension is {tension:.1f} N; "
                "is the cable made fast? (--travel-mm)"
            )
        plan = self._plan
        return tension >= plan.highest_N if winding_in else tension <= plan.lowest_N

    def _travel_m(self) -> float:
        return self._puller.travel_rad * abs(self._session.winch.cable_m_per_motor_rad)


def measure_anchored(
    session: WinchSession,
    out: Output,
    path: Path,
    plan: AnchorPlan,
    sampler: TensionSampler,
) -> Path:
    """Wind in to the highest tension and pay out again, recording readings into `path`.

    The sampler reads the one load cell of this cable. Raises TripError when it does not answer,
    the cable gives way or the rotor runs away; the torque is zero afterwards.
    """
    winch, device = session.winch, session.device
    meta: dict[str, Any] = {
        "what": "anchored",
        "identity": session.identity,
        "wind_in": -winch.cable_sign,
        "pole_pairs": winch.motor.poles // 2,
        "cable": sampler.exchange.cables[0],
        "speed_rad_s": plan.speed_rad_s,
    }
    session.restrict(_FASTEST_RAD_S, math.inf)
    session.enable()
    log = RawLogWriter(path, COLUMNS, meta)
    try:
        recording = _Recording(session, plan, sampler)
        out.note(f"winding in to {plan.highest_N:g} N and paying out to {plan.lowest_N:g} N")
        recording.pull(True, log)
        recording.pull(False, log)
    finally:
        try:
            device.command.torque_Nm[:] = 0.0
            device.transmit()
        finally:  # a bus that is gone takes no zero torque, yet the rows are to be kept
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
