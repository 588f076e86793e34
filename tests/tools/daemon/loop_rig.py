"""The daemon's loop in the test process, turned by the test, on simulated drives."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from cdpr_drivers.robot.machine import RobotMachine
from cdpr_profiles import load_robot
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowReader, SharedBlock
from cdpr_rt.core.states import LoopState
from cdpr_rt.loop.loop import ControlLoop
from cdpr_rt.loop.right import LONGEST_S, PublishedRight
from cdpr_rt.loop.stop_socket import StopSocket
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.programs.base import Program
from cdpr_rt.service.lease import Lease, LeaseError
from cdpr_tools.composition.loop_parts import loop_parts


class LoopRig:
    """A loop on the buses of one or several URLs, which only the test turns.

    `programs` are added to those of the daemon. Other arguments are for the machine. The right to
    move is held from the beginning, with a clock that only the test advances.
    """

    def __init__(
        self,
        path: Path | str,
        url: str,
        programs: Mapping[str, Program] | None = None,
        stops: StopSocket | None = None,
        **more: Any,
    ) -> None:
        self.robot = load_robot(path)
        n, rate_Hz = len(self.robot.axes), 1.0 / self.robot.sync_period_s
        self.block = SharedBlock.create(n, 20.0, rate_Hz)
        self.now_ns = 1_000_000_000
        self.lease = Lease(PublishedRight(self.block), lambda: self.now_ns)
        self.take_right()
        self.machine = RobotMachine(self.robot, url.split(), **more)
        parts = loop_parts(self.robot, limits_of(self.robot), self.block)
        parts = replace(parts, programs={**parts.programs, **(programs or {})})
        self.loop = ControlLoop(self.block, self.machine, parts, lambda: self.now_ns, stops)
        self._rows = RowReader(self.block)

    def boot(self) -> None:
        """Perform the steps of the loop's start."""
        self.loop.runner.begin(self.loop.transitions.start_up())
        self.turn_until(lambda: not self.loop.busy)

    def take_right(self) -> None:
        """Take the right to move. Later commands use it."""
        self.token = self.lease.take("test", LONGEST_S)
        self.right = self.lease.renew(self.token).number

    def drop_right(self) -> None:
        with contextlib.suppress(LeaseError):
            self.lease.release(self.token)

    def turn_until(self, done: Callable[[], bool], seconds: float = 300.0) -> None:
        deadline = time.monotonic() + seconds
        while not done():
            assert time.monotonic() < deadline, self.block.status()
            self.loop.turn()

    def turn(self, turns: int) -> None:
        for _ in range(turns):
            self.loop.turn()

    def run(self, seconds: float) -> Row:
        """Run cycles for `seconds` of bus time. Return their rows."""
        self.rows()
        self.turn(round(seconds / self.robot.sync_period_s))
        return self.rows()

    def rows(self) -> Row:
        """Return the rows since the last call."""
        return self._rows.read()

    def command(self, do: Any, **what: Any) -> dict[str, Any]:
        """Post a command and turn until it is answered."""
        command = {"do": do, "client": "test", "right": self.right, **what}
        number = self.block.post_command(command)
        answers: list[dict[str, Any]] = []

        def answered() -> bool:
            answer = self.block.take_reply()
            if answer is not None and answer["to"] == number:
                answers.append(answer)
            return bool(answers)

        self.turn_until(answered)
        return answers[0]

    def obeyed(self, do: str, **what: Any) -> None:
        """Post a command that must succeed."""
        answer = self.command(do, **what)
        assert answer["ok"], answer

    def inject_fault(self, axis: int, sub: int, value: int) -> None:
        """Inject misbehaviour of a drive by 2F00h between two cycles."""
        where = self.robot.axes[axis]
        self.machine.networks[where.bus].write(where.node_id, 0x2F00, sub, value)

    @property
    def state(self) -> LoopState:
        return self.loop.life.state

    @property
    def status(self) -> dict[str, Any]:
        self.loop.status.publish()
        return self.block.status()

    def close(self) -> None:
        self.loop.request_stop()
        self.turn_until(lambda: self.loop.ended)
        self.machine.clock.close()


@contextmanager
def opened(
    path: Path, url: str, programs: Mapping[str, Program] | None = None, **more: Any
) -> Iterator[LoopRig]:
    rig = LoopRig(path, url, programs, **more)
    rig.boot()
    try:
        yield rig
    finally:
        rig.close()
