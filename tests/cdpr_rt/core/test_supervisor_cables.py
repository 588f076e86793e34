"""Detection of disagreeing lengths, slack cables and broken cables."""

from __future__ import annotations

import dataclasses
import math

import pytest

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.fault import fault_text
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervisor import Supervisor, no_suspects
from tests.cdpr_rt.core.supervisor_rig import PERIOD_S, SAFE, Cycle, reason_of
from tests.cdpr_rt.core.test_supervisor_limits import run, tension


@pytest.mark.parametrize(("axis", "named"), [(1, "axis 2: "), (-1, "")])
def test_lengths_that_disagree_persistently_stop_the_motion(axis: int, named: str) -> None:
    limits = dataclasses.replace(SAFE, lengths_disagree_m=0.03, broken_within_s=0.0495)
    supervisor, cycle = Supervisor(limits, 2, PERIOD_S), Cycle()
    told = []
    for off_m, cycles in ((0.029, 200), (0.031, 40), (0.03, 40), (math.nan, 50)):
        for _ in range(cycles):
            cycle.check(supervisor)
            told.append(supervisor.compare_lengths(PERIOD_S, off_m, axis))
    assert told == [Reaction.NONE] * (len(told) - 1) + [Reaction.CONTROLLED_STOP]
    assert supervisor.axis == axis
    assert reason_of(supervisor).startswith(f"{named}the cables' lengths disagree by")
    supervisor.reset()
    cycle.check(supervisor)
    assert supervisor.compare_lengths(PERIOD_S, math.nan, axis) == Reaction.NONE


@pytest.mark.parametrize(("axis", "named"), [(1, "axis 2: "), (-1, "")])
def test_lengths_that_jump_stop_the_motion_before_they_disagree_too_far(
    axis: int, named: str
) -> None:
    limits = dataclasses.replace(
        SAFE, lengths_disagree_m=0.03, lengths_jump_m=0.007, broken_within_s=0.0495
    )
    supervisor, cycle = Supervisor(limits, 2, PERIOD_S), Cycle()
    told = []
    for jump_m, cycles in ((0.007, 200), (0.008, 40), (0.002, 40), (0.008, 50)):
        for _ in range(cycles):
            cycle.check(supervisor)
            told.append(supervisor.compare_lengths(PERIOD_S, 0.02, -1, no_suspects, jump_m, axis))
    assert told == [Reaction.NONE] * (len(told) - 1) + [Reaction.CONTROLLED_STOP]
    assert (supervisor.limit, supervisor.axis) == (Limit.LENGTHS_JUMP, axis)
    assert reason_of(supervisor).startswith(
        f"{named}the cables' lengths suddenly changed relative to each other by 8.0 mm, "
        "7.0 mm allowed"
    )


def test_lengths_that_oscillate_about_agreement_are_reported():
    limits = dataclasses.replace(SAFE, lengths_disagree_m=0.03, broken_within_s=0.05)
    supervisor, cycle = Supervisor(limits, 2, PERIOD_S), Cycle()
    told = []
    for k in range(1000):
        cycle.check(supervisor)
        off_m = abs(0.06 * math.sin(2.0 * math.pi * 8.0 * k * PERIOD_S))
        told.append(supervisor.compare_lengths(PERIOD_S, off_m, -1))
    assert Reaction.CONTROLLED_STOP in told


def test_a_cable_that_was_never_tight_is_not_reported_as_slack():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    cycle.estimate.tension_N[:] = 0.0
    assert {cycle.check(supervisor) for _ in range(500)} == {Reaction.NONE}


def test_slack_is_reported_once_until_the_cable_was_tight_again():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    told = []
    for tension_N in (50.0, 10.0, 2.0, 10.0, 50.0, 10.0, 2.0):
        cycle.estimate.tension_N[1] = tension_N
        for _ in range(150):
            if cycle.check(supervisor):
                told.append((tension_N, supervisor.limit))
    low, slack = (10.0, Limit.TENSION_LOW), (2.0, Limit.SLACK)
    assert told == [low, slack, low, slack]


@pytest.mark.parametrize(
    ("paid_out_rad", "limit"),
    [
        (0.06, Limit.TENSION_LOW),  # 1.6 mm
        (0.01, Limit.BROKEN_CABLE),  # 0.3 mm
        (-0.06, Limit.BROKEN_CABLE),
    ],
)
def test_a_cable_that_lost_tension_by_paying_out_is_not_reported_as_broken(
    paid_out_rad: float, limit: Limit
):
    def change(cycle: Cycle, k: int) -> None:
        tension(0.0, after_cycles=20, paid_out_rad=paid_out_rad)(cycle, k)
        cycle.feedback.position_rad[1] += 7.0
        cycle.setpoint.position_rad[:] = cycle.feedback.position_rad

    supervisor, *_ = run(change, at_rad=7.0)
    assert supervisor.limit is limit


def test_a_broken_cable_is_reported_once():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    cycle.check(supervisor)
    cycle.estimate.tension_N[1] = 0.0
    told = [supervisor.limit for _ in range(300) if cycle.check(supervisor)]
    assert told == [Limit.BROKEN_CABLE]


def runs_in(at_rad_s: float, tension_N: float, planned_rad_s: float = 0.0) -> Limit:
    """Return the limit reported for a cable under 50 N reeled in at this speed and tension."""
    limits = dataclasses.replace(
        SAFE, speed_rad_s=200.0, following_error_rad=100.0, runaway_m_s=1.0
    )
    supervisor, cycle = Supervisor(limits, 2, PERIOD_S), Cycle()
    for _ in range(300):
        cycle.check(supervisor)
    cycle.setpoint.velocity_rad_s[1] = -planned_rad_s
    for k in range(20):
        share = (k + 1) / 20
        cycle.estimate.velocity_rad_s[1] = -share * at_rad_s
        cycle.estimate.tension_N[1] = 50.0 + share * (tension_N - 50.0)
        if cycle.check(supervisor):
            return supervisor.limit
    return Limit.NONE


