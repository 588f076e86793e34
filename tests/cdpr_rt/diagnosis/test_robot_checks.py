"""Findings about a robot's file: impossible and doubtful settings with remedies."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles import ProfileError, Robot, load_robot
from cdpr_profiles.places import SHIPPED
from cdpr_rt.diagnosis.checks import diagnose, refuse_impossible
from cdpr_rt.model.statics import statics_of

PLANAR = (SHIPPED / "robots" / "planar-3.toml").read_text()


def robot_of(folder: Path, *replaced: tuple[str, str]) -> Robot:
    text = PLANAR
    for old, new in replaced:
        assert old in text
        text = text.replace(old, new)
    path = folder / "mine.toml"
    path.write_text(text)
    return load_robot(path)


def test_the_shipped_robot_has_a_reserve_in_its_whole_box() -> None:
    robot = load_robot("planar-3")
    statics = statics_of(robot)
    assert diagnose(robot) == [] and refuse_impossible(robot) == []
    points = statics.box.grid(31, 31)
    assert statics.margin_N(points, statics.platform.acceleration_m_s2).min() > 18.0
    assert diagnose(load_robot("spatial-8")) == []


def test_a_home_at_which_the_platform_would_tip_is_doubtful(tmp_path: Path) -> None:
    apart = [
        ("[-2.0, 3.0]", "[-1.0, 2.5]"),
        ("[2.0, 3.0]", "[2.5, 2.0]"),
        ("[0.0, 0.0]", "[-0.5, -0.5]"),
    ]
    box = [
        ("[-0.6, 1.4]", "[0.4, 1.3]"),
        ("[0.6, 2.4]", "[1.1, 1.6]"),
        ("[0.0, 1.3]", "[0.75, 1.25]"),
    ]
    told = diagnose(robot_of(tmp_path, *apart, *box))
    assert any(f.key == "platform.home_m" and "tip it on its stand" in f.text for f in told)


def _ten_times(value: Any) -> Any:
    return tuple(map(_ten_times, value)) if isinstance(value, tuple) else 10.0 * value


def hall(low_N: float, high_N: float) -> Robot:
    """Return `planar-3` in a frame ten times as large, with the given bounds of tension."""
    robot = load_robot("planar-3")
    assert robot.platform is not None
    larger = {
        key: _ten_times(getattr(robot.platform, key))
        for key in ("exit_points_m", "home_m", "workspace_min_m", "workspace_max_m")
    }
    bounds = {"tension_min_N": (low_N,), "tension_max_N": (high_N,), "slack_N": (0.5 * low_N,)}
    return dataclasses.replace(
        robot,
        platform=dataclasses.replace(robot.platform, **larger),
        limits=robot.limits.model_copy(update=bounds),
    )


@pytest.mark.parametrize(("low_N", "high_N"), [(1.0, 20.0), (20.0, 150.0)])
def test_sagging_cables_are_reported_with_a_sufficient_tension(low_N: float, high_N: float) -> None:
    """The reference is the derivative of a parabola's extra length over the whole box."""
    robot = hall(low_N, high_N)
    told = [f.text for f in diagnose(robot) if f.key == "limits.tension_min_N"]
    statics, cable = statics_of(robot), robot.axes[0].winch.cable
    spans = (statics.exits_m - statics.points()[..., None, :] - statics.anchors_m).reshape(-1, 2)

    def sag_m(tension_N: float) -> np.ndarray:
        chord = np.hypot(*spans.T)
        load_N_m = cable.weight_per_length_N_m * np.abs(spans[:, 0]) / chord
        depth = load_N_m * chord**2 / (8.0 * tension_N)
        return 8.0 / 3.0 * depth**2 / chord

    planned_N = low_N + statics.model.reserve_N
    slope = float((sag_m(planned_N - 0.01) - sag_m(planned_N + 0.01)).max()) / 0.02
    assert bool(told) == (slope > 0.01) == (low_N < 20.0)
    if told:
        assert f"{slope:.2g} m, and" in told[0]
        enough_N = float(told[0].split("use ")[1].split()[0])
        better = hall(enough_N, high_N + enough_N)
        assert not any(f.key == "limits.tension_min_N" for f in diagnose(better))


