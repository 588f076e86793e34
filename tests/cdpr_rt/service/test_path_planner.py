"""The service's planner: one path at a time, in a separate process."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest

from cdpr_rt.service.service import PathPlanRunner, PlannerBusyError, WorkspaceBorder

WANTED = {"name": "part.nc", "text": "M2\n"}


def planned(status: int, text: str, stopped: str = "") -> dict[str, Any]:
    planner, seen = PathPlanRunner(), []

    async def work(file: Path, wanted: dict[str, Any]) -> tuple[int, str]:
        seen.append((file.read_text(), wanted))
        return status, text.replace("FILE", str(file))

    async def go() -> dict[str, Any]:
        planner.work = work
        assert planner.begin(WANTED)["planning"]
        with pytest.raises(PlannerBusyError):
            planner.begin(WANTED)
        if stopped:
            planner.cancel(stopped)
        while planner.job["planning"]:
            await asyncio.sleep(0)
        return planner.job

    job = asyncio.run(go())
    assert seen == [("M2\n", WANTED)]
    return job


def test_a_finished_plan_has_its_name_and_duration():
    job = planned(0, json.dumps({"plan": "ab", "duration_s": 2.0}))
    assert job == {"number": 1, "planning": False, "error": None, "plan": "ab", "duration_s": 2.0}


def test_an_infeasible_path_is_reported_by_the_users_file_name():
    job = planned(2, json.dumps({"error": "FILE:3: outside"}))
    assert (job["plan"], job["error"]) == (None, "part.nc:3: outside")
    assert planned(1, "no JSON")["error"].startswith("planning ended with status 1: out of memory?")


def test_a_stop_during_planning_discards_the_plan():
    job = planned(0, json.dumps({"plan": "ab", "duration_s": 2.0}), "hold by somebody")
    assert job["plan"] is None
    assert job["error"] == "not started: hold by somebody during planning"


def test_a_workspace_that_could_not_be_computed_is_computed_again():
    answers = [(1, json.dumps({"error": "no memory"})), (0, json.dumps({"edges": [1]}))]

    async def work() -> tuple[int, str]:
        return answers.pop(0)

    async def go() -> None:
        border = WorkspaceBorder()
        border.work = work
        with pytest.raises(PlannerBusyError, match="no memory"):
            await border.get()
        assert await border.get() == await border.get() == {"edges": [1]}

    asyncio.run(go())


def test_planning_without_a_robot_is_rejected():
    with pytest.raises(PlannerBusyError):
        PathPlanRunner().begin(WANTED)


def test_a_long_error_is_truncated():
    job = planned(2, json.dumps({"error": "FILE:3: " + "x" * 900_000}))
    assert job["error"].startswith("part.nc:3: x")
    assert len(job["error"]) <= 2000
