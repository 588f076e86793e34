"""The Python interface to a daemon: right to move, faults, dying scripts, and the end."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from threading import Timer

import numpy as np
import pytest
from daemon_rig import PATIENCE_S, RealDaemon, alive, write_robot
from waiting import until

import cdpr_rt as cdpr
from cdpr_rt.arrays import FloatArray
from cdpr_rt.loop.stop_socket import STOP_SUFFIX, send_stop
from cdpr_tools.client.client import open_daemon
from cdpr_tools.client.daemon_robot import commanded
from cdpr_tools.daemon.loop_file import LoopFile, launcher_pid
from cdpr_tools.daemon.paths import find_launcher_files, find_sockets


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    folder = tmp_path_factory.mktemp("daemon")
    one = RealDaemon(folder, "--record", str(folder / "recordings"))
    yield one
    assert one.end() == 0, one.errors()


@pytest.fixture
def robot(daemon: RealDaemon) -> Iterator[cdpr.Robot]:
    with cdpr.connect(socket=daemon.socket) as connected:
        connected.enable()
        yield connected


def setpoints(robot: cdpr.Robot) -> FloatArray:
    """Return the set-points of the motors, which friction keeps this robot from reaching."""
    return np.array([axis["setpoint_rad"] for axis in robot.status["axes"]])


def test_a_script_moves_the_robot_of_a_daemon_and_reads_its_recording(robot: cdpr.Robot) -> None:
    robot.turn_by(
        [0.1, 0.1]
    )  # in the first cycle with power, set-points equal the encoder positions
    begun = setpoints(robot)
    robot.turn_by([0.5, -0.25])
    assert setpoints(robot) - begun == pytest.approx([0.5, -0.25])
    log = robot.log()
    assert log["setpoint_rad"][-1] - begun == pytest.approx([0.5, -0.25])
    assert np.diff(log["cycle"]).max() == 1
    assert log["time_s"][-1] <= robot.time_s


def test_a_second_script_is_rejected_while_the_first_has_the_right_to_move(
    robot: cdpr.Robot, daemon: RealDaemon
) -> None:
    robot.turn_by([0.1, 0.1])
    with cdpr.connect(socket=daemon.socket) as second:
        assert second.state == "active"
        with pytest.raises(cdpr.Refused, match="holds the right to move"):
            second.turn_by([0.1, 0.1])
        robot.close()
        second.turn_by([0.1, 0.1])


def test_a_path_file_that_is_not_text_is_rejected(robot: cdpr.Robot, tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(cdpr.Refused, match=r"points\.csv: is not UTF-8 text"):
        robot.follow(file)


def test_ctrl_c_in_a_command_that_only_watches_leaves_the_power_on(
    robot: cdpr.Robot, daemon: RealDaemon
) -> None:
    with (
        open_daemon(None, daemon.socket, None, None) as opened,
        pytest.raises(KeyboardInterrupt),
        commanded(opened) as watching,
    ):
        Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        watching.wait(PATIENCE_S)
    assert robot.state == "active"


def test_a_hold_by_another_client_ends_the_motion(robot: cdpr.Robot, daemon: RealDaemon) -> None:
    with cdpr.connect(socket=daemon.socket) as second:
        Timer(0.5, second.hold).start()
        with pytest.raises(cdpr.MotionEnded, match="pid was ended"):
            robot.turn_by([0.5, 0.0], speed_rad_s=0.02)
    assert (robot.state, robot.program) == ("active", "hold")


def test_an_enable_whose_body_comes_after_a_stop_gives_no_power(daemon: RealDaemon) -> None:
    with cdpr.connect(socket=daemon.socket) as robot:
        robot.disable()
    stop, body = daemon.socket.with_suffix(STOP_SUFFIX), b'{"program": "hold"}'
    for accepted in (False, True):
        with (
            open_daemon(None, daemon.socket, None, None) as client,
            socket.socket(socket.AF_UNIX) as slow,
        ):
            token = client.post("/control", {"client": "slow", "ttl_s": 10.0})["token"]
            slow.settimeout(PATIENCE_S)
            slow.connect(str(daemon.socket))
            head = f"""POST /enable HTTP/1.1\r\nHost: robot\r\nX-Control-Token: {token}\r
