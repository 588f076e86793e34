"""A robot's daemon in the present process, on simulated drives, cycle by cycle in bus time.

The loop, its programs, its supervisor and the bus are those of `cdpr run`; only the clock that
leases and streams count by is the bus' own, so that minutes of motion pass as fast as the machine
computes them.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, Final, Self

from cdpr_drivers.bus import query_status
from cdpr_drivers.robot.commissioned import with_commissioned, without_commissioned
from cdpr_drivers.robot.machine import RobotMachine
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import load_robot
from cdpr_profiles.calibration.in_force import calibrated
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowReader, SharedBlock
from cdpr_rt.core.states import LoopState
from cdpr_rt.programs.base import Program
from cdpr_rt.robots.robot_arrays import limits_of
from cdpr_rt.runtime.control_loop.loop import ControlLoop
from cdpr_rt.runtime.realtime import one_core
from cdpr_rt.service.recordings.recording import Recorder
from cdpr_tools.composition.loop_parts import description, loop_parts
from cdpr_tools.composition.simulator import OwnLoadCells, OwnSimulator
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.trials.evaluation.pose_log import PoseLogTail
from cdpr_tools.trials.right import RightInBusTime
from cdpr_tools.trials.streams.stream import StreamInBusTime

RING_S: Final = 30.0
_LOOK_CYCLES: Final = 512
_names = count()


class CommandRefusedError(WorkFailedError):
    """A command was refused or failed, for the reason given."""


class LockstepRobot:
    """One robot, booted and checked, that moves on only when it is turned; a context manager.

    `robot` is a profile's name or file. `plant` is the simulator's plant file. `truth_log` is where
    the simulator logs the true pose, a file of its own where left out; `record` a folder for the
    recording (MCAP), none where left out. `programs` are run besides the robot's own.
    `commissioned` is the folder of what commissioning has learnt of the motors, where the robot's
    file does not name it; nothing is made of it where the robot is not to be `compensated`, and of
    the others nothing is learnt in motion where it `learns` nothing. The
    calibration of its geometry in force is left aside where it is not to be run `as_calibrated`,
    and believed less where it is `calibration_in_doubt`.
    `scanner` is where a simulated device outside logs the poses that it measures, `camera` the
    socket to make of a simulated camera on the platform. The
    right to move is held from the beginning, see `right`. Raises CommandError, DriverError and
    ProfileError as `cdpr run` does, WorkFailedError where the robot does not get ready.
    """

    def __init__(
        self,
        robot: str | Path,
        *,
        plant: Path | None = None,
        truth_log: Path | None = None,
        record: Path | None = None,
        programs: Mapping[str, Program] | None = None,
        commissioned: Path | None = None,
        compensated: bool = True,
        learns: bool = True,
        as_calibrated: bool = True,
        calibration_in_doubt: bool = False,
        scanner: Path | None = None,
        camera: Path | None = None,
    ) -> None:
        loaded = load_robot(robot)
        self.robot = with_commissioned(
            calibrated(loaded) if as_calibrated else loaded, commissioned
        )
        if not compensated:
            self.robot = without_commissioned(self.robot)
        self.period_s = self.robot.sync_period_s
        self._reference = str(robot)
        self._plant, self._truth_path, self._record = plant, truth_log, record
        self._scanner, self._camera, self._learns = scanner, camera, learns
        self._more_programs = dict(programs or {})
        self._limits = limits_of(self.robot, calibration_in_doubt=calibration_in_doubt)
        self._stack = ExitStack()
        self._turns = self._status_seen = 0
        self.block: SharedBlock
        self.machine: RobotMachine
        self.loop: ControlLoop
        self.right: RightInBusTime
        """The right to move, and who holds it."""
        self.stream: StreamInBusTime
        """Takes the packets of set-point streams."""
        self.cells: OwnLoadCells
        """The simulated load cells of a robot whose file names `tension_sensors`."""
        self.recorder: Recorder | None = None
        self._truth: PoseLogTail | None = None

    def __enter__(self) -> Self:
        with self._stack as stack:
            self._start(stack)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the power at once, wherever the platform is; `shut_down` lowers it first."""
        self._stack.close()

    def _start(self, stack: ExitStack) -> None:
        robot, n = self.robot, len(self.robot.axes)
        bus = f"simbus:trial-{os.getpid()}-{next(_names)}"
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="cdpr-trial-")))
        if self._truth_path is None and robot.platform is not None:
            self._truth_path = folder / "truth.log"
        board = None if robot.tension_sensors is None else folder / "board"
        simulator = OwnSimulator(
            self._reference,
            bus,
            self._plant,
            self._truth_path,
            board=board,
            scanner=self._scanner,
            camera=self._camera,
        )
        stack.callback(simulator.stop)
        self.simulator, port = simulator, None
        if board is not None:
            self.cells = OwnLoadCells(str(robot.tension_sensors), board)
            stack.callback(self.cells.stop)
            port = self.cells.port
        self.block = block = SharedBlock.create(n, RING_S, 1.0 / self.period_s)
        stack.callback(os.close, block.fd)
        block.counters["start_monotonic_ns"] = time.monotonic_ns()
        block.counters["start_realtime_ns"] = time.time_ns()
        limits = self._limits
        self.machine = RobotMachine(robot, [bus], tension_port=port, limits=limits)
        stack.callback(self.machine.clock.close)
        stack.callback(self.machine.close)
        parts = loop_parts(robot, limits, block, learns=self._learns)
        programs = {**parts.programs, **self._more_programs}
        # whether the user's own robot may be believed is nothing to a trial of a simulated one
        parts = replace(parts, programs=programs, before_power=lambda: None)
        block.write_description(description(robot, limits, parts))
        self.loop = ControlLoop(block, self.machine, parts, lambda: self.now_ns)
        self.right = RightInBusTime(block, lambda: self.now_ns)
        self.stream = StreamInBusTime(block, self.right, lambda: self.now_ns)
        self._reader = RowReader(block)
        self._channels = [url.channel for url in robot_urls(robot, (bus,)).values()]
        if self._record is not None:
            self.recorder = Recorder(block, self._record, robot.profile)
            stack.callback(self._end_recording)
            self.recorder.begin()
        self._boot()
        if self._truth_path is not None:
            self._truth = stack.enter_context(PoseLogTail(self._truth_path))
        stack.enter_context(one_core(simulator.process.pid))

    def _boot(self) -> None:
        loop = self.loop
        loop.runner.begin(loop.transitions.start_up())
        self._turn_until(lambda: not loop.busy, 60.0, "the boot")
        if loop.life.state is not LoopState.READY:
            raise WorkFailedError(loop.life.reason or "the drives are not ready")
        self.right.take("trial")

    def _end_recording(self) -> None:
        recorder = self.recorder
        if recorder is not None:
            recorder.finish()

    # -- time

    @property
    def cycle(self) -> int:
        """SYNCs since cycles began, as the recording counts them."""
        device = self.machine.device
        return 0 if device is None else device.feedback.cycle

    @property
    def now_s(self) -> float:
        """Bus time since cycles began, as the recording has it."""
        return self.cycle * self.period_s

    @property
    def now_ns(self) -> int:
        """The same in ns."""
        return round(self.now_s * 1e9)

    def turn(self, turns: int = 1) -> None:
        """Run so many cycles."""
        loop, right, stream, recorder = self.loop, self.right, self.stream, self.recorder
        status = self.block.counters["status"]
        for _ in range(turns):
            right.look()
            stream.look()
            loop.turn()
            self._turns += 1
            if recorder is not None and (
                self._turns % _LOOK_CYCLES == 0 or status[0] != self._status_seen
            ):
                self._status_seen = int(status[0])
                recorder.look()

    def run(self, seconds: float) -> Row:
        """Run cycles for `seconds` of bus time; return their rows."""
        self.rows()
        self.turn(round(seconds / self.period_s))
        return self.rows()

    def until(self, done: Callable[[], bool], within_s: float, what: str = "the end") -> None:
        """Run cycles until `done`; raises WorkFailedError where that takes longer than `within_s`.

        It fails at once where the drives have lost their power meanwhile.
        """
        driven = self.loop.engine.driving

        def done_or_lost() -> bool:
            return done() or (driven and not self.loop.engine.driving)

        self._turn_until(done_or_lost, within_s, what)
        if not done():
            self._turn_until(lambda: not self.loop.busy, within_s, "the drives' power off")
            raise WorkFailedError(f"{what}: {self.loop.life.reason or 'the power was taken'}")

    def _turn_until(self, done: Callable[[], bool], within_s: float, what: str) -> None:
        clock = self.machine.clock  # bus time goes on without cycles too, as in a boot
        end_s = clock.now_s + within_s
        while not done():
            if clock.now_s > end_s:
                raise WorkFailedError(f"{what}: not within {within_s:g} s: {self.state_text()}")
            self.turn()

    # -- commands

    def command(self, do: str, within_s: float = 60.0, **what: Any) -> dict[str, Any]:
        """Send a command as the service does and turn until the reply, in bus time.

        `what` are its keys: program, wanted. Raises CommandRefusedError where it fails.
        """
        right = self.right.number
        number = self.block.post_command({"do": do, "client": "trial", "right": right, **what})
        answers: list[dict[str, Any]] = []

        def answered() -> bool:
            while (answer := self.block.take_reply()) is not None:
                if answer["to"] == number:
                    answers.append(answer)
            return bool(answers)

        self._turn_until(answered, within_s, do)
        if not answers[0]["ok"]:
            raise CommandRefusedError(f"{do}: {answers[0]['text']}")
        return answers[0]

    def enable(self, program: str = "hold", **arguments: Any) -> None:
        """Give the drives power and run `program`."""
        self.command("enable", program=program, wanted=arguments)

    def program(self, name: str, **arguments: Any) -> None:
        """Change to a program with these arguments; returns at once."""
        self.command("program", program=name, wanted=arguments)

    def carry_out(self, name: str, within_s: float = 60.0, **arguments: Any) -> None:
        """Run a program until nothing is left for it to do; raises WorkFailedError otherwise."""
        self.program(name, **arguments)
        program = self.loop.engine.program
        self.finish(within_s)
        if trouble := program.progress().get("trouble", ""):
            raise WorkFailedError(f"{name}: {trouble}")

    def finish(self, within_s: float = 60.0) -> None:
        """Run cycles until the present program has nothing left to do."""
        program = self.loop.engine.program

        def over() -> bool:
            return self.loop.engine.program is not program or program.at_rest

        self.until(over, within_s, program.name)
        if self.loop.engine.program is not program:
            raise WorkFailedError(f"{program.name} was ended: {self.state_text()}")

    def inject_fault(self, axis: int, sub: int, value: int) -> None:
        """Inject a fault into a simulated drive (object 2F00h), between two cycles."""
        where = self.robot.axes[axis]
        networks = self.machine.networks
        networks[where.bus].write(where.node_id, 0x2F00, sub, value)

    def shut_down(self) -> None:
        """End as `cdpr run` does when it is told to stop: under control, then without power."""
        self.loop.request_stop()
        self._turn_until(lambda: self.loop.ended, 120.0, "the end")

    def die(self, seconds: float) -> None:
        """Leave the drives without SYNC and heartbeat, as a killed process does, for so long.

        The simulator's log goes on, in records without SYNC.
        """
        Clock.close(self.machine.clock)  # nothing is listened to or sent; the lead is kept
        self.machine.clock.sleep(seconds)

    # -- what is known

    def rows(self) -> Row:
        """Return the rows since the last call, at most those of the last `RING_S`."""
        return self._reader.read()

    @property
    def row(self) -> Any:
        """The newest row."""
        written = int(self.block.counters["rows"][0])
        return self.block.rows[(written - 1) % self.block.capacity]

    def truth(self) -> Any:
        """Return what was true at the last SYNC, a record of the pose log."""
        assert self._truth is not None  # of a robot with a platform
        return self._truth.last()

    @property
    def truth_log(self) -> Path:
        """The file of the pose log."""
        assert self._truth_path is not None  # of a robot with a platform
        return self._truth_path

    @property
    def sync_offset(self) -> int:
        """How many SYNCs the simulator had seen before our first cycle."""
        return int(query_status(self._channels[0]).get("sync_count", 0)) - self.cycle

    @property
    def state(self) -> LoopState:
        """The loop's state."""
        return self.loop.life.state

    @property
    def progress(self) -> dict[str, Any]:
        """Progress of the running program."""
        return self.loop.engine.program.progress()

    @property
    def status(self) -> dict[str, Any]:
        """The status that the daemon would publish now."""
        self.loop.status.publish()
        return self.block.status()

    def state_text(self) -> str:
        """Return state, program and reason, for messages."""
        life = self.loop.life
        reason = f": {life.reason}" if life.reason else ""
        return f"{life.state.label}, {self.loop.engine.program.name}{reason}"

    def recordings(self) -> Sequence[Path]:
        """Return the files recorded so far, in their order."""
        return [] if self._record is None else sorted(self._record.glob("*.mcap"))
