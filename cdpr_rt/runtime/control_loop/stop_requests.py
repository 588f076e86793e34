"""Requests by signals, outside all queues: end under control, or remove the power."""

from __future__ import annotations

from typing import Final

from cdpr_rt.core.states import CUT_SHORT, LoopState, Reaction
from cdpr_rt.runtime.control_loop.engine import Engine
from cdpr_rt.runtime.control_loop.safe_stop import SafeStop
from cdpr_rt.runtime.control_loop.transition_runner import TransitionRunner
from cdpr_rt.runtime.control_loop.transitions import Transitions

EMERGENCY_STOP: Final = "emergency stop by cdpr estop"
_NOT_LOWERED: Final = "; the platform was not let down"


class StopRequests:
    """Two flags that signal handlers set and the next turn obeys."""

    def __init__(
        self,
        engine: Engine,
        runner: TransitionRunner,
        safe_stop: SafeStop,
        transitions: Transitions,
    ) -> None:
        self._engine, self._life = engine, engine.life
        self._runner = runner
        self._safe_stop = safe_stop
        self._transitions = transitions
        self.stop = False
        """Whether the loop is to end under control."""
        self.power_off = False
        """Whether the power is to be removed at once, in any state."""
        self._stopping = False

    def poll(self) -> None:
        """Obey the requests; called every turn."""
        if self.power_off:
            self._remove_power()
        if self.stop:
            self._end()

    def _remove_power(self) -> None:
        life, state = self._life, self._life.state
        if state not in (LoopState.READY, LoopState.ACTIVE, LoopState.FAULT):
            return  # drives that boot have no power: it is latched once they are ready
        if state is LoopState.FAULT and self._runner.busy:
            return  # it may be being acknowledged
        self.power_off = False
        if self._engine.machine.read_only:
            return
        if state is LoopState.ACTIVE:
            cut_short = CUT_SHORT + (_NOT_LOWERED if self._safe_stop.lowers else "")
            life.set_reason(cut_short if self._stopping else EMERGENCY_STOP)
            self._safe_stop.stop(Reaction.TORQUE_OFF, LoopState.FAULT)
        elif state is LoopState.READY and not self._stopping:
            life.set_reason(EMERGENCY_STOP)
            self._safe_stop.enter_fault()

    def _end(self) -> None:
        if self._runner.task_running:
            return
        # again where a fault has come between
        if not self._stopping or not (self._runner.busy or self._transitions.ended):
            self._stopping = True
            self._runner.begin(self._transitions.shut_down())
