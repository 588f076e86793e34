"""`cdpr bench` loop, stop and latency run the cases that they name. Timing is not judged."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_tools.bench import api, loop, stop
from cdpr_tools.output import Output
from tests.slower_robot import PERIOD_S, slower_robot

WAKE_UP_S = 0.002
ALONE = pytest.mark.alone
pytestmark = pytest.mark.long


@ALONE
def test_the_baseline_loop_runs_the_same_axes_and_costs_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop, "ROUNDS", 1)
    figures = loop.measure(2.0, Output(as_json=True), str(slower_robot(tmp_path, "bench-8")))
    ours, *baseline = figures.rows.values()
    assert len(baseline) == 2
    for row, period_s in zip(
        figures.rows.values(), (PERIOD_S, PERIOD_S, 4 * PERIOD_S), strict=True
    ):
        assert row["cycles"] > 0.5 * 2.0 / period_s
        assert row["missed"] < 8 * row["cycles"]  # eight axes
        assert 20.0 < row["host CPU"] < 5000.0
        assert 0.0 < row["computing p50"] <= row["computing p99.9"]
    ratio = baseline[1]["host CPU"] / ours["host CPU"]
    assert figures.targets["baseline_over_ours"].value == pytest.approx(ratio) and ratio > 1.5


@ALONE
def test_bench_api_measures_starts_and_controllers_in_lockstep_and_paced() -> None:
    figures = api.measure(1, 200, 3.0, Output(as_json=True))
    simulated, daemon = (figures.more["starts"][way] for way in (api.SIMULATED, api.DAEMON))
    assert (
        0.0
        < simulated["ready p50"]
        < simulated["begins p50"]
        < simulated["moved p50"]
        < daemon["moved p50"]
    )
    assert set(figures.rows) == {api.BUILT_IN, api.NOTHING, api.POSE}
    assert figures.rows[api.POSE]["CPU p50"] > figures.rows[api.NOTHING]["CPU p50"]
    assert all(row["cycles"] > 0.5 * 3.0 / PERIOD_S for row in figures.more["paced"].values())
    assert set(figures.targets) == {"start_s", "over_us", "late", "off_mm"}
    assert figures.more["paced"][api.POSE]["off by p50, mm"] < 3.0


@ALONE
def test_bench_loop_moves_a_platform_and_ignores_stored_lengths(
    tmp_path: Path, state_home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fallen = '{"stopped": false}'
    for name in ("spatial-8", "spatial-8.simulated"):
        file = state_home / "cdpr-rt" / f"lengths.{name}.json"
        file.parent.mkdir(exist_ok=True)
        file.write_text(fallen)
    monkeypatch.setattr(loop, "ROUNDS", 1)
    figures = loop.measure(3.0, Output(as_json=True), str(slower_robot(tmp_path, "spatial-8")))
    (ours,) = figures.rows.values()
    assert ours["cycles"] > 0.5 * 3.0 / PERIOD_S
    for name in ("spatial-8", "spatial-8.simulated"):
        assert (state_home / "cdpr-rt" / f"lengths.{name}.json").read_text() == fallen


def test_each_stop_is_accepted_while_every_interface_is_flooded() -> None:
    figures = stop.measure(6, Output(as_json=True))
    assert len(figures.rows) == 4
    for ms in figures.rows.values():
        assert 0.0 < ms["p50"] <= ms["p99"] <= ms["max"]
    kinds = {"unix", "http_with_key", "http_without_key", "websocket", "websocket_refused"}
    assert set(figures.more["sent"]) == kinds | {"idle_connections", "stream_packets"}
    assert min(figures.more["sent"].values()) > 0


def test_all_four_curves_of_latency_are_measured_and_drawn(tmp_path: Path) -> None:
    picture = tmp_path / "new" / "latency.png"
    options = ("--seconds", "0.2", "--rate", "500", "--out", str(picture), "--json")
    command = [sys.executable, "-m", "cdpr_tools.cli", "bench", "latency", *options]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 0, run.stderr
    figures: dict[str, Any] = json.loads(run.stdout.splitlines()[-1])
    assert (figures["wakeups"], len(figures["rows"])) == (100, 4)
    for us in figures["rows"].values():
        assert 0.0 <= us["p50"] <= us["p99"] <= us["p99.9"] <= us["max"]
    for notice in figures["not_allowed"]:
        assert notice in run.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_delay_of_many_cycles_is_counted_for_each_of_them() -> None:
    """The loop skips deadlines that have passed but counts their lateness."""
    arguments = [str(WAKE_UP_S), "1000"]
    probe = subprocess.Popen(
        [sys.executable, "-m", "cdpr_tools.bench.latency", *arguments], stdout=subprocess.PIPE
    )
    stopped_s = 0.0
    while probe.poll() is None:  # one of the stops occurs during its cycles
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
    assert np.sum(late_ns > 0.1e9) * WAKE_UP_S < stopped_s
