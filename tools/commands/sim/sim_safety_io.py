"""`cdpr sim safety-io` and `cdpr sim panel`: a simulated safety I/O and the hands at it."""

from __future__ import annotations

import asyncio
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

from cdpr_profiles.devices.safety_io import load_safety_io
from cdpr_sim_bus.devices.modbus_tcp_server import serve_units
from cdpr_sim_bus.devices.safety_plant import SafetyPlant
from cdpr_sim_bus.devices.sim_safety_io import SafetyIoFault, SimSafetyIo
from cdpr_sim_bus.physics_board import PhysicsBoard, common_time
from cdpr_tools.commands.options import ExitWithStdinOption
from cdpr_tools.errors import BadInputError, WorkFailedError

_FAULTS = {fault.name.lower().replace("_", "-"): fault for fault in SafetyIoFault if fault.name}
_PRESSED, _FAULT = 0, 1


app = typer.Typer()


@app.command()
def safety_io(
    io: Annotated[str, typer.Argument(help="Safety I/O profile: a name or a file.", metavar="IO")],
    board: Annotated[
        list[Path] | None,
        typer.Option(help="Physics board whose axes are those of the profile; may be repeated."),
    ] = None,
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="Port of 127.0.0.1; 0: any that is free.")
    ] = None,
    plant: Annotated[
        Path | None, typer.Option(help="Plant file: delays and where the limit switches stand.")
    ] = None,
    exit_with_stdin: ExitWithStdinOption = False,
) -> None:
    """Run a simulated safety I/O until Ctrl-C; tells on standard output when it is up."""
    profile = load_safety_io(io)
    truth = SafetyPlant() if plant is None else SafetyPlant.load_file(plant)
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
        str, typer.Argument(help=f"press, release, mend, {', '.join(_FAULTS)}.", metavar="ACTION")
    ],
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port of the simulated safety I/O.")],
    unit: Annotated[int, typer.Option(help="The panel's unit, as `sim safety-io` tells.")] = 247,
) -> None:
    """Press the emergency stop of a simulated safety I/O, release it, break or mend something."""
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
            f"127.0.0.1:{port}: no simulated safety I/O answers there; `cdpr sim safety-io` tells "
            "its port"
        ) from None
    finally:
        client.close()  # type: ignore[no-untyped-call]
    if refused:
        raise WorkFailedError(
            f"127.0.0.1:{port}: unit {unit} is no panel of a simulated safety I/O"
        )
