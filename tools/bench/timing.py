"""Process and wall time of repeated calls, their percentiles, and what is said of a target."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.int64]
"""Times in ns, (k,)."""


def timed(work: Callable[[], object], count: int, warm_up: int) -> tuple[Times, Times]:
    """Return process time (of all threads) and wall time of `count` calls after a warm-up, ns."""
    cpu, wall = np.zeros(count, np.int64), np.zeros(count, np.int64)
    cpu_clock, wall_clock = time.process_time_ns, time.perf_counter_ns
    for _ in range(warm_up):
        work()
    gc.collect()
    for k in range(count):
        wall_start, cpu_start = wall_clock(), cpu_clock()
        work()
        cpu[k], wall[k] = cpu_clock() - cpu_start, wall_clock() - wall_start
    return cpu, wall


def percentiles(
    values: NDArray[Any] | Sequence[float], *percents: float, digits: int
) -> dict[str, float]:
    """Return percentiles rounded to so many digits, by names such as p50, p99.9 and max."""
    found = np.percentile(values, percents)
    names = ("max" if p == 100.0 else f"p{p:g}" for p in percents)
    return {name: round(float(v), digits) for name, v in zip(names, found, strict=True)}


def verdict(reached: bool) -> str:
    """Return in a word whether a target is reached."""
    return "reached" if reached else "MISSED"
