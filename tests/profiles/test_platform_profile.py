"""The platform in a robot's file is read, and each invalid value is rejected with its key."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cdpr_profiles import ProfileError, load_robot
from cdpr_profiles.places import SHIPPED

PLANAR = (SHIPPED / "robots" / "planar-3.toml").read_text()


def changed(folder: Path, *replaced: tuple[str, str]) -> Path:
    text = PLANAR
    for old, new in replaced:
        assert old in text
        text = text.replace(old, new)
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_missing_keys_get_defaults() -> None:
    platform = load_robot("planar-3").platform
    assert platform is not None
    assert platform.controlled == ("x", "y")  # three cables in a plane do not control the angle
    assert (platform.inertia_kg_m2, platform.home_rotation_rad) == (None, (0.0,))
    assert (platform.centre_of_mass_m, platform.pulley_radius_m) == ((0.0, 0.0), (0.0,) * 3)
    assert platform.pulley_axes == ((0.0, 1.0),) * 3
    assert platform.angular_speed_rad_s == pytest.approx(0.5 / 0.1)  # the arm is at least 0.1 m
    in_space = load_robot("suspended-8").platform
    assert in_space is not None
    assert in_space.controlled == ("x", "y", "z", "rx", "ry", "rz")
    assert in_space.home_rotation_rad == in_space.centre_of_mass_m == (0.0,) * 3


def test_values_of_the_file_are_read(tmp_path: Path) -> None:
    said = (
        "mass_kg = 2.0\ninertia_kg_m2 = 0.01\ncentre_of_mass_m = [0.0, -0.01]\n"
        'home_rotation_rad = 0.1\ncontrolled = ["y", "x"]\ncable_model = "catenary"\n'
        'tension_distribution = "closed-form"'
    )
    pulley = "pulley_radius_m = 0.03\npulley_axis = [0.0, -2.0]\nexit_point_m = [0.0, 0.0]"
    path = changed(tmp_path, ("mass_kg = 2.0", said), ("exit_point_m = [0.0, 0.0]", pulley))
    platform = load_robot(path).platform
    assert platform is not None
    assert platform.inertia_kg_m2 == (0.01,)
    assert platform.centre_of_mass_m == (0.0, -0.01)
    assert platform.home_rotation_rad == (0.1,)
    assert platform.controlled == ("x", "y")
    assert (platform.cable_model, platform.tension_method) == ("catenary", "closed-form")
    assert not platform.own_distribution
    assert platform.pulley_radius_m == (0.0, 0.0, 0.03)
    assert platform.pulley_axes == ((0.0, 1.0), (0.0, 1.0), (0.0, -1.0))


@pytest.mark.parametrize(
    ("replaced", "key", "problem"),
    [
        (("exit_point_m = [0.0, 0.0]\n", ""), "axes[2].exit_point_m", "missing"),
        (("[0.0, 0.0]", "[0.0, 0.0, 0.0]"), "axes[2].exit_point_m", "2 coordinates, as platform"),
        (("[0.0, 0.0]", "[0.0, 2000.0]"), "axes[2].exit_point_m[1]", "-1000 to 1000, in metres"),
        (("home_m = [0.0, 1.3]", "home_m = [0.7, 1.3]"), "platform.home_m[0]", "-0.6 to 0.6"),
        (("home_m = [0.0, 1.3]", "home_m = [0.0, 2.5]"), "platform.home_m[1]", "up to 2.4"),
        (("max_m = [0.6, 2.4]", "max_m = [0.6, 1.4]"), "platform.workspace_max_m[1]", "above 1.4"),
        (("max_m = [0.6, 2.4]", "max_m = [0.6]"), "platform.workspace_max_m", "2 or more entries"),
        (("mass_kg = 2.0", "mass_kg = 0.0"), "platform.mass_kg", "greater than 0"),
        (("mass_kg = 2.0", "mass_kg = nan"), "platform.mass_kg", "finite number"),
        (("mass_kg", "mas_kg"), "platform.mas_kg", "did you mean 'mass_kg'?"),
        (("tension_min_N = 20.0\n", "\n"), "limits.tension_min_N", "with a [platform]"),
    ],
)
def test_impossible_platforms_are_rejected(
    tmp_path: Path, replaced: tuple[str, str], key: str, problem: str
) -> None:
    changes = [replaced]
    if key == "limits.tension_min_N":
        changes.append(("slack_N = 3.0\n", ""))
    path = changed(tmp_path, *changes)
    with pytest.raises(ProfileError) as caught:
        load_robot(path)
    assert (caught.value.file, caught.value.key) == (str(path), key)
    assert problem in str(caught.value)


WALL = (SHIPPED / "robots" / "planar-4.toml").read_text()
HALL = (SHIPPED / "robots" / "suspended-8.toml").read_text()
CAMERA = (SHIPPED / "robots" / "point-4.toml").read_text()
ROOM = (SHIPPED / "robots" / "spatial-8.toml").read_text()
BODY = "body = { min_m = [-0.1, -0.1, -0.3], max_m = [0.1, 0.1, 0.3] }"
INERTIA = "inertia_kg_m2 = [16.7, 16.7, 16.7, 0.0, 0.0, 0.0]"
HOME = "home_m = [0.0, 0.0, 0.5]"


@pytest.mark.parametrize(
    ("text", "old", "new", "key", "problem"),
    [
        (WALL, "= 0.05\n", "= 0.0\n", "platform.inertia_kg_m2", "all above 0"),
        (WALL, "= 0.05\n", "= 5e4\n", "platform.inertia_kg_m2", "is it in kg m2?"),
        (WALL, "= 0.05\n", "= [1, 1]\n", "platform.inertia_kg_m2",
         "value [1.0, 1.0]; allowed: 1 number in a"),
        (HALL, INERTIA, "inertia_kg_m2 = 1.0", "platform.inertia_kg_m2",
         "value [1.0]; allowed: 6 numbers in space"),
        (HALL, "16.7, 0.0,", "16.7, 17.0,", "platform.inertia_kg_m2", "all above 0"),
        (HALL, "16.7, 0.0,", "40.0, 0.0,", "platform.inertia_kg_m2", "sum of the other two"),
        (HALL, HOME, HOME + "\nhome_rotation_rad = [0.0, 0.0, 90.0]",
         "platform.home_rotation_rad", "is it in degrees?"),
        (HALL, HOME, HOME + "\nhome_rotation_rad = 0.1", "platform.home_rotation_rad",
         "value [0.1]; allowed: 3 numbers in space"),
        (HALL, HOME, HOME + "\nhome_rotation_rad = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
         "platform.home_rotation_rad", "value [[1, 0, 0], [0, 1, 0], [0, 0, 1]]; allowed: three n"),
        (HALL, INERTIA, "inertia_kg_m2 = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
         "platform.inertia_kg_m2", "allowed: six numbers Ixx Iyy Izz Ixy Ixz Iyz, not a matrix"),
        (HALL, INERTIA, 'inertia_kg_m2 = "round"', "platform.inertia_kg_m2", "allowed: six num"),
        (HALL, "exit_point_m = [", 'exit_point_m = 5.0 # ', "axes[0].exit_point_m", "an array"),
        (HALL, HOME, HOME + "\ncentre_of_mass_m = [0.0, 0.0, 500.0]",
         "platform.centre_of_mass_m", "not beyond the frame"),
        (ROOM, BODY, BODY + "\ncentre_of_mass_m = [1.0, 0.0, 0.0]", "platform.centre_of_mass_m",
         "0.9 m outside the box around anchor points and body; allowed: in it, or up to 0.332 m"),
        (WALL, "mass_kg", "centre_of_mass_m = [0.0, -0.4]\nmass_kg", "platform.centre_of_mass_m",
         "0.3 m outside the box around anchor points; allowed: in it, or up to 0.224 m"),
        (ROOM, BODY, "body = { min_m = [-0.1, -0.1, -0.3], max_m = [0.06, 0.1, 0.3] }",
         "axes[0].anchor_point_m", "0.04 m outside platform.body; allowed: on it, or up to 0.03 m"),
        (HALL, "angle_rad = 0.2618", "angle_rad = 15.0", "platform.workspace_angle_rad",
         "value 15; allowed: below pi (is it in degrees?)"),
        (HALL, "angular_speed_rad_s = 0.25\n", "", "platform.angular_speed_rad_s", "missing; "),
        (HALL, HOME, HOME + '\ncontrolled = ["x", "y"]', "platform.controlled", "x, y, z, and any"),
        (HALL, HOME, HOME + '\ncontrolled = ["x", "x", "y", "z"]', "platform.controlled",
         "each once"),
        (HALL, HOME, HOME + "\ncontrolled = []", "platform.controlled", "value []; allowed: x, y"),
        (WALL, "mass_kg", 'controlled = ["x", "y", "z"]\nmass_kg', "platform.controlled",
         "x, y, and"),
        (WALL, "mass_kg", 'controlled = ["x", "why"]\nmass_kg', "platform.controlled[1]",
         "'angle'"),
        (WALL, "mass_kg", 'cable_model = "rope"\nmass_kg', "platform.cable_model", "'catenary'"),
        (WALL, "mass_kg", 'tension_distribution = "x"\nmass_kg',
         "platform.tension_distribution", "'closed-form'"),
        (WALL, "mass_kg", 'tension_distribution = "os:system"\nmass_kg',
         "platform.tension_distribution", "'FILE.py:NAME'"),
        (CAMERA, "[0.0, 0.0, 0.0]", "[0.1, 0.0, 0.0]", "axes", "all anchor points equal"),
        (CAMERA, "mass_kg", 'controlled = ["x", "y", "z", "rz"]\nmass_kg', "platform.controlled",
         "no angle if all anchor points are equal"),
        (CAMERA, "mass_kg", "workspace_angle_rad = 0.1\nmass_kg", "platform.workspace_angle_rad",
         "allowed: 0 if no angle is controlled"),
        (WALL, "exit_point_m = [-2.0, 3.0]", "exit_point_m = [-350.0, 3.0]", "axes[0].exit_point_m",
         "are they in millimetres?"),
    ],
)  # fmt: skip
def test_impossible_sizes_and_directions_are_rejected(
    tmp_path: Path, text: str, old: str, new: str, key: str, problem: str
) -> None:
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ProfileError) as caught:
        load_robot(path)
    assert key == caught.value.key and problem in str(caught.value), caught.value


def test_a_point_mass_over_a_stadium_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "stadium.toml"
    path.write_text(
        CAMERA.replace("3.0, 2.5, 4.0", "100.0, 70.0, 40.0").replace(
            "3.0, -2.5, 4.0", "100.0, -70.0, 40.0"
        )
    )
    platform = load_robot(path).platform
    assert platform is not None and platform.exit_points_m[0] == (-100.0, 70.0, 40.0)


def test_anchor_points_a_millimetre_apart_are_rejected(tmp_path: Path) -> None:
    text = re.sub(r"anchor_point_m = \[(.*), (.*)\]", r"anchor_point_m = [\1e-3, \2e-3]", WALL)
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ProfileError, match=r"anchor points are 0\.000\d+ m apart at most"):
        load_robot(path)


def test_polygon_centroid_allows_at_most_two_more_cables_than_directions(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    polygon = 'controlled = ["x", "y", "z"]\ntension_distribution = "polygon-centroid"\nmass_kg'
    text = re.sub(r"workspace_angle_rad.*\n", "", HALL.replace("mass_kg", polygon, 1))
    path.write_text(text)
    with pytest.raises(ProfileError, match="allowed for up to 5 cables"):
        load_robot(path)


def test_exit_points_without_platform_and_too_few_cables_are_rejected(tmp_path: Path) -> None:
    start, end = PLANAR.index("[platform]"), PLANAR.index("[limits]")
    path = tmp_path / "mine.toml"
    path.write_text(PLANAR[:start] + PLANAR[end:])
    with pytest.raises(ProfileError, match=r"axes\[0\]: .*allowed only with \[platform\]"):
        load_robot(path)
    path.write_text(PLANAR[: PLANAR.index("[[axes]]", PLANAR.index("[[axes]]") + 1)])
    with pytest.raises(ProfileError, match="axes: 1; allowed: 2 or more to control x, y"):
        load_robot(path)


def test_named_poses_are_inside_the_workspace(tmp_path: Path) -> None:
    def with_poses(poses: str) -> Path:
        return changed(tmp_path, ("mass_kg = 2.0", f"mass_kg = 2.0\nposes_m = {poses}"))

    platform = load_robot(with_poses("{ load = [0.3, 2.0] }")).platform
    assert platform is not None and platform.poses_m == {"load": (0.3, 2.0)}
    for poses, problem in (
        ("{ load = [0.3, 2.5] }", r"poses_m.load\[1\]: value 2.5; allowed: 1.4 to 2.4"),
        ("{ load = [0.3, 2.0, 0.0] }", "poses_m.load: .* 2 coordinates"),
        ("{ home = [0.3, 2.0] }", "poses_m.home: the name stands for home_m"),
        ('{ "2" = [0.3, 2.0] }', "poses_m"),
    ):
        with pytest.raises(ProfileError, match=problem):
            load_robot(with_poses(poses))


def test_home_may_be_below_the_workspace_or_in_it(tmp_path: Path) -> None:
    for y_m in (0.2, 1.4, 2.4):
        path = changed(tmp_path, ("home_m = [0.0, 1.3]", f"home_m = [0.0, {y_m}]"))
        platform = load_robot(path).platform
        assert platform is not None and platform.home_m == (0.0, y_m)


def test_commissioning_results_are_found_beside_the_robot_file(tmp_path: Path) -> None:
    (tmp_path / "motors" / "left").mkdir(parents=True)
    name = 'name = "upper left"'
    path = changed(tmp_path, (name, f'{name}\ncommissioned = "motors/left"'))
    first, second, _ = load_robot(path).axes
    assert (first.commissioned, second.commissioned) == (tmp_path / "motors" / "left", None)


def test_body_and_obstacles_have_as_many_dimensions_as_the_robot(tmp_path: Path) -> None:
    body = "body = { min_m = [-0.1, -0.1], max_m = [0.1, 0.1] }\nmass_kg"
    box = "[[platform.obstacles]]\nmin_m = [0.0, 0.0]\nmax_m = [0.1, 0.2]\n[limits]"
    platform = load_robot(changed(tmp_path, ("mass_kg", body), ("[limits]", box))).platform
    assert platform is not None and platform.body is not None
    assert (platform.body.min_m, platform.obstacles[0].max_m) == ((-0.1, -0.1), (0.1, 0.2))
    assert platform.clearance_m == 0.01
    for wrong, key, problem in (
        ("max_m = [0.1, -0.1]", "platform.obstacles[0].max_m[1]", "above 0"),
        ("max_m = [0.1, 0.2, 0.3]", "platform.obstacles[0].max_m", "3]; allowed: 2"),
        ("max_m = [0.1, 2000.0]", "platform.obstacles[0].max_m[1]", "in metres"),
        ("max = [0.1, 0.2]", "platform.obstacles[0].max", "did you mean 'max_m'?"),
    ):
        path = changed(tmp_path, ("[limits]", box.replace("max_m = [0.1, 0.2]", wrong)))
        with pytest.raises(ProfileError, match=re.escape(key)) as refused:
            load_robot(path)
        assert problem in str(refused.value)


def test_a_clearance_below_the_cable_diameter_is_rejected(tmp_path: Path) -> None:
    path = changed(tmp_path, ("mass_kg", "clearance_m = 0.002\nmass_kg"))
    with pytest.raises(ProfileError, match=r"platform.clearance_m: value 0.002; allowed: .*0.0048"):
        load_robot(path)


def test_a_larger_body_allows_a_more_distant_centre_of_mass(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    hung = ROOM.replace(BODY, "centre_of_mass_m = [0.0, 0.0, -0.8]\n" + BODY)
    path.write_text(hung)
    with pytest.raises(ProfileError, match="centre_of_mass_m"):
        load_robot(path)
    path.write_text(hung.replace(BODY, BODY.replace("-0.1, -0.3]", "-0.1, -0.9]")))
    assert load_robot(path).platform is not None
