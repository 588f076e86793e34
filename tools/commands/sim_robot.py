"""`cdpr sim up ROBOT`: the drives of every bus of a robot, in one process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from profiles import Robot
from sim_bus.canopen.store import StoreError
from sim_bus.clock import ClockMode
from sim_bus.drive import SimDrive
from sim_bus.fleet import FleetBus, serve_fleet
from sim_bus.physics_board import PhysicsBoard
from sim_bus.plant import Plant
from tools.bus_fit import require_fit
from tools.errors import BadInputError
from tools.robot_buses import robot_urls


def up(
    robot: Robot,
    buses: Sequence[str],
    plant: Plant,
    mode: ClockMode,
    store_file: Callable[[int], Path | None],
    board: Path | None,
    until_stdin_ends: bool,
) -> None:
    """Run the simulated drives of `robot` until Ctrl-C.

    Every drive has the same plant but noise of its own; serial numbers count the axes from 1.
    `board` is a file to make, through which other simulated devices share the axes' physics.
    Raises BadInputError for a robot that does not fit its buses, and BusSetupError.
    """
    require_fit(robot)
    urls = robot_urls(robot, buses)
    for name, url in urls.items():
        if url.interface not in ("simbus", "socketcan"):
            raise BadInputError(
                f"--bus {name}={url}: simulated drives run on simbus:NAME or socketcan:IFACE"
            )
    with ExitStack() as stack:
        drives = []
        for i, axis in enumerate(robot.axes):
            own = plant.model_copy(update={"seed": (plant.seed + i) % 2**32})
            try:
                drive = SimDrive.for_winch(axis.winch, own, store=store_file(i + 1), serial=i + 1)
            except StoreError as error:
                raise BadInputError(str(error)) from error
            stack.callback(drive.close)
            drives.append(drive)
        if board is not None:
            shared = stack.enter_context(PhysicsBoard.create(board, len(drives)))
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
        serve_fleet(robot.reference, fleet, mode=mode, until_stdin_ends=until_stdin_ends)
