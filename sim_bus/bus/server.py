"""Run nodes on simulated buses started here, or on real buses, until a stop signal."""

from __future__ import annotations

import gc
import json
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Protocol

from cdpr_profiles.errors import printable
from cdpr_sim_bus.bus.client import LocalNode, raw_can_socket
from cdpr_sim_bus.bus.gateways import Gateway
from cdpr_sim_bus.bus.hub import FINE_WAIT_S, Hub
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.frame import FrameLog

_PRIORITY = 40
_CHANNEL = "can0"


class Bench(Protocol):
    """Takes orders that clients send on a bus beside the frames."""

    def connect(self, hubs: Sequence[Hub]) -> None:
        """Take the orders of clients of these buses."""


class Loop(Protocol):
    """Event loop of one or several buses."""

    def run(self) -> None:
        """Carry frames until `stop` is called."""

    def stop(self) -> None:
        """End `run` soon; may be called from a signal handler."""

    def watch(self, descriptor: int, handler: Callable[[], None]) -> None:
        """Call `handler` whenever `descriptor` is readable."""


def serve(
    nodes: Sequence[LocalNode],
    bus: str,
    *,
    mode: ClockMode = ClockMode.LOCKSTEP,
    bitrate: int = 1_000_000,
    truth_log: str | None = None,
    frame_log: FrameLog | None = None,
    until_stdin_ends: bool = False,
    slcan: bool = False,
    socketcand_port: int | None = None,
    bench: Bench | None = None,
) -> None:
    """Run `nodes` on `bus` until SIGTERM or SIGINT, then close them.

    `bus` is simbus:NAME, which is opened here, or socketcan:IFACE, which must exist. When all is
    ready, one line of JSON goes to standard output: {"ready": {"bus", "pid", and the bus status}};
    a terminal gets a few readable lines instead. With `until_stdin_ends`, the end of standard input
    also stops it: if the parent holds the other end of this pipe, the simulator never outlives it.
    `frame_log` receives all frames, as those of can0. `bench` takes orders through a simbus.

    A simbus can also be reached through a serial CAN adapter (`slcan`) on a pseudo-terminal and by
    the socketcand protocol on a port of 127.0.0.1 (0: any free port). "ready" then contains
    "slcan", the terminal's path, "slcan_pid", the process to kill to unplug the adapter, and
    "socketcand", the URL, with "socketcand_pid".

    Raises:
        BusSetupError: the bus or a gateway to it cannot be opened.
        SimulatorError: a real interface was lost while running.
    """
    if not bus.startswith("simbus:") and (slcan or socketcand_port is not None):
        raise BusSetupError(f"bus {bus!r}: --slcan and --socketcand are for simbus:NAME only")
    with ExitStack() as stack:
        logged = with_frame_log(nodes, frame_log, _CHANNEL)
        hub = open_hub(stack, logged, bus, mode=mode, bitrate=bitrate, truth_log=truth_log)
        if bench is not None:
            bench.connect([hub])
        gateways = _open_gateways(stack, hub, slcan, socketcand_port)
        ready = {"bus": bus, "pid": os.getpid(), **gateways, **hub.status()}
        run_until_stopped(hub, ready, mode, until_stdin_ends)


def with_frame_log(
    nodes: Sequence[LocalNode], log: FrameLog | None, channel: str
) -> Sequence[LocalNode]:
    """Return `nodes` and a listener that writes the bus to `log` as `channel`."""
    return nodes if log is None else (*nodes, log.listener(channel))


def open_hub(
    stack: ExitStack,
    nodes: Sequence[LocalNode],
    bus: str,
    *,
    mode: ClockMode,
    bitrate: int,
    truth_log: str | None = None,
) -> Hub:
    """Return the hub of `bus`, which `stack` closes; raises BusSetupError."""
    interface, _, channel = bus.partition(":")
    name = channel if interface == "simbus" else bus
    hub = Hub(nodes, mode=mode, bitrate=bitrate, name=name, truth_log=truth_log)
    stack.callback(hub.close)
    if interface == "simbus":
        hub.listen()
    elif interface == "socketcan":
        hub.attach(raw_can_socket(channel), essential=True)
    else:
        raise BusSetupError(f"bus {bus!r}: simulated drives run on simbus:NAME or socketcan:IFACE")
    return hub


def run_until_stopped(
    loop: Loop, ready: dict[str, Any], mode: ClockMode, until_stdin_ends: bool
) -> None:
    """Print `ready`, then run `loop` until SIGTERM or SIGINT.

    Raises BusSetupError if standard input cannot be watched, and the errors of the loop.
    """
    with _stopped_by_signals(loop):
        if until_stdin_ends:
            _stop_with_stdin(loop)
        print_ready(ready)
        if mode is not ClockMode.LOCKSTEP:
            gc.collect()  # takes 0.1 s, for which a master in lockstep would wait
        # objects that exist now are never garbage, so the collector need not search them
        gc.freeze()
        if mode is ClockMode.LOCKSTEP:
            _use_batch_scheduling()
        else:
            _raise_priority()
        loop.run()


