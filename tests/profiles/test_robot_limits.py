"""Limits, reactions, axis names, calibrations and heartbeat in a robot's file."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drivers.bus.budget import machine_budget
from cdpr_profiles import ProfileError, load_robot
from cdpr_profiles.bounded_input import read_toml
from cdpr_profiles.places import SHIPPED
from cdpr_profiles.platform import PlatformFile
from cdpr_profiles.reader import validated
from cdpr_profiles.robot_limits import Limit, Reactions, RobotLimits
from cdpr_profiles.winch_calibration import WinchCalibration
from cdpr_rt.core.states import Reaction
from cdpr_rt.core.supervisor import DEFAULT_REACTIONS
from cdpr_rt.model.robot_arrays import described, limits_of, winches_of

FILE = """
name = "Two"
{top}
[[buses]]
name = "can0"
[[axes]]
winch = "winch-mpp0923d"
bus = "can0"
node_id = 1
{first}
[[axes]]
winch = "winch-mpp0923d"
bus = "can0"
node_id = 2
{second}
[limits]
{limits}
[limits.reactions]
{reactions}
"""


def robot_file(folder: Path, **parts: str) -> Path:
    path = folder / "two.toml"
    keys = ("top", "first", "second", "limits", "reactions")
    path.write_text(FILE.format(**{key: parts.get(key, "") for key in keys}))
    return path


def test_a_robot_without_limits_gets_safe_defaults(tmp_path: Path) -> None:
    robot = load_robot(robot_file(tmp_path))
    limits, motor = limits_of(robot), robot.axes[0].winch.motor
    np.testing.assert_allclose(limits.torque_Nm, [motor.rated_torque_Nm] * 2)
    np.testing.assert_allclose(limits.torque_rate_Nm_s, [motor.rated_torque_Nm / 5e-3] * 2)
    np.testing.assert_allclose(limits.speed_rad_s, [0.2 * motor.rated_speed_rad_s] * 2)
    np.testing.assert_allclose(limits.following_error_rad, [math.tau] * 2)
    breaking_N = robot.axes[0].winch.cable.breaking_force_N
    np.testing.assert_allclose(limits.tension_max_N, [breaking_N / 5.0] * 2)
    for unknown in (limits.cable_length_max_m, -np.asarray(limits.cable_length_min_m)):
        np.testing.assert_array_equal(unknown, [math.inf] * 2)
    np.testing.assert_array_equal(limits.tension_min_N, [-math.inf] * 2)
    np.testing.assert_array_equal(limits.slack_N, [-math.inf] * 2)
    assert limits.reactions == DEFAULT_REACTIONS


def test_a_limit_is_one_number_for_all_axes_or_one_for_each(tmp_path: Path) -> None:
    text = "torque_Nm = [1.0, 2]\nspeed_rad_s = 30\ntension_min_N = [10.0, 20.0]"
    robot = load_robot(robot_file(tmp_path, limits=text, reactions='tension_low = "quick stop"'))
    limits = limits_of(robot)
    np.testing.assert_array_equal(limits.torque_Nm, [1.0, 2.0])
    np.testing.assert_array_equal(limits.speed_rad_s, [30.0, 30.0])
    np.testing.assert_array_equal(limits.slack_N, [2.5, 5.0])
    assert limits.reactions[Limit.TENSION_LOW] is Reaction.QUICK_STOP
    told = described(limits, 2)
    assert (told["torque_Nm"], told["cable_length_max_m"]) == ([1.0, 2.0], [None, None])
    assert (told["reactions"]["tension_low"], told["reactions"]["torque"]) == (
        "quick stop",
        "clamp",
    )


@pytest.mark.parametrize(
    ("parts", "key", "problem"),
    [
        ({"limits": "torque_Nm = [1.0, 2.0, 3.0]"}, "limits.torque_Nm", "allowed: 1 or 2"),
        (
            {"limits": "speed_rad_s = 1037.0"},
            "limits.speed_rad_s[0]",
            "2 times the motor's rated speed",
        ),
        ({"limits": "torque_Nm = 12.0"}, "limits.torque_Nm[0]", "the motor's peak torque (11.55)"),
        ({"limits": "torque_Nm = 0.0"}, "limits.torque_Nm[0]", "greater than 0"),
        ({"limits": "torque_Nm = true"}, "limits.torque_Nm[0]", "a valid number"),
        ({"limits": 'torque_Nm = "much"'}, "limits.torque_Nm[0]", "a valid number"),
        ({"limits": "torque_Nm = inf"}, "limits.torque_Nm[0]", "a finite number"),
        ({"limits": "torque = 1.0"}, "limits.torque", "did you mean 'torque_Nm'?"),
        ({"limits": "tension_max_N = 1e6"}, "limits.tension_max_N[0]", "the breaking force"),
        (
            {"limits": "tension_min_N = 20.0\ntension_max_N = [30.0, 10.0]"},
            "limits",
            "tension_min_N[1]: value 20; allowed: below tension_max_N (10)",
        ),
        ({"limits": "slack_N = 2.0"}, "limits", "slack_N: allowed only with tension_min_N"),
        ({"limits": "missed_cycles = -1"}, "limits.missed_cycles", "greater than or equal to 0"),
        (
            {"reactions": 'speed = "clamp"'},
            "limits.reactions.speed",
            "'quick stop' or 'torque off'",
        ),
        ({"reactions": 'safety_alarm = "hold"'}, "limits.reactions.safety_alarm", "'torque off'"),
        ({"reactions": 'sped = "hold"'}, "limits.reactions.sped", "did you mean 'speed'?"),
        ({"first": 'name = "axis 2"'}, "axes[1].name", "each once, but axes[0] also has it"),
        ({"first": 'name = "a"', "second": 'name = "a"'}, "axes[1].name", "axes[0] also has it"),
        ({"first": "cable_sign = 0"}, "axes[0].cable_sign", "-1 or 1"),
        ({"top": "master_heartbeat_s = 0.001"}, "master_heartbeat_s", "equal to 0.01"),
        (
            {"top": "master_heartbeat_s = 0.01\nsync_period_s = 0.01"},
            "master_heartbeat_s",
            "at least two cycles (0.02)",
        ),
    ],
)
def test_impossible_limits_are_rejected(
    tmp_path: Path, parts: dict[str, str], key: str, problem: str
) -> None:
    with pytest.raises(ProfileError) as caught:
        load_robot(robot_file(tmp_path, **parts))
    assert caught.value.key == key
    assert problem in str(caught.value)


LABELS = [reaction.label for reaction in Reaction if reaction]


@pytest.mark.parametrize("name", list(Reactions.model_fields))
def test_a_reaction_may_only_be_more_severe(name: str) -> None:
    least = DEFAULT_REACTIONS[Limit[name.upper()]]
    for label, reaction in zip(LABELS, list(Reaction)[1:], strict=True):
        table = {"reactions": {name: label}}
        if reaction >= least:
            told = validated(Path("x.toml"), table, RobotLimits)
            assert getattr(told.reactions, name) == label
        else:
            with pytest.raises(ProfileError, match="allowed: "):
                validated(Path("x.toml"), table, RobotLimits)


ANYTHING = st.one_of(
    st.floats(),
    st.integers(),
    st.booleans(),
    st.text(max_size=8),
    st.lists(st.floats(), max_size=3),
)
KEYS = st.sampled_from([*RobotLimits.model_fields, "torque", ""])


@settings(max_examples=100)
@given(st.dictionaries(KEYS, ANYTHING, max_size=4))
def test_any_value_of_a_limit_is_read_or_rejected_with_an_error(table: dict[str, object]) -> None:
    arrays = {k: tuple(v) if isinstance(v, list) else v for k, v in table.items()}
    try:
        told = validated(Path("x.toml"), arrays, RobotLimits)
    except ProfileError as error:
        assert "x.toml" in str(error)
        return
    figures = [getattr(told, key) for key in RobotLimits.model_fields if key != "reactions"]
    for figure in figures:
        for value in figure if isinstance(figure, tuple) else (figure,):
            assert value is None or (math.isfinite(value) and value >= 0)


# -- names, directions, heartbeat


def test_axes_have_names_and_cable_signs(tmp_path: Path) -> None:
    robot = load_robot(robot_file(tmp_path, first='name = "top left"', second="cable_sign = -1"))
    assert [axis.name for axis in robot.axes] == ["top left", "axis 2"]
    assert [axis.winch.cable_sign for axis in robot.axes] == [1, -1]
    arrays = winches_of(robot.axes)
    assert arrays.cable_m_per_rad[0] == -arrays.cable_m_per_rad[1] == pytest.approx(0.026)
    assert (arrays.gain_m > 0.0).all()


def calibration(motor: str = "MPP0923D") -> WinchCalibration:
    return WinchCalibration(
        winch="winch-mpp0923d",
        motor=motor,
        drive_serial=1,
        date=datetime(2026, 1, 2, tzinfo=UTC),
        method="masses",
        gain_m=0.027,
        gain_half_width_m=1e-4,
        nominal_gain_m=0.026,
        bias_Nm=0.01,
        bias_half_width_Nm=0.001,
        friction_Nm=0.08,
        friction_half_width_Nm=0.001,
        friction_per_N_m=1e-4,
        friction_per_N_half_width_m=1e-5,
        residual_rms_Nm=0.001,
        lowest_tension_N=20.0,
        highest_tension_N=80.0,
        raw_data=("a.raw",),
    )


def test_an_axis_uses_the_calibration_of_its_winch(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(calibration().to_toml())
    path = robot_file(tmp_path, second='calibration = "mine.toml"')
    arrays = winches_of(load_robot(path).axes)
    np.testing.assert_allclose(arrays.gain_m, [0.026, 0.027])
    np.testing.assert_allclose(arrays.friction_Nm, [0.0, 0.08])
    np.testing.assert_allclose(arrays.friction_per_N_m, [0.0, 1e-4])
    np.testing.assert_allclose(arrays.bias_Nm, [0.0, 0.01])
    (tmp_path / "mine.toml").write_text(calibration("MPP0922C").to_toml())
    with pytest.raises(ProfileError, match=r"mine\.toml: motor: .*'MPP0922C'; allowed"):
        load_robot(path)
    (tmp_path / "mine.toml").unlink()
    with pytest.raises(ProfileError, match=r"mine\.toml: cannot be read"):
        load_robot(path)


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [
        ("gain_m", 0.0129, "allowed: 0.013 to 0.039 m, 0.5 to 1.5 times drum_radius_m"),
        ("gain_m", 1e6, "allowed: 0.013 to 0.039 m, 0.5 to 1.5 times drum_radius_m"),
        ("bias_Nm", -1.6, "allowed: -1.5 to 1.5 Nm, 50 % of the rated torque of MPP0923D"),
        ("friction_Nm", 1.6, "allowed: -1.5 to 1.5 Nm, 50 % of the rated torque of MPP0923D"),
        ("friction_per_N_m", 0.03, "allowed: -0.027 to 0.027 m, gain_m"),
        ("highest_tension_N", 1e5, "N, the cable's breaking force"),
        ("lowest_tension_N", 81.0, "allowed: 0 to 80 N, highest_tension_N"),
    ],
)
def test_an_implausible_winch_calibration_is_rejected(
    tmp_path: Path, key: str, value: float, allowed: str
) -> None:
    spoilt = calibration().model_copy(update={key: value})
    (tmp_path / "mine.toml").write_text(spoilt.to_toml())
    path = robot_file(tmp_path, second='calibration = "mine.toml"')
    with pytest.raises(ProfileError) as refused:
        load_robot(path)
    assert refused.value.file.endswith("mine.toml")
    assert refused.value.key == key
    assert allowed in refused.value.problem


def test_drives_detect_a_missing_master_within_two_heartbeats(tmp_path: Path) -> None:
    robot = load_robot(robot_file(tmp_path, top="master_heartbeat_s = 0.04"))
    for axis in robot.axes:
        assert 1.5 * 0.04 < axis.winch.drive.heartbeat_consumer_s < 2 * 0.04
    (often,) = machine_budget(robot)
    (usual,) = machine_budget(load_robot(robot_file(tmp_path)))
    more_bits_s = (often.heartbeat_share - usual.heartbeat_share) * 1e6
    assert more_bits_s == pytest.approx(65 / 0.04 - 65 / 0.1)


def test_a_winch_loads_as_a_robot_with_one_axis() -> None:
    robot = load_robot("winch-mpp0923d")
    assert robot.is_winch
    assert [axis.name for axis in robot.axes] == ["axis 1"]
    assert robot.axes[0].winch.drive.heartbeat_consumer_s < 2 * robot.master_heartbeat_s
    assert limits_of(robot).torque_Nm == pytest.approx([3.0])
    assert load_robot(robot.reference) == robot
    assert load_robot(robot.path) == robot
    with pytest.raises(ProfileError, match=r"did you mean 'winch-mpp0923d'\?"):
        load_robot("winch-mpp0923")


# -- what the documentation says


DOCS = Path(__file__).parents[2] / "docs"


def test_the_documented_robot_loads_and_shows_all_keys(tmp_path: Path) -> None:
    text = (DOCS / "how-to" / "describing-your-robot.md").read_text()
    robot, _devices, platform, limits = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    winch = (SHIPPED / "winches" / "winch-mpp0923d.toml").read_text()
    (tmp_path / "my-winch.toml").write_text(winch)
    path = tmp_path / "my-robot.toml"
    path.write_text(robot + limits)
    (tmp_path / "right.toml").write_text(calibration().to_toml())
    told = load_robot(path)
    assert [axis.name for axis in told.axes] == ["axis 1", "right"]
    assert told.axes[1].calibration == calibration()
    figures = re.findall(r"^([a-z]\w+) = ", limits.partition("[limits.reactions]")[0], re.M)
    assert figures == [key for key in RobotLimits.model_fields if key != "reactions"]
    limits_in_force = limits_of(told)
    for figure in figures:
        in_force, in_file = getattr(limits_in_force, figure), getattr(told.limits, figure)
        assert np.all(np.equal(in_force, in_file)), figure
    path.write_text(platform)
    keys = read_toml(path)["platform"]
    documented = validated(path, keys, PlatformFile)
    shipped = load_robot("planar-4").platform
    assert shipped is not None
    absent = {"body", "obstacles", "poses_m"}  # planar-4 has none of these
    assert all(getattr(shipped, k) == value for k, value in documented if k not in absent)
    assert documented.body is not None and len(documented.obstacles) == 1
    assert list(keys) == list(PlatformFile.model_fields)


def test_the_documented_reactions_are_the_defaults() -> None:
    text = (DOCS / "reference" / "supervisor.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \|.*\| ([a-z ]+) \|$", text, re.M)
    assert rows == [(limit.key, reaction.label) for limit, reaction in DEFAULT_REACTIONS.items()]


def test_the_text_of_each_limit_takes_value_and_allowed_value() -> None:
    """Whoever detects a limit without a text writes the message."""
    for limit in Limit:
        assert limit.text.count("{") <= 2
        limit.text.format(1.0, 2.0)
