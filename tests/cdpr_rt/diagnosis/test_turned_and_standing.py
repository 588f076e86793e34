"""Angles that are infeasible everywhere, and platforms that do not stand without cables."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cdpr_profiles import ProfileError, load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt.diagnosis.checks import diagnose, refuse_impossible
from cdpr_tools.composition.robot_physics import physics_of

SPATIAL = (SHIPPED / "robots" / "spatial-8.toml").read_text()
WALL = (SHIPPED / "robots" / "planar-4.toml").read_text()
BODY = "body = { min_m = [-0.1, -0.1, -0.3], max_m = [0.1, 0.1, 0.3] }"

CROSSED_m = {
    "exit_point_m": [
        *([x, y, 0.469] for x, y in ((-1.5, -1.131), (-1.5, 1.131), (1.5, 1.131), (1.5, -1.131))),
        *([x, y, 3.0] for x, y in ((-1.489, -1.5), (-1.489, 1.5), (1.489, 1.5), (1.489, -1.5))),
    ],
    "anchor_point_m": [
        *([0.2, -0.2, 0.2], [0.2, 0.2, -0.2], [-0.2, 0.2, 0.2], [-0.2, -0.2, -0.2]),
        *([0.2, -0.2, -0.2], [0.2, 0.2, 0.2], [-0.2, 0.2, -0.2], [-0.2, -0.2, 0.2]),
    ],
}


def crossed() -> str:
    """Return the robot with cables that touch each other only at small angles."""
    text = SPATIAL.replace(BODY, "")
    for key, value in (
        ("home_m", [0.0, 0.0, 1.1]),
        ("workspace_min_m", [-0.25, -0.25, 1.2]),
        ("workspace_max_m", [0.25, 0.25, 1.6]),
        ("tension_min_N", 5.0),
    ):
        text = re.sub(rf"\n({key} =) [^#\n]*", rf"\n\1 {value}", text)
    for key, points in CROSSED_m.items():
        place = iter(points)
        text = re.sub(rf"({key} =) [^#\n]*", lambda m, at=place: f"{m[1]} {next(at)}", text)
    return text


def test_an_angle_that_is_held_nowhere_in_the_box_is_impossible(tmp_path: Path) -> None:
    path = tmp_path / "turning.toml"
    for shipped, about in ((SPATIAL, " about z"), (WALL, "")):
        path.write_text(re.sub(r"(workspace_angle_rad =) \S+", r"\1 2.0", shipped))
        refused = (
            r"workspace_angle_rad: value 2; if the platform is turned by [\d.]+ "
            rf"deg{about}, .*up to ([\d.]+)"
        )
        with pytest.raises(ProfileError, match=refused) as caught:
            refuse_impossible(load_robot(path))
        assert "anchor_point_m" not in str(caught.value)  # anchor points are not the cause
        allowed = re.search(refused, str(caught.value))[1]  # type: ignore[index]
        assert float(allowed) >= 0.2618  # feasible in the whole box
        path.write_text(re.sub(r"(workspace_angle_rad =) \S+", rf"\1 {allowed}", shipped))
        told = [f.key for f in diagnose(load_robot(path)) if f.impossible]
        assert "platform.workspace_angle_rad" not in told


def test_smaller_angles_with_contact_everywhere_are_not_skipped(tmp_path: Path) -> None:
    path = tmp_path / "crossed.toml"
    refused = r"turned by 6\.88 deg about x, .*; allowed: up to 0\.08$"
    for angle in (0.1, 0.12, 0.128, 0.3, 0.4, 0.5, 2.0):
        text = re.sub(r"(workspace_angle_rad =) \S+", rf"\1 {angle}", crossed())
        path.write_text(text)
        found = {f.key: f.text for f in diagnose(load_robot(path)) if f.impossible}
        told = found.get("platform.workspace_angle_rad", "")
        assert bool(told) is (angle > 0.11) and (not told or re.search(refused, told)), told


def test_an_upright_rod_without_foot_is_reported_as_tipping(tmp_path: Path) -> None:
    text = re.sub(r"(anchor_point_m =) \[.*, (.*)\]", r"\1 [0.0, 0.0, \2]", SPATIAL)
    text = re.sub(r"\nworkspace_angle_rad.*", "", text)
    path, rod = tmp_path / "rod.toml", 'controlled = ["x", "y", "z", "rx", "ry"]'
    for body, told in (("", True), (BODY, False)):
        path.write_text(text.replace(BODY, f"{rod}\n{body}"))
        found = {f.key: f.text for f in diagnose(load_robot(path))}
        assert (
            "0 % of its weight tips the platform over" in found.get("axes[0].anchor_point_m", "")
        ) == told


def test_the_simulated_platform_stands_on_the_body_of_its_file(tmp_path: Path) -> None:
    path = tmp_path / "footed.toml"
    path.write_text(SPATIAL.replace(BODY, BODY.replace("-0.1, -0.1, -0.3", "-0.2, -0.4, -0.5")))
    physics, _ = physics_of(load_robot(path), None, detached=False)
    assert physics is not None
    platform = physics.platform[0]
    feet = platform["foot"][: platform["feet"]] + platform["com"]
    assert feet.min(axis=0) == pytest.approx([-0.2, -0.4, -0.5])
    assert feet.max(axis=0) == pytest.approx([0.1, 0.1, 0.3])
    assert platform["floor"] == pytest.approx(1.3 - 0.5, abs=1e-3)
