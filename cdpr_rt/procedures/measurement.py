"""Runs that measure a motor: their commanded motion, and the part of the recording to evaluate."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.errors import RawLogError
from cdpr_rt.identification.rawlog import RawLog, RawLogWriter, column_names
from cdpr_rt.identification.windows import SweepData
from cdpr_rt.loop.operating import Operator
from cdpr_rt.motion.trajectory import TrapezoidalMove

Index = Literal["homing", "probe"]
"""How to find the encoder index: by homing, or by the touch probe during a normal motion."""

# the rotor lags the set-point by friction over gain; the lag in both directions fits in here
SWEEP_LEAD_IN_RAD = math.radians(30.0)


@dataclass(frozen=True)
class Pass:
    """One pass at constant speed: motor angle to cover after a lead-in, in one direction."""

    speed_rad_s: float
    """Speed of the pass, signed."""
    lead_in_rad: float
    """Angle that is covered first and not evaluated, so that friction and controller have
    settled."""
    distance_rad: float
    ramp_s: float = 0.5
    """Time to reach the speed, and to stop."""
    with_ramps: bool = False
    """Whether to evaluate the ramps too, which is required for the inertia."""

    def move(self, start_rad: FloatArray) -> TrapezoidalMove:
        """Return the set-point of n axes that start at `start_rad` (n,)."""
        cruise = (self.lead_in_rad + self.distance_rad) / abs(self.speed_rad_s)
        speed = np.full(np.shape(start_rad), self.speed_rad_s)
        return TrapezoidalMove(start_rad, speed, cruise, self.ramp_s)

    def duration_s(self) -> float:
        """Return the duration of the pass."""
        return (self.lead_in_rad + self.distance_rad) / abs(self.speed_rad_s) + 2.0 * self.ramp_s

    def measured(self) -> tuple[float, float]:
        """Return the times, in s from the start, between which the pass is evaluated."""
        if self.with_ramps:
            return 0.0, self.duration_s()
        begin = self.ramp_s + self.lead_in_rad / abs(self.speed_rad_s)
        return begin, begin + self.distance_rad / abs(self.speed_rad_s)


def both_ways(speed_rad_s: float, lead_in_rad: float, turns: float) -> tuple[Pass, Pass]:
    """Return a pass forward and one backward over whole turns."""
    there = Pass(speed_rad_s, lead_in_rad, turns * math.tau)
    return there, replace(there, speed_rad_s=-speed_rad_s)


def run_pass(
    operator: Operator,
    controller: Controller,
    what: Pass,
    path: Path,
    meta: dict[str, Any],
    on_progress: Callable[[float], None] | None = None,
) -> Path:
    """Run `controller` along one pass from the present position, recording into `path`.

    Raises the errors of `Operator.follow`; the file is always closed and kept.
    """
    device = operator.device
    begin, end = what.measured()
    meta = {
        **meta,
        "axes": device.n,
        "period_s": device.period_s,
        "speed_rad_s": what.speed_rad_s,
        "measured_from_s": begin,
        "measured_until_s": end,
        "first_cycle": device.feedback.cycle + 1,
    }
    log = RawLogWriter(path, column_names(device.n), meta)
    try:
        move = what.move(device.feedback.position_rad)
        operator.follow(controller, move, log, on_progress)
    finally:
        log.close()
    return path


@dataclass(frozen=True)
class Recording:
    """One recorded pass of one axis, angles from the index; arrays are (samples,)."""

    sweep: SweepData
    effort_Nm: FloatArray
    cycle: FloatArray
    judged: BoolArray
    """Samples to evaluate: at full speed after the lead-in."""
    period_s: float
    complete: bool
    """Whether the pass is complete; False if the recording ends before the pass."""


def recording(log: RawLog) -> Recording:
    """Return the recording of a pass from a raw log, with angles from the encoder index.

    Raises RawLogError if the log is of another kind, ends before the part to evaluate, or does not
    contain the index.
    """
    try:
        period = float(log.header["period_s"])
        begin, end = float(log.header["measured_from_s"]), float(log.header["measured_until_s"])
        first_cycle = int(log.header["first_cycle"])
    except (KeyError, TypeError, ValueError) as error:
        raise RawLogError(f"{log.path}: not the recording of a pass ({error})") from error
    answered = log.column("valid") != 0.0
    since_start = (log.column("cycle") - first_cycle) * period
    judged = ((since_start >= begin) & (since_start < end))[answered]
    if not judged.any():
        raise RawLogError(
            f"{log.path}: ends after {since_start[-1]:.1f} s; the part to be measured begins at "
            f"{begin:.1f} s"
        )
    if not log.column("index_known")[answered].all():
        raise RawLogError(f"{log.path}: the encoder index is not known in this recording")
    index = log.column("index_rad")[answered]
    sweep = SweepData(
        time_s=log.column("time_s")[answered],
        angle_rad=log.column("position_rad")[answered] - index,
        torque_Nm=log.column("torque_sent_Nm")[answered],
        setpoint_rad=log.column("setpoint_rad")[answered] - index,
        setpoint_velocity_rad_s=log.column("setpoint_velocity_rad_s")[answered],
    )
    if not all(np.isfinite(getattr(sweep, field.name)).all() for field in fields(sweep)):
        raise RawLogError(f"{log.path}: contains numbers that are not finite")
    return Recording(
        sweep=sweep,
        effort_Nm=log.column("effort_Nm")[answered],
        cycle=log.column("cycle")[answered],
        judged=judged,
        period_s=period,
        complete=bool(since_start[-1] >= end - 2 * period),
    )
