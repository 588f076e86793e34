"""Dispatches the commands that arrive in the shared memory, one per turn."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.clock import Task, TaskCancelled
from cdpr_rt.core.shared_block import SharedBlockError
from cdpr_rt.core.states import LoopState, Reaction, Transition
from cdpr_rt.errors import ControlError
from cdpr_rt.loop.engine import HOLD, Engine, RefusedError, Steps, TransitionRunner
from cdpr_rt.loop.stop_socket import StopRequest, StopSocket
from cdpr_rt.loop.transitions import Transitions
from cdpr_rt.programs.base import Program
from cdpr_rt.refusal import CommandRefusal, refusal_of

Command = Mapping[str, Any]
_MOST_TEXT, _SHORT_TEXT = 1500, 200
_LONGEST_CABLE_m = 1000.0
_ANOTHER = "another command came after it"
_OBEYED = "accepted; its end is not reported"
_MOVING = frozenset({"enable", "program", "set"})
_CHANGING = frozenset({"enable", "disable", "program", "hold", "shutdown"})
"""Commands that change the state or the running program."""
_ASIDE: Final = frozenset({"lengths", "object"})
"""Commands that cancel no deferred command."""
_MOST_OBJECT_BYTES: Final = 500
_CONTROLWORDS: Final = range(0x6040, 0xA000, 0x800)
"""Controlwords of the up to eight axes of a CiA 402 drive."""


@dataclass(frozen=True)
class _Deferred:
    """A command whose preparation runs in parallel with the cycles."""

    command: Command
    task: Task[None]
    program: Program
    state: LoopState
    """State when the command arrived; `program` is the program that ran at that time."""


class _Result(str):
    """Text of a reply to a command that succeeded."""

    __slots__ = ()


class CommandDispatcher:
    """Takes commands, rejects those that the state forbids, and replies once to each.

    A command that needs preparation, such as reading a file, is deferred until the preparation is
    done, and then dispatched again. It is cancelled if state or program change during that time,
    because of another command or, for example, a hold by the supervisor. Stops come from the
    service through the shared memory, and from local clients through `stops`.
    """

    def __init__(
        self,
        engine: Engine,
        runner: TransitionRunner,
        transitions: Transitions,
        request_stop: Callable[[], None],
        stops: StopSocket | None,
    ) -> None:
        self._engine, self._life = engine, engine.life
        self._runner = runner
        self._transitions = transitions
        self._request_stop = request_stop
        self._stops = stops
        self._deferred: _Deferred | None = None
        self._reading: tuple[Command, Task[bytes]] | None = None
        """A command that reads an object of a drive."""
        self._replies: list[tuple[int | StopRequest, CommandRefusal | str]] = []
        self._counters = engine.block.counters
        # a memoryview, because it is read in every cycle and faster
        queues = ("urgent", "urgent_taken", "commands", "commands_taken")
        self._urgent, self._urgent_taken, self._commands, self._commands_taken = (
            self._counters[name].data for name in queues
        )
        self._handlers: dict[str, Callable[[Command], Steps | None]] = {
            "configure": self._configure,
            "check": self._check,
            "enable": self._enable,
            "disable": self._disable,
            "acknowledge": self._acknowledge,
            "release": self._release,
            "program": self._program,
            "set": self._set,
            "hold": self._hold,
            "lengths": self._lengths,
            "object": self._object,
            "shutdown": self._shutdown,
        }

    @property
    def waiting(self) -> bool:
        """Whether a command waits in the block, or one is deferred."""
        return (
            self._deferred is not None
            or self._commands[0] != self._commands_taken[0]
            or self._urgent[0] != self._urgent_taken[0]
        )

    def poll(self) -> None:
        """Take one stop from each source, then one command if there is any, or a deferred one."""
        if self._deferred is not None and self._is_superseded(self._deferred):
            self._cancel(self._deferred, self._life.reason or "another command came first")
        if self._stops is not None and (stop := self._stops.take()) is not None:
            self._counters["stops_taken"][0] += 1
            self._life.changed = True
            self._dispatch({"do": stop.do, "client": stop.client}, stop)
            if stop.is_surplus and all(to is not stop for to, _ in self._replies):
                state = self._life.state.label
                stop.answer({"ok": True, "text": _OBEYED, "state": state})
        if self._urgent[0] != self._urgent_taken[0]:
            self._take(self._urgent_taken, self._engine.block.take_urgent)
        # its reply comes before the next command, so that no later stop is merged with it
        elif self._commands[0] != self._commands_taken[0]:
            self._take(self._commands_taken, self._engine.block.take_command)
        elif self._deferred is not None and self._deferred.task.done:
            self._resume(self._deferred)
        if self._reading is not None:
            if self._engine.reacting is not Reaction.NONE:  # confirming that the power is off
                self._engine.machine.clock.cancel(self._reading[1])  # may need the same drive
            if self._reading[1].done:
                self._answer_reading(*self._reading)

    def _take(self, taken: memoryview, take: Callable[[], Command | None]) -> None:
        try:
            command = take()
        except (ValueError, RecursionError):  # not JSON, so there is no number for a reply
            taken[0] += 1
            return
        if isinstance(command, dict):
            self._dispatch(command)

    def _dispatch(self, command: Command, stop: StopRequest | None = None) -> None:
        number = _number(command)
        do = command.get("do")
        handler = self._handlers.get(do) if isinstance(do, str) else None
        answer = partial(self._reply, number if stop is None else stop)
        if do == "disable" and self._engine.reacting and self._runner.busy:
            self._runner.listen(answer)  # in progress: the reply follows when the power is off
            return
        try:
            if handler is None:
                raise RefusedError(f"do: {do!r}; allowed: {', '.join(self._handlers)}")
            if do in _MOVING and command.get("stops") != self._engine.block.stops:
                raise RefusedError(f"{do}: cancelled by a later stop")
            steps = handler(command)
        except ControlError as error:
            answer(refusal_of(error) or str(error))
            return
        except Exception as error:  # the loop continues whatever a command contains
            answer(f"{do}: {type(error).__name__}: {error}")
            return
        deferred = self._deferred
        if deferred is not None and deferred.command is command:
            return  # the reply follows when the command is resumed
        if self._reading is not None and self._reading[0] is command:
            return  # the reply follows when the drive has answered
        if deferred is not None and do not in _ASIDE:
            self._cancel(deferred, _ANOTHER)
        if do in _CHANGING:
            what = command["program"] if do == "program" else do
            self._engine.commanded = f"{what} by {command.get('client')}"
        if steps is None:
            answer("")
        else:
            self._runner.begin(steps, answer)

    def _prepare(self, command: Command, program: Program) -> bool:
        """Return whether a command for a program is deferred because it needs preparation."""
        work = program.preparation(self._arguments(command))
        if work is None:
            return False
        engine, clock = self._engine, self._engine.machine.clock
        if self._deferred is not None:
            self._cancel(self._deferred, _ANOTHER)
        task = clock.start(lambda: clock.run_blocking(work))
        self._deferred = _Deferred(command, task, engine.program, self._life.state)
        return True

    def _is_superseded(self, deferred: _Deferred) -> bool:
        """Return whether the robot's state or program has changed since the command arrived."""
        engine, state = self._engine, self._life.state
        changed = engine.program is not deferred.program or state is not deferred.state
        return changed or engine.reacting is not Reaction.NONE

    def _resume(self, deferred: _Deferred) -> None:
        """Dispatch a command whose preparation has ended, or reply why the preparation has
        failed.
        """
        self._deferred = None
        try:
            deferred.task.result()
        except Exception as error:  # the loop continues whatever a file contains
            mistake = "" if isinstance(error, ControlError) else f"{type(error).__name__}: "
            said = refusal_of(error) or f"{mistake}{error}"
            self._reply(_number(deferred.command), said)
            return
        self._dispatch(deferred.command)

    def _cancel(self, deferred: _Deferred, why: str) -> None:
        self._deferred = None
        self._engine.machine.clock.cancel(deferred.task)
        self._reply(_number(deferred.command), f"cancelled: {why}")

    def send_replies(self) -> None:
        """Reply to the commands that were completed, rejected or cancelled since the last call.

        It is called after the status was published, so that a client that requests the status after
        the reply sees the effect of its command.
        """
        for to, error in self._replies:
            self._send(to, error)
        self._replies.clear()

    def _reply(self, to: int | StopRequest, error: CommandRefusal | str) -> None:
        self._replies.append((to, error))

    def _send(self, to: int | StopRequest, error: CommandRefusal | str) -> None:
        state, text = self._life.state.label, str(error)
        refusal = {"refusal": error.as_json()} if isinstance(error, CommandRefusal) else {}
        # a character may take a dozen bytes
        for most, more in ((_MOST_TEXT, refusal), (_MOST_TEXT, {}), (_SHORT_TEXT, {})):
            is_done = not text or isinstance(error, _Result)
            reply = {"ok": is_done, "text": text[:most], "state": state, **more}
            if isinstance(to, StopRequest):
                to.answer(reply)
                return
            try:
                self._engine.block.post_reply({"to": to, **reply})
                return
            except SharedBlockError:
                continue  # the reply is too long, or the queue is full

    # -- handlers: each acts immediately, or returns the steps of a transition

    def _configure(self, _command: Command) -> Steps:
        self._require(Transition.CONFIGURE)
        return self._transitions.configure()

    def _check(self, _command: Command) -> Steps:
        self._require(Transition.CHECK)
        return self._transitions.check(reset=True)

    def _acknowledge(self, _command: Command) -> Steps:
        self._require(Transition.ACKNOWLEDGE)
        return self._transitions.acknowledge()

    def _release(self, _command: Command) -> Steps:
        self._refuse_read_only("release")
        self._require(Transition.RELEASE)
        return self._transitions.release()

    def _enable(self, command: Command) -> Steps | None:
        self._refuse_read_only("enable")
        self._require(Transition.ENABLE)
        name = self._known(command.get("program") or HOLD)
        right = self._right("enable", command)
        if self._prepare(command, self._engine.parts.programs[name]):
            return None
        return self._transitions.enable(name, self._arguments(command), right, command["stops"])

    def _disable(self, _command: Command) -> Steps | None:
        self._refuse_read_only("disable")
        self._life.require(Transition.DISABLE)
        if self._life.state is LoopState.READY:
            return None
        return self._transitions.disable()

    def _shutdown(self, _command: Command) -> None:
        self._request_stop()

    def _hold(self, _command: Command) -> None:
        engine = self._engine
        if self._life.state is LoopState.ACTIVE and self._runner.busy and not engine.reacting:
            # power-on is in progress: hold afterwards
            self._transitions.first_program = HOLD
            return
        self._require_running(HOLD)
        if engine.program.name != HOLD:  # a repeated hold keeps its position
            engine.switch(HOLD, {}, 0)

    def _program(self, command: Command) -> None:
        name = self._known(command.get("program"))
        right = self._right("program", command)
        self._require_running(name)
        if self._prepare(command, self._engine.parts.programs[name]):
            return
        self._engine.switch(name, self._arguments(command), right)
        if name != HOLD:
            self._life.clear_reason()  # the reason of the last hold

    def _set(self, command: Command) -> None:
        self._require_running("set")
        right, program = self._right("set", command), self._engine.program
        if program.needs_lease and right != self._engine.right.mover:
            raise RefusedError(
                f"set: {program.name} was not started by the present holder of the right to move"
            )
        if self._prepare(command, program):
            return
        program.command(self._arguments(command))
        self._life.changed = True

    def _lengths(self, command: Command) -> None:
        device = self._engine.machine.device
        allowed = (LoopState.READY, LoopState.ACTIVE)
        if device is None or self._life.state not in allowed:
            raise self._life.not_in_state("lengths", *allowed)
        self._right("lengths", command)
        if not device.feedback.valid.all():
            raise RefusedError("lengths: not every axis answers")
        length_m = self._lengths_in(self._arguments(command), device.n)
        self._engine.parts.estimator.set_lengths(device.feedback.position_rad, length_m)

    @staticmethod
    def _lengths_in(arguments: Mapping[str, Any], n: int) -> FloatArray:
        lengths = arguments.get("cable_length_m")
        if (
            set(arguments) != {"cable_length_m"}
            or not isinstance(lengths, list)
            or len(lengths) != n
        ):
            raise RefusedError(f"wanted: allowed: cable_length_m with {n} lengths or null")
        for i, length in enumerate(lengths):
            is_number = isinstance(length, int | float) and not isinstance(length, bool)
            if length is not None and not (is_number and 0.0 < length <= _LONGEST_CABLE_m):
                raise RefusedError(
                    f"cable_length_m[{i}]: {length!r}; allowed: above 0, up to {_LONGEST_CABLE_m:g}"
                )
        return np.array([math.nan if length is None else length for length in lengths])

    def _object(self, command: Command) -> Steps | None:
        """Read an object of a drive in parallel with the cycles, or write one without power."""
        machine, state = self._engine.machine, self._life.state
        axis, index, sub = (int(command[key]) for key in ("axis", "index", "sub"))
        if machine.device is None:
            raise RefusedError("object: the drives have not booted")
        if not 0 <= axis < machine.device.n:
            raise RefusedError(f"axis: {axis}; allowed: 0 to {machine.device.n - 1}")
        if command.get("value") is None:
            if self._reading is not None or self._runner.busy:
                raise RefusedError(f"object: {self._occupied()}")
            read = partial(machine.read_object, axis, index, sub)
            self._reading = command, machine.clock.start(read)
            return None
        self._refuse_read_only("object")
        if index in _CONTROLWORDS:
            raise RefusedError(f"object: {index:04X}h could switch a drive on; use enable")
        if state not in (LoopState.INACTIVE, LoopState.READY):
            raise RefusedError(
                f"object: written without power only, because a changed setting may move a drive; "
                f"the state is {state.label}"
            )
        if self._runner.busy:
            raise RefusedError(f"object: {self._occupied()}")
        self._right("object", command)
        value = int(command["value"])
        return self._transitions.write_object(
            partial(machine.write_object, axis, index, sub, value)
        )

    def _answer_reading(self, command: Command, task: Task[bytes]) -> None:
        self._reading = None
        try:
            data = task.result()
        except TaskCancelled:
            self._reply(_number(command), f"object: cancelled: {self._occupied()}")
        except Exception as error:  # a drive may send anything
            self._reply(_number(command), str(error) or type(error).__name__)
        else:
            self._reply(_number(command), _Result(data[:_MOST_OBJECT_BYTES].hex() or "-"))

    # -- preconditions

    def _require(self, transition: Transition) -> None:
        self._life.require(transition)
        if self._runner.busy:
            raise RefusedError(f"{transition.name.lower()}: {self._occupied()}")

    def _occupied(self) -> str:
        """Return the reason why the loop accepts no command at present, or ""."""
        if self._engine.reacting:
            why = f" ({reason})" if (reason := self._life.reason) else ""
            return f"the robot is stopping{why}: it lowers a platform, then the power goes off"
        return "another command is running"

    def _require_running(self, what: str) -> None:
        engine = self._engine
        shadow = engine.machine.read_only and self._life.state is LoopState.READY
        if (engine.driving and not self._runner.busy) or shadow:
            return
        if self._life.state is LoopState.ACTIVE:
            raise RefusedError(f"{what}: {self._occupied()}")
        raise self._life.not_in_state(what, LoopState.ACTIVE)

    def _right(self, what: str, command: Command) -> int:
        """Return the number of the grant that the command names, which must be the current one."""
        number = command.get("right")
        right = number if type(number) is int else 0
        why_not = self._engine.right.refusal(right)
        if why_not:
            raise RefusedError(f"{what}: {why_not}")
        return right

    def _refuse_read_only(self, what: str) -> None:
        if self._engine.machine.read_only:
            raise RefusedError(f"{what}: this daemon only listens (--read-only)")

    def _known(self, name: Any) -> str:
        programs = self._engine.parts.programs
        if not isinstance(name, str) or name not in programs:
            raise RefusedError(f"program: {name!r}; allowed: {', '.join(programs)}")
        return name

    @staticmethod
    def _arguments(command: Command) -> Mapping[str, Any]:
        arguments = command.get("wanted")
        if arguments is None:
            return {}
        if not isinstance(arguments, dict):
            raise RefusedError(f"wanted: {arguments!r}; allowed: a table")
        return arguments


def _number(command: Command) -> int:
    number = command.get("number")
    return number if isinstance(number, int) else 0
