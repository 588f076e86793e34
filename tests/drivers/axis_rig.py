"""A master in the test process and simulated drives in a separate process."""

from __future__ import annotations

import os
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import canopen

from cdpr_drivers.axes.axis_group import AxisGroup
from cdpr_drivers.axes.axis_layout import AxisConfig
from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.simbus import open_clock
from cdpr_drivers.canopen.boot import BootReport, BootSettings, boot_all
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import Mode, State
from cdpr_profiles import DriveProfile, load_drive
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.composition.simulator import OwnSimulator
from tests.fault_texts import alarm

MASTER = 127
PERIOD_S = 1e-3
HEARTBEAT_S = 0.1
DRIVE = load_drive("generic-cia402")
SETTINGS = BootSettings(MASTER, PERIOD_S, 3.0, 3.0)


def start_simulator(
    nodes: int = 1, plant: Path | None = None, *, paced: bool = False
) -> OwnSimulator:
    bus = f"simbus:axes-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    return OwnSimulator("winch-mpp0923d", bus, plant, nodes=nodes, paced=paced)


def dictionary(node_id: int) -> canopen.ObjectDictionary:
    return canopen.import_od(str(DRIVE.eds), node_id)


@contextmanager
def open_network(bus: str, nodes: list[int], *, lead: bool = True) -> Iterator[CanNetwork]:
    """Join a bus. Without `lead`, use wall-clock time, so that other programs can answer."""
    url = BusUrl.parse(bus)
    clock = open_clock([url]) if lead else PacedClock()
    network = CanNetwork(url, clock, nodes, MASTER, HEARTBEAT_S)
    try:
        for node in nodes:
            network.add_node(node, dictionary(node))
        yield network
    finally:
        network.close()
        clock.close()


class Rig:
    """Booted drives and their axis group. `run` runs cycles."""

    def __init__(
        self,
        bus: str,
        network: CanNetwork,
        drive: DriveProfile,
        nodes: list[int],
        period_s: float = PERIOD_S,
    ) -> None:
        self.bus = bus
        self.network = network
        self.nodes = nodes
        self.reports: dict[int, BootReport] = boot_all(
            network, dict.fromkeys(nodes, (drive, replace(SETTINGS, sync_period_s=period_s)))
        )
        axes = [AxisConfig.from_boot(drive, self.reports[node], 3.0) for node in nodes]
        self.group = AxisGroup(network, axes, period_s)
        network.start_heartbeat()

    def cycle(self) -> None:
        self.group.sync()
        self.group.receive()
        self.group.transmit()

    def run(
        self, seconds: float, until: Callable[[], bool] = lambda: False, alarms: bool = False
    ) -> float:
        """Run cycles for `seconds` of bus time or until `until`. Return the elapsed bus time."""
        begin = self.group.feedback.time_s
        for _ in range(round(seconds / PERIOD_S)):
            self.group.sync()
            self.group.receive()
            done = until()
            self.group.transmit()
            if not alarms:
                assert alarm(self.group) == ""
            if done:
                break
        return self.group.feedback.time_s - begin

    def reach(self, state: State) -> None:
        self.group.request(state)
        self.run(1.0, lambda: self.group.reached(state))
        assert self.group.reached(state)

    def set_mode(self, mode: int = Mode.CYCLIC_TORQUE) -> None:
        self.group.ask_mode(mode)
        self.run(1.0, self.group.mode_confirmed)
        assert self.group.mode_confirmed()

    def enable(self, mode: int = Mode.CYCLIC_TORQUE) -> None:
        self.set_mode(mode)
        self.reach(State.OPERATION_ENABLED)

    def until_alarm(self, seconds: float) -> tuple[str, float]:
        """Run until the group raises an alarm. Return its text and the elapsed bus time."""
        elapsed = self.run(seconds, lambda: bool(alarm(self.group)), alarms=True)
        return alarm(self.group), elapsed

    def misbehave(self, sub: int, value: int, node: int = 1) -> None:
        self.network.write(node, 0x2F00, sub, value)


@contextmanager
def open_rig(
    bus: str, nodes: list[int] | None = None, drive: DriveProfile = DRIVE, *, lead: bool = True
) -> Iterator[Rig]:
    nodes = nodes or [1]
    with ExitStack() as stack:
        network = stack.enter_context(open_network(bus, nodes, lead=lead))
        rig = Rig(bus, network, drive, nodes)
        stack.enter_context(rig.group)
        yield rig
