"""The warm-up compiles every kernel of the cycle."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from cdpr_rt.control.compensation import AxisCompensation, Compensation
from cdpr_rt.control.pid import Pid, PidGains, Proportional
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint, TensionFeedback
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervisor import Limits, Supervisor
from cdpr_rt.loop.warm_up import warm_up
from cdpr_rt.motion.trajectory import TrapezoidalMove

CYCLE = (
    *("control.compensation", "control.pid"),
    *("core.estimate", "core.supervisor", "motion.trajectory"),
)


def compiled() -> dict[str, int]:
    """Return how many variants of each kernel of the cycle are compiled."""
    return {
        f"{name}.{key}": len(value.signatures)
        for name in CYCLE
        for key, value in vars(sys.modules[f"cdpr_rt.{name}"]).items()
        if isinstance(value, Dispatcher)
    }


@pytest.mark.parametrize("n", [1, 8])
def test_the_cycle_compiles_nothing_after_the_warm_up(n: int) -> None:
    warm_up(n, 1e-3)
    before = compiled()
    # a kernel that only other kernels call has no compiled variant
    for name in CYCLE:
        assert max(count for key, count in before.items() if key.startswith(f"{name}.")) > 0

    # rows of larger arrays, as devices use them
    rows, flags = np.zeros((5, n)), np.ones((2, n), bool)
    feedback, setpoint = AxisFeedback(n), Setpoint(n)
    feedback.position_rad, feedback.torque_Nm, feedback.index_rad = rows[0], rows[1], rows[2]
    feedback.valid, feedback.index_known = flags[0], flags[1]
    feedback.statusword = np.zeros((1, n), np.uint16)[0]
    torque = rows[3]
    known = AxisCompensation(np.zeros((2, 720)), look_ahead_s=1e-3, most_Nm=10.0)
    limit = np.full(n, 0.75)
    pid = Pid([PidGains(1.0, 1.0, 0.1, 1e-3)] * n, limit, 1e-3, Compensation([known] * n, 1e-3))
    read = TensionFeedback(n)
    read.valid[:] = True
    supervisor, estimator = Supervisor(Limits(3.0, 100.0, 6.0, 3), n, 1e-3), Estimator(n, 1e-3)
    for controller in (Proportional(np.full(n, 2.0), limit), pid):
        controller.reset()
        TrapezoidalMove(rows[0], np.full(n, 0.05), 3.0, 0.5).fill(0.7, setpoint)
        controller.update(feedback, setpoint, torque)
        estimator.update(feedback, read)
        assert supervisor.check(feedback, estimator.estimate, setpoint, torque) == Reaction.NONE
    assert compiled() == before
