"""`cdpr bench poses` as typed, on a few ways."""

from __future__ import annotations

import json

import pytest
from cdpr_here import cdpr_here

from cdpr_tools.bench.poses import measure


def test_it_prints_rate_ratio_and_false_acceptances(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure, "_TIMED", 100)
    monkeypatch.setattr(measure, "_COMPARED", 3)
    done = cdpr_here("bench", "poses", "--ways", "12", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["ways"] == told["whole"] + told["cut_by_contact"] + told["cut_by_tensions"] == 12
    assert told["false_acceptances"] == 0 and told["reached"]["no_false_acceptance"]
    assert "accepted, but not by brute force: 0, wanted 0: reached" in done.stderr
