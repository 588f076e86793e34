"""Findings about platforms in space with uncontrolled angles: equilibrium and stability."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt.diagnosis.checks import diagnose
from cdpr_rt.diagnosis.subject import Finding
from cdpr_rt.model.rigid_body import inertia_kg_m2
from cdpr_rt.model.statics import PlatformStatics, statics_of

CAMERA = (SHIPPED / "robots" / "point-4.toml").read_text()
SUSPENDED = (SHIPPED / "robots" / "suspended-8.toml").read_text()
STANDARD_GRAVITY = 9.80665
TURNED = (
    r"at \((.*), (.*), (.*)\) m the platform hangs turned by (\S+) deg, "
    r"(\S+) mm from where it would be without that rotation"
)


def hanging(arm_m: float, below_m: float, origin_m: float = 0.0) -> str:
    """Return point-4 with anchors apart by `arm_m` and its centre of mass below them.

    `origin_m` puts the origin of the platform's frame below the anchors.
    """
    text = CAMERA.replace(
        "mass_kg",
        f"centre_of_mass_m = [0.0, 0.0, {origin_m - below_m}]\n"
        'controlled = ["x", "y", "z"]\nmass_kg',
        1,
    )
    for exit_m in re.findall(r"exit_point_m = \[(.*), (.*), .*\]", CAMERA):
        x, y = (float(np.copysign(arm_m, float(one))) for one in exit_m)
        point = f"anchor_point_m = [{x}, {y}, {origin_m}]"
        text = text.replace("anchor_point_m = [0.0, 0.0, 0.0]", point, 1)
    return re.sub(
        r"((?:home_m|workspace_m.._m) = \[.*, )(.*)\]",
        lambda found: f"{found[1]}{float(found[2]) - origin_m}]",
        text,
    )


def rod(turned_rad: float, beside_m: float) -> str:
    """Return spatial-8 as a rod with uncontrolled rotation about its axis."""
    text = (SHIPPED / "robots" / "spatial-8.toml").read_text()
    text = re.sub(r"(anchor_point_m =) \[.*, (.*)\]", r"\1 [0.0, 0.0, \2]", text)
    text = re.sub(r"\nworkspace_angle_rad.*", "", text)
    given = f"centre_of_mass_m = [{beside_m}, 0.0, 0.0]\nhome_rotation_rad = [0, {turned_rad}, 0]\n"
    return text.replace("mass_kg", f'{given}controlled = ["x", "y", "z", "rx", "ry"]\nmass_kg', 1)


def rotation_finding(folder: Path, text: str) -> Finding | None:
    path = folder / "hanging.toml"
    path.write_text(text)
    of_it = (one for one in diagnose(load_robot(path)) if one.key == "platform.controlled")
    return next(of_it, None)


def resting(statics: PlatformStatics, place: np.ndarray) -> np.ndarray:
    """Return the motion (6,) from `place` to the equilibrium in which lengths seem to match.

    The control adds tensions that hold the controlled directions.
    """
    platform = statics.platform
    directions = list(statics.model.kinematics.directions)
    a, b = np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
    weight = np.array([0.0, 0.0, -platform.mass_kg * STANDARD_GRAVITY])
    t = statics.least_tensions_N(place[None], statics.model.reserve_N)[0]

    def lengths_and_jacobian(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        arms = Rotation.from_rotvec(x[3:]).apply(b)
        away = place + x[:3] + arms - a
        lengths = np.linalg.norm(away, axis=1)
        u = away / lengths[:, None]
        return lengths, np.hstack([u, np.cross(arms, u)])

    before, J = lengths_and_jacobian(np.zeros(6))
    inverse = np.linalg.pinv(J[:, directions])

    def wrong(unknown: np.ndarray) -> np.ndarray:
        x, force = unknown[:6], unknown[6:]
        lengths, J_there = lengths_and_jacobian(x)
        wrench = -J_there.T @ (t + inverse.T @ force)
        wrench[:3] += weight
        centre = Rotation.from_rotvec(x[3:]).apply(platform.centre_of_mass_m)
        wrench[3:] += np.cross(centre, weight)
        return np.concatenate([wrench, 100.0 * inverse @ (lengths - before)])

    found = root(wrong, np.zeros(6 + len(directions)), tol=1e-12)
    assert found.success
    return np.asarray(found.x[:6])


@pytest.mark.parametrize(
    ("arm_m", "below_m", "origin_m"), [(0.05, 0.1, 0.0), (0.05, 0.1, 0.1), (0.03, 0.05, -0.05)]
)
def test_the_reported_rotation_is_that_of_the_equilibrium(
    tmp_path: Path, arm_m: float, below_m: float, origin_m: float
) -> None:
    found = rotation_finding(tmp_path, hanging(arm_m, below_m, origin_m))
    assert found is not None and not found.impossible
    figures = re.search(TURNED, found.text)
    assert figures is not None, found.text
    *place, turned_deg, off_mm = map(float, figures.groups())
    x = resting(statics_of(load_robot(tmp_path / "hanging.toml")), np.array(place))
    assert np.degrees(np.linalg.norm(x[3:])) == pytest.approx(turned_deg, rel=0.12)
    assert 1e3 * np.linalg.norm(x[:3]) == pytest.approx(off_mm, rel=0.12)


@pytest.mark.parametrize(
    ("arm_m", "below_m", "says"),
    [(0.05, -0.1, "turn the platform over"), (0.05, -0.02, "turns by more than 30 deg")],
)
def test_a_platform_that_turns_over_is_impossible(
    tmp_path: Path, arm_m: float, below_m: float, says: str
) -> None:
    found = rotation_finding(tmp_path, hanging(arm_m, below_m))
    assert found is not None and found.impossible
    assert says in found.text and "needs 6 cables" in found.text


def test_a_platform_whose_lengths_would_disagree_is_impossible(tmp_path: Path) -> None:
    controlled = 'controlled = ["x", "y", "z", "rz"]\nmass_kg'
    text = (SHIPPED / "robots" / "suspended-6.toml").read_text()
    found = rotation_finding(tmp_path, text.replace("mass_kg", controlled, 1))
    assert found is not None and found.impossible
    assert re.search(r"^rx, ry left out: .* disagree by \d+\.\d mm, 31\.6 mm allowed", found.text)
    assert "its cables can control these directions" in found.text


def test_disagreement_is_measured_by_normalised_residuals(tmp_path: Path) -> None:
    controlled = 'controlled = ["x", "y", "z", "ry", "rz"]\nmass_kg'
    text = SUSPENDED.replace("mass_kg", controlled, 1)
    found = rotation_finding(tmp_path, re.sub(r"workspace_angle_rad.*\n", "", text))
    assert found is not None and found.impossible
    figures = re.search(r"at \((.*), (.*), (.*)\) m .* by (\S+) mm, ", found.text)
    assert figures is not None, found.text
    *place, apart_mm = map(float, figures.groups())
    statics = statics_of(load_robot(tmp_path / "hanging.toml"))
    x = resting(statics, np.array(place))
    kinematics = statics.model.kinematics
    held = kinematics.jacobian(statics.model.pose(np.array(place)))
    projection = np.eye(8) - held @ np.linalg.pinv(held)
    turned = statics.model.pose(np.array(place)).plus(x)
    longer = kinematics.lengths(turned) - kinematics.lengths(statics.model.pose(np.array(place)))
    normalised = np.abs(projection @ longer) / np.sqrt(np.diag(projection))
    assert 1e3 * normalised.max() == pytest.approx(apart_mm, rel=0.15)


@pytest.mark.parametrize(("turned_rad", "beside_m"), [(0.0, 0.0), (0.02, 0.0), (0.35, 0.0)])
def test_rotation_of_a_rod_about_its_axis_is_not_reported(
    tmp_path: Path, turned_rad: float, beside_m: float
) -> None:
    assert rotation_finding(tmp_path, rod(turned_rad, beside_m)) is None


def test_loads_beside_a_rod_or_below_a_knot_are_reported_as_swinging_but_accepted(
    tmp_path: Path,
) -> None:
    knot = CAMERA.replace("mass_kg", "centre_of_mass_m = [0.02, 0.0, -0.1]\nmass_kg", 1)
    for text in (rod(0.0, 0.02), knot):
        found = rotation_finding(tmp_path, text)
        assert found is not None and not found.impossible
        assert "the platform swings about these axes" in found.text


def test_the_reported_periods_are_those_of_a_pendulum_on_cables_of_fixed_length(
    tmp_path: Path,
) -> None:
    found = rotation_finding(tmp_path, hanging(0.05, 0.1))
    assert found is not None
    figures = re.search(
        r"the platform swings at \((.*), (.*), (.*)\) m in (\S+) and (\S+) s", found.text
    )
    assert figures is not None, found.text
    statics = statics_of(load_robot(tmp_path / "hanging.toml"))
    platform = statics.platform
    a, b = np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
    place, centre = np.array([float(x) for x in figures.groups()[:3]]), platform.centre_of_mass_m

    def lengths(x: np.ndarray) -> np.ndarray:
        return np.linalg.norm(x[:3] + Rotation.from_rotvec(x[3:]).apply(b) - a, axis=1)

    before = lengths(np.array([*place, 0.0, 0.0, 0.0]))

    def turned(tilt: np.ndarray) -> np.ndarray:
        """Return the pose (6,) with these lengths at a tilt about x and y."""

        def pose(rest: np.ndarray) -> np.ndarray:
            return np.array([*rest[:3], *tilt, rest[3]])

        at = root(lambda rest: lengths(pose(rest)) - before, np.array([*place, 0.0]), tol=1e-13)
        return pose(at.x)

    def energy(tilt: np.ndarray) -> float:
        x = turned(tilt)
        raised = x[2] + Rotation.from_rotvec(x[3:]).apply(centre)[2]
        return float(platform.mass_kg * STANDARD_GRAVITY * raised)

    h, axes = 0.02, np.eye(2)
    K = np.array([
        [
            (energy(h * (p + q)) - energy(h * (p - q)) - energy(h * (q - p)) + energy(-h * (p + q)))
            / (4.0 * h * h)
            for q in axes
        ]
        for p in axes
    ])  # fmt: skip
    moves = np.column_stack([(turned(h * p) - turned(-h * p)) / (2.0 * h) for p in axes])
    of_centre = moves[:3] + np.cross(moves[3:].T, centre).T
    inertia = inertia_kg_m2(platform)
    M = platform.mass_kg * of_centre.T @ of_centre + moves[3:].T @ inertia @ moves[3:]
    squares = np.linalg.eigvals(np.linalg.solve(M, K)).real
    periods = sorted(2.0 * np.pi / np.sqrt(squares), reverse=True)
    assert periods == pytest.approx([float(one) for one in figures.groups()[3:]], rel=0.02)


def test_a_box_below_the_home_of_a_hanging_platform_is_impossible(tmp_path: Path) -> None:
    text = hanging(0.05, 0.1)
    low = re.search(r"workspace_min_m = \[.*, (.*)\]", text)
    home = re.search(r"home_m = \[.*, (.*)\]", text)
    assert low is not None and home is not None
    under = f"{low[0][: -len(low[1]) - 1]}{float(home[1]) - 0.1}]"
    path = tmp_path / "hanging.toml"
    path.write_text(text.replace(low[0], under))
    found = [one for one in diagnose(load_robot(path)) if "0.1 m below home" in one.text]
    assert [(one.key, one.impossible) for one in found] == [("platform.workspace_min_m", True)]
