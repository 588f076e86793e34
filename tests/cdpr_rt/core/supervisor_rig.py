"""The inputs of a supervisor for a cycle of two axes, and limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_rt.core.estimate import AxisEstimate
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.fault import fault_text
from cdpr_rt.core.supervisor import Limits, Supervisor

PERIOD_S = 1e-3
SAFE = Limits(
    torque_Nm=np.array([1.0, 2.0]),
    speed_rad_s=np.array([10.0, 20.0]),
    following_error_rad=np.array([0.1, 0.2]),
    torque_rate_Nm_s=1e4,
    cable_length_min_m=0.5,
    cable_length_max_m=np.array([3.0, 4.0]),
    tension_min_N=20.0,
    tension_max_N=100.0,
    slack_N=5.0,
    slack_s=0.0995,
    broken_within_s=0.02,
    missed_cycles=3,
    missed_in_window=5,
    window_cycles=50,
    stale_cycles=10,
    late_s=0.02,
)


class Cycle:
    """A cycle of two healthy axes, which tests change."""

    def __init__(self) -> None:
        self.feedback, self.estimate = AxisFeedback(2), AxisEstimate(2)
        self.setpoint, self.torque = Setpoint(2), np.zeros(2)
        for flags in (self.feedback.valid, self.feedback.alive, self.feedback.rate_ok):
            flags[:] = True
        self.estimate.elapsed_s = PERIOD_S
        self.estimate.cable_m_per_rad[:] = 0.026
        self.estimate.cable_length_m[:] = 2.0
        self.estimate.tension_N[:] = 50.0

    def check(self, supervisor: Supervisor) -> int:
        return supervisor.check(self.feedback, self.estimate, self.setpoint, self.torque)


def with_rate(rate_Nm_s: float) -> Limits:
    values = {name: getattr(SAFE, name) for name in SAFE.__dataclass_fields__}
    return Limits(**values | {"torque_rate_Nm_s": rate_Nm_s})


def reason_of(supervisor: Supervisor, names: Sequence[str] = ()) -> str:
    """Return the worst finding of the last cycle as text, or ""."""
    fault = supervisor.fault()
    return "" if fault is None else fault_text(fault, names)
