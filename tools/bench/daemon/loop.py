"""What the daemon's control loop costs at 1 kHz, beside a baseline in plain Python."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import floor
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drivers.bus import query_status
from cdpr_drivers.bus.budget import machine_budget
from cdpr_profiles import Robot, load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import Row
from cdpr_tools.bench.daemon import baseline_process
from cdpr_tools.bench.daemon.loop_daemon import BenchDaemon, with_tolerant_limits
from cdpr_tools.bench.timing import verdict
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output

ROBOT, ONE_BUS = "bench-8", "one-bus-8"
ROUNDS = 3
SLOW_PERIOD_S, POSE_PERIOD_S = 4e-3, 10e-3
"""At 1 kHz the baseline loop has no pause; here it has, so that its own cost can be measured; the
latter where it has a platform to control."""
TARGETS = {"compute_share": 0.30, "obvious_over_ours": 4.0, "recording_share": 0.02}
"""The first and last at most, the second at least this."""
PERCENTILES = (50.0, 99.9, 100.0)
_NAMES = ("p50", "p99.9", "worst")
_SPEED_RAD_S = 1.0
_SETTLE_S = 1.0


@dataclass(frozen=True)
class LoopRun:
    """Cycles of one variant, and what they cost."""

    compute_s: FloatArray
    """From the last answer until the last command has been sent, (cycles,)."""
    lateness_s: FloatArray
    exchange_s: FloatArray
    late: int
    missed: int
    processor_s: float
    """Of the loop's whole process, for all cycles."""

    @classmethod
    def of(cls, rows: Row, processor_s: float) -> LoopRun:
        """Take what the loop has written of its cycles."""
        return cls(
            rows["compute_s"],
            rows["lateness_s"],
            rows["exchange_s"],
            int(rows["late_cycles"][-1] - rows["late_cycles"][0]),
            int(rows["missed"][-1] - rows["missed"][0]),
            processor_s,
        )

    @property
    def cycles(self) -> int:
        """How many cycles were run."""
        return int(self.compute_s.size)

    @property
    def host_us(self) -> float:
        """Processor time of a cycle."""
        return 1e6 * self.processor_s / self.cycles


