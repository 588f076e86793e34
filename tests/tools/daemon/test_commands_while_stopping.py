"""Commands to a robot that is stopping, has stopped or has failed report no false success."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cdpr_rt.refusal import CommandRefusal, RefusalCode
from cdpr_rt.service.link import ENDED
from cdpr_tools.client import daemon_end
from cdpr_tools.client.motion import carry_out
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.commands import daemon_state, with_daemon
from cdpr_tools.daemon.loop_file import LoopFile, started
from cdpr_tools.errors import NoDaemonError, ServiceRefusalError, WorkFailedError
from cdpr_tools.output import Output

LOOP = """
import signal, sys, time
signal.signal(signal.SIGUSR1, lambda *_: None)
print("named", flush=True)
time.sleep(2)
"""
ACTIVE = {
    "state": "active", "program": "lower", "reason": "", "axes": [], "notices": [],
    "read_only": False,
}  # fmt: skip


class Daemon:
    """A stand-in whose status depends on the number of stop requests. None: no answer."""

    def __init__(
        self,
        status: Callable[[int], dict[str, Any] | None],
        where: str | Path = "/nowhere/control.sock",
        refusal: Exception | None = None,
    ) -> None:
        self.status, self.where, self.refusal, self.asked = status, str(where), refusal, 0

    def get(self, _path: str) -> dict[str, Any]:
        told = self.status(self.asked)
        if told is None:
            raise NoDaemonError("nobody is there")
        return {**ACTIVE, **told}

    def post(self, _path: str) -> None:
        self.asked += 1
        if self.refusal is not None:
            raise self.refusal


def ends(alive: bool, **status: str) -> Callable[[int], dict[str, Any] | None]:
    """Return the status of a daemon that ends on request, whose drive is `alive` or not."""
    told = {"axes": [{"name": "top", "alive": alive}], **status}
    return lambda asked: None if asked else told


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Return a function that runs a command with a daemon and returns the result."""

    def invoke(daemon: Daemon, *words: str) -> Any:
        @contextmanager
        def opened(*_where: Any) -> Iterator[Daemon]:
            yield daemon

        for module in (with_daemon, daemon_state):
            monkeypatch.setattr(module, "open_daemon", opened)
        app = typer.Typer()
        app.add_typer(daemon_state.app)
        return CliRunner().invoke(app, words)

    return invoke


Run = Callable[..., Any]


@pytest.mark.parametrize("command", ["ack", "enable"])
def test_commands_during_a_reaction_report_its_reason(run: Run, command: str) -> None:
    stopping = {"reacting": "controlled stop", "reason": "left: angle jumped"}
    error = run(Daemon(lambda _: stopping), command).exception
    assert isinstance(error, WorkFailedError)
    assert "the robot is stopping (controlled stop): left: angle jumped" in str(error)


def refusing(state: str) -> Daemon:
    states = {"state": state, "allowed": ["ready", "active"]}
    refusal = CommandRefusal(RefusalCode.NOT_IN_STATE, "disable", arguments=states)
    status = {"state": state, "reason": "cable 2 broke"}
    return Daemon(lambda _: status, refusal=DaemonRefusalError.of(refusal))


def test_disable_in_fault_succeeds_and_mentions_ack(run: Run) -> None:
    result = run(refusing("fault"), "disable", "--json")
    assert result.exit_code == 0, result.exception
    told = json.loads(result.stdout.splitlines()[-1])
    assert told == {"ok": True, "state": "fault", "text": "cable 2 broke"}
    assert "cdpr ack" in result.output


def test_disable_without_booted_drives_is_an_error(run: Run) -> None:
    assert isinstance(run(refusing("unconfigured"), "disable").exception, DaemonRefusalError)


DIED = "the loop has died: killed by signal 9"


@pytest.mark.parametrize(
    ("status", "exit_status", "told"),
    [
        (ends(True), 0, "stopped, power off"),
        (ends(False), 1, "stopped; these drives do not answer and may have power: top"),
        (ends(True, state="dead", reason=DIED), 1, "ended; its loop had died: "),
    ],
)
def test_exit_status_of_stop_shows_whether_power_is_known_to_be_off(
    run: Run, status: Callable[[int], dict[str, Any] | None], exit_status: int, told: str
) -> None:
    ended = run(Daemon(status), "stop")
    error = ended.exception
    found = error.exit_status if isinstance(error, WorkFailedError) else ended.exit_code
    assert found == exit_status
    assert told in (str(error) if error else ended.output)


