"""A script does not wait for a loop that hangs."""

from __future__ import annotations

from typing import Any, cast

import pytest

import cdpr_rt as cdpr
from cdpr_tools.client.client import Daemon
from cdpr_tools.client.daemon_robot import commanded


class HangingDaemon:
    """Answers as the service of a loop whose controller does not return."""

    def get(self, path: str) -> dict[str, Any]:
        if path == "/description":
            return {"robot": "hanging", "axes": [{"name": "left"}]}
        return {
            "state": "active", "lockstep": False, "parts": {}, "reacting": "none",
            "loop": {"silent_s": 60.0}, "cycle": {"time_s": 3.0},
        }  # fmt: skip


def test_a_script_does_not_wait_for_a_controller_that_never_returns() -> None:
    with commanded(cast(Daemon, HangingDaemon())) as robot:
        assert robot.state == "active"
        with pytest.raises(cdpr.Error, match="run no cycle for 10 s: does a controller"):
            robot.wait(0.2)
