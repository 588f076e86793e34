"""`cdpr sim rail`: a simulated rail, on a CAN bus or as a Modbus TCP server."""

from __future__ import annotations

import asyncio
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from cdpr_profiles.devices.rail import ModbusRail, RailProfile, load_rail
from cdpr_profiles.devices.rail_drive import load_rail_drive
from cdpr_sim_bus.bus.server import serve
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.devices.modbus_tcp_server import serve_units
from cdpr_sim_bus.devices.sim_rail import SimRail
from cdpr_sim_bus.physics_board import PhysicsBoard, common_time
from cdpr_sim_bus.robot.plant import Plant
from cdpr_tools.commands.options import ExitWithStdinOption
from cdpr_tools.errors import BadInputError

app = typer.Typer()


@app.command()
def rail(
    rail_name: Annotated[
        str, typer.Argument(help="Rail profile: a name or a file.", metavar="RAIL")
    ],
    bus: Annotated[
        str | None, typer.Option(help="For CiA 402: simbus:NAME, opened here, or socketcan:IFACE.")
    ] = None,
    board: Annotated[
        Path | None,
        typer.Option(
            help="For CiA 402: make this physics board, for its brake. For Modbus: the board of a "
            "simulator in lockstep, whose time the rail lives in."
        ),
    ] = None,
    lockstep: Annotated[
        bool,
        typer.Option(
            "--lockstep/--paced", help="For CiA 402: bus time moves with its master, or the clock."
        ),
    ] = False,
    plant: Annotated[
        Path | None, typer.Option(help="For CiA 402: the truth about motor and drive.")
    ] = None,
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="For Modbus: port of 127.0.0.1; 0: any.")
    ] = None,
    exit_with_stdin: ExitWithStdinOption = False,
) -> None:
    """Run a simulated rail until Ctrl-C; tells on standard output when it is up."""
    profile = load_rail(rail_name)
    if profile.modbus is not None:
        _serve_modbus(profile, profile.modbus, board, port, exit_with_stdin)
        return
    if bus is None:
        raise BadInputError(f"--bus: {profile.name} is on a CAN bus; name it")
    mode = ClockMode.LOCKSTEP if lockstep else ClockMode.PACED
    _serve_drive(rail_name, profile, bus, board, plant, mode, exit_with_stdin)


def _serve_modbus(
    rail: RailProfile, there: ModbusRail, board: Path | None, port: int | None, until_ends: bool
) -> None:
    with ExitStack() as stack:
        boards = [] if board is None else [stack.enter_context(PhysicsBoard.attach(board))]
        bus_time = common_time(boards)
        device = SimRail(rail, bus_time)
        step = device.step if bus_time is None else None
        details = {"unit": there.unit, "panel_unit": device.panel.unit}
        where = there.port if port is None else port
        served = serve_units(device.units(), device.line, step, where, details, until_ends)
        asyncio.run(served)


def _serve_drive(
    name: str,
    rail: RailProfile,
    bus: str,
    board: Path | None,
    plant: Path | None,
    mode: ClockMode,
    exit_with_stdin: bool,
) -> None:
    assert rail.cia402 is not None  # its kind says so
    truth = Plant() if plant is None else Plant.load_file(plant)
    drive = SimDrive(load_rail_drive(name, rail.cia402).eds, rail.cia402.node_id, truth)
    with ExitStack() as stack:
        stack.callback(drive.close)
        if board is not None:
            made = PhysicsBoard.create(board, 1, lockstep=mode is ClockMode.LOCKSTEP)
            drive.connect(stack.enter_context(made).axis(0))
        serve([drive], bus, mode=mode, until_stdin_ends=exit_with_stdin)
