"""Commissioning of one winch's motor, step by step: measure, identify, measure again, validate."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_rt.compensation import AxisCompensation, Compensation
from cdpr_rt.controllers.pid import Pid
from cdpr_rt.controllers.proportional import Proportional
from cdpr_rt.measurement import Pass, both_ways, run_pass
from cdpr_rt.tuning import PidDesign, design_pid, sweep_gain
from tools.output import Output
from tools.session import WinchSession

METHODS = ("none", "thesis", "better")
BANDWIDTHS_HZ = (3.0, 5.0, 8.0, 10.0, 15.0, 25.0)
DEFAULT_BANDWIDTH_HZ = 8.0

_SWEEP_SPEED_RAD_S = math.radians(3.0)
_SWEEP_TURNS = 2
# the rotor trails the set-point by friction over gain; both directions' trail fits in here
_SWEEP_LEAD_IN_RAD = math.radians(30.0)
_VALIDATION_SPEED_RAD_S = math.radians(22.0)


@dataclass(frozen=True)
class Paths:
    """Where a commissioning leaves its files."""

    out: Path

    def raw(self, name: str) -> Path:
        """Return the file of one recorded pass."""
        return self.out / "raw" / f"{name}.raw"

    @property
    def profile(self) -> Path:
        """Return the file of the cogging profile."""
        return self.out / "cogging-profile.json"

    @property
    def truth(self) -> Path:
        """Return the simulator's own log, which only the report reads."""
        return self.out / "raw" / "simulator-truth.log"


class Measurement:
    """Runs passes of one winch and keeps what is common to them."""

    def __init__(self, session: WinchSession, out: Output, paths: Paths) -> None:
        self._session = session
        self._out = out
        self._paths = paths
        motor = session.winch.motor
        # an unloaded rotor needs little: enough for any cogging, too little to do harm
        self._limit_Nm = np.full(session.device.n, 0.25 * motor.rated_torque_Nm)

    def sweep(self, inertia_kg_m2: float) -> list[Path]:
        """Sweep both directions slowly under the proportional controller (Tremblay, 1.3, 1.4)."""
        gain = sweep_gain(inertia_kg_m2, self._session.latency_s)
        controller = Proportional(np.full(self._session.device.n, gain), self._limit_Nm)
        passes = both_ways(_SWEEP_SPEED_RAD_S, _SWEEP_LEAD_IN_RAD, _SWEEP_TURNS)
        meta = {"what": "sweep", "gain_Nm_rad": gain}
        return self._run(controller, "sweep", passes, meta)

    def track(
        self,
        name: str,
        design: PidDesign,
        compensation: AxisCompensation | None,
        passes: Sequence[Pass],
        meta: dict[str, Any],
    ) -> list[Path]:
        """Follow ramps under the PID, with or without compensation (Tremblay, 1.5)."""
        device = self._session.device
        known = Compensation([compensation], device.period_s) if compensation else None
        controller = Pid([design.gains], self._limit_Nm, device.period_s, known)
        return self._run(controller, name, passes, {**meta, "gains": vars(design.gains)})
