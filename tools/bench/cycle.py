"""What one exchange with eight axes costs the host, three ways on one bus in one run."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.realtime import one_core
from drivers.axis_group import AxisConfig, AxisGroup
from drivers.boot import BootReport, BootSettings, boot
from drivers.bus import BusUrl, query_status
from drivers.bus.leading import open_clock
from drivers.data_sheet import load_dictionary
from drivers.network import CanNetwork
from profiles import Winch, load_winch
from tools.bench.contenders import Exchange, FloorExchange, LibraryExchange, OwnExchange
from tools.output import Output
from tools.simulator import OwnSimulator

AXES = 8
PERIOD_S = 2e-3
"""Eight drives fill 1.9 ms of a bus at 1 Mbit/s."""
TARGETS = {"canopen_over_ours": 6.0, "ours_over_floor": 1.5}
"""The first ratio must be at least, the second at most this."""
PERCENTILES = (50.0, 99.9)

_WINCH = "winch-mpp0923d"
_BLOCK = 500
_WARM_UP = 50
_US = 1e-3  # of a ns

Times = NDArray[np.int64]


def measure(cycles: int, out: Output) -> dict[str, Any]:
    """Measure `cycles` exchanges of each way and return the figures, times in µs.

    The ways take turns in blocks, so that what else the machine does hits all alike. Raises
    BusError when an axis does not answer.
    """
    blocks = [_BLOCK] * (cycles // _BLOCK) + [cycles % _BLOCK] * (cycles % _BLOCK > 0)
    with _contenders(out) as (bus, ways):
        times: dict[str, list[tuple[Times, Times]]] = {way.name: [] for way in ways}
        frames = {way.name: [0, 0] for way in ways}
        # no progress bar: the thread that draws it would be measured with them
        out.note(f"{cycles} exchanges of each of {len(ways)} ways, some seconds per 10000 ...")
        for block in blocks:
            for way in ways:
                times[way.name].append(_run(way, block, bus, frames[way.name]))
        statuswords = {way.name: way.statuswords() for way in ways}
    own_cost = _clock_cost_ns()
    cpu = {name: np.concatenate([t[0] for t in of]) - own_cost for name, of in times.items()}
    wall = {name: np.concatenate([t[1] for t in of]) for name, of in times.items()}
    cpu_us = {name: _percentiles(values) for name, values in cpu.items()}
    return {
        "axes": AXES,
        "cycles": cycles,
        "period_us": round(PERIOD_S * 1e6),
        "cpu_us": cpu_us,
        "wall_us": {name: _percentiles(values) for name, values in wall.items()},
        "frames_per_cycle": {name: round(f / s, 2) for name, (f, s) in frames.items()},
        "statuswords": statuswords,
        **_judge(cpu_us),
    }


def _judge(cpu_us: dict[str, dict[str, float]]) -> dict[str, Any]:
    p50 = {name: values["p50"] for name, values in cpu_us.items()}
    ratios = {
        "canopen_over_ours": round(p50["canopen"] / p50["ours"], 2),
        "ours_over_floor": round(p50["ours"] / p50["floor"], 2),
    }
    return {
        "ratios": ratios,
        "targets": TARGETS,
        "reached": {
            "canopen_over_ours": ratios["canopen_over_ours"] >= TARGETS["canopen_over_ours"],
            "ours_over_floor": ratios["ours_over_floor"] <= TARGETS["ours_over_floor"],
        },
    }


def _percentiles(times_ns: Times) -> dict[str, float]:
    values = np.percentile(times_ns, PERCENTILES) * _US
    return {f"p{p:g}": round(float(v), 2) for p, v in zip(PERCENTILES, values, strict=True)}


def _run(way: Exchange, cycles: int, bus: str, frames: list[int]) -> tuple[Times, Times]:
    """Return process and wall time of each cycle of one block, ns; add to frames and SYNCs."""
    cpu, wall = np.zeros(cycles, np.int64), np.zeros(cycles, np.int64)
    cpu_clock, wall_clock, cycle = time.process_time_ns, time.perf_counter_ns, way.cycle
    way.open()
    try:
        before = query_status(bus)
        for _ in range(_WARM_UP):
            cycle()
        gc.collect()
        for k in range(cycles):
            wall_start, cpu_start = wall_clock(), cpu_clock()
            cycle()
            cpu[k], wall[k] = cpu_clock() - cpu_start, wall_clock() - wall_start
        after = query_status(bus)
    finally:
        way.close()
    frames[0] += after["frames"] - before["frames"]
    frames[1] += after["sync_count"] - before["sync_count"]
    return cpu, wall


def _clock_cost_ns() -> int:
    """Return what reading the process clock adds to an interval."""
    clock = time.process_time_ns
    return int(np.median([-(clock() - clock()) for _ in range(1001)]))


@contextmanager
def _contenders(out: Output) -> Iterator[tuple[str, Sequence[Exchange]]]:
    """Boot eight simulated drives in a process of their own; yield the bus and the three ways."""
    winch = load_winch(_WINCH)
    bus = f"bench-{os.getpid()}"
    url = BusUrl.parse(f"simbus:{bus}")
    nodes = list(range(winch.node_id, winch.node_id + AXES))
    with ExitStack() as stack:
        out.note(f"starting {AXES} simulated drives ...")
        simulator = OwnSimulator(winch.profile, str(url), nodes=AXES)
        stack.callback(simulator.stop)
        # the simulator does the same work for all three; on one core no wake-up crosses cores
        stack.enter_context(one_core(simulator.process.pid))
        heartbeat_s = winch.drive.heartbeat_consumer_s / 4
        clock = open_clock([url])
        stack.callback(clock.close)
        network = CanNetwork(url, clock, nodes, winch.master_node_id, heartbeat_s)
        stack.callback(network.close)
        dictionaries = {node: load_dictionary(winch.drive.eds, node) for node in nodes}
        reports = []
        for node, dictionary in dictionaries.items():
            network.add_node(node, dictionary)
            reports.append(_boot(network, node, winch))
        limit = winch.motor.rated_torque_Nm
        axes = [AxisConfig.from_boot(winch.drive, report, limit) for report in reports]

        def join() -> AxisGroup:
            return AxisGroup(network, axes, PERIOD_S)

        yield (
            bus,
            (
                OwnExchange(join),
                LibraryExchange(bus, dictionaries),
                FloorExchange(bus, nodes),
            ),
        )


def _boot(network: CanNetwork, node: int, winch: Winch) -> BootReport:
    """Boot a drive, then end both heartbeats: they are no part of the exchange."""
    limit = winch.motor.rated_torque_Nm
    report = boot(network, node, winch.drive, BootSettings(winch.master_node_id, PERIOD_S, limit))
    network.write(node, 0x1016, 1, 0)
    network.write(node, 0x1017, 0, 0)
    return report
