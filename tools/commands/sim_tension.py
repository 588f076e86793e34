"""`cdpr sim tension` and `cdpr sim hang`: simulated load cells, and masses hung on cables."""

from __future__ import annotations

import asyncio
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from cdpr_profiles.tension_sensor import load_tension_sensors
from cdpr_sim_bus.devices.modbus_servers import serve_rtu
from cdpr_sim_bus.devices.sim_inclinometer import SimInclinometer
from cdpr_sim_bus.devices.sim_load_cells import AmplifierPlant, SimAmplifier
from cdpr_sim_bus.physics_board import PhysicsBoard, common_time
from cdpr_tools.commands.options import ExitWithStdinOption, argument, option
from cdpr_tools.errors import BadInputError

_MOST_KG = 1000.0


app = typer.Typer()


@app.command()
def tension(
    sensors: Annotated[str, argument("Tension sensors: a name or a file.", metavar="SENSORS")],
    board: Annotated[
        list[Path], option("Physics board whose axes are the sensors' cables; may be repeated.")
    ],
    plant: Annotated[Path | None, option("Plant file: the truth about the amplifiers.")] = None,
    fault: Annotated[
        list[str] | None, option('Faults from the start, such as "silent 3" or "wrong-crc all".')
    ] = None,
    exit_with_stdin: ExitWithStdinOption = False,
) -> None:
    """Run simulated load cells on a pseudo-terminal until Ctrl-C; prints its path when ready.

    If the file has an inclinometer, this is on the platform of the first board.

    Type a fault and a unit, such as `silent 3`, or `unplug`, to break it; `mend all` repairs it.
    """
    profile = load_tension_sensors(sensors)
    truth = AmplifierPlant.load_file(plant)
    with ExitStack() as stack:
        boards = [stack.enter_context(PhysicsBoard.attach(path)) for path in board]
        axes = [one.axis(i) for one in boards for i in range(one.axes)]
        if len(axes) < len(profile.sensors):
            raise BadInputError(
                f"--board: {len(axes)} axes for {len(profile.sensors)} sensors of {sensors}"
            )
        units: list[SimAmplifier | SimInclinometer] = [
            SimAmplifier(profile, sensor, truth, axis)
            for sensor, axis in zip(profile.sensors, axes, strict=False)
        ]
        if profile.inclinometer is not None:
            units.append(SimInclinometer(profile.inclinometer, truth, boards[0].platform))
        served = serve_rtu(
            units,
            profile.baudrate,
            bits_per_byte=9 + profile.stop_bits + (profile.parity != "N"),
            lockstep=common_time(boards) is not None,
            faults=[text.split() for text in fault or ()],
            details={"sensors": sensors},
            until_stdin_ends=exit_with_stdin,
        )
        asyncio.run(served)


@app.command()
def hang(
    mass_kg: Annotated[float, argument("Mass, kg.", min=0.0, max=_MOST_KG, metavar="MASS_KG")],
    board: Annotated[Path, option("Physics board of the simulator.")],
    axis: Annotated[int, option("Axis, counted from 1.", min=1)] = 1,
) -> None:
    """Hang a mass on a simulated cable whose plant has load.kind = "hung_mass"."""
    with PhysicsBoard.attach(board) as shared:
        if axis > shared.axes:
            raise BadInputError(f"--axis {axis}: {board} has {shared.axes} axes")
        shared.axis(axis - 1).hung_mass_kg = mass_kg
