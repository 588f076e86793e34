"""Boot a robot's drives on its buses as one device; every session begins with this."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace

import numpy as np

from cdpr_drivers.axes.axis_buses import AxisBuses, BusAxes
from cdpr_drivers.axes.axis_layout import AxisConfig
from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.budget import machine_budget
from cdpr_drivers.bus.url import MasterLock
from cdpr_drivers.canopen.boot import BootReport, BootReports, BootSettings, boot_all
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import fault_text
from cdpr_drivers.errors import (
    BootError,
    BusError,
    ConfigurationError,
    DriverError,
    RobotBootError,
    SdoError,
)
from cdpr_profiles import Robot, RobotAxis, Winch
from cdpr_profiles.eds import load_dictionary
from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.fault import Fault

# objects that make a drive stop without a master, and the one that limits its torque
_GUARDS, _TORQUE_LIMIT = ("1016h", "6007h", "605Ah"), "6072h"


def open_networks(
    stack: ExitStack, robot: Robot, urls: Mapping[str, BusUrl], clock: Clock
) -> dict[str, CanNetwork]:
    """Open the buses of `robot` as the only master on this machine; `stack` closes them.

    Raises ConfigurationError, for example if another process of this machine uses one of them.
    """
    networks: dict[str, CanNetwork] = {}
    for name, url in urls.items():
        axes = [robot.axes[i] for i in robot.axes_on(name)]
        nodes = [axis.node_id for axis in axes]
        try:
            stack.enter_context(MasterLock(url))
            network = CanNetwork(url, clock, nodes, robot.master_node_id, robot.master_heartbeat_s)
        except BusError as error:
            raise ConfigurationError(f"bus {name}: {error}") from error
        stack.callback(network.close)
        for axis in axes:
            eds = axis.winch.drive.eds
            network.add_node(axis.node_id, load_dictionary(eds, axis.node_id))
        networks[name] = network
    return networks


def boot_robot(
    stack: ExitStack, robot: Robot, networks: Mapping[str, CanNetwork], torque_Nm: Sequence[float]
) -> tuple[dict[int, BootReport], dict[int, str]]:
    """Boot all buses at the same time; return, by axis, the reports and reasons for missing axes.

    Each drive's torque is limited (6072h) to `torque_Nm`, one for each axis of the robot. `stack`
    releases the drives. Raises RobotBootError if a mandatory drive does not boot.
    """

    bitrates = {bus.name: bus.bitrate_bit_s for bus in robot.buses}

    def boot_bus(name: str, network: CanNetwork) -> Callable[[], BootReports]:
        drives = {
            axis.node_id: (axis.winch.drive, _settings(robot, axis, most_Nm))
            for axis, most_Nm in ((robot.axes[i], torque_Nm[i]) for i in robot.axes_on(name))
        }
        return lambda: boot_all(network, drives, bitrate_bit_s=bitrates[name])

    clock = next(iter(networks.values())).clock
    tasks = clock.gather([boot_bus(*bus) for bus in networks.items()])
    failures: list[DriverError] = []
    booted: dict[int, BootReport] = {}
    absent: dict[int, str] = {}
    for name, task in zip(networks, tasks, strict=True):
        try:
            reports = task.result()
        except (BootError, BusError) as error:
            failures.append(error)
            error.add_note(f"on bus {name}")
            continue
        for i in robot.axes_on(name):
            node_id = robot.axes[i].node_id
            if node_id in reports:
                booted[i] = reports[node_id]
                stack.callback(networks[name].release, node_id)
            else:
                absent[i] = str(reports.missing[node_id])
    if failures:
        raise RobotBootError("; ".join(_error_text(error) for error in failures)) from failures[0]
    if not booted:
        raise RobotBootError(f"{robot.name}: no drive booted; {'; '.join(absent.values())}")
    return dict(sorted(booted.items())), absent


def _error_text(error: DriverError) -> str:
    *others, where = error.__notes__
    return f"{where}: " + "; ".join([str(error), *others])


def boot_settings(winch: Winch, torque_Nm: float) -> BootSettings:
    """Return the settings that the master adds to a drive's profile; `torque_Nm` is for 6072h."""
    return BootSettings(
        winch.master_node_id,
        winch.sync_period_s,
        torque_Nm,
        rated_torque_Nm=winch.motor.rated_torque_Nm,
        counts_per_turn=winch.encoder_counts_per_turn,
        torque_constant_Nm_per_Arms=winch.motor.torque_constant_Nm_per_Arms,
    )


