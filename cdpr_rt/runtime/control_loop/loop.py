"""The control loop: one turn after the other, in every state of the robot."""

from __future__ import annotations

import time
from collections.abc import Callable

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.runtime.control_loop.command_dispatcher import CommandDispatcher
from cdpr_rt.runtime.control_loop.engine import TURN_S, Engine
from cdpr_rt.runtime.control_loop.fault_detection import FaultDetection
from cdpr_rt.runtime.control_loop.loop_parts import LoopParts
from cdpr_rt.runtime.control_loop.safe_stop import SafeStop
from cdpr_rt.runtime.control_loop.status import StatusPage
from cdpr_rt.runtime.control_loop.stop_requests import StopRequests
from cdpr_rt.runtime.control_loop.transition_runner import TransitionRunner
from cdpr_rt.runtime.control_loop.transitions import Transitions
from cdpr_rt.runtime.machine import Machine


class ControlLoop:
    """Runs the machine's axes until it is told to end; shares nothing but `block`.

    Commands are taken after the cycle's torques have been sent. A transition is advanced once a
    turn, and so are tasks, which wait for answers on a bus. By `clock_ns` the right to move expires
    and the status is renewed.
    """

    def __init__(
        self,
        block: SharedBlock,
        machine: Machine,
        parts: LoopParts,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.engine = engine = Engine(block, machine, parts, clock_ns)
        self.runner = runner = TransitionRunner(engine)
        self.safe_stop = safe_stop = SafeStop(engine, runner)
        self.transitions = transitions = Transitions(engine, runner, safe_stop)
        self.life = engine.life
        self.status = StatusPage(engine, runner, transitions, clock_ns)
        self._judge = FaultDetection(engine, safe_stop).judge
        self._requests = StopRequests(engine, runner, safe_stop, transitions)
        self._commands = CommandDispatcher(engine, runner, transitions, self.request_stop)
        self._alive = block.counters["loop_alive_ns"].data

    @property
    def busy(self) -> bool:
        """Whether a transition is in progress."""
        return self.runner.busy

    @property
    def ended(self) -> bool:
        """Whether it has been shut down."""
        return self.transitions.ended

    def run(self) -> None:
        """Boot, check, then turn until told to end; the drives have no power afterwards."""
        try:
            self.runner.begin(self.transitions.start_up())
            while not self.ended:
                self.turn()
        finally:
            self.runner.cancel()
            self.engine.machine.close()
            self.status.publish()

    def turn(self) -> None:
        """Run one cycle, or sleep; then stop requests, commands, transition, status and replies."""
        self._alive[0] = time.monotonic_ns()
        engine = self.engine
        if engine.cycling:
            engine.run_cycle(self._judge)
            engine.machine.clock.run_tasks()
        else:
            engine.machine.clock.sleep(TURN_S)
        self._requests.poll()
        self._commands.poll()
        try:
            self.runner.advance()
        except Exception as mistake:
            self.safe_stop.remove_power(mistake)
        self.status.update()
        self._commands.send_replies()

    def request_stop(self) -> None:
        """Have the loop end under control. For signal handlers."""
        self._requests.stop = True

    def request_power_off(self) -> None:
        """Have the power removed at once in any state. For signal handlers."""
        self._requests.power_off = True
