"""A robot finds what commissioning has learnt of its motors, and takes no other motor's for it."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

from cdpr_rt.cogging_profile import CoggingProfileError
from drivers.boot import BootReport
from profiles import Robot, load_robot
from profiles.errors import ProfileError
from sim_bus.plant import Plant
from tests.profiles.test_robot_limits import calibration
from tests.tools.motor_profiles import leave_profiles
from tests.tools.robot_rig import robot_file
from tools.commissioned import (
    compensation_of,
    folder_of,
    load_profiles,
    refuse_strangers,
    with_commissioned,
    without_commissioned,
)
from tools.daemon.status_text import compensation_text
from tools.errors import BadInputError
from tools.robot_commissioning import chosen_axes

PROFILE = "cogging-profile.json"


@pytest.fixture
def robot() -> Robot:
    return load_robot("planar-3")


@pytest.fixture
def learnt(robot: Robot, tmp_path: Path) -> Path:
    return leave_profiles(robot, [Plant()] * 3, tmp_path / "learnt")


def test_each_axis_has_a_folder_of_its_own(robot: Robot, learnt: Path) -> None:
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


def test_axes_that_are_not_commissioned_yet_are_left_as_they_are(
    robot: Robot, learnt: Path
) -> None:
    (learnt / "upper-right" / PROFILE).unlink()
    profiles = load_profiles(with_commissioned(robot, learnt))
    assert [p is not None for p in profiles] == [True, False, True]
    for name in ("upper-left", "lower"):
        (learnt / name / PROFILE).unlink()
    with pytest.raises(BadInputError, match=r"--commissioned .*learnt: no cogging-profile"):
        with_commissioned(robot, learnt)


def test_the_robots_file_names_a_folder_or_a_file(robot: Robot, learnt: Path) -> None:
    text = robot_file(learnt.parent, [("can0", 1), ("can0", 2)]).read_text()
    own = text.replace("node_id = 1", 'node_id = 1\ncommissioned = "learnt/upper-left"')
    own = own.replace("node_id = 2", f'node_id = 2\ncommissioned = "learnt/lower/{PROFILE}"')
    path = learnt.parent / "own.toml"
    path.write_text(own)
    assert all(load_profiles(load_robot(path)))
    path.write_text(own.replace("learnt/upper-left", "learnt/nowhere"))
    with pytest.raises(BadInputError, match=r"axis axis 0: .*nowhere: cannot be read"):
        load_profiles(load_robot(path))
    path.write_text(own.replace('"learnt/upper-left"', "7"))
    with pytest.raises(ProfileError, match="commissioned"):
        load_robot(path)


def test_a_damaged_profile_or_another_motors_is_refused(robot: Robot, learnt: Path) -> None:
    path = learnt / "lower" / PROFILE
    whole = path.read_text()
    found = with_commissioned(robot, learnt)
    path.write_text(whole.replace('"MPP0923D"', '"MPP1003D"'))
    with pytest.raises(BadInputError, match=r"axis lower: .*MPP1003D'; allowed: MPP0923D"):
        load_profiles(found)
    path.write_text(whole[: len(whole) // 2])
    with pytest.raises(BadInputError, match=r"axis lower: .*cogging-profile\.json"):
        load_profiles(found)


def test_another_drive_is_refused_by_its_serial_number(robot: Robot, learnt: Path) -> None:
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
    refuse_strangers(found, profiles, reports)
    reports[1] = replace(reports[1], serial=77)
    with pytest.raises(CoggingProfileError, match=r"axis upper right: .*serial = 2, .* has 77"):
        refuse_strangers(found, profiles, reports)
    refuse_strangers(found, (profiles[0], None, profiles[2]), reports)


@pytest.mark.parametrize(("booted", "refused"), [(1, False), (0, False), (77, True)])
def test_a_calibration_of_a_winch_with_another_drive_is_refused(
    robot: Robot, booted: int, refused: bool
) -> None:
    drive = robot.axes[0].winch.drive
    report = BootReport(node_id=1, vendor_id=drive.vendor_id, serial=booted)
    axes = (replace(robot.axes[0], calibration=calibration()), *robot.axes[1:])
    told = r"axes\[0\]\.calibration: .*serial 1, that of axis upper left has 77; calibrate it anew"
    with pytest.raises(BadInputError, match=told) if refused else nullcontext():
        refuse_strangers(replace(robot, axes=axes), (None,) * 3, [report])


def test_motors_to_commission_are_named(robot: Robot, tmp_path: Path) -> None:
    everything = chosen_axes(robot, (), True, tmp_path)
    assert [motor.winch.node_id for motor in everything] == [1, 2, 3]
    one = chosen_axes(robot, ("lower", "lower"), False, tmp_path)
    assert [motor.paths.out for motor in one] == [tmp_path / "lower"]
    for names, every in (((), False), (("lower",), True)):
        with pytest.raises(BadInputError, match="'upper left', 'upper right', 'lower'"):
            chosen_axes(robot, names, every, tmp_path)
    with pytest.raises(BadInputError, match=r"--axis left: no axis of .*'upper left'"):
        chosen_axes(robot, ("left",), False, tmp_path)


def test_the_status_tells_which_motors_are_compensated() -> None:
    axes = [
        {"name": "left", "commissioned": "a", "index_known": True},
        {"name": "right", "commissioned": "b", "index_known": False},
        {"name": "lower", "commissioned": None, "index_known": True},
    ]
    told = compensation_text(axes)
    assert told == "compensated: left; not compensated before its index passes: right"
    assert compensation_text([{"name": "left"}]) == ""
