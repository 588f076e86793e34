"""Predictions for a slipping cable agree with kinematics and the limit of lengths."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from cdpr_profiles import Robot, load_robot
from cdpr_rt.diagnosis.predictions import slips
from cdpr_rt.diagnosis.subject import Subject
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.model.robot_arrays import limits_of
from tests.cdpr_rt.diagnosis.robots import with_cables

UPPER = 3


def one_carries() -> Robot:
    """Return a point on three low cables and one upper cable that carries it."""
    file = load_robot("point-4")
    angles = np.radians([90.0, 210.0, 330.0])
    low = [(float(1.7 * np.cos(a)), float(1.7 * np.sin(a)), 0.1) for a in angles]
    platform = dataclasses.replace(
        file.platform,
        exit_points_m=(*low, (0.0, 0.0, 2.4)),
        anchor_points_m=((0.0, 0.0, 0.0),) * 4,
        home_m=(0.0, 0.0, 0.45),
        workspace_min_m=(-0.2, -0.2, 0.5),
        workspace_max_m=(0.2, 0.2, 0.85),
    )
    return dataclasses.replace(file, platform=platform)


@pytest.mark.parametrize("robot", [one_carries(), load_robot("planar-3")], ids=["one", "planar"])
def test_the_largest_undetected_slip_displaces_the_platform_as_predicted(robot: Robot) -> None:
    model, allowed_m = platform_model_of(robot), limits_of(robot).lengths_disagree_m
    k, n = model.positions, len(robot.axes)
    places = [model.home[:k], *map(np.array, Subject(robot).corner_targets)]
    for i, told in enumerate(slips(Subject(robot))):
        slip_m, off_m = [], []
        for place in places:
            J = model.kinematics.jacobian(model.pose(place))
            moved = np.linalg.lstsq(J, np.eye(n)[i], rcond=None)[0]
            left = np.eye(n)[i] - J @ moved
            slip_m.append(allowed_m / np.sqrt(left[i]))
            off_m.append(slip_m[-1] * float(np.linalg.norm(moved[:k])))
        assert told.unnoticed_m == pytest.approx(max(slip_m))
        assert told.off_m == pytest.approx(max(off_m))


def test_a_platform_sinks_by_most_of_a_slip_of_its_only_carrying_cable() -> None:
    model = platform_model_of(one_carries())
    lengths_m = model.kinematics.lengths(model.home_pose) + 0.03 * np.eye(4)[UPPER]
    found = model.kinematics.pose_from_lengths(lengths_m, model.home_pose)
    off_m = float(np.linalg.norm(found.pose.p - model.home_pose.p))
    assert 0.02 < off_m < 0.03 * slips(Subject(one_carries()))[UPPER].off_per_m * 1.05


def test_most_of_an_undetected_slip_of_the_only_carrying_cable_displaces_the_platform() -> None:
    told = slips(Subject(one_carries()))
    assert told[UPPER].unnoticed_m > 2.0 * limits_of(one_carries()).lengths_disagree_m
    assert told[UPPER].off_m > 0.8 * told[UPPER].unnoticed_m


def test_a_sudden_slip_is_detected_earlier_than_a_slow_one() -> None:
    for told in slips(Subject(one_carries())):
        assert 0.0 < told.sudden_m < 0.5 * told.unnoticed_m


def test_no_slip_is_detected_without_a_redundant_cable() -> None:
    for told in slips(Subject(load_robot("suspended-6"))):
        assert told.unnoticed_m == told.sudden_m == np.inf
        assert told.off_per_m > 0.5


def test_stiffer_cables_have_a_higher_tension_peak_after_a_slip() -> None:
    robot = load_robot("planar-3")
    stiff = 0.25 * robot.axes[0].winch.cable.elongation_percent_per_N
    stiffer = with_cables(robot, elongation_percent_per_N=stiff)
    for before, after in zip(slips(Subject(robot)), slips(Subject(stiffer)), strict=True):
        assert before.peak_N < after.peak_N
