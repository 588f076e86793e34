"""Speed loops of the winches."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_rt.control.winch_speed_loop import FASTEST_IN_m_s, HANGING_LOAD_1_s, WinchSpeedLoop
from cdpr_rt.core.exchange import AxisFeedback

PERIOD_s, INERTIA_kg_m2, CABLE_m = 0.001, 1.1e-4, 0.026
LOW_N, HIGH_N, COULOMB_Nm = 5.0, 150.0, 0.08


@pytest.mark.parametrize("begins_rad_s", [0.0, -150.0, -250.0])
def test_a_winch_with_a_broken_cable_does_not_run_away(begins_rad_s: float) -> None:
    """It starts with an unopposed 18 N, and the loop first sees the jump as rest."""
    loop = WinchSpeedLoop(np.array([INERTIA_kg_m2]), np.array([CABLE_m]), PERIOD_s)
    loop.low_N[:], loop.high_N[:], loop.paying_out_m_s[:] = LOW_N, HIGH_N, 0.15
    loop.fastest_in_m_s, loop.integral_rate_1_s = FASTEST_IN_m_s, HANGING_LOAD_1_s
    feedback, torque_Nm = AxisFeedback(1), np.array([-18.0 * CABLE_m])
    loop.begin(feedback, np.zeros(1), torque_Nm)
    speed_rad_s, fastest_rad_s = begins_rad_s, abs(begins_rad_s)
    for _ in range(1000):
        moving_Nm = torque_Nm[0] - COULOMB_Nm * np.sign(speed_rad_s)
        speed_rad_s += PERIOD_s * moving_Nm / INERTIA_kg_m2
        feedback.position_rad += PERIOD_s * speed_rad_s
        fastest_rad_s = max(fastest_rad_s, abs(speed_rad_s))
        loop.update(feedback, torque_Nm)
    assert fastest_rad_s < abs(begins_rad_s) + 50.0
    assert abs(speed_rad_s) * CABLE_m < FASTEST_IN_m_s


@pytest.mark.parametrize("friction_N", [0.5, 8.0, 12.0])
def test_a_slack_cable_is_paid_out_against_friction_up_to_the_push(friction_N: float) -> None:
    """The cable is paid out by the requested length. A winch with more friction stands still."""
    push_N, left_m = 10.0, 0.1
    loop = WinchSpeedLoop(np.array([INERTIA_kg_m2]), np.array([CABLE_m]), PERIOD_s)
    loop.high_N[:], loop.paying_out_m_s[:] = HIGH_N, 0.15
    loop.left_m[:], loop.push_N[:] = left_m, push_N
    loop.integral_rate_1_s = HANGING_LOAD_1_s
    feedback, torque_Nm, speed_rad_s = AxisFeedback(1), np.zeros(1), 0.0
    loop.begin(feedback, np.zeros(1), torque_Nm)
    for _ in range(2000):
        unbraked_rad_s = speed_rad_s + PERIOD_s * torque_Nm[0] / INERTIA_kg_m2
        braked_rad_s = abs(unbraked_rad_s) - PERIOD_s * friction_N * CABLE_m / INERTIA_kg_m2
        speed_rad_s = float(np.copysign(max(braked_rad_s, 0.0), unbraked_rad_s))
        feedback.position_rad += PERIOD_s * speed_rad_s
        loop.update(feedback, torque_Nm)
        assert loop.tension_N[0] >= -push_N
    paid_out_m = CABLE_m * feedback.position_rad[0]
    if friction_N > push_N:
        assert paid_out_m == 0.0
        assert loop.tension_N[0] == 0.0
    else:
        assert paid_out_m == pytest.approx(left_m, abs=0.01)
        assert speed_rad_s == 0.0 and loop.tension_N[0] >= 0.0


@pytest.mark.parametrize("left_m", [0.0, 2.0])
def test_a_motor_whose_encoder_shows_no_motion_does_not_run_away(left_m: float) -> None:
    """The cable is slack; the motor turns, and its encoder does not count.

    `tighten` can take up a metre of slack.
    """
    loop = WinchSpeedLoop(np.array([INERTIA_kg_m2]), np.array([CABLE_m]), PERIOD_s)
    loop.high_N[:], loop.paying_out_m_s[:] = HIGH_N, 0.15
    loop.left_m[:] = left_m
    loop.push_N[:], loop.low_N[:] = (25.0, 0.0) if left_m else (0.0, -25.0)
    if left_m:  # as in a blind lowering; otherwise as in tightening
        loop.integral_rate_1_s = HANGING_LOAD_1_s
    feedback, torque_Nm, speed_rad_s, turned_rad = AxisFeedback(1), np.zeros(1), 0.0, 0.0
    loop.begin(feedback, np.full(1, -1.0), torque_Nm)  # it was reeling in when the encoder failed
    for _ in range(1000):
        moving_Nm = max(torque_Nm[0] - COULOMB_Nm, -COULOMB_Nm)
        speed_rad_s = max(speed_rad_s + PERIOD_s * moving_Nm / INERTIA_kg_m2, 0.0)
        turned_rad += PERIOD_s * speed_rad_s
        loop.update(feedback, torque_Nm)
    assert CABLE_m * turned_rad < 0.25
    assert loop.stuck.all()
    assert speed_rad_s == torque_Nm[0] == 0.0


@pytest.mark.parametrize("noise_counts", [0.3, 145.0])
def test_a_winch_whose_encoder_shows_noise_does_not_wind_in_its_cable(noise_counts: float) -> None:
    """A tight cable is held at its end; clipped noise would pull with half the highest tension."""
    noise_rad = noise_counts * 2.0 * np.pi / 8192
    loop = WinchSpeedLoop(np.array([INERTIA_kg_m2]), np.array([CABLE_m]), PERIOD_s)
    loop.low_N[:], loop.high_N[:], loop.paying_out_m_s[:] = LOW_N, HIGH_N, 0.15
    loop.fastest_in_m_s, loop.integral_rate_1_s = FASTEST_IN_m_s, HANGING_LOAD_1_s
    feedback, torque_Nm = AxisFeedback(1), np.array([-18.0 * CABLE_m])
    loop.begin(feedback, np.zeros(1), torque_Nm)
    random, tensions_N = np.random.default_rng(1), []
    for _ in range(1000):
        feedback.position_rad[:] = np.round(random.normal(0.0, noise_rad, 1), 4)
        loop.update(feedback, torque_Nm)
        tensions_N.append(loop.tension_N[0])
    assert loop.noisy[0] == (noise_counts > 100.0)
    assert np.mean(tensions_N[200:]) == 0.0 if loop.noisy[0] else min(tensions_N) >= LOW_N


def test_a_winch_that_accelerates_as_fast_as_its_motor_can_does_not_count_as_noise() -> None:
    """Its cable has broken under the highest tension."""
    loop = WinchSpeedLoop(np.array([INERTIA_kg_m2]), np.array([CABLE_m]), PERIOD_s)
    loop.low_N[:], loop.high_N[:], loop.paying_out_m_s[:] = LOW_N, HIGH_N, 0.15
    loop.fastest_in_m_s, loop.integral_rate_1_s = FASTEST_IN_m_s, HANGING_LOAD_1_s
    feedback, torque_Nm, speed_rad_s = AxisFeedback(1), np.zeros(1), 0.0
    loop.begin(feedback, np.zeros(1), np.zeros(1))
    for _ in range(40):
        speed_rad_s -= PERIOD_s * HIGH_N * CABLE_m / INERTIA_kg_m2
        feedback.position_rad += PERIOD_s * speed_rad_s
        loop.update(feedback, torque_Nm)
        assert not loop.noisy.any()


def test_a_winch_that_turns_slowly_under_the_full_push_is_not_stuck() -> None:
    """A winch with a gear needs more time to reach its speed than an encoder to show a motion."""
    inertia, push_N = 20.0 * INERTIA_kg_m2, 10.0
    loop = WinchSpeedLoop(np.array([inertia]), np.array([CABLE_m]), PERIOD_s)
    loop.high_N[:], loop.paying_out_m_s[:] = HIGH_N, 0.15
    loop.left_m[:], loop.push_N[:] = 0.1, push_N
    feedback, torque_Nm, speed_rad_s = AxisFeedback(1), np.zeros(1), 0.0
    loop.begin(feedback, np.zeros(1), torque_Nm)
    for _ in range(2000):
        friction_Nm = 0.5 * push_N * CABLE_m
        speed_rad_s = max(speed_rad_s + PERIOD_s * (torque_Nm[0] - friction_Nm) / inertia, 0.0)
        feedback.position_rad += PERIOD_s * speed_rad_s
        loop.update(feedback, torque_Nm)
    assert not loop.stuck.any()
    assert CABLE_m * feedback.position_rad[0] > 0.09
