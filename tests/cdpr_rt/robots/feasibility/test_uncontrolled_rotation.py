"""Platforms in space whose file leaves angles out of `controlled`: how they hang is told."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_profiles.reading.places import SHIPPED
from cdpr_rt.robots.feasibility.checks import findings
from cdpr_rt.robots.feasibility.finding import Finding
from cdpr_rt.robots.statics import statics_of

CAMERA = (SHIPPED / "robots" / "point-4.toml").read_text()
WEIGHT_N = 9.80665


def hanging(arm_m: float, below_m: float) -> str:
    """Return point-4 with anchors so far apart, and its centre of mass so far below them."""
    text = CAMERA.replace("mass_kg", f"centre_of_mass_m = [0.0, 0.0, {-below_m}]\nmass_kg", 1)
    text = text.replace("mass_kg", 'controlled = ["x", "y", "z"]\nmass_kg', 1)
    for exit_m in re.findall(r"exit_point_m = \[(.*), (.*), .*\]", CAMERA):
        x, y = (np.copysign(arm_m, float(one)) for one in exit_m)
        text = text.replace(
            "anchor_point_m = [0.0, 0.0, 0.0]", f"anchor_point_m = [{x}, {y}, 0]", 1
        )
    return text


def told(folder: Path, text: str) -> Finding | None:
    path = folder / "hanging.toml"
    path.write_text(text)
    of_it = (one for one in findings(load_robot(path)) if one.key == "platform.controlled")
    return next(of_it, None)


def test_how_far_it_hangs_turned_is_what_its_moments_say(tmp_path: Path) -> None:
    found = told(tmp_path, hanging(0.05, 0.1))
    assert found is not None and not found.impossible
    figures = re.search(r"at \((.*), (.*), (.*)\) m .* by (\S+) deg .*: (\S+) mm off", found.text)
    assert figures is not None, found.text
    x, y, z, turned_deg, off_mm = map(float, figures.groups())
    statics = statics_of(load_robot(tmp_path / "hanging.toml"))
    platform, place = statics.platform, np.array([x, y, z])
    t = statics.least_tensions_N(place[None], statics.model.reserve_N)[0]
    a, b = np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
    centre = np.array(platform.centre_of_mass_m)

    def cables(place: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        arms = b @ Rotation.from_rotvec(turn).as_matrix().T
        return a - place - arms, arms

    def moment(turn: np.ndarray) -> np.ndarray:
        away, arms = cables(place, turn)
        pulls = t[:, None] * away / np.linalg.norm(away, axis=1)[:, None]
        hangs = Rotation.from_rotvec(turn).apply(centre)
        weight = [0.0, 0.0, -platform.mass_kg * WEIGHT_N]
        return np.asarray(np.cross(arms, pulls).sum(axis=0) + np.cross(hangs, weight))

    rests = root(moment, np.zeros(3)).x
    assert np.degrees(np.linalg.norm(rests)) == pytest.approx(turned_deg, rel=0.1)
    # where a platform that is not turned has those lengths, as near as can be
    lengths = np.linalg.norm(cables(place, rests)[0], axis=1)

    def errors(seems: np.ndarray) -> np.ndarray:
        return np.asarray(np.linalg.norm(cables(seems, np.zeros(3))[0], axis=1) - lengths)

    seems = place.copy()
    for _ in range(9):
        J = np.array([(errors(seems + d) - errors(seems - d)) / 2e-6 for d in 1e-6 * np.eye(3)]).T
        seems = seems - np.linalg.pinv(J) @ errors(seems)
    assert 1e3 * np.linalg.norm(seems - place) == pytest.approx(off_mm, rel=0.2)


def test_one_that_turns_over_is_impossible(tmp_path: Path) -> None:
    found = told(tmp_path, hanging(0.05, -0.1))
    assert found is not None and found.impossible
    assert "turn the platform over" in found.text
    assert "takes six cables" in found.text


def test_one_whose_lengths_would_disagree_is_impossible(tmp_path: Path) -> None:
    text = (SHIPPED / "robots" / "suspended-6.toml").read_text()
    found = told(
        tmp_path, text.replace("mass_kg", 'controlled = ["x", "y", "z", "rz"]\nmass_kg', 1)
    )
    assert found is not None and found.impossible
    assert re.search(r"^rx, ry left out: .* disagree by 1\d\d mm, 31\.6 mm allowed", found.text)
    assert "its 6 cables can control them" in found.text


def test_of_a_rod_the_angle_about_its_own_axis_is_nothing_to_mind(tmp_path: Path) -> None:
    text = (SHIPPED / "robots" / "spatial-8.toml").read_text()
    text = re.sub(r"(anchor_point_m =) \[.*, (.*)\]", r"\1 [0.0, 0.0, \2]", text)
    text = re.sub(r"\nworkspace_angle_rad.*", "", text)
    rod = 'controlled = ["x", "y", "z", "rx", "ry"]\nmass_kg'
    assert told(tmp_path, text.replace("mass_kg", rod, 1)) is None
