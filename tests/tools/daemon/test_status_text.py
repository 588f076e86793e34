"""A daemon's status for people: what does not work is said."""

from __future__ import annotations

from typing import Any

from cdpr_tools.client.status_text import compensation_text, status_text


def test_a_part_that_does_not_work_is_told_by_its_option() -> None:
    status: dict[str, Any] = {
        "robot": "bench",
        "state": "ready",
        "program": None,
        "read_only": False,
        "lockstep": False,
        "reason": "",
        "notices": [],
        "axes": [],
        "cycle": None,
        "control": {"held": False},
        "loop": {"silent_s": 0.0},
        "parts": {"live_view": {"error": "the live view ended: why"}, "stream": {"error": ""}},
    }
    lines = [str(line) for line in status_text(status).renderables]
    assert "--live does not work: the live view ended: why" in lines
    assert not any("--stream" in line for line in lines)


def test_the_status_tells_which_motors_are_compensated() -> None:
    axes = [
        {"name": "left", "commissioned": "a", "index_known": True},
        {"name": "right", "commissioned": "b", "index_known": False},
        {"name": "lower", "commissioned": None, "index_known": True},
    ]
    told = compensation_text(axes)
    assert told == (
        "compensated: left; not compensated before its index passes: right; not commissioned: lower"
    )
    assert compensation_text([{"name": "left"}]) == ""
