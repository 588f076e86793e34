"""`cdpr poses` reports, writes and draws poses, and rejects invalid requests."""

from __future__ import annotations

import csv
import json
import tomllib
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from cdpr_here import cdpr_here

from cdpr_profiles.places import SHIPPED


@pytest.mark.parametrize("choose", ["random", "spread", "information"])
def test_poses_are_reported_written_and_drawn(tmp_path: Path, choose: str) -> None:
    table, picture = tmp_path / "poses.csv", tmp_path / "poses.png"
    done = cdpr_here(
        "poses", "spatial-8", "-n", "12", "--seed", "3", "--choose", choose, "--angle", "10",
        "--out", table, "--png", picture, "--json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["ok"] and told["choose"] == choose and told["seed"] == 3
    assert told["drawn"] == (12 if choose == "random" else 240)
    assert told["clearance_m"] > 0.01 and told["margin_N"] > 0.0
    assert 0.0 < told["predicted_exit_deviation_m"] < 0.1
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"]
    read = np.array([[float(x) for x in row.values()] for row in rows])
    assert read == pytest.approx(np.array(told["poses"]), abs=1e-6)
    assert np.linalg.norm(read[:, 3:], axis=1).max() <= np.radians(10.0) + 1e-6
    assert matplotlib.image.imread(picture).std() > 0.05
    assert "and 7 more" in done.stderr


def test_planar_poses_from_another_place_are_written_as_toml(tmp_path: Path) -> None:
    table = tmp_path / "poses.toml"
    done = cdpr_here(
        "poses", "planar-3", "-n", "3", "--from", "-100", "1800", "--out", table, "--png",
        tmp_path / "plane.png",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "3 poses of 3 drawn; 0 ways cut short by contact" in done.stdout
    assert "no possible contacts" in done.stdout
    points = tomllib.loads(table.read_text())["points"]
    assert len(points) == 3 and all(len(point["position_m"]) == 2 for point in points)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("bench-8",), "has no platform; allowed: a robot with a [platform]"),
        (("spatial-8", "--angle", "20"), "--angle 20: allowed: up to 15 deg"),
        (("spatial-8", "--from", "0", "0"), "--from 0 0: 2 numbers; allowed: 3, X Y Z in mm"),
        (("spatial-8", "--from", "1500", "0", "1500"), "the start at 1.500, 0.000, 1.500 m: cable"),
        (("spatial-8", "--out", "poses.xlsx"), "poses.xlsx: allowed: NAME.csv or NAME.toml"),
        (("spatial-8", "--out", "/nowhere/poses.csv"), "in an existing folder"),
        (("spatial-8", "--choose", "best"), "'best'; allowed: 'random', 'spread'"),
        (("spatial-8", "-n", "0"), "allowed: 1 or more"),
    ],
)
def test_invalid_requests_are_rejected(arguments: tuple[str, ...], problem: str) -> None:
    done = cdpr_here("poses", *arguments)
    assert done.returncode == 2
    told = " ".join((done.stdout + done.stderr).replace("│", " ").split())
    assert problem in told and "Traceback" not in told


def test_poses_cut_off_by_an_obstacle_are_counted(tmp_path: Path) -> None:
    text = (SHIPPED / "robots" / "spatial-8.toml").read_text()
    box = (
        "[[platform.obstacles]]\nmin_m = [-0.2, 0.05, 1.98]\nmax_m = [-0.1, 0.15, 2.05]\n\n[limits]"
    )
    robot = tmp_path / "mine.toml"
    robot.write_text(text.replace("[limits]", box, 1))
    done = cdpr_here("poses", robot, "-n", "100", "--png", tmp_path / "mine.png", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["cut_by_contact"] > 3 and told["clearance_m"] >= 0.01