SPATIAL = (SHIPPED / "robots" / "spatial-8.toml").read_text()
SUSPENDED = (SHIPPED / "robots" / "suspended-8.toml").read_text()


def findings_of(folder: Path, text: str) -> dict[str, str]:
    path = folder / "space.toml"
    path.write_text(text)
    return {finding.key: finding.text for finding in diagnose(load_robot(path))}


@pytest.mark.parametrize("name", ["planar-4", "point-4", "suspended-6", "suspended-8", "spatial-8"])
def test_each_shipped_robot_holds_its_box_at_all_orientations(name: str) -> None:
    robot = load_robot(name)
    assert diagnose(robot) == []
    statics = statics_of(robot)
    assert (
        len(statics.orientations) == {3: 3, 6: 15}.get(statics.model.size, 1) or name == "point-4"
    )
    moving = statics.margin_N(
        statics.points(), statics.platform.acceleration_m_s2, statics.orientations
    )
    assert moving.min() > statics.model.reserve_N


def test_uncontrolled_angles_in_space_are_reported(tmp_path: Path) -> None:
    free = 'controlled = ["x", "y", "z"]\nmass_kg'
    text = re.sub(r"workspace_angle_rad.*\n", "", SUSPENDED.replace("mass_kg", free, 1))
    assert "rx, ry, rz left out" in findings_of(tmp_path, text)["platform.controlled"]


def test_collinear_or_coplanar_anchor_points_are_reported(tmp_path: Path) -> None:
    level = re.sub(r"(anchor_point_m = \[.*), .*, .*\]", r"\1, 0.0, 0.0]", SUSPENDED)
    assert "all anchor points lie in one line" in findings_of(tmp_path, level)["platform.home_m"]
    camera = (SHIPPED / "robots" / "point-4.toml").read_text()
    for i, exit_m in enumerate(re.findall(r"exit_point_m = (\[.*\])", camera)):
        camera = camera.replace(exit_m, f"[{-3.0 + 2.0 * i}, 0.0, 4.0]", 1)
    told = findings_of(tmp_path, camera)["platform.home_m"]
    assert told.endswith("all exit points lie in one line")


def test_the_axis_of_a_rod_that_needs_no_control_is_reported(tmp_path: Path) -> None:
    for turned, free in (("0.0, 0.0, 0.0", "rz"), ("0.0, 1.5708, 0.0", "rx"), ("0, 0.7, 0", "")):
        upright = re.sub(r"(anchor_point_m =) \[(.*), .*, .*\]", r"\1 [0.0, 0.0, \2]", SUSPENDED)
        text = upright.replace("mass_kg", f"home_rotation_rad = [{turned}]\nmass_kg", 1)
        told = findings_of(tmp_path, text)["platform.home_m"]
        assert ("platform.controlled without" in told) == bool(free)
        assert told.endswith(free)


def test_infeasible_orientations_are_reported_with_the_feasible_angle(tmp_path: Path) -> None:
    text = SUSPENDED.replace("workspace_angle_rad = 0.2618", "workspace_angle_rad = 0.6")
    told = findings_of(tmp_path, text)["platform.workspace_min_m"]
    assert re.search(
        r"turned by 34 deg about .*; workspace_angle_rad up to 0\.\d+ is possible", told
    )


def test_an_orientation_in_a_plane_is_reported_as_one_angle(tmp_path: Path) -> None:
    text = (SHIPPED / "robots" / "planar-4.toml").read_text()
    text = re.sub(r"(workspace_angle_rad =) \S+", r"\1 0.7", text)
    told = findings_of(tmp_path, text)["platform.workspace_min_m"]
    assert re.search(r" m, turned by -?40 deg the cables ", told), told


def test_a_turned_platform_that_touches_its_stand_is_reported(tmp_path: Path) -> None:
    text = SUSPENDED.replace("[-2.6, -1.8, 0.75]", "[-2.6, -1.8, 0.6]")
    told = findings_of(tmp_path, text)["platform.workspace_angle_rad"]
    assert "0.18 m lower, and the box begins 0.10 m above home" in told
    assert "from 0.68 m upward" in told


