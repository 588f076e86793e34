"""`cdpr bench tension` runs to its end and its figures agree; no timing is judged."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_rt.robots.tension.tension_distribution import METHODS
from cdpr_tools.bench.geometries import ROBOTS, SPATIAL, CableRobot

OTHERS = ("daqp", "piqp", "osqp", "osqp-tight")


@lru_cache
def bench() -> tuple[dict[str, Any], str]:
    """Return the JSON line and the text for people."""
    command = [
        sys.executable,
        "-m",
        "cdpr_tools.cli",
        "bench",
        "tension",
        "--poses",
        "1000",
        "--json",
    ]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1]), run.stderr


def robots() -> dict[str, Any]:
    found = bench()[0]["robots"]
    assert set(found) == {"spatial-8", "suspended-8"}
    return found


def test_every_method_and_solver_is_timed_on_every_robot() -> None:
    for robot in robots().values():
        assert set(robot["cpu_us"]) == set(robot["wall_us"]) == {*METHODS, *OTHERS}
        assert all(0.0 < us["p50"] <= us["p99"] <= us["p99.9"] for us in robot["cpu_us"].values())
        assert robot["not_installed"] == []


def test_what_is_feasible_is_agreed_on() -> None:
    for robot in robots().values():
        assert robot["only_osqp"] == 0
        assert robot["reached"]["feasible_wherever_osqp"]
        assert len({robot["found"][method] for method in METHODS}) == 1
        assert 0.2 < robot["found"]["minimum-norm"] < 0.95
        assert robot["found"]["daqp"] == pytest.approx(robot["found"]["minimum-norm"], abs=0.002)
        assert robot["wrench_missing_N"] < 1e-8


def test_the_target_is_that_of_the_printed_figure() -> None:
    figures, text = bench()
    for name, robot in figures["robots"].items():
        p99 = robot["cpu_us"][figures["in_the_cycle"]]["p99"]
        assert robot["reached"]["cost"] == (p99 <= figures["target_us"])
        told = f"{p99:.1f} us of processor time, wanted at most 10"
        assert f"{told}: {'reached' if robot['reached']['cost'] else 'MISSED'}" in text, name


def test_smoothness_is_told_of_every_method() -> None:
    for robot in robots().values():
        assert set(robot["smoothness"]) == set(METHODS)
        assert robot["smoothness"]["minimum-norm"]["paths_with_steps"] == 0
        assert robot["smoothness"]["polygon-centroid"]["paths_with_steps"] == 0
        assert robot["smoothness_of_the_nearest"]["largest_step_of_the_wrench_N"] < 1e-3


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_wrench_matrix_is_what_cable_lengths_change_by(robot: CableRobot) -> None:
    """W = -J', J the change of lengths by the platform's twist, here by differences."""
    p, rotation = np.array([0.3, -0.2, 1.6]), Rotation.from_rotvec([0.1, -0.2, 0.15])

    def lengths(twist: np.ndarray) -> np.ndarray:
        turned = Rotation.from_rotvec(twist[3:]) * rotation
        anchors = p + twist[:3] + turned.apply(robot.anchor_points)
        return np.asarray(np.linalg.norm(robot.exit_points - anchors, axis=1))

    J = np.column_stack([(lengths(1e-6 * e) - lengths(-1e-6 * e)) / 2e-6 for e in np.eye(6)])
    assert robot.wrench_matrix(p, rotation.as_matrix()) == pytest.approx(-J.T, abs=1e-8)


def test_the_platform_of_spatial_8_has_its_size() -> None:
    size = SPATIAL.anchor_points.max(axis=0) - SPATIAL.anchor_points.min(axis=0)
    assert size == pytest.approx([0.2, 0.2, 0.6])
