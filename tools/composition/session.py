"""Booted drives that a loop runs for a command; whatever ends it, they have no power then."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_drivers.axes import homing as touch_probe
from cdpr_drivers.axes.axis_buses import AxisBuses
from cdpr_drivers.axes.homing import Homing
from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.budget import HEARTBEATS_IN_TOLERANCE
from cdpr_drivers.bus.simbus import open_clock
from cdpr_drivers.canopen.boot import BootReport
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import Mode
from cdpr_drivers.errors import BusError, ConfigurationError, DriveFaultError
from cdpr_drivers.modbus.tension import TensionSampler
from cdpr_drivers.robot.commissioned import identity_of
from cdpr_drivers.robot.machine import RobotMachine
from cdpr_drivers.robot.robot_buses import require_fit, starts_own_simulator
from cdpr_drivers.robot.safety import CLOSED
from cdpr_profiles import Robot, Winch, load_winch
from cdpr_profiles.eds import load_dictionary
from cdpr_profiles.robot import robot_of_winch
from cdpr_profiles.robot_limits import Limit
from cdpr_profiles.tension_sensor import load_load_cells
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.cycle import Watch
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import TensionWatch
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervisor import Limits, Supervisor
from cdpr_rt.errors import NotInTimeError
from cdpr_rt.identification.cogging_profile import DriveIdentity
from cdpr_rt.loop.engine import HOLD, IDLE, LoopParts
from cdpr_rt.loop.loop import ControlLoop
from cdpr_rt.loop.machine import MachineError
from cdpr_rt.loop.operating import Operator, Tolerance
from cdpr_rt.loop.realtime import paced_realtime
from cdpr_rt.loop.warm_up import warm_up
from cdpr_rt.model.robot_arrays import RATED_SPEED_SHARE, limits_of
from cdpr_rt.programs.idle import ZeroTorqueProgram
from cdpr_rt.programs.track import TrackProgram
from cdpr_tools.composition.local_simulator import LocalSimulator
from cdpr_tools.composition.loop_parts import control_loop
from cdpr_tools.consent import require_consent
from cdpr_tools.errors import BadInputError, raised_as
from cdpr_tools.output import Output
from cdpr_tools.signals import StopRequest, stop_on_signals

# Load cells that monitor a session: too much tension, or an unknown one, brakes the motion.

_FIRST_READINGS_S = 2.0


Watching = Callable[[Clock], AbstractContextManager[Sequence[Watch]]]
"""Opens watches of a session with its clock, for the duration of the block."""


def no_watches(_: Clock) -> AbstractContextManager[Sequence[Watch]]:
    """Open nothing."""
    return nullcontext(())


def tension_watch(sensors: str | None, port: str | None) -> Watching:
    """Return a function that opens load cells as a session's watch; no watch without `sensors`.

    Raises ConfigurationError if only one of `sensors` and `port` is given, and ProfileError.
    Opening the watch raises ModbusError if load cells do not answer.
    """
    if (sensors is None) != (port is None):
        raise ConfigurationError(
            "--sensors and --tension-port: give both, the load cells and their serial port"
        )
    if sensors is None or port is None:
        return no_watches
    profile, _ = load_load_cells(sensors)

    @contextmanager
    def watching(clock: Clock) -> Iterator[Sequence[Watch]]:
        with TensionSampler(profile, port, clock) as sampler:
            sampler.await_readings(_FIRST_READINGS_S)
            yield (TensionWatch(sampler.exchange, profile.stop_above_N),)

    return watching


_RING_S: Final = 8.0
_INDEX_TIMEOUT_S: Final = 30.0
_BRIDGED_CYCLES: Final = 2
_MISSED_CYCLES: Final = 3
# any failure removes the torque immediately, because the motors hold no load; a watch may brake
_REACTIONS: Final[Mapping[Limit, Reaction]] = {
    limit: Reaction.TORQUE_OFF
    for limit in Limit
    if limit not in (Limit.TORQUE, Limit.TORQUE_RATE, Limit.SAFETY_STOP)
}


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
        """Bus time from the first frame until the last drive is operational."""

    @property
    def device(self) -> AxisBuses:
        """The booted axes."""
        device = self.machine.device
        assert device is not None  # true until the session is closed
        return device

    def set_mode(self, modes: int | Sequence[int]) -> None:
        """Request a mode of operation, one for all or one each, and wait until all confirm it.

        Raises ModeRefusedError if one does not.
        """
        device = self.device
        self.between_cycles(lambda: device.ask_mode(modes))
        timeout_s = max(axis.winch.drive.mode_display_timeout_s for axis in self.robot.axes)
        try:
            self.wait(device.mode_confirmed, timeout_s, "confirmation of the modes")
        except NotInTimeError as error:
            if device.mode_confirmed():
                raise
            raise device.unconfirmed_mode() from error

    def find_index(self, method: int = 34) -> None:
        """Find the first axis' encoder index by homing, which turns the motor by at most one turn.

        Afterwards the drive is in its torque mode again, without power.
        """
        homing = Homing(*self.device.group_of(0), method, _INDEX_TIMEOUT_S)
        self.run_task(homing.configure)
        self.set_mode(Mode.HOMING)
        try:
            # the procedure has its own timeout; this one is for a drive that no longer responds
            self.let_drive(homing.update, 2.0 * _INDEX_TIMEOUT_S, "the encoder index (homing)")
        except BaseException:
            homing.abort()
            raise
        self.set_mode(self.device.torque_modes)

    def expect_index(self) -> None:
        """Let the first drive latch its index during the following motion."""
        group, place = self.device.group_of(0)
        self.run_task(lambda: touch_probe.arm(group, place))

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
        """The report of the first axis' drive at boot."""
        return self.machine.reports[0]

    @property
    def drive_identity(self) -> DriveIdentity:
        """Identity of the drive, to which a cogging profile is bound in addition to the motor."""
        return identity_of(self.boot)

    @property
    def identity(self) -> dict[str, Any]:
        """Origin of raw data: winch, motor, drive."""
        whose = {"winch": self.winch.reference, "motor": self.winch.motor.model}
        return whose | self.drive_identity.model_dump()

    @property
    def torque_step_Nm(self) -> float:
        """The smallest torque step that can be commanded to the first drive."""
        return abs(self.device.axes[0].Nm_per_unit)

    @property
    def is_simulated(self) -> bool:
        """Whether the first axis' bus is simulated, so that no real motor turns."""
        return self.network.url.is_simulated

    def bus_record(self) -> dict[str, Any]:
        """Return data about the first axis' bus for reports."""
        status = self.machine.simulated_status().get(self.robot.axes[0].bus, {})
        known = {key: status[key] for key in ("load", "peak_cycle_load", "overruns") if status}
        return {"url": str(self.network.url), "missed": self.device.missed, **known}