BODY = "body = { min_m = [-0.1, -0.1, -0.3], max_m = [0.1, 0.1, 0.3] }"


def test_cables_that_touch_within_the_box_are_reported_with_the_place(tmp_path: Path) -> None:
    # cables of a corner cross: from below to the top and from above to the bottom
    text = SPATIAL.replace("[0.1, -0.1, 0.3]", "[-0.1, -0.1, 0.3]", 1)
    text = text.replace("[-0.1, 0.1, -0.3]", "[-0.1, -0.1, -0.3]", 1)
    text = text.replace("[-2.0873, -1.7254, 2.9602]", "[-1.8133, -2.1594, 2.9602]", 1)
    path = tmp_path / "crossed.toml"
    path.write_text(text)
    told = next(f for f in diagnose(load_robot(path)) if f.key == "platform.clearance_m")
    # contact everywhere at home, none if turned far enough: the platform can be moved
    assert not told.impossible and re.match(
        r"value 0\.01; in 100 % of the box, at home's orientation, .* at \(.*\) m.* cable",
        told.text,
    )
    assert "platform.clearance_m" not in findings_of(tmp_path, SPATIAL)


def test_a_body_that_cables_cannot_pass_is_impossible(tmp_path: Path) -> None:
    path = tmp_path / "wide.toml"
    wide = "body = { min_m = [-2.5, -2.5, -0.3], max_m = [2.5, 2.5, 0.3] }"
    path.write_text(SPATIAL.replace(BODY, wide))
    with pytest.raises(
        ProfileError, match=r"clearance_m: value 0\.01; in 100 % of the box, .*touch"
    ):
        refuse_impossible(load_robot(path))


def test_winch_friction_above_the_reserve_for_control_is_reported(tmp_path: Path) -> None:
    # share of the motor's rated 115 N
    told = diagnose(robot_of(tmp_path, ("max_N = 150", "max_N = 60")))
    about = [f for f in told if f.key == "platform.mass_kg"]
    assert about and "may need 6.9 N" in about[0].text and not about[0].impossible


def test_a_problem_at_all_places_is_reported_in_general(tmp_path: Path) -> None:
    # upper cables go to the lower end, lower ones to the upper end: none turns it about z
    text = re.sub(r"(anchor_point_m = )\[.*, .*, (.*)\]", r"\1[0.1, 0.0, \2]", SPATIAL)
    told = findings_of(tmp_path, text)["platform.home_m"]
    assert "or other anchor points" in told or "all anchor points" in told


def test_angular_speed_contributes_to_cable_speed(tmp_path: Path) -> None:
    text = SUSPENDED.replace("angular_speed_rad_s = 0.25", "angular_speed_rad_s = 0.6")
    told = findings_of(tmp_path, text)["platform.speed_m_s"]
    assert "along and about all directions, cables run at up to" in told
    found = re.search(
        r"up to (\S+) with angular_speed_rad_s up to (\S+), or limits.speed_rad_s from (\d+)$", told
    )
    assert found is not None, told
    # each of the two remedies works
    slower = SUSPENDED.replace("angular_speed_rad_s = 0.25", f"angular_speed_rad_s = {found[2]}")
    slower = re.sub(r"\nspeed_m_s = [\d.]+", f"\nspeed_m_s = {found[1]}", slower)
    assert "platform.speed_m_s" not in findings_of(tmp_path, slower)
    quicker = re.sub(r"\nspeed_rad_s = [\d.]+", f"\nspeed_rad_s = {found[3]}", text)
    assert "platform.speed_m_s" not in findings_of(tmp_path, quicker)


