"""A loop and its operator on two free inertias in place of a machine, without a bus."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.control.pid import Proportional
from cdpr_rt.core.clock import Clock, LockstepClock, PacedClock
from cdpr_rt.core.cycle import Watch
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisCommand, AxisFeedback
from cdpr_rt.core.fault import BUS_LOST, Fault
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervisor import Limits, Supervisor
from cdpr_rt.identification.rawlog import RawLogWriter, column_names
from cdpr_rt.loop.engine import LoopParts
from cdpr_rt.loop.loop import ControlLoop
from cdpr_rt.loop.operating import Operator
from cdpr_rt.motion.trajectory import TrapezoidalMove
from cdpr_rt.programs.idle import ZeroTorqueProgram
from cdpr_rt.programs.track import TrackProgram

INERTIA, DAMPING, PERIOD_S = 1e-3, 0.05, 1e-3
_OFF = (Limit.SPEED, Limit.FOLLOWING_ERROR, Limit.MISSED, Limit.NOT_FINITE, Limit.DRIVE)
LIMITS = Limits(
    torque_Nm=1.0,
    speed_rad_s=50.0,
    following_error_rad=2.0,
    missed_cycles=3,
    reactions=dict.fromkeys(_OFF, Reaction.TORQUE_OFF),
)


class Inertias:
    """Two damped inertias; torque written in one cycle acts from the next SYNC on."""

    n, period_s, commands_s = 2, PERIOD_S, 0.0

    def __init__(self, lockstep: bool = True) -> None:
        self.lockstep = lockstep
        self.clock: Clock = LockstepClock() if lockstep else PacedClock()
        self.feedback = AxisFeedback(2)
        self.command = AxisCommand(2)
        self.silent: set[int] = set()
        self.alarm_at = -1
        self.speed = np.zeros(2)
        self.angle = np.zeros(2)
        self.pending = np.zeros(2)
        self.in_force = np.zeros(2)

    def sync(self) -> None:
        self.speed += self.period_s * (self.in_force - DAMPING * self.speed) / INERTIA
        self.angle += self.period_s * self.speed
        self.in_force = self.pending.copy()
        self.feedback.cycle += 1

    def receive(self) -> int:
        answers = self.feedback.cycle not in self.silent
        self.feedback.valid[:] = self.feedback.alive[:] = self.feedback.rate_ok[:] = answers
        if answers:
            self.feedback.position_rad[:] = self.angle
        return 2 if answers else 0

    def transmit(self, _and_sync: bool = False) -> None:
        self.pending = self.command.torque_Nm.copy()
        self.command.sent_torque_Nm[:] = self.command.torque_Nm

    def faults(self) -> Sequence[Fault]:
        alarmed = self.feedback.cycle == self.alarm_at
        return (Fault(Limit.DRIVE, 0, BUS_LOST, detail="told to stop"),) if alarmed else ()


class Bench:
    """Implements `Machine` over one device whose drives obey immediately."""

    failures: tuple[type[Exception], ...] = (ConnectionError,)
    read_only = has_brakes = False
    notices: Sequence[str] = ()
    safety = ""

    def __init__(self, device: Inertias) -> None:
        self.device: Inertias | None = device
        self.clock = device.clock
        self.watches: Sequence[Watch] = ()
        self.power = False

    def power_on(self) -> None:
        self.power = True

    def power_off(self) -> None:
        self.power = False

    def powered(self) -> bool:
        return self.power

    def unpowered(self) -> bool:
        return not self.power

    def explain(self) -> Sequence[Fault]:
        return ()

    def states(self) -> list[str]:
        return []

    def prepared(self) -> bool:
        return True

    intact = faultless = prepared
    quick_stop = power_off

    def brakes_are(self, _released: bool) -> bool:
        return True

    def set_brakes(self, _released: bool) -> None:
        """Do nothing: there are no brakes."""

    def nothing(self) -> str:
        return ""

    open = prepare = acknowledge = pause = confirm_power_off = close = reset_faults = nothing
    read_tension = unprepared = switch_off_lost = nothing

    def bus_state(self) -> dict[str, Any]:
        return {}

    def heartbeat_age_s(self) -> list[float]:
        return []


class Rig:
    """An operator whose drives have power."""

    def __init__(self, device: Inertias, *watches: Watch) -> None:
        self.device = device
        self.stop: Callable[[], bool] = lambda: False
        self.machine = Bench(device)
        self.machine.watches = watches
        self.machine.read_tension = lambda: None  # type: ignore[method-assign, assignment, return-value]
        track, limp = TrackProgram(2, PERIOD_S), ZeroTorqueProgram(2)
        programs = {"idle": limp, "hold": limp, "track": track}
        self.supervisor = Supervisor(LIMITS, 2, PERIOD_S)
        parts = LoopParts(programs, self.supervisor, Estimator(2, PERIOD_S))
        self.block = SharedBlock.create(2, 0.2, 1.0 / PERIOD_S)
        self.loop = ControlLoop(self.block, self.machine, parts)  # type: ignore[arg-type]
        self.operator = Operator(self.loop, track, self.loop.turn, self._asked)
        self.operator.check()
        self.operator.enable()
        self.began = device.feedback.cycle
        """The last cycle before the motion of the test."""

    def _asked(self) -> bool:
        return self.stop()

    @property
    def cycle(self) -> int:
        """Cycles since power was switched on."""
        return self.device.feedback.cycle - self.began

    def follow(self, motion: Any = None, by: Any = None, log: Any = None) -> None:
        self.operator.follow(by or controller(), motion or leg(), log)


@contextmanager
def powered(device: Inertias | None = None, *watches: Watch) -> Iterator[Rig]:
    rig = Rig(device or Inertias(), *watches)
    try:
        yield rig
    finally:
        os.close(rig.block.fd)


def controller() -> Proportional:
    return Proportional(np.full(2, 1.0), np.full(2, 0.5))


def leg() -> TrapezoidalMove:
    return TrapezoidalMove(np.zeros(2), np.array([1.0, -1.0]), 0.5, 0.1)


def log(path: Path) -> RawLogWriter:
    return RawLogWriter(path, column_names(2), {"axes": 2})
