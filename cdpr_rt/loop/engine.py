"""The cycle engine: exchange with the axes, run the active program, record the row."""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.core.clock import Task
from cdpr_rt.core.cycle import Cycle
from cdpr_rt.core.cycle_row import AXIS_FIELDS, POSE_FIELDS, SCALAR_FIELDS, CycleField
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import Setpoint
from cdpr_rt.core.fault import (
    BUS_LOST,
    IN_REASON,
    PROGRAM,
    Fault,
    Key,
    fault_record,
    fault_text,
)
from cdpr_rt.core.shared_block import RowWriter, SharedBlock
from cdpr_rt.core.states import ALLOWED, LoopState, Reaction, Transition
from cdpr_rt.core.supervisor import Supervisor, Suspects, no_suspects
from cdpr_rt.errors import ControlError, error_text
from cdpr_rt.jit import bound, copy_bytes, jit
from cdpr_rt.loop.machine import Machine
from cdpr_rt.loop.right import RightToMove
from cdpr_rt.model.last_lengths import LastLengths
from cdpr_rt.programs.base import Program
from cdpr_rt.programs.path_store import PathStore
from cdpr_rt.refusal import CommandRefusal, RefusalCode, refusal_of

# Writes the row of each cycle into the shared ring.

_CODES: Final = {
    "<u8": "Q", "<i8": "q", "<f8": "d", "<u4": "I", "<i4": "i", "<u2": "H", "<i2": "h", "<u1": "B",
    "?": "?",
}  # fmt: skip
"""Type codes of `struct` for those of NumPy."""
_SCALARS = struct.Struct("<" + "".join(_CODES[field.kind] for field in SCALAR_FIELDS))
_scalars_of = attrgetter(*(field.source for field in SCALAR_FIELDS))
_axes_of = attrgetter(*(field.source for field in AXIS_FIELDS))
_poses_of = attrgetter(*(field.source for field in POSE_FIELDS))
_UNKNOWN = np.full(7, np.nan)


@jit
def _fill(
    copies: IntArray,
    rows: int,
    size: int,
    pose_rows: FloatArray,
    poses: tuple[FloatArray, ...],
    k: int,
) -> None:
    for j in range(copies.shape[0]):
        copy_bytes(rows + k * size + copies[j, 0], copies[j, 1], copies[j, 2])
    for j in range(len(poses)):
        for i in range(7):
            pose_rows[k, j, i] = poses[j][i]


class CycleRows:
    """Fills one row per cycle in place, without allocating memory that stays.

    The scalars, which come first in a row, are packed in one call. Arrays over the axes are copied
    from their addresses, because passing all of them to compiled code costs more than the copy.
    """

    def __init__(self, block: SharedBlock) -> None:
        self._writer = RowWriter(block)
        rows, n = block.rows, block.n
        self._rows = rows
        self._raw = memoryview(rows.view(np.uint8).data)
        self._size = rows.dtype.itemsize
        self._capacity = block.capacity
        self._written = int(block.counters["rows"][0])
        shape, at = (self._capacity, len(POSE_FIELDS), 7), self._offset(POSE_FIELDS[0])
        self._poses = np.ndarray(shape, "<f8", self._raw, at, (self._size, 7 * 8, 8))
        # this call compiles the kernel before the first cycle
        self._bind(tuple(np.zeros(n, field.kind) for field in AXIS_FIELDS))

    def _offset(self, field: CycleField) -> int:
        fields: Any = self._rows.dtype.fields
        return int(fields[field.name][1])

    def _bind(self, axes: tuple[NDArray[Any], ...]) -> None:
        copies = np.zeros((len(axes), 3), np.int64)
        for copy, field, values in zip(copies, AXIS_FIELDS, axes, strict=True):
            kind, allowed = np.dtype((values.dtype, values.shape)), self._rows.dtype[field.name]
            if kind != allowed or not values.flags.c_contiguous:
                raise TypeError(f"{field.source}: {kind}; allowed: {allowed}, contiguous")
            copy[:] = self._offset(field), values.ctypes.data, values.nbytes
        self._axes = axes  # keeps their addresses valid
        rows, then = self._rows.ctypes.data, ((_UNKNOWN,) * len(POSE_FIELDS), 0)
        self._fill = bound(_fill, copies, rows, self._size, self._poses, then=then)

    def follow(self, engine: Any) -> None:
        """Use the present per-axis arrays of `engine` as the sources of the row.

        Raises TypeError if an array has another type, length or layout than its field.
        """
        self._bind(_axes_of(engine))

    def write(self, engine: Any) -> None:
        """Write and publish one row of the present values of `engine`."""
        k = self._written % self._capacity
        _SCALARS.pack_into(self._raw, k * self._size, *_scalars_of(engine))
        poses = tuple([_UNKNOWN if pose is None else pose for pose in _poses_of(engine)])
        self._fill(poses, k)
        self._written += 1
        self._writer.commit()


