"""Commands that come through the shared memory: looked at one a turn, answered when done."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_rt.errors import ControlError
from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime import procedures
from cdpr_rt.runtime.lifecycle import RefusedError
from cdpr_rt.runtime.shared_block import SharedBlockError
from cdpr_rt.runtime.states import LoopState, Transition

if TYPE_CHECKING:
    from cdpr_rt.runtime.loop import ControlLoop

Order = Mapping[str, Any]
_MOST_TEXT, _SHORT_TEXT = 1500, 200
_LONGEST_CABLE_m = 1000.0
_MOVING = frozenset({"enable", "program", "set"})


class Orders:
    """Takes commands, refuses what the state forbids, and answers each of them once."""

    def __init__(self, loop: ControlLoop) -> None:
        self._loop = loop
        self._counters = loop.block.counters
        # looked at every cycle, and faster to read so
        queues = ("urgent", "urgent_taken", "commands", "commands_taken")
        self._urgent, self._urgent_taken, self._commands, self._commands_taken = (
            self._counters[name].data for name in queues
        )
        self._pending: list[int] = []
        """Numbers of the commands that are answered when the present procedure ends."""
        self._doing: dict[str, Callable[[Order], Iterator[None] | None]] = {
            "configure": self._configure,
            "check": self._check,
            "enable": self._enable,
            "disable": self._disable,
            "acknowledge": self._acknowledge,
            "program": self._program,
            "set": self._set,
            "hold": self._hold,
            "lengths": self._lengths,
            "shutdown": self._shutdown,
        }

    def take(self) -> None:
        """Look at one stop, then at one command, if there are any."""
        if self._urgent[0] != self._urgent_taken[0]:
            self._take(self._urgent_taken, self._loop.block.take_urgent)
        if self._commands[0] != self._commands_taken[0]:
            self._take(self._commands_taken, self._loop.block.take_command)

    def _take(self, taken: memoryview, take: Callable[[], Order | None]) -> None:
        try:
            order = take()
        except (ValueError, RecursionError):  # no JSON: nobody can be answered
            taken[0] += 1
            return
        if isinstance(order, dict):
            self._obey(order)

    def _obey(self, order: Order) -> None:
        number = order.get("number")
        number = number if isinstance(number, int) else 0
        do = order.get("do")
        doing = self._doing.get(do) if isinstance(do, str) else None
        if do == "disable" and self._loop.reacting and self._loop.busy:
            self._pending.append(number)  # it is being done: answered when the power is off
            return
        try:
            if doing is None:
                raise RefusedError(f"do: {do!r}; allowed: {', '.join(self._doing)}")
            if do in _MOVING and number <= int(self._counters["commands_void"][0]):
                raise RefusedError(f"{do}: given up: a stop was asked for after it")
            procedure = doing(order)
        except ControlError as error:
            self._reply(number, str(error))
            return
        except Exception as error:  # whatever a command holds: the loop goes on
            self._reply(number, f"{do}: {type(error).__name__}: {error}")
            return
        if procedure is None:
            self._reply(number, "")
            return
        self._loop.begin(procedure)
        self._pending = [number]

    def done(self, told: str) -> None:
        """Answer what the procedure that has ended was for; `told` is why it failed, if it did."""
        pending, self._pending = self._pending, []
        for number in pending:
            self._reply(number, told)

    def _reply(self, number: int, told: str) -> None:
        state = self._loop.life.state.label
        for most in (_MOST_TEXT, _SHORT_TEXT):  # letters may take a dozen bytes each
            reply = {"to": number, "ok": not told, "text": told[:most], "state": state}
            try:
                self._loop.block.post_reply(reply)
                return
            except SharedBlockError:
                continue  # too long, or nobody takes them

    # -- what each does: at once, or by a procedure

    def _configure(self, _order: Order) -> Iterator[None]:
        self._require(Transition.CONFIGURE)
        return procedures.configure(self._loop)

    def _check(self, _order: Order) -> Iterator[None]:
        self._require(Transition.CHECK)
        return procedures.check(self._loop, reset=True)

    def _acknowledge(self, _order: Order) -> Iterator[None]:
        self._require(Transition.ACKNOWLEDGE)
        return procedures.acknowledge(self._loop)

    def _enable(self, order: Order) -> Iterator[None]:
        self._refuse_read_only("enable")
        self._require(Transition.ENABLE)
        name = self._known(order.get("program") or "hold")
        right = self._right("enable", order)
        return procedures.enable(self._loop, name, self._wanted(order), right)

    def _disable(self, _order: Order) -> Iterator[None] | None:
        self._refuse_read_only("disable")
        loop = self._loop
        loop.life.require(Transition.DISABLE)
        if loop.life.state is LoopState.READY:
            return None
        return procedures.disable(loop)

    def _shutdown(self, _order: Order) -> None:
        self._loop.request_stop()

    def _hold(self, _order: Order) -> None:
        loop = self._loop
        if loop.life.state is LoopState.ACTIVE and loop.busy and not loop.reacting:
            loop.first_program = (
                "hold"  # the drives are getting their power: they hold, and stay so
            )
            return
        self._require_running("hold")
        if loop.program.name != "hold":  # asked for over and over, it stays where it is
            self._run("hold", {}, 0)

    def _program(self, order: Order) -> None:
        name = self._known(order.get("program"))
        self._run(name, self._wanted(order), self._right("program", order))
        if name != "hold":
            self._loop.life.forget()  # why the last motion was held

    def _set(self, order: Order) -> None:
        self._require_running("set")
        right, program = self._right("set", order), self._loop.program
        if program.needs_lease and right != self._loop.right.mover:
            raise RefusedError(f"set: {program.name} was not started by who holds the right now")
        program.command(self._wanted(order))
        self._loop.status.touch()

    def _lengths(self, order: Order) -> None:
        loop, device = self._loop, self._loop.machine.device
        if device is None or loop.life.state not in (LoopState.READY, LoopState.ACTIVE):
            raise RefusedError(f"lengths: not in state {loop.life.state.label}")
        self._right("lengths", order)
        if not device.feedback.valid.all():
            raise RefusedError("lengths: not every axis answers")
        length_m = self._lengths_in(self._wanted(order), device.n)
        loop.parts.estimator.set_lengths(device.feedback.position_rad, length_m)

    @staticmethod
    def _lengths_in(wanted: Mapping[str, Any], n: int) -> FloatArray:
        told = wanted.get("cable_length_m")
        if set(wanted) != {"cable_length_m"} or not isinstance(told, list) or len(told) != n:
            raise RefusedError(f"wanted: allowed: cable_length_m, {n} lengths or null")
        for i, length in enumerate(told):
            is_number = isinstance(length, int | float) and not isinstance(length, bool)
            if length is not None and not (is_number and 0.0 < length <= _LONGEST_CABLE_m):
                raise RefusedError(
                    f"cable_length_m[{i}]: {length!r}; allowed: above 0, up to {_LONGEST_CABLE_m:g}"
                )
        return np.array([math.nan if length is None else length for length in told])

    def _run(self, name: str, wanted: Mapping[str, Any], right: int) -> None:
        self._require_running(name)
        self._loop.switch(name, wanted, right)

    # -- what stands against it

    def _require(self, transition: Transition) -> None:
        self._loop.life.require(transition)
        if self._loop.busy:
            raise RefusedError(f"{transition.name.lower()}: another command is being carried out")

    def _require_running(self, what: str) -> None:
        loop = self._loop
        shadow = loop.machine.read_only and loop.life.state is LoopState.READY
        if (loop.driving and not loop.busy) or shadow:
            return
        if loop.life.state is LoopState.ACTIVE:
            raise RefusedError(f"{what}: another command is being carried out")
        raise RefusedError(
            f"{what}: not in state {loop.life.state.label}; allowed in {LoopState.ACTIVE.label}"
        )

    def _right(self, what: str, order: Order) -> int:
        """Return the number of the taking that gives the order, which has to hold now."""
        number = order.get("right")
        right = number if type(number) is int else 0
        missing = self._loop.right.missing(right)
        if missing:
            raise RefusedError(f"{what}: {missing}")
        return right

    def _refuse_read_only(self, what: str) -> None:
        if self._loop.machine.read_only:
            raise RefusedError(f"{what}: this daemon only listens (--read-only)")

    def _known(self, name: Any) -> str:
        programs = self._loop.parts.programs
        if not isinstance(name, str) or name not in programs:
            raise RefusedError(f"program: {name!r}; allowed: {', '.join(programs)}")
        return name

    @staticmethod
    def _wanted(order: Order) -> Mapping[str, Any]:
        wanted = order.get("wanted")
        if wanted is None:
            return {}
        if not isinstance(wanted, dict):
            raise RefusedError(f"wanted: {wanted!r}; allowed: a table")
        return wanted
