"""Measure the host's cost of one exchange with 8 axes on one bus, and that of the canopen package.

Each way sends SYNC, takes the n TPDOs (6041h, 6064h, 6077h) and sends the n RPDOs (6040h, 6071h).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from itertools import repeat

from cdpr_drivers.axes.axis_group import AxisGroup
from cdpr_drivers.axes.axis_layout import AxisConfig
from cdpr_drivers.bus import BusUrl, query_status
from cdpr_drivers.bus.simbus import open_clock
from cdpr_drivers.canopen.boot import BootReport, BootSettings, boot
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import BusError
from cdpr_profiles import Winch, load_winch
from cdpr_profiles.eds import load_dictionary
from cdpr_rt.loop.realtime import one_core
from cdpr_tools.bench.baseline_loop import CanopenAxes
from cdpr_tools.bench.harness import Figures, Target, Way, Work, cost_rows
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.output import Output

AXES = 8
PERIOD_S = 2e-3
"""Cycle period; eight drives use 1.9 ms of it on a bus at 1 Mbit/s."""
OURS, CANOPEN = "ours: AxisGroup", "the canopen package's PDOs"
_WINCH = "winch-mpp0923d"
_BLOCK, _WARM_UP = 500, 50
_TIMEOUT_S = 2.0


def measure(cycles: int, out: Output) -> Figures:
    """Measure `cycles` exchanges of each way."""
    frames: dict[str, list[int]] = {}
    with _ways(out) as (bus, ways):
        # no progress bar: its drawing thread would be measured too
        out.note(f"{cycles} exchanges with each of {len(ways)} libraries; 10000 take seconds ...")
        counted = {
            name: _counted(way, bus, frames.setdefault(name, [0, 0])) for name, way in ways.items()
        }
        rows = cost_rows(counted, cycles, _BLOCK, _WARM_UP)
    for name, (of_all, syncs) in frames.items():
        rows[name]["frames"] = round(of_all / syncs, 2)
    ratio = rows[CANOPEN]["times ours"]
    return Figures(
        f"one exchange with {AXES} axes, {cycles} cycles of each: processor time of the host, "
        "wall time with the drives, us, and frames of a cycle",
        rows,
        {
            "canopen_over_ours": Target("canopen / ours", ratio, 6.0, True),
        },
        more={"axes": AXES, "cycles": cycles},
    )


def _counted(way: Way, bus: str, frames: list[int]) -> Way:
    """Return `way` with the counts of the bus, all frames and SYNCs, added to `frames`."""

    @contextmanager
    def joined() -> Iterator[Iterator[Work]]:
        with way() as steps:
            before = query_status(bus)
            yield steps
            after = query_status(bus)
        for k, key in enumerate(("frames", "sync_count")):
            frames[k] += after[key] - before[key]

    return joined


@contextmanager
def _ways(out: Output) -> Iterator[tuple[str, dict[str, Way]]]:
    """Boot eight simulated drives in a separate process; yield the bus and the ways."""
    winch = load_winch(_WINCH)
    bus = f"bench-{os.getpid()}"
    url = BusUrl.parse(f"simbus:{bus}")
    nodes = list(range(winch.node_id, winch.node_id + AXES))
    with ExitStack() as stack:
        out.note(f"starting {AXES} simulated drives ...")
        simulator = OwnSimulator(winch.profile, str(url), nodes=AXES)
        stack.callback(simulator.stop)
        # The simulator does the same work for both ways. On a single core, no wake-up crosses
        # cores.
        stack.enter_context(one_core(simulator.process.pid))
        heartbeat_s = winch.drive.heartbeat_consumer_s / 4
        clock = stack.enter_context(closing(open_clock([url])))
        network = stack.enter_context(
            closing(CanNetwork(url, clock, nodes, winch.master_node_id, heartbeat_s))
        )
        dictionaries = {node: load_dictionary(winch.drive.eds, node) for node in nodes}
        reports = []
        for node, dictionary in dictionaries.items():
            network.add_node(node, dictionary)
            reports.append(_boot(network, node, winch))
        limit = winch.motor.rated_torque_Nm
        axes = [AxisConfig.from_boot(winch.drive, report, limit) for report in reports]
        library = CanopenAxes({"": bus}, [("", node, of) for node, of in dictionaries.items()])
        yield (
            bus,
            {
                OURS: lambda: _ours(AxisGroup(network, axes, PERIOD_S)),
                CANOPEN: lambda: _canopen(library),
            },
        )


def _boot(network: CanNetwork, node: int, winch: Winch) -> BootReport:
    """Boot a drive, then end both heartbeats, which are not part of the exchange."""
    limit = winch.motor.rated_torque_Nm
    report = boot(network, node, winch.drive, BootSettings(winch.master_node_id, PERIOD_S, limit))
    network.write(node, 0x1016, 1, 0)
    network.write(node, 0x1017, 0, 0)
    return report


@contextmanager
def _ours(group: AxisGroup) -> Iterator[Iterator[Work]]:
    """Exchange through `AxisGroup`, as the control loop does."""

    def cycle() -> None:
        group.sync()
        if group.receive() < group.n:
            raise BusError(f"AxisGroup: an axis did not answer: {group.faults()}")
        group.transmit()

    with closing(group):
        yield repeat(cycle)


@contextmanager
def _canopen(axes: CanopenAxes) -> Iterator[Iterator[Work]]:
    """Exchange through the PDOs of the `canopen` package."""
    torques = [0] * AXES

    def cycle() -> None:
        if axes.exchange(_TIMEOUT_S):
            raise BusError("canopen: an axis did not answer")
        axes.command(0, torques)

    with axes.joined():
        yield repeat(cycle)