@contextmanager
def booted(
    robot: Robot,
    buses: Sequence[str],
    stop_requested: Callable[[], bool],
    safety_io: str | None = None,
    watching: Watching = no_watches,
    tolerance: Tolerance | None = None,
) -> Iterator[Session]:
    """Boot the drives of `robot` on `buses`, the values of --bus, with a loop to run them.

    The watches that `watching` opens are checked every cycle. However the block ends, the
    drives have no power afterwards; raises DriveFaultError if that is not certain, and the errors
    of `RobotMachine` and `watching`.
    """
    with ExitStack() as stack:
        machine = RobotMachine(robot, buses, safety_io, optional=True)
        stack.callback(machine.clock.close)
        warm_up(len(robot.axes), robot.sync_period_s)  # compiling later would delay a poll
        loop, track = _loop_of(stack, machine, tolerance or Tolerance())
        watches = stack.enter_context(watching(machine.clock))
        begun_s = machine.clock.now_s
        stack.enter_context(_powered_off_at_last(machine))
        boot_s = machine.clock.now_s - begun_s
        if len(machine.robot.axes) < len(robot.axes):
            loop, track = _loop_of(stack, machine, tolerance or Tolerance())
        session = Session(machine.robot, machine, loop, track, stop_requested)
        session.boot_s = boot_s
        session.device.tolerate_silence(_BRIDGED_CYCLES)
        machine.watches = (*machine.watches, *watches)
        yield session


def _loop_of(
    stack: ExitStack, machine: RobotMachine, tolerance: Tolerance
) -> tuple[ControlLoop, TrackProgram]:
    """Return the loop of the machine's axes, and the program that it runs."""
    robot, n, period_s = machine.robot, len(machine.robot.axes), machine.robot.sync_period_s
    limits = _limits(robot, tolerance)
    block = SharedBlock.create(n, _RING_S, 1.0 / period_s)
    stack.callback(os.close, block.fd)
    track, limp = TrackProgram(n, period_s), ZeroTorqueProgram(n)
    parts = LoopParts(
        programs={IDLE: limp, HOLD: limp, track.name: track},
        supervisor=Supervisor(limits, n, period_s),
        estimator=Estimator(n, period_s),
        axis_names=[axis.name for axis in robot.axes],
        enable_realtime=lambda: stack.enter_context(paced_realtime()),
    )
    return control_loop(robot, limits, block, machine, parts), track


@contextmanager
def _powered_off_at_last(machine: RobotMachine) -> Iterator[None]:
    """Boot the drives; cut their power at the end, and report if that is not certain."""
    try:
        machine.open()
    except MachineError as error:
        if error.__cause__ is None:
            raise
        raise error.__cause__  # noqa: B904  # the cause decides how the command ends
    try:
        yield
    except BaseException as error:
        try:
            unconfirmed = machine.close()
        except MachineError as another:
            unconfirmed = str(another)
        if unconfirmed:
            error.add_note(unconfirmed)
        raise
    if unconfirmed := machine.close():
        raise DriveFaultError(unconfirmed)


def _limits(robot: Robot, tolerance: Tolerance) -> Limits:
    rated = np.array([axis.winch.motor.rated_speed_rad_s for axis in robot.axes])
    speed = RATED_SPEED_SHARE * rated if tolerance.speed_rad_s is None else tolerance.speed_rad_s
    torque_Nm = limits_of(robot).torque_Nm
    return Limits(
        torque_Nm, speed, tolerance.following_error_rad, _MISSED_CYCLES, reactions=_REACTIONS
    )


