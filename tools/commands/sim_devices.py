"""`cdpr sim safety-io|panel|rail`: a simulated safety I/O with its panel, and a simulated rail."""

from __future__ import annotations

import asyncio
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

from cdpr_profiles.catalogue import load_rail_drive
from cdpr_profiles.rail import ModbusRail, RailProfile, load_rail
from cdpr_profiles.safety_io import load_safety_io
from cdpr_sim_bus.bus.server import serve
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.devices.modbus_servers import serve_units
from cdpr_sim_bus.devices.sim_rail import SimRail
from cdpr_sim_bus.devices.sim_safety_io import SafetyPlant, SimSafetyIo
from cdpr_sim_bus.physics_board import PhysicsBoard, SafetyIoFault, common_time
from cdpr_sim_bus.robot.plant import Plant
from cdpr_tools.commands.options import ExitWithStdinOption, argument, option
from cdpr_tools.errors import BadInputError, WorkFailedError

_FAULTS = {fault.name.lower().replace("_", "-"): fault for fault in SafetyIoFault if fault.name}
_PRESSED, _FAULT = 0, 1


app = typer.Typer()


@app.command()
def safety_io(
    io: Annotated[str, argument("Safety I/O profile: a name or a file.", metavar="IO")],
    board: Annotated[
        list[Path] | None,
        option("Physics board whose axes are those of the profile; may be repeated."),
    ] = None,
    port: Annotated[
        int | None, option("Port of 127.0.0.1; 0: any free port.", min=0, max=65535)
    ] = None,
    plant: Annotated[
        Path | None, option("Plant file: delays and positions of the limit switches.")
    ] = None,
    exit_with_stdin: ExitWithStdinOption = False,
) -> None:
    """Run a simulated safety I/O until Ctrl-C."""
    profile = load_safety_io(io)
    truth = SafetyPlant.load_file(plant)
    with ExitStack() as stack:
        boards = [stack.enter_context(PhysicsBoard.attach(path)) for path in board or ()]
        axes = [one.axis(i) for one in boards for i in range(one.axes)]
        bus_time = common_time(boards)
        device = SimSafetyIo(profile, truth, axes, bus_time)
        stack.callback(device.switch_off)
        details = {"unit": profile.unit, "panel_unit": device.panel.unit}
        served = serve_units(
            device.units(),
            device.line,
            device.step if bus_time is None else None,
            profile.port if port is None else port,
            details,
            exit_with_stdin,
        )
        asyncio.run(served)


@app.command()
def panel(
    action: Annotated[
        str, argument(f"press, release, mend, {', '.join(_FAULTS)}.", metavar="ACTION")
    ],
    port: Annotated[int, option("Port of the simulated safety I/O.", min=1, max=65535)],
    unit: Annotated[int, option("Modbus unit of the panel, as `sim safety-io` prints it.")] = 247,
) -> None:
    """Press or release the emergency stop of a simulated safety I/O, or break it."""
    if action in ("press", "release"):
        register, value = _PRESSED, int(action == "press")
    elif action in _FAULTS or action == "mend":
        register, value = _FAULT, int(_FAULTS.get(action, 0))
    else:
        known = ", ".join(("press", "release", "mend", *_FAULTS))
        raise BadInputError(f"action {action!r}; allowed: {known}")
    client = ModbusTcpClient("127.0.0.1", port=port, timeout=2, retries=0)
    try:
        refused = client.write_register(register, value, device_id=unit).isError()
    except ModbusException:
        raise WorkFailedError(
            f"127.0.0.1:{port}: no simulated safety I/O answers there; `cdpr sim safety-io` "
            "prints its port"
        ) from None
    finally:
        client.close()  # type: ignore[no-untyped-call]
    if refused:
        raise WorkFailedError(
            f"127.0.0.1:{port}: unit {unit} is not the panel of a simulated safety I/O"
        )


@app.command()
def rail(
    rail_name: Annotated[str, argument("Rail profile: a name or a file.", metavar="RAIL")],
    bus: Annotated[
        str | None, option("For CiA 402: simbus:NAME, opened here, or socketcan:IFACE.")
    ] = None,
    board: Annotated[
        Path | None,
        option(
            "For CiA 402: physics board to create, for the brake. For Modbus: board of a "
            "simulator in lockstep, whose time the rail uses."
        ),
    ] = None,
    lockstep: Annotated[
        bool,
        option("For CiA 402: bus time follows the master, or the clock.", "--lockstep/--paced"),
    ] = False,
    plant: Annotated[Path | None, option("For CiA 402: the truth about motor and drive.")] = None,
    port: Annotated[
        int | None, option("For Modbus: port of 127.0.0.1; 0: any.", min=0, max=65535)
    ] = None,
    exit_with_stdin: ExitWithStdinOption = False,
) -> None:
    """Run a simulated rail until Ctrl-C; prints a line when it is ready."""
    profile = load_rail(rail_name)
    if profile.modbus is not None:
        _serve_modbus(profile, profile.modbus, board, port, exit_with_stdin)
        return
    if bus is None:
        raise BadInputError(
            f"--bus: is missing; {profile.name} is on a CAN bus, such as simbus:NAME"
        )
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
    assert rail.cia402 is not None  # ensured by its kind
    truth = Plant.load_file(plant)
    drive = SimDrive(load_rail_drive(name, rail.cia402).eds, rail.cia402.node_id, truth)
    with ExitStack() as stack:
        stack.callback(drive.close)
        if board is not None:
            made = PhysicsBoard.create(board, 1, lockstep=mode is ClockMode.LOCKSTEP)
            drive.connect(stack.enter_context(made).axis(0))
        serve([drive], bus, mode=mode, until_stdin_ends=exit_with_stdin)
