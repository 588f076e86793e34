"""Run nodes on a bus of their own, or on a real one, until told to stop."""

from __future__ import annotations

import gc
import json
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

from sim_bus.client import raw_can_socket
from sim_bus.clock import ClockMode
from sim_bus.control import status
from sim_bus.errors import BusSetupError
from sim_bus.hub import Hub
from sim_bus.membership import Gateway
from sim_bus.node_protocol import LocalNode

_PRIORITY = 40


def serve(
    nodes: Sequence[LocalNode],
    bus: str,
    *,
    mode: ClockMode = ClockMode.LOCKSTEP,
    bitrate: int = 1_000_000,
    truth_log: str | None = None,
    until_stdin_ends: bool = False,
    slcan: bool = False,
    socketcand_port: int | None = None,
) -> None:
    """Run `nodes` on `bus` until SIGTERM or SIGINT, then close them.

    `bus` is simbus:NAME, which is opened here, or socketcan:IFACE, which must exist. When all is
    up, one line of JSON goes to standard output: {"ready": {"bus", "pid", and the bus status}}.
    With `until_stdin_ends` the end of standard input (a pipe whose other end the parent holds)
    stops it too, so that a simulator never outlives the command that started it.

    A simbus can also be reached through a serial CAN adapter (`slcan`) on a pseudo-terminal and by
    the socketcand protocol on a port of 127.0.0.1 (0: any that is free); "ready" then holds
    "slcan", the terminal's path, "slcan_pid", the process to kill as one pulls the adapter out, and
    "socketcand", the URL, with "socketcand_pid".

    Raises:
        BusSetupError: the bus cannot be opened, or a gateway to it.
        SimulatorError: a real interface went away while running.
    """
    interface, _, channel = bus.partition(":")
    hub = Hub(
        nodes,
        mode=mode,
        bitrate=bitrate,
        name=channel if interface == "simbus" else bus,
        truth_log=truth_log,
    )
    try:
        if interface == "simbus":
            hub.listen()
        elif interface == "socketcan":
            hub.attach(raw_can_socket(channel), essential=True)
        else:
            raise BusSetupError(
                f"bus {bus!r}: simulated drives run on simbus:NAME or socketcan:IFACE"
            )
        with ExitStack() as stack:
            gateways = _open_gateways(stack, interface, hub, slcan, socketcand_port)
            stack.enter_context(_stopped_by_signals(hub))
            if until_stdin_ends:
                _stop_with_stdin(hub)
            ready = {"ready": {"bus": bus, "pid": os.getpid(), **gateways, **status(hub)}}
            print(json.dumps(ready), flush=True)
            # what lives from here on is never garbage, so it need not be searched
            gc.collect()
            gc.freeze()
            if mode is ClockMode.LOCKSTEP:
                _let_sender_finish()
            else:
                _answer_at_once()
            hub.run()
    finally:
        hub.close()


def _open_gateways(
    stack: ExitStack, interface: str, hub: Hub, slcan: bool, socketcand_port: int | None
) -> dict[str, Any]:
    """Start what else the bus can be reached by, until `stack` ends; return how to reach it."""
    if interface != "simbus" and (slcan or socketcand_port is not None):
        raise BusSetupError(f"bus {hub.name!r}: --slcan and --socketcand are for simbus:NAME only")
    told: dict[str, Any] = {}
    if slcan:
        adapter = Gateway("sim_bus.serial_adapter", hub.name, str(hub.load.bitrate))
        stack.callback(adapter.close)
        told |= {"slcan": adapter.told["path"], "slcan_pid": adapter.pid}
    if socketcand_port is not None:
        server = Gateway("sim_bus.socketcand_server", hub.name, str(socketcand_port))
        stack.callback(server.close)
        url = f"socketcand://127.0.0.1:{server.told['port']}/{hub.name}"
        told |= {"socketcand": url, "socketcand_pid": server.pid}
    return told


def _let_sender_finish() -> None:
    """Do not preempt a master on the same core at each frame, but when it waits for answers.

    Saves two changes of context a cycle; a scheduling class that the user chose is kept.
    """
    if os.sched_getscheduler(0) == os.SCHED_OTHER:
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def _answer_at_once() -> None:
    """Go before ordinary processes, as a drive's own processor does, where that is allowed."""
    if os.sched_getscheduler(0) == os.SCHED_OTHER:
        with suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))


@contextmanager
def _stopped_by_signals(hub: Hub) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = {
        number: signal.signal(number, lambda *_: hub.stop())
        for number in (signal.SIGTERM, signal.SIGINT)
    }
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _stop_with_stdin(hub: Hub) -> None:
    descriptor = sys.stdin.fileno()

    def read() -> None:
        if not os.read(descriptor, 4096):
            hub.stop()

    try:
        hub.watch(descriptor, read)
    except PermissionError:
        raise BusSetupError("standard input must be a pipe to be watched for its end") from None
