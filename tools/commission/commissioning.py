"""Commission one winch's motor: index, sweeps, second pass, validation."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cdpr_profiles.motor_bounds import MotorBounds
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.control.compensation import AxisCompensation, Compensation
from cdpr_rt.control.pid import Pid, Proportional
from cdpr_rt.control.tuning import PidDesign, TuningError, design_pid, stiffest_pid, sweep_gain
from cdpr_rt.errors import TripError
from cdpr_rt.identification.cogging_profile import CoggingProfile, stored_harmonic_model
from cdpr_rt.identification.commissioning_results import (
    METHODS,
    Identified,
    Paths,
    identify_first,
    legs,
    round_name,
    store_profile,
    validation_name,
)
from cdpr_rt.identification.harmonic_model import MOST_ROUNDS, SecondPass
from cdpr_rt.identification.rawlog import RawLogWriter, column_names
from cdpr_rt.loop.operating import Notifier, Operator
from cdpr_rt.motion.trajectory import TrapezoidalMove
from cdpr_tools.composition.session import Session

Index = Literal["homing", "probe"]
"""How to find the encoder index: by homing, or by the touch probe during a normal motion."""

# the rotor lags the set-point by friction over gain; the lag in both directions fits in here
SWEEP_LEAD_IN_RAD = math.radians(30.0)


@dataclasses.dataclass(frozen=True)
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
    return there, dataclasses.replace(there, speed_rad_s=-speed_rad_s)


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


# Passes of one winch's motor: slow sweeps, fast turns, ramps with or without compensation.

VALIDATION_SPEED_RAD_S = math.radians(22.0)
# speed, angle at that speed and ramp duration: fast turns for inertia and viscous friction, a slow
# ramp through all speeds for the friction curve, a creep for its low end
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
    "index": "a turn to find the index",
}
NAMES = {"none": "no compensation", "thesis": "thesis' method", "harmonic": "harmonic model"}


class Measurement:
    """Runs passes of one winch and records them; `planned_s` is their approximate total time."""

    def __init__(
        self, session: Session, out: Notifier, paths: Paths, planned_s: float = math.inf
    ) -> None:
        self._planned_s, self._done_s = planned_s, 0.0
        self._session = session
        self._out = out
        self._paths = paths
        # an unloaded rotor needs little torque: enough for any cogging, too little to do harm
        rated = session.winch.motor.rated_torque_Nm
        self._limit_Nm = np.full(session.device.n, _TORQUE_SHARE * rated)

    def sweep(self, gain_Nm_rad: float, speed_rad_s: float, turns: int) -> list[Path]:
        """Sweep slowly both ways under the proportional controller (Tremblay, 1.3, 1.4)."""
        controller = Proportional(np.full(self._session.device.n, gain_Nm_rad), self._limit_Nm)
        passes = both_ways(speed_rad_s, SWEEP_LEAD_IN_RAD, turns)
        return self._run("sweep", controller, passes, {"gain_Nm_rad": gain_Nm_rad})

    def fast_legs(self, design: PidDesign) -> list[Path]:
        """Turn back and forth at other speeds, to identify inertia and the friction curve."""
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
        meta["sync_offset"] = session.machine.sync_offset
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
    """Return a recording's name as text for people."""
    if name in _SPOKEN:
        return _SPOKEN[name]
    if name.startswith("round"):
        return f"refining, round {int(name.removeprefix('round')) + 1}"
    _, bandwidth, method = name.split("-", 2)
    return f"validating at {bandwidth.removesuffix('Hz')} Hz, {NAMES[method]}"


def _further(advance: Callable[[float], None], done_s: float, time_s: float) -> None:
    advance(done_s + time_s)


DEFAULT_BANDWIDTH_HZ = 12.0

_LEAD_IN_RAD = math.tau
_SWEEP_ATTEMPTS = 4
_SETTLE_S = 2.0
_STIFF_HZ = (30.0, 25.0, 20.0, 15.0, DEFAULT_BANDWIDTH_HZ)
# more than one turn, because the rotor first lags until it breaks away
_PROBE_TURNS = 1.2

_SHORT_LEAD_IN_RAD = math.pi


@dataclasses.dataclass(frozen=True)
class Plan:
    """Extent of a commissioning's measurements."""

    sweep_speed_rad_s: float = math.radians(3.0)
    turns: int = 2
    """Turns of each sweep, in each direction."""
    rounds: int = MOST_ROUNDS
    """Largest number of rounds of the second pass."""
    both_ways: bool = True
    """Whether validation ramps at the default bandwidth go both ways."""
    bandwidths_Hz: tuple[float, ...] = (3.0, 5.0, 8.0, 15.0, 25.0)
    """Bandwidths at which the methods are compared in addition to the default."""


