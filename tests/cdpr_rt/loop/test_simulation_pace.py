"""The real-time factor of a simulated robot."""

from __future__ import annotations

from cdpr_rt.loop.loop import SimulationPace

S = 1_000_000_000


def test_the_factor_is_that_of_the_last_seconds() -> None:
    pace, bus_s, factors = SimulationPace(), 100.0, []
    for half in range(60):  # half seconds at the wall
        factors.append(pace.factor(half * S // 2, bus_s))
        bus_s += 0.5 if half < 30 else 0.2
    assert factors[:6] == [None] * 6
    assert set(factors[6:31]) == {1.0}
    assert set(factors[43:]) == {0.4}
    assert factors[30:44] == sorted(factors[30:44], reverse=True)


def test_a_bus_whose_time_starts_again_is_measured_again() -> None:
    pace = SimulationPace()
    pace.factor(0, 50.0)
    assert pace.factor(4 * S, 54.0) == 1.0
    assert pace.factor(5 * S, 0.0) is None
    assert pace.factor(9 * S, 2.0) == 0.5
