"""The control loop: it makes one turn after the other, in every state of the robot."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, Final

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle import Cycle
from cdpr_rt.core.fault import PROGRAM, Fault, fault_record
from cdpr_rt.core.shared_block import SharedBlock, SharedBlockError
from cdpr_rt.core.states import CUT_SHORT, EMERGENCY_STOP, LoopState, Reaction
from cdpr_rt.loop.command_dispatcher import CommandDispatcher
from cdpr_rt.loop.engine import TURN_S, Engine, LoopParts, TransitionRunner
from cdpr_rt.loop.machine import Machine
from cdpr_rt.loop.safe_stop import SafeStop
from cdpr_rt.loop.stop_socket import StopSocket
from cdpr_rt.loop.transitions import Transitions

# The loop's status, published when it changes.

_CHECK_NS = 500_000_000
# a character may take a dozen bytes in JSON
_MOST_TEXT = 500
_AFTERWARDS = ("hold", "idle")
"""Programs that run after another program has ended."""


_PACE_NS = 3_000_000_000


class SimulationPace:
    """Ratio of bus time to wall-clock time, over the last three to six seconds."""

    def __init__(self) -> None:
        self._marks: list[tuple[int, float]] = []
        """Up to two pairs of wall-clock and bus time, at least three seconds apart."""

    def factor(self, wall_ns: int, bus_s: float) -> float | None:
        """Return the real-time factor, rounded; None until it has been measured."""
        if self._marks and bus_s < self._marks[-1][1]:  # a new simulator has started
            self._marks = []
        if not self._marks or wall_ns - self._marks[-1][0] >= _PACE_NS:
            self._marks = [*self._marks[-1:], (wall_ns, bus_s)]
        began_ns, began_s = self._marks[0]
        if wall_ns - began_ns < _PACE_NS:
            return None
        return round(1e9 * (bus_s - began_s) / (wall_ns - began_ns), 2)


class StatusPage:
    """Writes the status into the shared memory, at every change of state and twice a second."""

    def __init__(
        self,
        engine: Engine,
        runner: TransitionRunner,
        transitions: Transitions,
        clock_ns: Callable[[], int],
        stops: StopSocket | None,
    ) -> None:
        self._stops = stops
        self._engine, self._life = engine, engine.life
        self._runner = runner
        self._transitions = transitions
        self._clock_ns = clock_ns
        self._checked_ns = 0
        self._written: dict[str, Any] = {}
        self._pace = SimulationPace()
        self._failure = ""
        """Program that failed last and the reason, until another program moves the robot."""

    def update(self) -> None:
        """Publish the status if it has changed; called every turn."""
        now_ns = self._clock_ns()
        if self._life.changed or now_ns - self._checked_ns > _CHECK_NS:
            self._life.changed = False
            self._checked_ns = now_ns
            self.publish()

    def publish(self) -> None:
        """Write the status if it differs from the last one."""
        status = self.present()
        if status == self._written:
            return
        try:
            self._engine.block.write_status(status)
        except (SharedBlockError, TypeError, ValueError):  # the progress of the program is too long
            self._publish_short(status)
        self._written = status

    def _publish_short(self, status: Mapping[str, Any]) -> None:
        """Write only the parts that are always short; if that fails, readers keep the last status.

        A status that cannot be published must not end the loop.
        """
        less: dict[str, Any] = {
            "program_progress": {},
            "failure": str(status["failure"])[:_MOST_TEXT],
            "buses": {},
            "notices": [],
            "check": {},
            "reason": str(status["reason"])[:_MOST_TEXT],
            "reason_limit": None,
            "faults": [],
            "safety": str(status["safety"])[:_MOST_TEXT],
        }
        with suppress(SharedBlockError, TypeError, ValueError):
            self._engine.block.write_status({**status, **less})

    def _progress(self) -> dict[str, Any]:
        try:
            return dict(self._engine.program.progress())
        except Exception as error:  # this must not end a motion either
            return {"error": f"{type(error).__name__}: {error}"}

    def _note_failure(self, progress: Mapping[str, Any]) -> None:
        """Store why a program fails, because its client then ends it and its progress is lost."""
        name, trouble = self._engine.program.name, progress.get("trouble")
        if trouble and progress.get("done") != 1.0:
            self._failure = f"{name}: {trouble}"
        elif name not in _AFTERWARDS:
            self._failure = ""

    def present(self) -> dict[str, Any]:
        """Return the present status."""
        engine, life = self._engine, self._life
        progress = self._progress()
        self._note_failure(progress)
        lateness = None if engine.cycle is None else engine.cycle.lateness
        last = engine.parts.last_stop
        lockstep = engine.cycle is not None and engine.cycle.device.lockstep
        bus_s = engine.machine.clock.now_s
        return {
            "state": life.state.label,
            "since_ns": life.since_ns,
            "reason": life.reason,
            "reason_limit": life.reason_limit,
            "faults": [fault_record(fault, life.axis_names) for fault in life.faults.values()],
            "program": engine.program.name,
            "program_number": engine.program_number,
            "commanded": engine.commanded,
            "program_progress": progress,
            "failure": self._failure,
            "last_stop": last and {"fallen": last.fallen, "broken": list(last.broken.values())},
            "driving": engine.driving,
            "reacting": engine.reacting.label,
            "busy": self._runner.busy,
            "released": self._transitions.released,
            "read_only": engine.machine.read_only,
            "lockstep": lockstep,
            "real_time_factor": self._pace.factor(self._clock_ns(), bus_s) if lockstep else None,
            "notices": [
                *(f"also: {life.text(fault)}" for fault in life.further),
                *map(life.text, engine.parts.supervisor.peaks()),
                *engine.notices,
                *engine.parts.notices(),
                *engine.machine.notices,
            ],
            "safety": engine.machine.safety,
            "buses": engine.machine.bus_state(),
            "check": self._transitions.check_result,
            "stops": {} if self._stops is None else self._stops.figures(),
            "count": {
                "missed": engine.missed,
                "cycles": 0 if engine.cycle is None else engine.cycle.device.feedback.cycle,
                "late": 0 if lateness is None else lateness.late,
                "worst_late_s": 0.0 if lateness is None else lateness.worst_s,
                "heartbeat_age_s": engine.machine.heartbeat_age_s() if engine.cycling else [],
            },
        }


_NOT_LOWERED: Final = "; the platform was not lowered"


class ControlLoop:
    """Runs the machine's axes until it is shut down; shares only `block` with other processes.

    In each cycle it checks torque, drives and safety I/O, and `SafeStop` reacts. Commands are taken
    after the cycle's torques have been sent. Each turn advances a transition and the tasks, which
    wait for answers on a bus. The expiry of the right to move and the period of the status follow
    `clock_ns`, by default CLOCK_MONOTONIC. `stops` is the socket through which local clients
    request a stop.
    """

    def __init__(
        self,
        block: SharedBlock,
        machine: Machine,
        parts: LoopParts,
        clock_ns: Callable[[], int] | None = None,
        stops: StopSocket | None = None,
    ) -> None:
        clock_ns = clock_ns or time.monotonic_ns
        self.engine = engine = Engine(block, machine, parts, clock_ns)
        self.runner = runner = TransitionRunner(engine)
        self.safe_stop = safe_stop = SafeStop(engine, runner)
        self.transitions = transitions = Transitions(engine, runner, safe_stop)
        self.life = engine.life
        self.status = StatusPage(engine, runner, transitions, clock_ns, stops)
        self._stop_requested = self._power_off_requested = self._stopping = False
        self._commands = CommandDispatcher(engine, runner, transitions, self.request_stop, stops)
        self._alive = block.counters["loop_alive_ns"].data

    @property
    def busy(self) -> bool:
        """Whether a transition is in progress."""
        return self.runner.busy

    @property
    def ended(self) -> bool:
        """Whether the loop has been shut down."""
        return self.transitions.ended

    def run(self) -> None:
        """Boot, check, then make turns until a request to end; the drives have no power
        afterwards.
        """
        try:
            self.runner.begin(self.transitions.start_up())
            while not self.ended:
                self.turn()
        finally:
            self.runner.cancel()
            self.engine.machine.close()
            self.status.publish()

    def turn(self, another_follows: bool = False) -> None:
        """Run one cycle, or sleep; then stop requests, commands, transition, status and replies.

        In lockstep, a caller that does nothing between this turn and the next sets
        `another_follows`, so that the simulator can already compute.
        """
        self._alive[0] = time.monotonic_ns()
        engine = self.engine
        if engine.cycling:
            engine.run_cycle(self._judge, self._is_quiet if another_follows else None)
            engine.machine.clock.run_tasks()
        else:
            engine.machine.clock.sleep(TURN_S)
        if self._power_off_requested:
            self._remove_power()
        if self._stop_requested:
            self._end()
        self._commands.poll()
        try:
            self.runner.advance()
        except Exception as mistake:
            self.safe_stop.remove_power(mistake)
        self.status.update()
        self._commands.send_replies()

    def _is_quiet(self) -> bool:
        """Whether the rest of the turn sends nothing: no command, transition or transfer is due."""
        requested = self._power_off_requested or self._stop_requested
        return not (
            requested
            or self.runner.busy
            or self._commands.waiting
            or self.engine.machine.clock.has_tasks
        )

    def request_stop(self) -> None:
        """End the loop with a controlled stop. For signal handlers."""
        self._stop_requested = True

    def request_power_off(self) -> None:
        """Remove the power immediately in any state. For signal handlers."""
        self._power_off_requested = True

    def _remove_power(self) -> None:
        life, state = self.life, self.life.state
        if self.transitions.released:  # the service then ends the procedure
            self._power_off_requested = False
            life.set_reason(EMERGENCY_STOP)
            return
        if state not in (LoopState.READY, LoopState.ACTIVE, LoopState.FAULT):
            return  # booting drives have no power; the request is latched later
        if state is LoopState.FAULT and self.runner.busy:
            return  # the fault may be about to be acknowledged
        self._power_off_requested = False
        if self.engine.machine.read_only:
            return
        if state is LoopState.ACTIVE:
            cut_short = CUT_SHORT + (_NOT_LOWERED if self.safe_stop.lowers else "")
            life.set_reason(cut_short if self._stopping else EMERGENCY_STOP)
            self.safe_stop.stop(Reaction.TORQUE_OFF, LoopState.FAULT)
        elif state is LoopState.READY and not self._stopping:
            life.set_reason(EMERGENCY_STOP)
            self.safe_stop.enter_fault()

    def _end(self) -> None:
        if self.runner.task_running:
            return
        # repeated if there was a fault in between
        if not self._stopping or not (self.runner.busy or self.transitions.ended):
            self._stopping = True
            self.runner.begin(self.transitions.shut_down())

    def _judge(self, cycle: Cycle, torque_Nm: FloatArray) -> int:
        """Limit the torque, (n,) in place; return the reaction to exceeded limits and faults."""
        engine, parts, safe_stop = self.engine, self.engine.parts, self.safe_stop
        supervisor = parts.supervisor
        reaction = 0
        engine.lengths_disagree_m = math.nan
        if engine.driving:
            estimate = parts.estimator.estimate
            feedback, blind = cycle.device.feedback, safe_stop.pays_out_blind
            reaction = supervisor.check(feedback, estimate, engine.setpoint, torque_Nm, blind)
            if engine.program_s >= supervisor.limits.late_s and engine.program_fault is None:
                reaction = supervisor.report(_too_long(engine, supervisor.limits.late_s))
            if parts.lengths_disagree is not None:
                engine.lengths_disagree_m, axis, jump_m, jumped = parts.lengths_disagree()
                reaction = supervisor.compare_lengths(
                    estimate.elapsed_s, engine.lengths_disagree_m, axis, parts.length_suspects,
                    jump_m, jumped,
                )  # fmt: skip
        else:
            torque_Nm[:] = 0.0
        reacts = safe_stop.reacts_to_fault
        # in a fault the drives' alarms are known
        known = self.life.state is LoopState.FAULT or safe_stop.without_pose
        drives: Sequence[Fault] = ()
        if engine.lost_bus is not None:
            drives, known = (engine.lost_bus,), False
        elif reacts or not known:
            drives = cycle.device.faults()
        found = [] if known else [*drives[:1]]
        if cycle.watches:
            found += cycle.watch_faults()
        if found and not engine.driving:
            supervisor.reset()
        for fault in found:
            reaction = supervisor.report(fault)
        if reaction > Reaction.CLAMP:
            safe_stop.react(Reaction(reaction), torque_Nm, drives)
        if engine.reacting > Reaction.HOLD:
            engine.machine.switch_off_lost()
        # includes other axes in the cycle that begins the reaction, and its cause
        if (drives or reaction > Reaction.HOLD) and (reacts or safe_stop.reacts_to_fault):
            safe_stop.note_further(drives)
        return reaction


def _too_long(engine: Engine, allowed_s: float) -> Fault:
    """Return the fault of a program that delayed the loop, such as one with a user's controller."""
    name, took_s = engine.last_program.name, engine.program_s
    return Fault(
        Limit.LATE, code=PROGRAM, source=f"program {name}", value=took_s, allowed=allowed_s,
        detail=f"took {1e3 * took_s:.0f} ms in a cycle, {1e3 * allowed_s:.0f} ms allowed",
    )  # fmt: skip
