"""`cdpr bench bus` measures every bus there is and says which there is not."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from cdpr_tools.bench.cyclic.bus import report


@pytest.fixture(scope="module")
def result() -> subprocess.CompletedProcess[str]:
    words = ("bench", "bus", "--exchanges", "20", "--json")
    return subprocess.run(
        [sys.executable, "-m", "cdpr_tools.cli", *words],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture(scope="module")
def figures(result: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    assert result.returncode == 0, result.stderr
    return dict(json.loads(result.stdout.splitlines()[-1]))


@pytest.mark.parametrize("bus", ["simbus", "socketcand", "slcan"])
@pytest.mark.parametrize("way", ["ours", "python-can"])
def test_each_way_on_each_bus(figures: dict[str, Any], bus: str, way: str) -> None:
    told = figures["buses"][bus][way]
    mean_us = told["wall_us_per_frame"]["mean"]
    assert told["frames_per_s"] == pytest.approx(1e6 / mean_us, rel=0.01)
    for key in ("cpu_us_per_frame", "wall_us_per_frame"):
        assert 0.0 < told[key]["p50"] <= told[key]["p99.9"]


def test_a_serial_line_is_no_faster_than_its_characters(figures: dict[str, Any]) -> None:
    """A frame of 8 bytes has 22 characters, 220 us at 1 Mbaud; both directions at once."""
    for way in ("ours", "python-can"):
        assert figures["buses"]["slcan"][way]["wall_us_per_frame"]["p50"] > 110.0


def test_the_packed_path_is_the_cheaper_one(figures: dict[str, Any]) -> None:
    told = figures["buses"]["simbus"]
    ours, stock = (told[way]["cpu_us_per_frame"]["mean"] for way in ("ours", "python-can"))
    assert told["python_can_over_ours"] == pytest.approx(stock / ours, rel=0.05)
    # of twenty exchanges one that is disturbed makes a mean of either
    assert told["python-can"]["cpu_us_per_frame"]["p50"] > told["ours"]["cpu_us_per_frame"]["p50"]


def test_the_table_has_a_line_for_each(
    figures: dict[str, Any], result: subprocess.CompletedProcess[str]
) -> None:
    for line in report(figures):
        assert line in result.stderr
    names = [line.split()[0].rstrip(":") for line in report(figures)[3:]]
    assert set(names) >= {"simbus", "socketcan", "socketcand", "slcan"}
