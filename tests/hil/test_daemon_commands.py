"""A real daemon is controlled by commands on a terminal."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from daemon_lab import KEY, angles, running, setpoints, with_key, with_power
from daemon_rig import NAME, RealDaemon
from waiting import until

from cdpr_tools.cli import main


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    """A daemon that stands still and answers requests, with a slow cycle."""
    folder = tmp_path_factory.mktemp("daemon")
    with running(folder, *with_key(folder), period_s=0.01) as one:
        yield one


@pytest.fixture(scope="module")
def quick_daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    """A daemon that moves, with a cycle fast enough for a stiff position loop."""
    with running(tmp_path_factory.mktemp("quick"), period_s=0.002) as one:
        yield one


@pytest.fixture
def url(daemon: RealDaemon) -> str:
    # a restarted service has a different port
    return f"http://{daemon.status()['parts']['service']['http']}"


@pytest.fixture
def active(daemon: RealDaemon) -> Iterator[RealDaemon]:
    with with_power(daemon) as one:
        yield one


@pytest.fixture
def quick(quick_daemon: RealDaemon) -> Iterator[RealDaemon]:
    with with_power(quick_daemon) as one:
        yield one


class Terminal:
    """Run commands of `cdpr` in this process and return output and exit status."""

    def __init__(self, capsys: pytest.CaptureFixture[str], monkeypatch: Any) -> None:
        self._capsys = capsys
        self._monkeypatch = monkeypatch

    def run(self, *arguments: str) -> tuple[int, str, str]:
        self._monkeypatch.setattr(sys, "argv", ["cdpr", *arguments])
        self._capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *self._capsys.readouterr()

    def told(self, *arguments: str) -> dict[str, Any]:
        status, out, err = self.run(*arguments, "--json")
        assert status == 0, err
        answer: dict[str, Any] = json.loads(out.splitlines()[-1])
        return answer


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Terminal:
    return Terminal(capsys, monkeypatch)


def test_a_move_ends_at_its_target(quick: RealDaemon, terminal: Terminal) -> None:
    result = terminal.told("move", "left=20", "right=-15", "--speed", "200", *quick.at)
    assert result["arrived"] is True
    assert setpoints(quick) == pytest.approx([20.0, -15.0], abs=0.1)
    found = [math.degrees(result["position_rad"][name]) for name in ("left", "right")]
    assert found == pytest.approx([20.0, -15.0], abs=10.0)
    terminal.told("move", "right=5", "--relative", *quick.at)
    assert setpoints(quick) == pytest.approx([20.0, -10.0], abs=0.1)


def test_a_jog_has_the_requested_speed_and_duration(quick: RealDaemon, terminal: Terminal) -> None:
    start = setpoints(quick)
    result = terminal.told("jog", "left=40", "--seconds", "1", *quick.at)
    assert result["program"] == "hold"
    turned = [now - then for now, then in zip(setpoints(quick), start, strict=True)]
    assert turned == pytest.approx([40.0, 0.0], abs=0.1)
    assert abs(angles(quick)[0] - setpoints(quick)[0]) < 15.0  # with this slow cycle


def test_the_axis_stops_after_a_jogging_client_was_killed(quick: RealDaemon) -> None:
    words = ("jog", "left=60", "--seconds", "60", *quick.at)
    client = subprocess.Popen([sys.executable, "-m", "cdpr_tools.cli", *words])
    until(lambda: quick.status()["program"] == "jog")
    until(lambda: quick.status()["axes"][0]["velocity_rad_s"] > 0.5)
    assert quick.status()["control"]["client"]
    client.kill()
    client.wait()
    until(lambda: quick.status()["program"] == "hold")
    until(lambda: abs(quick.status()["axes"][0]["velocity_rad_s"]) < 0.1)
    assert "nobody holds the right to move" in quick.status()["reason"]


def test_a_controller_runs_to_its_end_and_then_holds(quick: RealDaemon, terminal: Terminal) -> None:
    sweep = ("sweep", "distance_rad=[0.2, 0.2]", "speed_rad_s=0.4", "legs=2")
    result = terminal.told("controller", *sweep, *quick.at)
    assert (result["state"], result["program"]) == ("active", "hold")


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (
            ("jog", "middle=3"),
            2,
            "middle=3: allowed: AXIS=deg/s of 'left', 'right', such as left=20",
        ),
        (("jog", "left=fast"), 2, "'fast' is not a number of deg/s"),
        (("move", "left=1e9"), 2, "left=1e+09: allowed: -573000 to 573000 deg"),
        (("controller", "waltz"), 1, "program: 'waltz'; allowed: idle, hold"),
        (("controller", "sweep", "legs=[1"), 2, "legs: is not valid JSON"),
    ],
)
def test_an_impossible_command_prints_one_line(
    active: RealDaemon, terminal: Terminal, arguments: tuple[str, ...], status: int, said: str
) -> None:
    ended, _, err = terminal.run(*arguments, *active.at)
    assert ended == status
    assert said in err
    assert err.count("\n") == 1


def test_status_prints_text_or_json(active: RealDaemon, terminal: Terminal) -> None:
    _, shown, _ = terminal.run("status", *active.at)
    assert shown.startswith(f"{NAME}: active, program hold")
    for axis in ("left", "right"):
        assert f"\n{axis} " in shown
    assert terminal.told("status", *active.at)["axes"][1]["name"] == "right"


def test_acknowledging_without_a_fault_succeeds(active: RealDaemon, terminal: Terminal) -> None:
    assert terminal.told("ack", *active.at)["state"] == "active"


def test_disable_and_enable_are_idempotent(active: RealDaemon, terminal: Terminal) -> None:
    for _ in range(2):
        assert terminal.told("disable", *active.at)["state"] == "ready"
    for _ in range(2):
        assert terminal.told("enable", *active.at)["state"] == "active"


def handles_sigterm(pid: int) -> bool:
    status = Path(f"/proc/{pid}/status").read_text()
    caught = int(status.partition("SigCgt:")[2].split()[0], 16)
    return bool(caught >> (signal.SIGTERM - 1) & 1)


def test_status_follow_runs_until_ctrl_c(active: RealDaemon) -> None:
    command = [sys.executable, "-m", "cdpr_tools.cli", "status", "--watch", "--json", *active.at]
    watching = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until(lambda: handles_sigterm(watching.pid))
    time.sleep(0.5)
    assert watching.poll() is None
    watching.send_signal(signal.SIGINT)
    out, err = watching.communicate(timeout=60.0)
    assert watching.returncode == 0, err
    assert json.loads(out.splitlines()[-1])["state"] == "active"


def test_commands_over_tcp_need_the_key(
    active: RealDaemon, url: str, terminal: Terminal, tmp_path: Path
) -> None:
    key_file = tmp_path / "key"
    key_file.write_text(KEY)
    key_file.chmod(0o600)
    assert terminal.told("hold", "--url", url, "--key-file", str(key_file))["state"] == "active"
    for option in ((), ("--key-file", str(wrong_key(tmp_path)))):
        status, _, err = terminal.run("hold", "--url", url, *option)
        assert (status, "Bearer KEY" in err) == (2, True)
    assert terminal.told("status", "--url", url)["state"] == "active"
    key_file.chmod(0o644)
    status, _, err = terminal.run("hold", "--url", url, "--key-file", str(key_file))
    assert (status, "others may read it" in err) == (2, True)


def wrong_key(folder: Path) -> Path:
    path = folder / "wrong"
    path.write_text("the key of another robot")
    path.chmod(0o600)
    return path
