"""`cdpr bench workspace` compares what says the same; times belong to a machine."""

from __future__ import annotations

import json
from typing import Any

import pytest
from cdpr_here import cdpr_here

from cdpr_tools.bench import workspace as bench


def test_others_say_the_same_and_volumes_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "CELLS", 30)
    monkeypatch.setattr(bench, "RAYS", 2000)
    done = cdpr_here("bench", "workspace", "--poses", "100000", "--compared", "40", "--json")
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    assert set(told["others"]) == {"margins", "active set", "osqp", "pycapacity"}
    assert all(other["otherwise"] == 0 for other in told["others"].values())
    volume = told["volume"]
    assert abs(volume["grid_m3"] - volume["drawn_m3"]) < 4.0 * volume["drawn_std_m3"]
    assert told["reached"]["agreement"] is True
    assert "a million takes" in done.stderr and "OSQP, every corner" in done.stderr
