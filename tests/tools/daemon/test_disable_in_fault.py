"""`cdpr disable` of a robot that a fault has stopped already: no error, and what comes next."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cdpr_rt.refusal import CommandRefusal, RefusalCode
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.commands.daemon import daemon_state, with_daemon


class Refuses:
    """A daemon whose loop refuses to disable in a state."""

    def __init__(self, state: str) -> None:
        self.state = state

    def get(self, _path: str) -> dict[str, Any]:
        return {"state": self.state, "reason": "cable 2 broke"}

    def post(self, _path: str) -> dict[str, Any]:
        states = {"state": self.state, "allowed": ["ready", "active"]}
        raise DaemonRefusalError.of(
            CommandRefusal(RefusalCode.NOT_IN_STATE, "disable", arguments=states)
        )


def disabled(monkeypatch: pytest.MonkeyPatch, state: str) -> Any:
    @contextmanager
    def opened(*_where: Any) -> Iterator[Refuses]:
        yield Refuses(state)

    monkeypatch.setattr(with_daemon, "open_daemon", opened)
    app = typer.Typer()
    app.add_typer(daemon_state.app)
    return CliRunner().invoke(app, ["disable", "--json"])


def test_in_fault_there_is_nothing_to_disable(monkeypatch: pytest.MonkeyPatch) -> None:
    result = disabled(monkeypatch, "fault")
    assert result.exit_code == 0, result.exception
    told = json.loads(result.stdout.splitlines()[-1])
    assert told == {"ok": True, "state": "fault", "text": "cable 2 broke"}
    assert "cdpr ack" in result.output


def test_where_no_drive_has_booted_it_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    result = disabled(monkeypatch, "unconfigured")
    assert isinstance(result.exception, DaemonRefusalError)