def test_a_winch_that_runs_away_against_friction_has_a_broken_cable():
    """Friction may leave an estimated tension above `slack_N`."""
    assert runs_in(40.0, 24.0) is Limit.BROKEN_CABLE  # 1.04 m/s
    assert runs_in(37.0, 24.0) is Limit.NONE
    assert runs_in(60.0, 24.0, planned_rad_s=25.0) is Limit.NONE
    # held, as by a pushed platform: tension remains
    assert runs_in(60.0, 35.0) is Limit.NONE


def test_a_broken_cable_of_a_slowly_accelerating_winch_is_detected():
    """Meanwhile the tension left by friction does not replace the earlier tension."""
    limits = dataclasses.replace(
        SAFE,
        speed_rad_s=200.0,
        following_error_rad=100.0,
        runaway_m_s=1.0,
        tension_min_N=2.0,
        slack_N=0.5,
    )
    supervisor, cycle = Supervisor(limits, 2, PERIOD_S), Cycle()
    cycle.estimate.tension_N[1] = 10.0
    for _ in range(600):
        cycle.check(supervisor)
    cycle.estimate.tension_N[1] = 4.0
    told = []
    for _ in range(100):
        cycle.estimate.velocity_rad_s[1] -= 0.5  # 1 m/s after 77 ms
        if cycle.check(supervisor):
            told.append(supervisor.limit)
            break
    assert told == [Limit.BROKEN_CABLE]


def test_two_cables_that_break_in_one_cycle_are_both_reported() -> None:
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    cycle.check(supervisor)
    cycle.estimate.tension_N[:] = 0.0
    cycle.check(supervisor)
    assert supervisor.axis == 0
    found = [(fault.axis, fault.limit) for fault in supervisor.findings()]
    assert found == [(0, Limit.BROKEN_CABLE), (1, Limit.BROKEN_CABLE)]


@pytest.mark.parametrize(
    ("suspects", "told"), [((1,), ", one of right"), ((1, 0), ", one of right, left"), ((), "")]
)
def test_ambiguous_lengths_name_all_suspected_cables(suspects: tuple[int, ...], told: str) -> None:
    limits = dataclasses.replace(SAFE, lengths_disagree_m=0.03)
    limits = dataclasses.replace(limits, lengths_jump_m=0.007)
    supervisor, cycle = Supervisor(limits, 2, PERIOD_S), Cycle()
    asked: list[bool] = []

    def ask(jump: bool) -> tuple[int, ...]:
        asked.append(jump)
        return suspects

    def compare(disagree_m: float, jump_m: float = 0.0) -> None:
        for _ in range(100):
            cycle.check(supervisor)
            supervisor.compare_lengths(PERIOD_S, disagree_m, -1, ask, jump_m)

    compare(0.05)
    assert supervisor.limit is Limit.LENGTHS
    assert reason_of(supervisor, ("left", "right")).endswith(f"cable or encoder failed{told}")
    assert asked == [False]  # only once per disagreement
    compare(0.0)
    assert supervisor.limit is Limit.NONE
    compare(0.05)
    compare(0.0)
    compare(0.0, 0.008)
    assert supervisor.limit is Limit.LENGTHS_JUMP
    assert reason_of(supervisor, ("left", "right")).endswith(told)
    assert asked == [False, False, True]


def test_a_tension_peak_that_ends_early_is_reported() -> None:
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    for tension_N in (50.0, 99.0, 140.0, 99.0, 50.0, 120.0, 50.0):
        cycle.estimate.tension_at_once_N[1] = tension_N
        assert cycle.check(supervisor) == Reaction.NONE
    (peak,) = supervisor.peaks()
    text = fault_text(peak, ("left", "right"))
    assert text.startswith("right: tension 140 N or more for some ms, 100 N allowed")
    supervisor.reset()
    assert supervisor.peaks() == []


def test_an_angle_jump_is_not_reported_as_tension_peak() -> None:
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    for _ in range(3):
        cycle.check(supervisor)
    cycle.feedback.position_rad[1] = cycle.setpoint.position_rad[1] = 0.15
    cycle.estimate.tension_at_once_N[1] = 400.0
    told = [supervisor.limit for _ in range(5) if cycle.check(supervisor)]
    assert Limit.ENCODER_JUMP in told
    assert supervisor.peaks() == []


@pytest.mark.parametrize(("within_s", "told"), [(0.005, True), (0.2, False)])
def test_a_break_while_slack_is_allowed_is_detected_by_the_sudden_run_in(
    within_s: float, told: bool
) -> None:
    """The winch runs in immediately. With a swinging platform, a winch takes up slack slowly."""
    limits = dataclasses.replace(SAFE, speed_rad_s=200.0, following_error_rad=100.0)
    supervisor, cycle, found = Supervisor(limits, 2, PERIOD_S), Cycle(), set()
    cycle.estimate.slack_allowed = True
    for k in range(600):
        share = min(max(k - 300, 0) * PERIOD_S / within_s, 1.0)
        cycle.estimate.velocity_rad_s[1] = -share * 0.45 / 0.026
        cycle.estimate.tension_N[1] = 50.0 - 45.0 * share
        supervisor.check(cycle.feedback, cycle.estimate, cycle.setpoint, cycle.torque, True)
        found.add((supervisor.limit, supervisor.axis))
    assert ((Limit.BROKEN_CABLE, 1) in found) is told
