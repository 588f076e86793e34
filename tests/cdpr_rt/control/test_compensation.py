"""Compensation interpolates its tables, blends directions, looks ahead and fades in."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_rt.control.compensation import AxisCompensation, Compensation, FrictionFeedforward
from cdpr_rt.core.exchange import AxisFeedback, Setpoint

M = 720
ANGLES = np.arange(M) * 2 * math.pi / M
TABLE = np.vstack([np.sin(4 * ANGLES), 2.0 + np.cos(3 * ANGLES)])


def at(n=1, angle=0.0, velocity=1.0, index=0.0, known=True):
    feedback, setpoint = AxisFeedback(n), Setpoint(n)
    feedback.position_rad[:] = angle
    feedback.index_rad[:] = index
    feedback.index_known[:] = known
    setpoint.position_rad[:] = angle
    setpoint.velocity_rad_s[:] = velocity
    return feedback, setpoint


def settled(axis, feedback, setpoint, cycles=400):
    compensation, out = Compensation([axis], 1e-3), np.zeros(1)
    for _ in range(cycles):
        compensation.torque(feedback, setpoint, out)
    return out[0]


@settings(max_examples=60)
@given(angle=st.floats(-50, 50), index=st.floats(-10, 10), forward=st.booleans())
def test_table_is_interpolated_from_the_index(angle, index, forward):
    feedback, setpoint = at(angle=angle, index=index, velocity=1.0 if forward else -1.0)
    got = settled(AxisCompensation(TABLE, most_Nm=10.0), feedback, setpoint)
    row = TABLE[0 if forward else 1]
    place = ((angle - index) % (2 * math.pi)) / (2 * math.pi) * M
    want = np.interp(place, np.arange(M + 1), np.append(row, row[0]))
    assert got == pytest.approx(want, abs=1e-9)


@pytest.mark.parametrize("velocity", [-1.0, 0.0, 1.0])
def test_reported_cogging_has_zero_mean_over_a_turn(velocity):
    rubbing = FrictionFeedforward(coulomb_forward_Nm=0.3, coulomb_backward_Nm=0.2)
    compensation = Compensation([AxisCompensation(TABLE, rubbing, most_Nm=10.0)], 1e-3)
    total, cogging = np.zeros((2, M))
    for _ in range(300):
        compensation.torque(*at(velocity=velocity), np.zeros(1))
    for k, angle in enumerate(ANGLES):
        out = np.zeros(1)
        compensation.torque(*at(angle=angle, velocity=velocity), out)
        total[k], cogging[k] = out[0], compensation.cogging_Nm[0]
    assert cogging.mean() == pytest.approx(0.0, abs=1e-9)
    assert cogging == pytest.approx(total - total.mean(), abs=1e-9)


def test_reported_friction_is_the_compensated_part():
    rubbing = FrictionFeedforward(
        coulomb_forward_Nm=0.3, coulomb_backward_Nm=0.2, stribeck_backward_Nm=0.15
    )
    axis = AxisCompensation(TABLE, rubbing, most_Nm=10.0)
    compensation = Compensation([axis, None, axis], 1e-3)
    feedback, setpoint = at(n=3)
    feedback.index_known[2] = False
    for _ in range(100):
        compensation.torque(feedback, setpoint, np.zeros(3))
    made_up_for = compensation.friction_Nm * compensation.faded_in
    assert made_up_for == pytest.approx([0.175, 0.0, 0.0])  # faded in by half
    for _ in range(200):
        compensation.torque(feedback, setpoint, np.zeros(3))
    made_up_for = compensation.friction_Nm * compensation.faded_in
    assert made_up_for == pytest.approx([0.35, 0.0, 0.0])


def test_directions_blend_continuously_at_standstill():
    axis = AxisCompensation(TABLE, blend_speed_rad_s=0.02, most_Nm=10.0)
    got = [settled(axis, *at(angle=0.4, velocity=v)) for v in np.linspace(-0.03, 0.03, 61)]
    assert np.max(np.abs(np.diff(got))) < 0.06 * np.ptp(got)
    low, middle, high = got[0], got[30], got[-1]
    assert middle == pytest.approx(0.5 * (low + high))


@settings(max_examples=60)
@given(angle=st.floats(-50, 50), index=st.floats(-10, 10))
def test_standing_torque_equals_the_compensation_at_rest(angle, index):
    feedback, setpoint = at(n=3, angle=angle, index=index, velocity=0.0)
    feedback.index_known[2] = False
    rubbing = FrictionFeedforward(coulomb_forward_Nm=0.3, stribeck_backward_Nm=0.1)
    axes = [
        AxisCompensation(TABLE, rubbing, most_Nm=10.0),
        None,
        AxisCompensation(TABLE, most_Nm=10.0),
    ]
    compensation, out = Compensation(axes, 1e-3), np.zeros(3)
    for _ in range(300):
        compensation.torque(feedback, setpoint, out)
    got = compensation.standing_Nm(feedback.position_rad, feedback)
    assert got == pytest.approx(out, abs=1e-9)
    assert got[1] == got[2] == 0.0


@pytest.mark.parametrize("observer_s", [0.0, 0.003])
def test_the_table_is_read_at_the_angle_when_the_torque_acts(observer_s):
    axis = AxisCompensation(TABLE, look_ahead_s=0.002, observer_s=observer_s, most_Nm=10.0)
    got = settled(axis, *at(angle=1.0, velocity=5.0))
    assert got == pytest.approx(math.sin(4 * 1.01), abs=1e-4)


def test_observer_follows_a_moving_deviation_without_lag():
    axis = AxisCompensation(TABLE, look_ahead_s=0.01, observer_s=0.003, most_Nm=10.0)
    compensation, out = Compensation([axis], 1e-3), np.zeros(1)
    for k in range(400):
        feedback, setpoint = at(angle=0.0, velocity=1.0)
        feedback.position_rad[:] = 0.5 * k * 1e-3  # the set-point is at 0 while the rotor drifts
        compensation.torque(feedback, setpoint, out)
    angle = 0.5 * 399e-3 + 1.5 * 0.01
    assert out[0] == pytest.approx(math.sin(4 * angle), abs=3e-4)


def test_friction_follows_the_speed_of_the_rotor_and_never_reverses():
    friction = FrictionFeedforward(0.08, 0.06, 0.02, 0.01, 0.2, 5e-4)
    axis = AxisCompensation(np.zeros((2, M)), friction, observer_s=0.003, most_Nm=10.0)
    assert settled(axis, *at(velocity=1.0)) == pytest.approx(0.08 + 0.02 * math.exp(-25.0) + 5e-4)
    assert settled(axis, *at(velocity=-0.1)) == pytest.approx(-0.06 - 0.01 * math.exp(-0.25) - 5e-5)
    compensation, out = Compensation([axis], 1e-3), np.zeros(1)
    for k in range(400):
        feedback, setpoint = at(velocity=0.3)
        feedback.position_rad[:] = -0.3 * k * 1e-3  # so that the rotor stands
        compensation.torque(feedback, setpoint, out)
    assert out[0] == pytest.approx(0.08 + 0.02, abs=1e-6)


def test_compensation_fades_in_with_the_index_and_stops_without():
    compensation = Compensation([AxisCompensation(TABLE + 1.0, most_Nm=10.0)], 1e-3)
    out = np.zeros(1)
    hidden, seen = at(known=False), at()
    for _ in range(50):
        compensation.torque(*hidden, out)
        assert out[0] == 0.0
    course = []
    for _ in range(300):
        compensation.torque(*seen, out)
        course.append(out[0])
    assert course[99] == pytest.approx(0.5)
    assert course[199:] == pytest.approx(np.ones(101))
    compensation.torque(*hidden, out)
    assert out[0] == 0.0


def test_axes_without_profile_are_not_compensated():
    compensation, out = (
        Compensation([None, AxisCompensation(TABLE + 1.0, most_Nm=10.0), None], 1e-3),
        np.ones(3),
    )
    for _ in range(300):
        compensation.torque(*at(3), out)
    assert out == pytest.approx([0.0, 1.0, 0.0])


def test_tables_of_different_shapes_are_rejected():
    with pytest.raises(ValueError, match="shape"):
        Compensation(
            [AxisCompensation(TABLE, most_Nm=10.0), AxisCompensation(TABLE[:, :100], most_Nm=10.0)],
            1e-3,
        )


@settings(max_examples=60)
@given(
    scale=st.sampled_from([1.0, 1e3, 1e6, 1e300]),
    velocity=st.floats(-300, 300),
    angle=st.floats(-50, 50),
    most=st.floats(0.01, 1.0),
)
def test_compensation_never_exceeds_the_limit_of_the_axis(scale, velocity, angle, most):
    friction = FrictionFeedforward(scale, scale, scale, -scale, 0.2, scale)
    axis = AxisCompensation(scale * TABLE, friction, look_ahead_s=0.5, most_Nm=most)
    feedback, setpoint = at(angle=angle, velocity=velocity)
    assert abs(settled(axis, feedback, setpoint, 250)) <= most
    standing = Compensation([axis], 1e-3).standing_Nm(feedback.position_rad, feedback)
    assert abs(standing[0]) <= most


def test_nan_passes_through_to_the_supervisor():
    axis = AxisCompensation(np.full((2, M), np.nan), most_Nm=0.5)
    assert math.isnan(settled(axis, *at()))