# The parts of a control loop except the machine that it runs.


@dataclass(frozen=True)
class Lowering:
    """Lowering of a platform before power-off, if no brakes would hold it."""

    program: str
    """Name of the program; with `{"blind": true}` it lowers without a pose."""
    longest_s: float
    """Longest time that lowering may take."""


@dataclass(frozen=True)
class LoopParts:
    """The parts of a control loop, all made for the n axes of its machine."""

    programs: Mapping[str, Program]
    """Programs by name, in the order of their numbers; `idle` and `hold` are among them."""
    supervisor: Supervisor
    estimator: Estimator
    axis_names: Sequence[str] = ()
    """Names of the axes in messages."""
    lengths_disagree: Callable[[], tuple[float, int, float, int]] | None = None
    """Function that returns the largest normalised residual of cable lengths, m, and its cable.
    Then follow the largest sudden change of a residual, and its cable. -1 is an unknown cable.
    """
    length_suspects: Suspects = no_suspects
    """Function that returns the axes whose cables may contradict the others, the most likely
    first."""
    lowering: Lowering | None = None
    """Lowering of the platform, None for a robot without such a program."""
    last_stop: LastLengths | None = None
    """Stores the cable lengths of the last stop, if the next start can use them."""
    paths: PathStore | None = None
    """The planned paths of a robot with a platform."""
    notices: Callable[[], Sequence[str]] = tuple
    """Function that returns notices to the operator, in addition to the state."""
    before_power: Callable[[], object] = lambda: None
    """Function called before the drives get power; may wait for files."""
    enable_realtime: Callable[[], Sequence[str]] = tuple
    """Function called once before the first paced cycle; returns notices of denied settings."""


# The loop's state, its faults, and the transitions that are allowed.

_MOST_CHARACTERS = 2000
_MOST_OF_AN_ERROR = 500
"""Longest text of an exception, in characters; the status contains it several times."""
_MOST_FAULTS = 17


class RefusedError(ControlError):
    """A command was rejected for the given reason; nothing has changed."""


