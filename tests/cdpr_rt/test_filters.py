"""The two filters written out here against the library's."""

import numpy as np
from scipy.signal import butter, savgol_filter, sosfiltfilt

from cdpr_rt.identification.thesis import savitzky_golay
from cdpr_rt.validation import VELOCITY_LOW_PASS_Hz, low_pass_velocity

SEED = 5


def test_savitzky_golay_is_the_librarys() -> None:
    print("seed", SEED)
    curves = np.random.default_rng(SEED).normal(size=(2, 400))
    expected = savgol_filter(curves, 51, 2, axis=1, mode="wrap")
    np.testing.assert_allclose(savitzky_golay(curves, 51), expected, atol=1e-12)


def test_velocity_low_pass_is_a_butterworth_run_both_ways() -> None:
    print("seed", SEED)
    period = 1e-3
    angle = np.cumsum(np.random.default_rng(SEED).normal(size=4000)) * 1e-4
    sections = butter(2, VELOCITY_LOW_PASS_Hz, fs=1 / period, output="sos")
    expected = sosfiltfilt(sections, np.gradient(angle, period))
    got = low_pass_velocity(angle, period)
    inner = slice(100, -100)
    scale = np.std(expected[inner])
    # the bilinear transform bends the sampled filter's frequencies a little
    assert np.std(got[inner] - expected[inner]) < 0.01 * scale
    ramp = np.arange(1000) * 0.3 * period
    np.testing.assert_allclose(low_pass_velocity(ramp, period), 0.3, rtol=1e-9)
