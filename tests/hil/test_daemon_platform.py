"""Commands that move a platform, on a real daemon with a simulated planar robot."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from daemon_rig import RealDaemon, cdpr
from waiting import until

from cdpr_profiles import load_robot
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import load_data
from cdpr_rt.calibration.residuals import encoder_lengths
from tests.slower_robot import slower_robot


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    """Yield a daemon of the shipped robot with three cables."""
    yield from running("planar-3", tmp_path_factory.mktemp("platform"))


@pytest.fixture(scope="module")
def turning(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RealDaemon]:
    """Yield a daemon of the shipped robot whose four cables also turn its platform."""
    yield from running("planar-4", tmp_path_factory.mktemp("turning"))


def running(name: str, folder: Path) -> Iterator[RealDaemon]:
    """Yield the daemon of a shipped robot with a cycle that leaves time for other processes."""
    env = {"XDG_STATE_HOME": str(folder)}
    one = RealDaemon(folder, "--no-record", robot=slower_robot(folder, name), env=env)
    try:
        assert cdpr("enable", *one.at).returncode == 0, one.errors()
        yield one
    finally:
        assert one.end() == 0, one.errors()


def output_of(daemon: RealDaemon, *command: str) -> dict[str, object]:
    """Return the JSON output of a command that must succeed."""
    done = cdpr(*command, *daemon.at, "--json")
    assert done.returncode == 0, f"{done.stderr}{daemon.errors()}"
    figures: dict[str, object] = json.loads(done.stdout.splitlines()[-1])
    return figures


def refused(daemon: RealDaemon, *command: str) -> tuple[int, str]:
    done = cdpr(*command, *daemon.at)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr


def test_a_platform_is_tightened_moved_and_lowered_to_its_stand(daemon: RealDaemon) -> None:
    status, why = refused(daemon, "move", "--to", "0", "1600")
    assert (status, "run tighten first" in why) == (1, True)
    status, why = refused(daemon, "tighten", "--from", "last")
    assert (status, "no lengths of the last stop" in why) == (1, True)
    assert output_of(daemon, "tighten")["position_m"] == pytest.approx([0.0, 1.3], abs=0.005)

    assert output_of(daemon, "move", "--to", "100", "1600")["position_m"] == pytest.approx(
        [0.1, 1.6], abs=0.005
    )
    moved = output_of(daemon, "move", "--to", "-50", "20", "--relative", "--speed", "200")
    assert moved["position_m"] == pytest.approx([0.05, 1.62], abs=0.005)
    shown = cdpr("status", *daemon.at).stdout
    assert re.search(r"platform at \d+\.\d, 16\d\d\.\d mm; target 50\.0, 1620\.0 mm", shown)

    for command, named in (
        (("move", "--to", "0", "9000"), "--to 0 9000: y 9000 mm; allowed: 1400 to 2400 mm"),
        (("move", "--to", "0.3", "2.0"), "are these metres? In mm: --to 300 2000"),
        (("move", "--to", "0", "1600", "lower=5"), "cannot be combined with axes"),
        (("jog", "up=5"), "up=5: allowed: x=MM, y=MM for a step of the platform, or AXIS=DEG_S"),
        (("move", "--rotate", "5"), "--rotate 5: this platform has no controlled angle"),
        (("tighten", "--from", "home"), "tighten --from home: the cables are already tight"),
        (("controller", "idle"), "lower it first"),
    ):
        status, why = refused(daemon, *command)
        assert status in (1, 2)
        assert named in why and "moving to" not in why

    command = [
        sys.executable,
        "-m",
        "cdpr_tools.cli",
        "move",
        "--to",
        "-300",
        "1900",
        "--speed",
        "100",
    ]
    with subprocess.Popen([*command, *daemon.at], stderr=subprocess.PIPE, text=True) as going:
        target = pytest.approx([-0.3, 1.9])
        until(lambda: daemon.status()["program_progress"].get("target_m") == target)
        output_of(daemon, "hold")
        held = daemon.status()
        assert held["program"] == "hold"
        assert held["program_progress"]["position_m"] != pytest.approx([-0.3, 1.9], abs=0.05)
        assert "pose was ended: hold by" in going.communicate()[1]
    assert going.returncode == 1
    assert output_of(daemon, "resume")["position_m"] == pytest.approx([-0.3, 1.9], abs=0.005)

    lowered = output_of(daemon, "lower")
    assert lowered["program"] == "hold"
    assert until(lambda: daemon.status()["program_progress"].get("tight") is False)
    again = cdpr("lower", *daemon.at)
    assert again.returncode == 0 and "lowering the platform" not in again.stderr
    assert "paying out the cables; a platform" in again.stderr


def test_poses_are_recorded_for_a_calibration(turning: RealDaemon, tmp_path: Path) -> None:
    read = ("calibrate", "read", "--out", str(tmp_path / "cal"))
    status, why = refused(turning, *read)
    assert (status, "the cables do not hold the platform" in why) == (1, True)
    output_of(turning, "tighten")
    assert output_of(turning, *read)["pose"] == 1
    output_of(turning, "move", "--to", "150", "1500", "--rotate", "4")
    assert output_of(turning, *read)["pose"] == 2
    data = load_data(tmp_path / "cal" / "data.json")
    assert data.simulated and len(data.poses) == 2 and not data.restarts
    geometry = CableGeometry.of(load_robot(str(turning.robot)))
    there = geometry.model.poses(np.array([[0.15, 1.5, math.radians(4.0)]]))
    tension_N = np.array([data.poses[1].tension_N])
    lengths_m = encoder_lengths(geometry, there, tension_N)[0]
    assert data.poses[1].length_m == pytest.approx(lengths_m.tolist(), abs=0.005)
    output_of(turning, "lower")


def test_a_daemon_moves_to_the_poses_of_a_calibration(turning: RealDaemon, tmp_path: Path) -> None:
    """The poses are close together to save time. The test types measurements of two."""
    poses, folder = tmp_path / "poses.csv", tmp_path / "cal"
    places = [(0.03 * (j % 4), 1.4 + 0.03 * (j // 4), 0.02 * (j % 3)) for j in range(14)]
    rows = [",".join(map(str, place)) for place in places]
    poses.write_text("x_m,y_m,angle_rad\n" + "\n".join(rows) + "\n")
    command = ("calibrate", "measure", "--poses", str(poses), "--ask", "--dry-run")
    status, why = refused(turning, *command, "--out", str(folder))
    assert (status, "the cables do not hold the platform" in why, folder.exists()) == (
        1,
        True,
        False,
    )
    output_of(turning, "tighten")
    typed = "0 1000\n\n\n0 1450 0.5\n"
    # fifteen poses, and a fit
    done = cdpr(*command, *turning.at, "--out", folder, typed=typed, timeout_s=240.0)
    assert done.stderr.count("measured x y in mm") == 5, done.stderr  # end of the typed input
    assert "the robot holds the platform at the last pose" in done.stdout
    data = load_data(folder / "data.json")
    assert len(data.poses) == 15 and data.simulated
    assert {pose.target for pose in data.poses[1:]} == set(places)
    assert (folder / "points.csv").read_text().splitlines()[1:] == [
        "1,0.0,1000.0",
        "4,0.0,1450.0,0.5",
    ]
    assert turning.status()["program"] == "hold"
    output_of(turning, "lower")
