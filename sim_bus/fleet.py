"""Several buses of one robot in one process and one thread."""

from __future__ import annotations

import os
import select
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.bus.server import open_hub, run_until_stopped, with_frame_log
from cdpr_sim_bus.bus.switch import LocalNode
from cdpr_sim_bus.bus.watcher import FINE_WAIT_S
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.frame import FrameLog


@dataclass(frozen=True)
class FleetBus:
    """One bus and what hangs on it; `url` is simbus:NAME or socketcan:IFACE."""

    name: str
    url: str
    bitrate_bit_s: int
    nodes: Sequence[LocalNode]


class Fleet:
    """Event loop of several hubs, each with its own bus time."""

    def __init__(self, hubs: Sequence[Hub]) -> None:
        self._hubs = {hub.fileno(): hub for hub in hubs}
        self._first = hubs[0]
        for number, hub in enumerate(hubs):
            hub.robot_hubs, hub.buses_before = hubs, hubs[:number]
        self._poller = select.epoll()
        for descriptor in self._hubs:
            self._poller.register(descriptor, select.EPOLLIN)

    def watch(self, descriptor: int, handler: Callable[[], None]) -> None:
        """Call `handler` whenever `descriptor` is readable."""
        self._first.watch(descriptor, handler)

    def stop(self) -> None:
        """End `run` soon; may be called from a signal handler or another thread."""
        self._first.stop()

    def run(self) -> None:
        """Carry frames on all buses until `stop` is called.

        Raises SimulatorError when one of them has gone.
        """
        hubs = self._hubs
        while not any(hub.stopping for hub in hubs.values()):
            self._turn()
        for hub in hubs.values():
            hub.check()

    def _turn(self) -> None:
        """Run a turn of those hubs that have frames or whose wait is over."""
        waits = {hub: hub.wait_s() for hub in self._hubs.values()}
        shortest = min((wait for wait in waits.values() if wait is not None), default=None)
        if shortest and shortest < FINE_WAIT_S:
            select.select([self._poller], [], [], shortest)
        ready = dict(
            self._poller.poll(0.0 if shortest is not None and shortest < FINE_WAIT_S else shortest)
        )
        # always in the same order, as the drives of all buses may share their physics
        for descriptor, hub in self._hubs.items():
            if descriptor in ready:
                hub.turn(0.0)
                waits.pop(hub)
        # with frames on one bus no time has passed on the others
        expired = 0.0 if ready else shortest
        for hub, wait in waits.items():
            if wait is not None and expired is not None and wait <= expired:
                hub.turn(0.0)

    def close(self) -> None:
        """Free what the loop itself holds."""
        self._poller.close()


def serve_fleet(
    robot: str,
    buses: Sequence[FleetBus],
    *,
    mode: ClockMode = ClockMode.LOCKSTEP,
    until_stdin_ends: bool = False,
    frame_log: FrameLog | None = None,
    truth_log: str | None = None,
) -> None:
    """Run the nodes of all `buses` until SIGTERM or SIGINT, then close them.

    When all is up, one line of JSON goes to standard output: {"ready": {"robot", "pid", "buses":
    {name: {"bus", and the bus status}}}}. With `until_stdin_ends` the end of standard input stops
    it too. All frames go to `frame_log`, under the names of the buses. Raises BusSetupError for a
    bus that cannot be opened, SimulatorError for a real interface that went away.
    """
    with ExitStack() as stack:
        hubs = {
            bus.name: open_hub(
                stack,
                with_frame_log(bus.nodes, frame_log, bus.name),
                bus.url,
                mode=mode,
                bitrate=bus.bitrate_bit_s,
                truth_log=truth_log,
            )
            for bus in buses
        }
        fleet = Fleet(list(hubs.values()))
        stack.callback(fleet.close)
        report = {bus.name: {"bus": bus.url, **hubs[bus.name].status()} for bus in buses}
        ready = {"robot": robot, "pid": os.getpid(), "buses": report}
        run_until_stopped(fleet, ready, mode, until_stdin_ends)
