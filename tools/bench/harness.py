"""The harness of all benches: alternating timings, ratios, percentiles, table, targets, JSON.

A bench is a function `measure` that returns `Figures`. It compares different ways to do the same.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdpr_tools.output import TableText

Times = NDArray[np.int64]
"""Times in ns, (k,)."""
Work = Callable[[], object]
Way = Callable[[], AbstractContextManager[Iterator[Work]]]
"""Yields the calls that are timed one after the other. Between them it may prepare the next call
and check the last result. This work is not timed.
"""
Row = dict[str, Any]
"""Figures of one way, by the names of their columns."""


@dataclass(frozen=True)
class Target:
    """A figure and its bound."""

    text: str
    value: float
    bound: float
    at_least: bool = False

    @property
    def reached(self) -> bool:
        """Whether the figure is within its bound."""
        return self.value >= self.bound if self.at_least else self.value <= self.bound

    def line(self) -> str:
        """Return the target as a line of text."""
        sense = "at least" if self.at_least else "at most"
        verdict = "reached" if self.reached else "MISSED"
        return f"{self.text}: {self.value:.4g}, target {sense} {self.bound:g}: {verdict}"


@dataclass
class Figures:
    """The result of a bench."""

    title: str
    rows: dict[str, Row]
    targets: dict[str, Target] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """Further lines of text."""
    more: dict[str, Any] = field(default_factory=dict)
    """Further keys of the JSON."""
    error: str = ""
    """Why the bench has failed."""

    def lines(self) -> list[str]:
        """Return the table, then targets and notes."""
        targets = [target.line() for target in self.targets.values()]
        return [self.title, table_of(self.rows), *targets, *self.notes]

    def as_json(self) -> dict[str, Any]:
        """Return all figures."""
        targets = {
            name: {"value": of.value, "bound": of.bound, "reached": of.reached}
            for name, of in self.targets.items()
        }
        return {"title": self.title, "rows": self.rows, "targets": targets, **self.more}


def with_nothing_open(steps: Iterator[Work]) -> Way:
    """Return a way of measurement that opens no resources."""
    return lambda: nullcontext(steps)


def timed(steps: Iterator[Work], count: int, warm_up: int) -> tuple[Times, Times]:
    """Return process time (of all threads) and wall time of `count` calls after a warm-up, ns."""
    cpu, wall = np.zeros(count, np.int64), np.zeros(count, np.int64)
    cpu_clock, wall_clock = time.process_time_ns, time.perf_counter_ns
    for _ in range(warm_up):
        next(steps)()
    gc.collect()
    for k in range(count):
        work = next(steps)
        wall_start, cpu_start = wall_clock(), cpu_clock()
        work()
        cpu[k], wall[k] = cpu_clock() - cpu_start, wall_clock() - wall_start
    return cpu, wall


def cost_rows(
    ways: Mapping[str, Way],
    count: int,
    block: int,
    warm_up: int,
    percents: Sequence[float] = (50.0, 99.9),
    per: int = 1,
) -> dict[str, Row]:
    """Return CPU and wall time of `count` calls of each way, in us, and ratios to the first way.

    The ways take turns in blocks, so that other load on the machine affects all equally. A way is
    open only during its own blocks. A call repeats the work `per` times. The ratio is that of the
    medians of processor time, or of the means if the kernel counts it in ticks.
    """
    parts: dict[str, list[tuple[Times, Times]]] = {name: [] for name in ways}
    for first in range(0, count, block):
        for name, way in ways.items():
            with way() as steps:
                parts[name].append(timed(steps, min(block, count - first), warm_up))
    reading = np.median([time.process_time_ns() - time.process_time_ns() for _ in range(10_001)])
    rows: dict[str, Row] = {}
    ours_us = 0.0
    for name, blocks in parts.items():
        cpu_us = np.concatenate([1e-3 * (cpu + reading) for cpu, _ in blocks]) / per
        wall_us = np.concatenate([1e-3 * wall for _, wall in blocks]) / per
        middle_us = float(np.median(cpu_us)) or float(cpu_us.mean())
        ours_us = ours_us or middle_us
        rows[name] = {
            "CPU mean": round(float(cpu_us.mean()), 3),
            **{f"CPU {key}": us for key, us in percentiles(cpu_us, *percents).items()},
            "wall mean": round(float(wall_us.mean()), 3),
            **{f"wall {key}": us for key, us in percentiles(wall_us, *percents).items()},
            "times ours": round(middle_us / max(ours_us, 1e-9), 2),
        }
    return rows


def percentiles(
    values: NDArray[Any] | Sequence[float], *percents: float, digits: int = 3
) -> dict[str, float]:
    """Return percentiles rounded to `digits` digits, by names such as p50, p99.9 and max."""
    found = np.percentile(values, percents)
    names = ("max" if p == 100.0 else f"p{p:g}" for p in percents)
    return {name: round(float(v), digits) for name, v in zip(names, found, strict=True)}


def table_of(rows: Mapping[str, Row]) -> TableText:
    """Return the rows under the names of all their columns."""
    columns = list(dict.fromkeys(column for row in rows.values() for column in row))
    return table(columns, [(name, [row.get(c, "") for c in columns]) for name, row in rows.items()])


def table(
    columns: Sequence[str], rows: Iterable[tuple[str, Iterable[object]]], digits: int = 1
) -> TableText:
    """Return the rows under a heading; a float has `digits` digits after the point."""
    shown = [["", *columns]]
    for label, cells in rows:
        row = [label, *(f"{x:.{digits}f}" if isinstance(x, float) else f"{x}" for x in cells)]
        shown.append(row + [""] * (len(shown[0]) - len(row)))
    return TableText(shown)
