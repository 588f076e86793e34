"""Robot files are found, read and validated."""

from pathlib import Path

import pytest

import cdpr_profiles
from cdpr_profiles import ProfileError, Robot, Winch, load_robot, load_winch_or_robot

TWO_AXES = """
name = "Two"
{top}
[[buses]]
name = "left"
[[buses]]
name = "right"
bitrate_bit_s = 500000
[[axes]]
winch = "{winch}"
bus = "{bus}"
node_id = {node}
[[axes]]
winch = "winch-mpp0923d"
bus = "left"
node_id = 2
mandatory = false
"""


def robot_file(folder: Path, **changes: object) -> Path:
    values = {"top": "", "winch": "winch-mpp0923d", "bus": "right", "node": 2} | changes
    path = folder / "two.toml"
    path.write_text(TWO_AXES.format(**values))
    return path


def test_the_shipped_robot_has_four_winches_on_each_of_two_buses():
    robot = load_robot("spatial-8")
    assert [robot.axes_on(bus.name) for bus in robot.buses] == [(0, 1, 2, 3), (4, 5, 6, 7)]
    assert robot.sync_period_s == 0.001
    assert all(axis.mandatory for axis in robot.axes)
    assert robot.reference == "spatial-8"
    assert "spatial-8" in cdpr_profiles.list_profiles()["robots"]
    assert isinstance(cdpr_profiles.load_all()["robots"]["spatial-8"], Robot)


def test_winches_inherit_node_id_bit_rate_and_period_from_the_robot(tmp_path: Path):
    robot = load_robot(robot_file(tmp_path, top="sync_period_s = 0.004\nmaster_node_id = 100"))
    right, left = robot.axes
    # one node id on each of two buses is allowed
    assert (right.winch.node_id, left.winch.node_id) == (2, 2)
    assert (right.winch.bitrate_bit_s, left.winch.bitrate_bit_s) == (500_000, 1_000_000)
    assert {axis.winch.sync_period_s for axis in robot.axes} == {0.004}
    assert {axis.winch.master_node_id for axis in robot.axes} == {100}
    assert not left.mandatory
    assert robot.reference == str(tmp_path / "two.toml")
    assert load_robot(robot.reference) == robot


@pytest.mark.parametrize(
    ("changes", "key", "problem"),
    [
        ({"bus": "left"}, "buses[1].name", "axes[1].node_id: value 2; axes[0] already has it"),
        ({"bus": "rigth"}, "buses[1].name", "allowed: a bus with at least one axis"),
        ({"bus": "rigth"}, "buses[1].name", "axes[0].bus: value 'rigth'; allowed: left, right"),
        ({"top": "master_node_id = 2"}, "axes[0].node_id", "any but master_node_id"),
        ({"node": 128}, "axes[0].node_id", "less than or equal to 127"),
        ({"winch": "winch-mpp0932d"}, "axes[0].winch", "did you mean 'winch-mpp0923d'?"),
        ({"top": "sync_periods = 1"}, "sync_periods", "did you mean 'sync_period_s'?"),
    ],
)
def test_contradictory_profiles_are_rejected(
    tmp_path: Path, changes: dict[str, object], key: str, problem: str
):
    path = robot_file(tmp_path, **changes)
    with pytest.raises(ProfileError) as caught:
        load_robot(path)
    assert (caught.value.file, caught.value.key) == (str(path), key)
    assert problem in str(caught.value)


def test_two_buses_of_the_same_name_are_rejected(tmp_path: Path):
    path = robot_file(tmp_path, bus="left", node=1)
    path.write_text(path.read_text().replace('name = "right"', 'name = "left"'))
    with pytest.raises(ProfileError, match=r"buses\[1\].name: value 'left'; allowed: each name"):
        load_robot(path)


def test_a_machine_is_loaded_as_winch_or_robot(tmp_path: Path):
    assert isinstance(load_winch_or_robot("winch-mpp0923d"), Winch)
    assert isinstance(load_winch_or_robot("spatial-8"), Robot)
    assert isinstance(load_winch_or_robot(robot_file(tmp_path)), Robot)
    winch = tmp_path / "winch.toml"
    winch.write_text((cdpr_profiles.places.SHIPPED / "winches/winch-mpp0923d.toml").read_text())
    assert isinstance(load_winch_or_robot(winch), Winch)
    with pytest.raises(ProfileError, match="did you mean 'spatial-8'"):
        load_winch_or_robot("spatial8")


def test_paths_of_devices_are_relative_to_the_robots_file(tmp_path: Path):
    shipped = cdpr_profiles.places.SHIPPED / "safety_io/modbus-remote-io.toml"
    (tmp_path / "io.toml").write_text(shipped.read_text())
    top = 'safety_io = "./io.toml@127.0.0.1:1502"\nrails = ["rail-modbus", "sub/mine.toml"]'
    robot = load_robot(robot_file(tmp_path, top=top, node=1))
    assert robot.safety_io == f"{tmp_path / 'io.toml'}@127.0.0.1:1502"
    assert robot.rails == ("rail-modbus", str(tmp_path / "sub/mine.toml"))
    named = robot_file(tmp_path, top='tension_sensors = "rtu-load-cell-1"')
    assert load_robot(named).tension_sensors == "rtu-load-cell-1"
    wrong = robot_file(tmp_path, top='tension_sensors = "rtu-load-cell-8"')
    with pytest.raises(ProfileError, match="did you mean 'rtu-load-cells-8'") as caught:
        load_robot(wrong)
    assert (caught.value.file, caught.value.key) == (str(wrong), "tension_sensors")
    wrong = robot_file(tmp_path, top='tension_sensors = "rtu-load-cells-8"')
    with pytest.raises(ProfileError, match="8 sensors; allowed: up to 2, one for each") as caught:
        load_robot(wrong)
    assert (caught.value.file, caught.value.key) == (str(wrong), "tension_sensors")


def test_a_safety_io_requires_unique_node_ids_on_all_buses(tmp_path: Path):
    path = robot_file(tmp_path, top='safety_io = "modbus-remote-io"')
    with pytest.raises(ProfileError, match="the safety_io identifies brakes by node id") as caught:
        load_robot(path)
    assert caught.value.key == "axes[1].node_id"