def _settings(robot: Robot, axis: RobotAxis, torque_Nm: float) -> BootSettings:
    settings = boot_settings(axis.winch, torque_Nm)
    # the robot's rate may have changed since its file was read
    return replace(settings, sync_period_s=robot.sync_period_s, mandatory=axis.mandatory)


def device_of(
    robot: Robot,
    networks: Mapping[str, CanNetwork],
    booted: Mapping[int, BootReport],
    torque_Nm: Sequence[float],
) -> AxisBuses:
    """Return the axes that have booted as one device; raises the drivers' errors."""
    place_of = {i: place for place, i in enumerate(booted)}
    buses = []
    commands_s = {budget.bus: budget.commands_s for budget in machine_budget(robot)}
    # a single axis needs no name
    names = [axis.name if len(robot.axes) > 1 else "" for axis in robot.axes]
    for name, network in networks.items():
        booted_axes = [i for i in robot.axes_on(name) if i in booted]
        if not booted_axes:
            continue
        configs = [
            AxisConfig.from_boot(robot.axes[i].winch.drive, booted[i], torque_Nm[i], names[i])
            for i in booted_axes
        ]
        axis_numbers = [place_of[i] for i in booted_axes]
        buses.append(BusAxes(name, network, configs, axis_numbers, commands_s[name]))
    return AxisBuses(buses, robot.sync_period_s)


def _lacking_guards(node: str, report: BootReport) -> str:
    """Return what to check if a drive lacks objects that stop it or limit its torque; else ""."""
    lacking = [name for name in report.absent if name.startswith(_GUARDS)]
    texts = []
    if lacking:
        texts.append(f"lacks {', '.join(lacking)}: find out what stops it if it loses its master")
    if any(name.startswith(_TORQUE_LIMIT) for name in report.absent):
        texts.append(f"lacks {_TORQUE_LIMIT}: only the master limits its torque")
    return f"{node} {'; '.join(texts)}" if texts else ""


def boot_notes(
    robot: Robot, booted: Mapping[int, BootReport], absent: Mapping[int, str]
) -> list[str]:
    """Return notes about the drives that have booted, and about those that have not."""
    notes = []
    for i, report in booted.items():
        axis = robot.axes[i]
        notes.append(_lacking_guards(f"bus {axis.bus} node {axis.node_id} ({axis.name})", report))
    notes += [
        f"{robot.axes[i].name} (optional) is left out: {reason}" for i, reason in absent.items()
    ]
    return [note for note in notes if note]


def reported_errors(
    axes: Sequence[RobotAxis], device: AxisBuses, networks: Mapping[str, CanNetwork]
) -> Iterator[Fault]:
    """Yield the error code (603Fh) of each drive in fault that has one, read by SDO."""
    for i in np.flatnonzero(device.faulted()).tolist():
        axis = axes[i]
        try:
            number = networks[axis.bus].read_int(axis.node_id, 0x603F)
        except (SdoError, BusError):
            continue
        if number:
            code, _, meaning = fault_text(number).partition(" ")
            yield Fault(Limit.DRIVE, i, code, drive_source(axis), detail=meaning)


def drive_source(axis: RobotAxis) -> str:
    """Return the bus and node of a drive, as the source of a fault."""
    return f"bus {axis.bus} node {axis.node_id}"
