"""The daemon's description of each robot is valid JSON."""

import json
from types import SimpleNamespace

import pytest

from cdpr_drivers.errors import ConfigurationError
from cdpr_drivers.robot.robot_buses import refuse_simulated_calibration
from cdpr_profiles import load_robot
from cdpr_profiles.calibration_in_force import load_calibrated, take_over, undo
from cdpr_profiles.catalogue import list_profiles
from cdpr_rt.model.calibration_state import mark_calibrated
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_tools.composition.loop_parts import description, look_at_calibration
from cdpr_tools.robots.calibration_text import calibration_text
from tests.profiles.test_geometry_calibration import calibration


@pytest.mark.parametrize("name", list_profiles()["robots"])
def test_each_shipped_robot_is_described(name: str) -> None:
    robot, parts = load_robot(name), SimpleNamespace(programs={}, lowering=None)
    told = json.loads(json.dumps(description(robot, limits_of(robot), parts)))  # type: ignore[arg-type]
    assert [axis["name"] for axis in told["axes"]] == [axis.name for axis in robot.axes]
    if robot.platform is not None:
        assert told["platform"]["home_m"] == list(robot.platform.home_m)


def test_targets_require_the_calibration_in_force(tmp_path, monkeypatch) -> None:
    for folder in ("XDG_CONFIG_HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(folder, str(tmp_path))
    before, platform = load_calibrated("planar-4"), SimpleNamespace(not_calibrated_reason="")
    take_over(before, calibration(before))
    mark_calibrated("planar-4", "calibration 1")
    known = load_calibrated("planar-4").calibration
    assert known is not None
    assert calibration_text(known.summary()).startswith("calibration 1 ")
    look_at_calibration(before, platform)  # type: ignore[arg-type]
    assert "restart the daemon" in platform.not_calibrated_reason
    now = load_calibrated("planar-4")
    look_at_calibration(now, platform)  # type: ignore[arg-type]
    assert platform.not_calibrated_reason == ""
    undo(before)
    look_at_calibration(now, platform)  # type: ignore[arg-type]
    assert "adopted or undone" in platform.not_calibrated_reason


def test_a_calibration_of_a_simulated_robot_is_rejected_on_a_real_bus() -> None:
    robot = load_robot("planar-4")
    found = calibration(robot).model_copy(update={"simulated": True})
    refuse_simulated_calibration(found.applied(robot), ["simbus:here"])
    refuse_simulated_calibration(found.applied(robot), ["simbus:"])
    with pytest.raises(ConfigurationError, match="measured on a simulated robot"):
        refuse_simulated_calibration(
            found.applied(robot), [f"{robot.buses[0].name}=socketcan:can0"]
        )
