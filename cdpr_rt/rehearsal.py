"""Have every kernel of the cycle compiled before a motor is energised."""

from __future__ import annotations

import numpy as np

from cdpr_rt.clock import LockstepClock
from cdpr_rt.compensation import Compensation
from cdpr_rt.controllers.base import Controller
from cdpr_rt.controllers.pid import Pid, PidGains
from cdpr_rt.controllers.proportional import Proportional
from cdpr_rt.exchange import AxisCommand, AxisFeedback
from cdpr_rt.executive import Executive
from cdpr_rt.runtime.estimate import Estimator
from cdpr_rt.supervisor import Limits, Supervisor
from cdpr_rt.tension import TensionFeedback
from cdpr_rt.trajectory import Leg


class _StandIn:
    """A device of n axes that stand still and do what they are told at once."""

    lockstep = True

    def __init__(self, n: int, period_s: float) -> None:
        self.n = n
        self.period_s = period_s
        self.clock = LockstepClock()
        self.feedback = AxisFeedback(n)
        self.command = AxisCommand(n)

    def sync(self) -> None:
        self.feedback.cycle += 1

    def receive(self) -> int:
        self.feedback.valid[:] = True
        return self.n

    def transmit(self) -> None:
        self.command.sent_torque_Nm[:] = self.command.torque_Nm

    def alarm(self) -> str:
        return ""


def rehearse(n: int, period_s: float) -> None:
    """Run each controller for some cycles on n axes that are not there.

    A kernel is compiled when it is called first, which may take seconds: a cycle held up for so
    long is a silent master, and the drives stop. What is compiled already costs nothing here.
    """
    executive = Executive(
        _StandIn(n, period_s), Supervisor(Limits(1.0, 1.0, 1.0), n, period_s), lambda: False
    )
    ones, still = np.ones(n), np.zeros(n)
    gains = [PidGains(1.0, 0.0, 0.0, period_s)] * n
    controllers: tuple[Controller, ...] = (
        Proportional(ones, ones),
        Pid(gains, ones, period_s, Compensation([None] * n, period_s)),
    )
    for controller in controllers:
        executive.run(controller, Leg(still, still, 0.0, period_s))
    Estimator(n, period_s).update(executive.device.feedback, TensionFeedback(n))
