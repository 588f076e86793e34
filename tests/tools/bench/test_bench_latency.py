"""`cdpr bench latency` measures how the control loop waits; no figure is judged."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.long

PERIOD_S = 0.002


def test_all_four_curves_are_measured_and_drawn(tmp_path: Path) -> None:
    picture = tmp_path / "new" / "latency.png"
    asked = ("--seconds", "0.2", "--rate", "500", "--out", str(picture), "--json")
    command = [sys.executable, "-m", "cdpr_tools.cli", "bench", "latency", *asked]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 0, run.stderr
    told = json.loads(run.stdout.splitlines()[-1])
    assert told["wakeups"] == 100
    for load in ("idle", "loaded"):
        for way in ("ordinary", "realtime"):
            us = told["late_us"][load][way]
            assert 0.0 <= us["p50"] <= us["p99"] <= us["p99.9"] <= us["max"]
    for notice in told["not_allowed"]:
        assert notice in run.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_loop_that_is_held_up_for_many_cycles_is_that_late() -> None:
    """The loop gives up the deadlines that have passed; their lateness is counted all the same."""
    arguments = [str(PERIOD_S), "1000", "ordinary"]
    probe = subprocess.Popen(
        [sys.executable, "-m", "cdpr_tools.bench.cyclic.wakeups", *arguments],
        stdout=subprocess.PIPE,
    )
    stopped_s = 0.0
    while probe.poll() is None:  # whenever it has loaded its libraries, one falls into its cycles
        time.sleep(0.5)
        began_s = time.monotonic()
        probe.send_signal(signal.SIGSTOP)
        time.sleep(0.4)
        probe.send_signal(signal.SIGCONT)
        stopped_s += time.monotonic() - began_s
    out, _ = probe.communicate(timeout=120)
    late_ns = np.frombuffer(out.partition(b"\n")[2], "<i8")
    assert late_ns.size == 1000
    assert late_ns.min() > -1000
    assert late_ns.max() > 0.3e9
    # all other cycles begin on time
    assert np.sum(late_ns > 0.1e9) * PERIOD_S < stopped_s
