"""Winches that the loop swings are reported; motion, decaying swings and noise are not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cdpr_rt.platform.oscillation import Oscillation

PERIOD_S, THRESHOLD_m = 1e-3, 4e-4
M_PER_RAD = np.array([0.01, -0.01, 0.02])
MUCH_m = 1.5 * THRESHOLD_m
STANDS_rad = 700.0

Wave = Callable[[float], float]


class Winches:
    """Three winches; the second one swings."""

    def __init__(self) -> None:
        self.position_rad, self.velocity = np.full(3, STANDS_rad), np.zeros(2)
        self.setpoint_rad = self.position_rad + 0.3
        self.watch = Oscillation(
            ["one", "two", "three"], np.full((2, 3), THRESHOLD_m) * [[1.0], [3.0]], M_PER_RAD,
            self.position_rad, self.velocity, PERIOD_S,
        )  # fmt: skip
        self.cycle = 0
        self.moved()

    def moved(self) -> None:
        self.velocity[1] = 0.2
        self.watch.update(self.setpoint_rad)
        self.velocity[1] = 0.0

    def told(self, swing_m: Wave, seconds: float) -> str:
        for _ in range(round(seconds / PERIOD_S)):
            swing_rad = swing_m(self.cycle * PERIOD_S) / abs(M_PER_RAD[1])
            self.position_rad[1] = STANDS_rad + swing_rad
            self.cycle += 1
            self.watch.update(self.setpoint_rad)
        return self.watch.trouble


def sine(frequency_Hz: float, amplitude_m: float, mean_m: float = 0.0) -> Wave:
    return lambda t: float(mean_m + amplitude_m * np.sin(2.0 * np.pi * frequency_Hz * t))


@pytest.mark.parametrize("frequency_Hz", [6.0, 13.0, 80.0, 120.0])
@pytest.mark.parametrize("mean_m", [0.0, -0.003])
def test_oscillation_longer_than_three_seconds_is_reported(
    frequency_Hz: float, mean_m: float
) -> None:
    winches = Winches()
    wave = sine(frequency_Hz, MUCH_m, mean_m)
    assert not winches.told(wave, 2.9)
    told = winches.told(wave, 1.4)
    assert told.startswith("two: the control loop oscillates at this winch: for 3 s at ")
    assert "by more than 0.40 mm of cable to either side" in told
    told_Hz = float(told.split(" at ")[2].split(" Hz")[0])
    assert abs(told_Hz - frequency_Hz) <= max(1.0, 0.03 * frequency_Hz)
    assert winches.told(lambda _: 0.0, 5.0) == told, "the report stays until it is cleared"
    winches.watch.clear()
    winches.moved()
    assert not winches.told(wave, 2.9)
    assert winches.told(wave, 1.4)


def test_the_winch_that_swings_furthest_is_named() -> None:
    winches = Winches()
    for k in range(4000):
        turn = np.sin(2.0 * np.pi * 20.0 * k * PERIOD_S)
        winches.position_rad[:] = STANDS_rad + np.array([0.05, 0.2, 0.04]) * turn
        winches.watch.update(winches.setpoint_rad)
    assert winches.watch.trouble.startswith("two: ")


@pytest.mark.parametrize(("share", "told"), [(1.5, False), (2.9, False), (4.5, True)])
def test_the_threshold_in_motion_is_three_times_that_at_rest(share: float, told: bool) -> None:
    winches = Winches()
    wave = sine(20.0, share * THRESHOLD_m)
    way_rad = 0.0
    for _ in range(1400):
        winches.velocity[0] = 0.2
        way_rad += 5.0 * PERIOD_S
        winches.setpoint_rad[:] = STANDS_rad + 0.3 + way_rad
        winches.told(lambda t: wave(t) + 0.01 * way_rad, PERIOD_S)  # noqa: B023  # in this cycle
    assert bool(winches.watch.trouble) is told
    if told:
        assert "for 1 s at 20 Hz by more than 1.20 mm" in winches.watch.trouble


@pytest.mark.parametrize(
    "swing_m",
    [
        sine(80.0, 0.9 * THRESHOLD_m),
        sine(2.0, 3.0 * MUCH_m),
        lambda t: MUCH_m * (1.0 if t % 1.0 < 0.5 else -1.0),
        lambda t: 4.0 * MUCH_m * np.exp(-1.2 * (t % 5.0)) * np.sin(2.0 * np.pi * 20.0 * t),
        lambda t: 3.0 * MUCH_m if t > 0.5 else 0.0,
    ],
    ids=["little", "slow", "there and back", "rings out", "leans on"],
)
def test_small_slow_and_decaying_swings_are_not_reported(swing_m: Wave) -> None:
    assert not Winches().told(swing_m, 10.0)


def test_a_pause_restarts_the_time_of_a_swing() -> None:
    winches = Winches()
    for _ in range(5):
        assert not winches.told(sine(40.0, MUCH_m), 2.5)
        assert not winches.told(lambda _: 0.0, 0.4)


def test_encoder_noise_is_not_reported() -> None:
    winches, chance = Winches(), np.random.default_rng(7)
    count_m = THRESHOLD_m / 4.0  # the smallest threshold
    noise_m = count_m * np.round(chance.normal(0.3, 0.6, 20_000))
    assert not winches.told(lambda t: float(noise_m[round(t / PERIOD_S)]), 19.0)
