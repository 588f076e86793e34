"""The daemon's real-time process: one robot's control loop, from boot to controlled stop."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path
from types import FrameType

from cdpr_drivers.errors import DriverError
from cdpr_drivers.robot.commissioned import with_commissioned
from cdpr_drivers.robot.listening_machine import ListeningMachine
from cdpr_drivers.robot.machine import RobotMachine
from cdpr_drivers.robot.robot_buses import refuse_simulated_calibration, require_fit, robot_urls
from cdpr_profiles import Robot
from cdpr_profiles.calibration_in_force import load_calibrated
from cdpr_profiles.errors import ProfileError, printable
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.diagnosis.checks import refuse_impossible
from cdpr_rt.errors import ControlError
from cdpr_rt.loop.loop import ControlLoop
from cdpr_rt.loop.machine import Machine
from cdpr_rt.loop.realtime import freeze_memory
from cdpr_rt.loop.stop_socket import STOP_SUFFIX, StopSocket
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.programs.path_store import PathStore, paths_folder
from cdpr_rt.state_file import state_path
from cdpr_tools.compiling import announce_compiling
from cdpr_tools.composition.loop_parts import control_loop, loop_parts
from cdpr_tools.daemon.child import POWER_UNCONFIRMED, end_with_launcher
from cdpr_tools.daemon.loop_file import POWER_OFF_SIGNAL
from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.errors import BAD_INPUT, DONE, BadInputError
from cdpr_tools.streams import guard_streams, outlive_output


def main() -> int:
    """Run the loop as the launcher requested; return the exit status."""
    guard_streams()
    outlive_output()
    announce_compiling("the control loop")
    settings = RunSettings.from_argv()
    block = SharedBlock.attach(settings.block_fd)
    try:
        robot = load_calibrated(settings.robot)
        limits = limits_of(robot)
        refuse_impossible(robot, limits)
        refuse_simulated_calibration(robot, settings.buses)
        robot = with_commissioned(robot, settings.commissioned)
        require_fit(robot)
        machine: Machine
        if settings.read_only:
            machine = ListeningMachine(robot, settings.buses)
        else:
            machine = RobotMachine(
                robot, settings.buses, settings.safety_io, settings.tension_port, real_time=True,
                limits=limits,
            )  # fmt: skip
        parts = loop_parts(robot, limits, block, own=settings.own.load())
        stops = _stop_socket(settings.socket.with_suffix(STOP_SUFFIX))
    except (ProfileError, DriverError, ControlError, BadInputError) as error:
        print(f"cdpr: {printable(str(error))}", file=sys.stderr)
        return BAD_INPUT
    simulated = any(url.is_simulated for url in robot_urls(robot, settings.buses).values())
    if parts.last_stop is not None and robot.platform is not None:
        parts.last_stop.path = _lengths_file(robot, settings)
        parts.last_stop.geometry = robot.geometry_identity
        parts.last_stop.load(len(robot.axes), robot.platform.longest_cable_m)
    if parts.paths is not None:
        _open_paths(parts.paths, robot, settings, block)
    loop = control_loop(robot, limits, block, machine, parts, stops=stops, simulated=simulated)
    loop.engine.notices += freeze_memory()
    loop.engine.notices += settings.own.notices(robot)
    _obey_signals(loop)
    end_with_launcher(settings.launcher_pid)
    counters = block.counters
    if counters["start_monotonic_ns"][0] == 0:
        counters["start_monotonic_ns"] = time.monotonic_ns()
        counters["start_realtime_ns"] = time.time_ns()
    counters["loop_pid"] = os.getpid()
    try:
        loop.run()
    finally:  # a client that finds the ending process can see this and does not disturb it
        signal.signal(POWER_OFF_SIGNAL, signal.SIG_IGN)
        stops.close()
    # the launcher reports which drive, from the status
    return POWER_UNCONFIRMED if loop.transitions.power_off_unconfirmed else DONE


def _stop_socket(path: Path) -> StopSocket:
    """Return the socket for stops; raises ControlError."""
    try:
        return StopSocket(path)
    except OSError as error:
        reason = error.strerror or error
        raise ControlError(f"{path}: cannot create the socket for stops: {reason}") from None


def _lengths_file(robot: Robot, settings: RunSettings) -> Path | None:
    """Return the path of the cable lengths at the last stop; simulations have their own file.

    A simulator that starts with the daemon starts at home, however the previous one ended.
    """
    if settings.own_simulator:
        return None
    return state_path(
        "lengths", f"{robot.profile}.simulated" if settings.simulated else robot.profile
    )


def _open_paths(paths: PathStore, robot: Robot, settings: RunSettings, block: SharedBlock) -> None:
    """Load planned paths from their folder; without a folder the robot runs without paths."""
    try:
        paths.open(
            paths_folder(robot.profile), block.counters["path"], simulated=settings.simulated
        )
    except ControlError as error:
        print(f"cdpr: paths cannot be followed: {printable(str(error))}", file=sys.stderr)


def _obey_signals(loop: ControlLoop) -> None:
    def stop(_number: int, _frame: FrameType | None) -> None:
        loop.request_stop()

    def remove_power(_number: int, _frame: FrameType | None) -> None:
        loop.request_power_off()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop)
    signal.signal(POWER_OFF_SIGNAL, remove_power)


if __name__ == "__main__":
    sys.exit(main())
