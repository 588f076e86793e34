"""A robot on simulated drives, run by this process cycle by cycle in bus time.

The loop, its programs, its supervisor and the bus are those of `cdpr run`. Only leases and streams
use bus time as their clock, so that minutes of motion pass as fast as the machine computes them.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from cdpr_drivers.robot.commissioned import with_commissioned, without_commissioned
from cdpr_drivers.robot.machine import RobotMachine
from cdpr_profiles import load_robot
from cdpr_profiles.calibration_in_force import calibrated
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowReader, SharedBlock
from cdpr_rt.core.states import LoopState
from cdpr_rt.errors import ControlError
from cdpr_rt.loop.loop import ControlLoop
from cdpr_rt.loop.right import PublishedRight
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.refusal import CommandRefusal
from cdpr_rt.robot import Error, InvalidArgument, NotRunning, Refused
from cdpr_rt.service import stream_packet
from cdpr_rt.service.lease import Lease, LeaseError
from cdpr_rt.service.rows import cycle_figures
from cdpr_rt.service.setpoint_stream import Address, StreamSessionManager
from cdpr_tools.client.handle_errors import errors_for_scripts
from cdpr_tools.composition.local_simulator import LocalSimulator
from cdpr_tools.composition.loop_parts import control_loop, loop_parts
from cdpr_tools.composition.own_code import OwnCode
from cdpr_tools.composition.simulator import OwnLoadCells
from cdpr_tools.errors import BadInputError
from cdpr_tools.recordings.truth import POSES, RecordLog

if TYPE_CHECKING:
    from cdpr_rt.service.recording import Recorder

# The right to move, granted and lost in bus time.

_TTL_S: Final = 2.0
_RENEWED_NS: Final = 500_000_000


class RightInBusTime:
    """The daemon's lease on a clock that stands still between cycles.

    A right taken here is kept until `drop` or `fall_silent`; a stream has a separate right.
    """

    def __init__(self, block: SharedBlock, clock_ns: Callable[[], int]) -> None:
        self._clock_ns = clock_ns
        self.token: str | None = None
        """The token of the right, if it is held here; else None."""
        self.number = 0
        """The number of the newest grant to this process, which commands carry."""
        self._renewed_ns = 0
        self.lease = Lease(PublishedRight(block), self._heard_ns)

    def take(self, client: str) -> str:
        """Take the right and keep it; return the token. Raises LeaseError if another has it."""
        self.token, self._renewed_ns = self.lease.take(client, _TTL_S), self._clock_ns()
        self._renew(self.token)
        return self.token

    def drop(self) -> None:
        """Release the right."""
        token, self.token = self.token, None
        with suppress(LeaseError):  # the right has expired
            self.lease.release(token)

    def fall_silent(self) -> None:
        """Stop renewing the right, so that it expires."""
        self.token = None

    def look(self) -> None:
        """Renew the right as often as is due; called every cycle.

        More than its duration may have passed since the last cycle, as in a boot.
        """
        while self.token is not None and self._clock_ns() - self._renewed_ns >= _RENEWED_NS:
            self._renew(self.token)

    def _renew(self, token: str) -> None:
        self._renewed_ns = self._heard_ns()
        self.number = self.lease.renew(token).number

    def _heard_ns(self) -> int:
        """Return the time now, at most until the next renewal while the right is kept."""
        now_ns = self._clock_ns()
        return now_ns if self.token is None else min(now_ns, self._renewed_ns + _RENEWED_NS)


# A set-point stream in bus time: packets as on the wire, received as by the daemon.

_LOOPBACK: Final[Address] = ("127.0.0.1", 1)
_LOOK_NS: Final = 10_000_000


class StreamInBusTime:
    """Passes packets to the session manager behind the daemon's socket, in bus time."""

    def __init__(
        self, block: SharedBlock, right: RightInBusTime, clock_ns: Callable[[], int]
    ) -> None:
        self.sessions = StreamSessionManager(block, right.lease)
        self._right = right
        self._clock_ns = clock_ns
        self._look_ns = 0

    def sender(self) -> StreamSender:
        """Return a sender under the right held here; it replaces any earlier sender.

        Raises LeaseError if the right is not held.
        """
        return StreamSender(self.sessions.issue(self._right.token))

    def take(self, data: bytes, address: Address = _LOOPBACK) -> bytes | None:
        """Receive one packet now; return the answer, None if none is due."""
        return self.sessions.receive(data, address, self._clock_ns())

    def look(self) -> None:
        """Free the stream of a sender that is silent; called every cycle."""
        now_ns = self._clock_ns()
        if now_ns >= self._look_ns:
            self._look_ns = now_ns + _LOOK_NS
            self.sessions.expire(now_ns)


