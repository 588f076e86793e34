"""A refusal as text, as JSON, and read back from JSON."""

from __future__ import annotations

import json
import pickle
from typing import Any

import pytest

from cdpr_rt.errors import ControlError
from cdpr_rt.loop.engine import RefusedError
from cdpr_rt.refusal import CommandRefusal, RefusalCode, refusal_of

RANGE = {"index": 1, "low": -2.0, "high": 2.0}
STATE = {"state": "fault", "allowed": ["ready", "active"]}
FROM = {"why": "the lengths are not known", "allowed": ["home", "last"]}
REFUSALS = [
    (
        CommandRefusal(RefusalCode.NOT_IN_STATE, "enable", arguments=STATE),
        "enable: not allowed in state fault; allowed in ready or active",
    ),
    (
        CommandRefusal(RefusalCode.OUT_OF_RANGE, "jog", {"velocity_rad_s": 5.0}, RANGE),
        "jog: velocity_rad_s[1]: value 5.0; allowed: a number from -2 to 2",
    ),
    (
        CommandRefusal(RefusalCode.OUT_OF_RANGE, "path", {"feed": 5.0}, {**RANGE, "index": None}),
        "path: feed: value 5.0; allowed: a number from -2 to 2",
    ),
    (
        CommandRefusal(
            RefusalCode.NOT_FEASIBLE, "pose", {"position_m": [0.1, 2.0]}, {"why": "cable 1"}
        ),
        "pose: position_m: value [100.0, 2000.0] mm: cable 1",
    ),
    (
        CommandRefusal(
            RefusalCode.NOT_FEASIBLE,
            "pose",
            {"position_m": [0.0, -0.2], "rotation_rad": [0.1]},
            {"why": "on the way, at 0.0, -100.0 mm turned by 2.9 deg: cable 1"},
        ),
        "pose: position_m: value [0.0, -200.0] mm, rotation_rad: value [5.7] deg: on the way, at "
        "0.0, -100.0 mm turned by 2.9 deg: cable 1",
    ),
    (
        CommandRefusal(
            RefusalCode.NOTHING_LEFT, "path", {"resume": True}, {"left": "path", "instead": "plan"}
        ),
        "path: resume: there is no path to continue; allowed: plan",
    ),
    (
        CommandRefusal(RefusalCode.NOT_TIGHT, "pose"),
        "pose: the cables are not tight; run tighten first",
    ),
    (
        CommandRefusal(RefusalCode.NOT_CALIBRATED, "pose", arguments={"why": "not calibrated"}),
        "pose: not calibrated",
    ),
    (
        CommandRefusal(RefusalCode.BAD_SOURCE, "tighten", {"from": "lengths"}, FROM),
        "tighten: from: value 'lengths': the lengths are not known; allowed: from home, last",
    ),
    (
        CommandRefusal(RefusalCode.BAD_SOURCE, "tighten", {}, {**FROM, "allowed": []}),
        "tighten: the lengths are not known",
    ),
]


def test_every_refusal_code_has_an_example() -> None:
    assert {refusal.code for refusal, _ in REFUSALS} == set(RefusalCode)


@pytest.mark.parametrize(("refusal", "text"), REFUSALS)
def test_a_refusal_has_its_text_and_survives_json(refusal: CommandRefusal, text: str) -> None:
    assert str(refusal) == str(ControlError(refusal)) == text
    assert CommandRefusal.from_json(json.loads(json.dumps(refusal.as_json()))) == refusal


def test_a_refused_error_can_be_pickled_and_given_another_text() -> None:
    refusal = REFUSALS[0][0]
    copy = pickle.loads(pickle.dumps(RefusedError(refusal)))
    assert type(copy) is RefusedError
    assert (str(copy), refusal_of(copy)) == (str(refusal), refusal)
    assert str(type(copy)("other words")) == "other words"


def test_an_error_carries_its_refusal_and_an_error_with_text_only_has_none() -> None:
    refusal = REFUSALS[0][0]
    assert refusal_of(ControlError(refusal)) is refusal
    assert refusal_of(ControlError("words")) is None
    assert refusal_of(ControlError()) is None


@pytest.mark.parametrize(
    "value",
    [
        None,
        "not_tight",
        {},
        {"code": "of another version", "command": "jog"},
        {"code": "not_tight"},
        {"code": "out_of_range", "command": "jog", "asked": {"a": 1}, "arguments": {"low": 0}},
        {"code": "out_of_range", "command": "jog", "asked": [], "arguments": RANGE},
        {"code": "not_in_state", "command": "jog", "arguments": {"state": "a", "allowed": [1]}},
        {"code": "not_tight", "command": "jog", "more": 1},
        {"code": "not_tight", "command": 1},
        {"code": "not_tight", "command": "jog", "asked": []},
        {"code": "not_tight", "command": "jog", "arguments": "none"},
        {"code": "not_calibrated", "command": "jog", "arguments": {"why": 1}},
        {"code": "not_in_state", "command": "jog", "arguments": {**STATE, "state": []}},
        {"code": "not_in_state", "command": "jog", "arguments": {**STATE, "allowed": "ready"}},
        {"code": "out_of_range", "command": "jog", "asked": {"a": "b"}, "arguments": RANGE},
        {"code": "out_of_range", "command": "jog", "arguments": {**RANGE, "low": "1"}},
        {"code": "out_of_range", "command": "jog", "arguments": {**RANGE, "index": -1}},
        {"code": "out_of_range", "command": "jog", "arguments": {**RANGE, "index": "1"}},
        {"code": "nothing_left", "command": "path", "arguments": {"left": "path"}},
        {"code": "bad_source", "command": "tighten", "arguments": {"why": "x", "allowed": None}},
    ],
)
def test_an_unknown_refusal_reads_as_none(value: Any) -> None:
    assert CommandRefusal.from_json(value) is None