def test_stop_does_not_claim_that_a_silent_remote_daemon_has_ended(run: Run) -> None:
    for asked in (0, 1):  # also if there was no answer from the beginning
        daemon = Daemon(ends(True))
        daemon.asked = asked
        ended = run(daemon, "stop", "--url", "http://elsewhere:8000")
        assert isinstance(ended.exception, WorkFailedError)
        assert ("not known whether it has" in str(ended.exception)) is not bool(asked)
        assert not ended.stdout


@pytest.mark.parametrize("takes", [True, False])
def test_stop_waits_for_a_loop_without_service(run: Run, tmp_path: Path, takes: bool) -> None:
    with subprocess.Popen([sys.executable, "-c", LOOP], stdout=subprocess.PIPE) as loop:
        assert loop.stdout is not None
        loop.stdout.readline()
        named = LoopFile(
            robot="r", uid=os.geteuid(), pid=loop.pid, started=started(loop.pid), block_fd=0,
            drives_stop_s=0.1,
        )  # fmt: skip
        named.write(tmp_path / "control.loop")
        reaping = threading.Thread(target=loop.wait)
        reaping.start()
        silent = None if takes else NoDaemonError("timed out")
        try:
            ended = run(Daemon(ends(True), tmp_path / "control.sock", silent), "stop")
            assert not (takes and named.runs())
        finally:
            loop.kill()
            reaping.join()
    assert ended.exit_code == 0, ended.exception
    told = "stopped, power off" if takes else "its loop was stopped under control"
    assert told in ended.output


def test_stop_does_not_wait_for_a_loop_that_dies_while_ending(run: Run) -> None:
    def dies(asked: int) -> dict[str, Any] | None:
        axes = [{"name": "top", "alive": False}]
        state = ("fault", "dead", None)[asked]
        return None if state is None else {"state": state, "reason": "it died", "axes": axes}

    error = run(Daemon(dies), "stop").exception
    assert isinstance(error, WorkFailedError)
    assert str(error) == "stopped; these drives do not answer and may have power: top; it died"


def test_a_loop_that_ends_before_its_service_is_a_successful_stop(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    states = iter(["active", "active", "dead", "dead"])

    def ends_before_its_service(_asked: int) -> dict[str, Any] | None:
        if (state := next(states, "")) == "":
            return None
        axes = [{"name": "top", "alive": state != "dead"}]
        return {"state": state, "reason": ENDED if state == "dead" else "", "axes": axes}

    monkeypatch.setattr(daemon_end, "_WATCH_S", 0.0)
    daemon = Daemon(ends_before_its_service)
    ended = run(daemon, "stop")
    assert (ended.exit_code, daemon.asked) == (0, 1), ended.exception
    assert ended.output.splitlines()[-1] == "stopped, power off"


class UnheldDaemon:
    """A stand-in for a daemon whose service rejects holds. A real one always accepts them."""

    where = "nowhere"

    def get(self, path: str) -> dict[str, Any]:
        if path == "/description":
            return {"robot": "bench", "axes": [{"name": "left"}], "platform": None, "programs": []}
        return {
            **ACTIVE,
            "program": "jog",
            "lockstep": False,
            "reacting": "none",
            "cycle": {"time_s": 1.0},
            "loop": {"silent_s": 0.0},
            "parts": {},
            "program_progress": {},
        }

    def post(self, path: str, *_: Any) -> dict[str, Any]:
        if path == "/hold":
            raise ServiceRefusalError("the service is busy")
        return {"token": "mine"}

    def renew(self, token: str) -> None:
        pass

    def release(self, token: str) -> None:
        pass


def test_a_motion_that_cannot_be_held_at_its_end_is_not_reported_as_held() -> None:
    with pytest.raises(WorkFailedError, match="could not be stopped: the service is busy"):
        carry_out(
            UnheldDaemon(),  # type: ignore[arg-type]
            Output(True),
            lambda robot: robot.run("jog", velocity_rad_s=[1.0]),
            seconds=0.0,
        )
