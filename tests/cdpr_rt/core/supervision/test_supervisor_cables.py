"""Cables whose lengths disagree, that are slack, and that have broken."""

from __future__ import annotations

import dataclasses
import math

import pytest

from cdpr_profiles.limits.robot_limits import Limit
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervision.supervisor import Supervisor
from tests.cdpr_rt.core.supervision.supervisor_rig import PERIOD_S, SAFE, Cycle
from tests.cdpr_rt.core.supervision.test_supervisor_limits import run, tension


@pytest.mark.parametrize(("axis", "named"), [(1, "axis 2: "), (-1, "")])
def test_lengths_that_disagree_for_longer_than_a_break_takes(axis: int, named: str) -> None:
    limits = dataclasses.replace(SAFE, lengths_disagree_m=0.03, broken_within_s=0.0495)
    supervisor, cycle = Supervisor(limits, 2, PERIOD_S), Cycle()
    told = []
    for off_m, cycles in ((0.029, 200), (0.031, 40), (0.03, 40), (math.nan, 50)):
        for _ in range(cycles):
            cycle.check(supervisor)
            told.append(supervisor.compare_lengths(PERIOD_S, off_m, axis))
    assert told == [Reaction.NONE] * (len(told) - 1) + [Reaction.CONTROLLED_STOP]
    assert supervisor.axis == axis
    assert supervisor.reason().startswith(f"{named}the cables' lengths disagree by")
    supervisor.reset()
    cycle.check(supervisor)
    assert supervisor.compare_lengths(PERIOD_S, math.nan, axis) == Reaction.NONE


def test_lengths_that_swing_about_agreement_are_told_too():
    limits = dataclasses.replace(SAFE, lengths_disagree_m=0.03, broken_within_s=0.05)
    supervisor, cycle = Supervisor(limits, 2, PERIOD_S), Cycle()
    told = []
    for k in range(1000):
        cycle.check(supervisor)
        off_m = abs(0.06 * math.sin(2.0 * math.pi * 8.0 * k * PERIOD_S))
        told.append(supervisor.compare_lengths(PERIOD_S, off_m, -1))
    assert Reaction.CONTROLLED_STOP in told


def test_a_cable_that_was_never_tight_is_not_slack():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    cycle.estimate.tension_N[:] = 0.0
    assert {cycle.check(supervisor) for _ in range(500)} == {Reaction.NONE}


def test_slack_is_told_once_until_the_cable_was_tight_again():
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
def test_a_cable_from_which_tension_was_paid_out_is_not_broken(paid_out_rad: float, limit: Limit):
    def change(cycle: Cycle, k: int) -> None:
        tension(0.0, after_cycles=20, paid_out_rad=paid_out_rad)(cycle, k)
        cycle.feedback.position_rad[1] += 7.0
        cycle.setpoint.position_rad[:] = cycle.feedback.position_rad

    supervisor, *_ = run(change, at_rad=7.0)
    assert supervisor.limit is limit


def test_a_broken_cable_is_told_once():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    cycle.check(supervisor)
    cycle.estimate.tension_N[1] = 0.0
    told = [supervisor.limit for _ in range(300) if cycle.check(supervisor)]
    assert told == [Limit.BROKEN_CABLE]


def runs_in(at_rad_s: float, tension_N: float, planned_rad_s: float = 0.0) -> Limit:
    """Return what is told of a cable under 50 N that comes in so fast, with this tension left."""
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


def test_a_winch_that_runs_away_against_no_more_than_friction_has_lost_its_cable():
    """What friction leaves of a tension by torque may be more than `slack_N`."""
    assert runs_in(40.0, 24.0) is Limit.BROKEN_CABLE  # 1.04 m/s
    assert runs_in(37.0, 24.0) is Limit.NONE
    assert runs_in(60.0, 24.0, planned_rad_s=25.0) is Limit.NONE
    # held, as by a platform that somebody pushes: its tension is left
    assert runs_in(60.0, 35.0) is Limit.NONE


def test_a_weak_winch_takes_long_to_run_away():
    """Meanwhile what friction leaves is not taken for the tension that the cable had."""
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
