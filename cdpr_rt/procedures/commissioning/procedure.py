"""Commissioning of one winch's motor: index, sweeps, second pass, validation."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from cdpr_profiles.limits.motor_bounds import MotorBounds
from cdpr_rt.control.compensation import AxisCompensation
from cdpr_rt.control.tuning import PidDesign, TuningError, design_pid, stiffest_pid, sweep_gain
from cdpr_rt.errors import TripError
from cdpr_rt.identification.cogging.second_pass import MOST_ROUNDS, SecondPass
from cdpr_rt.identification.cogging_profile import CoggingProfile, stored_harmonic_model
from cdpr_rt.procedures.commissioning.commission_files import Paths
from cdpr_rt.procedures.commissioning.evaluation import METHODS
from cdpr_rt.procedures.commissioning.finding_index import Index
from cdpr_rt.procedures.commissioning.identified import (
    Identified,
    identify_first,
    legs,
    round_name,
    store_profile,
    validation_name,
)
from cdpr_rt.procedures.commissioning.winch_passes import (
    SWEEP_LEAD_IN_RAD,
    VALIDATION_SPEED_RAD_S,
    Measurement,
    fast_passes,
)
from cdpr_rt.procedures.measurement import Pass, both_ways
from cdpr_rt.procedures.winch_operator import Notifier, WinchOperator

DEFAULT_BANDWIDTH_HZ = 12.0

_LEAD_IN_RAD = math.tau
_SWEEP_ATTEMPTS = 4
_SETTLE_S = 2.0
_STIFF_HZ = (30.0, 25.0, 20.0, 15.0, DEFAULT_BANDWIDTH_HZ)
# the set-point starts ahead of a rotor that has to break away first
_PROBE_TURNS = 1.2

_SHORT_LEAD_IN_RAD = math.pi


@dataclasses.dataclass(frozen=True)
class Plan:
    """Extent of a commissioning's measurements."""

    sweep_speed_rad_s: float = math.radians(3.0)
    turns: int = 2
    """Turns of each sweep, in each direction."""
    rounds: int = MOST_ROUNDS
    """Rounds of the second pass at the most."""
    both_ways: bool = True
    """Whether validation ramps at the default bandwidth go both ways."""
    bandwidths_Hz: tuple[float, ...] = (3.0, 5.0, 8.0, 15.0, 25.0)
    """Bandwidths at which the methods are compared besides the default."""


THOROUGH = Plan()
"""The thesis' procedure (Tremblay, sections 1.4 and 1.5) and the comparison over bandwidths."""
QUICK = Plan(math.radians(30.0), turns=1, rounds=2, both_ways=False, bandwidths_Hz=())
"""A look at a motor within two minutes of its time; the sweep is too fast for fine figures."""


def _refine(second: SecondPass, recorded: list[Path]) -> None:
    second.add(legs(recorded))


def planned_s(plan: Plan) -> float:
    """Return about how long the motor turns by a plan, bus time."""
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
    """Runs the steps on an open session; each leaves its files in `paths`."""

    def __init__(
        self, session: WinchOperator, out: Notifier, paths: Paths, plan: Plan = THOROUGH
    ) -> None:
        self._session = session
        self._plan = plan
        self._out = out
        self._paths = paths
        self._measure = Measurement(session, out, paths, planned_s(plan))
        self._bounds = MotorBounds(session.winch.motor)

    def run(self, bandwidth_Hz: float, index: Index = "homing") -> dict[str, Any]:
        """Do everything on the bus; return what the report has to know of it."""
        self._out.note(
            f"turns the motor for about {planned_s(self._plan) / 60.0:.0f} min of bus time"
        )
        session, winch = self._session, self._session.winch
        started = time.monotonic()
        self.prepare(index)
        self.measure()
        # it takes its time, and a safety I/O is asked meanwhile
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
        """Find the index; the drive has no power afterwards.

        By homing, or by the touch probe during a turn under the PID. Raises TripError when no
        index was seen.
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
            raise TripError(f"no encoder index was seen in {_PROBE_TURNS:g} turns")

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
        """Sweep both ways; where friction cannot hold the rotor, with less and less gain.

        The loop's latency feeds an oscillation with the square of its amplitude, friction damps
        it with the first power: a rotor that snaps far enough runs away under too high a gain.
        """
        plan = self._plan
        for attempt in range(_SWEEP_ATTEMPTS):
            try:
                self._measure.sweep(gain_Nm_rad, plan.sweep_speed_rad_s, plan.turns)
            except TripError as error:
                last = attempt == _SWEEP_ATTEMPTS - 1
                if self._session.device.alarm() or last or not self._session.is_simulated:
                    raise  # beside a real motor a person decides whether it turns again
                gain_Nm_rad /= 2.0
                self._out.note(f"{error}; sweeping again with {gain_Nm_rad:.2g} Nm/rad")
                self._settle()
            else:
                return

    def _settle(self) -> None:
        """Let the rotor come to rest without power after a motion was given up."""
        self._session.reset()
        self._session.idle(_SETTLE_S)
        self._session.enable()

    def measure_again(self, found: Identified, bandwidth_Hz: float) -> Identified:
        """Record ramps under compensation and refine, until they do not get smoother."""
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

        Both ways at the default bandwidth, one way at the others. Returns the bandwidths that
        could be had and the loops' designs.
        """
        session = self._session
        known: dict[str, AxisCompensation | None] = {
            method: profile.compensation(method, session.drive_identity, self._bounds)
            for method in ("thesis", "better")
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
                if session.device.alarm() or wanted == bandwidth_Hz:
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
        # what was just learnt comes first: a motor that warms up is soon another one
        for method in ("better", "none", "thesis"):
            name = validation_name(method, wanted_Hz)
            passes = ramps(both_ways)
            self._measure.track(name, design, known[method], passes, {"method": method})
