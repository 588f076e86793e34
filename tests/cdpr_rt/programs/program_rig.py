"""Three axes with friction and load, run by programs, and a sender of set-points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.control.compensation import AxisCompensation, FrictionFeedforward
from cdpr_rt.control.tuning import sweep_gain
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.shared_block import SAMPLE, SharedBlock
from cdpr_rt.programs.base import Program
from cdpr_rt.programs.model import AxesModel, position_loop
from cdpr_rt.programs.registry import build_programs

N = 3
PERIOD_S = 1e-3
LATENCY_S = 2.3e-3
INERTIA_kg_m2 = 1.13e-4
COULOMB_Nm = 0.03
COUNT_RAD = 2.0 * np.pi / 8192


def rig_model() -> AxesModel:
    """Axes that differ in all their bounds; the last one's friction is known."""
    gains = position_loop(INERTIA_kg_m2, LATENCY_S, PERIOD_S).gains
    friction = FrictionFeedforward(COULOMB_Nm, COULOMB_Nm)
    return AxesModel(
        period_s=PERIOD_S,
        torque_Nm=np.array([3.0, 2.0, 1.0]),
        speed_rad_s=np.array([40.0, 30.0, 50.0]),
        acceleration_rad_s2=np.array([80.0, 50.0, 100.0]),
        cable_m_per_rad=np.array([0.026, -0.026, 0.05]),
        gains=(gains,) * N,
        sweep_gain_Nm_rad=np.full(N, sweep_gain(INERTIA_kg_m2, LATENCY_S)),
        compensation=(None, None, AxisCompensation(np.zeros((2, 8)), friction, most_Nm=10.0)),
    )


class ProgramRig:
    """Runs programs one after the other as the loop does, on simulated rotors, with a history."""

    def __init__(self, load_Nm: tuple[float, ...] = (0.0, 0.2, -0.1)) -> None:
        self.model = rig_model()
        self.block = SharedBlock.create(N, 1.0, 1000.0)
        self.programs = build_programs(self.model, self.block)
        self.feedback, self.setpoint = AxisFeedback(N), Setpoint(N)
        self.feedback.index_known[:] = True
        self.torque = np.zeros(N)
        self.load_Nm = np.array(load_Nm)
        self.angle, self.speed, self._acting = np.zeros((3, N))
        self.history: dict[str, list[Any]] = {
            name: [] for name in ("position", "velocity", "angle", "torque", "program", "effort")
        }
        self.sample = np.zeros((), SAMPLE)
        self.sample["quaternion"], self.sample["session"] = (1.0, 0.0, 0.0, 0.0), 1
        self.program: Program = self.programs["idle"]
        self.switch("idle")

    def switch(self, name: str, wanted: Mapping[str, Any] | None = None) -> Program:
        self.program = self.programs[name]
        self.program.start(self.feedback, self.setpoint, self.torque)
        if wanted is not None:
            self.program.command(wanted)
        return self.program

    def cycle(self) -> None:
        self.feedback.cycle += 1
        self.feedback.position_rad[:] = np.round(self.angle / COUNT_RAD) * COUNT_RAD
        self.program.update(self.feedback, self.setpoint, self.torque)
        self._keep()
        # a torque acts one cycle later, against friction, until the next one
        force = self._acting + self.load_Nm - COULOMB_Nm * np.tanh(self.speed / 0.05)
        self.speed += force / INERTIA_kg_m2 * PERIOD_S
        self.angle += self.speed * PERIOD_S
        self._acting = self.torque.copy()

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD_S)):
            self.cycle()

    def send(self, position_m: tuple[float, float, float], scale: float = 1.0) -> None:
        """Post a sample of the stream, sent now."""
        sample = self.sample
        sample["sequence"] += np.uint64(1)
        sample["sent_ns"] = round(self.feedback.cycle * PERIOD_S * 1e9)
        sample["position_m"], sample["scale"] = position_m, scale
        self.block.post_sample(sample)

    def array(self, name: str) -> np.ndarray:
        """Return the history of a quantity, (k, n), or of the programs' names, (k,)."""
        return np.array(self.history[name])

    def _keep(self) -> None:
        kept = {
            "position": self.setpoint.position_rad.copy(),
            "velocity": self.setpoint.velocity_rad_s.copy(),
            "angle": self.feedback.position_rad.copy(),
            "torque": self.torque.copy(),
            "program": self.program.name,
            "effort": self.program.controller.effort_Nm.copy(),
        }
        for name, value in kept.items():
            self.history[name].append(value)
