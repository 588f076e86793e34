"""Warm-up: compile every kernel of the cycle before a motor is energised."""

from __future__ import annotations

import numpy as np

from cdpr_rt.control.base import Controller
from cdpr_rt.control.compensation import Compensation
from cdpr_rt.control.pid import Pid, PidGains, Proportional
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint, TensionFeedback
from cdpr_rt.core.supervisor import Limits, Supervisor
from cdpr_rt.motion.trajectory import TrapezoidalMove


def warm_up(n: int, period_s: float) -> None:
    """Run the controllers of a `TrackProgram`, estimator and supervisor on n imaginary axes.

    The first call of a kernel compiles it, which may take seconds. The drives would stop if the
    master were silent for so long.
    """
    feedback, setpoint, torque, ones = AxisFeedback(n), Setpoint(n), np.zeros(n), np.ones(n)
    feedback.valid[:] = True
    gains = [PidGains(1.0, 0.0, 0.0, period_s)] * n
    controllers: tuple[Controller, ...] = (
        Proportional(ones, ones),
        Pid(gains, ones, period_s, Compensation([None] * n, period_s)),
    )
    leg = TrapezoidalMove(np.zeros(n), np.zeros(n), 0.0, period_s)
    for controller in controllers:
        leg.fill(0.0, setpoint)
        controller.update(feedback, setpoint, torque)
    supervisor = Supervisor(Limits(1.0, 1.0, 1.0, missed_cycles=0), n, period_s)
    warm_up_supervision(Estimator(n, period_s), supervisor, n)


def warm_up_supervision(estimator: Estimator, supervisor: Supervisor, n: int) -> None:
    """Compile the kernels of estimator and supervisor for n axes; reset both afterwards."""
    feedback = AxisFeedback(n)
    feedback.valid[:] = True
    estimator.update(feedback, TensionFeedback(n), motor_loss_Nm=np.zeros(n))
    supervisor.check(feedback, estimator.estimate, Setpoint(n), np.zeros(n))
    supervisor.compare_lengths(0.0, 0.0, -1)
    estimator.reset()
    supervisor.reset()
