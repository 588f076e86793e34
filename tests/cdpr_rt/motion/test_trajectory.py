"""Properties of every leg."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdpr_rt.core.exchange import Setpoint
from cdpr_rt.motion.trajectory import Hold, TrapezoidalMove

legs = st.builds(
    TrapezoidalMove,
    st.lists(st.floats(-10, 10), min_size=2, max_size=2).map(np.array),
    st.lists(st.floats(-5, 5), min_size=2, max_size=2).map(np.array),
    st.floats(0, 3),
    st.floats(0.01, 1),
)


def sample(leg: TrapezoidalMove, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    setpoint = Setpoint(2)
    positions, velocities = [], []
    for t in times:
        leg.fill(t, setpoint)
        positions.append(setpoint.position_rad.copy())
        velocities.append(setpoint.velocity_rad_s.copy())
    return np.array(positions), np.array(velocities)


@given(legs)
def test_velocity_is_the_derivative_and_keeps_its_bounds(leg: TrapezoidalMove) -> None:
    times = np.linspace(-0.1, leg.duration_s + 0.1, 4001)
    positions, velocities = sample(leg, times)
    step = times[1] - times[0]
    numeric = np.diff(positions, axis=0) / step
    mean = 0.5 * (velocities[1:] + velocities[:-1])
    slope = np.abs(leg.velocity_rad_s) / leg.ramp_s
    assert np.all(np.abs(numeric - mean) <= slope * step + 1e-9)
    assert np.all(np.abs(velocities) <= np.abs(leg.velocity_rad_s) + 1e-12)
    assert np.all(np.abs(np.diff(velocities, axis=0)) <= slope * step * (1 + 1e-6) + 1e-12)
    np.testing.assert_allclose(positions[0], leg.start_rad)
    np.testing.assert_allclose(positions[-1], leg.end_rad(), atol=1e-9)


@given(legs, st.floats(0, 1))
def test_braking_continues_position_and_velocity_and_ends_at_rest(
    leg: TrapezoidalMove, where: float
) -> None:
    t = where * leg.duration_s
    before, after = Setpoint(2), Setpoint(2)
    leg.fill(t, before)
    brake = leg.brake(t)
    brake.fill(brake.ramp_s, after)
    np.testing.assert_allclose(after.position_rad, before.position_rad, atol=1e-9)
    np.testing.assert_allclose(after.velocity_rad_s, before.velocity_rad_s, atol=1e-9)
    brake.fill(brake.duration_s, after)
    np.testing.assert_allclose(after.velocity_rad_s, 0.0, atol=1e-9)


def test_holding_does_not_move() -> None:
    positions, velocities = sample(Hold(np.array([1.0, -2.0]), 0.5), np.linspace(0, 0.5, 11))
    assert np.all(positions == [1.0, -2.0])
    assert np.all(velocities == 0.0)
