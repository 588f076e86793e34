"""Measure how late a loop wakes up on this machine, with and without the real-time settings.

Run as a program, it waits for deadlines as the control loop does. Arguments: period in s, cycles,
and optionally `realtime`. Standard output gets one line of JSON with the settings that were not
allowed, then the lateness of each cycle in ns as little-endian 64-bit numbers.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import cast

import numpy as np

from cdpr_rt.core.clock import PacedClock
from cdpr_rt.core.cycle import Cycle
from cdpr_rt.core.exchange import AxisDevice
from cdpr_rt.loop.realtime import enable_realtime, freeze_memory
from cdpr_tools.bench.harness import Figures, Times, percentiles
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output
from cdpr_tools.processes import module_command

ORDINARY, REALTIME = "ordinary process", "real-time settings"
_LOADS = {"idle": "no other load", "loaded": "every processor busy"}
_ROUNDS, _WARM_UP, _BINS_A_DECADE = 2, 100, 12
_COLOURS = {ORDINARY: "#d1581a", REALTIME: "#2f6fb0"}
# reads and writes more than a cache holds, so that processes also compete for memory
_BURN = "import hashlib\nblock = bytes(1 << 22)\nwhile True:\n    hashlib.sha256(block).digest()"

Lateness = dict[str, dict[str, Times]]


def measure(rate_Hz: float, seconds: float, picture: Path, out: Output) -> Figures:
    """Measure the lateness of wake-ups, by load and way, and draw all of them.

    The ways take turns, so that other load on the machine affects both equally. Raises
    WorkFailedError.
    """
    cycles = max(1, round(rate_Hz * seconds / _ROUNDS))
    late: Lateness = {load: {} for load in _LOADS}
    not_allowed: list[str] = []
    begun = 0
    with out.progress("waking up", seconds * len(_LOADS) * len(_COLOURS)) as advance:
        for load, of in late.items():
            with _busy(len(os.sched_getaffinity(0)) if load == "loaded" else 0):
                for _ in range(_ROUNDS):
                    for way in _COLOURS:
                        notices, times = _probe(1.0 / rate_Hz, cycles, way)
                        of[way] = np.concatenate([of.get(way, times[:0]), times])
                        not_allowed = notices or not_allowed
                        begun += 1
                        advance(begun * seconds / _ROUNDS)
    _draw(late, rate_Hz, picture)
    return Figures(
        f"{_ROUNDS * cycles} wake-ups at {rate_Hz:g} Hz for each line, in us behind the deadline; "
        f"kernel {platform.release()}, {len(os.sched_getaffinity(0))} processors",
        {
            f"{load}, {way}": percentiles(1e-3 * times, 50.0, 99.0, 99.9, 100.0, digits=1)
            for load, of in late.items()
            for way, times in of.items()
        },
        notes=[*(f"not allowed: {notice}" for notice in not_allowed), f"picture: {picture}"],
        more={"wakeups": _ROUNDS * cycles, "not_allowed": not_allowed, "picture": picture},
    )


def _draw(late: Lateness, rate_Hz: float, path: Path) -> None:
    """Write the histograms as a picture; raises BadInputError if it cannot be written."""
    # imported here: the probe, which locks its memory, must not load it
    from cdpr_tools.style import canvas, legend_above, save_figure  # noqa: PLC0415

    figure, axes = canvas(1, len(_LOADS), height=3.2, sharey=True)
    worst_us = 1e-3 * max(float(times.max()) for of in late.values() for times in of.values())
    decades = np.log10(max(worst_us, 10.0))
    bins = np.logspace(0.0, decades + 0.02, int(_BINS_A_DECADE * decades) + 2).tolist()
    for ax, (load, text) in zip(axes, _LOADS.items(), strict=True):
        for way, times in late[load].items():
            # times below a microsecond belong to the first bar
            us = np.maximum(1e-3 * times, bins[0])
            ax.hist(us, bins=bins, histtype="stepfilled", color=_COLOURS[way], alpha=0.25)
            ax.hist(us, bins=bins, histtype="step", color=_COLOURS[way], label=way)
        ax.axvline(1e6 / rate_Hz, color="#555555", lw=0.9, ls="--", label="one period")
        ax.set(xscale="log", yscale="log", title=text, xlabel="delay of the wake-up, µs")
    axes[0].set_ylabel("cycles per bar")
    legend_above(figure, axes[0])
    with os_error_as(BadInputError, f"--out {path}: cannot be written"):
        path.parent.mkdir(parents=True, exist_ok=True)
        save_figure(figure, path)


def _probe(period_s: float, cycles: int, way: str) -> tuple[list[str], Times]:
    command = module_command(
        "cdpr_tools.bench.latency", repr(period_s), str(cycles), *["realtime"] * (way == REALTIME)
    )
    run = subprocess.run(command, capture_output=True, check=False)
    head, _, data = run.stdout.partition(b"\n")
    if run.returncode != 0 or not data:
        raise WorkFailedError(f"the measuring process failed: {run.stderr.decode()[-300:].strip()}")
    return json.loads(head)["not_allowed"], np.frombuffer(data, "<i8")


@contextmanager
def _busy(count: int) -> Iterator[None]:
    """Keep `count` processors busy with ordinary processes while the block runs."""
    burners = [subprocess.Popen([sys.executable, "-P", "-c", _BURN]) for _ in range(count)]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()


class _NoDrives:
    """A device without axes and bus, so that only the waiting remains."""

    lockstep = False
    commands_s = 0.0

    def __init__(self, period_s: float) -> None:
        self.period_s = period_s
        self.clock = PacedClock()

    def sync(self) -> None:
        """Send nothing."""

    def receive(self) -> int:
        """Expect nothing."""
        return 0

    def transmit(self, _and_sync: bool = False) -> None:
        """Send nothing."""


def _wait(period_s: float, cycles: int) -> Times:
    """Return the lateness of each of `cycles` cycles, (cycles,), in ns."""
    cycle = Cycle(cast(AxisDevice, _NoDrives(period_s)))
    late = np.zeros(cycles + _WARM_UP, np.int64)
    due_ns, period_ns = 0, round(period_s * 1e9)
    for k in range(late.size):
        cycle.exchange()
        began_ns = cycle.began_ns
        # after a delay of many cycles the clock skips deadlines; the lateness still counts
        deadline_ns = began_ns - round(cycle.late_s * 1e9)
        given_up = k > 0 and deadline_ns - due_ns > period_ns // 2
        late[k] = began_ns - (due_ns if given_up else deadline_ns)
        due_ns = deadline_ns + period_ns
        cycle.transmit()
    return late[_WARM_UP:]


def _probed(period_s: str, cycles: str, *realtime: str) -> None:
    """Measure and write the lateness."""
    notices = [*freeze_memory(), *enable_realtime()] if realtime else []
    late = _wait(float(period_s), int(cycles))
    sys.stdout.buffer.write(json.dumps({"not_allowed": notices}).encode() + b"\n")
    sys.stdout.buffer.write(late.astype("<i8").tobytes())


if __name__ == "__main__":
    _probed(*sys.argv[1:])
