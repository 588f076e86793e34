"""What a daemon tells of its robot can be written as JSON, whatever the robot's file has."""

import json
from types import SimpleNamespace

import pytest

from cdpr_profiles import load_robot
from cdpr_profiles.catalogue import list_profiles
from cdpr_rt.robots.robot_arrays import limits_of
from cdpr_tools.daemon.loop_process import description


@pytest.mark.parametrize("name", list_profiles()["robots"])
def test_every_shipped_robot_is_described(name: str) -> None:
    robot, parts = load_robot(name), SimpleNamespace(programs={}, lowering=None)
    told = json.loads(json.dumps(description(robot, limits_of(robot), parts)))  # type: ignore[arg-type]
    assert [axis["name"] for axis in told["axes"]] == [axis.name for axis in robot.axes]
    if robot.platform is not None:
        assert told["platform"]["home_m"] == list(robot.platform.home_m)
