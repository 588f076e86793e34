"""The planner's plans for a robot are accepted by its control."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import Robot, load_robot
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.model.robot_arrays import limits_of, winches_of
from cdpr_rt.motion.path_description import Move, PathDescription
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.model import model_of
from cdpr_rt.programs.path_planning import PathPlanner
from cdpr_rt.programs.path_store import PathStore, write_plan
from cdpr_rt.programs.registry import platform_parts


def with_torque(share: float) -> Robot:
    robot = load_robot("planar-3")
    assert robot.limits.torque_Nm is not None
    torque_Nm = tuple(share * each for each in robot.limits.torque_Nm)
    return replace(robot, limits=robot.limits.model_copy(update={"torque_Nm": torque_Nm}))


@pytest.mark.parametrize("share", [1.0, 0.8])
def test_a_plan_for_the_robot_is_accepted_by_its_control(share: float, tmp_path: Path) -> None:
    """Also if motor torque limits the tensions; but not for other motors."""
    robot, n = with_torque(share), 3
    planner = PathPlanner(robot)
    model = planner.model
    assert (model.torque_limited_N < model.high_N).all() == (share < 1.0)
    start = 0.5 * np.add(planner.platform.workspace_min_m, planner.platform.workspace_max_m)
    path = PathDescription("line.nc", planner.coordinates, start, 1)
    path.add(Move(2, np.add(start, [0.1, 0.0]), np.inf, 0.0))
    timed = planner.plan(path).timed
    assert timed is not None
    name = write_plan(tmp_path, timed, np.full(len(timed.samples), 2), "line.nc", model)
    axes, limits = robot.axes, limits_of(robot)
    axis_model = model_of(axes, 1e-3, [2.3e-3] * n, limits)
    estimator = Estimator(n, 1e-3, winches_of(axes))
    parts = platform_parts(robot, limits, axis_model, estimator)
    assert parts is not None
    parts.paths.open(tmp_path)
    parts.paths.load(name)
    assert parts.paths.is_loaded(name)
    highest_N = model.torque_limited_N - model.reserve_N
    np.testing.assert_allclose(parts.control.workspace.high, highest_N)
    other = PathStore(platform_model_of(with_torque(0.8 * share)))
    other.open(tmp_path)
    with pytest.raises(ProgramError, match="another robot, or its file has changed"):
        other.load(name)
