"""A robot finds the commissioning results of its motors and rejects those of other motors."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

from cdpr_drivers.canopen.boot import BootReport
from cdpr_drivers.errors import ConfigurationError
from cdpr_drivers.robot.commissioned import (
    check_drive_identities,
    compensation_of,
    folder_of,
    load_profiles,
    with_commissioned,
    without_commissioned,
)
from cdpr_profiles import Robot, load_robot
from cdpr_profiles.errors import ProfileError
from cdpr_rt.identification.cogging_profile import CoggingProfileError
from cdpr_sim_bus.robot.plant import Plant
from tests.profiles.test_robot_limits import calibration
from tests.tools.motor_profiles import leave_profiles
from tests.tools.robot_rig import robot_file

PROFILE = "cogging-profile.json"


@pytest.fixture
def robot() -> Robot:
    return load_robot("planar-3")


@pytest.fixture
def learnt(robot: Robot, tmp_path: Path) -> Path:
    return leave_profiles(robot, [Plant()] * 3, tmp_path / "learnt")


def test_each_axis_has_a_separate_folder(robot: Robot, learnt: Path) -> None:
    assert [folder_of(axis) for axis in robot.axes] == ["upper-left", "upper-right", "lower"]
    found = with_commissioned(robot, learnt)
    assert [axis.commissioned for axis in found.axes] == [
        learnt / "upper-left",
        learnt / "upper-right",
        learnt / "lower",
    ]
    known = compensation_of(robot, load_profiles(found))
    assert [one is not None for one in known] == [True] * 3
    assert not any(load_profiles(without_commissioned(found)))
    assert with_commissioned(found, None) is found


def test_axes_without_commissioning_results_run_without_compensation(
    robot: Robot, learnt: Path
) -> None:
    (learnt / "upper-right" / PROFILE).unlink()
    profiles = load_profiles(with_commissioned(robot, learnt))
    assert [p is not None for p in profiles] == [True, False, True]
    for name in ("upper-left", "lower"):
        (learnt / name / PROFILE).unlink()
    with pytest.raises(ConfigurationError, match=r"--commissioned .*learnt: no cogging-profile"):
        with_commissioned(robot, learnt)


def test_the_robots_file_may_name_a_folder_or_a_file_of_results(robot: Robot, learnt: Path) -> None:
    text = robot_file(learnt.parent, [("can0", 1), ("can0", 2)]).read_text()
    own = text.replace("node_id = 1", 'node_id = 1\ncommissioned = "learnt/upper-left"')
    own = own.replace("node_id = 2", f'node_id = 2\ncommissioned = "learnt/lower/{PROFILE}"')
    path = learnt.parent / "own.toml"
    path.write_text(own)
    assert all(load_profiles(load_robot(path)))
    path.write_text(own.replace("learnt/upper-left", "learnt/nowhere"))
    with pytest.raises(ConfigurationError, match=r"axis axis 1: .*nowhere: cannot be read"):
        load_profiles(load_robot(path))
    path.write_text(own.replace('"learnt/upper-left"', "7"))
    with pytest.raises(ProfileError, match="commissioned"):
        load_robot(path)


def test_a_damaged_profile_or_one_of_another_motor_is_rejected(robot: Robot, learnt: Path) -> None:
    path = learnt / "lower" / PROFILE
    whole = path.read_text()
    found = with_commissioned(robot, learnt)
    path.write_text(whole.replace('"MPP0923D"', '"MPP1003D"'))
    with pytest.raises(ConfigurationError, match=r"axis lower: .*MPP1003D'; allowed: MPP0923D"):
        load_profiles(found)
    path.write_text(whole[: len(whole) // 2])
    with pytest.raises(ConfigurationError, match=r"axis lower: .*cogging-profile\.json"):
        load_profiles(found)


def test_a_profile_of_another_drive_is_rejected_by_serial_number(
    robot: Robot, learnt: Path
) -> None:
    found = with_commissioned(robot, learnt)
    profiles = load_profiles(found)
    drive = robot.axes[0].winch.drive
    same = BootReport(
        node_id=1,
        vendor_id=drive.vendor_id,
        product_code=drive.product_code,
        revision=drive.revision or 0,
        serial=1,
        counts_per_turn=8192,
    )
    reports = [replace(same, node_id=i + 1, serial=i + 1) for i in range(3)]
    check_drive_identities(found, profiles, reports)
    reports[1] = replace(reports[1], serial=77)
    with pytest.raises(CoggingProfileError, match=r"axis upper right: .*serial = 2, .* has 77"):
        check_drive_identities(found, profiles, reports)
    check_drive_identities(found, (profiles[0], None, profiles[2]), reports)


@pytest.mark.parametrize(("booted", "refused"), [(1, False), (0, False), (77, True)])
def test_a_calibration_of_a_winch_with_another_drive_is_rejected(
    robot: Robot, booted: int, refused: bool
) -> None:
    drive = robot.axes[0].winch.drive
    report = BootReport(node_id=1, vendor_id=drive.vendor_id, serial=booted)
    axes = (replace(robot.axes[0], calibration=calibration()), *robot.axes[1:])
    told = (
        r"axes\[0\]\.calibration: .*serial 1, but that of axis upper left has 77; "
        "calibrate it again"
    )
    with pytest.raises(ConfigurationError, match=told) if refused else nullcontext():
        check_drive_identities(replace(robot, axes=axes), (None,) * 3, [report])
