"""Measure the cost of a frame on each kind of bus, with this project's ports and python-can.

Run as a program with a bus as argument, it is the far end: a node that answers each of eight frames
with another, until its standard input ends.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from itertools import repeat
from typing import Any

import can
import numpy as np

from cdpr_drivers.bus import BusUrl, FrameBuffer, open_port
from cdpr_drivers.bus.socketcan import interface_problem
from cdpr_drivers.errors import BusError
from cdpr_rt.loop.realtime import one_core
from cdpr_sim_bus.bus.server import serve
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.errors import SimulatorError
from cdpr_sim_bus.frame import HEADER, pack_frame
from cdpr_tools.bench.harness import Figures, Row, Way, Work, cost_rows
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.processes import end_by_stdin, module_command

VCAN = BusUrl.parse("socketcan:vcan0")
_ASKED, _ANSWERED, _FRAMES = 0x200, 0x180, 8
"""Identifiers of requests and answers, to which a number from 1 to 8 is added; frames per call."""
_EXCHANGE = 2 * _FRAMES
_BLOCKS, _WARM_UP = 5, 5
_TIMEOUT_S, _STOP_TIMEOUT_S = 2.0, 10.0


def measure(exchanges: int, out: Output) -> Figures:
    """Measure `exchanges` in each way on each bus; raises WorkFailedError, BusError."""
    name = f"bench-{os.getpid()}"
    with _far_end(f"simbus:{name}") as ready:
        remote = BusUrl.parse(ready["socketcand"])
        slcan = BusUrl.parse(f"slcan:{ready['slcan']}?bitrate=1000000")
        with one_core(int(ready["pid"])):
            rows = compare(BusUrl.parse(f"simbus:{name}"), exchanges, out, channel=name)
        rows |= compare(remote, exchanges, out, channel=name, **remote.options)
        rows |= compare(
            slcan, exchanges, out, channel=ready["slcan"], bitrate=1_000_000, sleep_after_open=0.1
        )
    problem = interface_problem(VCAN)
    if not problem:
        rows |= measure_vcan(exchanges, out)
    return Figures(
        f"{_EXCHANGE} frames of 8 bytes an exchange, half of them answers, {exchanges} exchanges "
        "of each way: processor time of the host and wall time, us a frame",
        rows,
        notes=[f"socketcan: not measured: {problem}"] if problem else [],
        more={"exchanges": exchanges},
    )


def measure_vcan(exchanges: int, out: Output) -> dict[str, Row]:
    """Return the rows of a virtual CAN interface."""
    with _far_end(str(VCAN)) as ready, one_core(int(ready["pid"])):
        return compare(VCAN, exchanges, out, channel=VCAN.channel)


def compare(url: BusUrl, exchanges: int, out: Output, **stock: Any) -> dict[str, Row]:
    """Return the rows of a bus: by our port, and by python-can with the options `stock`."""
    name = url.interface
    out.note(f"{exchanges} exchanges with each implementation on {name} ...")
    ways: dict[str, Way] = {
        f"{name}, ours": lambda: _ours(url),
        f"{name}, python-can": lambda: _python_can(name, **stock),
    }
    rows = cost_rows(ways, exchanges, -(-exchanges // _BLOCKS), _WARM_UP, per=_EXCHANGE)
    for row in rows.values():
        row["frames/s"] = round(1e6 / row["wall mean"])
    return rows


@contextmanager
def _ours(url: BusUrl) -> Iterator[Iterator[Work]]:
    """Send eight frames and wait for the answers with a FramePort, as the cyclic exchange does."""
    tx, rx = FrameBuffer(_FRAMES), FrameBuffer(_FRAMES)
    tx.array["can_id"] = _ASKED + 1 + np.arange(_FRAMES)
    tx.array["length"] = 8
    with closing(open_port(url, [(_ANSWERED, 0x7F0)])) as port:
        port.settimeout(_TIMEOUT_S)
        send, recv_into = port.send, port.recv_into

        def exchange() -> None:
            try:
                for row in tx.rows:
                    send(row)
                for row in rx.rows:
                    if not recv_into(row):
                        raise port.lost()
            except OSError as error:
                raise port.lost(error) from error

        yield repeat(exchange)


@contextmanager
def _python_can(interface: str, channel: str, **options: Any) -> Iterator[Iterator[Work]]:
    """Exchange frames through a standard python-can bus, with its own filters."""
    messages = [
        can.Message(arbitration_id=_ASKED + 1 + k, data=bytes(8), is_extended_id=False)
        for k in range(_FRAMES)
    ]
    filters = [can.typechecking.CanFilter(can_id=_ANSWERED, can_mask=0x7F0)]
    with can.Bus(channel, interface, can_filters=filters, ignore_config=True, **options) as bus:
        send, recv = bus.send, bus.recv

        def exchange() -> None:
            for message in messages:
                send(message)
            for _ in messages:
                if recv(_TIMEOUT_S) is None:
                    raise BusError(f"{interface}: no answer through python-can")

        yield repeat(exchange)


@contextmanager
def _far_end(bus: str) -> Iterator[dict[str, Any]]:
    """Run the far end on `bus`; yield its report when it is up."""
    process = subprocess.Popen(
        module_command("cdpr_tools.bench.bus", bus),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None  # opened with PIPE
    try:
        line = process.stdout.readline()
        if not line:
            raise WorkFailedError(
                process.communicate()[1].strip() or "the other end of the bus did not start"
            )
        yield json.loads(line)["ready"]
    finally:
        end_by_stdin(process, _STOP_TIMEOUT_S)


class _EchoNode:
    """Answers 201h to 208h with 181h to 188h, 8 bytes each."""

    node_id = 1
    sync_period_s = 0.0

    def __init__(self) -> None:
        self.outbox: list[bytes] = []
        self.accepts = frozenset(range(_ASKED + 1, _ASKED + _FRAMES + 1))
        self._answers = {
            k: pack_frame(k - _ASKED + _ANSWERED, bytes(range(8))) for k in self.accepts
        }

    def receive(self, frame: bytes, now: float) -> None:  # noqa: ARG002  # as LocalNode has it
        self.outbox.append(self._answers[HEADER.unpack_from(frame)[0]])

    def advance(self, now: float) -> None:
        """Do nothing: nothing here takes time."""

    def next_event(self) -> float:
        return math.inf

    def close(self) -> None:
        """Do nothing: there is nothing to close."""


def _serve(bus: str) -> None:
    """Serve the bus, with all its gateways."""
    simulated = bus.startswith("simbus:")
    try:
        serve(
            [_EchoNode()],
            bus,
            mode=ClockMode.LOCKSTEP,
            until_stdin_ends=True,
            slcan=simulated,
            socketcand_port=0 if simulated else None,
        )
    except SimulatorError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    _serve(sys.argv[1])
