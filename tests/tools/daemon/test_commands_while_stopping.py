"""`cdpr ack` and `cdpr enable` while a fault's reaction is under way: no success is told."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cdpr_tools.commands.daemon import daemon_state, with_daemon
from cdpr_tools.errors import WorkFailedError

ACTIVE = {"state": "active", "program": "lower", "reason": "", "axes": [], "notices": []}


class Answers:
    """A daemon whose status this is, and which takes no command."""

    def __init__(self, status: dict[str, Any]) -> None:
        self.status = status

    def get(self, _path: str) -> dict[str, Any]:
        return self.status


def done(monkeypatch: pytest.MonkeyPatch, command: str, **status: str) -> Any:
    @contextmanager
    def opened(*_where: Any) -> Iterator[Answers]:
        yield Answers({**ACTIVE, **status})

    monkeypatch.setattr(with_daemon, "open_daemon", opened)
    app = typer.Typer()
    app.add_typer(daemon_state.app)
    return CliRunner().invoke(app, [command])


@pytest.mark.parametrize("command", ["ack", "enable"])
def test_while_a_robot_is_being_stopped_it_is_told_why(
    monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    stopping = {"reacting": "controlled stop", "reason": "left: angle jumped"}
    error = done(monkeypatch, command, **stopping).exception
    assert isinstance(error, WorkFailedError)
    assert "controlled stop under way: left: angle jumped" in str(error)
    assert done(monkeypatch, command).exit_code == 0
