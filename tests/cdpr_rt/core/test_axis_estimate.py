"""Estimates of velocity, cable length and tension agree with motors of known state."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.estimate import FILTER_S, Estimator, WinchArrays
from cdpr_rt.core.exchange import AxisFeedback, Setpoint, TensionFault, TensionFeedback
from cdpr_rt.core.supervisor import Limits, Supervisor

PERIOD_S = 1e-3
COUNT_rad = 2.0 * np.pi / 8192
DRUM_m = 0.104 / 4.0
INERTIA_kg_m2 = 1.13e-4


def winches(signs: FloatArray, friction_Nm: float = 0.0) -> WinchArrays:
    n = signs.size
    return WinchArrays(
        cable_m_per_rad=signs * DRUM_m,
        gain_m=np.full(n, DRUM_m),
        bias_Nm=np.full(n, 0.02),
        friction_Nm=np.full(n, friction_Nm),
        friction_per_N_m=np.full(n, 1e-4 if friction_Nm else 0.0),
        inertia_kg_m2=np.full(n, INERTIA_kg_m2),
    )


class Winch:
    """A motor with a drum and a cable under tension, with angles as read by an encoder."""

    def __init__(self, sign: float, friction_Nm: float = 0.0) -> None:
        self.feedback = AxisFeedback(1)
        self.feedback.valid[:] = self.feedback.alive[:] = self.feedback.rate_ok[:] = True
        self._sign, self._friction_Nm = sign, friction_Nm
        self.angle = self.speed = 0.0

    def step(self, winding_Nm: float, tension_N: float, blocked: bool = False) -> None:
        torque = -self._sign * winding_Nm
        friction = self._friction_Nm + (1e-4 * tension_N if self._friction_Nm else 0.0)
        pulled = self._sign * (DRUM_m * tension_N + 0.02)
        for _ in range(20):
            drag = friction * np.tanh(self.speed / 0.01)
            self.speed += PERIOD_S / 20 * (torque + pulled - drag) / INERTIA_kg_m2
            self.speed = 0.0 if blocked else self.speed
            self.angle += PERIOD_S / 20 * self.speed
        self.feedback.position_rad[0] = round(self.angle / COUNT_rad) * COUNT_rad
        self.feedback.torque_Nm[0] = torque


@settings(max_examples=30)
@given(st.floats(-50.0, 50.0), st.floats(-1e4, 1e4), st.sets(st.integers(20, 190), max_size=40))
def test_a_constant_speed_is_found_despite_missing_answers(
    speed: float, start: float, missing: set[int]
) -> None:
    estimator, feedback = Estimator(1, PERIOD_S), AxisFeedback(1)
    for k in range(200):
        feedback.valid[0] = k not in missing
        if feedback.valid[0]:
            exact = start + speed * k * PERIOD_S
            feedback.position_rad[0] = round(exact / COUNT_rad) * COUNT_rad
        estimator.update(feedback)
    # the filter reduces an encoder step in one cycle to a twelfth of its rate
    assert estimator.estimate.velocity_rad_s[0] == pytest.approx(speed, abs=COUNT_rad / FILTER_S)


def test_the_estimate_uses_the_elapsed_time_between_cycles() -> None:
    estimator, feedback = Estimator(1, PERIOD_S), AxisFeedback(1)
    feedback.valid[:] = True
    at = 0.0
    for k in range(300):
        elapsed_s = PERIOD_S * (7.0 if k % 10 == 0 else 1.0)
        at += elapsed_s
        feedback.position_rad[0] = 5.0 * at
        estimator.update(feedback, elapsed_s=elapsed_s)
        assert estimator.estimate.elapsed_s == elapsed_s
    assert estimator.estimate.velocity_rad_s[0] == pytest.approx(5.0, rel=1e-3)


def test_known_lengths_follow_the_motors() -> None:
    estimator = Estimator(3, PERIOD_S, winches(np.array([1.0, -1.0, 1.0])))
    feedback = AxisFeedback(3)
    feedback.valid[:] = True
    feedback.position_rad[:] = 1.0, 2.0, 3.0
    estimator.update(feedback)
    told = estimator.estimate
    assert np.isnan(told.cable_length_m).all()
    assert not told.length_known.any()
    estimator.set_lengths(feedback.position_rad, np.array([2.0, 3.0, np.nan]))
    feedback.position_rad[:] += 10.0
    estimator.update(feedback)
    assert told.length_known.tolist() == [True, True, False]
    np.testing.assert_allclose(told.cable_length_m[:2], [2.0 + 0.26, 3.0 - 0.26])
    assert np.isnan(told.cable_length_m[2])
    estimator.reset()
    estimator.update(feedback)
    np.testing.assert_allclose(told.cable_length_m[:2], [2.26, 2.74])
    estimator.forget_lengths()
    estimator.update(feedback)
    assert np.isnan(told.cable_length_m).all()
    assert not told.length_known.any()


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("friction_Nm", [0.0, 0.08])
@pytest.mark.parametrize("winding_rad_s", [-5.0, 5.0])
def test_tension_is_found_from_the_torque(
    sign: float, friction_Nm: float, winding_rad_s: float
) -> None:
    winch = Winch(sign, friction_Nm)
    estimator = Estimator(1, PERIOD_S, winches(np.array([sign]), friction_Nm))
    for _ in range(1500):
        # a speed controller winds the cable under 60 N
        wanted = -sign * winding_rad_s
        winding = DRUM_m * 60.0 + 0.02 - sign * 0.02 * (wanted - winch.speed)
        winch.step(winding, 60.0)
        estimator.update(winch.feedback)
    # friction reduces the speed, because the controller has no integrator
    assert np.sign(winch.speed) == np.sign(-sign * winding_rad_s)
    assert estimator.estimate.tension_N[0] == pytest.approx(60.0, abs=1.0)
    assert not estimator.estimate.tension_measured[0]


@pytest.mark.parametrize("measured_Nm", [0.0, 0.08])
def test_friction_torque_does_not_count_as_tension(measured_Nm: float) -> None:
    """Friction is subtracted once: that of the motor, or the measured friction of the winch."""
    winch = Winch(1.0, 0.08)
    estimator = Estimator(1, PERIOD_S, winches(np.array([1.0]), measured_Nm))
    for _ in range(1500):
        winding = DRUM_m * 60.0 + 0.02 - 0.02 * (-5.0 - winch.speed)
        winch.step(winding, 60.0)
        estimator.update(winch.feedback, motor_loss_Nm=np.full(1, -0.08))
    assert winch.speed < 0.0
    assert estimator.estimate.tension_N[0] == pytest.approx(60.0, abs=1.0)


@pytest.mark.parametrize("measured_Nm", [0.0, 0.08])
def test_cogging_does_not_count_as_tension(measured_Nm: float) -> None:
    winch = Winch(1.0, 0.08)
    estimator = Estimator(1, PERIOD_S, winches(np.array([1.0]), measured_Nm))
    loss, cogging = np.full(1, -0.08 - 0.06), np.full(1, -0.06)
    for _ in range(1500):
        winding = DRUM_m * 60.0 + 0.02 - 0.02 * (-5.0 - winch.speed)
        winch.step(winding, 60.0)
        winch.feedback.torque_Nm += (
            cogging  # the drive exerts this torque and the rotor's magnets balance it
        )
        estimator.update(winch.feedback, motor_loss_Nm=loss, cogging_Nm=cogging)
    assert estimator.estimate.tension_N[0] == pytest.approx(60.0, abs=1.0)


def test_inertial_torque_does_not_count_as_tension() -> None:
    """A cable is cut while the motor pulls. The torque alone would still indicate 50 N."""
    winch, estimator = Winch(1.0), Estimator(1, PERIOD_S, winches(np.array([1.0])))
    limits = Limits(
        10.0, 1e4, 1e4, 3, tension_min_N=20.0, slack_N=5.0, slack_s=0.1, broken_within_s=0.05
    )
    supervisor, setpoint, torque = Supervisor(limits, 1, PERIOD_S), Setpoint(1), np.zeros(1)
    winding = DRUM_m * 50.0 + 0.02
    for _ in range(500):
        winch.step(winding, 50.0, blocked=True)
        estimator.update(winch.feedback)
        assert supervisor.check(winch.feedback, estimator.estimate, setpoint, torque) == 0
    assert estimator.estimate.tension_N[0] == pytest.approx(50.0, abs=0.5)
    cycles = 0
    while supervisor.limit is Limit.NONE and cycles < 60:
        winch.step(winding, 0.0)
        estimator.update(winch.feedback)
        supervisor.check(winch.feedback, estimator.estimate, setpoint, torque)
        cycles += 1
    assert supervisor.limit is Limit.BROKEN_CABLE
    assert 15 <= cycles <= 50  # after more than twice the estimate's 10 ms
    assert winch.feedback.torque_Nm[0] == pytest.approx(-winding)


def test_tension_is_found_with_friction_proportional_to_it() -> None:
    table = winches(np.array([1.0]), friction_Nm=0.1)
    table.friction_per_N_m[:] = 5e-3
    feedback = AxisFeedback(1)
    feedback.valid[:] = True
    for winding_rad_s, way in ((2.0, 1.0), (-2.0, -1.0), (0.0, 0.0)):
        estimator = Estimator(1, PERIOD_S, table)
        # 60 N at constant speed; a positive angle pays out
        torque = -(DRUM_m * 60.0 + 0.02 + way * (0.1 + 5e-3 * 60.0))
        for k in range(300):
            feedback.position_rad[0] = 1e3 - winding_rad_s * k * PERIOD_S
            feedback.torque_Nm[0] = torque
            estimator.update(feedback)
        assert estimator.estimate.tension_N[0] == pytest.approx(60.0, abs=1e-3)


def test_reset_forgets_the_motion_and_keeps_the_position() -> None:
    winch, estimator = Winch(1.0), Estimator(1, PERIOD_S, winches(np.array([1.0])))
    for _ in range(100):
        winch.step(-1.0, 0.0)
        estimator.update(winch.feedback)
    assert estimator.estimate.velocity_rad_s[0] > 10.0
    estimator.reset()
    assert estimator.estimate.velocity_rad_s[0] == 0.0
    winch.feedback.position_rad[0] += 1000.0  # as after a long pause of cycles
    winch.feedback.torque_Nm[0] = -(DRUM_m * 30.0 + 0.02)
    estimator.update(winch.feedback)
    assert estimator.estimate.velocity_rad_s[0] == 0.0
    assert estimator.estimate.tension_N[0] == pytest.approx(30.0)


def test_a_cable_does_not_push() -> None:
    winch, estimator = Winch(1.0), Estimator(1, PERIOD_S, winches(np.array([1.0])))
    for _ in range(100):
        winch.step(-0.5, 0.0, blocked=True)
        estimator.update(winch.feedback)
    assert estimator.estimate.tension_N[0] == 0.0


def test_an_axis_without_a_cable_has_no_tension() -> None:
    estimator, feedback = Estimator(2, PERIOD_S), AxisFeedback(2)
    feedback.valid[:] = True
    estimator.update(feedback)
    assert np.isnan(estimator.estimate.tension_N).all()
    estimator.set_lengths(feedback.position_rad, np.ones(2))
    assert not estimator.estimate.length_known.any()


def readings(*tension_N: float) -> TensionFeedback:
    told = TensionFeedback(len(tension_N))
    told.tension_N[:] = tension_N
    told.valid[:] = True
    told.fault[:] = TensionFault.NONE
    return told


def test_a_sensor_takes_precedence_over_the_torque() -> None:
    winch, estimator = Winch(1.0), Estimator(1, PERIOD_S, winches(np.array([1.0])))
    read = readings(42.0)
    told = estimator.estimate
    for _ in range(100):
        winch.step(DRUM_m * 50.0 + 0.02, 50.0, blocked=True)
        estimator.update(winch.feedback, read)
        assert (told.tension_N[0], told.tension_measured[0], told.sensor_ok[0]) == (42.0, 1, 1)
    read.valid[0] = False
    estimator.update(winch.feedback, read)
    assert told.tension_N[0] == pytest.approx(50.0, abs=0.5)
    assert (told.tension_measured[0], told.sensor_ok[0]) == (False, False)


def test_sensor_readings_belong_to_the_first_axes() -> None:
    feedback = AxisFeedback(3)
    feedback.valid[:] = True
    first = Estimator(3, PERIOD_S)
    first.update(feedback, readings(1.0, 2.0))
    np.testing.assert_array_equal(first.estimate.tension_N, [1.0, 2.0, np.nan])
    assert first.estimate.sensor_ok.all()
    assert first.estimate.tension_measured.tolist() == [True, True, False]
