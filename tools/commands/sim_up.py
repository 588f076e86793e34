"""`cdpr sim up`: run simulated drives on simulated or real buses."""

from __future__ import annotations

import dataclasses
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.errors import BusError
from cdpr_drivers.robot.robot_buses import require_fit, robot_urls
from cdpr_profiles import Robot, Winch, load_winch_or_robot
from cdpr_sim_bus.bus.server import FleetBus, serve, serve_fleet
from cdpr_sim_bus.canopen.lss import UNCONFIGURED
from cdpr_sim_bus.cia402.fault_bench import FaultBench
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.robot.plant import Plant
from cdpr_tools.commands.options import ExitWithStdinOption, RobotOrWinchArgument, option
from cdpr_tools.compiling import announce_compiling
from cdpr_tools.composition.robot_physics import (
    board_of,
    drives_of,
    frame_log_at,
    simulated_drives,
)
from cdpr_tools.errors import BadInputError, raised_as

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
    with ExitStack() as stack:
        if isinstance(profile, Robot):
            if nodes > 1 or unconfigured or slcan or socketcand is not None:
                raise BadInputError(
                    "--nodes, --unconfigured, --slcan, --socketcand: for a winch only"
                )
            urls = robot_urls(profile, bus)
            for name, url in urls.items():
                _require_simulated(f"{name}={url}", url)
            drives = simulated_drives(
                *(stack, profile, plant), detached=detached, store=store, truth_log=truth_log,
                scanner=scanner, board=board, camera=camera, lockstep=lockstep,
            )  # fmt: skip
        else:
            if scanner is not None or camera is not None:
                raise BadInputError("--scanner, --camera: allowed only for a robot with a platform")
            if detached:
                raise BadInputError(
                    "--detached: only for a robot; a winch's plant file describes its load"
                )
            if truth_log is not None and nodes > 1:
                raise BadInputError("--truth-log: only for one drive; omit --nodes")
            winches, plants = _numbered(profile, nodes, unconfigured), [Plant.load_file(plant)]
            urls = {"": _bus(bus)}
            drives = drives_of(stack, winches, plants * nodes, None, store, truth_log)
            board_of(stack, board, None, drives, lockstep=lockstep)
        bench = FaultBench(drives)
        log, text = frame_log_at(frame_log), None if truth_log is None else str(truth_log)
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


def _numbered(winch: Winch, nodes: int, unconfigured: bool) -> list[Winch]:
    """Return `nodes` copies of the winch with consecutive node ids; unconfigured ones have none."""
    last = winch.node_id + nodes - 1
    if last > 127:
        raise BadInputError(f"--nodes {nodes}: node ids end at 127, the first is {winch.node_id}")
    ids = [UNCONFIGURED] * nodes if unconfigured else range(winch.node_id, last + 1)
    return [dataclasses.replace(winch, node_id=node_id) for node_id in ids]


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
