"""What a frame costs on each kind of bus: this project's ports beside plain python-can."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import can
import numpy as np
from numpy.typing import NDArray

from cdpr_drivers.bus import BusUrl, FrameBuffer, FramePort, open_port
from cdpr_drivers.bus.adapters.socketcan import interface_problem
from cdpr_drivers.errors import BusError
from cdpr_rt.runtime.realtime import one_core
from cdpr_tools.bench.cyclic.echo_bus import ANSWERED, ASKED, FRAMES
from cdpr_tools.bench.timing import Times, percentiles, timed
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.processes.module_process import end_by_stdin, module_command

PERCENTILES = (50.0, 99.9)
VCAN = "vcan0"
FRAMES_AN_EXCHANGE = 2 * FRAMES

_BLOCKS = 5
_WARM_UP = 5
_TIMEOUT_S = 2.0
_MASK = 0x7F0
_US = 1e-3  # of a ns
_RESOLUTION_US = 0.01
_STOP_TIMEOUT_S = 10.0
_DELIVERIES = 200


class OwnAccess:
    """A FramePort, as the cyclic exchange uses it."""

    name = "ours"

    def __init__(self, url: BusUrl) -> None:
        self._url = url
        self._tx, self._rx = FrameBuffer(FRAMES), FrameBuffer(FRAMES)
        self._tx.array["can_id"] = ASKED + 1 + np.arange(FRAMES)
        self._tx.array["length"] = 8
        self.port: FramePort

    def open(self) -> None:
        """Join the bus."""
        self.port = open_port(self._url, [(ANSWERED, _MASK)])
        self.port.settimeout(_TIMEOUT_S)

    def exchange(self) -> None:
        """Send eight frames and wait for the answers; raises BusError."""
        send, recv_into = self.port.send, self.port.recv_into
        try:
            for row in self._tx.rows:
                send(row)
            for row in self._rx.rows:
                if not recv_into(row):
                    raise self.port.lost()
        except OSError as error:
            raise self.port.lost(error) from error

    def close(self) -> None:
        """Leave the bus."""
        self.port.close()


class PythonCanAccess:
    """A stock python-can bus, with its own filters."""

    name = "python-can"

    def __init__(self, interface: str, channel: str, **options: Any) -> None:
        self._interface, self._channel, self._options = interface, channel, options
        self._messages = [
            can.Message(arbitration_id=ASKED + 1 + k, data=bytes(8), is_extended_id=False)
            for k in range(FRAMES)
        ]
        self._bus: can.BusABC

    def open(self) -> None:
        """Join the bus."""
        filters = [can.typechecking.CanFilter(can_id=ANSWERED, can_mask=_MASK)]
        self._bus = can.Bus(
            self._channel, self._interface, can_filters=filters, ignore_config=True, **self._options
        )

    def exchange(self) -> None:
        """Send eight frames and wait for the answers; raises BusError."""
        send, recv = self._bus.send, self._bus.recv
        for message in self._messages:
            send(message)
        for _ in range(FRAMES):
            if recv(_TIMEOUT_S) is None:
                raise BusError(f"{self._interface}: no answer through python-can")

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


def measure(exchanges: int, out: Output) -> dict[str, Any]:
    """Measure `exchanges` of each variant on each bus and return the figures, times in us.

    The variants take turns in blocks, so that what else the machine does hits both alike. Raises
    WorkFailedError, BusError.
    """
    buses: dict[str, Any] = {}
    name = f"bench-{os.getpid()}"
    with _echo(f"simbus:{name}") as ready:
        pid = int(ready["pid"])
        remote = BusUrl.parse(ready["socketcand"])
        for url, stock, core in (
            (BusUrl.parse(f"simbus:{name}"), PythonCanAccess("simbus", name), one_core(pid)),
            (remote, PythonCanAccess("socketcand", name, **remote.options), nullcontext()),
            (
                BusUrl.parse(f"slcan:{ready['slcan']}?bitrate=1000000"),
                PythonCanAccess("slcan", ready["slcan"], bitrate=1_000_000, sleep_after_open=0.1),
                nullcontext(),
            ),
        ):
            out.note(f"{exchanges} exchanges of each variant on {url.interface} ...")
            with core:
                buses[url.interface] = _compare(url, stock, exchanges)
    buses["socketcan"] = _on_vcan(exchanges, out)
    return {
        "frames_per_exchange": FRAMES_AN_EXCHANGE,
        "exchanges": exchanges,
        "buses": buses,
    }


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as a table, a line for each variant of each bus."""
    lines = [
        f"{figures['frames_per_exchange']} frames of 8 bytes an exchange, half of them answers; "
        f"{figures['exchanges']} exchanges of each variant",
        f"{'':24}{'':>10}{'host CPU us a frame':>30}{'wall us a frame':>20}{'python-can':>14}",
        f"{'':24}{'frames/s':>10}{'mean':>10}"
        + f"{'p50':>10}{'p99.9':>10}" * 2
        + f"{'/ ours':>14}",
    ]
    for name in ("simbus", "socketcan", "socketcand", "slcan"):
        measured = figures["buses"][name]
        if "missing" in measured:
            lines.append(f"{name}: not measured: {measured['missing']}")
            continue
        for variant in ("ours", "python-can"):
            one = measured[variant]
            cpu, wall = one["cpu_us_per_frame"], one["wall_us_per_frame"]
            columns = (cpu["mean"], cpu["p50"], cpu["p99.9"], wall["p50"], wall["p99.9"])
            numbers = "".join(f"{value:10.1f}" for value in columns)
            ratio = f"{measured['python_can_over_ours']:14.2f}" if variant == "ours" else ""
            lines.append(f"{name + ' ' + variant:24}{one['frames_per_s']:10}{numbers}{ratio}")
        if "delivery_us" in measured:
            late = measured["delivery_us"]
            lines.append(
                f"{'':24}from the kernel's time stamp to the program: "
                f"p50 {late['p50']:.1f} us, p99.9 {late['p99.9']:.1f} us"
            )
    return lines


