"""Run nodes on a bus of their own, or on a real one, until told to stop."""

from __future__ import annotations

import gc
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import Any, Protocol

from cdpr_sim_bus.bus.adapters.gateway import Gateway
from cdpr_sim_bus.bus.client import raw_can_socket
from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.bus.switch import LocalNode
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.frame import FrameLog

_PRIORITY = 40
_CHANNEL = "can0"


class Loop(Protocol):
    """Event loop of one bus or several."""

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
) -> None:
    """Run `nodes` on `bus` until SIGTERM or SIGINT, then close them.

    `bus` is simbus:NAME, which is opened here, or socketcan:IFACE, which must exist. When all is
    up, one line of JSON goes to standard output: {"ready": {"bus", "pid", and the bus status}}; a
    terminal gets a few readable lines instead.
    With `until_stdin_ends` the end of standard input (a pipe whose other end the parent holds)
    stops it too, so that a simulator never outlives the command that started it. All frames go to
    `frame_log`, as those of can0.

    A simbus can also be reached through a serial CAN adapter (`slcan`) on a pseudo-terminal and by
    the socketcand protocol on a port of 127.0.0.1 (0: any that is free); "ready" then holds
    "slcan", the terminal's path, "slcan_pid", the process to kill as one pulls the adapter out, and
    "socketcand", the URL, with "socketcand_pid".

    Raises:
        BusSetupError: the bus cannot be opened, or a gateway to it.
        SimulatorError: a real interface went away while running.
    """
    if not bus.startswith("simbus:") and (slcan or socketcand_port is not None):
        raise BusSetupError(f"bus {bus!r}: --slcan and --socketcand are for simbus:NAME only")
    with ExitStack() as stack:
        logged = with_frame_log(nodes, frame_log, _CHANNEL)
        hub = open_hub(stack, logged, bus, mode=mode, bitrate=bitrate, truth_log=truth_log)
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
    """Return the hub of `bus`, closed with `stack`; raises BusSetupError."""
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

    Raises BusSetupError when standard input cannot be watched, and what the loop raises.
    """
    with _stopped_by_signals(loop):
        if until_stdin_ends:
            _stop_with_stdin(loop)
        print_ready(ready)
        # what lives from here on is never garbage, so it need not be searched
        gc.collect()
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
        adapter = Gateway(
            "cdpr_sim_bus.bus.adapters.serial_adapter", hub.name, str(hub.load.bitrate)
        )
        stack.callback(adapter.close)
        report |= {"slcan": adapter.report["path"], "slcan_pid": adapter.pid}
    if socketcand_port is not None:
        server = Gateway(
            "cdpr_sim_bus.bus.adapters.socketcand_server", hub.name, str(socketcand_port)
        )
        stack.callback(server.close)
        url = f"socketcand://127.0.0.1:{server.report['port']}/{hub.name}"
        report |= {"socketcand": url, "socketcand_pid": server.pid}
    return report


def _use_batch_scheduling() -> None:
    """Use SCHED_BATCH: do not preempt a master on the same core at each frame.

    Saves two changes of context a cycle; a scheduling class that the user chose is kept.
    """
    if os.sched_getscheduler(0) == os.SCHED_OTHER:
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def _raise_priority() -> None:
    """Run at real-time priority, as a drive's own processor would, where that is allowed."""
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
        raise BusSetupError("standard input must be a pipe to be watched for its end") from None


_SHOWN_KEYS = ("robot", "bus", "mode", "nodes", "slcan", "socketcand", "truth_log")


def print_ready(ready: dict[str, Any]) -> None:
    """Print {"ready": ...} as one line of JSON, or a readable text on a terminal."""
    if not sys.stdout.isatty():
        print(json.dumps({"ready": ready}), flush=True)
        return
    for line in _lines(ready):
        print(line)
    print("up; Ctrl-C ends it", flush=True)


def _lines(ready: dict[str, Any]) -> Iterator[str]:
    for key in _SHOWN_KEYS:
        value = ready.get(key)
        if value is not None:
            shown = ", ".join(map(str, value)) if isinstance(value, list) else value
            yield f"{key.replace('_', ' '):12}{shown}"
    buses = ready.get("buses")
    for bus in buses.values() if isinstance(buses, dict) else ():
        yield from _lines(bus)
