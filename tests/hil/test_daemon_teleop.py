"""`cdpr teleop` moves a simulated planar robot through a real daemon, also over bad networks."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from daemon_rig import RealDaemon, held_right
from hostile_proxy import hostile
from typer.testing import CliRunner
from waiting import until

from cdpr_profiles import load_robot
from cdpr_rt.core.states import LoopState
from cdpr_rt.motion.pose_stream import confirmation
from cdpr_rt.service.recording_reader import RecordingReader
from cdpr_tools.commands.teleop import app
from cdpr_tools.errors import BadInputError, CommandError
from cdpr_tools.teleop import session as session_module
from tests.slower_robot import PERIOD_S, slower_robot

PLATFORM = load_robot("planar-3").platform
RIGHT = b"\x1b[C"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("teleop")


@pytest.fixture(scope="module")
def daemon(folder: Path) -> Iterator[RealDaemon]:
    """Yield a daemon of the shipped robot with a cycle that leaves time for other processes."""
    options = ("--record", str(folder / "rec"))
    one = RealDaemon(folder, *options, robot=slower_robot(folder, "planar-3"))
    try:
        start_up(one)
        yield one
    finally:
        assert one.end() == 0, one.errors()


def start_up(daemon: RealDaemon) -> None:
    """Enable the drives and tighten the cables. Return when teleoperation may start."""
    wish: dict[str, Any] = {"client": "start-up"}
    # after a killed loop, only the test knows that the simulated platform is at home
    tighten = {"program": "tighten", "wanted": {"from": "home"}}
    with held_right(daemon, wish["client"]) as headers:
        for path, more in (("/enable", {}), ("/program", tighten)):
            answer = daemon.http.post(path, json={**wish, **more}, headers=headers)
            assert answer.status_code == 200, answer.text
        until(lambda: daemon.status()["program_progress"].get("tight"))


def port_of(daemon: RealDaemon) -> int:
    return int(daemon.status()["parts"]["stream"]["address"].rpartition(":")[2])


def place(daemon: RealDaemon) -> np.ndarray:
    """Return the position at which the platform will come to rest, x and y in m."""
    return np.array(daemon.status()["program_progress"]["target_m"])


def teleop(daemon: RealDaemon, *options: str | Path) -> list[str]:
    command = [sys.executable, "-m", "cdpr_tools.cli", "teleop", str(daemon.robot), *daemon.at]
    return [*command, *map(str, options)]


def play(daemon: RealDaemon, folder: Path, script: str, *options: str) -> dict[str, Any]:
    """Run teleoperation from a script to its end. Return the JSON output of the command."""
    path = folder / "script"
    path.write_text(script)
    given = ("--device", "script", "--script", path, *options, "--json")
    told = subprocess.run(
        teleop(daemon, *given), capture_output=True, text=True, timeout=60.0, check=False
    )
    assert told.returncode == 0, told.stderr
    figures: dict[str, Any] = json.loads(told.stdout.splitlines()[-1])
    return figures


def test_a_script_beyond_the_workspace_names_the_limit(daemon: RealDaemon, folder: Path) -> None:
    # from the stand, sideways below the box of targets: nothing moves
    path = folder / "aside"
    path.write_text("0 0 0\n0.5 0 0\n1 5 0\n1.5 5 0\n")
    command = teleop(daemon, "--device", "script", "--script", path)
    told = subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=False)
    assert told.returncode == 1
    assert "did not follow the hand: below the workspace" in told.stderr
    up = play(daemon, folder, "0 0 0\n0.5 0 0\n4 0 300\n4.5 0 300\n")
    assert up["held_back"] == ""
    down = play(daemon, folder, "0 0 0\n0.5 0 0\n6 0 -500\n6.5 0 -500\n")
    assert down["held_back"] == "at the edge of the workspace, y 1400 mm"
    play(daemon, folder, "0 0 0\n0.5 0 0\n3 0 100\n3.5 0 100\n")


@contextmanager
def at_the_keys(daemon: RealDaemon) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """Run teleoperation by keyboard. Yield the command and the other end of its terminal."""
    ours, its = pty.openpty()
    command = teleop(daemon, "--device", "keyboard", "--scale", "8:1")
    process = subprocess.Popen(command, stdin=its, stderr=subprocess.PIPE, text=True)
    os.close(its)
    try:
        until(lambda: daemon.status()["program"] == "pose")
        yield process, ours
    finally:
        process.kill()
        process.communicate()


def hold_key(terminal: int, key: bytes, seconds: float) -> None:
    """Send a key repeatedly, as a terminal does while it is held."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        os.write(terminal, key)
        time.sleep(0.03)


