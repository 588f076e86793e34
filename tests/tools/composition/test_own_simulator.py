"""A simulator of a command's own: what is done while it starts."""

from __future__ import annotations

from typing_extensions import override

from cdpr_tools.composition.simulator import OwnSimulator
from tests.tools.robot_rig import unique


def test_work_is_done_while_it_starts_and_not_after() -> None:
    done: list[str] = []

    class Noted(OwnSimulator):
        @override
        def _await_ready(self) -> str:
            assert self.process.poll() is None
            done.append("waiting")
            return super()._await_ready()

    bus = f"simbus:{unique()}"
    Noted("winch-mpp0923d", bus, meanwhile=lambda: done.append("work")).stop()
    assert done == ["work", "waiting"]
