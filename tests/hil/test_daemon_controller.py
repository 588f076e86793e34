"""A user's own code in a daemon: `cdpr run ROBOT --controller FILE.py:CLASS`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from daemon_rig import RealDaemon
from daemon_rig import cdpr as run_cdpr

import cdpr_rt as cdpr
from tests.slower_robot import slower_robot

MINE = """
import time

import numpy as np
import cdpr_rt as cdpr

class Mine(cdpr.Controller):
    def reset(self, state):
        self.integral = np.zeros_like(state.position)

    def update(self, state, target):
        error = target.position - state.position
        self.integral += state.period_s * error
        force = 3000.0 * (error + 3.0 * self.integral)
        return state.distribute(force + 250.0 * (target.velocity - state.velocity))

class Torques(Mine, cdpr.TorqueController):
    def update(self, state, target):
        return state.torques(super().update(state, target))

class Blocking(Torques):
    def update(self, state, target):
        if target.position[1] > 1.5:
            time.sleep(0.05)
        return super().update(state, target)

class Other:
    pass

class Side(cdpr.Program):
    'A step to the side.'

    name = "side"
    arguments = {"step_m": (0.0, 0.2, 0.1)}

    def begin(self, position, step_m):
        self.goal = position + [step_m, 0.0]

    def target(self, time_s):
        return self.goal if time_s < 0.1 else None

def middle(W, w, low, high, previous):
    t, free = 0.5 * (low + high), np.full(3, True)
    while True:
        t[free] -= np.linalg.pinv(W[:, free]) @ (W @ t + w)
        outside = np.maximum(low - t, t - high)
        if outside.max() <= 0.0:
            return t
        worst = outside.argmax()
        t[worst], free[worst] = np.clip(t[worst], low[worst], high[worst]), False
"""


@contextmanager
def running(folder: Path, controller: str, paced: bool = False) -> Iterator[RealDaemon]:
    file, robot = folder / "mine.py", slower_robot(folder, "planar-3")
    file.write_text(MINE)
    named = '[platform]\ntension_distribution = "mine.py:middle"'
    robot.write_text(robot.read_text().replace("[platform]", named))
    env = {"XDG_STATE_HOME": str(folder)}
    mine = ("--no-record", "--controller", f"{file}:{controller}", "--allow-code")
    mine += ("--program", f"{file}:Side")
    daemon = RealDaemon(folder, *mine, robot=robot, env=env, paced=paced)
    try:
        yield daemon
    finally:
        daemon.end()


def done(daemon: RealDaemon, *command: str) -> dict[str, object]:
    result = run_cdpr(*command, *daemon.at, "--json")
    assert result.returncode == 0, f"{result.stderr}{daemon.errors()}"
    told: dict[str, object] = json.loads(result.stdout.splitlines()[-1])
    return told


def test_code_from_files_moves_the_platform_and_is_shown(tmp_path: Path) -> None:
    with running(tmp_path, "Torques") as daemon:
        done(daemon, "enable")
        done(daemon, "tighten")
        moved = done(daemon, "move", "--to", "100", "1600")
        assert moved["position_m"] == pytest.approx([0.1, 1.6], abs=0.005)
        moved = done(daemon, "controller", "side", "step_m=0.05")
        assert moved["position_m"] == pytest.approx([0.15, 1.6], abs=0.005)
        schemas = daemon.http.get("/openapi.json").json()["components"]["schemas"]
        name = schemas["ProgramRequest"]["properties"]["program"]
        assert "side" in name["examples"]
        assert "A step to the side. (step_m from 0 to 0.2, 0.1 by default)" in name["description"]
        notices = daemon.status()["notices"]
        assert any("mine.py:Torques controls the platform" in notice for notice in notices)
        assert "mine.py:middle distributes the tensions off the stand" in notices


@pytest.mark.alone
def test_a_controller_that_blocks_for_50_ms_stops_the_robot(tmp_path: Path) -> None:
    with (
        running(tmp_path, "Blocking", paced=True) as daemon,
        cdpr.connect(socket=daemon.socket) as robot,
    ):
        robot.enable()
        robot.tighten()
        blocked = r"program pose: took \d+ ms in a cycle, 50 ms allowed"
        with pytest.raises(cdpr.Faulted, match=blocked) as fault:
            robot.move_to([0.0, 1.6])
        assert fault.value.limit == "late"
        assert robot.state == "fault"
        enabled = [axis["statusword"] & 0x6F == 0x27 for axis in robot.status["axes"]]
        assert enabled == [False] * 3
        robot.acknowledge()
        assert robot.state == "ready"


def test_an_invalid_controller_is_rejected_before_anything_starts(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    words = ("--bus", "simbus:", "--socket", tmp_path / "control.sock", "--no-record")
    result = run_cdpr("run", "planar-3", *words, "--controller", f"{file}:Other")
    assert result.returncode == 2, result.stderr
    assert "derive Other from cdpr_rt.Controller" in result.stderr
    assert "Traceback" not in result.stderr
