"""Encoder counter, delay, noise and index pulse."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_sim_bus.robot import motor as motor_physics
from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.plant import Plant
from tests.sim_bus.robot.bare_motor import Motor

TRUE = {"eccentricity_rad": 0.0, "interpolation_error": 0.0}
"""An encoder without errors."""


def spinning(speed_rad_s: float, **sections: object) -> Motor:
    """Return a flywheel without friction or cogging that turns at a constant speed."""
    plant = Plant.model_validate(
        {
            "cogging": (),
            "motor": {"inertia_kg_m2": 10.0, "initial_angle_deg": 12.0},
            "friction": {"coulomb_Nm": 0.0, "breakaway_Nm": 0.0, "viscous_Nms_rad": 0.0},
            **sections,
        }
    )
    motor = Motor(plant)
    motor.record["velocity"] = speed_rad_s
    return motor


@settings(max_examples=25)
@given(
    speed=st.floats(-300.0, 300.0),
    counts=st.integers(16, 2**22),
    delay=st.floats(0.0, 0.01),
    dt=st.floats(2e-4, 5e-3),
)
def test_counter_is_the_delayed_angle(speed: float, counts: int, delay: float, dt: float) -> None:
    motor = spinning(
        speed,
        encoder={"counts_per_turn": counts, "noise_counts": 0.0, **TRUE},
        drive={"feedback_delay_s": delay, "feedback_jitter_s": 0.0},
    )
    for _ in range(30):
        sample = motor.step(dt, servo.OFF, 0.0)
    seen = max(0.0, motor.time_s - delay)
    exact = speed * seen * counts / (2 * math.pi)
    assert abs(sample.counts - exact) <= 1.0 + 1e-6 * abs(exact)


def test_noise_is_normal_white_and_has_the_stated_deviation() -> None:
    motor = spinning(0.0, encoder={"noise_counts": 4.0})
    readings = np.array([motor.step(1e-4, servo.OFF, 0.0).counts for _ in range(20_000)])
    assert np.std(readings) == pytest.approx(math.hypot(4.0, 1 / math.sqrt(12)), rel=0.02)
    assert abs(np.mean(readings)) < 0.6
    # Fourth moment of a normal distribution, and no correlation between readings.
    deviation = readings - readings.mean()
    assert np.mean(deviation**4) / np.var(readings) ** 2 == pytest.approx(3.0, abs=0.2)
    assert abs(np.corrcoef(deviation[1:], deviation[:-1])[0, 1]) < 0.03


@settings(max_examples=40)
@given(
    speed=st.floats(-400.0, 400.0).filter(lambda v: abs(v) > 0.5),
    counts=st.sampled_from([17, 1000, 5000, 8192, 10007, 65536]),
    index_deg=st.floats(-360.0, 360.0),
)
def test_index_latches_once_per_turn_at_its_angle(
    speed: float, counts: int, index_deg: float
) -> None:
    motor = spinning(speed, encoder={"counts_per_turn": counts, "index_deg": index_deg})
    start = math.radians(12.0)
    away = (start - math.radians(index_deg) + math.pi) % (2 * math.pi) - math.pi
    begins_on_it = abs(away) <= 2 * math.pi / counts  # then the pulse falls before it rises
    latched = []
    for _ in range(200):
        sample = motor.step(1e-3, servo.OFF, 0.0)
        if sample.flags & motor_physics.INDEX_ROSE:
            count = int(motor.record["rise_count"][0])
            if not latched or latched[-1] != count:
                latched.append(count)
        assert bool(sample.flags & motor_physics.INDEX_FELL) <= bool(latched) or begins_on_it
    turned = sample.angle_rad - start
    assert abs(len(latched) - abs(turned) / (2 * math.pi)) <= 1.0
    for count in latched:
        angle = start + count * 2 * math.pi / counts
        off = (angle - math.radians(index_deg) + math.pi) % (2 * math.pi) - math.pi
        assert abs(off) <= 1.01 * 2 * math.pi / counts
    assert all(abs(b - a) % counts == 0 for a, b in itertools.pairwise(latched))


def test_index_is_at_the_same_count_in_both_directions() -> None:
    motor = spinning(20.0)
    forward = backward = None
    for _ in range(400):
        if motor.step(1e-3, servo.OFF, 0.0).flags & motor_physics.INDEX_ROSE:
            forward = int(motor.record["rise_count"][0])
    motor.record["velocity"] = -20.0
    for _ in range(400):
        if motor.step(1e-3, servo.OFF, 0.0).flags & motor_physics.INDEX_ROSE:
            backward = int(motor.record["rise_count"][0])
    assert forward is not None and backward is not None
    assert (forward - backward) % 8192 == 0


def test_a_missing_index_never_latches() -> None:
    motor = spinning(100.0, encoder={"index_present": False})
    edges = motor_physics.INDEX_ROSE | motor_physics.INDEX_FELL
    assert not any(motor.step(1e-3, servo.OFF, 0.0).flags & edges for _ in range(500))


@pytest.mark.parametrize("index_deg", [123.4, -200.0])
def test_error_of_an_eccentric_disc_has_one_period_per_turn_and_is_zero_at_the_index(
    index_deg: float,
) -> None:
    disc = {"eccentricity_rad": 0.01, "eccentricity_phase_deg": 50.0, "interpolation_error": 0.0}
    disc |= {"counts_per_turn": 2**20, "noise_counts": 0.0, "index_deg": index_deg}
    motor = spinning(0.0, encoder=disc)
    for off_deg in (0.0, 40.0, 90.0, 200.0, 360.0):
        angle = math.radians(index_deg + off_deg)
        motor.record["angle"] = motor.record["slot_angle"] = angle
        read = motor_physics.read_counter(motor.record[0], angle) * 2 * math.pi / 2**20
        phase = math.radians(50.0)
        error = 0.01 * (math.sin(math.radians(off_deg) + phase) - math.sin(phase))
        assert read == pytest.approx(angle - math.radians(12.0) + error, abs=2e-5)


def test_interpolation_error_has_a_period_of_four_counts() -> None:
    disc = {"eccentricity_rad": 0.0, "interpolation_error": 0.2, "noise_counts": 0.0}
    motor = spinning(0.0, encoder=disc)
    zero = int(motor.record["zero"][0])
    per_rad = 8192 / (2 * math.pi)
    for place in np.arange(0.0, 12.0, 0.11):
        read = motor_physics.read_counter(motor.record[0], place / per_rad) + zero
        assert read == math.floor(place + 0.8 * math.sin(math.pi / 2 * place) + 0.5)


def test_jitter_shifts_readings_by_speed_times_delay() -> None:
    speed, jitter = 100.0, 5e-4
    motor = spinning(
        speed,
        encoder={"counts_per_turn": 2**22, "noise_counts": 0.0, **TRUE},
        drive={"feedback_delay_s": 1e-3, "feedback_jitter_s": jitter},
    )
    late = []
    for _ in range(2000):
        sample = motor.step(1e-3, servo.OFF, 0.0)
        read = sample.counts * 2 * math.pi / 2**22
        late.append(motor.time_s - 1e-3 - read / speed)
    off = np.array(late[5:])
    assert jitter * 0.98 < np.abs(off).max() < jitter * 1.001
    assert np.std(off) == pytest.approx(jitter / math.sqrt(3.0), rel=0.05)
    assert abs(np.mean(off)) < 0.05 * jitter
