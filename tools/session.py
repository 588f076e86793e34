"""Drives opened for a command, run by the daemon's loop, and left without power however it ends."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_rt.cogging_profile import DriveIdentity
from cdpr_rt.errors import NotInTimeError
from cdpr_rt.limits import Limit, Limits
from cdpr_rt.realtime import one_core, paced_realtime
from cdpr_rt.rehearsal import rehearse
from cdpr_rt.runtime.estimate import Estimator
from cdpr_rt.runtime.loop import HOLD, IDLE, ControlLoop
from cdpr_rt.runtime.loop_parts import LoopParts
from cdpr_rt.runtime.machine import MachineError
from cdpr_rt.runtime.operating import Operator
from cdpr_rt.runtime.programs.limp import LimpProgram
from cdpr_rt.runtime.programs.track import TrackProgram
from cdpr_rt.runtime.robot_arrays import SPEED_SHARE, limits_of
from cdpr_rt.runtime.shared_block import SharedBlock
from cdpr_rt.runtime.states import Reaction
from cdpr_rt.supervisor import Supervisor
from drivers import touch_probe
from drivers.axis_buses import AxisBuses
from drivers.boot import BootReport
from drivers.bus import BusUrl, query_status
from drivers.bus.budget import HEARTBEATS_IN_TOLERANCE
from drivers.bus.leading import open_clock
from drivers.cia402 import Mode
from drivers.data_sheet import load_dictionary
from drivers.errors import BusError, DriveFaultError
from drivers.homing import Homing
from drivers.network import CanNetwork
from profiles import Robot, Winch
from profiles.robot import robot_of_winch
from tools.bus_fit import require_fit
from tools.commissioned import identity_of
from tools.consent import require_consent
from tools.daemon.machine import RobotMachine
from tools.errors import BadInputError
from tools.output import Output
from tools.robot_buses import asks_for_own_simulator
from tools.safety import CLOSED
from tools.signals import StopRequest, stop_on_signals
from tools.simulator import OwnSimulator
from tools.tension.session_watch import Watching, no_watches

_RING_S: Final = 8.0
_INDEX_TIMEOUT_S: Final = 30.0
_BRIDGED_CYCLES: Final = 2
# whatever ends a motion takes the torque at once, as nothing is held up by it; a watch may brake it
_REACTIONS: Final[Mapping[Limit, Reaction]] = {
    limit: Reaction.TORQUE_OFF
    for limit in Limit
    if limit not in (Limit.TORQUE, Limit.TORQUE_RATE, Limit.SAFETY_STOP)
}


@dataclass(frozen=True)
class Tolerance:
    """What a motion may do before it is ended; a bare rotor may swing by turns without harm."""

    following_error_rad: float = 4.0 * math.tau
    speed_rad_s: float | None = None
    """A share of each motor's rated speed where left out."""


class Session(Operator):
    """Booted drives, of one winch or of a robot, and the loop that runs them for a command."""

    def __init__(
        self,
        robot: Robot,
        machine: RobotMachine,
        loop: ControlLoop,
        track: TrackProgram,
        stop_requested: Callable[[], bool],
    ) -> None:
        super().__init__(loop, track, loop.turn, stop_requested)
        self.robot = robot
        self.machine = machine
        self.boot_s = 0.0
        """Bus time from the first frame to the last drive being operational."""
        self.simulator_pid: int | None = None
        """Process of the simulator that the command has started."""

    @property
    def device(self) -> AxisBuses:
        """The booted axes."""
        device = self.machine.device
        assert device is not None  # until the session is closed
        return device

    def set_mode(self, modes: int | Sequence[int]) -> None:
        """Ask for a mode of operation, one for all or one each, and wait until all confirm it.

        Raises ModeRefusedError when one does not.
        """
        device = self.device
        self.between_cycles(lambda: device.ask_mode(modes))
        timeout_s = max(axis.winch.drive.mode_display_timeout_s for axis in self.robot.axes)
        try:
            self.wait(device.mode_confirmed, timeout_s, "the modes' confirmation")
        except NotInTimeError as error:
            if device.mode_confirmed():
                raise
            raise device.unconfirmed_mode() from error

    def find_index(self, method: int = 34) -> None:
        """Find the first axis' encoder index by homing, which turns the motor by up to a turn.

        It is in its torque mode again afterwards, without power.
        """
        homing = Homing(*self.device.part_of(0), method, _INDEX_TIMEOUT_S)
        self.beside(homing.configure)
        self.set_mode(Mode.HOMING)
        try:
            # the procedure keeps its own time; this one is there for a drive gone deaf
            self.let_drive(homing.update, 2.0 * _INDEX_TIMEOUT_S, "the encoder index (homing)")
        except BaseException:
            homing.abort()
            raise
        self.set_mode(self.device.torque_modes)

    def expect_index(self) -> None:
        """Have the first drive latch its index in the ordinary motion that follows."""
        group, place = self.device.part_of(0)
        self.beside(lambda: touch_probe.arm(group, place))

    def bus_status(self) -> dict[str, dict[str, Any]]:
        """Return what each simulated bus tells of itself, by the robot's name of it."""
        return {
            name: query_status(network.url.channel)
            for name, network in self.machine.networks.items()
            if network.url.is_simulated
        }

    def sync_offset(self) -> int:
        """Return how many SYNCs a simulated bus had seen before our first cycle."""
        status = next(iter(self.bus_status().values()), {})
        return int(status.get("sync_count", 0)) - self.device.feedback.cycle

    # -- of one winch

    @property
    def winch(self) -> Winch:
        """The first axis' winch."""
        return self.robot.axes[0].winch

    @property
    def network(self) -> CanNetwork:
        """The first axis' bus."""
        return self.machine.networks[self.robot.axes[0].bus]

    @property
    def boot(self) -> BootReport:
        """What the first axis' drive told when it booted."""
        return self.machine.reports[0]

    @property
    def drive_identity(self) -> DriveIdentity:
        """What a cogging profile is bound to, besides the motor."""
        return identity_of(self.boot)

    @property
    def identity(self) -> dict[str, Any]:
        """What raw data keep of where they come from."""
        whose = {"winch": self.winch.reference, "motor": self.winch.motor.model}
        return whose | self.drive_identity.model_dump()


