"""`cdpr robot new`: its questions, files and rejected answers."""

from __future__ import annotations

import json
import math
import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from cdpr_here import cdpr_here

from cdpr_drivers.robot.robot_buses import require_fit
from cdpr_profiles import ProfileError, load_robot
from cdpr_rt.diagnosis.checks import diagnose, refuse_impossible
from cdpr_rt.model.platform_model import RESERVE
from cdpr_rt.model.statics import statics_of
from cdpr_tools.errors import BadInputError
from cdpr_tools.robots.new_robot import answers_of, write_robot
from cdpr_tools.robots.picture import figure_of
from cdpr_tools.robots.questions import KINDS, Question, kind_of


@pytest.fixture(autouse=True)
def _wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")


def usual(question: Question, default: str, wrong: str) -> str:
    assert not wrong
    return default


@pytest.mark.parametrize("kind", list(KINDS))
def test_the_default_answers_of_every_kind_give_a_robot_without_findings(
    kind: str, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    robot = write_robot(answers_of(path, {"kind": kind}, usual), path)
    assert diagnose(robot) == []
    shipped = load_robot(kind)
    assert robot.platform is not None and shipped.platform is not None
    assert robot.platform.controlled == shipped.platform.controlled
    assert robot.platform.workspace_angle_rad == pytest.approx(
        shipped.platform.workspace_angle_rad, abs=1e-3
    )
    assert [len(robot.axes_on(bus.name)) for bus in robot.buses] == [
        len(robot.axes) // len(robot.buses)
    ] * len(robot.buses)


FRAMES = [(kind, width_m) for kind in KINDS for width_m in (1.5, 3.0, 8.0, 15.0)]


@pytest.mark.long
@pytest.mark.parametrize(("kind", "widest_m"), FRAMES)
def test_the_default_answers_for_any_frame_size_give_a_robot_without_findings(
    kind: str, widest_m: float, tmp_path: Path
) -> None:
    usual_m = kind_of(kind).frame_m
    scale = widest_m / max(usual_m)
    frame = ", ".join(f"{scale * side:.3f}" for side in usual_m)
    path = tmp_path / "mine.toml"
    robot = write_robot(answers_of(path, {"kind": kind, "frame_m": frame}, usual), path)
    assert diagnose(robot) == []
    assert robot.platform is not None
    side_m = max(math.dist(*pair) for pair in combinations(robot.platform.anchor_points_m, 2))
    assert side_m == pytest.approx(scale * kind_of(kind).side_m, rel=0.02)


def test_the_proposed_box_of_a_wide_and_low_frame_is_feasible(tmp_path: Path) -> None:
    path = tmp_path / "stadium.toml"
    given = {"kind": "point-4", "frame_m": "80 50 20"}
    told = diagnose(write_robot(answers_of(path, given, usual), path))
    # the proposed winches are the smallest that hold the platform, and their cables of 50 m sag
    assert [finding.key for finding in told] == ["limits.tension_min_N"]


def test_the_error_for_a_platform_too_light_names_a_possible_mass(tmp_path: Path) -> None:
    path = tmp_path / "light.toml"
    given = {"kind": "suspended-6", "frame_m": "1.5 1.5 1.5", "mass_kg": "1"}
    with pytest.raises(ProfileError) as caught:
        write_robot(answers_of(path, given, usual), path)
    assert re.search(
        r"a platform of \d+\.?\d* kg or more is possible there, or tension_min_N up to 0\.\d+ "
        "with correspondingly small winches",
        str(caught.value),
    )


def test_smaller_winches_and_a_smaller_frame_get_a_smaller_platform(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    given = {"kind": "suspended-8", "frame_m": "3 2 2", "winch": "winch-300n"}
    robot = write_robot(answers_of(path, given, usual), path)
    platform = robot.platform
    assert diagnose(robot) == []
    assert platform is not None and 20.0 < platform.mass_kg < 40.0
    assert max(math.dist(*pair) for pair in combinations(platform.anchor_points_m, 2)) < 0.35
    assert min(math.dist(*pair) for pair in combinations(platform.exit_points_m, 2)) > 0.149
    np.testing.assert_allclose(np.ptp(platform.exit_points_m, axis=0)[:2], (3.0, 2.0), atol=0.02)


def test_the_stand_is_in_the_middle_of_the_frame(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    given = {"kind": "suspended-8", "frame_m": "3 2 2"}
    platform = write_robot(answers_of(path, given, usual), path).platform
    assert platform is not None
    assert platform.home_m[:2] == (0.0, 0.0)


def test_the_kinds_are_listed_before_the_first_question(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    done = cdpr_here("robot", "new", path, stdin="planar-5\n\n")
    assert done.returncode == 2 and not path.exists()
    for kind, what in KINDS.items():
        assert re.search(rf"{kind} +{re.escape(what)}", done.stderr)
    assert "value 'planar-5'; allowed: planar-3, planar-4, point-4" in done.stderr


def test_yes_writes_a_robot_like_planar_3_and_never_overwrites_it(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    done = cdpr_here("robot", "new", path, "--yes", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1]) == {"ok": True, "file": str(path)}
    robot = load_robot(path)
    assert robot.name == "mine" and diagnose(robot) == []
    assert [axis.name for axis in robot.axes] == ["upper left", "upper right", "lower"]
    platform, shipped = robot.platform, load_robot("planar-3").platform
    assert platform is not None and shipped is not None
    assert platform.exit_points_m == shipped.exit_points_m
    np.testing.assert_allclose(platform.anchor_points_m, shipped.anchor_points_m, atol=1e-4)
    statics = statics_of(robot)
    spare = RESERVE * (statics.high_N - statics.low_N).min()
    points = statics.box.grid(21, 21)
    assert statics.margin_N(points, platform.acceleration_m_s2).min() > 0.85 * spare
    again = cdpr_here("robot", "new", path, "--yes")
    assert again.returncode == 2 and "never overwritten" in again.stderr
    assert load_robot(path) == robot


def test_defaults_follow_from_the_exit_points(tmp_path: Path) -> None:
    given = {"exit_1_m": "-2, 0", "exit_2_m": "2, 0", "exit_3_m": "0.2, 3", "side_m": "0.2"}
    path = tmp_path / "upright.toml"
    robot = write_robot(answers_of(path, given, usual), path)
    assert diagnose(robot) == []
    platform = robot.platform
    assert platform is not None
    # one corner points up, the others towards their exit points
    (x1, y1), (x2, y2), (x3, y3) = platform.anchor_points_m
    assert x1 < 0 < x2 and y1 < 0 and y2 < 0 and abs(x3) < 1e-9 and y3 > 0
    assert platform.home_m[1] < platform.workspace_min_m[1]
    assert [axis.name for axis in robot.axes] == ["cable 1", "cable 2", "cable 3"]


def test_questions_are_repeated_until_their_answer_is_valid(tmp_path: Path) -> None:
    answers = [
        "",
        "Wall robot",
        "winch-mpp0932d",
        "",
        "socketcan:can1",
        "1, 1, 2",
        "4 5 6",
        "3, 2.5",
    ]
    answers += ["", "", "here", "0.1, 0.1", "-1", "0.2", "", "", "", "400", "4", "15"]
    answers += ["10", "140", "1.5", "", "", "", "-5, 0", "0.3, 1.9", "9, 9", ""]
    path = tmp_path / "wall.toml"
    done = cdpr_here("robot", "new", path, stdin="\n".join(answers) + "\n")
    assert done.returncode == 0, done.stderr
    for problem in (
        "did you mean 'winch-mpp0923d'?",
        "allowed: 3 different numbers from 1 to 126",
        "value 'here'; allowed: two numbers in m",
        "allowed: a number from 0 to 10",
        "allowed: a number from 0.001 to 11.55",
        "allowed: a number from 15 to",
        "allowed: above -0",
        "allowed: x from -0",
    ):
        assert problem in done.stderr, problem
    robot = load_robot(path)
    platform = robot.platform
    assert platform is not None
    assert (robot.name, robot.buses[0].url) == ("Wall robot", "socketcan:can1")
    assert [axis.node_id for axis in robot.axes] == [4, 5, 6]
    assert platform.exit_points_m == ((-1.5, 2.5), (1.5, 2.5), (0.1, 0.1))
    assert platform.workspace_max_m == (0.3, 1.9)
    assert (robot.limits.tension_min_N, robot.limits.tension_max_N) == ((15.0,), (140.0,))
    assert platform.mass_kg == 1.5


def test_unanswered_questions_write_no_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    done = cdpr_here("robot", "new", path, stdin="\nMine\n\n")
    assert done.returncode == 2
    assert "no answer to 'bus' (--yes takes the defaults); nothing was written" in done.stderr
    assert "Traceback" not in done.stderr and not path.exists()


def test_all_unknown_keys_are_named_with_the_allowed_keys(tmp_path: Path) -> None:
    given = {"kind": "planar-4", "width_m": "3", "height": "2"}
    with pytest.raises(BadInputError) as caught:
        answers_of(tmp_path / "mine.toml", given, usual)
    text = str(caught.value)
    assert text.startswith("--set width_m, height: no such question; allowed for planar-4: kind, ")
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "describing-your-robot.md").read_text()
    for key in text.rpartition(": ")[2].split(", "):
        assert f"`{key}`" in page or re.fullmatch(r"(exit|anchor)_[234]_m", key), key


@pytest.mark.parametrize(
    ("key", "value", "problem"),
    [
        ("mass", "2", "--set mass: no such question; did you mean 'mass_kg'?"),
        ("mass_kg", "nan", "--set mass_kg: value 'nan'; allowed: a number from 0.01 to 10000"),
        ("exit_1_m", "1,2,3", "--set exit_1_m: value '1,2,3'; allowed: two numbers"),
        ("frame_m", "3x2", "value '3x2'; allowed: two numbers in m, such as `4, 3`"),
        ("frame_m", "3000, 2000", "allowed: up to 300 m each (in metres, not millimetres)"),
        ("name", "two\nlines", "allowed: a text of one line"),
    ],
)
def test_invalid_answers_by_set_are_rejected(
    tmp_path: Path, key: str, value: str, problem: str
) -> None:
    with pytest.raises(BadInputError) as caught:
        answers_of(tmp_path / "mine.toml", {key: value}, usual)
    assert problem in str(caught.value)


def test_two_answers_to_one_question_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "twice.toml"
    answers = "--set", "kind=planar-3", "--set", "kind=planar-4"
    done = cdpr_here("robot", "new", path, "--yes", *answers)
    assert done.returncode == 2 and not path.exists()
    assert "--set kind: given as 'planar-3' and 'planar-4'; give it once" in done.stderr


def test_an_impossible_robot_is_reported_and_not_written(tmp_path: Path) -> None:
    path = tmp_path / "point.toml"
    line = ["exit_1_m=-1,2", "exit_2_m=0,2", "exit_3_m=1,2", "side_m=0", 'name=A "line" é']
    done = cdpr_here("robot", "new", path, "--yes", *(p for text in line for p in ("--set", text)))
    assert done.returncode == 2
    assert f"cdpr: {path}: platform." in done.stderr and not path.exists()
    assert "--set side_m=0 --set 'name=A \"line\" é' --yes" in done.stderr


def test_a_file_in_a_missing_folder_is_rejected(tmp_path: Path) -> None:
    done = cdpr_here("robot", "new", tmp_path / "nowhere" / "mine.toml", "--yes")
    assert done.returncode == 2
    assert "allowed: NAME.toml in an existing folder" in done.stderr


def test_names_in_the_picture_stay_inside_its_axes(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    given = {"kind": "suspended-8", "frame_m": "3 2 2"}
    robot = write_robot(answers_of(path, given, usual), path)
    assert robot.platform is not None
    figure = figure_of(robot, robot.platform)
    figure.draw_without_rendering()
    (from_above,) = [ax for ax in figure.axes if ax.texts]
    assert len(from_above.texts) == 8
    inside = from_above.get_window_extent()
    for name in from_above.texts:
        (left, lower), (right, upper) = name.get_window_extent().get_points()
        assert inside.x0 <= left and right <= inside.x1, name
        assert inside.y0 <= lower and upper <= inside.y1, name


@pytest.mark.parametrize(
    ("given", "under_m"),
    [
        ({"kind": "suspended-6"}, 0.4),
        ({"kind": "point-4"}, 0.4),
        ({"kind": "point-4", "frame_m": "80 50 20"}, 0.5),
    ],
)
def test_a_platform_that_cables_hold_down_to_the_floor_has_a_stand(
    given: dict[str, str], under_m: float, tmp_path: Path
) -> None:
    answers = answers_of(tmp_path / "mine.toml", given, usual)
    assert answers["home_m"][-1] >= under_m
    assert answers["low_m"][-1] > answers["home_m"][-1]


# Robots with other numbers of cables than `cdpr robot new` writes, as the pages describe.


def _point(axis: str, key: str, point_m: tuple[float, ...]) -> str:
    return re.sub(rf"^{key} = \[.*?\]", f"{key} = {list(point_m)}", axis, flags=re.MULTILINE)


def _file_of(kind: str, path: Path) -> tuple[str, list[str]]:
    """Return the head and the axes of a file as `cdpr robot new` writes it."""
    write_robot(answers_of(path, {"kind": kind}, usual), path)
    head, *axes = path.read_text().split("\n[[axes]]\n")
    return head, axes


def _require_works(path: Path, head: str, axes: list[str]) -> None:
    path.write_text("\n[[axes]]\n".join([head, *axes]))
    robot = load_robot(path)
    require_fit(robot)
    refuse_impossible(robot)
    assert robot.platform is not None and len(robot.axes) == len(axes)
    box = robot.platform.workspace_min_m, robot.platform.workspace_max_m
    assert statics_of(robot).is_target(np.mean(box, axis=0))


@pytest.mark.parametrize("kind", ["planar-4", "suspended-6", "suspended-8", "spatial-8"])
@pytest.mark.parametrize("above", [False, True])
def test_a_robot_with_one_more_cable_below_or_above_the_middle_is_feasible(
    kind: str, above: bool, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    head, axes = _file_of(kind, path)
    robot = load_robot(path)
    assert robot.platform is not None
    size = len(robot.platform.home_m)
    top_m = max(point[-1] for point in robot.platform.exit_points_m)
    place_m = (*(0.0,) * (size - 1), top_m if above else robot.platform.home_m[-1] - 0.2)
    more = _point(axes[-1], "exit_point_m", place_m)
    more = _point(more, "anchor_point_m", (0.0,) * size)
    more = re.sub(r"node_id = \d+", f"node_id = {len(axes) + 1}", more)
    more = re.sub(r"^name = .*", 'name = "middle"', more, flags=re.MULTILINE)
    head = head.replace("sync_period_s = 0.001 ", "sync_period_s = 0.00125 ")
    _require_works(path, head, [*axes, more])


def test_a_point_on_two_cables_in_a_plane_is_feasible(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    head, axes = _file_of("planar-3", path)
    head = re.sub(r"^mass_kg = \S+", "mass_kg = 6.5", head, flags=re.MULTILINE)
    upper = [_point(axis, "anchor_point_m", (0.0, 0.0)) for axis in axes[:2]]
    _require_works(path, head, upper)


def test_a_point_on_three_cables_from_above_is_feasible(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    head, axes = _file_of("point-4", path)
    _, y_m, z_m = (float(x) for x in re.findall(r"exit_point_m = \[(.*?)\]", axes[2])[0].split(","))
    _require_works(path, head, [*axes[:2], _point(axes[2], "exit_point_m", (0.0, y_m, z_m))])
