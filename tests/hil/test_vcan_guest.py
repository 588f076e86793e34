"""A vcan test passes only if it ran: outcomes of the guest are replayed faithfully."""

import json

import pytest
from vcan_replay import Outcome, parse, replay


def _phase(item: pytest.Item, when: str, outcome: str, longrepr: object = None) -> str:
    return json.dumps(
        {
            "nodeid": item.nodeid,
            "location": list(item.location),
            "keywords": {},
            "outcome": outcome,
            "longrepr": longrepr,
            "when": when,
            "sections": [],
            "duration": 0.1,
            "start": 0.0,
            "stop": 0.1,
        }
    )


def _outcomes(item: pytest.Item, outcome: Outcome) -> list[str]:
    return [f"{r.when} {r.outcome}" for r in replay(item, outcome)]


def test_a_test_is_skipped_with_the_reason_if_there_is_no_guest(request: pytest.FixtureRequest):
    (report,) = replay(request.node, Outcome({}, "", "no apt-get"))
    assert report.outcome == "skipped"
    assert isinstance(report.longrepr, tuple)
    assert report.longrepr[2].endswith("no guest kernel: no apt-get")


def test_reports_of_the_guest_are_replayed(request: pytest.FixtureRequest):
    item = request.node
    ran = [_phase(item, when, "passed") for when in ("setup", "call", "teardown")]
    whole = Outcome(parse("".join(line + "\n" for line in ran)), "")
    assert _outcomes(item, whole) == ["setup passed", "call passed", "teardown passed"]
    ran[1] = _phase(item, "call", "failed", "assert 1 == 2")
    failed = Outcome(parse("".join(line + "\n" for line in ran)), "")
    assert _outcomes(item, failed) == ["setup passed", "call failed", "teardown passed"]
    ran[1] = _phase(item, "call", "skipped", ["f.py", 3, "Skipped: no"])
    skipped = Outcome(parse("".join(line + "\n" for line in ran)), "")
    assert [r.longrepr for r in replay(item, skipped)][1] == ("f.py", 3, "Skipped: no")


@pytest.mark.parametrize("lines", [0, 1, 2])
def test_a_guest_that_dies_fails_the_test(request: pytest.FixtureRequest, lines: int):
    item = request.node
    ran = [_phase(item, when, "passed") for when in ("setup", "call", "teardown")]
    cut = "".join(line + "\n" for line in ran[:lines]) + ran[lines][:-5]
    last = list(replay(item, Outcome(parse(cut), "Kernel panic")))[-1]
    assert last.outcome == "failed"
    assert "Kernel panic" in str(last.longrepr)
