"""A loop whose tensions alternate for long is told; what works, moves or rings out is not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cdpr_rt.robots.platform.oscillation import RESERVE_SHARE, Oscillation

PERIOD_S, RESERVE_N = 1e-3, 20.0
PLANNED_N = np.array([40.0, 60.0, 50.0])
MUCH_N = 1.5 * RESERVE_SHARE * RESERVE_N

Wave = Callable[[float], float]


class Loop:
    """Three cables, of which the loop asks the second for more and less."""

    def __init__(self) -> None:
        self.tension_N, self.planned_N = PLANNED_N.copy(), PLANNED_N.copy()
        self.watch = Oscillation(
            ["one", "two", "three"], RESERVE_N, self.tension_N, self.planned_N, PERIOD_S
        )
        self.cycle = 0

    def told(self, beyond_N: Wave, seconds: float) -> str:
        for _ in range(round(seconds / PERIOD_S)):
            self.tension_N[:] = self.planned_N
            self.tension_N[1] += beyond_N(self.cycle * PERIOD_S)
            self.cycle += 1
            self.watch.update()
        return self.watch.trouble


def sine(frequency_Hz: float, amplitude_N: float, mean_N: float = 0.0) -> Wave:
    return lambda t: float(mean_N + amplitude_N * np.sin(2.0 * np.pi * frequency_Hz * t))


@pytest.mark.parametrize("frequency_Hz", [6.0, 13.0, 80.0, 120.0])
@pytest.mark.parametrize("mean_N", [0.0, -15.0])
def test_what_alternates_for_more_than_a_second_is_told(frequency_Hz: float, mean_N: float) -> None:
    loop = Loop()
    wave = sine(frequency_Hz, MUCH_N, mean_N)
    assert not loop.told(wave, 0.9)
    told = loop.told(wave, 0.6)
    assert "for 1 s it has asked two for 10 N more and less than on average" in told
    assert abs(float(told.split(" at ")[1].split(" Hz")[0]) - frequency_Hz) <= max(
        1.0, 0.03 * frequency_Hz
    )
    assert loop.told(lambda _: 0.0, 5.0) == told, "it stays until it is cleared"
    loop.watch.clear()
    assert not loop.told(wave, 0.9)
    assert loop.told(wave, 0.6)


def test_what_the_plan_changes_is_no_oscillation() -> None:
    loop = Loop()
    for k in range(3000):
        swing_N = MUCH_N * np.sin(2.0 * np.pi * 20.0 * k * PERIOD_S)
        loop.planned_N[:] = PLANNED_N + swing_N
        loop.told(lambda _: 0.0, PERIOD_S)
    assert not loop.watch.trouble


@pytest.mark.parametrize(
    "beyond_N",
    [
        sine(80.0, 0.9 * RESERVE_SHARE * RESERVE_N),
        sine(2.0, MUCH_N),
        lambda t: MUCH_N * (1.0 if t % 1.0 < 0.5 else -1.0),
        lambda t: 4.0 * MUCH_N * np.exp(-2.0 * (t % 2.0)) * np.sin(2.0 * np.pi * 20.0 * t),
        lambda t: 3.0 * MUCH_N if t > 0.5 else 0.0,
    ],
    ids=["little", "slow", "there and back", "rings out", "leans on"],
)
def test_a_loop_that_works_is_none(beyond_N: Wave) -> None:
    assert not Loop().told(beyond_N, 10.0)


def test_a_pause_begins_anew() -> None:
    loop = Loop()
    for _ in range(10):
        assert not loop.told(sine(40.0, MUCH_N), 0.7)
        assert not loop.told(lambda _: 0.0, 0.15)
