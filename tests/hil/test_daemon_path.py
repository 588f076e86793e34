"""`cdpr path` on a real daemon is paused, faulted, killed and resumed."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from daemon_rig import RealDaemon, cdpr, held_right
from test_daemon_kills import third_party
from test_daemon_teleop import start_up
from waiting import until

from cdpr_drivers.bus import BusUrl
from tests.slower_robot import slower_robot

GCODE = "G21 G90 G64 P10\nG0 X-200 Y0\nG1 X100 F4000\nY100\nG3 X0 Y100 I-50 J0\nG1 X-200\nM2\n"
ENCODER_FAULT = 0x7305  # by 2F00h
HELD = "`cdpr path resume` continues"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "part.nc").write_text(GCODE)
    slower_robot(tmp_path, "planar-4")
    return tmp_path


@contextmanager
def running(folder: Path, status: int = 0) -> Iterator[RealDaemon]:
    """Yield a daemon with its platform off the stand on tight cables. It ends with `status`."""
    env = {"XDG_STATE_HOME": str(folder)}
    one = RealDaemon(folder, "--no-record", robot=folder / "planar-4.toml", env=env)
    try:
        start_up(one)
        yield one
    except BaseException as error:
        error.add_note(one.errors())
        one.end()  # report the failure instead of the exit status of a daemon that was not killed
        raise
    assert one.end() == status, one.errors()


def following(daemon: RealDaemon, *options: str | Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "cdpr_tools.cli", "path", *map(str, options), *daemon.at]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def told(daemon: RealDaemon) -> dict[str, Any]:
    path: dict[str, Any] = (daemon.status().get("program_progress") or {}).get("path") or {}
    return path


def until_time(daemon: RealDaemon, time_s: float) -> dict[str, Any]:
    def there() -> dict[str, Any] | None:
        path = told(daemon)
        return path if path.get("stage") == "path" and path["time_s"] >= time_s else None

    path: dict[str, Any] = until(there)
    return path


def _still(daemon: RealDaemon) -> float | None:
    one, other = told(daemon)["along_m"], told(daemon)["along_m"]
    return one if one == other else None


def pause(daemon: RealDaemon, folder: Path) -> None:
    """Follow the path from its beginning until it is paused."""
    # an origin in the plane: X is horizontal, Y is up
    with following(daemon, "run", folder / "part.nc", "--origin=0 1700") as path:
        until_time(daemon, 0.5)
        assert cdpr("hold", *daemon.at).returncode == 0
        said = path.communicate()[0]
    assert path.returncode == 0
    assert re.search(r"path part.nc stopped at \d+ %, line \d+, paused by .*; " + HELD, said)
    shown = cdpr("status", *daemon.at).stdout
    assert re.search(r"path part.nc stopped at \d+ %, line \d+; " + HELD, shown)


def lead(daemon: RealDaemon) -> None:
    """Continue slowly, stop on the path and step back over HTTP."""
    left = told(daemon)
    with held_right(daemon, "api") as headers:

        def ask(to: str, **body: Any) -> None:
            answer = daemon.http.post(to, json=body, headers=headers)
            assert answer.status_code == 200, answer.text

        ask("/program", program="path", wanted={"resume": True, "feed": 0.2})
        until_time(daemon, left["time_s"] + 0.05)
        ask("/set", wanted={"pause": True})
        assert until(lambda: told(daemon)["waiting"] == "paused")
        assert told(daemon)["feed"] == 0.2
        along_m = until(lambda: _still(daemon))
        ask("/set", wanted={"back_m": 0.02, "feed": 1.0})
        until(lambda: told(daemon)["waiting"] == "stepped back")
        assert told(daemon)["along_m"] == pytest.approx(along_m - 0.02, abs=2e-3)


def break_a_drive(daemon: RealDaemon) -> None:
    """Let an encoder fail on the path, then recover the robot."""
    with following(daemon, "resume", "--feed", "50") as path:
        seen = until_time(daemon, told(daemon)["time_s"] + 0.2)
        with third_party(BusUrl.parse(f"{daemon.bus}-can0")) as network:
            network.write(1, 0x2F00, 1, ENCODER_FAULT)
        errors = path.communicate()[1]
    assert path.returncode == 1
    assert "7305h" in errors and f"when the robot works again, {HELD}" in errors
    daemon.wait_for("fault")
    fallen_where_it_stands = ("tighten", "--from", "lengths")
    for command in (("ack",), ("enable",), fallen_where_it_stands):
        assert cdpr(*command, *daemon.at).returncode == 0
    assert told(daemon)["time_s"] >= seen["time_s"]


def test_a_path_resumes_where_it_was_paused_faulted_or_killed(folder: Path) -> None:
    with running(folder, status=1) as daemon:
        pause(daemon, folder)
        lead(daemon)
        break_a_drive(daemon)
        with following(daemon, "resume") as path:
            seen = until_time(daemon, told(daemon)["time_s"] + 0.2)
            assert seen["feed"] == 0.5
            os.kill(daemon.children()["loop"], signal.SIGKILL)
            path.communicate()
        assert path.returncode == 1
    with running(folder) as daemon:
        with following(daemon, "resume", "--json") as path:
            here = until(lambda: told(daemon) if told(daemon).get("stage") == "to the path" else {})
            assert here["time_s"] >= seen["time_s"]
            out, errors = path.communicate()
        assert path.returncode == 0, errors
        assert json.loads(out.splitlines()[-1])["path"]["time_s"] == here["duration_s"]
        done = cdpr("path", "resume", *daemon.at)
        assert done.returncode in (1, 2)
        assert (
            "path resume: there is no path to continue; allowed: cdpr path run FILE" in done.stderr
        )


def test_a_path_of_several_plans_is_completed(folder: Path) -> None:
    count = 26_000
    lines = "".join(f"X{-100.0 + 200.0 * i / count:.3f}\n" for i in range(1, count + 1))
    (folder / "long.nc").write_text(f"G21 G90\nG0 X-100 Y0\nG1 F6000\n{lines}M2\n")
    with running(folder) as daemon:
        with following(daemon, "run", folder / "long.nc", "--origin=0 1700", "--json") as path:
            out, errors = path.communicate()
        assert path.returncode == 0, errors
        progress = json.loads(out.splitlines()[-1])["path"]
        assert (progress["name"], progress["line"]) == ("long.nc", count + 3)
        assert errors.count("long.nc: 0.") == 2  # sums over both plans
