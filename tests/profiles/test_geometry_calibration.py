"""The calibration beside a robot's file is applied, validated, versioned and undone."""

from __future__ import annotations

import shutil
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from cdpr_profiles import ProfileError, Robot, load_robot
from cdpr_profiles.calibration_in_force import (
    calibrated,
    calibration_file,
    next_version,
    take_over,
    undo,
)
from cdpr_profiles.geometry_calibration import GeometryCalibration, geometry_sha256
from cdpr_profiles.places import SHIPPED


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    path = tmp_path / "mine.toml"
    shutil.copy(SHIPPED / "robots" / "planar-4.toml", path)
    return load_robot(path)


def calibration(robot: Robot, version: int = 1, move_m: float = 0.01) -> GeometryCalibration:
    platform = robot.platform
    assert platform is not None
    return GeometryCalibration(
        robot=robot.profile,
        geometry_sha256=geometry_sha256(robot),
        simulated=False,
        version=version,
        date=datetime(2026, 3, 4, 5, 6, tzinfo=UTC),
        method="points",
        frame="the room",
        exit_points_m=tuple((x + move_m, *rest) for x, *rest in platform.exit_points_m),
        home_m=(platform.home_m[0] + 0.002, *platform.home_m[1:]),
        home_rotation_rad=platform.home_rotation_rad,
        drum_scales=(1.01, 1.0, 0.99, *(1.0 for _ in robot.axes[3:])),
        elongation_scale=1.4,
        poses=40,
        exit_std_m=(0.001,) * len(robot.axes),
        predicted_3_sigma_mm=0.5,
        verified_poses=8,
        verified_mean_mm=0.7,
        verified_worst_mm=1.5,
        raw_data="data.json",
    )


def test_a_robot_without_calibration_is_as_its_file_says(robot: Robot) -> None:
    assert calibrated(robot) is robot
    assert next_version(robot) == 1


def test_calibration_replaces_the_geometry_of_the_robots_file(robot: Robot) -> None:
    path = take_over(robot, calibration(robot))
    assert path == calibration_file(robot) and path.parent == robot.path.parent
    told = calibrated(robot)
    assert told.platform is not None and robot.platform is not None
    for here, before in zip(told.platform.exit_points_m, robot.platform.exit_points_m, strict=True):
        assert here[0] == pytest.approx(before[0] + 0.01)
    first, before_first = told.axes[0].winch, robot.axes[0].winch
    assert first.drum_radius_m == pytest.approx(1.01 * before_first.drum_radius_m)
    assert first.cable.stiffness_N == pytest.approx(before_first.cable.stiffness_N / 1.4)
    assert told.platform.home_m[0] == pytest.approx(robot.platform.home_m[0] + 0.002)
    assert told.calibration == calibration(robot)
    # the file is unchanged: a simulator that loads it does not see the calibration
    assert load_robot(robot.path).platform == robot.platform


def test_calibration_is_read_back_as_written(robot: Robot) -> None:
    given = calibration(robot)
    held = GeometryCalibration.load_file(take_over(robot, given))
    assert held == given
    assert held.identity == given.identity
    assert calibration(robot, move_m=0.011).identity != given.identity


def test_undo_restores_one_version_at_a_time(robot: Robot) -> None:
    take_over(robot, calibration(robot, 1))
    assert next_version(robot) == 2
    take_over(robot, calibration(robot, 2, 0.02))
    assert next_version(robot) == 3
    back = undo(robot)
    assert back is not None and back.version == 1
    held = calibrated(robot).calibration
    assert held is not None and held.version == 1
    assert undo(robot) is None
    assert calibrated(robot) is robot
    assert next_version(robot) == 3, "no version number is used twice"
    with pytest.raises(ProfileError, match="no calibration is in force"):
        undo(robot)


