"""Fault campaigns: snapshots change nothing, failures are found, reported and shrunk."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from cdpr_here import cdpr_here

from cdpr_tools.campaign.campaign import drawn, shrunk
from cdpr_tools.campaign.farm import Seeds, run_alone
from cdpr_tools.campaign.scenario import BEFORE_BOOT, READY, TIGHT, Scenario

ROBOT = "planar-3"
NOTHING = Scenario(0, ROBOT, {}, READY, ({"do": "enable", "wait_s": 0.1},), (), False, False)


@pytest.mark.long
def test_a_seed_from_a_snapshot_gives_the_same_bytes_as_a_separate_robot(tmp_path: Path) -> None:
    drawn_ones = drawn(range(100), [ROBOT])
    chosen = [
        next(one for one in drawn_ones if one.start == start)
        for start in (TIGHT, READY, BEFORE_BOOT)
    ]
    results = Seeds(tuple(chosen)).run()
    alone = [run_alone(one, tmp_path).digest for one in chosen]
    assert all(alone)
    assert [result.digest for result in results] == alone


def test_a_crash_is_reported_and_shrunk_to_the_action_that_causes_it() -> None:
    crash = {"do": "stall", "wait_s": 0.1}  # without its duration
    hold = {"do": "hold", "wait_s": 0.01}
    fault = {"fault": "drive-fault", "axis": 1, "value": None, "at_s": 0.02}
    failing = replace(NOTHING, actions=(hold, hold, crash, hold), faults=(fault,))
    crashed, fine = Seeds((failing, NOTHING)).run()
    assert "KeyError" in crashed.violations[0]
    assert not fine.violations
    smallest = shrunk(failing, lambda _: None)
    assert [action["do"] for action in smallest.actions] == ["stall"]
    assert not smallest.faults


def test_a_script_is_played_and_its_violation_sets_the_exit_status(tmp_path: Path) -> None:
    script = tmp_path / "script.json"
    script.write_text(NOTHING.text(), encoding="utf-8")
    assert cdpr_here("sim", "campaign", "--script", str(script)).returncode == 0
    bad = replace(NOTHING, actions=({"do": "stall", "wait_s": 0.1},))
    script.write_text(bad.text(), encoding="utf-8")
    done = cdpr_here("sim", "campaign", "--script", str(script), "--json")
    assert done.returncode == 1
    assert not json.loads(done.stdout.splitlines()[-1])["ok"]


@pytest.mark.long
def test_thirty_seeds_violate_nothing() -> None:
    done = cdpr_here(
        "sim", "campaign", ROBOT, "--from", "30", "--seeds", "30", "--workers", "1", "--json"
    )
    assert done.returncode == 0, done.stdout
