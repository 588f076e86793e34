"""`cdpr bench control` runs to its end, both ways agree, and its verdicts are those of its figures.

No timing is judged.
"""

from __future__ import annotations

import json
import subprocess
import sys
from functools import lru_cache
from typing import Any

import pytest


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cdpr_tools.cli", "bench", "control", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@lru_cache
def measured(robot: str) -> tuple[dict[str, Any], str]:
    """Return the JSON line and the text for people."""
    done = run("--robot", robot, "--cycles", "500", "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1]), done.stderr


@pytest.mark.parametrize(
    ("robot", "cables", "directions"), [("planar-3", 3, 2), ("spatial-8", 8, 6)]
)
def test_both_ways_come_to_the_same_torques(robot: str, cables: int, directions: int) -> None:
    figures, _ = measured(robot)
    assert (figures["ok"], figures["robot"], figures["cycles"]) == (True, robot, 500)
    assert (figures["cables"], figures["directions"]) == (cables, directions)
    assert 0.0 < figures["difference_Nm"] < 1e-5


def test_verdicts_are_those_of_the_printed_figures() -> None:
    figures, told = measured("planar-3")
    us = figures["update_us"]
    for way in ("ours", "obvious"):
        assert 0.0 < us[way]["p50"] <= us[way]["p99"] <= us[way]["worst"]
    ratio = us["obvious"]["p50"] / us["ours"]["p50"]
    assert figures["obvious_over_ours"] == pytest.approx(ratio)
    assert figures["targets"] == {"ratio": 20.0, "p99_us": 100.0}
    assert figures["reached"] == {"ratio": ratio >= 20.0, "p99_us": us["ours"]["p99"] <= 100.0}
    for text in ("planar-3: 3 cables, 2 directions", "ours, compiled", "NumPy / ours at p50"):
        assert text in told


def test_a_robot_without_a_platform_is_refused() -> None:
    done = run("--robot", "bench-2")
    assert done.returncode == 2
    assert "bench-2.toml: has no platform; allowed: robots with a [platform]" in done.stderr
    assert "Traceback" not in done.stderr
