"""The `cdpr bench` commands run to their end and their figures agree; no timing is judged."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import lru_cache
from typing import Any

import pytest

VARIANTS = ("ours", "canopen", "floor")


@lru_cache
def bench(*arguments: str) -> tuple[dict[str, Any], str]:
    """Return the JSON line and the text for people of one `cdpr bench` run."""
    command = [sys.executable, "-m", "cdpr_tools.cli", "bench", *arguments, "--json"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1]), run.stderr


def cycle() -> tuple[dict[str, Any], str]:
    # two blocks, the second one shorter
    return bench("cycle", "--cycles", "520")


def test_cycle_gives_percentiles_of_each_way() -> None:
    figures, _ = cycle()
    assert (figures["ok"], figures["axes"], figures["cycles"]) == (True, 8, 520)
    for kind in ("cpu_us", "wall_us"):
        assert set(figures[kind]) == set(VARIANTS)
        for variant in VARIANTS:
            assert 0.0 < figures[kind][variant]["p50"] <= figures[kind][variant]["p99.9"]


def test_the_ratios_are_those_of_the_printed_medians_and_are_held_against_the_targets() -> None:
    figures, _ = cycle()
    p50 = {variant: figures["cpu_us"][variant]["p50"] for variant in VARIANTS}
    ratios, targets = figures["ratios"], figures["targets"]
    assert ratios["canopen_over_ours"] == pytest.approx(p50["canopen"] / p50["ours"], abs=0.01)
    assert ratios["ours_over_floor"] == pytest.approx(p50["ours"] / p50["floor"], abs=0.01)
    assert targets == {"canopen_over_ours": 6.0, "ours_over_floor": 1.5}
    assert figures["reached"] == {
        "canopen_over_ours": ratios["canopen_over_ours"] >= 6.0,
        "ours_over_floor": ratios["ours_over_floor"] <= 1.5,
    }


def test_every_way_exchanges_the_same_frames() -> None:
    """SYNC, 8 TPDOs and 8 RPDOs, counted by the bus; ours adds the master's heartbeat."""
    frames = cycle()[0]["frames_per_cycle"]
    assert frames["canopen"] == frames["floor"] == 17.0
    assert 17.0 <= frames["ours"] < 17.1


def test_every_way_reads_all_eight_drives() -> None:
    """Nobody asks for power, so every statusword must say switch-on disabled."""
    statuswords = cycle()[0]["statuswords"]
    for variant in VARIANTS:
        assert [word & 0x4F for word in statuswords[variant]] == [0x40] * 8


def test_people_are_told_the_figures_and_the_verdicts() -> None:
    figures, text = cycle()
    for variant in VARIANTS:
        assert f"{figures['cpu_us'][variant]['p50']:.1f}" in text
        assert f"{figures['cpu_us'][variant]['p99.9']:.1f}" in text
    for key, told in (("canopen_over_ours", "canopen / ours"), ("ours_over_floor", "ours / floor")):
        (line,) = [line for line in text.splitlines() if line.startswith(told)]
        assert f"{figures['ratios'][key]:.2f}" in line
        assert line.endswith("reached" if figures["reached"][key] else "MISSED")


def test_cycles_must_be_positive() -> None:
    command = [sys.executable, "-m", "cdpr_tools.cli", "bench", "cycle", "--cycles", "0"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 2
    assert "--cycles" in run.stderr
    assert "Traceback" not in run.stderr


def test_profiles_are_held_against_their_bound_and_bare_parsing() -> None:
    figures, text = bench("profiles", "--repeats", "2")
    assert figures["files"] >= 5
    ratio = figures["load_all_ms"] / figures["tomllib_ms"]
    assert figures["ratio"] == pytest.approx(ratio, abs=0.01)
    assert figures["bound_ms"] == 100.0
    assert figures["reached"] == (figures["load_all_ms"] < 100.0)
    assert f"{figures['ratio']:.2f}" in text
