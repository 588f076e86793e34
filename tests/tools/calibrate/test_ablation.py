"""`cdpr calibrate study --ablation`: the thesis' way and the joint fit on the same readings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from cdpr_here import cdpr_here

from cdpr_tools.calibrate import ablation
from cdpr_tools.calibrate.ablation import SOURCES, STEPS, AblationCase, Accuracy, trial


def test_the_joint_fit_is_several_times_better_than_the_thesis_way() -> None:
    thesis = trial("spatial-8", replace(SOURCES[0], poses=30), 3)
    joint = trial("spatial-8", replace(STEPS[2], poses=30), 3)
    assert 20.0 < thesis.marker_mm < 200.0
    assert joint.marker_mm < 0.3 * thesis.marker_mm
    assert joint.position_mm < 0.7 * thesis.position_mm
    assert joint.turn_deg < 0.6 * thesis.turn_deg
    assert joint.position_mm < 10.0 and joint.turn_deg < 0.5


def test_the_last_step_is_within_what_is_wanted() -> None:
    last = trial("spatial-8", replace(STEPS[-1], poses=30), 4)
    assert last.position_mm < 2.0 and last.turn_deg < 0.15


def test_each_case_has_its_own_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def one(robot: str, case: AblationCase, seed: int) -> Accuracy:
        asked.append((robot, seed))
        return Accuracy(float(case.poses), float(case.joint), float(seed), 0.0)

    monkeypatch.setattr(ablation, "trial", one)
    monkeypatch.setattr(ablation, "cores", lambda: 1)
    done: list[float] = []
    tables = ablation.ablation("spatial-8", 2, 5, None, done.append)
    assert done == [float(k + 1) for k in range(ablation.count(2))]
    assert set(asked) == {("spatial-8", 5), ("spatial-8", 6)}
    assert [row["name"] for row in tables["sources"]] == [case.name for case in SOURCES]
    for row, case in zip(tables["steps"], STEPS, strict=True):
        told = row["name"], row["position_mm"], row["turn_deg"], row["marker_mm"]
        assert told == (case.name, float(case.poses), float(case.joint), 5.5)


def test_both_tables_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    one = Accuracy(14.0, 0.7, 49.0, 2.4)
    rows = [ablation._row(case, [one, one]) for case in SOURCES]

    def made(*_: Any) -> dict[str, Any]:
        return {"sources": rows, "steps": rows[:1]}

    monkeypatch.setattr(ablation, "ablation", made)
    done = cdpr_here("calibrate", "study", "spatial-8", "--ablation", "--draws", "2", "--json")
    assert done.returncode == 0, done.stderr
    assert "with rigid cables" in done.stderr and "14.00 mm" in done.stderr
    assert '"marker_mm": 49.0' in done.stdout


def test_a_robot_in_a_plane_is_refused() -> None:
    done = cdpr_here("calibrate", "study", "planar-3", "--ablation")
    assert done.returncode == 2 and "six directions" in done.stderr
