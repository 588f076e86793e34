"""`cdpr sim up`: simulated drives on buses of their own or on real ones."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.errors import BusError
from cdpr_drivers.robot.bus_fit import require_fit
from cdpr_profiles import Robot, Winch, load_winch_or_robot
from cdpr_sim_bus.bus.server import serve
from cdpr_sim_bus.canopen.dictionary.store import StoreError
from cdpr_sim_bus.canopen.lss import UNCONFIGURED
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.frame import FrameLog
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_sim_bus.robot.plant import Plant
from cdpr_tools.commands.options import ExitWithStdinOption, WinchOrRobotArgument
from cdpr_tools.commands.sim import sim_robot
from cdpr_tools.compiling import announce_compiling
from cdpr_tools.errors import BadInputError, os_error_as, raised_as

app = typer.Typer()


@app.command()
def up(
    machine: WinchOrRobotArgument,
    bus: Annotated[
        list[str],
        typer.Option(
            help="simbus:NAME, opened here, or socketcan:IFACE; for a robot also BUS=URL, each bus."
        ),
    ],
    plant: Annotated[
        Path | None, typer.Option(help="Plant file: the truth about motor and drive.")
    ] = None,
    lockstep: Annotated[
        bool,
        typer.Option(
            "--lockstep/--paced", help="Bus time moves with each SYNC, or with the clock."
        ),
    ] = True,
    nodes: Annotated[
        int, typer.Option(min=1, max=16, help="Number of drives, node ids counted up.")
    ] = 1,
    truth_log: Annotated[
        Path | None,
        typer.Option(help="Write the true motion, or pose, to this file (one drive, or a robot)."),
    ] = None,
    scanner: Annotated[
        Path | None,
        typer.Option(help="Write the platform's pose to this file, as measured with errors."),
    ] = None,
    frame_log: Annotated[
        Path | None,
        typer.Option(
            "--frame-log",
            envvar="CDPR_SIM_FRAME_LOG",
            help="Write every frame, at bus time, to this file, as candump does.",
        ),
    ] = None,
    unconfigured: Annotated[
        bool, typer.Option("--unconfigured", help="New drives: without node ids, waiting for LSS.")
    ] = False,
    store: Annotated[
        Path | None,
        typer.Option(help="Folder where the drives keep what is stored in them (1010h, LSS)."),
    ] = None,
    slcan: Annotated[
        bool, typer.Option("--slcan", help="Offer the bus as a serial CAN adapter as well.")
    ] = False,
    socketcand: Annotated[
        int | None,
        typer.Option(
            metavar="PORT", min=0, max=65535, help="Serve socketcand on 127.0.0.1:PORT; 0: any."
        ),
    ] = None,
    detached: Annotated[
        bool,
        typer.Option("--detached", help="A robot whose cables are not attached: motors alone."),
    ] = False,
    board: Annotated[
        Path | None,
        typer.Option(help="Make this file, a physics board for simulated sensors and safety I/O."),
    ] = None,
    camera: Annotated[
        Path | None,
        typer.Option(help="Unix socket to make of a camera on a robot's platform: sim:SOCKET."),
    ] = None,
    exit_with_stdin: ExitWithStdinOption = False,
) -> None:
    """Run simulated drives until Ctrl-C; tells on standard output when they are up."""
    profile = load_winch_or_robot(machine)
    announce_compiling("the simulated drives")
    mode = ClockMode.LOCKSTEP if lockstep else ClockMode.PACED
    if isinstance(profile, Robot):
        if nodes > 1 or unconfigured or slcan or socketcand is not None:
            raise BadInputError("--nodes, --unconfigured, --slcan, --socketcand: for a winch only")
        stores = partial(_store_file, store)
        sim_robot.up(
            *(profile, bus, plant, mode, stores, board, exit_with_stdin),
            truth_log=truth_log,
            detached=detached,
            frame_log=_frame_log(frame_log),
            scanner=scanner,
            camera=camera,
        )
        return
    if scanner is not None or camera is not None:
        raise BadInputError("--scanner, --camera: for a robot with a platform")
    if detached:
        raise BadInputError("--detached: for a robot; a winch's plant file says what it pulls")
    truth = Plant.load_file(plant)
    require_fit(profile)
    url = _bus(bus)
    if truth_log is not None and nodes > 1:
        raise BadInputError("--truth-log: one drive only; leave out --nodes")
    last = profile.node_id + nodes - 1
    if last > 127:
        raise BadInputError(f"--nodes {nodes}: node ids end at 127, the first is {profile.node_id}")
    ids = [UNCONFIGURED] * nodes if unconfigured else range(profile.node_id, last + 1)
    with ExitStack() as stack:
        drives = _drives(stack, profile, ids, truth, truth_log, store)
        if board is not None:
            made = PhysicsBoard.create(board, len(drives), lockstep=lockstep)
            shared = stack.enter_context(made)
            for number, drive in enumerate(drives):
                drive.connect(shared.axis(number))
        serve(
            drives,
            str(url),
            mode=mode,
            bitrate=profile.bitrate_bit_s,
            truth_log=str(truth_log) if truth_log else None,
            frame_log=_frame_log(frame_log),
            until_stdin_ends=exit_with_stdin,
            slcan=slcan,
            socketcand_port=socketcand,
        )


def _drives(
    stack: ExitStack,
    winch: Winch,
    node_ids: Sequence[int],
    plant: Plant,
    truth_log: Path | None,
    store: Path | None,
) -> list[SimDrive]:
    """Return a drive of the winch for each node id, closed with `stack`."""
    drives = []
    for serial, node_id in enumerate(node_ids, 1):
        one = dataclasses.replace(winch, node_id=node_id)
        kept = _store_file(store, serial)
        try:
            drive = SimDrive.for_winch(one, plant, truth_log=truth_log, store=kept, serial=serial)
        except StoreError as error:
            raise BadInputError(str(error)) from error
        except OSError as error:
            raise BadInputError(f"--truth-log {truth_log}: {error.strerror}") from error
        stack.callback(drive.close)
        drives.append(drive)
    return drives


def _frame_log(path: Path | None) -> FrameLog | None:
    """Return the log that the buses close when they end."""
    if path is None:
        return None
    with os_error_as(BadInputError, f"--frame-log {path}"):
        return FrameLog(path)


def _store_file(folder: Path | None, serial: int) -> Path | None:
    """Return the file in which the drive with this serial number keeps what is stored in it."""
    if folder is None:
        return None
    with os_error_as(BadInputError, f"--store {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder / f"drive-{serial}.json"


def _bus(texts: list[str]) -> BusUrl:
    text = texts[0]
    if len(texts) > 1:
        raise BadInputError(f"--bus {texts[1]}: a winch has one bus, which is {text} already")
    with raised_as(BadInputError, BusError):
        url = BusUrl.parse(text)
    if url.interface not in ("simbus", "socketcan") or not url.channel:
        raise BadInputError(f"--bus {text}: simulated drives run on simbus:NAME or socketcan:IFACE")
    return url