class StreamSender:
    """The packets of one session, numbered and stamped."""

    def __init__(self, session: stream_packet.StreamSession) -> None:
        self._session = session
        self._sequence = 0

    def packet(
        self,
        sent_s: float,
        position_m: Sequence[float],
        scale: float = 1.0,
        buttons: int = 0,
        quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
    ) -> bytes:
        """Return the bytes of the next set-point, sent at `sent_s` by the sender's clock."""
        self._sequence += 1
        x, y, z = position_m
        w, i, j, k = quaternion
        setpoint = stream_packet.StreamSetpoint(
            self._session.number, self._sequence, round(sent_s * 1e9), (x, y, z), (w, i, j, k),
            scale, buttons,
        )  # fmt: skip
        return stream_packet.seal(setpoint, self._session.key)

    def answer_of(self, data: bytes) -> stream_packet.StreamAnswer:
        """Return the robot's answer; raises PacketError for a packet of another session."""
        packet = stream_packet.parse(data, self._session.key)
        assert isinstance(packet, stream_packet.StreamAnswer)  # the manager sends no other kind
        return packet


RING_S: Final = 30.0
_REPLY_S: Final = 120.0
_LOOK_CYCLES: Final = 512


class LockstepRobot:
    """One robot, booted and checked, whose time passes only in `turn`; a context manager.

    It is the backend of a `Robot` in this process. Trials and tests also run it cycle by cycle.

    `robot` is a profile's name or file, `plant` the simulator's plant file. The simulator logs the
    true pose to `truth_log`, by default a temporary file. `record` is a folder for the recording
    (MCAP); without it nothing is recorded. `own` is the user's code, which the loop runs.
    `commissioned` is the folder with the commissioning results of the motors, if the robot's file
    does not name it. They are used only if `compensated`. The control learns the other motors only
    if `learns`. The calibration in force is used only if `as_calibrated`. With
    `calibration_in_doubt`, the limits are those of a robot without a calibration. `scanner` is the
    file in which a simulated external scanner logs the poses it measures, `camera` the socket of a
    simulated camera on the platform. Rows of the last `ring_s` are kept. The right to move is held
    from the beginning, see `right`. If `boots` is false, the caller boots the robot. Raises
    CommandError, DriverError and ProfileError as `cdpr run` does, Error if the robot does not get
    ready.
    """

    look_s = 0.02

    def __init__(
        self,
        robot: str | Path,
        *,
        plant: Path | None = None,
        truth_log: Path | None = None,
        record: Path | None = None,
        own: OwnCode | None = None,
        commissioned: Path | None = None,
        compensated: bool = True,
        learns: bool = True,
        as_calibrated: bool = True,
        calibration_in_doubt: bool = False,
        scanner: Path | None = None,
        camera: Path | None = None,
        ring_s: float = RING_S,
        boots: bool = True,
    ) -> None:
        self._simulated = loaded = load_robot(robot)
        self.robot = with_commissioned(
            calibrated(loaded) if as_calibrated else loaded, commissioned
        )
        if not compensated:
            self.robot = without_commissioned(self.robot)
        self.period_s = self.robot.sync_period_s
        self._reference = str(robot)
        self._plant, self._truth_path, self._record = plant, truth_log, record
        self._scanner, self._camera, self._learns = scanner, camera, learns
        self._ring_s, self._own, self._boots = ring_s, own, boots
        self._limits = limits_of(self.robot, calibration_in_doubt=calibration_in_doubt)
        self._stack = ExitStack()
        self._turns = self._status_seen = self._began = 0
        self._closed, self._in_use = False, threading.Lock()
        self.simulator: LocalSimulator
        self.description: Mapping[str, Any]
        """The description that the daemon would publish."""
        self.block: SharedBlock
        self.machine: RobotMachine
        self.loop: ControlLoop
        self.right: RightInBusTime
        """The right to move, and who holds it."""
        self.folder: Path
        """Folder for the robot's temporary files, while it is open."""
        self.stream: StreamInBusTime
        """Takes the packets of set-point streams."""
        self.cells: OwnLoadCells
        """The simulated load cells of a robot whose file names `tension_sensors`."""
        self.recorder: Recorder | None = None
        self._truth: RecordLog | None = None

    def __enter__(self) -> Self:
        with self._stack as stack:
            self._start(stack)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the power immediately, wherever the platform is; `shut_down` lowers it first."""
        self._closed = True
        self._stack.close()

    def _start(self, stack: ExitStack) -> None:
        robot, limits, port = self.robot, self._limits, None
        self.simulator = simulator = LocalSimulator(
            *(self._simulated, self._plant, self._truth_path, self._scanner, self._camera)
        )
        stack.callback(simulator.stop)
        self.folder = simulator.folder
        self.block = block = SharedBlock.create(
            len(robot.axes), self._ring_s, 1.0 / self.period_s, private=True
        )
        stack.callback(os.close, block.fd)
        parts = loop_parts(robot, limits, block, learns=self._learns, own=self._own)
        if simulator.board is not None:
            self.cells = OwnLoadCells(str(robot.tension_sensors), simulator.board)
            stack.callback(self.cells.stop)
            port = self.cells.port
        block.counters["start_monotonic_ns"] = time.monotonic_ns()
        block.counters["start_realtime_ns"] = time.time_ns()
        self.machine = RobotMachine(robot, [simulator.bus], tension_port=port, limits=limits)
        stack.callback(self.machine.clock.close)
        stack.callback(self.machine.close)
        # doubts about the calibration of a real robot do not concern a simulated one
        parts = replace(parts, before_power=lambda: None)
        self.loop = control_loop(
            robot, limits, block, self.machine, parts, lambda: self.now_ns, simulated=True
        )
        self.description = block.description()
        self.right = RightInBusTime(block, lambda: self.now_ns)
        self.stream = StreamInBusTime(block, self.right, lambda: self.now_ns)
        self._reader = RowReader(block)
        if self._record is not None:
            # imported here: a robot that does not record needs no package of the daemon
            from cdpr_rt.service.recording import Recorder  # noqa: PLC0415

            self.recorder = Recorder(block, self._record, robot.profile)
            stack.callback(self._end_recording)
            self.recorder.begin()
        if self._boots:
            self.boot()
        self._began = self.rows_written
        if not robot.is_winch:  # the log of a single drive has another format
            self._truth = stack.enter_context(RecordLog(simulator.truth_log, POSES))

    def boot(self) -> None:
        """Boot and check the drives; take the right to move. Raises Error if that fails."""
        loop = self.loop
        loop.runner.begin(loop.transitions.start_up())
        self._turn_until(lambda: not loop.busy, 60.0, "the boot")
        if loop.life.state is not LoopState.READY:
            raise Error(loop.life.reason or "the drives are not ready")
        self.right.take("trial")

    def _end_recording(self) -> None:
        recorder = self.recorder
        if recorder is not None:
            recorder.finish()

    # -- time

    @property
    def cycle(self) -> int:
        """Number of SYNCs since cycles began, as in the recording."""
        device = self.machine.device
        return 0 if device is None else device.feedback.cycle

    @property
    def now_s(self) -> float:
        """Bus time since cycles began, as in the recording."""
        return self.cycle * self.period_s

    @property
    def now_ns(self) -> int:
        """Bus time, which also passes without cycles and never goes back, in ns."""
        return round(self.machine.clock.now_s * 1e9)

    def turn(self, turns: int = 1) -> None:
        """Run `turns` cycles."""
        loop, right, stream, recorder = self.loop, self.right, self.stream, self.recorder
        status = self.block.counters["status"]
        for left in range(turns - 1, -1, -1):
            right.look()
            stream.look()
            loop.turn(another_follows=left > 0)
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
        """Run cycles until `done`; raises Error if that takes longer than `within_s`.

        It fails immediately if the drives lose their power meanwhile.
        """
        driven = self.loop.engine.driving

        def done_or_lost() -> bool:
            return done() or (driven and not self.loop.engine.driving)

        self._turn_until(done_or_lost, within_s, what)
        if not done():
            self._turn_until(lambda: not self.loop.busy, within_s, "the drives' power off")
            raise Error(f"{what}: {self.loop.life.reason or 'the power was removed'}")

    def _turn_until(self, done: Callable[[], bool], within_s: float, what: str) -> None:
        clock = self.machine.clock  # bus time also passes without cycles, as in a boot
        end_s = clock.now_s + within_s
        while not done():
            if clock.now_s > end_s:
                raise Error(f"{what}: not complete after {within_s:g} s: {self.state_text()}")
            self.turn()

    # -- commands

    def command(
        self,
        do: str,
        program: str = "",
        wanted: Mapping[str, Any] | None = None,
        within_s: float = _REPLY_S,
    ) -> None:
        """Send a command as the service does, and run cycles until the reply arrives.

        Raises Refused if it is rejected or fails.
        """
        fields = {"program": program} if program else {}
        answers: list[dict[str, Any]] = []

        def answered() -> bool:
            while (answer := self.block.take_reply()) is not None:
                if answer["to"] == number:
                    answers.append(answer)
            return bool(answers)

        with self._for_script():
            right = self.right.number
            number = self.block.post_command(
                {"do": do, "client": "trial", "right": right, **fields, "wanted": wanted or {}}
            )
            self._turn_until(answered, within_s, do)
        if not answers[0]["ok"]:
            refusal = CommandRefusal.from_json(answers[0].get("refusal"))
            raise Refused(str(refusal or answers[0]["text"]), refusal)

    def enable(self, program: str = "hold", **arguments: Any) -> None:
        """Enable the drives and run `program`."""
        self.command("enable", program=program, wanted=arguments)

    def program(self, name: str, **arguments: Any) -> None:
        """Change to a program with these arguments; returns immediately."""
        self.command("program", program=name, wanted=arguments)

    def carry_out(self, name: str, within_s: float = 60.0, **arguments: Any) -> None:
        """Run a program until it has finished; raises Error if it does not succeed."""
        self.program(name, **arguments)
        program = self.loop.engine.program
        self.finish(within_s)
        if trouble := program.progress().get("trouble", ""):
            raise Error(f"{name}: {trouble}")

    def finish(self, within_s: float = 60.0) -> None:
        """Run cycles until the running program has finished."""
        program = self.loop.engine.program

        def over() -> bool:
            return self.loop.engine.program is not program or program.at_rest

        self.until(over, within_s, program.name)
        if self.loop.engine.program is not program:
            raise Error(f"{program.name} was ended: {self.state_text()}")

    def inject(self, axis: int, sub: int, value: int) -> None:
        """Write a fault to a simulated drive (object 2F00h), between two cycles."""
        where = self.robot.axes[axis]
        networks = self.machine.networks
        networks[where.bus].write(where.node_id, 0x2F00, sub, value)

    def shut_down(self) -> None:
        """End as `cdpr run` does when it is stopped: under control, then without power."""
        self.loop.request_stop()
        self._turn_until(lambda: self.loop.ended, 120.0, "the end")

    def die(self, seconds: float) -> None:
        """Send neither SYNC nor heartbeat for this time, like a killed process.

        The simulator's log continues, with records without SYNC.
        """
        Clock.close(self.machine.clock)  # nothing is received or sent, but we keep leading the bus
        self.machine.clock.sleep(seconds)

    # -- state and data

    def rows(self) -> Row:
        """Return the rows since the last call, but no more than those of the last `ring_s`."""
        return self._reader.read()

    @property
    def rows_written(self) -> int:
        """Number of rows so far."""
        return int(self.block.counters["rows"][0])

    def kept_rows(self, since: int = 0) -> Row:
        """Return the rows of the last `ring_s`, (cycles,), from row number `since` on."""
        written, capacity = self.rows_written, self.block.capacity
        return self.block.rows[np.arange(max(since, written - capacity), written) % capacity]

    @property
    def row(self) -> Any:
        """The newest row."""
        written = int(self.block.counters["rows"][0])
        return self.block.rows[(written - 1) % self.block.capacity]

    def truth(self) -> Any:
        """Return the truth at the last SYNC, a record of the pose log.

        Without a platform, the record has no pose. `simulator.truth()` shows more, and needs no
        loop.
        """
        assert self._truth is not None  # opened with the robot
        return self._truth.last()

    @property
    def truth_log(self) -> Path:
        """The file of the pose log."""
        return self.simulator.truth_log

    @property
    def state(self) -> LoopState:
        """The loop's state."""
        return self.loop.life.state

    @property
    def progress(self) -> dict[str, Any]:
        """The progress of the running program."""
        return self.loop.engine.program.progress()

    def status(self) -> dict[str, Any]:
        """Return the status that the daemon would publish now, with the newest cycle."""
        self._require_open()
        self.loop.status.publish()
        return self.block.status() | cycle_figures(self.block, self.description)

    def brief_status(self) -> dict[str, Any]:
        """Return the status without the newest cycle, and publish nothing."""
        self._require_open()
        return self.loop.status.present()

    def state_text(self) -> str:
        """Return state, program and reason, for messages."""
        life = self.loop.life
        reason = f": {life.reason}" if life.reason else ""
        return f"{life.state.label}, {self.loop.engine.program.name}{reason}"

    def recordings(self) -> Sequence[Path]:
        """Return the files recorded so far, oldest first."""
        return [] if self._record is None else sorted(self._record.glob("*.mcap"))

    # -- for the handle: a Ctrl-C takes effect between two cycles, and errors are those of the
    # handle

    def wait(self, seconds: float) -> None:
        """Run cycles for some seconds, at least one."""
        with self._for_script():
            self.turn(max(1, round(seconds / self.period_s)))

    def observe(self, seconds: float) -> Row:
        """Run cycles for some seconds, at least two; return their rows."""
        began = self.rows_written
        self.wait(max(seconds, 2.0 * self.period_s))
        return self.kept_rows(began)

    def true_pose(self) -> FloatArray:
        """Return the true pose at the last SYNC, (7,)."""
        from scipy.spatial.transform import Rotation  # noqa: PLC0415  # slow to load

        self._require_open()
        if self._truth is None or self.robot.platform is None:
            raise InvalidArgument(f"true_pose: {self._reference} {NO_PLATFORM}")
        true = self._truth.last()
        x, y, z, w = Rotation.from_matrix(true["rotation"]).as_quat(canonical=True)
        return np.array([*true["position_m"], w, x, y, z])

    def plan(self, file: Path) -> str:
        """Plan the path in a file; return the name of the plan."""
        # imported here: most scripts follow no path
        from cdpr_rt.programs.path_store import write_plan  # noqa: PLC0415
        from cdpr_tools.robots.path_options import PathOptions  # noqa: PLC0415
        from cdpr_tools.robots.path_preview import obstacle_text, preview  # noqa: PLC0415

        self._require_open()
        try:
            shown = preview(self.robot, file, PathOptions(), lambda _what, _part: None)
        except (ProfileError, ControlError, BadInputError) as error:
            raise Refused(str(error)) from None
        plan, paths = shown.plan, self.loop.engine.parts.paths
        if shown.obstacle is not None or plan.timed is None or paths is None:
            raise Refused(obstacle_text(shown))
        if plan.next_line is not None:
            raise Refused(f"{file}: is too long for one plan; divide it at line {plan.next_line}")
        folder = self.folder / "paths"
        paths.open(folder)
        lines = plan.nodes.line[plan.timed.node]
        try:
            return write_plan(folder, plan.timed, lines, file.name, shown.planner.model)
        except ControlError as error:
            raise Refused(str(error)) from None

    @contextmanager
    def open_stream(self) -> Iterator[Callable[[Sequence[float], float], None]]:
        """Open a stream under the right held here; yield a sender of positions and scales."""
        self._require_open()
        sender = self.stream.sender()

        def send(position_m: Sequence[float], scale: float) -> None:
            self._require_open()
            self.stream.take(sender.packet(self.now_s, position_m, scale))

        yield send

    def log(self, fields: Sequence[str]) -> Row:
        """Return these fields of the rows since the robot was ready, at most the last `ring_s`."""
        self._require_open()
        return self.kept_rows(self._began)[list(fields)]

    def inject_fault(self, axis: int, fault: str, value: int | None) -> None:
        """Inject a fault by its name."""
        with self._for_script():
            self.simulator.inject(fault, axis + 1, value)

    def end(self) -> None:
        """End under control, then without power."""
        with self._for_script():
            self.shut_down()

    def close(self) -> None:
        """Remove the power and end the simulation; idempotent."""
        if not self._closed:
            with self._for_script():
                self.__exit__()

    def _require_open(self) -> None:
        if self._closed:
            raise NotRunning("the simulation has ended")

    @contextmanager
    def _for_script(self) -> Iterator[None]:
        self._require_open()
        if not self._in_use.acquire(blocking=False):
            raise Error(
                "another thread, or a controller or program, uses this handle now; use it from one "
                "thread, outside of your controller"
            )
        try:
            with errors_for_scripts(), _interrupts_deferred():
                yield
        finally:
            self._in_use.release()


@contextmanager
def _interrupts_deferred() -> Iterator[None]:
    """Defer a Ctrl-C in the block to its end; a second one raises KeyboardInterrupt immediately."""
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield
        return
    interrupts = 0

    def note(_number: int, _frame: FrameType | None) -> None:
        nonlocal interrupts
        interrupts += 1
        if interrupts > 1:
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if interrupts == 1:
            raise KeyboardInterrupt
