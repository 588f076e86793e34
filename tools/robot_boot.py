"""A robot's drives booted on its buses, as one device: what every session begins with."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace

from cdpr_rt.clock import Clock
from drivers.axis_buses import AxisBuses, BusAxes
from drivers.axis_layout import AxisConfig
from drivers.boot import BootReport, BootSettings, boot_all
from drivers.bus import BusUrl
from drivers.bus.master_lock import MasterLock
from drivers.cia402 import fault_text
from drivers.data_sheet import load_dictionary
from drivers.errors import BootError, BusError, DriverError, SdoError
from drivers.network import CanNetwork
from profiles import Robot, RobotAxis, Winch
from tools.errors import BadInputError, WorkFailedError

# what makes a drive stop by itself once nobody leads it, and bounds its torque until then
_GUARDS = ("1016h", "6007h", "605Ah", "6072h")


def open_networks(
    stack: ExitStack, robot: Robot, urls: Mapping[str, BusUrl], clock: Clock
) -> dict[str, CanNetwork]:
    """Open the buses of `robot` as their only master here; `stack` closes them.

    Raises BadInputError, also where another process of this machine runs drives on one of them.
    """
    networks: dict[str, CanNetwork] = {}
    for name, url in urls.items():
        axes = [robot.axes[i] for i in robot.axes_on(name)]
        nodes = [axis.node_id for axis in axes]
        try:
            stack.enter_context(MasterLock(url))
            network = CanNetwork(url, clock, nodes, robot.master_node_id, robot.master_heartbeat_s)
        except BusError as error:
            raise BadInputError(f"bus {name}: {error}") from error
        stack.callback(network.close)
        for axis in axes:
            eds = axis.winch.drive.eds
            network.add_node(axis.node_id, load_dictionary(eds, axis.node_id))
        networks[name] = network
    return networks


def boot_robot(
    stack: ExitStack, robot: Robot, networks: Mapping[str, CanNetwork], torque_Nm: Sequence[float]
) -> list[BootReport]:
    """Boot all buses at the same time; return what each axis' drive told.

    Each drive's torque is limited (6072h) to `torque_Nm`, one for each axis of the robot. `stack`
    leaves the drives alone again. Raises WorkFailedError where one does not boot.
    """

    def boot_bus(name: str, network: CanNetwork) -> Callable[[], dict[int, BootReport]]:
        wanted = {
            axis.node_id: (axis.winch.drive, _settings(robot, axis, most_Nm))
            for axis, most_Nm in ((robot.axes[i], torque_Nm[i]) for i in robot.axes_on(name))
        }
        return lambda: boot_all(network, wanted)

    clock = next(iter(networks.values())).clock
    tasks = clock.together([boot_bus(*bus) for bus in networks.items()])
    failures: list[DriverError] = []
    booted: dict[tuple[str, int], BootReport] = {}
    for (name, network), task in zip(networks.items(), tasks, strict=True):
        try:
            reports = task.result()
        except (BootError, BusError) as error:
            failures.append(error)
            error.add_note(f"on bus {name}")
            continue
        for node_id, report in reports.items():
            booted[name, node_id] = report
            stack.callback(network.release, node_id)
    if failures:
        raise WorkFailedError("; ".join(_told(error) for error in failures)) from failures[0]
    return [booted[axis.bus, axis.node_id] for axis in robot.axes]


def _told(error: DriverError) -> str:
    *others, where = error.__notes__
    return f"{where}: " + "; ".join([str(error), *others])


def boot_settings(winch: Winch, torque_Nm: float) -> BootSettings:
    """Return what the master wants of a winch's drive besides its profile, 6072h `torque_Nm`."""
    return BootSettings(
        winch.master_node_id,
        winch.sync_period_s,
        torque_Nm,
        rated_torque_Nm=winch.motor.rated_torque_Nm,
        counts_per_turn=winch.encoder_counts_per_turn,
    )


def _settings(robot: Robot, axis: RobotAxis, torque_Nm: float) -> BootSettings:
    settings = boot_settings(axis.winch, torque_Nm)
    # the robot's rate may have been changed since its file was read
    return replace(settings, sync_period_s=robot.sync_period_s)


def device_of(
    robot: Robot,
    networks: Mapping[str, CanNetwork],
    reports: Sequence[BootReport],
    torque_Nm: Sequence[float],
) -> AxisBuses:
    """Return the axes as one device; raises the drivers' errors."""
    configs = [
        AxisConfig.from_boot(axis.winch.drive, report, most_Nm)
        for axis, report, most_Nm in zip(robot.axes, reports, torque_Nm, strict=True)
    ]
    buses = []
    for name, network in networks.items():
        places = robot.axes_on(name)
        buses.append(BusAxes(name, network, [configs[i] for i in places], places))
    return AxisBuses(buses, robot.sync_period_s)


def _lacking_guards(node: str, report: BootReport) -> str:
    """Return what to look at where a drive lacks what makes it stop by itself, else nothing."""
    lacking = [name for name in report.absent if name.startswith(_GUARDS)]
    if not lacking:
        return ""
    return f"{node} lacks {', '.join(lacking)}: check what stops it when its master falls silent"


def boot_notes(robot: Robot, reports: Sequence[BootReport]) -> list[str]:
    """Return what people should know of the drives that have booted."""
    notes = [
        _lacking_guards(f"bus {axis.bus} node {axis.node_id}", report)
        for axis, report in zip(robot.axes, reports, strict=True)
    ]
    return [note for note in notes if note]


def faults_text(
    axes: Sequence[RobotAxis], device: AxisBuses, networks: Mapping[str, CanNetwork], known: str
) -> str:
    """Return what each drive in fault says of it, asked by SDO, where that is not `known`."""
    texts = []
    for axis, faulted in zip(axes, device.faulted(), strict=True):
        if not faulted:
            continue
        try:
            code = networks[axis.bus].read_int(axis.node_id, 0x603F)
            why = fault_text(code) if code else "no code given (603Fh = 0)"
        except (SdoError, BusError):
            why = "the drive does not say why"
        if why not in known:
            texts.append(f"bus {axis.bus} node {axis.node_id}: {why}")
    return "; ".join(texts)
