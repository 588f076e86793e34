"""`cdpr sim up ROBOT`: the drives of every bus of a robot, in one process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from cdpr_drivers.robot.bus_fit import require_fit
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import Robot
from cdpr_sim_bus.canopen.dictionary.store import StoreError
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.fleet import FleetBus, serve_fleet
from cdpr_sim_bus.frame import FrameLog
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.logs.pose_logs import BoardPose, PoseLog, PoseScanner
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.composition.robot_physics import physics_of
from cdpr_tools.composition.simulator import OwnCamera
from cdpr_tools.errors import BadInputError, os_error_as, raised_as


def up(
    robot: Robot,
    buses: Sequence[str],
    plant: Path | None,
    mode: ClockMode,
    store_file: Callable[[int], Path | None],
    board: Path | None,
    until_stdin_ends: bool,
    *,
    truth_log: Path | None,
    detached: bool,
    frame_log: FrameLog | None,
    scanner: Path | None,
    camera: Path | None,
) -> None:
    """Run the simulated drives of `robot` until Ctrl-C; serial numbers count the axes from 1.

    `plant` is a plant file: of the whole robot where it has a platform, whose true pose goes into
    `truth_log`; otherwise that of each motor, which differ in their noise only. `detached` leaves
    the cables off the drums: the same motors turn freely. What is measured of the pose from outside
    goes into `scanner`. A camera on the platform answers on the socket `camera`. `board` is a file
    to make, through which other simulated devices share the axes' physics. All frames go to
    `frame_log`. Raises BadInputError for a robot that does not fit its buses, and BusSetupError.
    """
    require_fit(robot)
    urls = robot_urls(robot, buses)
    for name, url in urls.items():
        if url.interface not in ("simbus", "socketcan"):
            raise BadInputError(
                f"--bus {name}={url}: simulated drives run on simbus:NAME or socketcan:IFACE"
            )
    with ExitStack() as stack:
        body, plants = physics_of(robot, plant, detached)
        if body is None:
            _refuse_platforms(truth_log, scanner, camera)
        drives = _drives(stack, robot, plants, body, store_file)
        if camera is not None and board is None:
            folder = stack.enter_context(TemporaryDirectory(prefix="cdpr-board-"))
            board = Path(folder) / "board"
        shared = None
        if board is not None:
            lockstep = mode is ClockMode.LOCKSTEP
            made = PhysicsBoard.create(board, len(drives), lockstep=lockstep)
            shared = stack.enter_context(made)
            for i, drive in enumerate(drives):
                drive.connect(shared.axis(i))
        if body is not None:
            _record(drives, body, RobotPlant.load_file(plant), truth_log, scanner, shared)
        if camera is not None and board is not None:
            described = "camera" in RobotPlant.load_file(plant).model_fields_set
            stack.callback(OwnCamera(camera, board, plant if described else None).stop)
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
            truth_log=str(truth_log) if truth_log else None,
        )


def _drives(
    stack: ExitStack,
    robot: Robot,
    plants: Sequence[Plant],
    body: CableRobot | None,
    store_file: Callable[[int], Path | None],
) -> list[SimDrive]:
    """Return a drive for each axis, with the physics of `body` if there is one."""
    members = [None] * len(plants) if body is None else body.members()
    drives = []
    for serial, (axis, plant, member) in enumerate(
        zip(robot.axes, plants, members, strict=True), 1
    ):
        with raised_as(BadInputError, StoreError):
            drive = SimDrive.for_winch(
                axis.winch, plant, store=store_file(serial), serial=serial, robot=member
            )
        stack.callback(drive.close)
        drives.append(drive)
    return drives


def _refuse_platforms(truth_log: Path | None, scanner: Path | None, camera: Path | None) -> None:
    """Raise BadInputError where something is asked of a platform that does not exist."""
    robot = "a robot with its platform on the cables"
    for option, path, whose in (
        ("--truth-log", truth_log, f"a winch, or {robot}"),
        ("--scanner", scanner, robot),
        ("--camera", camera, robot),
    ):
        if path is not None:
            raise BadInputError(f"{option}: for {whose}")


def _record(
    drives: Sequence[SimDrive],
    body: CableRobot,
    plant: RobotPlant,
    truth_log: Path | None,
    scanner: Path | None,
    board: PhysicsBoard | None,
) -> None:
    """Have the pose written down; each drive keeps one log, and a platform has three at least."""
    if truth_log is not None:
        with os_error_as(BadInputError, f"--truth-log {truth_log}"):
            drives[0].record_with(PoseLog(truth_log, body))
    if board is not None:
        drives[1].record_with(BoardPose(body, board.platform))
    if scanner is not None:
        with os_error_as(BadInputError, f"--scanner {scanner}"):
            drives[-1].record_with(PoseScanner(scanner, body, plant.scanner, plant.seed))