def open_bus(text: str) -> BusUrl:
    """Return the bus that `text` names; raises BadInputError."""
    try:
        return BusUrl.parse(text)
    except BusError as error:
        raise BadInputError(str(error)) from error


def confirm_motion(url: BusUrl, yes: bool, what: str) -> None:
    """Ask before a real motor is energised; raises BadInputError when nobody agrees."""
    require_consent(f"{what} on {url}: the motor will turn.", yes or url.is_simulated)


@contextmanager
def open_network(
    winch: Winch, url: BusUrl, out: Output, plant: Path | None = None
) -> Iterator[CanNetwork]:
    """Join the bus for acyclic work, with a simulator of its own where `simbus:` has no name.

    Raises BadInputError for a cycle that does not fit the bus, and for a bus that cannot be opened.
    """
    require_fit(winch)
    with ExitStack() as stack:
        bus, _ = _find_bus(stack, winch, url, out, plant)
        clock = open_clock([bus])
        stack.callback(clock.close)
        heartbeat_s = _heartbeat_s(winch)
        try:
            network = CanNetwork(bus, clock, [winch.node_id], winch.master_node_id, heartbeat_s)
        except BusError as error:
            raise BadInputError(str(error)) from error
        stack.callback(network.close)
        network.add_node(winch.node_id, load_dictionary(winch.drive.eds, winch.node_id))
        yield network


@contextmanager
def open_winch(
    winch: Winch,
    url: BusUrl,
    out: Output,
    plant: Path | None = None,
    truth_log: Path | None = None,
    safety_io: str | None = None,
    watching: Watching = no_watches,
    tolerance: Tolerance | None = None,
    reset: bool = False,
) -> Iterator[Session]:
    """Boot the winch's drive on `url` and get ready to run its axis, in its torque mode.

    With `safety_io`, the profile of a safety I/O, there is power only while that allows it;
    what `watching` opens by the robot's clock is asked every cycle besides. A drive in fault is
    refused, or acknowledged with `reset`. Whatever ends the block, the drive's power stage is off
    afterwards. Raises BadInputError for a bus that cannot be opened, what `watching` and the safety
    I/O raise, and the drivers' errors for a drive that does not boot.
    """
    require_fit(winch)
    with ExitStack() as stack:
        stop_requested = stack.enter_context(stop_on_signals())
        bus, pid = _find_bus(stack, winch, url, out, plant, truth_log)
        robot = robot_of_winch(winch)
        axis = replace(robot.axes[0], winch=winch)  # whose drive waits as long as its profile says
        robot = replace(robot, axes=(axis,), master_heartbeat_s=_heartbeat_s(winch))
        opened = _open(
            stack, robot, [str(bus)], stop_requested, out, safety_io, watching, tolerance, reset
        )
        opened.simulator_pid = pid
        yield opened


@contextmanager
def open_robot(
    robot: Robot,
    buses: Sequence[str],
    out: Output,
    *,
    plant: Path | None = None,
    safety_io: str | None = None,
    reset: bool = False,
) -> Iterator[Session]:
    """Boot all drives of `robot`, and get ready to run its axes as `open_winch` does.

    `buses` are what was given with --bus; `simbus:` alone starts a simulator of all buses, with
    `plant`. Where no `safety_io` is named the robot's own counts, unless all buses are simulated.
    """
    require_fit(robot)
    with ExitStack() as stack:
        stop_requested = stack.enter_context(stop_on_signals())
        pid = None
        if asks_for_own_simulator(buses):
            out.note(f"starting simulated drives: {len(robot.axes)} ...")
            buses, pid = _own_simulator(stack, robot.reference, plant)
        elif plant is not None:
            raise _plant_not_ours()
        opened = _open(stack, robot, buses, stop_requested, out, safety_io, reset=reset)
        opened.simulator_pid = pid
        yield opened