THOROUGH = Plan()
"""The thesis' procedure (Tremblay, sections 1.4 and 1.5) and the comparison over bandwidths."""
QUICK = Plan(math.radians(30.0), turns=1, rounds=2, both_ways=False, bandwidths_Hz=())
"""A quick check of a motor within two minutes; the sweep is too fast for precise figures."""


def _refine(second: SecondPass, recorded: list[Path]) -> None:
    second.add(legs(recorded))


def planned_s(plan: Plan) -> float:
    """Return the approximate bus time for which a plan turns the motor."""
    ramp = ramps(both=False)[0].duration_s()
    refining = both_ways(VALIDATION_SPEED_RAD_S, _SHORT_LEAD_IN_RAD, 1)
    others = len([b for b in plan.bandwidths_Hz if b != DEFAULT_BANDWIDTH_HZ])
    passes = [
        *both_ways(plan.sweep_speed_rad_s, SWEEP_LEAD_IN_RAD, plan.turns),
        *fast_passes(),
        *plan.rounds * refining,
        *len(METHODS) * ramps(plan.both_ways),
    ]
    return sum(one.duration_s() for one in passes) + len(METHODS) * others * ramp


def ramps(both: bool) -> tuple[Pass, ...]:
    """Return the passes of one validation."""
    if both:
        return both_ways(VALIDATION_SPEED_RAD_S, _LEAD_IN_RAD, 1)
    return (Pass(VALIDATION_SPEED_RAD_S, _SHORT_LEAD_IN_RAD, math.tau),)


