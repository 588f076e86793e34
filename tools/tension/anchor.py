"""Calibrate a winch by load cells: its cable made fast, the torque raised and lowered in steps."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_rt.errors import RawLogError, TripError
from cdpr_rt.rawlog import RawLogWriter, read_raw_log
from cdpr_rt.tension_gain import CalibrationRefusedError, TorquePoint
from drivers.modbus.tension import TensionSampler
from profiles import Winch
from tools.errors import BadInputError
from tools.output import Output
from tools.session import WinchSession

COLUMNS = ["time_s", "step", "winding_in", "torque_sent_Nm", "position_rad", "tension_N", "read_s"]
_TORQUE_SHARE = 0.9
_SLOPE_Nm_s = 1.0
# phase the latency may take where the damping crosses over on the rotor alone
_DAMPING_PHASE = 0.5
_SPEED_FILTER_S = 0.005
_FASTEST_RAD_S = 60.0
_LOOK_EVERY = 10
_PATIENCE_S = 10.0
_LONGEST_S = 3600.0


@dataclass(frozen=True)
class AnchorPlan:
    """The tensions to step through, up and down again, and how long to look at each."""

    lowest_N: float
    highest_N: float
    steps: int = 16
    settle_s: float = 0.3
    """Wall time from the end of a torque's change until readings count: the amplifier's filter."""
    readings: int = 3

    def levels(self) -> Iterator[tuple[float, bool]]:
        """Yield (tension, winding in), the highest once each way."""
        up = np.linspace(self.lowest_N, self.highest_N, self.steps)
        yield from ((float(level), True) for level in up)
        yield from ((float(level), False) for level in up[-2::-1])


def check_plan(winch: Winch, plan: AnchorPlan) -> None:
    """Raise BadInputError for tensions the motor cannot give."""
    most = _TORQUE_SHARE * winch.motor.rated_torque_Nm / abs(winch.cable_m_per_motor_rad)
    if not 0.0 < plan.lowest_N < plan.highest_N <= most:
        raise BadInputError(
            f"--lowest-n {plan.lowest_N:g}, --highest-n {plan.highest_N:g}; allowed: rising and up "
            f"to {most:.0f} N, which takes {100 * _TORQUE_SHARE:g} % of the motor's rated torque"
        )


class _Torque:
    """Leads the torque to a level and holds it there, damping the rotor, for `Executive.step`."""

    def __init__(self, session: WinchSession) -> None:
        device, winch = session.device, session.winch
        self._device = device
        self._supervisor = session.executive.supervisor
        self._period_s = device.period_s
        self._setpoint = session.executive.setpoint
        inertia = winch.motor.rotor_inertia_kg_m2
        self._damping_Nms_rad = inertia * _DAMPING_PHASE / session.latency_s
        self._wind_in = -winch.cable_sign
        self._speed_rad_s = 0.0
        self._last_rad = float(device.feedback.position_rad[0])
        self.wanted_Nm = self.now_Nm = 0.0

    def cycle(self) -> bool:
        """Write the torque of this cycle; return whether the wanted level is reached."""
        feedback, command = self._device.feedback, self._device.command
        position = float(feedback.position_rad[0])
        share = self._period_s / (self._period_s + _SPEED_FILTER_S)
        self._speed_rad_s += share * (
            (position - self._last_rad) / self._period_s - self._speed_rad_s
        )
        self._last_rad = position
        step = _SLOPE_Nm_s * self._period_s
        self.now_Nm += min(step, max(-step, self.wanted_Nm - self.now_Nm))
        command.torque_Nm[0] = (
            self._wind_in * self.now_Nm - self._damping_Nms_rad * self._speed_rad_s
        )
        reason = self._supervisor.check(feedback, self._setpoint, command.torque_Nm)
        if reason:
            raise TripError(f"{reason}; is the cable made fast?")
        return self.now_Nm == self.wanted_Nm


def measure_anchored(
    session: WinchSession,
    out: Output,
    path: Path,
    plan: AnchorPlan,
    sampler: TensionSampler,
    cable: int,
) -> Path:
    """Step through the plan's tensions with the cable made fast, recording readings into `path`.

    `cable` is the load cell's place among the sampler's. Raises TripError when it does not answer
    or the rotor runs away; the torque is zero afterwards.
    """
    winch, device = session.winch, session.device
    meta: dict[str, Any] = {
        "what": "anchored",
        "identity": session.identity,
        "wind_in": -winch.cable_sign,
        "pole_pairs": winch.motor.poles // 2,
        "cable": sampler.exchange.cables[cable],
    }
    session.restrict(_FASTEST_RAD_S, 1e3 * math.tau)
    session.enable()
    log = RawLogWriter(path, COLUMNS, meta)
    levels = list(plan.levels())
    gain = abs(winch.cable_m_per_motor_rad)
    try:
        torque = _Torque(session)
        with out.progress("torque steps", float(len(levels))) as advance:
            for number, (level, winding_in) in enumerate(levels):
                torque.wanted_Nm = gain * level
                session.executive.step(torque.cycle, _LONGEST_S, "the torque's level")
                _Dwell(session, torque, plan, sampler, cable, log).run(number, winding_in)
                advance(float(number + 1))
            torque.wanted_Nm = 0.0
            session.executive.step(torque.cycle, _LONGEST_S, "the torque's end")
    finally:
        device.command.torque_Nm[:] = 0.0
        device.transmit()
        log.close()
    session.disable()
    return path


class _Dwell:
    """One level held until enough readings have come that were taken while it was."""

    def __init__(
        self,
        session: WinchSession,
        torque: _Torque,
        plan: AnchorPlan,
        sampler: TensionSampler,
        cable: int,
        log: RawLogWriter,
    ) -> None:
        self._executive = session.executive
        self._device = session.device
        self._torque = torque
        self._plan = plan
        self._exchange = sampler.exchange
        self._cable = cable
        self._log = log

    def run(self, number: int, winding_in: bool) -> None:
        """Write the readings; the torque of a row is the mean since the row before."""
        begun = time.monotonic()
        last_read = begun + self._plan.settle_s
        kept, cycles = 0, itertools.count(1)
        sums = np.zeros(3)
        row = np.zeros((1, len(COLUMNS)))
        i = self._cable
        feedback, told = self._device.feedback, self._exchange.feedback

        def cycle() -> bool:
            nonlocal last_read, kept
            self._torque.cycle()
            if time.monotonic() > last_read:
                sums[:] += (1.0, self._device.command.torque_Nm[0], feedback.position_rad[0])
            if next(cycles) % _LOOK_EVERY:
                return False
            self._exchange.update()
            if not told.valid[i]:
                raise TripError(self._exchange.reason())
            if sums[0] and told.time_s[i] > last_read:
                _, torque, position = sums / sums[0]
                tension = told.tension_N[i]
                row[0] = (feedback.time_s, number, winding_in, torque, position, tension,
                          told.time_s[i])  # fmt: skip
                self._log.write(row)
                last_read = float(told.time_s[i])
                kept += 1
                sums[:] = 0.0
            elif time.monotonic() > last_read + _PATIENCE_S:
                raise TripError(f"no reading of the load cell for {_PATIENCE_S:g} s")
            return kept == self._plan.readings

        self._executive.step(cycle, _LONGEST_S, "the readings")


def anchored_points(path: Path) -> tuple[list[TorquePoint], int]:
    """Return the points of a recording, one for each step, and the motor's pole pairs.

    Raises RawLogError for a recording of something else, CalibrationRefusedError where the cable
    was never taut.
    """
    log = read_raw_log(path)
    try:
        wind_in, order = int(log.header["wind_in"]), int(log.header["pole_pairs"])
    except (KeyError, TypeError, ValueError) as error:
        raise RawLogError(f"{path}: not a recording of torque steps ({error})") from None
    step = log.column("step")
    points = []
    for number in np.unique(step):
        rows = step == number
        tension, torque, angle, side = (
            float(log.column(name)[rows].mean())
            for name in ("tension_N", "torque_sent_Nm", "position_rad", "winding_in")
        )
        points.append(TorquePoint(tension, wind_in * torque, side > 0.0, angle))
    if max(point.tension_N for point in points) <= 0.0:
        raise CalibrationRefusedError(f"{path}: the load cell saw no tension; is the cable slack?")
    return points, order