def measure(seconds: float, out: Output, name: str = "") -> dict[str, Any]:
    """Run each variant for `seconds` and return the figures; raises WorkFailedError.

    The variants take turns, so that what else the machine does hits all alike. `name` is the
    robot's, that of bare axes where left out; a platform is led by `pose`, and there is no baseline
    loop at its own rate: its computing alone takes longer than a cycle.
    """
    with tempfile.TemporaryDirectory(prefix="cdpr-bench-") as folder:
        robot = with_tolerant_limits(load_robot(name or ROBOT), Path(folder))
        one_bus = with_tolerant_limits(load_robot(ONE_BUS), Path(folder))
        bare_axes = robot.platform is None
        slow = replace(robot, sync_period_s=SLOW_PERIOD_S if bare_axes else POSE_PERIOD_S)
        bare, served, baseline, relaxed = [], [], [], []
        for k in range(ROUNDS):
            out.note(f"round {k + 1} of {ROUNDS}: the daemon, then the baseline loop ...")
            part = seconds / ROUNDS
            alone, recorded = _daemon(robot, part, Path(folder))
            bare.append(alone)
            served.append(recorded)
            if bare_axes:
                baseline.append(_baseline(robot, part))
            relaxed.append(_baseline(slow, part))
        out.note("eight axes on one bus ...")
        full = _full_bus(one_bus, seconds, Path(folder))
    ours, unserved, unhurried = map(_combined, (served, bare, relaxed))
    period_us = 1e6 * robot.sync_period_s
    shares = {
        "compute_share": ours["compute_us"]["p99.9"] / period_us,
        "obvious_over_ours": unhurried["host_us"] / ours["host_us"],
        "recording_share": ours["host_us"] / unserved["host_us"] - 1.0,
    }
    return {
        "robot": name or ROBOT,
        "axes": len(robot.axes),
        "buses": len(robot.buses),
        "period_us": round(period_us),
        "slow_Hz": round(1.0 / slow.sync_period_s),
        "seconds": seconds,
        "ours": ours,
        "without_service": unserved,
        **({"obvious": _combined(baseline)} if baseline else {}),
        "obvious_slow": unhurried,
        "one_bus": full,
        "shares": {name: round(value, 3) for name, value in shares.items()},
        "targets": TARGETS,
        "reached": {
            name: value >= TARGETS[name] if name == "obvious_over_ours" else value <= TARGETS[name]
            for name, value in shares.items()
        }
        | {"one_bus": full["by_loop"] == 0},
    }


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as a table, a line for each variant."""
    lines = [
        f"{figures['axes']} axes on {figures['buses']} buses, {figures['period_us']} us a cycle",
        f"{'':32}{'host CPU':>10}{'computing, us':>22}{'late by, us':>22}{'late':>8}{'answers':>9}",
        f"{'':32}{'us/cycle':>10}"
        + f"{'p50':>11}{'p99.9':>11}" * 2
        + f"{'cycles':>8}{'missed':>9}",
    ]
    for name, text in (
        ("ours", "ours, recorded and watched"),
        ("without_service", "ours, the loop's process alone"),
        ("obvious", "the baseline loop on canopen"),
        ("obvious_slow", f"the baseline loop at {figures['slow_Hz']} Hz"),
    ):
        if (one := figures.get(name)) is None:
            continue
        compute, late = one["compute_us"], one["lateness_us"]
        lines.append(
            f"{text:32}{one['host_us']:10.1f}"
            f"{compute['p50']:11.1f}{compute['p99.9']:11.1f}"
            f"{late['p50']:11.1f}{late['p99.9']:11.1f}{one['late']:8}{one['missed']:9}"
        )
    full, shares, targets = figures["one_bus"], figures["shares"], figures["targets"]
    verdicts = {name: verdict(reached) for name, reached in figures["reached"].items()}
    return [
        *lines,
        f"computing, p99.9: {100 * shares['compute_share']:.1f} % of the period, wanted at most "
        f"{100 * targets['compute_share']:g} %: {verdicts['compute_share']}",
        f"the baseline loop / ours: {shares['obvious_over_ours']:.2f}, wanted at least "
        f"{targets['obvious_over_ours']:g}: {verdicts['obvious_over_ours']}",
        f"recording and live views cost the loop {100 * shares['recording_share']:.1f} %, wanted "
        f"at most {100 * targets['recording_share']:g} %: {verdicts['recording_share']}",
        f"one bus, {full['axes']} axes: {full['rate_Hz']:g} Hz are {100 * full['share']:.0f} % "
        f"of the {full['limit_Hz']} Hz it carries; {full['cycles']} cycles, {full['overruns']} "
        f"overruns, {full['late']} late, {full['missed']} answers missed; SYNCs that the loop sent "
        f"while its commands could be on the wire: {full['by_loop']}, wanted none: "
        f"{verdicts['one_bus']}",
    ]


def _daemon(robot: Robot, seconds: float, folder: Path) -> tuple[LoopRun, LoopRun]:
    """Run the loop alone, then with recording and clients of both live views."""
    with BenchDaemon(robot, folder) as daemon:
        daemon.move(_SPEED_RAD_S)
        time.sleep(_SETTLE_S)
        alone = LoopRun.of(*daemon.measure(seconds))
        with daemon.served():
            daemon.move(_SPEED_RAD_S)
            time.sleep(_SETTLE_S)
            recorded = LoopRun.of(*daemon.measure(seconds))
        if not any(path.stat().st_size for path in daemon.recordings()):
            raise WorkFailedError(f"{robot.name}: nothing was recorded")
        return alone, recorded


def _baseline(robot: Robot, seconds: float) -> LoopRun:
    measured = baseline_process.measure(robot, seconds, _SPEED_RAD_S)
    return LoopRun(
        np.array(measured["compute_s"]),
        np.array(measured["lateness_s"]),
        np.array(measured["exchange_s"]),
        measured["late"],
        measured["missed"],
        measured["processor_s"],
    )


def _full_bus(robot: Robot, seconds: float, folder: Path) -> dict[str, Any]:
    """Run eight axes on one bus, which their robot's rate nearly fills; count what did not fit."""
    (budget,) = machine_budget(robot)
    with BenchDaemon(robot, folder) as daemon:
        daemon.move(_SPEED_RAD_S)
        time.sleep(_SETTLE_S)
        (bus,) = daemon.buses()
        before = query_status(bus)
        rows, processor_s = daemon.measure(seconds)
        after = query_status(bus)
    return {
        "axes": len(robot.axes),
        "rate_Hz": 1.0 / robot.sync_period_s,
        "limit_Hz": floor(budget.highest_rate_Hz),
        "share": round(1.0 / robot.sync_period_s / budget.highest_rate_Hz, 3),
        "overruns": after["overruns"] - before["overruns"],
        "by_loop": early_syncs(rows, budget.commands_s),
        **_combined([LoopRun.of(rows, processor_s)]),
    }


def early_syncs(rows: Row, commands_s: float) -> int:
    """Return how many SYNCs went out within `commands_s` of the last cycle's commands."""
    began_s = 1e-9 * rows["stamp_ns"]
    sent_s = began_s + rows["exchange_s"] + rows["compute_s"]
    return int(np.sum(began_s[1:] < sent_s[:-1] + commands_s))


def _combined(runs: Sequence[LoopRun]) -> dict[str, Any]:
    """Put rounds together; the processor time is the middle one of the rounds'."""
    return {
        "cycles": sum(run.cycles for run in runs),
        "host_us": round(float(np.median([run.host_us for run in runs])), 1),
        "compute_us": _percentiles([run.compute_s for run in runs]),
        "exchange_us": _percentiles([run.exchange_s for run in runs]),
        "lateness_us": _percentiles([run.lateness_s for run in runs]),
        "late": sum(run.late for run in runs),
        "missed": sum(run.missed for run in runs),
    }


def _percentiles(parts: Sequence[FloatArray]) -> dict[str, float]:
    values = 1e6 * np.percentile(np.concatenate(parts), PERCENTILES)
    return {name: round(float(value), 1) for name, value in zip(_NAMES, values, strict=True)}