def test_pairs_of_cables_may_share_exit_points(tmp_path: Path) -> None:
    # the published robocrane: three exit points with two cables each
    crane = (SHIPPED / "robots" / "suspended-6.toml").read_text()
    for pair, point in (
        (r"-?0\.15, 4\.0", "0.0, 4.0"),
        (r"-3\.\d+, -\d\.\d+", "-3.464, -2.0"),
        (r"3\.\d+, -\d\.\d+", "3.464, -2.0"),
    ):
        crane, count = re.subn(
            rf"exit_point_m = \[{pair}, 4\.0\]", f"exit_point_m = [{point}, 4.0]", crane
        )
        assert count == 2
    path = tmp_path / "crane.toml"
    path.write_text(crane)
    assert not [f for f in diagnose(load_robot(path)) if f.impossible]


@pytest.mark.parametrize(
    ("replaced", "key", "problem", "impossible"),
    [
        ([("mass_kg = 2.0", "mass_kg = 60.0")], "platform.home_m", "of up to 12.6 kg", True),
        ([("period_s = 0.001", "period_s = 0.01")], "sync_period_s", "up to 0.005", True),
        ([("mass_kg = 2.0", "mass_kg = 15.0")], "platform.workspace_min_m", "up to 3 kg is", True),
        ([("[0.0, 1.3]", "[0.5, 0.3]")], "platform.home_m", "farther inside", True),
        ([("[0.0, 1.3]", "[0.6, -0.5]")], "platform.home_m", "only a place", True),
        ([("[-0.6, 1.4]", "[-0.6, 0.9]")], "platform.workspace_min_m", "they would be in", False),
        ([("n_m_s2 = 2.0", "n_m_s2 = 50")], "platform.home_m", "acceleration_m_s2 up to", True),
        ([("torque_Nm = 4.5", "torque_Nm = 2.5")], "limits.tension_max_N", "up to 96 N", True),
        ([("speed_m_s = 0.5", "speed_m_s = 5")], "platform.speed_m_s", "allowed: up to 1.9", True),
        ([("[-0.075, 0.0433]", "[-75.0, 43.3]")], "axes[0].anchor_point_m", "in millimetres", True),
        ([("[0.0, 0.0]", "[2.0, 3.0]")], "platform.home_m", "the cables would need", True),
        (
            [("[0.0, 0.0]", "[2.0, 3.0]"), ("[0.0, -0.0866]", "[0.075, 0.0433]")],
            "axes[2].exit_point_m",
            "0 m from that of axes[1], and so are their anchor points",
            True,
        ),
        ([("[0.0, 0.0]", "[0.0, 3.0]")], "platform.home_m", "tension_min_N up to 2 with", True),
        ([("[-2.0, 3.0]", "[-0.5, 2.0]")], "platform.workspace_min_m", "from the exit point", True),
        (
            [("slack_N", "cable_length_max_m = 2.5\nslack_N")],
            "limits.cable_length_max_m",
            "axes[0] has 2.97 m",
            True,
        ),
        (
            [("torque_Nm = 4.5", "torque_Nm = 11.0"), ("max_N = 150", "max_N = 400"),
             ("[0.6, 2.4]", "[0.6, 2.8]")],
            "platform.workspace_max_m",
            "motor is rated for 3 Nm",
            False,
        ),
        (
            [("[-0.075, 0.0433]", "[0.0751, 0.0433]"), ("[0.075, 0.0433]", "[-0.075, 0.0433]")],
            "axes[0].anchor_point_m",
            "turn the platform over",
            True,
        ),
        (
            [("[-0.075, 0.0433]", "[-0.075, 0.0]"), ("[0.075, 0.0433]", "[0.075, 0.0]"),
             ("[0.0, -0.0866]", "[0.0, -0.3]")],
            "axes[0].anchor_point_m",
            "which no cable can prevent",
            False,
        ),
    ],
)  # fmt: skip
def test_infeasible_settings_are_reported_with_a_remedy(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    replaced: list[tuple[str, str]],
    key: str,
    problem: str,
    impossible: bool,
) -> None:
    robot = robot_of(tmp_path, *replaced)
    told = diagnose(robot)
    about = [found for found in told if found.key == key]
    assert about, told
    assert any(problem in found.text and found.impossible is impossible for found in about), about
    # compute the findings, which take seconds, only once
    monkeypatch.setattr(
        "cdpr_rt.diagnosis.checks.diagnose", lambda asked, _limits: told if asked is robot else []
    )
    if impossible:
        with pytest.raises(ProfileError, match=r"mine\.toml: ") as caught:
            refuse_impossible(robot)
        assert f"{key}: " in str(caught.value)
    else:
        assert any(f"{key}: " in line for line in refuse_impossible(robot))