Content-Type: application/json\r\nContent-Length: {len(body)}\r\nConnection: close\r\n\r\n"""
            slow.sendall(head.encode() + body[:-1])
            client.get("/status")  # answered after the head of the enable was read
            if not accepted:
                assert send_stop(stop, "disable", "fast", PATIENCE_S)
            slow.sendall(body[-1:])
            answer = b"".join(iter(lambda: slow.recv(65536), b""))
            client.release(token)
        assert (b"200 OK" in answer) is accepted, answer
        assert (b"cancelled by a later stop" in answer) is not accepted
        assert daemon.status()["state"] == ("active" if accepted else "ready")


@pytest.mark.long
def test_a_connected_script_ends_the_daemon_and_waits_for_it(tmp_path: Path) -> None:
    daemon = RealDaemon(tmp_path, "--no-record")
    try:
        robot = cdpr.connect(socket=daemon.socket)
        robot.enable()
        robot.shut_down()
        with pytest.raises(cdpr.NotRunning):
            cdpr.connect(socket=daemon.socket)
        assert daemon.process.wait(PATIENCE_S) == 0
    finally:
        daemon.end()


@pytest.mark.long
def test_a_daemon_ends_when_the_script_that_started_it_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    script = (
        "import sys, cdpr_rt as cdpr\n"
        "robot = cdpr.run(sys.argv[1], bus='simbus:', record=sys.argv[2])\n"
        "robot.enable()\n"
        "print('active', flush=True)\n"
        "robot.wait(100.0)\n"
    )
    command = [sys.executable, "-c", script, str(write_robot(tmp_path)), str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as dying:
        assert dying.stdout is not None
        assert dying.stdout.readline() == "active\n"
        (launcher,) = map(launcher_pid, find_launcher_files())
        dying.kill()
    assert launcher is not None
    until(lambda: not alive(launcher))
    assert not find_sockets()


@pytest.mark.long
def test_closing_a_daemon_whose_loop_died_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    robot = cdpr.run(write_robot(tmp_path), bus="simbus:", record=tmp_path)
    robot.enable()
    os.kill(LoopFile.read(LoopFile.beside(find_sockets()[0])).pid, signal.SIGKILL)
    with pytest.raises(cdpr.Error, match="the loop has died"):
        robot.close()
    assert not find_sockets()


def test_a_dropped_handle_releases_the_right_to_move(daemon: RealDaemon) -> None:
    robot = cdpr.connect(socket=daemon.socket)
    robot.enable()
    robot.turn_by([0.05, 0.05])
    assert daemon.status()["control"]["held"]
    del robot
    until(lambda: not daemon.status()["control"]["held"], 15.0)


def test_real_drives_are_not_started_without_consent(tmp_path: Path) -> None:
    robot = write_robot(tmp_path)
    with pytest.raises(cdpr.InvalidArgument, match="can0 will move; give yes=True"):
        cdpr.run(robot, bus="can0=socketcan:can0")
    with pytest.raises(cdpr.InvalidArgument, match="unknown interface 'nonsense'"):
        cdpr.run(robot, bus="nonsense:")
    command = [sys.executable, "-P", "-m", "cdpr_tools.cli", "run", str(robot), "--no-record"]
    options = ["--bus", "can0=slcan:/dev/no-adapter", "--socket", str(tmp_path / "one.sock")]
    with subprocess.Popen(
        [*command, *options, "--exit-with-stdin"],
        stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as asked:  # fmt: skip
        assert asked.stderr is not None
        assert asked.wait(PATIENCE_S) == 2
        assert "with --exit-with-stdin, real drives need --yes" in asked.stderr.read()


def test_one_of_two_scripts_starts_the_daemon_and_it_ends_with_that_script(
    tmp_path: Path, daemon: RealDaemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    start = partial(cdpr.run, daemon.robot, bus="simbus:", record=tmp_path)
    with ThreadPoolExecutor() as scripts:
        started = [scripts.submit(start) for _ in range(2)]
    errors = [error for one in started if (error := one.exception()) is not None]
    assert [type(error) for error in errors] == [cdpr.AlreadyRunning], errors
    (robot,) = (one.result() for one in started if one.exception() is None)
    with robot:
        assert LoopFile.read(LoopFile.beside(find_sockets()[0])).runs()
        with pytest.raises(cdpr.AlreadyRunning, match=r"connect\(.* uses it"):
            cdpr.run(daemon.robot, bus="simbus:")
        robot.enable()
        robot.turn_by([0.1, 0.1])
    with pytest.raises(cdpr.NotRunning):
        cdpr.connect(daemon.robot)
    with pytest.raises(cdpr.NotRunning, match="the handle is closed"):
        robot.enable()
    with pytest.raises(cdpr.InvalidRobot, match="no-such-robot"):
        cdpr.run("no-such-robot", bus="simbus:")