def _open(
    stack: ExitStack,
    robot: Robot,
    buses: Sequence[str],
    stop_requested: StopRequest,
    out: Output,
    safety_io: str | None = None,
    watching: Watching = no_watches,
    tolerance: Tolerance | None = None,
    reset: bool = False,
) -> Session:
    """Return the robot, booted and checked; `stack` leaves it without power."""
    machine = RobotMachine(robot, buses, safety_io, optional=True)
    stack.callback(machine.clock.close)
    rehearse(len(robot.axes), robot.sync_period_s)  # compiling keeps a poll waiting
    loop, track = _loop_of(stack, machine, tolerance or Tolerance())
    watches = stack.enter_context(watching(machine.clock))
    begun_s = machine.clock.now_s
    stack.enter_context(_powered_off_at_last(machine))
    boot_s = machine.clock.now_s - begun_s
    if len(machine.robot.axes) < len(robot.axes):
        loop, track = _loop_of(stack, machine, tolerance or Tolerance())
    session = Session(machine.robot, machine, loop, track, stop_requested)
    session.boot_s = boot_s
    stack.callback(stop_requested.closing)  # before what is closed above
    stop_requested.energised = True
    session.device.tolerate_silence(_BRIDGED_CYCLES)
    machine.watches = (*machine.watches, *watches)
    session.check(reset)
    for notice in (*machine.notices, *loop.notices):
        out.note(notice)
    if machine.safety:
        out.note(f"{machine.safety}: {CLOSED}")
    return session


def _loop_of(
    stack: ExitStack, machine: RobotMachine, tolerance: Tolerance
) -> tuple[ControlLoop, TrackProgram]:
    """Return the loop of the machine's axes, and its program."""
    robot, n, period_s = machine.robot, len(machine.robot.axes), machine.robot.sync_period_s
    block = SharedBlock.create(n, _RING_S, 1.0 / period_s)
    stack.callback(os.close, block.fd)
    track, limp = TrackProgram(n, period_s), LimpProgram(n)
    parts = LoopParts(
        programs={IDLE: limp, HOLD: limp, track.name: track},
        supervisor=Supervisor(_limits(robot, tolerance), n, period_s),
        estimator=Estimator(n, period_s),
        punctual=lambda: stack.enter_context(paced_realtime()),
    )
    return ControlLoop(block, machine, parts), track


@contextmanager
def _powered_off_at_last(machine: RobotMachine) -> Iterator[None]:
    """Boot the drives; take their power at the end, and tell where that is not certain."""
    try:
        machine.open()
    except MachineError as error:
        if error.__cause__ is None:
            raise
        raise error.__cause__  # noqa: B904  # what it is decides how the command ends
    try:
        yield
    except BaseException as error:
        try:
            doubt = machine.close()
        except MachineError as another:
            doubt = str(another)
        if doubt:
            error.add_note(doubt)
        raise
    if doubt := machine.close():
        raise DriveFaultError(doubt)


def _limits(robot: Robot, tolerance: Tolerance) -> Limits:
    rated = np.array([axis.winch.motor.rated_speed_rad_s for axis in robot.axes])
    speed = SPEED_SHARE * rated if tolerance.speed_rad_s is None else tolerance.speed_rad_s
    torque_Nm = limits_of(robot).torque_Nm
    return Limits(torque_Nm, speed, tolerance.following_error_rad, reactions=_REACTIONS)


def _heartbeat_s(winch: Winch) -> float:
    """Return how often the master is heard within what the drive tolerates."""
    return winch.drive.heartbeat_consumer_s / HEARTBEATS_IN_TOLERANCE


def _find_bus(
    stack: ExitStack,
    winch: Winch,
    url: BusUrl,
    out: Output,
    plant: Path | None,
    truth_log: Path | None = None,
) -> tuple[BusUrl, int | None]:
    """Return the winch's bus, and the process of its simulator where one was to be started."""
    if url.starts_own_simulator:
        out.note("starting the simulated drive ...")
        (bus,), pid = _own_simulator(stack, winch.reference, plant, truth_log)
        return open_bus(bus), pid
    if plant is not None:
        raise _plant_not_ours()
    return url, None


def _plant_not_ours() -> BadInputError:
    return BadInputError("--plant: only for a simulator that the command starts (simbus:)")


def _own_simulator(
    stack: ExitStack, reference: str, plant: Path | None, truth_log: Path | None = None
) -> tuple[list[str], int]:
    bus = f"simbus:own-{os.getpid()}"
    simulator = OwnSimulator(reference, bus, plant, truth_log)
    stack.callback(simulator.stop)
    stack.enter_context(one_core(simulator.process.pid))
    return [bus], simulator.process.pid
