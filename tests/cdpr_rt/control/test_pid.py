"""The PID agrees with scipy's linear simulation and behaves at its limits."""

import numpy as np
from scipy import signal

from cdpr_rt.control.pid import Pid, PidGains
from cdpr_rt.core.exchange import AxisFeedback, Setpoint

PERIOD_S = 1e-3
GAINS = PidGains(0.4, 3.0, 0.006, 0.004)


def run(pid: Pid, errors: np.ndarray) -> np.ndarray:
    feedback, setpoint, torque = AxisFeedback(1), Setpoint(1), np.zeros(1)
    pid.reset()
    out = []
    for error in errors:
        setpoint.position_rad[0] = error
        pid.update(feedback, setpoint, torque)
        out.append(torque[0])
    return np.array(out)


def test_the_pid_matches_its_discrete_transfer_function() -> None:
    seed = 3
    print("seed", seed)
    errors = np.random.default_rng(seed).normal(0, 0.01, 500)
    errors[0] = 0.0
    g = GAINS
    integral = signal.lfilter([g.integral_Nm_rad_s * PERIOD_S], [1, -1], errors)
    pole = g.derivative_filter_s / (g.derivative_filter_s + PERIOD_S)
    gain = g.derivative_Nms_rad / (g.derivative_filter_s + PERIOD_S)
    slope = signal.lfilter([gain, -gain], [1, -pole], errors)
    expected = g.proportional_Nm_rad * errors + integral + slope
    got = run(Pid([g], np.array([100.0]), PERIOD_S), errors)
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-12)


def test_the_pid_saturates_without_windup() -> None:
    limit = 0.1
    pid = Pid([GAINS], np.array([limit]), PERIOD_S)
    errors = np.concatenate([np.full(5000, 1.0), np.full(50, -0.01)])
    torque = run(pid, errors)
    assert np.max(np.abs(torque)) == limit
    # five seconds at the limit must not be integrated: the torque decreases immediately
    assert torque[5001] < limit
    assert torque[5040] < 0.0


def test_compensation_counts_towards_the_limit_and_is_reported_separately() -> None:
    class Constant:
        cogging_Nm = np.zeros(1)

        def reset(self) -> None:
            pass

        def torque(self, feedback: AxisFeedback, setpoint: Setpoint, out: np.ndarray) -> None:
            out[:] = 0.05

    pid = Pid([GAINS], np.array([0.06]), PERIOD_S, Constant())
    torque = run(pid, np.full(100, 0.5))
    assert np.max(torque) == 0.06
    assert pid.compensation_Nm[0] == 0.05
