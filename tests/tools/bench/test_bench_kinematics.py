"""`cdpr bench kinematics` finds what it is to find; times belong to a machine."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog
from typer.testing import CliRunner

from cdpr_rt.robots.kinematics.kinematics import CableKinematics
from cdpr_tools.bench import kinematics as bench
from cdpr_tools.bench.geometries import COGIRO, held_tensions
from cdpr_tools.commands.bench import app


def test_bad_starts_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "ANGLES_deg", (2.0, 40.0))
    monkeypatch.setattr(bench, "_SCIPY_POSES", 3)
    done = CliRunner().invoke(app, ["kinematics", "--poses", "200"])
    assert done.exit_code == 0, done.output
    assert done.output.count("success at least reached") == 2
    assert "p99 wanted at most 15 us" in done.output


def test_held_poses_are_those_of_a_linear_program() -> None:
    robot = CableKinematics(COGIRO.exit_points_m, COGIRO.anchor_points_m)
    rng, weight = np.random.default_rng(3), np.array([0.0, 0.0, -981.0, 0.0, 0.0, 0.0])
    held = 0
    for _ in range(60):
        pose = COGIRO.home.plus(
            rng.uniform([-6, -4, -2, -0.5, -0.5, -0.5], [6, 4, 3, 0.5, 0.5, 0.5])
        )
        W = robot.wrench_matrix(pose)
        t = held_tensions(W, weight, 10.0, 6000.0)
        told = linprog(np.ones(8), A_eq=W, b_eq=-weight, bounds=(10.0, 6000.0))
        assert (t is not None) == (told.status == 0)
        if t is not None:
            held += 1
            assert W @ t + weight == pytest.approx(np.zeros(6), abs=1e-6)
            assert t.sum() == pytest.approx(told.fun, rel=1e-6)
    assert 5 < held < 60
