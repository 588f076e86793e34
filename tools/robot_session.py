"""A whole robot on its buses, opened for a command and left without power, however it ends."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_rt.errors import TripError
from cdpr_rt.executive import Executive, Watch
from cdpr_rt.realtime import one_core, paced_realtime
from cdpr_rt.rehearsal import rehearse
from cdpr_rt.supervisor import Limits, Supervisor
from drivers.axis_buses import AxisBuses
from drivers.boot import BootReport
from drivers.bus import BusUrl, query_status
from drivers.bus.leading import open_clock
from drivers.cia402 import State
from drivers.errors import DriveFaultError
from drivers.network import CanNetwork
from profiles import Robot, RobotAxis
from tools.bus_fit import require_fit
from tools.errors import BadInputError
from tools.output import Output
from tools.robot_boot import boot_notes, boot_robot, device_of, faults_text, open_networks
from tools.robot_buses import asks_for_own_simulator, robot_urls
from tools.safety import SessionSafety, open_safety
from tools.signals import stop_on_signals
from tools.simulator import OwnSimulator

_SPEED_SHARE = 0.2
# a bare rotor may swing by turns without doing harm; its speed is what is limited
_FOLLOWING_ERROR_RAD = 4.0 * math.tau


class RobotSession:
    """A booted robot and the executive that runs its axes.

    `axes` are those which booted, in the order of the robot's file and of the device's arrays;
    `absent` says of each optional axis that did not, by its number in the file, why.
    """

    def __init__(
        self,
        robot: Robot,
        networks: Mapping[str, CanNetwork],
        device: AxisBuses,
        executive: Executive,
        axes: Sequence[RobotAxis],
        reports: Sequence[BootReport],
        absent: Mapping[int, str],
        safety: SessionSafety | None = None,
    ) -> None:
        self.robot = robot
        self.networks = networks
        self.device = device
        self.executive = executive
        self.axes = tuple(axes)
        self.reports = tuple(reports)
        self.absent = dict(absent)
        self.safety = safety
        self.boot_s = 0.0
        """Wall time from the first frame to the last drive being operational."""
        self.simulator_pid: int | None = None
        """Process of the simulator that the command has started."""
        self._paused: list[tuple[RobotAxis, list[tuple[int, int]]]] = []

    def set_mode(self, modes: int | Sequence[int]) -> None:
        """Ask for a mode of operation, one for all or one each, and wait until all confirm it.

        Raises ModeRefusedError when one does not.
        """
        self.device.ask_mode(modes)
        timeout = max(axis.winch.drive.mode_display_timeout_s for axis in self.axes)
        try:
            self.executive.step(self.device.mode_confirmed, timeout, "the modes' confirmation")
        except TripError as error:
            if self.device.alarm() or self.device.mode_confirmed():
                raise
            raise self.device.unconfirmed_mode() from error

    def set_torque_mode(self) -> None:
        """Put each drive into the mode in which it obeys a torque; raises ModeRefusedError."""
        self.set_mode(self.device.torque_modes)

    def enable(self) -> None:
        """Switch all power stages on; the torque is zero until a controller runs."""
        for axis, entries in self._paused:
            self.networks[axis.bus].resume_watch(axis.node_id, entries)
        self._paused = []
        self._lead_to(State.OPERATION_ENABLED)
        if self.safety is not None:
            self.safety.release_brakes(self.executive)

    def disable(self) -> None:
        """Switch all power stages off, so that computation may take its time."""
        if self.safety is not None:
            self.safety.apply_brakes(self.executive)
        self._lead_to(State.SWITCH_ON_DISABLED)
        self.device.stop_cycling()
        # a drive that was disabled before watches nothing now, and is to watch again all the same
        self._paused += [
            (axis, self.networks[axis.bus].pause_watch(axis.node_id) or []) for axis in self.axes
        ]

    def reset_fault(self) -> None:
        """Acknowledge all faults; the drives are left without power. Raises TripError."""
        device = self.device
        device.sync()
        device.receive()
        device.transmit()
        device.acknowledge_fault()
        self._lead_to(State.SWITCH_ON_DISABLED)
        device.stop_cycling()

    def idle(self, seconds: float) -> None:
        """Run cycles without torque for a while."""
        cycles = iter(range(round(seconds / self.device.period_s)))
        self.executive.step(lambda: next(cycles, None) is None, seconds + 1.0, "the end")

    def bus_status(self) -> dict[str, dict[str, Any]]:
        """Return what each simulated bus tells of itself, by the robot's name of it."""
        return {
            name: query_status(network.url.channel)
            for name, network in self.networks.items()
            if network.url.is_simulated
        }

    def _lead_to(self, state: State) -> None:
        self.device.request(state)
        timeout = 4.0 * max(axis.winch.drive.state_timeout_s for axis in self.axes)
        what = f"the state {state.label!r} of all drives"
        try:
            self.executive.step(lambda: self.device.reached(state), timeout, what)
        except TripError as error:
            left = [
                f"bus {axis.bus} node {axis.node_id} is {now.label!r}"
                for axis, now in zip(self.axes, self.device.states(), strict=True)
                if now != state
            ]
            if self.device.alarm() or not left:
                raise
            raise TripError(f"{error}: {', '.join(left)}") from error


