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

from tools.bench.wakeups import Times
from tools.errors import BadInputError, WorkFailedError
from tools.output import Output
from tools.report.style import COLOURS, canvas, legend_above

WAYS = {"ordinary": "ordinary process", "realtime": "real-time settings"}
LOADS = {"idle": "nothing else asked of the machine", "loaded": "every processor kept busy"}

_ROUNDS = 2
_PERCENTILES = (50.0, 99.0, 99.9)
_US = 1e-3  # of a ns
_BINS_A_DECADE = 12
_COLOURS = {"ordinary": COLOURS["better"], "realtime": COLOURS["thesis"]}
# reads and writes more than a cache holds, so that memory is contended for as well
_BURN = "import hashlib\nblock = bytes(1 << 22)\nwhile True:\n    hashlib.sha256(block).digest()"

Lateness = dict[str, dict[str, Times]]


def measure(rate_Hz: float, seconds: float, out: Output) -> tuple[dict[str, Any], Lateness]:
    """Return figures and the lateness of every wake-up in ns, by load and way.

    The ways take turns, so that what else the machine does hits both. Raises WorkFailedError.
    """
    cycles = max(1, round(rate_Hz * seconds / _ROUNDS))
    late: Lateness = {}
    not_allowed: list[str] = []
    with out.progress("waking up", seconds * len(LOADS) * len(WAYS)) as advance:
        for load in LOADS:
            parts: dict[str, list[Times]] = {way: [] for way in WAYS}
            with _load(load == "loaded"):
                for done in range(_ROUNDS * len(WAYS)):
                    way = list(WAYS)[done % len(WAYS)]
                    notices, times = _probe(1.0 / rate_Hz, cycles, way)
                    parts[way].append(times)
                    not_allowed = notices or not_allowed
                    advance(seconds * (len(late) * len(WAYS) + (done + 1) / _ROUNDS))
            late[load] = {way: np.concatenate(times) for way, times in parts.items()}
    figures = {
        "rate_Hz": rate_Hz,
        "wakeups": _ROUNDS * cycles,
        "kernel": platform.release(),
        "processors": len(os.sched_getaffinity(0)),
        "not_allowed": not_allowed,
        "late_us": {
            load: {way: _figures(times) for way, times in ways.items()}
            for load, ways in late.items()
        },
    }
    return figures, late


def draw(figures: dict[str, Any], late: Lateness, path: Path) -> None:
    """Write the histograms as a picture; raises BadInputError where it cannot be written."""
    figure, axes = canvas(1, len(LOADS), height=3.2, sharey=True)
    most = max(float(times.max()) for ways in late.values() for times in ways.values()) * _US
    bins = np.logspace(0.0, np.log10(max(most, 10.0)) + 0.02, _bins(most))
    for ax, (load, text) in zip(axes, LOADS.items(), strict=True):
        for way, label in WAYS.items():
            _histogram(ax, late[load][way], bins, label, _COLOURS[way])
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


def _bins(most_us: float) -> int:
    return int(_BINS_A_DECADE * np.log10(max(most_us, 10.0))) + 2


def _histogram(ax: Axes, times: Times, bins: Any, label: str, colour: str) -> None:
    # what is under a microsecond counts with the first bar
    values = np.maximum(times * _US, bins[0])
    ax.hist(values, bins=bins, histtype="stepfilled", color=colour, alpha=0.25)
    ax.hist(values, bins=bins, histtype="step", color=colour, label=label)
    ax.set_xscale("log")
    ax.set_yscale("log")


def _figures(times: Times) -> dict[str, float]:
    found = {f"p{p:g}": float(np.percentile(times, p)) * _US for p in _PERCENTILES}
    return {key: round(v, 1) for key, v in {**found, "max": float(times.max()) * _US}.items()}


def _probe(period_s: float, cycles: int, way: str) -> tuple[list[str], Times]:
    command = [sys.executable, "-P", "-m", "tools.bench.wakeups", repr(period_s), str(cycles), way]
    run = subprocess.run(command, capture_output=True, check=False)
    head, _, data = run.stdout.partition(b"\n")
    if run.returncode != 0 or not data:
        raise WorkFailedError(f"the measuring process failed: {run.stderr.decode()[-300:].strip()}")
    return json.loads(head)["not_allowed"], np.frombuffer(data, "<i8")


@contextmanager
def _load(wanted: bool) -> Iterator[None]:
    """Keep every processor busy with ordinary processes while the block runs."""
    count = len(os.sched_getaffinity(0)) if wanted else 0
    burners = [subprocess.Popen([sys.executable, "-P", "-c", _BURN]) for _ in range(count)]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()
