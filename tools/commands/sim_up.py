"""`cdpr sim up`: run simulated drives on simulated or real buses."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.errors import BusError
from cdpr_drivers.robot.robot_buses import require_fit, robot_urls
from cdpr_profiles import Robot, Winch, load_winch_or_robot
from cdpr_sim_bus.bus.server import FleetBus, serve, serve_fleet
from cdpr_sim_bus.canopen.lss import UNCONFIGURED
from cdpr_sim_bus.canopen.store import StoreError
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.cia402.fault_bench import FaultBench
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.frame import FrameLog
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_sim_bus.robot.truth_log import BoardPose, MotorsLog, PoseLog, PoseScanner
from cdpr_tools.commands.options import ExitWithStdinOption, RobotOrWinchArgument, option
from cdpr_tools.compiling import announce_compiling
from cdpr_tools.composition.robot_physics import physics_of
from cdpr_tools.composition.simulator import OwnCamera
from cdpr_tools.errors import BadInputError, os_error_as, raised_as

app = typer.Typer()


@app.command()
def up(
    machine: RobotOrWinchArgument,
    bus: Annotated[
        list[str],
        option(
            "simbus:NAME, opened here, or socketcan:IFACE; for a robot also BUS=URL for each bus."
        ),
    ],
    plant: Annotated[Path | None, option("Plant file: the truth about motor and drive.")] = None,
    lockstep: Annotated[
        bool, option("Bus time follows the SYNCs, or the clock.", "--lockstep/--paced")
    ] = True,
    nodes: Annotated[
        int, option("Number of drives, with consecutive node ids.", min=1, max=16)
    ] = 1,
    truth_log: Annotated[
        Path | None, option("Write the true motion, or pose, to this file (one drive, or a robot).")
    ] = None,
    scanner: Annotated[
        Path | None, option("Write the platform's pose to this file, measured with errors.")
    ] = None,
    frame_log: Annotated[
        Path | None,
        option(
            "Write every frame with its bus time to this file, in candump format.",
            "--frame-log",
            envvar="CDPR_SIM_FRAME_LOG",
        ),
    ] = None,
    unconfigured: Annotated[
        bool, option("New drives: without node ids, waiting for LSS.", "--unconfigured")
    ] = False,
    store: Annotated[
        Path | None, option("Folder for parameters that the drives store (1010h, LSS).")
    ] = None,
    slcan: Annotated[
        bool, option("Also offer the bus as a serial CAN adapter.", "--slcan")
    ] = False,
    socketcand: Annotated[
        int | None,
        option("Serve socketcand on 127.0.0.1:PORT; 0: any.", metavar="PORT", min=0, max=65535),
    ] = None,
    detached: Annotated[
        bool, option("Simulate the motors of a robot without their cables.", "--detached")
    ] = False,
    board: Annotated[
        Path | None,
        option("Create this file, a physics board for simulated sensors and safety I/O."),
    ] = None,
    camera: Annotated[
        Path | None, option("Unix socket to create for a camera on a robot's platform: sim:SOCKET.")
    ] = None,
    exit_with_stdin: ExitWithStdinOption = False,
) -> None:
    """Run simulated drives until Ctrl-C."""
    profile = load_winch_or_robot(machine)
    announce_compiling("the simulated drives")
    mode = ClockMode.LOCKSTEP if lockstep else ClockMode.PACED
    require_fit(profile)
    if isinstance(profile, Robot):
        if nodes > 1 or unconfigured or slcan or socketcand is not None:
            raise BadInputError("--nodes, --unconfigured, --slcan, --socketcand: for a winch only")
        body, plants = physics_of(profile, plant, detached)
        winches, urls = [axis.winch for axis in profile.axes], robot_urls(profile, bus)
        if body is None:
            _refuse_platforms(scanner, camera)
        for name, url in urls.items():
            _require_simulated(f"{name}={url}", url)
    else:
        if scanner is not None or camera is not None:
            raise BadInputError("--scanner, --camera: for a robot with a platform")
        if detached:
            raise BadInputError(
                "--detached: only for a robot; a winch's plant file describes its load"
            )
        if truth_log is not None and nodes > 1:
            raise BadInputError("--truth-log: only for one drive; omit --nodes")
        body, plants = None, [Plant.load_file(plant)] * nodes
        winches, urls = _numbered(profile, nodes, unconfigured), {"": _bus(bus)}
    with ExitStack() as stack:
        own_log = truth_log if isinstance(profile, Winch) else None
        drives = _drives(stack, winches, plants, body, store, own_log)
        shared = _shared_board(stack, board, camera, drives, lockstep)
        if body is not None:
            truth = RobotPlant.load_file(plant)
            _record(drives, body, truth, truth_log, scanner, shared)
            if camera is not None and shared is not None:
                described = plant if "camera" in truth.model_fields_set else None
                stack.callback(OwnCamera(camera, shared.path, described).stop)
        elif truth_log is not None and isinstance(profile, Robot):
            with os_error_as(BadInputError, f"--truth-log {truth_log}"):
                drives[0].record_with(MotorsLog(truth_log, [one.axis.motor for one in drives]))
        bench = FaultBench(drives)
        log, text = _frame_log(frame_log), None if truth_log is None else str(truth_log)
        if isinstance(profile, Winch):
            serve(
                *(drives, str(urls[""])), mode=mode, bitrate=profile.bitrate_bit_s, truth_log=text,
                frame_log=log, until_stdin_ends=exit_with_stdin, slcan=slcan,
                socketcand_port=socketcand, bench=bench,
            )  # fmt: skip
            return
        fleet = [
            FleetBus(
                one.name,
                str(urls[one.name]),
                one.bitrate_bit_s,
                [drives[i] for i in profile.axes_on(one.name)],
            )
            for one in profile.buses
        ]
        serve_fleet(
            *(profile.reference, fleet), mode=mode, until_stdin_ends=exit_with_stdin,
            frame_log=log, truth_log=text, bench=bench,
        )  # fmt: skip


def _shared_board(
    stack: ExitStack,
    path: Path | None,
    camera: Path | None,
    drives: Sequence[SimDrive],
    lockstep: bool,
) -> PhysicsBoard | None:
    """Return the board at `path` with the axes of `drives`; a camera always needs one."""
    if path is None and camera is not None:
        path = Path(stack.enter_context(TemporaryDirectory(prefix="cdpr-board-"))) / "board"
    if path is None:
        return None
    made = PhysicsBoard.create(path, len(drives), lockstep=lockstep)
    shared = stack.enter_context(made)
    for number, drive in enumerate(drives):
        drive.connect(shared.axis(number))
    return shared


def _numbered(winch: Winch, nodes: int, unconfigured: bool) -> list[Winch]:
    """Return `nodes` copies of the winch with consecutive node ids; unconfigured ones have none."""
    last = winch.node_id + nodes - 1
    if last > 127:
        raise BadInputError(f"--nodes {nodes}: node ids end at 127, the first is {winch.node_id}")
    ids = [UNCONFIGURED] * nodes if unconfigured else range(winch.node_id, last + 1)
    return [dataclasses.replace(winch, node_id=node_id) for node_id in ids]


def _drives(
    stack: ExitStack,
    winches: Sequence[Winch],
    plants: Sequence[Plant],
    body: CableRobot | None,
    store: Path | None,
    truth_log: Path | None,
) -> list[SimDrive]:
    """Return a drive for each winch, with the physics of `body` if there is one."""
    members = [None] * len(plants) if body is None else body.members()
    drives = []
    for serial, (winch, plant, member) in enumerate(zip(winches, plants, members, strict=True), 1):
        kept = _store_file(store, serial)
        with (
            os_error_as(BadInputError, f"--truth-log {truth_log}"),
            raised_as(BadInputError, StoreError),
        ):
            drive = SimDrive.for_winch(
                *(winch, plant), truth_log=truth_log, store=kept, serial=serial, robot=member
            )
        stack.callback(drive.close)
        drives.append(drive)
    return drives


def _frame_log(path: Path | None) -> FrameLog | None:
    """Return the frame log at `path`; the buses close it when they end."""
    if path is None:
        return None
    with os_error_as(BadInputError, f"--frame-log {path}"):
        return FrameLog(path)


def _store_file(folder: Path | None, serial: int) -> Path | None:
    """Return the file for the stored parameters of the drive with this serial number."""
    if folder is None:
        return None
    with os_error_as(BadInputError, f"--store {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder / f"drive-{serial}.json"


def _bus(texts: list[str]) -> BusUrl:
    text = texts[0]
    if len(texts) > 1:
        raise BadInputError(f"--bus {texts[1]}: a winch has one bus, and {text} is given")
    with raised_as(BadInputError, BusError):
        url = BusUrl.parse(text)
    _require_simulated(text, url)
    return url


def _require_simulated(text: str, url: BusUrl) -> None:
    if url.interface not in ("simbus", "socketcan") or not url.channel:
        raise BadInputError(f"--bus {text}: simulated drives run on simbus:NAME or socketcan:IFACE")


def _refuse_platforms(scanner: Path | None, camera: Path | None) -> None:
    """Raise BadInputError for options that need a platform, which the robot lacks."""
    for name, path in (("--scanner", scanner), ("--camera", camera)):
        if path is not None:
            raise BadInputError(f"{name}: for a robot with its platform on the cables")


def _record(
    drives: Sequence[SimDrive],
    body: CableRobot,
    plant: RobotPlant,
    truth_log: Path | None,
    scanner: Path | None,
    board: PhysicsBoard | None,
) -> None:
    """Set up the logs of the platform's pose, each at another drive of the three or more."""
    if truth_log is not None:
        with os_error_as(BadInputError, f"--truth-log {truth_log}"):
            drives[0].record_with(PoseLog(truth_log, body))
    if board is not None:
        drives[1].record_with(BoardPose(body, board.platform))
    if scanner is not None:
        with os_error_as(BadInputError, f"--scanner {scanner}"):
            drives[-1].record_with(PoseScanner(scanner, body, plant.scanner, plant.seed))