def test_more_cables_than_a_daemon_runs_are_reported(tmp_path: Path) -> None:
    axes = re.findall(r"\[\[axes\]\][^\[]*(?:\[[\d., -]*\][^\[]*)*", SUSPENDED)
    more = [re.sub('name = "', f'name = "{i}', axis) for i in range(1, 3) for axis in axes]
    more = [re.sub(r"node_id = .*", f"node_id = {20 + k}", axis) for k, axis in enumerate(more)]
    text = SUSPENDED + "\n".join(re.sub(r"4\.0\]", "3.5]", axis) for axis in more)
    assert findings_of(tmp_path, text)["axes"] == "24; allowed: up to 16, as many as a daemon runs"


def on_seven(anchor_arm_m: float, winch: str) -> str:
    """Return the file of a platform with four cables from above and three from below."""
    x, y = 0.15 * anchor_arm_m / 0.18, 0.1 * anchor_arm_m / 0.18
    ends = [(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1), (0, -1, -1), (1, 1, -1), (-1, 1, -1)]
    axes = "".join(
        f"""
        [[axes]]
        name = "{i}"
        winch = "{winch}"
        bus = "only"
        node_id = {i + 1}
        exit_point_m = [{a}.0, {b}.0, {1.0 + c}]
        anchor_point_m = [{a * x}, {b * y}, {0.05 * c}]
        """
        for i, (a, b, c) in enumerate(ends)
    )
    return f"""
        name = "Seven"
        sync_period_s = 0.002
        [[buses]]
        name = "only"
        url = "socketcan:can0"
        [platform]
        mass_kg = 2.0
        home_m = [0.0, 0.0, 0.6]
        workspace_min_m = [-0.1, -0.1, 0.8]
        workspace_max_m = [0.1, 0.1, 1.0]
        workspace_angle_rad = 0.01
        angular_speed_rad_s = 0.3
        angular_acceleration_rad_s2 = 1.0
        speed_m_s = 0.3
        acceleration_m_s2 = 1.0
        [limits]
        torque_Nm = 3.5
        tension_min_N = 15.0
        tension_max_N = 200.0
        {axes}"""


def test_friction_does_not_destabilise_a_platform_held_by_set_point_tensions(
    tmp_path: Path,
) -> None:
    assert "axes[0].anchor_point_m" not in findings_of(tmp_path, on_seven(0.18, "winch-300n"))


def test_friction_that_turns_a_planar_platform_is_reported_without_axis(tmp_path: Path) -> None:
    plate = (SHIPPED / "robots" / "planar-4.toml").read_text()
    text = plate.replace("anchor_point_m = [-0.2, -0.1]", "anchor_point_m = [0.0, 0.0]")
    told = findings_of(tmp_path, text)["axes[0].anchor_point_m"]
    found = re.search(
        r"friction of 12 N, .* turns the platform by ([\d.]+) deg until the control overcomes it "
        r"\(1 mm of each cable is ([\d.]+) deg\).*hold a rotation of at most ([\d.]+) deg",
        told,
    )
    assert found is not None, told
    turned, per_mm, held = map(float, found.groups())
    assert held < turned and per_mm > 0.1


def test_a_stand_too_close_to_an_exit_point_is_reported(tmp_path: Path) -> None:
    # the lower anchor point is 87 mm below the platform's origin
    told = diagnose(robot_of(tmp_path, ("exit_point_m = [0.0, 0.0]", "exit_point_m = [0.0, 1.15]")))
    about = [f for f in told if f.key == "platform.home_m" and f.impossible]
    assert about and about[0].text.startswith("the platform at rest reaches up to 0.063 m from")
    assert "axes[2] (lower); allowed: 0.1 m or more" in about[0].text