class Lifecycle:
    """The state and the faults, which stay until acknowledged or until a new motion."""

    def __init__(self, axis_names: Sequence[str] = ()) -> None:
        self.axis_names = axis_names
        self.state = LoopState.UNCONFIGURED
        self.since_ns = time.monotonic_ns()
        self.note = ""
        """Reason why the motion ended or was held, or a transition failed, if there was no
        fault."""
        self.faults: dict[Key, Fault] = {}
        """Faults by key: the one that ended or held the motion, then further ones."""
        self.reaction = Reaction.NONE
        """Reaction to the first of the faults."""
        self.earlier: tuple[str, frozenset[Key]] = "", frozenset()
        """Reason and keys of the faults whose acknowledgement failed."""
        self.changed = True
        """Whether the status must be published again."""

    @property
    def cause(self) -> Fault | None:
        """The fault that ended or held the motion."""
        return next(iter(self.faults.values()), None)

    @property
    def ends_motion(self) -> bool:
        """Whether the first fault ends the motion."""
        return self.reaction > Reaction.HOLD

    @property
    def reason(self) -> str:
        """Reason why the motion ended or was held, or the robot is not ready, as text, or ""."""
        first, *others = self.faults.values() or (None,)
        named = [] if first is None else [first, *(f for f in others if f.code in IN_REASON)]
        text = "; ".join(filter(None, (self.note, *map(self.text, named))))
        earlier = f" (before: {self.earlier[0]})" if self.earlier[0] else ""
        return (text + earlier)[:_MOST_CHARACTERS]

    @property
    def reason_limit(self) -> dict[str, Any] | None:
        """The cause and the reaction to it, in the form for programs; None without a cause."""
        cause = self.cause
        if cause is None:
            return None
        return {**fault_record(cause, self.axis_names), "reaction": self.reaction.label}

    @property
    def further(self) -> list[Fault]:
        """The faults that are not part of the reason."""
        return [fault for fault in list(self.faults.values())[1:] if fault.code not in IN_REASON]

    def text(self, fault: Fault) -> str:
        """Return a fault as text."""
        return fault_text(fault, self.axis_names)

    def require(self, transition: Transition) -> None:
        """Raise RefusedError if `transition` is not allowed in the present state."""
        allowed = ALLOWED[transition]
        if self.state not in allowed:
            raise self.not_in_state(transition.name.lower(), *allowed)

    def not_in_state(self, command: str, *allowed: LoopState) -> RefusedError:
        """Return the refusal of a command that is only allowed in other states."""
        states = {"state": self.state.label, "allowed": [state.label for state in allowed]}
        return RefusedError(CommandRefusal(RefusalCode.NOT_IN_STATE, command, arguments=states))

    def enter(self, state: LoopState) -> None:
        """Go to `state`."""
        if state is not self.state:
            self.state = state
            self.since_ns = time.monotonic_ns()
            self.changed = True

    def set_reason(self, reason: str) -> None:
        """Set the reason why the motion ended or was held, unless `faults` already give it."""
        if reason == self.reason:
            return
        if not self.ends_motion:
            self.faults.clear()
        self.note, self.changed = reason, True

    def set_cause(self, fault: Fault, reaction: Reaction) -> None:
        """Set the fault that ends or holds the motion by `reaction`, and remove all others."""
        self.note, self.faults = "", {fault.key: fault}
        self.reaction, self.changed = reaction, True

    def add_fault(self, fault: Fault, *, as_cause: bool = False) -> None:
        """Add a further fault; `as_cause` if all others follow from it.

        A drive's fault replaces the fault that it explains. A known fault gets the new values, but
        this does not publish the status, because a value may rise in every cycle. There are about
        17 faults at most, so the status stays short.
        """
        faults, said = list(self.faults.values()), fault.code in IN_REASON
        if fault.key in self.faults:
            if fault.key != faults[0].key:
                self.faults[fault.key] = fault
            return
        if vague := next(filter(fault.explains, faults), None):
            faults[faults.index(vague)] = fault
        elif len(faults) < _MOST_FAULTS or said or as_cause:
            faults.insert(0 if as_cause else len(faults), fault)
        else:
            return
        self.faults, self.changed = {known.key: known for known in faults}, True

    def clear_reason(self) -> None:
        """Clear the reason and the faults."""
        self.note, self.faults, self.reaction = "", {}, Reaction.NONE
        self.earlier, self.changed = ("", frozenset()), True


IDLE: Final = "idle"
HOLD: Final = "hold"
TURN_S: Final = 0.005
_TOO_OLD_S: Final = 0.1
"""Maximum age of answers; a torque computed from older answers is not sent."""
"""Duration of a turn while no cycles run."""

Judge = Callable[[Cycle, FloatArray], int]
"""Function that limits the torque, (n,) in place, and returns the reaction to exceeded limits and
faults."""