def test_a_script_moves_the_robot_through_a_bad_network(daemon: RealDaemon, folder: Path) -> None:
    begin = place(daemon)  # on the stand, below the workspace
    script = (
        # first up from the stand, where no sideways motion is possible. At rest when the clutch
        # opens and closes, because a lost set-point would report that too late.
        "0 0 0\n0.2 0 0\n1 0 30\n1.5 0 30\n2.2 40 30\n2.8 40 30 confirm\n3 40 30 clutch\n"
        "3.2 40 30 clutch\n3.4 0 0 clutch\n3.6 0 0\n3.8 0 0\n4.2 0 20 confirm"
    )
    with hostile(port_of(daemon), seed=3) as proxy:
        via = f"127.0.0.1:{proxy.port}"
        figures = play(daemon, folder, script, "--scale", "4:1", "--via", via)
        assert proxy.passed < 0.95 * proxy.came
    # the whole motion of the hand arrives despite losses
    np.testing.assert_allclose(place(daemon) - begin, [0.16, 0.12 + 0.08], atol=5e-4)
    assert figures["answered"] < 0.9 * figures["sent"]
    assert 1.0 < figures["round_trip_ms"]["p50"] < 1000.0
    first, second = figures["confirmations"]
    np.testing.assert_allclose(np.subtract(first["setpoint_m"], begin), [0.16, 0.12], atol=2e-2)
    assert [first["number"], second["number"]] == [1, 2]
    status = daemon.status()
    assert (status["state"], status["program"], status["control"]["held"]) == (
        "active", "hold", False
    )  # fmt: skip
    assert status["reason"] == ""  # it was commanded to hold before the right to move was released


def test_altered_set_points_do_not_move_the_robot(daemon: RealDaemon, folder: Path) -> None:
    begin = place(daemon)
    refused = daemon.status()["parts"]["stream"]["packets"]["tag"]
    with hostile(port_of(daemon), seed=8, altered=0.2) as proxy:
        via = f"127.0.0.1:{proxy.port}"
        play(daemon, folder, "0 0 0\n0.7 20 0\n1.5 -20 0\n2 0 0", "--scale", "2:1", "--via", via)
        assert proxy.spoilt > 5
    packets = daemon.status()["parts"]["stream"]["packets"]
    assert packets["tag"] > refused, "altered packets belong to no session"
    # each restart loses some of the motion of the hand, but does not add any
    assert np.all(np.abs(place(daemon) - begin) <= [0.085, 5e-4])
    assert daemon.status()["state"] == "active"


def test_keys_move_the_robot_until_the_terminal_closes(daemon: RealDaemon) -> None:
    begin = place(daemon)
    with at_the_keys(daemon) as (process, terminal):
        until(lambda: hold_key(terminal, RIGHT, 0.3) or place(daemon)[0] - begin[0] > 0.02)
        os.close(terminal)  # in motion
        assert process.wait(timeout=60.0) == 1
        assert process.stderr is not None
        assert "the terminal was closed" in process.stderr.read()
    assert daemon.status()["program"] == "hold"
    assert abs(place(daemon)[1] - begin[1]) < 3e-3
    rest = place(daemon)
    time.sleep(0.3)
    np.testing.assert_allclose(place(daemon), rest, atol=2e-3)