def _on_vcan(exchanges: int, out: Output) -> dict[str, Any]:
    """Return the figures on a virtual CAN, or why there are none."""
    url = BusUrl.parse(f"socketcan:{VCAN}")
    problem = interface_problem(url)
    if problem:
        return {"missing": problem}
    out.note(f"{exchanges} exchanges of each variant on {url} ...")
    with _echo(str(url)) as ready, one_core(int(ready["pid"])):
        access = OwnAccess(url)
        figures = _compare(url, PythonCanAccess("socketcan", VCAN), exchanges)
        figures["delivery_us"] = _delivery(access)
    return figures


def _compare(url: BusUrl, stock: PythonCanAccess, exchanges: int) -> dict[str, Any]:
    variants = (OwnAccess(url), stock)
    times: dict[str, list[tuple[Times, Times]]] = {variant.name: [] for variant in variants}
    share = -(-exchanges // _BLOCKS)
    left = exchanges
    while left > 0:
        for variant in variants:
            times[variant.name].append(_run(variant, min(share, left)))
        left -= share
    figures: dict[str, Any] = {"url": str(url)}
    for variant in variants:
        cpu = np.concatenate([pair[0] for pair in times[variant.name]]) / FRAMES_AN_EXCHANGE
        wall = np.concatenate([pair[1] for pair in times[variant.name]]) / FRAMES_AN_EXCHANGE
        figures[variant.name] = {
            "frames_per_s": round(1e9 / float(wall.mean())),
            "cpu_us_per_frame": _percentiles(cpu),
            "wall_us_per_frame": _percentiles(wall),
        }
    # of the means: some kernels count process time in ticks of 10 ms
    costs = [figures[variant.name]["cpu_us_per_frame"]["mean"] for variant in variants]
    figures["python_can_over_ours"] = round(costs[1] / max(costs[0], _RESOLUTION_US), 2)
    return figures


def _percentiles(times_ns: NDArray[np.float64]) -> dict[str, float]:
    times_us = times_ns * _US
    return {"mean": round(float(times_us.mean()), 2)} | percentiles(
        times_us, *PERCENTILES, digits=2
    )


def _run(variant: OwnAccess | PythonCanAccess, exchanges: int) -> tuple[Times, Times]:
    """Return process time (of all threads) and wall time of each exchange, ns."""
    variant.open()
    try:
        return timed(variant.exchange, exchanges, _WARM_UP)
    finally:
        variant.close()


def _delivery(variant: OwnAccess) -> dict[str, float]:
    """Return how long after the kernel's stamp the last answer of an exchange is in hand."""
    variant.open()
    try:
        late_ns = np.zeros(_DELIVERIES)
        for k in range(_DELIVERIES):
            variant.exchange()
            late_ns[k] = (time.time() - variant.port.arrival_s()) * 1e9
    finally:
        variant.close()
    return _percentiles(late_ns)


@contextmanager
def _echo(bus: str) -> Iterator[dict[str, Any]]:
    """Run the far end on `bus`; yield what it reported when it was up."""
    process = subprocess.Popen(
        module_command("cdpr_tools.bench.cyclic.echo_bus", bus),
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
            raise WorkFailedError(process.communicate()[1].strip() or "the far end did not start")
        yield json.loads(line)["ready"]
    finally:
        end_by_stdin(process, _STOP_TIMEOUT_S)