class Engine:
    """Runs the machine's axes under the active program; does not handle commands or stops.

    A cycle allocates no memory that stays and does not log. It waits only in its exchange: for its
    deadline, and for the axes' answers.
    """

    def __init__(
        self,
        block: SharedBlock,
        machine: Machine,
        parts: LoopParts,
        clock_ns: Callable[[], int],
    ) -> None:
        self.block = block
        self.machine = machine
        self.parts = parts
        self.programs = list(parts.programs.values())
        self.life = Lifecycle(parts.axis_names)
        self.program = parts.programs[IDLE]
        self.program_number = 0
        self.commanded = ""
        """The last command that selected the running program, and its sender: "hold by
        user@host"."""
        self.last_program = self.program
        """The program of the last cycle, even if the supervisor's reaction has replaced it
        since."""
        self.program_fault: Fault | None = None
        """The exception raised by the program in this cycle, or the fault that it took too long."""
        self.program_s = 0.0
        """Time that the program took in this cycle, 0 in lockstep."""
        self.setpoint = Setpoint(block.n)
        self.cycling = False
        """Whether cycles run."""
        self.driving = False
        """Whether the drives have power and obey the program."""
        self.reacting = Reaction.NONE
        """The reaction that is ending the motion, else NONE."""
        self.missed = 0
        self.cycle: Cycle | None = None
        self.notices: list[str] = []
        self.lost_bus: Fault | None = None
        """The exception of a lost bus, without which cycles cannot continue."""
        self.exchange_s = 0.0
        """Time from the last SYNC to its last answer."""
        self.compute_s = 0.0
        """Time from that answer until the last command had been sent."""
        self.answered = 0
        """Number of axes that answered the last SYNC."""
        self.asked_Nm: FloatArray = np.zeros(block.n)
        """Torque commanded by the program, before limits, (n,)."""
        self.reaction = self.limit = 0
        """Reaction of the supervisor in the last cycle, and the limit that caused it."""
        self.limit_axis = -1
        """Axis that exceeded that limit, -1 if there is no single axis."""
        self.lengths_disagree_m = math.nan
        """Largest normalised residual of a platform's cable lengths, nan without power."""
        self.right = RightToMove(block, clock_ns)
        self._realtime = False
        self._rows = CycleRows(block)

    def start_cycles(self) -> None:
        """Run cycles from the next turn on, with the device opened by the machine."""
        device = self.machine.device
        assert device is not None  # the device has been opened
        if not device.lockstep and not self._realtime:
            self._realtime = True
            self.notices += self.parts.enable_realtime()
        if self.cycle is None or self.cycle.device is not device:
            self.cycle = Cycle(device, self.machine.watches)
            self.parts.estimator.forget_lengths()  # after a boot angles have an arbitrary origin
        self.cycle.begin()
        self.parts.estimator.reset()
        self.lost_bus = None
        self.cycling = True
        self.switch(IDLE)

    def stop_cycles(self) -> None:
        """Stop running cycles."""
        self.cycling = self.driving = False

    def cycles_in(self, seconds: float) -> int:
        """Return the number of cycles in a time, at least one."""
        cycle = self.cycle
        return max(1, round(seconds / (cycle.device.period_s if cycle else TURN_S)))

    def run_cycle(self, judge: Judge, is_quiet: Callable[[], bool] | None = None) -> None:
        """Exchange with the axes, run the program, supervise its torque, send and record it.

        In lockstep, `is_quiet` returns whether nothing else is sent before the next cycle, which
        follows immediately. If so, the SYNC of that cycle goes out now.
        """
        cycle, machine = self.cycle, self.machine
        assert cycle is not None  # cycles run
        device = cycle.device
        feedback, torque = device.feedback, device.command.torque_Nm
        self.answered = 0
        try:
            self.answered = cycle.exchange()
        except machine.failures as error:
            self.lost_bus = Fault(Limit.DRIVE, code=BUS_LOST, detail=str(error))
        came_ns, came_s = time.monotonic_ns(), machine.clock.now_s
        self.exchange_s = (came_ns - cycle.began_ns) * 1e-9
        self.missed += device.n - self.answered
        estimator = self.parts.estimator
        estimator.update(
            feedback,
            machine.read_tension(),
            cycle.elapsed_s,
            self.program.controller.motor_loss_Nm,
            self.program.controller.cogging_Nm,
        )
        if self.program.needs_lease:
            self._watch_right()
        program = self.last_program = self.program
        self.program_fault = None
        try:
            program.update(feedback, self.setpoint, torque)
        except Exception as error:  # any error of a program stops the drives
            torque[:] = np.nan
            self.program_fault = Fault(
                Limit.NOT_FINITE, code=PROGRAM, source=f"program {program.name}",
                detail=error_text(error)[:_MOST_OF_AN_ERROR],
            )  # fmt: skip
        self.program_s = machine.clock.now_s - came_s
        self.asked_Nm[:] = torque
        self.reaction = judge(cycle, torque)
        if machine.clock.now_s - came_s > _TOO_OLD_S:
            torque[:] = 0.0  # the process was suspended, and its drives stopped in the meantime
        try:
            cycle.transmit(and_sync=is_quiet is not None and is_quiet())
        except machine.failures as error:
            self.lost_bus = Fault(Limit.DRIVE, code=BUS_LOST, detail=str(error))
        sent_ns = time.monotonic_ns()
        self.compute_s = (sent_ns - came_ns) * 1e-9
        supervisor = self.parts.supervisor
        self.limit = int(supervisor.limit) if self.reaction else 0
        self.limit_axis = supervisor.axis if self.limit else -1
        self._rows.write(self)

    def _watch_right(self) -> None:
        """Hold if the client that started the motion has lost the right to move."""
        if not self.driving or self.reacting:
            return
        lost = self.right.loss()
        if lost:
            self.hold(f"{self.program.name}: {lost}; the robot holds")

    # -- programs

    def drive(self) -> None:
        """Hold the axes after their drives have been enabled."""
        self.parts.supervisor.reset()
        self.driving = True
        self.switch(HOLD)

    def hold(self, reason: str | Fault) -> None:
        """End the motion and hold the axes, for `reason`."""
        if isinstance(reason, Fault):
            self.life.set_cause(reason, Reaction.HOLD)
        else:
            self.life.set_reason(reason)
        self.switch(HOLD)

    def switch(self, name: str, arguments: Mapping[str, Any] | None = None, right: int = 0) -> None:
        """Change to another program; if it raises ProgramError, nothing changes.

        `right` is the number of the grant of the right to move under which it runs, 0 for none.
        """
        program = self.parts.programs[name]
        checked = None if arguments is None else program.check(arguments)
        cycle = self.cycle
        assert cycle is not None  # cycles run
        device = cycle.device
        if not self.driving and not self.machine.read_only:
            device.command.torque_Nm[:] = 0.0
        program.start(device.feedback, self.setpoint, device.command.torque_Nm)
        if arguments is not None:
            program.apply(checked)
        self.program, self.right.mover = program, right
        self.program_number = self.programs.index(program)
        self._rows.follow(self)
        self.life.changed = True


