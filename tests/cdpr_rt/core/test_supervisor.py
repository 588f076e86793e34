"""The supervisor clamps torques, reports faults and resets."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.fault import Fault, fault_record
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervisor import Limits, Supervisor
from tests.cdpr_rt.core.supervisor_rig import PERIOD_S, SAFE, Cycle, reason_of, with_rate

# -- clamping


def test_torque_is_clamped_to_the_limit_of_each_axis():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    cycle.torque[:] = -5.0, 5.0
    assert cycle.check(supervisor) == Reaction.CLAMP
    np.testing.assert_array_equal(cycle.torque, [-1.0, 2.0])


def test_torque_changes_at_most_with_its_rate():
    supervisor, cycle = Supervisor(with_rate(100.0), 2, PERIOD_S), Cycle()
    supervisor.reset(np.array([0.5, -0.5]))
    sent = [[0.5, -0.5]]
    for k in range(40):
        cycle.torque[:] = (0.9, 1.9) if k < 25 else (-0.9, -1.9)
        cycle.check(supervisor)
        sent.append(cycle.torque.tolist())
    steps = np.diff(np.array(sent), axis=0)
    assert np.abs(steps).max() == pytest.approx(0.1)
    assert sent[4][0] == pytest.approx(0.9)
    assert sent[24][1] == pytest.approx(1.9)
    assert sent[-1] == pytest.approx([-0.6, 0.4])


def test_a_nan_torque_is_not_passed_on():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    cycle.torque[:] = math.nan, math.inf
    assert cycle.check(supervisor) == Reaction.QUICK_STOP
    np.testing.assert_array_equal(cycle.torque, [0.0, 0.0])


def test_one_limit_applies_to_all_axes():
    supervisor, cycle = Supervisor(Limits(1.5, 1.0, 1.0, 3), 2, PERIOD_S), Cycle()
    cycle.torque[:] = -5.0, 5.0
    cycle.check(supervisor)
    np.testing.assert_array_equal(cycle.torque, [-1.5, 1.5])


# -- reporting


def test_the_most_severe_violation_of_a_cycle_counts():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    cycle.torque[:] = 5.0  # will be clamped
    cycle.estimate.tension_N[0] = 110.0
    cycle.setpoint.position_rad[1] = 1.0
    assert cycle.check(supervisor) == Reaction.QUICK_STOP
    assert (supervisor.limit, supervisor.axis) == (Limit.FOLLOWING_ERROR, 1)
    assert supervisor.fault() == Fault(Limit.FOLLOWING_ERROR, 1, value=1.0, allowed=0.2)
    cycle.setpoint.position_rad[1] = 0.0
    assert cycle.check(supervisor) == Reaction.CONTROLLED_STOP
    assert (supervisor.limit, supervisor.axis) == (Limit.TENSION_HIGH, 0)


def test_axes_are_reported_by_name():
    supervisor = Supervisor(SAFE, 2, PERIOD_S)
    cycle = Cycle()
    cycle.setpoint.position_rad[1] = 1.0
    cycle.check(supervisor)
    assert reason_of(supervisor, ("left", "right")).startswith("right: following error")


def test_the_more_severe_external_reaction_wins():
    supervisor, cycle = Supervisor(SAFE, 2, PERIOD_S), Cycle()
    door = Fault(Limit.SAFETY_STOP, code="door", detail="a door is open")
    drive = Fault(Limit.DRIVE, 1, "2310h", "node 2", detail="over current")
    cycle.check(supervisor)
    assert supervisor.report(door) == Reaction.CONTROLLED_STOP
    assert supervisor.report(drive) == Reaction.QUICK_STOP
    assert supervisor.report(door) == Reaction.QUICK_STOP
    assert (supervisor.fault(), supervisor.axis) == (drive, 1)
    alarm = Fault(Limit.SAFETY_ALARM, code="chain_open", detail="emergency stop")
    assert supervisor.report(alarm) == Reaction.TORQUE_OFF
    assert cycle.check(supervisor) == Reaction.NONE
    assert (reason_of(supervisor), supervisor.limit, supervisor.axis) == ("", Limit.NONE, -1)


# -- arbitrary input


WILD = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True), st.floats(-3.0, 3.0), st.just(math.nan)
)


@settings(max_examples=200)
@given(st.lists(st.tuples(*[WILD] * 7, st.integers(0, 31)), min_size=1, max_size=20))
def test_arbitrary_torques_never_exceed_the_limits(
    cycles: list[tuple[float, float, float, float, float, float, float, int]],
) -> None:
    supervisor, cycle = Supervisor(with_rate(100.0), 2, PERIOD_S), Cycle()
    last = np.zeros(2)
    for torque_Nm, speed_rad_s, position, wanted, wanted_speed, *cable, flags in cycles:
        cycle.torque[:] = torque_Nm
        cycle.estimate.velocity_rad_s[1] = speed_rad_s
        cycle.feedback.position_rad[1] = position
        cycle.setpoint.position_rad[1] = wanted
        cycle.setpoint.velocity_rad_s[1] = wanted_speed
        cycle.estimate.cable_length_m[1], cycle.estimate.tension_N[1] = cable
        told = (cycle.feedback.valid, cycle.feedback.alive, cycle.feedback.rate_ok)
        for bit, array in enumerate((*told, cycle.estimate.sensor_ok)):
            array[1] = bool(flags >> bit & 1)
        cycle.estimate.elapsed_s = 1.0 if flags >> 4 else PERIOD_S
        reaction = Reaction(cycle.check(supervisor))
        assert np.isfinite(cycle.torque).all()
        assert (np.abs(cycle.torque) <= np.array([1.0, 2.0])).all()
        assert (np.abs(cycle.torque - last) <= 100.0 * PERIOD_S + 1e-12).all()
        assert bool(reason_of(supervisor)) == (reaction is not Reaction.NONE)
        assert all(
            json.dumps(fault_record(fault, ()), allow_nan=False) for fault in supervisor.findings()
        )
        last[:] = cycle.torque