# Sessions as commands open them, with their own simulator if `simbus:` has no name.


def open_bus(text: str) -> BusUrl:
    """Return the bus that `text` names; raises BadInputError."""
    with raised_as(BadInputError, BusError):
        return BusUrl.parse(text)


def confirm_motion(url: BusUrl, yes: bool, what: str) -> None:
    """Ask before a real motor gets power; raises BadInputError if the user does not agree."""
    require_consent(f"{what} on {url}: the motor will turn.", yes or url.is_simulated)


@contextmanager
def open_network(
    winch: Winch, url: BusUrl, out: Output, plant: Path | None = None
) -> Iterator[CanNetwork]:
    """Join the bus for acyclic work, with its own simulator if `simbus:` has no name.

    Raises ConfigurationError for a cycle that does not fit the bus, and BadInputError for a bus
    that cannot be opened.
    """
    require_fit(winch)
    with ExitStack() as stack:
        bus = find_bus(stack, winch, url, out, plant)
        clock = open_clock([bus])
        stack.callback(clock.close)
        heartbeat_s = _heartbeat_s(winch)
        with raised_as(BadInputError, BusError):
            network = CanNetwork(bus, clock, [winch.node_id], winch.master_node_id, heartbeat_s)
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
    """Boot the winch's drive on `url` and prepare to run its axis, in its torque mode.

    `safety_io` is the profile of a safety I/O; power is then possible only while this device allows
    it. The watches that `watching` opens are also checked every cycle. A drive in fault is
    rejected, or acknowledged with `reset`. However the block ends, the drive's power stage is off
    afterwards. Raises ConfigurationError if the bus cannot be opened, and the drivers' errors if
    the drive does not boot. Also raises the errors of `watching` and of the safety I/O.
    """
    require_fit(winch)
    with ExitStack() as stack:
        stop_requested = stack.enter_context(stop_on_signals())
        robot = robot_of_winch(winch)
        bus = find_bus(stack, winch, url, out, plant, truth_log)
        axis = replace(robot.axes[0], winch=winch)  # the drive waits as long as its profile says
        robot = replace(robot, axes=(axis,), master_heartbeat_s=_heartbeat_s(winch))
        session = stack.enter_context(
            booted(robot, [str(bus)], stop_requested, safety_io, watching, tolerance)
        )
        stack.callback(stop_requested.closing)  # before the power is cut
        _prepare(session, stop_requested, out, reset)
        yield session


@contextmanager
def open_robot(
    robot: Robot,
    buses: Sequence[str],
    out: Output,
    *,
    safety_io: str | None = None,
    reset: bool = False,
) -> Iterator[Session]:
    """Boot all drives of `robot`, and prepare to run its axes as `open_winch` does.

    `buses` are the values of --bus; `simbus:` alone starts a simulator of all buses. By default
    `safety_io` is the robot's own, unless all buses are simulated.
    """
    require_fit(robot)
    with ExitStack() as stack:
        stop_requested = stack.enter_context(stop_on_signals())
        if starts_own_simulator(buses):
            out.note(f"starting simulated drives: {len(robot.axes)} ...")
            buses = [simulator_of(stack, robot)]
        session = stack.enter_context(booted(robot, buses, stop_requested, safety_io))
        stack.callback(stop_requested.closing)  # before the power is cut
        _prepare(session, stop_requested, out, reset)
        yield session


def _prepare(session: Session, stop_requested: StopRequest, out: Output, reset: bool) -> None:
    """Check the cycles of a booted session, and report notes about its drives."""
    stop_requested.energised = True
    session.check(reset)
    for notice in (*session.machine.notices, *session.loop.engine.notices):
        out.note(notice)
    if session.machine.safety:
        out.note(f"{session.machine.safety}: {CLOSED}")


def _heartbeat_s(winch: Winch) -> float:
    """Return a period of the master's heartbeat that the drive tolerates."""
    return winch.drive.heartbeat_consumer_s / HEARTBEATS_IN_TOLERANCE


def find_bus(
    stack: ExitStack,
    winch: Winch,
    url: BusUrl,
    out: Output,
    plant: Path | None,
    truth_log: Path | None = None,
    board: Path | None = None,
) -> BusUrl:
    """Return the winch's bus; `simbus:` without a name starts a simulator."""
    if url.starts_own_simulator:
        out.note("starting the simulated drive ...")
        robot = robot_of_winch(load_winch(winch.reference))  # as in its file
        return open_bus(simulator_of(stack, robot, plant, truth_log, board))
    if plant is not None:
        raise BadInputError("--plant: only for a simulator that the command starts (simbus:)")
    return url


def simulator_of(
    stack: ExitStack,
    robot: Robot,
    plant: Path | None = None,
    truth_log: Path | None = None,
    board: Path | None = None,
    *,
    detached: bool = False,
) -> str:
    """Start a simulator of `robot` that `stack` stops; return its bus."""
    simulator = LocalSimulator(robot, plant, truth_log, board=board, detached=detached)
    stack.callback(simulator.stop)
    return simulator.bus
