"""`cdpr bench loop` runs what it says it runs; how fast is for a machine that is not busy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_tools.bench.daemon import baseline_process
from cdpr_tools.bench.daemon import loop as loop_bench
from cdpr_tools.bench.daemon.loop_daemon import BenchDaemon, with_tolerant_limits
from cdpr_tools.output import Output

SECONDS, PERIOD_S = 1.0, 4e-3
pytestmark = [pytest.mark.alone, pytest.mark.long]


@pytest.fixture(scope="module")
def figures(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """One round at a quarter of the speed, which a machine that is busy with tests can follow."""
    shipped = load_robot(loop_bench.ROBOT).path
    slower = tmp_path_factory.mktemp("bench") / shipped.name
    slower.write_text(
        shipped.read_text().replace("sync_period_s = 0.001", f"sync_period_s = {PERIOD_S}")
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loop_bench, "ROUNDS", 1)
        patch.setattr(loop_bench, "ROBOT", str(slower))
        patch.setattr(loop_bench, "SLOW_PERIOD_S", 2 * PERIOD_S)
        return loop_bench.measure(SECONDS, Output(as_json=True))


@pytest.mark.parametrize(
    ("way", "rate_Hz"),
    [("ours", 250), ("without_service", 250), ("obvious", 250), ("obvious_slow", 125)],
)
def test_each_way_runs_its_cycles(figures: dict[str, Any], way: str, rate_Hz: int) -> None:
    told = figures[way]
    assert told["cycles"] > 0.5 * SECONDS * rate_Hz
    # eight axes each
    assert told["missed"] < 8 * told["cycles"]
    for figure in ("compute_us", "exchange_us", "lateness_us"):
        spread = told[figure]
        assert 0.0 < spread["p50"] <= spread["p99.9"] <= spread["worst"]
    assert 20.0 < told["host_us"] < 5000.0


def test_the_obvious_loop_costs_more(figures: dict[str, Any]) -> None:
    shares = figures["shares"]
    assert shares["obvious_over_ours"] > 1.5
    expected = figures["obvious_slow"]["host_us"] / figures["ours"]["host_us"]
    assert shares["obvious_over_ours"] == pytest.approx(expected, rel=0.01)
    cost = figures["ours"]["host_us"] / figures["without_service"]["host_us"] - 1.0
    assert shares["recording_share"] == pytest.approx(cost, abs=1e-3)


def test_one_bus_runs_at_nearly_all_it_carries(figures: dict[str, Any]) -> None:
    full = figures["one_bus"]
    assert (full["rate_Hz"], full["limit_Hz"]) == (500.0, 524)
    assert 0.94 < full["share"] < 0.96
    assert full["cycles"] > 0.5 * SECONDS * 500
    assert figures["reached"]["one_bus"] == (full["by_loop"] == 0)


def test_syncs_that_meet_the_last_commands_are_counted() -> None:
    stamp_ns = np.array([0, 2_000_000, 3_900_000, 6_200_000], np.int64)
    rows = {"stamp_ns": stamp_ns, "exchange_s": np.full(4, 1.1e-3), "compute_s": np.full(4, 5e-5)}
    assert loop_bench.early_syncs(rows, 0.76e-3) == 1
    assert loop_bench.early_syncs(rows, 0.70e-3) == 0


def test_a_platform_is_led_to_and_fro_by_both(tmp_path: Path, state_home: Path) -> None:
    # a robot of this name has fallen: none of the benchmark's business, nor is it to change that
    fallen = '{"stopped": false}'
    for name in ("spatial-8", "spatial-8.simulated"):
        file = state_home / "cdpr-rt" / f"lengths.{name}.json"
        file.parent.mkdir(exist_ok=True)
        file.write_text(fallen)
    shipped = load_robot("spatial-8").path
    slower = tmp_path / shipped.name
    slower.write_text(
        shipped.read_text().replace("sync_period_s = 0.001", f"sync_period_s = {PERIOD_S}")
    )
    (tmp_path / "tolerant").mkdir()
    robot = with_tolerant_limits(load_robot(str(slower)), tmp_path / "tolerant")
    with BenchDaemon(robot, tmp_path) as daemon:
        daemon.move(1.0)
        rows, spent_s = daemon.measure(3.0)
        assert daemon.block.status()["program"] == "pose"
    for file in state_home.glob("cdpr-rt/lengths.*"):
        assert file.read_text() == fallen
    assert spent_s > 0.0
    assert np.ptp(rows["position_rad"], axis=0).max() > 5.0
    assert np.nanmin(rows["tension_N"]) > 5.0, "all cables are tight"
    slow = replace(robot, sync_period_s=loop_bench.POSE_PERIOD_S)
    measured = baseline_process.measure(slow, 1.0, 0.0)
    assert measured["cycles"] == 100
    assert np.abs(measured["turned_rad"]).max() > 5.0


def test_figures_are_told_for_people(figures: dict[str, Any]) -> None:
    text = "\n".join(loop_bench.report(figures))
    for words in ("ours, recorded and watched", "at 125 Hz", "95 % of the 524 Hz"):
        assert words in text
    assert text.count("reached") + text.count("MISSED") == len(figures["reached"])
