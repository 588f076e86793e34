"""`cdpr robot workspace` searches, draws and writes workspaces, and rejects invalid requests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
import trimesh
from cdpr_here import cdpr_here

from cdpr_profiles.places import SHIPPED

COARSE = ("--cells", "12", "--rays", "200")


def searched(*arguments: str | Path) -> dict[str, Any]:
    done = cdpr_here("robot", "workspace", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert isinstance(told, dict) and told["ok"]
    return told


def refused(*arguments: str | Path) -> str:
    done = cdpr_here("robot", "workspace", *arguments)
    assert done.returncode == 2 and not done.stdout
    assert done.stderr.startswith("cdpr: ") and "Traceback" not in done.stderr
    return done.stderr


def test_a_workspace_in_space_is_searched_drawn_and_written_as_a_mesh(tmp_path: Path) -> None:
    picture, mesh = tmp_path / "space.png", tmp_path / "space.stl"
    done = cdpr_here(
        "robot", "workspace", "spatial-8", "--cells", "30", "--rays", "2000", "--png", picture,
        "--mesh", mesh, "--json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["grid"]["volume_m3"] == pytest.approx(told["rays"]["volume_m3"], rel=0.02)
    assert told["unseen_share"] == 0.0 and told["reaches_sides"] == []
    assert "wrench-feasible workspace: 1 m/s2 and 57 deg/s2" in done.stderr
    image = matplotlib.image.imread(picture)
    assert image.shape[0] > 500 and np.ptp(image[..., :3]) > 0.5
    loaded = trimesh.load_mesh(mesh)
    assert loaded.is_watertight
    assert loaded.volume == pytest.approx(told["grid"]["volume_m3"], rel=1e-3)


def test_weaker_requirements_give_a_larger_workspace() -> None:
    at_rest = searched("spatial-8", "--static", *COARSE)["grid"]["volume_m3"]
    moving = searched("spatial-8", *COARSE)["grid"]["volume_m3"]
    with_margin = searched("spatial-8", "--margin", "22", *COARSE)
    turned = searched("spatial-8", "--rotate", "0", "0", "-10", *COARSE)
    within = searched("spatial-8", "--within", "15", *COARSE)
    assert at_rest > 1.05 * moving and moving > 1.05 * with_margin["grid"]["volume_m3"]
    assert moving > 1.05 * within["grid"]["volume_m3"]
    assert turned["turns_rad"] == [[0.0, 0.0, pytest.approx(np.radians(-10.0))]]
    assert len(within["turns_rad"]) == 29
    assert with_margin["greatest_margin_N"] > 60.0 and with_margin["margin_at_least_N"] == 22.0


def test_contact_can_be_ignored() -> None:
    turned = ("spatial-8", "--static", "--rotate", "0", "0", "30", *COARSE)
    free = searched(*turned, "--contact-free")
    assert free["contact_free"] is True
    volume = free["grid"]["volume_m3"]
    assert 0.0 < volume < 0.9 * searched(*turned)["grid"]["volume_m3"]
    told = refused("spatial-8", "--rotate", "0", "0", "60", *COARSE, "--contact-free")
    assert "there is a contact at the start of the rays" in told


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_meshes_in_other_formats_are_closed(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"mesh{suffix}"
    told = searched("suspended-6", "--mesh", path, *COARSE)
    loaded = trimesh.load_mesh(path)
    assert loaded.is_watertight
    assert loaded.volume == pytest.approx(told["grid"]["volume_m3"], rel=1e-3)
    assert told["reaches_sides"] == ["z low"]


def test_a_planar_workspace_has_an_area(tmp_path: Path) -> None:
    picture = tmp_path / "plane.png"
    told = searched("planar-3", "--png", picture, "--low", "-2000", "0", "--high", "2000", "3000")
    assert told["grid"]["area_m2"] == pytest.approx(told["rays"]["area_m2"], rel=0.02)
    assert told["searched_m"] == [[-2.0, 0.0], [2.0, 3.0]]
    assert picture.stat().st_size > 10_000


def test_the_number_of_workers_does_not_change_the_result() -> None:
    alone = searched("planar-4", *COARSE, "--within", "5", "--workers", "1")
    assert searched("planar-4", *COARSE, "--within", "5", "--workers", "2") == alone


def test_a_missing_cluster_is_reported() -> None:
    done = cdpr_here("robot", "workspace", "planar-3", "--cluster", "127.0.0.1:1")
    assert done.returncode == 1 and done.stderr.startswith("cdpr: --cluster 127.0.0.1:1: ")


def test_the_nearest_place_is_reported_if_none_is_held() -> None:
    done = cdpr_here("robot", "workspace", "spatial-8", "--margin", "85", *COARSE)
    assert done.returncode == 1
    assert "the nearest place is" in done.stderr and "N too small" in done.stderr


def test_a_centre_outside_the_workspace_is_rejected_with_one_inside() -> None:
    for outside in (("0", "0", "0.5"), ("0", "0", "900000")):
        told = refused("spatial-8", *COARSE, "--centre", *outside)
        inside = told.rsplit("such as ", 1)[1].split()
        assert searched("spatial-8", *COARSE, "--centre", *inside)["rays"]["volume_m3"] > 3.0


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["bench-2"], "has no platform; allowed: a robot with a [platform]"),
        (["point-4", "--rotate", "1", "2", "3"], "this platform has no controlled angle"),
        (["planar-4", "--rotate", "-200"], "less than 180 deg"),
        (["planar-4", "--within", "180"], "less than 180 deg"),
        (["planar-4", "--within", "-1"], "less than 180 deg"),
        (["spatial-8", "--rotate", "1", "2"], "2 numbers; allowed: 3, RX RY RZ in deg"),
        (
            ["spatial-8", "--rotate", "1", "2", "3", "--within", "4"],
            "cannot be combined with --within",
        ),
        (["spatial-8", "--centre", "1", "2", "nan"], "allowed: finite numbers"),
        (["planar-3", "--low", "1", "2", "3"], "3 numbers; allowed: 2, X Y in mm"),
        (["planar-3", "--low", "0", "0", "--high", "100", "0"], "--low below --high"),
        (["planar-3", "--low", "-1e9", "0"], "within 1000 m"),
        (["planar-3", "--mesh", "a.stl"], "this robot is planar"),
        (["spatial-8", "--mesh", "a.xyz"], "allowed: a name that ends in .stl, .ply, .obj"),
        (["spatial-8", "--png", "/nowhere/a.png"], "a file in a folder that can be written to"),
        (["nobody"], "nobody"),
    ],
)
def test_invalid_requests_are_rejected(arguments: list[str], told: str) -> None:
    assert told in refused(*arguments)


def test_a_users_robot_is_searched_by_its_file(tmp_path: Path) -> None:
    text = (SHIPPED / "robots" / "planar-3.toml").read_text()
    path = tmp_path / "mine.toml"
    path.write_text(text.replace("mass_kg = 2.0", "mass_kg = 4.0"))
    heavier = searched(path, *COARSE)["grid"]["area_m2"]
    assert heavier < searched("planar-3", *COARSE)["grid"]["area_m2"]
