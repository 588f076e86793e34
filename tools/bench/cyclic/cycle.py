"""What one exchange with eight axes costs the host, by three variants on one bus."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np

from cdpr_drivers.axes.axis_group import AxisConfig, AxisGroup
from cdpr_drivers.bus import BusUrl, query_status
from cdpr_drivers.bus.simulated_bus import open_clock
from cdpr_drivers.canopen.boot.boot import BootReport, BootSettings, boot
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_profiles import Winch, load_winch
from cdpr_profiles.eds.dictionary import load_dictionary
from cdpr_rt.runtime.realtime import one_core
from cdpr_tools.bench.cyclic.exchanges import Exchange, FloorExchange, LibraryExchange, OwnExchange
from cdpr_tools.bench.timing import Times, percentiles, timed, verdict
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.output import Output

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


def measure(cycles: int, out: Output) -> dict[str, Any]:
    """Measure `cycles` exchanges of each variant and return the figures, times in µs.

    The variants take turns in blocks, so that what else the machine does hits all alike. Raises
    BusError when an axis does not answer.
    """
    blocks = [_BLOCK] * (cycles // _BLOCK) + [cycles % _BLOCK] * (cycles % _BLOCK > 0)
    with _exchanges(out) as (bus, variants):
        times: dict[str, list[tuple[Times, Times]]] = {variant.name: [] for variant in variants}
        frames = {variant.name: [0, 0] for variant in variants}
        # no progress bar: the thread that draws it would be measured with them
        out.note(
            f"{cycles} exchanges of each of {len(variants)} variants, some seconds per 10000 ..."
        )
        for block in blocks:
            for variant in variants:
                times[variant.name].append(_run(variant, block, bus, frames[variant.name]))
        statuswords = {variant.name: variant.statuswords() for variant in variants}
    clock_cost = _clock_cost_ns()
    cpu = {name: np.concatenate([t[0] for t in of]) - clock_cost for name, of in times.items()}
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


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as a table, a line for each variant."""
    cpu, wall = figures["cpu_us"], figures["wall_us"]
    return [
        f"one exchange with {figures['axes']} axes, {figures['cycles']} cycles of each",
        f"{'':30}{'host CPU time, us':>20}{'wall, drives too, us':>24}",
        f"{'':30}{'p50':>10}{'p99.9':>10}{'p50':>14}{'p99.9':>10}",
        *(
            f"{text:30}{cpu[name]['p50']:10.1f}{cpu[name]['p99.9']:10.1f}"
            f"{wall[name]['p50']:14.1f}{wall[name]['p99.9']:10.1f}"
            for name, text in (
                ("ours", "ours: AxisGroup"),
                ("canopen", "the canopen package's PDOs"),
                ("floor", "floor: bare socket and struct"),
            )
        ),
        *(
            f"{text}: {figures['ratios'][key]:.2f}, wanted {bound} {figures['targets'][key]:g}: "
            f"{verdict(figures['reached'][key])}"
            for key, text, bound in (
                ("canopen_over_ours", "canopen / ours", "at least"),
                ("ours_over_floor", "ours / floor", "at most"),
            )
        ),
    ]


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
    return percentiles(times_ns * _US, *PERCENTILES, digits=2)


def _run(variant: Exchange, cycles: int, bus: str, frames: list[int]) -> tuple[Times, Times]:
    """Return process and wall time of each cycle of one block, ns; add to frames and SYNCs."""
    variant.open()
    try:
        before = query_status(bus)
        times = timed(variant.cycle, cycles, _WARM_UP)
        after = query_status(bus)
    finally:
        variant.close()
    frames[0] += after["frames"] - before["frames"]
    frames[1] += after["sync_count"] - before["sync_count"]
    return times


def _clock_cost_ns() -> int:
    """Return what reading the process clock adds to an interval."""
    clock = time.process_time_ns
    return int(np.median([-(clock() - clock()) for _ in range(1001)]))


@contextmanager
def _exchanges(out: Output) -> Iterator[tuple[str, Sequence[Exchange]]]:
    """Boot eight simulated drives in a process of their own; yield the bus and the variants."""
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