def _open_gateways(
    stack: ExitStack, hub: Hub, slcan: bool, socketcand_port: int | None
) -> dict[str, Any]:
    """Start the gateways to the bus until `stack` ends; return their addresses."""
    if ":" in hub.name and (slcan or socketcand_port is not None):
        raise BusSetupError(f"bus {hub.name!r}: --slcan and --socketcand are for simbus:NAME only")
    report: dict[str, Any] = {}
    if slcan:
        adapter = Gateway("slcan", hub.name, str(hub.load.bitrate))
        stack.callback(adapter.close)
        report |= {"slcan": adapter.report["path"], "slcan_pid": adapter.pid}
    if socketcand_port is not None:
        server = Gateway("socketcand", hub.name, str(socketcand_port))
        stack.callback(server.close)
        url = f"socketcand://127.0.0.1:{server.report['port']}/{hub.name}"
        report |= {"socketcand": url, "socketcand_pid": server.pid}
    return report


def _use_batch_scheduling() -> None:
    """Use SCHED_BATCH: do not preempt a master on the same core at each frame.

    This saves two context switches a cycle; a scheduling class chosen by the user is kept.
    """
    if os.sched_getscheduler(0) == os.SCHED_OTHER:
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def _raise_priority() -> None:
    """Run at real-time priority, as a drive's processor would, if that is allowed."""
    if os.sched_getscheduler(0) == os.SCHED_OTHER:
        with suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))


@contextmanager
def _stopped_by_signals(loop: Loop) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = {
        number: signal.signal(number, lambda *_: loop.stop())
        for number in (signal.SIGTERM, signal.SIGINT)
    }
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _stop_with_stdin(loop: Loop) -> None:
    descriptor = sys.stdin.fileno()

    def read() -> None:
        if not os.read(descriptor, 4096):
            loop.stop()

    try:
        loop.watch(descriptor, read)
    except PermissionError:
        raise BusSetupError("--exit-with-stdin: standard input must be a pipe") from None


_SHOWN_KEYS = ("robot", "bus", "mode", "nodes", "slcan", "socketcand", "truth_log")


def print_ready(ready: dict[str, Any]) -> None:
    """Print {"ready": ...} as one line of JSON, or a readable text on a terminal."""
    if not sys.stdout.isatty():
        print(json.dumps({"ready": ready}), flush=True)
        return
    for line in _lines(ready):
        print(printable(line))
    print("running; Ctrl-C ends it", flush=True)


def _lines(ready: dict[str, Any]) -> Iterator[str]:
    for key in _SHOWN_KEYS:
        value = ready.get(key)
        if value is not None:
            shown = ", ".join(map(str, value)) if isinstance(value, list) else value
            yield f"{key.replace('_', ' '):12}{shown}"
    buses = ready.get("buses")
    for bus in buses.values() if isinstance(buses, dict) else ():
        yield from _lines(bus)


# Several buses of one robot in one process and one thread.


@dataclass(frozen=True)
class FleetBus:
    """One bus and its nodes; `url` is simbus:NAME or socketcan:IFACE."""

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

        Raises SimulatorError if one of them is lost.
        """
        hubs = self._hubs
        while not any(hub.stopping for hub in hubs.values()):
            self._turn()
        for hub in hubs.values():
            hub.check()

    def _turn(self) -> None:
        """Run a turn of the hubs that have frames or whose wait is over."""
        waits = {hub: hub.wait_s() for hub in self._hubs.values()}
        shortest = min((wait for wait in waits.values() if wait is not None), default=None)
        if shortest and shortest < FINE_WAIT_S:
            select.select([self._poller], [], [], shortest)
        ready = dict(
            self._poller.poll(0.0 if shortest is not None and shortest < FINE_WAIT_S else shortest)
        )
        # always in the same order, because the drives of all buses may share their physics
        for descriptor, hub in self._hubs.items():
            if descriptor in ready:
                hub.turn(0.0)
                waits.pop(hub)
        # if one bus has frames, no time has passed on the others
        expired = 0.0 if ready else shortest
        for hub, wait in waits.items():
            if wait is not None and expired is not None and wait <= expired:
                hub.turn(0.0)

    def close(self) -> None:
        """Close the loop's own descriptors."""
        self._poller.close()


def serve_fleet(
    robot: str,
    buses: Sequence[FleetBus],
    *,
    mode: ClockMode = ClockMode.LOCKSTEP,
    until_stdin_ends: bool = False,
    frame_log: FrameLog | None = None,
    truth_log: str | None = None,
    bench: Bench | None = None,
) -> None:
    """Run the nodes of all `buses` until SIGTERM or SIGINT, then close them.

    When everything is ready, one line of JSON goes to standard output: {"ready": {"robot", "pid",
    "buses": {name: {"bus", and the bus status}}}}. With `until_stdin_ends`, the end of standard
    input also stops it. `frame_log` receives all frames, under the names of the buses. `bench`
    takes orders through each simbus. Raises BusSetupError if a bus cannot be opened,
    SimulatorError if a real interface was lost.
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
        loop: Loop = hubs[buses[0].name]
        if len(hubs) > 1:
            loop = fleet = Fleet(list(hubs.values()))
            stack.callback(fleet.close)
        if bench is not None:
            bench.connect(list(hubs.values()))
        report = {bus.name: {"bus": bus.url, **hubs[bus.name].status()} for bus in buses}
        ready = {"robot": robot, "pid": os.getpid(), "buses": report}
        run_until_stopped(loop, ready, mode, until_stdin_ends)