@contextmanager
def open_robot(
    robot: Robot,
    buses: Sequence[str],
    out: Output,
    *,
    plant: Path | None = None,
    torque_share: float = 1.0,
    safety_io: str | None = None,
) -> Iterator[RobotSession]:
    """Boot the drives of `robot`, all at the same time, and get ready to run its axes.

    `buses` are what was given with --bus; `simbus:` alone starts a simulator of all buses, with
    `plant`. Torques are limited to `torque_share` of each motor's rated torque. Whatever ends the
    block, the drives' power stages are off afterwards.

    With `safety_io` there is power only while that safety I/O allows it; without, the robot's own
    counts, unless all buses are simulated. Raises BadInputError for a robot that does
    not fit its buses (before anything is opened) and for buses that cannot be opened,
    WorkFailedError for a mandatory drive that does not boot, and what `open_safety` raises.
    """
    require_fit(robot)
    with ExitStack() as stack:
        stop_requested = stack.enter_context(stop_on_signals())
        urls, pid = _find_buses(stack, robot, buses, out, plant)
        nodes = [axis.node_id for axis in robot.axes]
        real = not all(url.is_simulated for url in urls.values())
        reference = safety_io or (robot.safety_io if real else None)
        rehearse(len(robot.axes), robot.sync_period_s)  # compiling may keep a poll waiting
        clock = open_clock(urls.values())
        stack.callback(clock.close)
        safety = stack.enter_context(open_safety(reference, out, nodes, clock))
        networks = open_networks(stack, robot, urls, clock)
        begin = time.monotonic()
        torque_Nm = [torque_share * axis.winch.motor.rated_torque_Nm for axis in robot.axes]
        booted, absent = boot_robot(stack, robot, networks, torque_Nm)
        boot_s = time.monotonic() - begin
        for note in boot_notes(robot, booted, absent):
            out.note(note)
        axes = [robot.axes[i] for i in booted]
        device = stack.enter_context(device_of(robot, networks, booted, torque_Nm))
        if safety is not None:
            stack.callback(safety.drop_brakes)
        stack.callback(stop_requested.closing)  # before what is closed above
        stop_requested.energised = True
        for network in networks.values():
            network.start_heartbeat()
        if not device.lockstep:
            for notice in stack.enter_context(paced_realtime()):
                out.note(notice)
        watches = () if safety is None else (safety.io,)
        executive = _executive(device, axes, torque_share, stop_requested, watches)
        session = RobotSession(
            robot, networks, device, executive, axes, list(booted.values()), absent, safety
        )
        session.boot_s, session.simulator_pid = boot_s, pid
        try:
            yield session
        except TripError as error:
            raise _explained(session, error) from error


def _find_buses(
    stack: ExitStack, robot: Robot, buses: Sequence[str], out: Output, plant: Path | None
) -> tuple[dict[str, BusUrl], int | None]:
    """Return the robot's buses, and the process of their simulator where one was to be started."""
    if asks_for_own_simulator(buses):
        pid, name = _own_simulator(stack, robot, out, plant)
        return robot_urls(robot, [name]), pid
    if plant is not None:
        raise BadInputError("--plant: only for a simulator that the command starts (simbus:)")
    return robot_urls(robot, buses), None


def _explained(session: RobotSession, error: TripError) -> TripError | DriveFaultError:
    """Return `error` with what the safety I/O and the drives in fault say of it."""
    reason, faulted = str(error), session.device.faulted().any()
    if faulted:
        reason = f"{reason}: {faults_text(session.axes, session.device, session.networks)}"
    if session.safety is not None:
        reason = session.safety.cause(reason)
    return (DriveFaultError if faulted else TripError)(reason)


def _own_simulator(
    stack: ExitStack, robot: Robot, out: Output, plant: Path | None
) -> tuple[int, str]:
    name = f"simbus:own-{os.getpid()}"
    out.note(f"starting simulated drives: {len(robot.axes)} ...")
    simulator = OwnSimulator(robot.reference, name, plant)
    stack.callback(simulator.stop)
    stack.enter_context(one_core(simulator.process.pid))
    return simulator.process.pid, name


def _executive(
    device: AxisBuses,
    axes: Sequence[RobotAxis],
    torque_share: float,
    stop_requested: Callable[[], bool],
    watches: Sequence[Watch],
) -> Executive:
    limits = Limits(
        torque_Nm=torque_share * np.array([axis.winch.motor.rated_torque_Nm for axis in axes]),
        speed_rad_s=_SPEED_SHARE * np.array([axis.winch.motor.rated_speed_rad_s for axis in axes]),
        following_error_rad=_FOLLOWING_ERROR_RAD,
    )
    supervisor = Supervisor(limits, device.n, device.period_s)
    return Executive(device, supervisor, stop_requested, watches)