class Commissioning:
    """Runs the steps on an open session; each writes its files to `paths`."""

    def __init__(
        self, session: Session, out: Notifier, paths: Paths, plan: Plan = THOROUGH
    ) -> None:
        self._session = session
        self._plan = plan
        self._out = out
        self._paths = paths
        self._measure = Measurement(session, out, paths, planned_s(plan))
        self._bounds = MotorBounds(session.winch.motor)

    def run(self, bandwidth_Hz: float, index: Index = "homing") -> dict[str, Any]:
        """Run all steps on the bus; return the results for the report."""
        self._out.note(
            f"turns the motor for about {planned_s(self._plan) / 60.0:.0f} min of bus time"
        )
        session, winch = self._session, self._session.winch
        started = time.monotonic()
        self.prepare(index)
        self.measure()
        # this is slow, and the safety I/O is monitored meanwhile
        found = session.run_blocking(partial(identify_first, winch, winch.latency_s, self._paths))
        found = self.measure_again(found, bandwidth_Hz)
        identity = session.drive_identity
        store_profile(winch, identity, found, self._paths)
        wanted, designs = self.validate(CoggingProfile.load(self._paths.profile), bandwidth_Hz)
        device, boot = session.device, session.boot
        return {
            "winch": winch.reference,
            "motor": winch.motor.model,
            "drive": {
                "name": boot.device_name,
                **identity.model_dump(),
                "changed": boot.changed,
                "absent": boot.absent,
            },
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
            "encoder_counts_per_turn": boot.counts_per_turn,
            "rated_torque_Nm": boot.rated_torque_Nm,
            "torque_step_Nm": session.torque_step_Nm,
            "inertia_kg_m2": found.harmonic.inertia_kg_m2.value,
            "pid": [dataclasses.asdict(design) for design in designs],
            "bandwidth_Hz": bandwidth_Hz,
            "bandwidths_Hz": wanted,
            "latency_s": winch.latency_s,
            "bus": {
                **session.bus_record(),
                "period_s": device.period_s,
                "lockstep": device.lockstep,
                "cycles": device.feedback.cycle,
                "late": session.lateness.late,
                "wall_s": time.monotonic() - started,
            },
        }

    def prepare(self, index: Index = "homing") -> None:
        """Find the index, by homing or by the touch probe during a turn under the PID.

        The drive has no power afterwards. Raises TripError if no index was seen.
        """
        session = self._session
        if index == "homing":
            session.find_index()
            return
        session.expect_index()
        session.enable()
        turn = Pass(VALIDATION_SPEED_RAD_S, 0.0, _PROBE_TURNS * math.tau)
        design = self._design(session.winch.motor.rotor_inertia_kg_m2, DEFAULT_BANDWIDTH_HZ)
        self._measure.track("index", design, None, [turn])
        session.disable()
        if not session.device.feedback.index_known.all():
            raise TripError(f"no encoder index was found in {_PROBE_TURNS:g} turns")

    def measure(self) -> None:
        """Record the sweeps and the fast legs."""
        session, plan = self._session, self._plan
        inertia, latency_s = session.winch.motor.rotor_inertia_kg_m2, session.winch.latency_s
        self._out.note(f"sweeping at {math.degrees(plan.sweep_speed_rad_s):g} deg/s")
        session.enable()
        self._sweep(sweep_gain(inertia, latency_s))
        stiffest = stiffest_pid(inertia, latency_s, _STIFF_HZ, session.device.period_s)
        self._measure.fast_legs(stiffest)
        session.disable()

    def _sweep(self, gain_Nm_rad: float) -> None:
        """Sweep both ways; if the rotor runs away, repeat with lower gain.

        The latency feeds energy into an oscillation in proportion to its squared amplitude, but
        friction removes it only in proportion to the amplitude. If the gain is too high, a large
        enough snap therefore makes the rotor run away.
        """
        plan = self._plan
        for attempt in range(_SWEEP_ATTEMPTS):
            try:
                self._measure.sweep(gain_Nm_rad, plan.sweep_speed_rad_s, plan.turns)
            except TripError as error:
                last = attempt == _SWEEP_ATTEMPTS - 1
                if self._session.device.faults() or last or not self._session.is_simulated:
                    raise  # with a real motor a person decides whether it turns again
                gain_Nm_rad /= 2.0
                self._out.note(f"{error}; sweeping again with {gain_Nm_rad:.2g} Nm/rad")
                self._settle()
            else:
                return

    def _settle(self) -> None:
        """Let the rotor come to rest without power after an aborted motion."""
        self._session.reset()
        self._session.idle(_SETTLE_S)
        self._session.enable()

    def measure_again(self, found: Identified, bandwidth_Hz: float) -> Identified:
        """Record ramps with compensation, and refine it until the ramps no longer get smoother."""
        session = self._session
        second = session.run_blocking(
            lambda: SecondPass(found.harmonic, legs(self._paths.passes("fast")))
        )
        passes = both_ways(VALIDATION_SPEED_RAD_S, _SHORT_LEAD_IN_RAD, 1)
        for number in range(self._plan.rounds):
            if second.done:
                break
            self._out.note(f"second pass at 22 deg/s under compensation, round {number + 1}")
            session.enable()
            design = self._design(second.current.inertia_kg_m2.value, bandwidth_Hz)
            known = stored_harmonic_model(second.current).compensation(self._bounds)
            recorded = self._measure.track(round_name(number), design, known, passes)
            session.disable()
            session.run_blocking(partial(_refine, second, recorded))
        return dataclasses.replace(found, harmonic=second.best)

    def _design(self, inertia_kg_m2: float, bandwidth_Hz: float) -> PidDesign:
        winch, period_s = self._session.winch, self._session.device.period_s
        return design_pid(inertia_kg_m2, winch.latency_s, bandwidth_Hz, period_s)

    def validate(
        self, profile: CoggingProfile, bandwidth_Hz: float
    ) -> tuple[list[float], list[PidDesign]]:
        """Record the ramps of thesis 1.5 without and with each compensation.

        The ramps go both ways at the default bandwidth, one way at the others. Returns the
        bandwidths that were possible and the loops' designs.
        """
        session = self._session
        known: dict[str, AxisCompensation | None] = {
            method: profile.compensation(method, session.drive_identity, self._bounds)
            for method in ("thesis", "harmonic")
        }
        known["none"] = None
        self._out.note("validating on ramps of 22 deg/s")
        reached, designs = [], []
        others = [b for b in self._plan.bandwidths_Hz if b != bandwidth_Hz]
        for wanted in (bandwidth_Hz, *others):
            try:
                design = self._design(profile.inertia_kg_m2, wanted)
            except TuningError as error:
                if wanted == bandwidth_Hz:
                    raise
                self._out.note(str(error))
                continue
            session.enable()
            try:
                self._compare(
                    design, wanted, known, self._plan.both_ways and wanted == bandwidth_Hz
                )
            except TripError as error:
                if session.device.faults() or wanted == bandwidth_Hz:
                    raise
                self._out.note(f"{wanted:g} Hz is left out of the comparison: {error}")
                self._settle()
            else:
                reached.append(wanted)
                designs.append(design)
            session.disable()
        return reached, designs

    def _compare(
        self,
        design: PidDesign,
        wanted_Hz: float,
        known: Mapping[str, AxisCompensation | None],
        both_ways: bool,
    ) -> None:
        """Record the ramps of one bandwidth, method by method."""
        # The model that was just identified comes first, because it no longer fits once the motor
        # has warmed up.
        for method in ("harmonic", "none", "thesis"):
            name = validation_name(method, wanted_Hz)
            passes = ramps(both_ways)
            self._measure.track(name, design, known[method], passes, {"method": method})