# Advances one transition at a time, one step per turn.

Steps = Iterator[None]
Listener = Callable[[CommandRefusal | str], None]
"""Function called at the end of a transition with the error, "" if it succeeded."""


class TransitionRunner:
    """Advances a transition's steps, one per turn, and the tasks that they wait for.

    A transition is a generator. Another transition may replace it at any `yield`. If it fails, it
    raises ControlError, whose text is passed to its listeners.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._clock = engine.machine.clock
        self._steps: Steps | None = None
        self._listeners: list[Listener] = []
        self._task: Task[Any] | None = None

    @property
    def busy(self) -> bool:
        """Whether a transition is in progress."""
        return self._steps is not None

    def begin(self, steps: Steps, listener: Listener | None = None) -> None:
        """Advance `steps` once per turn from now on, in place of any other transition."""
        before, self._steps = self._steps, steps
        if before is not None:
            self._tell(f"cancelled: {self._engine.life.reason or 'another command came first'}")
        if listener is not None:
            self.listen(listener)
        self._engine.life.changed = True

    def listen(self, listener: Listener) -> None:
        """Report the end of the transition in progress to `listener`."""
        self._listeners.append(listener)

    def advance(self) -> None:
        """Advance by one step; raises any exception except ControlError."""
        steps = self._steps
        if steps is None:
            return
        try:
            next(steps)
        except StopIteration:
            self._end(steps, "")
        except ControlError as error:
            self._end(steps, refusal_of(error) or str(error))
        except Exception as error:
            self._end(steps, f"{type(error).__name__}: {error}")
            raise

    def _end(self, steps: Steps, error: CommandRefusal | str) -> None:
        if self._steps is steps:  # the step may have begun another transition
            self._steps = None
            self._tell(error)
        self._engine.life.changed = True

    def _tell(self, error: CommandRefusal | str) -> None:
        listeners, self._listeners = self._listeners, []
        for listener in listeners:
            listener(error)

    # -- waiting

    @property
    def task_running(self) -> bool:
        """Whether a task runs in parallel with the cycles."""
        return self._task is not None and not self._task.done

    def start(self, work: Callable[[], Any]) -> Task[Any]:
        """Start `work` as a task in parallel with the cycles; it runs immediately until its first
        wait.
        """
        self._task = task = self._clock.start(work)
        self._clock.run_tasks()
        return task

    def cancel(self) -> None:
        """Cancel the task at the point where it waits."""
        if self._task is not None:
            self._task.cancel()

    def run_task(self, work: Callable[[], Any]) -> Steps:
        """Run `work`, which may wait, as a task in parallel with the cycles; raises its
        exception.
        """
        task = self.start(work)
        while not task.done:
            yield
        task.result()

    def run_blocking(self, work: Callable[[], Any]) -> Steps:
        """Run `work`, which touches no bus, in a thread, without delaying cycles."""
        yield from self.run_task(lambda: self._clock.run_blocking(work))

    def wait_up_to(self, within_s: float, done: Callable[[], bool]) -> Generator[None, None, bool]:
        """Wait until `done`, at most `within_s`; return whether it became true."""
        for _ in range(self._engine.cycles_in(within_s)):
            if done():
                return True
            yield
        return False

    def wait_until(self, done: Callable[[], bool], within_s: float, what: str) -> Steps:
        """Wait until `done`; raises RefusedError if that takes longer than `within_s`."""
        if not (yield from self.wait_up_to(within_s, done)):
            raise RefusedError(f"{what}: not complete after {within_s:g} s")
