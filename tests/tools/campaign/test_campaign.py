"""Fault campaigns: snapshots change nothing, failures are found, reported and shrunk."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cdpr_here import cdpr_here
from waiting import until

from cdpr_profiles import Robot
from cdpr_sim_bus.cia402.faults import FAULTS
from cdpr_tools.campaign.campaign import drawn, shrunk
from cdpr_tools.campaign.farm import Seeds, run_alone
from cdpr_tools.campaign.judge import INVARIANTS, judge
from cdpr_tools.campaign.play import Played, Player, RobotAtStart
from cdpr_tools.campaign.scenario import BEFORE_BOOT, DRAWN, READY, TIGHT, Scenario
from cdpr_tools.processes import module_command

pytestmark = pytest.mark.usefixtures("slower_profiles")
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


def test_all_faults_of_a_robot_without_cells_brakes_and_safety_io_are_drawn() -> None:
    faults = [fault for one in drawn(range(400), [ROBOT, "spatial-8"]) for fault in one.faults]
    assert {fault["fault"] for fault in faults} == set(DRAWN)
    for fault in faults:
        if fault["value"]:
            FAULTS[fault["fault"]].amount(fault["value"])  # raises ValueError


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Played, Robot]]:
    """A drive with a fault, repaired, and the robot at work again."""
    fault = {"fault": "drive-fault", "axis": 2, "value": None, "at_s": 0.3}
    move = {"do": "move", "position_m": [0.1, 1.6], "wait_s": 0.5}
    scenario = replace(NOTHING, start=TIGHT, actions=(move,), faults=(fault,), recorded=True)
    start = RobotAtStart(scenario, tmp_path_factory.mktemp("day"))
    with start.rig:
        for where in (READY, TIGHT):
            start.advance(where)
        yield Player(scenario, start).play(), start.rig.robot


def _changed(played: Played, name: str, at: Any, value: Any) -> Played:
    """Return what was played with other values in one field of the truth."""
    changed = replace(played, truth=played.truth.copy())
    changed.truth[name][at] = value
    return changed


def _with_cause(played: Played, **fields: Any) -> Played:
    statuses = [
        status | {"faults": [fault | fields for fault in status["faults"] or ()]}
        for status in played.statuses
    ]
    return replace(played, statuses=statuses)


def _reply(played: Played, **fields: Any) -> Played:
    return replace(played, replies=[played.replies[0] | fields])


def _end(played: Played, **fields: Any) -> Played:
    return replace(played, statuses=[*played.statuses[:-1], played.statuses[-1] | fields])


_TAMPERED: dict[str, Callable[[Played], Played]] = {
    "no_torque_afterwards": lambda p: _changed(p, "torque_Nm", (-1, 0), 0.1),
    "dead_loop_has_no_torque": lambda p: replace(
        _changed(p, "torque_Nm", (-1, 0), 0.1), dead_s=p.began_s
    ),
    "falls_are_reported": lambda p: _end(
        _changed(p, "position_m", -1, -1.0), last_stop={"fallen": False}
    ),
    "falls_have_a_cause": lambda p: _changed(p, "position_m", -1, -1.0),
    "descents_are_predicted": lambda p: _changed(p, "velocity_m_s", -1, -9.0),
    "causes_are_true": lambda p: _with_cause(p, axis=0),
    "causes_are_named": lambda p: _with_cause(p, axis=0),
    "what_matters_is_noticed": lambda p: _changed(p, "tension_N", (slice(None), 1), 200.0),
    "limits_are_kept": lambda p: _changed(p, "tension_N", (0, 1), 200.0),
    "tensions_are_predicted": lambda p: _changed(p, "tension_N", (-1, 1), 2000.0),
    "commands_are_answered": lambda p: _reply(p, ok=False, text=""),
    "comes_to_rest": lambda p: replace(p, settled_s=None),
    "works_again": lambda p: replace(p, recovered=False),
    "no_exception": lambda p: replace(p, output="Traceback (most recent call last):"),
    "numbers_are_finite": lambda p: _changed(p, "tension_N", (0, 0), np.nan),
    "recordings_are_complete": lambda p: replace(p, recordings=[]),
    "memory_is_bounded": lambda p: replace(p, rise_MB=1000.0),
}


def test_a_fault_that_the_robot_names_violates_nothing(day: tuple[Played, Robot]) -> None:
    played, robot = day
    result = judge(played, robot)
    assert not result.violations
    assert result.faults == [("drive-fault", "stopped, named")]
    assert set(_TAMPERED) == {invariant.__name__ for invariant in INVARIANTS}


@pytest.mark.parametrize("invariant", _TAMPERED)
def test_each_invariant_finds_its_violation(invariant: str, day: tuple[Played, Robot]) -> None:
    played, robot = day
    violations = judge(_TAMPERED[invariant](played), robot).violations
    assert invariant in {violation.partition(":")[0] for violation in violations}


def test_speeds_are_limited_until_the_power_is_cut(day: tuple[Played, Robot]) -> None:
    played, robot = day
    fast = _changed(played, "motor_rad_s", (3, 1), 1e4)
    for at, kept in ((2, True), (4, False)):
        cut = replace(fast, done=[("power off", float(fast.truth["time_s"][at]))])
        found = {one.partition(":")[0] for one in judge(cut, robot).violations}
        assert ("limits_are_kept" not in found) is kept


def test_the_tension_of_a_motor_that_disobeys_is_not_predicted(day: tuple[Played, Robot]) -> None:
    played, robot = day
    injected = ({**played.scenario.faults[0], "fault": "torque-bias", "value": -0.9},)
    for axis, judged in ((1, False), (0, True)):
        pulled = _changed(played, "tension_N", (-1, axis), 2000.0)
        disobeyed = replace(pulled, scenario=replace(played.scenario, faults=injected))
        found = {one.partition(":")[0] for one in judge(disobeyed, robot).violations}
        assert ("tensions_are_predicted" in found) is judged


def test_a_large_slip_must_be_named_unless_cables_may_be_slack(day: tuple[Played, Robot]) -> None:
    played, robot = day
    slip = {**played.scenario.faults[0], "fault": "slip", "value": 900.0}
    slipped = replace(played.scenario, faults=(slip,))
    for tight, missed in ((True, True), (False, False)):
        held = {"faults": [], "program": "hold", "program_progress": {"tight": tight}}
        statuses = [status | held for status in played.statuses]
        found = judge(replace(played, scenario=slipped, statuses=statuses), robot).violations
        assert any(one.startswith("causes_are_named") for one in found) is missed


def test_only_a_frozen_encoder_hides_the_speed_of_its_winch(day: tuple[Played, Robot]) -> None:
    played, robot = day
    calm = replace(played, statuses=[s | {"faults": []} for s in played.statuses])
    for axis, noticed in ((1, True), (0, False)):
        injected = ({**played.scenario.faults[0], "fault": "encoder-frozen", "at_s": 0.0},)
        fast = _changed(calm, "motor_rad_s", (slice(None), axis), 1e4)
        frozen = replace(fast, scenario=replace(played.scenario, faults=injected))
        found = {one.partition(":")[0] for one in judge(frozen, robot).violations}
        assert ("what_matters_is_noticed" not in found) is noticed


def test_a_frozen_encoder_may_drag_another_winch_from_its_place(day: tuple[Played, Robot]) -> None:
    played, robot = day
    for fault, explained in (("encoder-frozen", True), ("encoder-noise", False)):
        injected = ({**played.scenario.faults[0], "fault": fault},)
        scenario = replace(played.scenario, faults=injected)
        named = _with_cause(
            replace(played, scenario=scenario), axis=0, limit="following_error", code=""
        )
        found = {one.partition(":")[0] for one in judge(named, robot).violations}
        assert ("causes_are_true" not in found) is explained


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_campaign_that_is_ended_leaves_no_processes_and_files(how: int, tmp_path: Path) -> None:
    command = module_command("cdpr_tools.cli", "sim", "campaign", ROBOT, "--seeds", "2")
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen(
        [*command, "--workers", "1"], env=environment, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    ) as campaign:  # fmt: skip
        until(lambda: any(tmp_path.glob("cdpr-campaign-*/plant.toml")))
        os.killpg(campaign.pid, how) if how == signal.SIGINT else campaign.kill()
        said, _ = campaign.communicate(timeout=60.0)  # until no process has the pipe
    assert "Traceback" not in said
    assert not list(tmp_path.glob("cdpr-*"))


@pytest.mark.long
def test_fixed_seeds_violate_nothing() -> None:
    """They draw almost every fault and command, for the robot as it is shipped."""
    words = ("sim", "campaign", ROBOT, "--from", "60", "--seeds", "60", "--workers", "1", "--json")
    environment = {**os.environ, "XDG_CONFIG_HOME": "/nonexistent"}
    command = module_command("cdpr_tools.cli", *words)  # its own process, with its own robots
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 0, done.stdout
