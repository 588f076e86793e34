"""Booted drives run by a loop for a procedure, and left without power however it ends."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, Final

import numpy as np

from cdpr_drivers.axes import touch_probe
from cdpr_drivers.axes.axis_buses import AxisBuses
from cdpr_drivers.axes.homing import Homing
from cdpr_drivers.bus import query_status
from cdpr_drivers.canopen.boot.boot import BootReport
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import Mode
from cdpr_drivers.errors import DriveFaultError
from cdpr_drivers.robot.commissioned import identity_of
from cdpr_drivers.robot.machine import RobotMachine
from cdpr_drivers.robot.session_watch import Watching, no_watches
from cdpr_profiles import Robot, Winch
from cdpr_profiles.limits.robot_limits import Limit
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervision.limits import Limits
from cdpr_rt.core.supervision.supervisor import Supervisor
from cdpr_rt.errors import NotInTimeError
from cdpr_rt.identification.cogging_profile import DriveIdentity
from cdpr_rt.procedures.winch_operator import Tolerance, WinchOperator
from cdpr_rt.programs.axes.track import TrackProgram
from cdpr_rt.programs.axes.zero_torque import ZeroTorqueProgram
from cdpr_rt.robots.robot_arrays import RATED_SPEED_SHARE, limits_of
from cdpr_rt.runtime.control_loop.engine import HOLD, IDLE
from cdpr_rt.runtime.control_loop.loop import ControlLoop
from cdpr_rt.runtime.control_loop.loop_parts import LoopParts
from cdpr_rt.runtime.machine import MachineError
from cdpr_rt.runtime.realtime import paced_realtime
from cdpr_rt.runtime.warm_up import warm_up

_RING_S: Final = 8.0
_INDEX_TIMEOUT_S: Final = 30.0
_BRIDGED_CYCLES: Final = 2
_MISSED_CYCLES: Final = 3
# whatever ends a motion takes the torque at once, as nothing is held up by it; a watch may brake it
_REACTIONS: Final[Mapping[Limit, Reaction]] = {
    limit: Reaction.TORQUE_OFF
    for limit in Limit
    if limit not in (Limit.TORQUE, Limit.TORQUE_RATE, Limit.SAFETY_STOP)
}


class Session(WinchOperator):
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
        homing = Homing(*self.device.group_of(0), method, _INDEX_TIMEOUT_S)
        self.run_task(homing.configure)
        self.set_mode(Mode.HOMING)
        try:
            # the procedure keeps its own time; this one is there for a drive that stops responding
            self.let_drive(homing.update, 2.0 * _INDEX_TIMEOUT_S, "the encoder index (homing)")
        except BaseException:
            homing.abort()
            raise
        self.set_mode(self.device.torque_modes)

    def expect_index(self) -> None:
        """Have the first drive latch its index in the ordinary motion that follows."""
        group, place = self.device.group_of(0)
        self.run_task(lambda: touch_probe.arm(group, place))

    def bus_status(self) -> dict[str, dict[str, Any]]:
        """Return the status of each simulated bus, by the robot's name of it."""
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
        """What the first axis' drive reported when it booted."""
        return self.machine.reports[0]

    @property
    def drive_identity(self) -> DriveIdentity:
        """What a cogging profile is bound to, besides the motor."""
        return identity_of(self.boot)

    @property
    def torque_step_Nm(self) -> float:
        """The smallest difference of torque that the first drive can be commanded."""
        return abs(self.device.axes[0].Nm_per_unit)

    @property
    def is_simulated(self) -> bool:
        """Whether the first axis' bus is a simulated one, so that no real motor turns."""
        return self.network.url.is_simulated

    def bus_record(self) -> dict[str, Any]:
        """Return what reports tell of the first axis' bus."""
        status = self.bus_status().get(self.robot.axes[0].bus, {})
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
    """Boot the drives of `robot` on `buses`, what was given with --bus, with a loop to run them.

    What `watching` opens by the robot's clock is asked every cycle. Whatever ends the block, the
    drives have no power afterwards; raises DriveFaultError where that is not certain, and what
    `RobotMachine` and `watching` raise.
    """
    with ExitStack() as stack:
        machine = RobotMachine(robot, buses, safety_io, optional=True)
        stack.callback(machine.clock.close)
        warm_up(len(robot.axes), robot.sync_period_s)  # compiling keeps a poll waiting
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
    """Return the loop of the machine's axes, and its program."""
    robot, n, period_s = machine.robot, len(machine.robot.axes), machine.robot.sync_period_s
    block = SharedBlock.create(n, _RING_S, 1.0 / period_s)
    stack.callback(os.close, block.fd)
    track, limp = TrackProgram(n, period_s), ZeroTorqueProgram(n)
    parts = LoopParts(
        programs={IDLE: limp, HOLD: limp, track.name: track},
        supervisor=Supervisor(
            _limits(robot, tolerance), n, period_s, [axis.name for axis in robot.axes]
        ),
        estimator=Estimator(n, period_s),
        enable_realtime=lambda: stack.enter_context(paced_realtime()),
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
