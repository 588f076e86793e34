"""Commands that come while a robot is being stopped, or end one badly: no success is told."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cdpr_rt.service.link import ENDED
from cdpr_tools.client.client import NoDaemonError
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


class Ends:
    """A daemon that ends once it is asked to; its drive of this axis is heard, or not."""

    def __init__(self, alive: bool) -> None:
        self.alive, self.asked = alive, False

    def get(self, _path: str) -> dict[str, Any]:
        if self.asked:
            raise NoDaemonError("nobody is there")
        axes = [{"name": "top", "alive": self.alive}]
        return {**ACTIVE, "reason": "", "axes": axes, "read_only": False}

    def post(self, _path: str) -> None:
        self.asked = True


def stopped(monkeypatch: pytest.MonkeyPatch, daemon: Ends) -> Any:
    @contextmanager
    def opened(*_where: Any) -> Iterator[Ends]:
        yield daemon

    monkeypatch.setattr(daemon_state, "open_daemon", opened)
    app = typer.Typer()
    app.add_typer(daemon_state.app)
    return CliRunner().invoke(app, ["stop"])


@pytest.mark.parametrize(
    ("alive", "status", "told"),
    [
        (True, 0, "stopped, power off"),
        (False, 1, "stopped; unheard, and not known to be without power: top"),
    ],
)
def test_a_script_learns_that_a_drive_was_not_heard(
    monkeypatch: pytest.MonkeyPatch, alive: bool, status: int, told: str
) -> None:
    ended = stopped(monkeypatch, Ends(alive))
    error = ended.exception
    assert (error.exit_status if isinstance(error, WorkFailedError) else ended.exit_code) == status
    assert told in (str(error) if error else ended.output)


class Dies:
    """A daemon whose loop ends with an error once it is asked to end; asked again, all ends."""

    def __init__(self) -> None:
        self.asked = 0

    def get(self, _path: str) -> dict[str, Any]:
        if self.asked > 1:
            raise NoDaemonError("nobody is there")
        axes = [{"name": "top", "alive": False}]
        state = ("fault", "dead")[self.asked]
        return {**ACTIVE, "state": state, "reason": "it died", "axes": axes, "read_only": False}

    def post(self, _path: str) -> None:
        self.asked += 1


def test_a_loop_that_dies_while_it_ends_keeps_nobody_waiting(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    @contextmanager
    def opened(*_where: Any) -> Iterator[Dies]:
        yield Dies()

    monkeypatch.setattr(daemon_state, "open_daemon", opened)
    app = typer.Typer()
    app.add_typer(daemon_state.app)
    error = CliRunner().invoke(app, ["stop"]).exception
    assert isinstance(error, WorkFailedError)
    assert str(error) == "stopped; unheard, and not known to be without power: top; it died"


class EndsLoopFirst:
    """A daemon whose loop ends as asked, a while before the service that is asked does."""

    def __init__(self) -> None:
        self.states = iter(["active", "active", "dead", "dead"])
        self.asked = 0

    def get(self, _path: str) -> dict[str, Any]:
        if (state := next(self.states, "")) == "":
            raise NoDaemonError("nobody is there")
        axes = [{"name": "top", "alive": state != "dead"}]
        reason = ENDED if state == "dead" else ""
        return {**ACTIVE, "state": state, "reason": reason, "axes": axes, "read_only": False}

    def post(self, _path: str) -> None:
        self.asked += 1


def test_a_loop_that_is_seen_to_have_ended_as_asked_is_no_failure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    daemon = EndsLoopFirst()

    @contextmanager
    def opened(*_where: Any) -> Iterator[EndsLoopFirst]:
        yield daemon

    monkeypatch.setattr(daemon_state, "open_daemon", opened)
    monkeypatch.setattr(daemon_state, "_WATCH_S", 0.0)
    app = typer.Typer()
    app.add_typer(daemon_state.app)
    ended = CliRunner().invoke(app, ["stop"])
    assert (ended.exit_code, daemon.asked) == (0, 1), ended.exception
    assert ended.output.splitlines()[-1] == "stopped, power off"


class DiedBefore(Ends):
    """A daemon whose loop has died a while ago."""

    def get(self, path: str) -> dict[str, Any]:
        died = {"state": "dead", "reason": "the loop has died: killed by signal 9"}
        return {**super().get(path), **died}


def test_a_script_learns_that_the_loop_had_died(monkeypatch: pytest.MonkeyPatch) -> None:
    error = stopped(monkeypatch, DiedBefore(True)).exception
    assert isinstance(error, WorkFailedError)
    assert error.exit_status == 1
    assert str(error).startswith("ended; its loop had died: ")
