"""Set-points that are planned again in every cycle."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_rt.motion.trajectory import approach, ramp_velocity, soft_deadband, stopping_position

PERIOD_S = 1e-3
pairs = st.lists(st.floats(-20, 20), min_size=2, max_size=2).map(np.array)
bounds = st.lists(st.floats(0.05, 50), min_size=2, max_size=2).map(np.array)


class Run:
    """Two axes that move to targets, with their history."""

    def __init__(self, speed: np.ndarray, acceleration: np.ndarray) -> None:
        self.speed, self.acceleration = speed, acceleration
        self.position, self.velocity, self.slope = np.zeros((3, 2))
        self.places, self.paces = [np.zeros(2)], [np.zeros(2)]

    def towards(self, target: np.ndarray, cycles: int) -> bool:
        arrived = False
        state = self.position, self.velocity, self.slope
        for _ in range(cycles):
            arrived = approach(target, self.speed, self.acceleration, PERIOD_S, *state)
            self.keep()
        return arrived

    def keep(self) -> None:
        self.places.append(self.position.copy())
        self.paces.append(self.velocity.copy())

    def check(self) -> None:
        places, paces = np.array(self.places), np.array(self.paces)
        steps = np.abs(np.diff(paces, axis=0))
        assert np.all(steps <= self.acceleration * PERIOD_S * (1 + 1e-9) + 1e-12)
        mean = 0.5 * (paces[1:] + paces[:-1])
        np.testing.assert_allclose(np.diff(places, axis=0), mean * PERIOD_S, atol=1e-8)
        assert np.all(np.abs(paces) <= self.speed * (1 + 1e-12))


@given(pairs, bounds, bounds)
def test_axes_arrive_without_overshoot_as_early_as_the_bounds_allow(
    target: np.ndarray, speed: np.ndarray, acceleration: np.ndarray
) -> None:
    run = Run(speed, acceleration)
    way = np.abs(target)
    cruising = way > speed**2 / acceleration
    times = np.where(cruising, way / speed + speed / acceleration, 2 * np.sqrt(way / acceleration))
    cycles = int(np.ceil(times.max() / PERIOD_S))
    if cycles > 30_000:
        acceleration *= (cycles / 30_000) ** 2
        speed *= cycles / 30_000
        cycles = 30_000
    # whole cycles cost one or two more than the continuous profile
    assert run.towards(target, cycles + 4)
    run.check()
    np.testing.assert_array_equal(run.position, target)
    np.testing.assert_array_equal(run.velocity, 0.0)
    places = np.array(run.places)
    assert np.all(places * np.sign(target) <= np.abs(target) + 1e-9)


@given(st.lists(st.tuples(pairs, st.integers(1, 400)), min_size=1, max_size=8), bounds, bounds)
def test_bounds_hold_however_the_target_changes(
    targets: list[tuple[np.ndarray, int]], speed: np.ndarray, acceleration: np.ndarray
) -> None:
    run = Run(speed, acceleration)
    for target, cycles in targets:
        run.towards(target, cycles)
    run.check()


def test_a_nan_or_infinite_target_brakes() -> None:
    run = Run(np.ones(2), np.ones(2))
    run.towards(np.array([5.0, 5.0]), 500)
    run.towards(np.array([np.nan, np.inf]), 600)
    run.check()
    np.testing.assert_array_equal(run.velocity, 0.0)


@given(st.lists(st.tuples(pairs, st.integers(1, 400)), min_size=1, max_size=8), bounds)
def test_a_velocity_is_reached_within_the_acceleration(
    wanted: list[tuple[np.ndarray, int]], acceleration: np.ndarray
) -> None:
    run = Run(np.full(2, 20.0), acceleration)
    state = run.position, run.velocity, run.slope
    for pace, cycles in wanted:
        for _ in range(cycles):
            ramp_velocity(pace, acceleration, PERIOD_S, *state)
            run.keep()
        close = np.abs(run.velocity - pace) <= np.maximum(
            0.0, 40.0 - acceleration * PERIOD_S * cycles
        )
        assert np.all(close)
    run.check()
    # speed and then position change within single cycles
    assert not ramp_velocity(np.ones(2), np.full(2, 1e6), PERIOD_S, *state)
    assert not ramp_velocity(np.zeros(2), np.full(2, 1e6), PERIOD_S, *state)
    assert ramp_velocity(np.zeros(2), np.full(2, 1e6), PERIOD_S, *state)


@settings(max_examples=200)
@given(pairs, pairs, st.floats(0.0, 1.0))
def test_the_deadbands_goal_lies_between_position_and_target(
    target: np.ndarray, position: np.ndarray, awake: float
) -> None:
    goal = np.zeros(2)
    share = soft_deadband(target, position, np.ones(2), awake, 1e-4, goal)
    assert 0.0 <= share <= 1.0
    np.testing.assert_allclose(goal, position + share * (target - position), atol=1e-12)
    if np.linalg.norm(target - position) > 2e-4:
        assert share > 0.999


def test_the_deadband_wakes_at_a_larger_step_than_it_falls_asleep() -> None:
    goal = np.zeros(1)
    shares = {
        (awake, size): soft_deadband(np.array([size]), np.zeros(1), np.ones(1), awake, 1e-4, goal)
        for awake in (0.0, 1.0)
        for size in (5e-6, 3e-5, 2e-4)
    }
    assert shares[0.0, 5e-6] < 0.01
    assert shares[0.0, 3e-5] < 0.01, "it stays asleep"
    assert shares[1.0, 3e-5] > 0.99, "it stays awake"
    assert shares[1.0, 5e-6] < 0.1
    assert shares[0.0, 2e-4] > 0.99


@settings(max_examples=100)
@given(pairs, bounds, bounds)
def test_braking_stops_at_the_rest_position(
    pace: np.ndarray, speed: np.ndarray, acceleration: np.ndarray
) -> None:
    velocity = np.clip(pace, -speed, speed)
    position, slope, rest, still = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    stopping_position(position, velocity, acceleration, rest)
    most = np.abs(velocity).max() * PERIOD_S
    while not ramp_velocity(still, acceleration, PERIOD_S, position, velocity, slope):
        pass
    np.testing.assert_allclose(position, rest, atol=most + 1e-12)
