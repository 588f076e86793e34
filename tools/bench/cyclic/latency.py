"""How late a loop wakes up on this machine, with and without the real-time settings."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from cdpr_tools.bench.cyclic.wakeups import Times
from cdpr_tools.bench.timing import percentiles
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.processes.module_process import module_command
from cdpr_tools.report.style import COLOURS, canvas, legend_above

VARIANTS = {"ordinary": "ordinary process", "realtime": "real-time settings"}
LOADS = {"idle": "nothing else asked of the machine", "loaded": "every processor kept busy"}

_ROUNDS = 2
_PERCENTILES = (50.0, 99.0, 99.9, 100.0)
_US = 1e-3  # of a ns
_BINS_A_DECADE = 12
_COLOURS = {"ordinary": COLOURS["better"], "realtime": COLOURS["thesis"]}
# reads and writes more than a cache holds, so that memory is contended for as well
_BURN = "import hashlib\nblock = bytes(1 << 22)\nwhile True:\n    hashlib.sha256(block).digest()"

Lateness = dict[str, dict[str, Times]]


def measure(rate_Hz: float, seconds: float, picture: Path, out: Output) -> dict[str, Any]:
    """Return figures of the lateness of wake-ups, by load and variant, and draw all of them.

    The variants take turns, so that what else the machine does hits both. Raises WorkFailedError.
    """
    cycles = max(1, round(rate_Hz * seconds / _ROUNDS))
    late: Lateness = {}
    not_allowed: list[str] = []
    with out.progress("waking up", seconds * len(LOADS) * len(VARIANTS)) as advance:
        for load in LOADS:
            parts: dict[str, list[Times]] = {variant: [] for variant in VARIANTS}
            with _load(load == "loaded"):
                for done in range(_ROUNDS * len(VARIANTS)):
                    variant = list(VARIANTS)[done % len(VARIANTS)]
                    notices, times = _probe(1.0 / rate_Hz, cycles, variant)
                    parts[variant].append(times)
                    not_allowed = notices or not_allowed
                    advance(seconds * (len(late) * len(VARIANTS) + (done + 1) / _ROUNDS))
            late[load] = {variant: np.concatenate(times) for variant, times in parts.items()}
    figures = {
        "rate_Hz": rate_Hz,
        "wakeups": _ROUNDS * cycles,
        "kernel": platform.release(),
        "processors": len(os.sched_getaffinity(0)),
        "not_allowed": not_allowed,
        "late_us": {
            load: {
                variant: percentiles(times * _US, *_PERCENTILES, digits=1)
                for variant, times in variants.items()
            }
            for load, variants in late.items()
        },
        "picture": picture,
    }
    _draw(figures, late, picture)
    return figures


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as a table, a line for each load and variant."""
    lines = [
        f"{figures['wakeups']} wake-ups at {figures['rate_Hz']:g} Hz for each line, in us behind "
        f"the deadline; kernel {figures['kernel']}, {figures['processors']} processors",
        f"{'':30}{'p50':>9}{'p99':>9}{'p99.9':>9}{'worst':>10}",
    ]
    for load in LOADS:
        for variant, text in VARIANTS.items():
            us = figures["late_us"][load][variant]
            values = f"{us['p50']:9.1f}{us['p99']:9.1f}{us['p99.9']:9.1f}{us['max']:10.1f}"
            lines.append(f"{load + ':':8}{text:22}{values}")
    lines += [f"not allowed: {notice}" for notice in figures["not_allowed"]]
    return [*lines, f"picture: {figures['picture']}"]


def _draw(figures: dict[str, Any], late: Lateness, path: Path) -> None:
    """Write the histograms as a picture; raises BadInputError where it cannot be written."""
    figure, axes = canvas(1, len(LOADS), height=3.2, sharey=True)
    most = (
        max(float(times.max()) for variants in late.values() for times in variants.values()) * _US
    )
    bins = np.logspace(
        0.0, np.log10(max(most, 10.0)) + 0.02, int(_BINS_A_DECADE * np.log10(max(most, 10.0))) + 2
    )
    for ax, (load, text) in zip(axes, LOADS.items(), strict=True):
        for variant, label in VARIANTS.items():
            _histogram(ax, late[load][variant], bins, label, _COLOURS[variant])
        ax.axvline(1e6 / figures["rate_Hz"], color="#555555", lw=0.9, ls="--")
        ax.set_title(text)
        ax.set_xlabel("wake-up behind its deadline, µs")
    axes[0].set_ylim(0.7, 4.0 * figures["wakeups"])  # shared; room above for words
    axes[0].set_ylabel(f"cycles of {figures['wakeups']} per bar")
    axes[0].annotate(
        "one period",
        (1e6 / figures["rate_Hz"], 0.97),
        xycoords=("data", "axes fraction"),
        xytext=(-4, 0),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=8,
        color="#555555",
    )
    legend_above(figure, axes[0])
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise BadInputError(f"--out {path}: cannot be written: {error}") from error


def _histogram(ax: Axes, times: Times, bins: Any, label: str, colour: str) -> None:
    # what is under a microsecond counts with the first bar
    values = np.maximum(times * _US, bins[0])
    ax.hist(values, bins=bins, histtype="stepfilled", color=colour, alpha=0.25)
    ax.hist(values, bins=bins, histtype="step", color=colour, label=label)
    ax.set_xscale("log")
    ax.set_yscale("log")


def _probe(period_s: float, cycles: int, variant: str) -> tuple[list[str], Times]:
    command = module_command(
        "cdpr_tools.bench.cyclic.wakeups", repr(period_s), str(cycles), variant
    )
    run = subprocess.run(command, capture_output=True, check=False)
    head, _, data = run.stdout.partition(b"\n")
    if run.returncode != 0 or not data:
        raise WorkFailedError(f"the measuring process failed: {run.stderr.decode()[-300:].strip()}")
    return json.loads(head)["not_allowed"], np.frombuffer(data, "<i8")


@contextmanager
def _load(loaded: bool) -> Iterator[None]:
    """Keep every processor busy with ordinary processes while the block runs."""
    count = len(os.sched_getaffinity(0)) if loaded else 0
    burners = [subprocess.Popen([sys.executable, "-P", "-c", _BURN]) for _ in range(count)]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()