def test_the_robot_brakes_when_teleop_is_killed_in_motion(daemon: RealDaemon) -> None:
    begin = place(daemon)
    with at_the_keys(daemon) as (process, terminal):
        until(lambda: hold_key(terminal, b"a", 0.3) or begin[0] - place(daemon)[0] > 0.02)
        process.send_signal(signal.SIGKILL)
        killed = place(daemon)
        until(lambda: daemon.status()["program"] == "hold")
        assert "nobody holds the right to move" in daemon.status()["reason"]
        os.close(terminal)
    assert daemon.status()["state"] == "active"
    assert np.linalg.norm(place(daemon) - killed) < 0.1


def test_impossible_teleoperation_is_reported(
    daemon: RealDaemon, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_module, "_GREET_S", 0.5)
    script = folder / "still"
    script.write_text("0 0 0")
    plays = ("--device", "script", "--script", str(script))
    for options, status, told in (
        (("--device", "gamepad"), 2, "--device gamepad: no gamepad has all"),
        ((*plays, "--scale", "1000:1"), 2, "--scale 1000:1: allowed: 0.001 to 100"),
        (("--device", "script"), 2, "--script: required with --device script"),
        (
            ("--turn-axes", "rx,ry,rz"),
            2,
            "--turn-axes rx,ry,rz: allowed only with --device gamepad",
        ),
        ((*plays, "--axes", "ABS_X"), 2, "--axes ABS_X: allowed only with --device gamepad"),
        ((*plays, "--via", "nowhere"), 2, "--via nowhere: allowed: HOST:PORT"),
        ((*plays, "--via", "a..b:7710"), 2, "set-points to a..b:7710: is not a host name"),
        ((*plays, "--via", "127.0.0.1:9"), 1, "the robot has not answered for 0.5 s"),
    ):
        error = CliRunner().invoke(app, [str(daemon.robot), *daemon.at, *options]).exception
        assert isinstance(error, CommandError), error
        assert (error.exit_status, told in str(error)) == (status, True), error
    other = CliRunner().invoke(app, ["spatial", *daemon.at]).exception
    assert isinstance(other, BadInputError) and "runs planar" in str(other)
    assert daemon.status()["program"] == "hold"


def test_the_recording_has_no_steps_and_shows_each_confirmation(
    daemon: RealDaemon, folder: Path
) -> None:
    """This test is last because it ends the daemon, to read the recording of all others."""
    described = daemon.http.get("/description").json()["programs"]
    followed = described.index("pose")
    daemon.end()
    held = described.index("hold")
    wanted = ("pose_setpoint", "state", "program", "stream_buttons")
    rows: dict[str, list[Any]] = {name: [] for name in wanted}
    for path in sorted((folder / "rec").glob("*.mcap")):
        for columns in RecordingReader(path).cycles(wanted):
            for name in wanted:
                rows[name].append(columns[name])
    pose, state, program, buttons = (np.concatenate(rows[name]) for name in wanted)
    assert PLATFORM is not None
    xy = pose[:, :2]
    speed = np.diff(xy, axis=0) / PERIOD_S
    change = np.diff(speed, axis=0)
    # the following program brakes the motion that the hand started
    begun, ended = np.flatnonzero(program == followed)[[0, -1]]
    known = np.isfinite(xy).all(axis=1) & (state == LoopState.ACTIVE)
    known &= (program == followed) | (program == held)
    known[: begun - 1] = False
    known[ended + round(1.0 / PERIOD_S) :] = False
    led = known[2:] & known[1:-1] & known[:-2]
    assert (program == followed).sum() > 1000
    assert np.any((program[:-1] == followed) & (program[1:] == held) & (speed[:, 0] != 0.0))
    assert np.abs(speed[1:][led]).max() > 0.1
    assert np.abs(speed[1:][led]).max() <= 1.001 * PLATFORM.speed_m_s
    assert np.abs(change[led]).max() <= 1.001 * PLATFORM.acceleration_m_s2 * PERIOD_S
    numbers = confirmation(buttons.astype(np.int64))
    new = numbers[1:][np.diff(numbers) != 0]
    assert new[new > 0].tolist() == [1, 2]
