"""`cdpr sim up ROBOT`: the drives of every bus of a robot, in one process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from profiles import Robot
from profiles.platform import Platform
from sim_bus.cable_robot import CableRobot, RobotShape
from sim_bus.canopen.store import StoreError
from sim_bus.clock import ClockMode
from sim_bus.drive import SimDrive, transmission_of
from sim_bus.fleet import FleetBus, serve_fleet
from sim_bus.frame_log import FrameLog
from sim_bus.motor_state import Transmission
from sim_bus.physics_board import PhysicsBoard
from sim_bus.plant import Plant
from sim_bus.pose_log import PoseLog
from sim_bus.robot_plant import RobotPlant
from tools.bus_fit import require_fit
from tools.errors import BadInputError
from tools.robot_buses import robot_urls


def up(
    robot: Robot,
    buses: Sequence[str],
    plant: Path | None,
    mode: ClockMode,
    store_file: Callable[[int], Path | None],
    board: Path | None,
    until_stdin_ends: bool,
    truth_log: Path | None = None,
    detached: bool = False,
    frame_log: FrameLog | None = None,
) -> None:
    """Run the simulated drives of `robot` until Ctrl-C; serial numbers count the axes from 1.

    `plant` is a plant file: of the whole robot where it has a platform, whose true pose goes into
    `truth_log`; otherwise that of each motor, which differ in their noise only. `detached` leaves
    the cables off the drums: the same motors turn freely. `board` is a file to make, through which
    other simulated devices share the axes' physics. All frames go to `frame_log`. Raises
    BadInputError for a robot that does not fit its buses, and BusSetupError.
    """
    require_fit(robot)
    urls = robot_urls(robot, buses)
    for name, url in urls.items():
        if url.interface not in ("simbus", "socketcan"):
            raise BadInputError(
                f"--bus {name}={url}: simulated drives run on simbus:NAME or socketcan:IFACE"
            )
    with ExitStack() as stack:
        body, plants = _physics(robot, plant, detached)
        members = [None] * len(plants) if body is None else body.members()
        drives = []
        for i, (axis, own, member) in enumerate(zip(robot.axes, plants, members, strict=True)):
            try:
                drive = SimDrive.for_winch(
                    axis.winch, own, store=store_file(i + 1), serial=i + 1, robot=member
                )
            except StoreError as error:
                raise BadInputError(str(error)) from error
            stack.callback(drive.close)
            drives.append(drive)
        if truth_log is not None:
            drives[0].record_with(_pose_log(truth_log, body))
        if board is not None:
            lockstep = mode is ClockMode.LOCKSTEP
            made = PhysicsBoard.create(board, len(drives), lockstep=lockstep)
            shared = stack.enter_context(made)
            for i, drive in enumerate(drives):
                drive.connect(shared.axis(i))
        fleet = [
            FleetBus(
                bus.name,
                str(urls[bus.name]),
                bus.bitrate_bit_s,
                [drives[i] for i in robot.axes_on(bus.name)],
            )
            for bus in robot.buses
        ]
        serve_fleet(
            *(robot.reference, fleet),
            mode=mode,
            until_stdin_ends=until_stdin_ends,
            frame_log=frame_log,
        )


def _physics(
    robot: Robot, plant: Path | None, detached: bool
) -> tuple[CableRobot | None, Sequence[Plant]]:
    """Return what the axes move together, None where nothing, and the plant of each motor."""
    n, platform = len(robot.axes), robot.platform
    if platform is None:
        one = Plant() if plant is None else Plant.load_file(plant)
        return None, [one.model_copy(update={"seed": (one.seed + i) % 2**32}) for i in range(n)]
    whole = RobotPlant() if plant is None else RobotPlant.load_file(plant)
    try:
        whole.require_fit(n, len(platform.home_m))
        motors = whole.motor_plants(n, [axis.winch for axis in robot.axes])
        if detached:
            return None, motors
        return CableRobot(_shape(robot, platform), whole, _transmissions(robot)), motors
    except ValueError as error:
        raise BadInputError(f"--plant {plant}: {error}") from error


def _shape(robot: Robot, platform: Platform) -> RobotShape:
    return RobotShape(
        exit_points_m=platform.exit_points_m,
        anchor_points_m=platform.anchor_points_m,
        mass_kg=platform.mass_kg,
        home_m=platform.home_m,
        weights_N_m=[axis.winch.cable.weight_per_length_N_m for axis in robot.axes],
    )


def _transmissions(robot: Robot) -> list[Transmission]:
    return [transmission_of(axis.winch) for axis in robot.axes]


def _pose_log(path: Path, body: CableRobot | None) -> PoseLog:
    if body is None:
        raise BadInputError("--truth-log: for a winch, or a robot with its platform on the cables")
    try:
        return PoseLog(path, body)
    except OSError as error:
        raise BadInputError(f"--truth-log {path}: {error.strerror}") from error
