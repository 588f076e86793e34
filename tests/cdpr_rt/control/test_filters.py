"""The low-pass written out here against the library's."""

import numpy as np
from scipy.signal import butter, sosfiltfilt

from cdpr_rt.control.validation import VELOCITY_LOW_PASS_Hz, low_pass_velocity

SEED = 5


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
