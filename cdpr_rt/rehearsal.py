"""Have every kernel of the cycle compiled before a motor is energised."""

from __future__ import annotations

import numpy as np

from cdpr_rt.compensation import Compensation
from cdpr_rt.controllers.base import Controller
from cdpr_rt.controllers.pid import Pid, PidGains
from cdpr_rt.controllers.proportional import Proportional
from cdpr_rt.exchange import AxisFeedback, Setpoint
from cdpr_rt.limits import Limits
from cdpr_rt.runtime.estimate import Estimator
from cdpr_rt.supervisor import Supervisor
from cdpr_rt.tension import TensionFeedback
from cdpr_rt.trajectory import Leg


def rehearse(n: int, period_s: float) -> None:
    """Run what a `TrackProgram` may be given, and what judges it, on n axes that are not there.

    A kernel is compiled when it is called first, which may take seconds: a cycle held up for so
    long is a silent master, and the drives stop. What is compiled already costs nothing here.
    """
    feedback, setpoint, torque, ones = AxisFeedback(n), Setpoint(n), np.zeros(n), np.ones(n)
    feedback.valid[:] = True
    gains = [PidGains(1.0, 0.0, 0.0, period_s)] * n
    controllers: tuple[Controller, ...] = (
        Proportional(ones, ones),
        Pid(gains, ones, period_s, Compensation([None] * n, period_s)),
    )
    leg = Leg(np.zeros(n), np.zeros(n), 0.0, period_s)
    for controller in controllers:
        leg.fill(0.0, setpoint)
        controller.update(feedback, setpoint, torque)
    rehearse_judgement(Estimator(n, period_s), Supervisor(Limits(1.0, 1.0, 1.0), n, period_s), n)


def rehearse_judgement(estimator: Estimator, supervisor: Supervisor, n: int) -> None:
    """Have the kernels of both compiled, which are made for n axes and are as new afterwards."""
    feedback = AxisFeedback(n)
    feedback.valid[:] = True
    estimator.update(feedback, TensionFeedback(n), inner_Nm=np.zeros(n))
    supervisor.check(feedback, estimator.estimate, Setpoint(n), np.zeros(n))
    supervisor.compare_lengths(0.0)
    estimator.reset()
    supervisor.reset()
