"""Commands reject damaged files, pipes and devices with the reason."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from cdpr_profiles import load_robot
from cdpr_sim_bus.robot.plant import Plant
from tests.cdpr_here import cdpr_here
from tests.tools.motor_profiles import leave_profiles


@pytest.fixture
def learnt(tmp_path: Path) -> Path:
    """Return a folder with cogging profiles of planar-3's motors."""
    return leave_profiles(load_robot("planar-3"), [Plant()] * 3, tmp_path / "learnt")


def said(done: subprocess.CompletedProcess[str]) -> str:
    """Return the one line in which a command rejects its input."""
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("cdpr: ")
    assert done.stderr.count("\n") == 1
    return done.stderr


def test_a_daemon_rejects_a_cogging_profile_with_implausible_torque(
    learnt: Path,
) -> None:
    path = learnt / "lower" / "cogging-profile.json"
    table = json.loads(path.read_text())
    table["harmonic"]["table_Nm"][0][7] = 1e6
    path.write_text(json.dumps(table))
    told = said(cdpr_here("run", "planar-3", "--bus", "simbus:", "--commissioned", learnt))
    assert f"axis lower: {path}: harmonic.table_Nm[0]: value 1e+06; allowed: -0.75 to 0.75" in told
    out = learnt / "out"
    told = said(
        cdpr_here("cogging", "validate", "winch-mpp0923d", path, "--bus", "simbus:", "--out", out)
    )
    assert f"{path}: harmonic.table_Nm[0]: value 1e+06" in told
    assert not out.exists()


def test_cogging_profiles_with_tables_of_different_length_are_rejected(learnt: Path) -> None:
    path = learnt / "lower" / "cogging-profile.json"
    table = json.loads(path.read_text())
    table["harmonic"]["table_Nm"] = [row[::2] for row in table["harmonic"]["table_Nm"]]
    path.write_text(json.dumps(table))
    told = said(cdpr_here("run", "planar-3", "--bus", "simbus:", "--commissioned", learnt))
    assert "harmonic.table_Nm has 512 and 256 values; every axis needs the same number" in told


def make_pipe(path: Path) -> None:
    path.unlink(missing_ok=True)
    os.mkfifo(path)


def test_each_command_rejects_an_invalid_input_file(tmp_path: Path, learnt: Path) -> None:
    robot, plant = tmp_path / "robot.toml", tmp_path / "plant.toml"
    profile = learnt / "lower" / "cogging-profile.json"
    asked = tmp_path / "trial"
    asked.mkdir()
    for path in (robot, plant, profile, asked / "trial.json"):
        make_pipe(path)
    for path, command in (
        (robot, ("run", robot, "--bus", "simbus:")),
        (robot, ("bus", "budget", robot)),
        (robot, ("robot", "show", robot)),
        (plant, ("sim", "up", "winch-mpp0923d", "--bus", "simbus:x", "--plant", plant)),
        (plant, ("sim", "up", "planar-3", "--bus", "simbus:x", "--plant", plant)),
        (profile, ("run", "planar-3", "--bus", "simbus:", "--commissioned", learnt)),
        (asked / "trial.json", ("robot", "trial", "planar-3", "line", "--again", "--out", asked)),
    ):
        answer = said(cdpr_here(*command))
        assert f"{path}: is not a regular file; allowed: a file, or a link to one" in answer


@pytest.mark.parametrize("command", [("drive", "import"), ("log", "info"), ("bus", "replay")])
def test_a_pipe_instead_of_a_file_is_rejected_immediately(
    tmp_path: Path, command: tuple[str, ...]
) -> None:
    path = tmp_path / "file.eds"
    make_pipe(path)
    done = cdpr_here(*command, path)
    assert done.returncode in (1, 2)
    assert "is not a regular file" in done.stderr
