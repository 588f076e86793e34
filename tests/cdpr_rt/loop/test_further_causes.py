"""Further faults while a robot reacts to its first fault."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.fault import BUS_OFF, Fault
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.core.supervisor import Supervisor
from cdpr_rt.loop.engine import Lifecycle
from cdpr_rt.loop.safe_stop import SafeStop
from cdpr_rt.model.last_lengths import LastLengths
from tests.cdpr_rt.core.supervisor_rig import PERIOD_S, SAFE, Cycle

DRIVE = Fault(Limit.DRIVE, 0, "7305h", "node 1")
SWITCH = Fault(Limit.SAFETY_STOP, 1, "limit_switch", "chain", detail="the limit switch opened")


def reacting(
    *explained: Fault, last: LastLengths | None = None
) -> tuple[SafeStop, Supervisor, Cycle, Lifecycle]:
    """Return a safe stop of two axes and its parts; its machine explains it by `explained`."""
    cycle, supervisor = Cycle(), Supervisor(SAFE, 2, PERIOD_S)
    parts = SimpleNamespace(
        supervisor=supervisor,
        estimator=SimpleNamespace(estimate=cycle.estimate),
        lowering=None,
        last_stop=last,
    )
    engine = SimpleNamespace(
        machine=SimpleNamespace(explain=lambda: explained),
        life=Lifecycle(("left", "right")),
        parts=parts,
        program_fault=None,
        lost_bus=None,
    )
    runner = SimpleNamespace(run_task=lambda work: iter((work(),)))
    safe_stop = SafeStop(engine, runner)  # type: ignore[arg-type]
    return safe_stop, supervisor, cycle, engine.life


def test_faults_reported_in_one_cycle_keep_their_codes_and_texts() -> None:
    safe_stop, supervisor, cycle, life = reacting(DRIVE, SWITCH)
    cycle.check(supervisor)
    supervisor.report(DRIVE)
    supervisor.report(SWITCH)
    assert list(supervisor.findings()) == [DRIVE, SWITCH]
    life.set_cause(DRIVE, supervisor.reaction)
    safe_stop.note_further((DRIVE,))
    list(safe_stop.explain())
    assert list(life.faults.values()) == [DRIVE, SWITCH]
    cycle.check(supervisor)
    assert not list(supervisor.findings())


def test_all_faults_of_no_single_axis_in_a_cycle_are_findings() -> None:
    alarm = Fault(Limit.SAFETY_ALARM, code="watchdog")
    lengths = Fault(Limit.LENGTHS, value=0.2, allowed=0.1)
    _, supervisor, cycle, _ = reacting()
    cycle.estimate.elapsed_s = 1.0
    cycle.check(supervisor)
    assert supervisor.limit is Limit.LATE
    for fault in (lengths, alarm, lengths, DRIVE):
        supervisor.report(fault)
    found = list(supervisor.findings())
    assert [fault.limit for fault in found[:1]] == [Limit.LATE]
    assert found[1:] == [lengths, alarm, DRIVE]
    cycle.estimate.elapsed_s = PERIOD_S
    cycle.check(supervisor)
    assert not list(supervisor.findings())


@pytest.mark.parametrize(
    ("cause", "replaced"),
    [
        (DRIVE, True),
        (Fault(Limit.MISSED, 0), True),
        (Fault(Limit.BROKEN_CABLE, 0), False),
        (Fault(Limit.SAFETY_ALARM, code="watchdog"), False),
    ],
)
def test_a_safety_stop_replaces_a_cause_that_its_open_chain_explains(
    cause: Fault, replaced: bool
) -> None:
    safe_stop, supervisor, _, life = reacting(SWITCH)
    life.set_cause(cause, supervisor.reaction)
    list(safe_stop.explain())
    assert life.cause == (SWITCH if replaced else cause)
    assert set(life.faults.values()) == {SWITCH, cause}


def test_a_cable_that_breaks_after_a_tension_fault_is_recorded_once() -> None:
    last = LastLengths()
    safe_stop, supervisor, cycle, life = reacting(last=last)
    life.enter(LoopState.ACTIVE)
    life.set_cause(Fault(Limit.TENSION_HIGH, 1), Reaction.CONTROLLED_STOP)

    def see(tension_N: float) -> bool:
        """Return whether this tension has the status published."""
        life.changed = False
        cycle.estimate.tension_N[1] = tension_N
        cycle.check(supervisor)
        safe_stop.note_further(())
        return life.changed

    assert not see(120.0)
    assert see(0.0)
    (broken,) = life.further
    assert life.text(broken).startswith("right: the cable seems broken")
    assert last.broken == {1: life.text(broken)}
    for _ in range(200):
        assert not see(0.0)
    assert last.broken == {1: life.text(broken)}


def test_a_tension_that_rises_during_the_reaction_publishes_the_status_once() -> None:
    life = Lifecycle()
    life.set_cause(Fault(Limit.SPEED, 0), Reaction.CONTROLLED_STOP)
    for value_N in (120, 130, 140):
        life.changed = False
        life.add_fault(Fault(Limit.TENSION_HIGH, 1, value=value_N))
        assert life.changed == (value_N == 120)
    assert [fault.value for fault in life.further] == [140]


def test_two_buses_that_are_off_are_recorded_as_two_faults() -> None:
    first, second = (
        Fault(Limit.DRIVE, code=BUS_OFF, source=bus, detail=f"{bus} is off") for bus in "AB"
    )
    safe_stop, supervisor, _, life = reacting()
    life.set_cause(first, supervisor.reaction)
    for _ in range(2):
        safe_stop.note_further((first, second))
    assert list(life.faults.values()) == [first, second]


def test_a_silent_drive_is_recorded_as_one_fault_with_the_code_of_the_drive() -> None:
    silent = Fault(Limit.DRIVE, 0, "silent", "node 1", 4.0, 3.0)
    safe_stop, _, _, life = reacting()
    life.set_cause(Fault(Limit.MISSED, 0, value=3.0, allowed=3.0), Reaction.CONTROLLED_STOP)
    life.add_fault(SWITCH)
    for _ in range(2):
        safe_stop.note_further((silent, DRIVE._replace(axis=1)))
    assert list(life.faults.values()) == [silent, SWITCH, DRIVE._replace(axis=1)]
    assert life.reaction is Reaction.CONTROLLED_STOP
