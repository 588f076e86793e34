"""Passes of one winch's motor: slow sweeps, turns at speed, ramps with or without compensation."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_rt.control.base import Controller
from cdpr_rt.control.compensation import AxisCompensation, Compensation
from cdpr_rt.control.pid import Pid
from cdpr_rt.control.proportional import Proportional
from cdpr_rt.control.tuning import PidDesign
from cdpr_rt.procedures.commissioning.commission_files import Paths
from cdpr_rt.procedures.measurement import Pass, both_ways, run_pass
from cdpr_rt.procedures.winch_operator import Notifier, WinchOperator

# the rotor trails the set-point by friction over gain; both directions' trail fits in here
SWEEP_LEAD_IN_RAD = math.radians(30.0)
VALIDATION_SPEED_RAD_S = math.radians(22.0)
# speed, angle at that speed and ramp: quick turns for inertia and viscous friction, a slow rise
# through all speeds for the friction curve, a creep for its low end
_FAST_LEGS = (
    (math.radians(300.0), 3.0 * math.tau, 0.1),
    (math.radians(600.0), 3.0 * math.tau, 0.1),
    (math.radians(90.0), 0.0, 4.0),
    (math.radians(12.0), 0.25 * math.tau, 0.3),
)
_TORQUE_SHARE = 0.25
_SPOKEN = {
    "sweep": "slow sweeps",
    "fast": "turns at other speeds",
    "index": "a turn to see the index",
}
_METHODS = {
    "none": "no compensation",
    "thesis": "thesis' method",
    "better": "harmonic model",
}


class Measurement:
    """Runs passes of one winch and records them; `planned_s` is how long all take, about."""

    def __init__(
        self, session: WinchOperator, out: Notifier, paths: Paths, planned_s: float = math.inf
    ) -> None:
        self._planned_s, self._done_s = planned_s, 0.0
        self._session = session
        self._out = out
        self._paths = paths
        # an unloaded rotor needs little: enough for any cogging, too little to do harm
        rated = session.winch.motor.rated_torque_Nm
        self._limit_Nm = np.full(session.device.n, _TORQUE_SHARE * rated)

    def sweep(self, gain_Nm_rad: float, speed_rad_s: float, turns: int) -> list[Path]:
        """Sweep both directions slowly under the proportional controller (Tremblay, 1.3, 1.4)."""
        controller = Proportional(np.full(self._session.device.n, gain_Nm_rad), self._limit_Nm)
        passes = both_ways(speed_rad_s, SWEEP_LEAD_IN_RAD, turns)
        return self._run("sweep", controller, passes, {"gain_Nm_rad": gain_Nm_rad})

    def fast_legs(self, design: PidDesign) -> list[Path]:
        """Turn back and forth at other speeds, which tells inertia and the friction curve."""
        return self.track("fast", design, None, fast_passes())

    def track(
        self,
        name: str,
        design: PidDesign,
        compensation: AxisCompensation | None,
        passes: Sequence[Pass],
        meta: dict[str, Any] | None = None,
    ) -> list[Path]:
        """Follow ramps under the PID, with or without compensation (Tremblay, 1.5)."""
        device = self._session.device
        known = Compensation([compensation], device.period_s) if compensation else None
        controller = Pid([design.gains], self._limit_Nm, device.period_s, known)
        gains = {"gains": dataclasses.asdict(design.gains), "bandwidth_Hz": design.bandwidth_Hz}
        return self._run(name, controller, passes, gains | (meta or {}))

    def _run(
        self, name: str, controller: Controller, passes: Sequence[Pass], meta: dict[str, Any]
    ) -> list[Path]:
        session = self._session
        meta = {**meta, "what": name, "identity": session.identity}
        meta["sync_offset"] = session.sync_offset()
        meta["latency_s"] = session.winch.latency_s
        total = sum(one.duration_s() for one in passes)
        recorded = []
        label = spoken_name(name)
        begin_s, self._done_s = self._done_s, self._done_s + total
        if math.isfinite(self._planned_s):
            begin, end = (min(s / self._planned_s, 1.0) for s in (begin_s, self._done_s))
            label += f" ({100.0 * begin:.0f} to {100.0 * end:.0f} % of all)"
        with self._out.progress(label, total) as advance:
            done = 0.0
            for number, one in enumerate(passes):
                path = self._paths.raw(f"{name}-{number}")
                so_far = partial(_further, advance, done)
                recorded.append(run_pass(session, controller, one, path, meta, so_far))
                done += one.duration_s()
        return recorded


def fast_passes() -> list[Pass]:
    """Return the turns back and forth at other speeds."""
    return [
        Pass(sign * speed, 0.0, distance, ramp, with_ramps=True)
        for speed, distance, ramp in _FAST_LEGS
        for sign in (1.0, -1.0)
    ]


def spoken_name(name: str) -> str:
    """Return what a recording's name means."""
    if name in _SPOKEN:
        return _SPOKEN[name]
    if name.startswith("round"):
        return f"refining, round {int(name.removeprefix('round')) + 1}"
    _, bandwidth, method = name.split("-", 2)
    return f"validating at {bandwidth.removesuffix('Hz')} Hz, {_METHODS[method]}"


def _further(advance: Callable[[float], None], done_s: float, time_s: float) -> None:
    advance(done_s + time_s)
