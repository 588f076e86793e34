"""Each limit: conditions that trip it, conditions that do not, and the reaction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervisor import DEFAULT_REACTIONS, Limits, Supervisor
from tests.cdpr_rt.core.supervisor_rig import PERIOD_S, SAFE, Cycle, reason_of, with_rate

Change = Callable[[Cycle, int], None]


def run(
    change: Change, limits: Limits = SAFE, cycles: int = 400, at_rad: float = 0.0
) -> tuple[Supervisor, int, Cycle]:
    """Run 50 normal cycles, then some with `change`. Return the first cycle that trips.

    Its number is relative to the change, -1 if no cycle trips.
    """
    supervisor, cycle = Supervisor(limits, 2, PERIOD_S), Cycle()
    supervisor.reset()
    cycle.feedback.position_rad[:] = cycle.setpoint.position_rad[:] = at_rad
    for _ in range(50):
        assert cycle.check(supervisor) == Reaction.NONE
    for k in range(cycles):
        change(cycle, k)
        if cycle.check(supervisor) != Reaction.NONE:
            return supervisor, k, cycle
    return supervisor, -1, cycle


def torque(value: float) -> Change:
    def change(cycle: Cycle, _k: int) -> None:
        cycle.torque[:] = (0.0, value)

    return change


def torque_by_steps(step_Nm: float) -> Change:
    def change(cycle: Cycle, k: int) -> None:
        cycle.torque[1] = step_Nm * (k % 2)

    return change


def speed(value: float) -> Change:
    def change(cycle: Cycle, _k: int) -> None:
        cycle.estimate.velocity_rad_s[1] = value

    return change


def jump(value: float, missed: int = 0) -> Change:
    """Jump once after `missed` cycles without an answer."""

    def change(cycle: Cycle, k: int) -> None:
        cycle.feedback.valid[1] = k >= missed
        cycle.feedback.position_rad[1] = value if k >= missed else 0.0
        cycle.setpoint.position_rad[1] = cycle.feedback.position_rad[1]

    return change


def behind(value: float) -> Change:
    def change(cycle: Cycle, _k: int) -> None:
        cycle.setpoint.position_rad[1] = value

    return change


def length(value_m: float, wanted_rad_s: float) -> Change:
    def change(cycle: Cycle, _k: int) -> None:
        cycle.estimate.cable_length_m[1] = value_m
        cycle.setpoint.velocity_rad_s[1] = wanted_rad_s

    return change


def tension(value_N: float, after_cycles: int = 0, paid_out_rad: float = 0.0) -> Change:
    """Reduce the tension within some cycles while the motor pays out."""

    def change(cycle: Cycle, k: int) -> None:
        fallen = min(1.0, (k + 1) / (after_cycles + 1))
        cycle.estimate.tension_N[1] = 50.0 + fallen * (value_N - 50.0)
        cycle.feedback.position_rad[1] = fallen * paid_out_rad
        cycle.setpoint.position_rad[1] = fallen * paid_out_rad

    return change


def missed(which: Callable[[int], bool]) -> Change:
    def change(cycle: Cycle, k: int) -> None:
        cycle.feedback.valid[1] = not which(k)

    return change


def flag(name: str, cycles: int) -> Change:
    def change(cycle: Cycle, k: int) -> None:
        getattr(cycle.feedback, name)[1] = k >= cycles

    return change


def sensor(is_ok: bool) -> Change:
    def change(cycle: Cycle, _k: int) -> None:
        cycle.estimate.sensor_ok[1] = is_ok
        # without a reading, the estimate is used, which may have any value
        cycle.estimate.tension_N[1] = 50.0 if is_ok else 0.0

    return change


def late(value_s: float) -> Change:
    def change(cycle: Cycle, _k: int) -> None:
        cycle.estimate.elapsed_s = PERIOD_S + value_s

    return change


@dataclass(frozen=True)
class Case:
    """One limit: what trips it and when, what does not, and its text."""

    limit: Limit
    trips: Change
    told: str
    at: int = 0
    """Cycle after the change."""
    value: float = math.nan
    axis: int = 1
    does_not: tuple[Change, ...] = field(default_factory=tuple)


CASES = [
    Case(
        Limit.TORQUE,
        torque(-2.01),
        "axis 2: torque -2.01 Nm, 2 Nm allowed",
        value=-2.01,
        does_not=(torque(2.0),),
    ),
    Case(
        Limit.TORQUE_RATE,
        torque_by_steps(1.5),
        "axis 2: torque rate 1.5e+03 Nm/s, 1e+03 Nm/s allowed",
        at=1,
        value=1500.0,
        does_not=(torque_by_steps(0.99),),
    ),
    Case(
        Limit.SPEED,
        speed(-20.1),
        "axis 2: speed -1152 deg/s, 1146 deg/s allowed",
        value=-20.1,
        does_not=(speed(19.9), speed(-19.9)),
    ),
    Case(
        Limit.ENCODER_JUMP,
        jump(0.0701),
        "axis 2: angle jumped by 4.0 deg, 4.0 deg possible",
        value=0.0701,
        # the angle that a motor may turn during missing answers
        does_not=(jump(0.0699), jump(-0.0699), jump(0.0899, missed=1)),
    ),
    Case(Limit.SPEED, speed(math.nan), "axis 2: speed nan deg/s, 1146 deg/s allowed", does_not=()),
    Case(
        Limit.FOLLOWING_ERROR,
        behind(0.21),
        "axis 2: following error 12.0 deg, 11.5 deg allowed",
        value=0.21,
        does_not=(behind(0.19), behind(-0.19)),
    ),
    Case(
        Limit.FOLLOWING_ERROR, behind(math.nan), "axis 2: following error nan deg, 11.5 deg allowed"
    ),
    Case(
        Limit.CABLE_LENGTH,
        length(4.01, 0.1),
        "axis 2: cable length 4.010 m, 4.000 m allowed",
        value=4.01,
        # on the way back, at rest, and with unknown length
        does_not=(length(3.99, 0.1), length(4.01, -0.1), length(4.01, 0.0), length(math.nan, 0.1)),
    ),
    Case(
        Limit.CABLE_LENGTH,
        length(0.49, -0.1),
        "axis 2: cable length 0.490 m, 0.500 m allowed",
        value=0.49,
        does_not=(length(0.51, -0.1), length(0.49, 0.1)),
    ),
    Case(
        Limit.TENSION_HIGH,
        tension(101.0),
        "axis 2: tension 101.0 N, 100.0 N allowed",
        value=101.0,
        does_not=(tension(99.0), tension(math.nan)),
    ),
    Case(
        Limit.TENSION_LOW,
        tension(15.0),
        "axis 2: tension 15.0 N, at least 20.0 N required",
        at=99,
        value=15.0,
        does_not=(tension(21.0),),
    ),
    Case(
        Limit.SLACK,
        tension(2.0, paid_out_rad=0.06),
        "axis 2: the cable is slack: tension 2.0 N, slack below 5.0 N",
        at=99,
        value=2.0,
    ),
    Case(
        Limit.BROKEN_CABLE,
        tension(0.0, after_cycles=20),
        "axis 2: the cable seems broken or has slipped: tension fell suddenly to 4.8 N, "
        "from above 20.0 N",
        at=18,
        value=50.0 / 21.0 * 2,
    ),
    Case(
        Limit.TENSION_SENSOR,
        sensor(False),
        "axis 2: the tension sensor gives no valid reading",
        does_not=(sensor(True),),
    ),
    Case(
        Limit.STALE,
        flag("alive", 1000),
        "axis 2: feedback silent or irregular for 11 cycles, 10 allowed",
        at=10,
        value=11.0,
        does_not=(flag("alive", 10),),
    ),
    Case(
        Limit.STALE,
        flag("rate_ok", 1000),
        "axis 2: feedback silent or irregular for 11 cycles, 10 allowed",
        at=10,
        value=11.0,
        does_not=(flag("rate_ok", 10),),
    ),
    Case(
        Limit.MISSED,
        missed(lambda _k: True),
        "axis 2: no feedback for 4 cycles, 3 allowed",
        at=3,
        value=4.0,
        does_not=(missed(lambda k: k in (0, 1, 2, 60, 61, 62)),),
    ),
    Case(
        Limit.MISSED_IN_WINDOW,
        missed(lambda k: k % 8 == 0),
        "axis 2: 6 answers missed in a window, 5 allowed",
        at=40,
        value=6.0,
        does_not=(missed(lambda k: k % 10 == 0),),
    ),
    Case(
        Limit.LATE,
        late(0.021),
        "the loop was delayed for 21 ms, 20 ms allowed",
        axis=-1,
        value=0.021,
        does_not=(late(0.019),),
    ),
    Case(
        Limit.NOT_FINITE,
        torque(math.nan),
        "axis 2: the controller's torque is nan; a finite number is required",
    ),
]


NAMES = [f"{i} {case.limit.key}" for i, case in enumerate(CASES)]


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_a_limit_trips_in_the_cycle_in_which_it_is_exceeded(case: Case):
    limits = SAFE if case.limit is not Limit.TORQUE_RATE else with_rate(1000.0)
    supervisor, when, _ = run(case.trips, limits)
    assert (supervisor.limit, when) == (case.limit, case.at)
    assert (supervisor.axis, supervisor.reaction) == (case.axis, DEFAULT_REACTIONS[case.limit])
    assert reason_of(supervisor) == case.told
    if not math.isnan(case.value):
        assert supervisor.fault().value == pytest.approx(case.value)
    for change in case.does_not:
        other, when, _ = run(change, limits)
        assert (when, other.fault()) == (-1, None)


@pytest.mark.parametrize("case", CASES, ids=NAMES)
@pytest.mark.parametrize("reaction", [Reaction.CONTROLLED_STOP, Reaction.TORQUE_OFF])
def test_a_limit_causes_the_reaction_in_the_robots_file(case: Case, reaction: Reaction):
    values = {name: getattr(SAFE, name) for name in SAFE.__dataclass_fields__}
    rate = 1000.0 if case.limit is Limit.TORQUE_RATE else 1e4
    wanted = Limits(**values | {"reactions": {case.limit: reaction}, "torque_rate_Nm_s": rate})
    supervisor, when, _ = run(case.trips, wanted)
    assert (supervisor.limit, when, supervisor.reaction) == (case.limit, case.at, reaction)


def test_each_limit_of_the_kernel_has_a_case():
    others = {Limit.NONE, Limit.SAFETY_STOP, Limit.SAFETY_ALARM, Limit.DRIVE}
    others |= {Limit.LENGTHS, Limit.LENGTHS_JUMP}
    assert {case.limit for case in CASES} == set(Limit) - others
    assert set(DEFAULT_REACTIONS) == set(Limit) - {Limit.NONE}


# -- memory


def test_violations_outside_the_window_are_not_counted():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    tripped = []
    for k in range(200):
        # five in each window of fifty, at shifting times
        cycle.feedback.valid[1] = k % 50 not in (1, 11, 21, 31, 41)
        tripped.append(cycle.check(supervisor))
    assert not any(tripped)
    cycle.feedback.valid[1] = False
    assert cycle.check(supervisor) == Reaction.CONTROLLED_STOP


def test_reset_forgets_everything():
    supervisor, when, cycle = run(missed(lambda k: k % 8 == 0))
    assert when > 0
    supervisor.reset()
    assert (reason_of(supervisor), supervisor.reaction) == ("", Reaction.NONE)
    cycle.feedback.valid[:] = True
    assert cycle.check(supervisor) == Reaction.NONE