def test_calibration_is_rejected_after_the_robots_geometry_changed(robot: Robot) -> None:
    take_over(robot, calibration(robot))
    text = robot.path.read_text()
    robot.path.write_text(text + "\n# a remark\n")
    assert calibrated(load_robot(robot.path)).calibration is not None
    robot.path.write_text(text.replace("home_m = [0.0,", "home_m = [0.01,", 1))
    with pytest.raises(ProfileError, match=r"has changed since .* cdpr calibrate undo"):
        calibrated(load_robot(robot.path))


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"drum_scales": (1.0, 1.0)}, "drum_scales: 2 entries; allowed: 4"),
        ({"drum_scales": (1.0, 3.0, 1.0, 1.0)}, r"drum_scales\[1\]"),
        ({"home_m": (0.0, 0.0, 0.0)}, "allowed: 2 coordinates"),
        ({"exit_points_m": ((9.0, 3.0),) * 4}, "more than 0.2 m"),
        ({"home_rotation_rad": (0.0, 0.0, 0.0)}, "home_rotation_rad"),
        ({"home_rotation_rad": (1000.0,)}, "home_rotation_rad"),
        ({"home_m": (500.0, 400.0)}, "home_m"),
        ({"robot": "other"}, "robot: value 'other'"),
        ({"anchor_points_m": ((7.0, 0.0),) * 4}, r"anchor_points_m\[0\]"),
        ({"anchor_points_m": ((0.0, 0.0),) * 3}, "3 entries"),
        ({"elongation_scale": 1e-300}, "elongation_scale"),
        ({"drum_scales": (0.51, 1.0, 1.0, 1.0)}, r"drum_scales\[0\]"),
    ],
)
def test_calibration_that_does_not_fit_the_robot_is_rejected(
    robot: Robot, change: dict[str, object], named: str
) -> None:
    wrong = calibration(robot).model_copy(update=change)
    with pytest.raises(ProfileError, match=named):
        take_over(robot, wrong)
    calibration_file(robot).write_text(wrong.to_toml())
    with pytest.raises(ProfileError, match=named):
        calibrated(robot)


def test_error_for_a_damaged_calibration_names_its_file(robot: Robot) -> None:
    calibration_file(robot).write_text("robot = 7\n")
    with pytest.raises(ProfileError, match=r"mine\.calibration"):
        calibrated(robot)


def test_calibration_of_a_shipped_robot_is_kept_in_the_users_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    shipped = load_robot("planar-4")
    take_over(shipped, calibration(shipped))
    assert calibration_file(shipped).is_relative_to(tmp_path)
    assert calibrated(load_robot("planar-4")).calibration is not None
    winch = replace(shipped, is_winch=True)
    assert calibrated(winch) is winch


def test_undo_does_not_restore_a_version_for_another_geometry(robot: Robot) -> None:
    take_over(robot, calibration(robot, 1))
    path = take_over(robot, calibration(robot, 2, 0.02))
    older = path.with_name(path.name + ".1")
    older.write_text(older.read_text().replace(calibration(robot).geometry_sha256, "0"))
    assert undo(robot) is None
    assert calibrated(robot) is robot


def test_versions_of_a_robot_with_a_similar_name_are_ignored(tmp_path: Path) -> None:
    named, other = tmp_path / "a[1].toml", tmp_path / "a1.toml"
    for path in (named, other):
        shutil.copy(SHIPPED / "robots" / "planar-4.toml", path)
    for version in (1, 2):
        take_over(load_robot(other), calibration(load_robot(other), version))
    assert next_version(load_robot(named)) == 1


def test_a_calibration_that_cannot_be_read_is_an_error(robot: Robot) -> None:
    path = take_over(robot, calibration(robot))
    elsewhere = path.with_name("share")
    path.rename(elsewhere)
    path.symlink_to(elsewhere)
    assert calibrated(robot).calibration is not None, "a link to a file is as good as the file"
    elsewhere.rename(elsewhere.with_name("unmounted"))
    for refused in (calibrated, next_version, undo):
        with pytest.raises(ProfileError, match=r"is a link to .*, which does not exist; mount or"):
            refused(robot)
    path.unlink()
    path.mkdir()
    for refused in (calibrated, undo):
        with pytest.raises(ProfileError, match="is no"):
            refused(robot)


def test_a_calibration_folder_that_is_not_mounted_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    shipped = load_robot("planar-4")
    assert calibrated(shipped) is shipped
    (tmp_path / "cdpr-rt").symlink_to(tmp_path / "share")
    with pytest.raises(ProfileError, match=r"cdpr-rt is a link to .*share, which does not exist"):
        calibrated(shipped)
