"""What is asked of the loop from outside all queues, by signals: to end, or to take the power."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cdpr_rt.runtime import procedures
from cdpr_rt.runtime.states import LoopState, Reaction

if TYPE_CHECKING:
    from cdpr_rt.runtime.loop import ControlLoop

EMERGENCY_STOP: Final = "emergency stop by cdpr estop"
CUT_SHORT: Final = "the power was taken at once while the loop was ending"
_NOT_LOWERED: Final = "; the platform was not let down"


class StopRequests:
    """Two flags that signal handlers set, and what the loop does about them in its next turn."""

    def __init__(self, loop: ControlLoop) -> None:
        self._loop = loop
        self.stop = False
        """Whether the loop is to end under control."""
        self.power_off = False
        """Whether the power is to be taken at once, whatever goes on."""
        self._stopping = False

    def watch(self) -> None:
        """Do what is asked; called every turn."""
        if self.power_off:
            self._take_power()
        if self.stop:
            self._end()

    def _take_power(self) -> None:
        loop = self._loop
        state = loop.life.state
        if state not in (LoopState.READY, LoopState.ACTIVE, LoopState.FAULT):
            return  # drives that boot have no power: it is latched once they are ready
        if state is LoopState.FAULT and loop.busy:
            return  # it may be being acknowledged
        self.power_off = False
        if loop.machine.read_only:
            return
        if state is LoopState.ACTIVE:
            cut_short = CUT_SHORT + (_NOT_LOWERED if loop.lowers else "")
            loop.life.blame(cut_short if self._stopping else EMERGENCY_STOP)
            loop.stop(Reaction.TORQUE_OFF, LoopState.FAULT)
        elif state is LoopState.READY and not self._stopping:
            loop.life.blame(EMERGENCY_STOP)
            loop.begin(procedures.fall(loop))

    def _end(self) -> None:
        loop = self._loop
        if loop.works_slowly:
            return
        # again where something worse has come between
        if not self._stopping or not (loop.busy or loop.ended):
            self._stopping = True
            loop.begin(procedures.shut_down(loop))
