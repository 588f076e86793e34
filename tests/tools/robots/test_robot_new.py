"""`cdpr robot new`: what it asks, writes and rejects."""

from __future__ import annotations

import json
import math
import os
import pty
import re
import subprocess
import sys
import threading
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from cdpr_here import cdpr_here

from cdpr_drivers.robot.robot_buses import require_fit
from cdpr_profiles import Robot, load_robot
from cdpr_rt.diagnosis.checks import refuse_impossible
from cdpr_rt.diagnosis.subject import Finding
from cdpr_rt.model.platform_model import RESERVE
from cdpr_rt.model.statics import statics_of
from cdpr_tools.errors import BadInputError
from cdpr_tools.robots.new_robot import answers_of, questioned, text_of, write_robot
from cdpr_tools.robots.picture import figure_of
from cdpr_tools.robots.questions import KINDS, Answers, Default, Question, kind_of


@pytest.fixture(autouse=True)
def _wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")


def usual(question: Question, default: Default, wrong: str) -> str:
    assert not wrong
    return default.text


@cache
def usual_answers(kind: str) -> Answers:
    """Return the defaults of a kind, which take seconds to compute."""
    return answers_of(Path("mine.toml"), {"kind": kind}, usual)


def described(path: Path, given: dict[str, str]) -> Robot:
    """Return the robot that is described with these answers, about which nothing is doubtful."""
    robot, found = write_robot(answers_of(path, given, usual), path)
    assert robot is not None and found == []
    return robot


def found_wrong(path: Path, given: dict[str, str]) -> list[Finding]:
    """Return the findings about a robot with these answers."""
    return write_robot(answers_of(path, given, usual), path)[1]


@pytest.mark.parametrize("kind", list(KINDS))
def test_the_defaults_of_every_kind_are_a_robot_that_works(kind: str, tmp_path: Path) -> None:
    answers = usual_answers(kind)
    robot, found = write_robot(answers, tmp_path / "mine.toml")
    shipped = load_robot(kind)
    assert robot is not None and found == []
    platform = robot.platform
    assert platform is not None and shipped.platform is not None
    assert platform.controlled == shipped.platform.controlled
    assert platform.workspace_angle_rad == pytest.approx(
        shipped.platform.workspace_angle_rad, abs=1e-3
    )
    assert [len(robot.axes_on(bus.name)) for bus in robot.buses] == [
        len(robot.axes) // len(robot.buses)
    ] * len(robot.buses)
    # winches stand on the edges of the frame, and the box is in the middle between them
    *sides_m, height_m = answers["frame_m"]
    exits_m = np.array(platform.exit_points_m)
    on_wall = np.abs(exits_m[:, :-1]) == np.array(sides_m) / 2.0
    centre = (exits_m[:, :-1] == 0.0) & (len(sides_m) == 1)
    assert (on_wall | centre).any(axis=1).all()
    assert set(exits_m[:, -1]) <= {0.0, height_m}
    assert platform.workspace_min_m[0] == -platform.workspace_max_m[0]
    assert platform.speed_m_s >= 0.3


FRAMES = [(kind, width_m) for kind in KINDS for width_m in (1.5, 15.0)]


@pytest.mark.long
@pytest.mark.parametrize(("kind", "widest_m"), FRAMES)
def test_the_default_answers_for_any_frame_size_give_a_robot_without_findings(
    kind: str, widest_m: float, tmp_path: Path
) -> None:
    usual_m = kind_of(kind).frame_m
    scale = widest_m / max(usual_m)
    frame = ", ".join(f"{scale * side:.3f}" for side in usual_m)
    robot = described(tmp_path / "mine.toml", {"kind": kind, "frame_m": frame})
    assert robot.platform is not None
    side_m = max(math.dist(*pair) for pair in combinations(robot.platform.anchor_points_m, 2))
    assert side_m == pytest.approx(scale * kind_of(kind).side_m, rel=0.02)


WINCH_OF_2_m_s = """\
name = "Winch for 2 m/s"
motor = "MPP0923D"
drive = "generic-cia402"
cable = "dyneema-4.8mm"
gear_ratio = 13.0
drum_radius_m = 0.05
encoder_counts_per_turn = 8192
node_id = 1
"""


@pytest.mark.parametrize("kind", ["planar-3", "suspended-8"])
def test_the_default_speed_makes_use_of_fast_winches(kind: str, tmp_path: Path) -> None:
    (tmp_path / "fast.toml").write_text(WINCH_OF_2_m_s)
    path = tmp_path / "mine.toml"
    given = {"kind": kind, "winch": "fast.toml"}
    robot, found = write_robot(answers_of(path, given, usual), path)
    assert robot is not None and not any(finding.impossible for finding in found)
    platform, (limit_rad_s,) = robot.platform, robot.limits.speed_rad_s or (0.0,)
    assert platform is not None and platform.speed_m_s > 0.4
    winch = robot.axes[0].winch
    assert limit_rad_s < winch.motor.rated_speed_rad_s
    assert limit_rad_s * winch.cable_m_per_motor_rad > math.sqrt(2.0) * platform.speed_m_s
    # cables between winches on all sides also hold a light platform
    assert kind == "suspended-8" or platform.mass_kg == 2.0


def test_a_speed_that_the_winches_cannot_reach_is_asked_again(tmp_path: Path) -> None:
    (tmp_path / "fast.toml").write_text(WINCH_OF_2_m_s)
    with pytest.raises(BadInputError, match=r"speed_m_s: value '3'; allowed: a number from 0.001"):
        answers_of(tmp_path / "mine.toml", {"winch": "fast.toml", "speed_m_s": "3"}, usual)


def test_targets_fill_the_box_of_a_wide_and_low_frame(tmp_path: Path) -> None:
    given = {"kind": "point-4", "frame_m": "80 50 20"}
    found = found_wrong(tmp_path / "stadium.toml", given)
    # the smallest winches that hold the platform are proposed, and cables of 50 m sag in their pull
    assert [finding.key for finding in found] == ["limits.tension_min_N"]


def test_the_error_for_a_platform_too_light_names_a_possible_mass(tmp_path: Path) -> None:
    path = tmp_path / "light.toml"
    given = {"kind": "suspended-6", "frame_m": "1.5 1.5 1.5", "mass_kg": "1"}
    worst = found_wrong(path, given)[0]
    assert worst.impossible and worst.helps == "platform.mass_kg"
    assert re.search(
        r"a platform of \d+\.?\d* kg or more is possible there, or tension_min_N up to 0\.\d+ "
        "with correspondingly small winches",
        worst.text,
    )


def test_smaller_winches_and_a_smaller_frame_get_a_smaller_platform(tmp_path: Path) -> None:
    given = {"kind": "suspended-8", "frame_m": "3 2 2", "winch": "winch-300n"}
    platform = described(tmp_path / "mine.toml", given).platform
    assert platform is not None and 20.0 < platform.mass_kg < 40.0
    assert max(math.dist(*pair) for pair in combinations(platform.anchor_points_m, 2)) < 0.35
    assert min(math.dist(*pair) for pair in combinations(platform.exit_points_m, 2)) > 0.149
    np.testing.assert_allclose(np.ptp(platform.exit_points_m, axis=0)[:2], (3.0, 2.0), atol=0.02)


def test_kinds_are_reported_before_the_first_question(tmp_path: Path) -> None:
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
    assert robot.name == "mine"
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
    robot = described(path, given)
    platform = robot.platform
    assert platform is not None
    # one corner points up, the others towards their exit points
    (x1, y1), (x2, y2), (x3, y3) = platform.anchor_points_m
    assert x1 < 0 < x2 and y1 < 0 and y2 < 0 and abs(x3) < 1e-9 and y3 > 0
    assert platform.home_m[1] < platform.workspace_min_m[1]
    assert [axis.name for axis in robot.axes] == ["cable 1", "cable 2", "cable 3"]


def test_a_question_is_asked_again_until_its_answer_is_valid(tmp_path: Path) -> None:
    answers = ["", "Wall robot", "winch-mpp0932d", "", "socketcan:can1", "1, 1, 2", "4 5 6"]
    answers += ["0, 2.5", "3, 2.5", "", "", "here", "0.1, 0.1", "-1", "0.2", "", "", ""]
    answers += ["400", "4", "1e9", "140", "150", "15", "", "1.5"]
    answers += ["", "-5, 0", "0.3, 1.9", "9, 9", "", "99", "0.4"]
    path = tmp_path / "wall.toml"
    done = cdpr_here("robot", "new", path, stdin="\n".join(answers) + "\n")
    told = done.stderr
    for problem in (
        "did you mean 'winch-mpp0923d'?",
        "allowed: 3 different numbers from 1 to 126",
        "allowed: two numbers in m above 0",
        "value 'here'; allowed: two numbers in m",
        "value '-1'; allowed: a number from 0 to 10",
        "value '400'; allowed: a number from 0.001 to 11.55",
        "value '1e9'; allowed: a number from 1 to",
        "value '150'; allowed: a number from 0.1 to 140",
        "value '-5, 0'; allowed: above -0",
        "value '9, 9'; allowed: x from -0",
        "value '99'; allowed: a number from 0.001 to 7",
    ):
        assert problem in told, problem
    robot = load_robot(path)
    platform = robot.platform
    assert platform is not None
    assert (robot.name, robot.buses[0].url) == ("Wall robot", "socketcan:can1")
    assert [axis.node_id for axis in robot.axes] == [4, 5, 6]
    assert platform.exit_points_m == ((-1.5, 2.5), (1.5, 2.5), (0.1, 0.1))
    assert platform.workspace_max_m == (0.3, 1.9)
    assert (robot.limits.tension_min_N, robot.limits.tension_max_N) == ((15.0,), (140.0,))
    assert (platform.mass_kg, platform.speed_m_s) == (1.5, 0.4)


def test_a_question_says_where_its_default_comes_from(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    done = cdpr_here("robot", "new", path, stdin="\n" * 30)
    assert done.returncode == 0, done.stderr
    for origin, text in (
        ("85 % of the torque limit", "Greatest tension"),
        ("that of planar-3; the cables hold 0.0", "Mass of the platform"),
        ("a box in which the cables hold the platform", "Box of targets, least"),
        ("reached within a quarter of the box; rated speed of the winches, 13 m/s", "Speed along"),
    ):
        assert re.search(rf"default: {re.escape(origin)}.*\n{text}", done.stderr), origin
        assert f"default: {origin}" in path.read_text()


def test_the_question_that_a_rejection_names_is_asked_again(tmp_path: Path) -> None:
    path = tmp_path / "heavy.toml"
    answers = *[""] * 17, "80", *[""] * 4, "1.5"
    done = cdpr_here("robot", "new", path, stdin="\n".join(answers) + "\n")
    assert done.returncode == 0, done.stderr
    before, _, after = done.stderr.partition("this robot cannot work:\n")
    assert before.count("Mass of the platform") == 1 and "kg is possible there" in after
    assert re.findall(r"^[A-Z][^:\n]*", after, re.MULTILINE) == ["Mass of the platform (kg) [2]"]
    platform = load_robot(path).platform
    assert platform is not None and platform.mass_kg == 1.5
    # the box follows from the new answer
    assert platform.workspace_max_m[0] == pytest.approx(0.5, abs=0.2)


def test_a_rejected_robot_is_written_so_that_it_can_be_edited(tmp_path: Path) -> None:
    path = tmp_path / "heavy.toml"
    set_ = ("--set", "mass_kg=80", "--set", 'name=A "line" é')
    done = cdpr_here("robot", "new", path, *set_, "--yes")
    assert done.returncode == 2
    assert f"{path}: written, but this robot cannot work\nplatform.home_m: " in done.stderr
    assert f"edit the file, then check it: cdpr robot show {path}" in done.stderr
    assert "another answer" not in done.stderr
    robot = load_robot(path)
    assert robot.name == 'A "line" é'
    path.write_text(path.read_text().replace("mass_kg = 80.0", "mass_kg = 1.5"))
    refuse_impossible(load_robot(path))


@pytest.mark.parametrize("answer", ["", "80\n"])
def test_a_rejected_robot_stays_written_if_no_other_answer_follows(
    answer: str, tmp_path: Path
) -> None:
    path = tmp_path / "heavy.toml"
    done = cdpr_here("robot", "new", path, "--set", "mass_kg=80", stdin="\n" * 21 + answer)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert done.stderr.count("Mass of the platform") == 1
    assert f"{path}: written, but this robot cannot work" in done.stderr
    platform = load_robot(path).platform
    assert platform is not None and platform.mass_kg == 80.0


def test_unanswered_questions_write_no_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    done = cdpr_here("robot", "new", path, stdin="planar-4\nMy wall\n\n")
    assert done.returncode == 2
    assert "no answer to 'bus' (--yes takes the defaults); nothing was written" in done.stderr
    again = f"to continue: cdpr robot new {path} --set kind=planar-4 --set 'name=My wall'"
    assert again in done.stderr
    assert "Traceback" not in done.stderr and not path.exists()


def test_questions_and_defaults_are_folded_to_the_width_of_the_terminal(tmp_path: Path) -> None:
    person, terminal = pty.openpty()
    with os.fdopen(terminal, "w") as shown:
        subprocess.run(
            [sys.executable, "-m", "cdpr_tools.cli", "robot", "new", str(tmp_path / "mine.toml")],
            input="suspended-6\n" + "\n" * 20,
            stderr=shown,
            env=os.environ | {"COLUMNS": "60"},
            text=True,
            timeout=120.0,
            check=False,
        )
        text = os.read(person, 1 << 16).decode()
    os.close(person)
    asked = (
        text[text.index("Kind of robot") : text.index("cdpr: no answer")]
        .replace("]:", "]:\n")
        .splitlines()
    )
    assert len(asked) > 20
    assert [line for line in asked if len(line) > 60] == []


def test_typed_ahead_lines_answer_no_question(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    person, terminal = pty.openpty()
    os.write(person, b"\n\n\n")  # while the command loads
    over = threading.Event()

    def leave() -> None:
        while not over.wait(0.05):
            os.write(person, b"\x04")  # end of input, once somebody reads

    leaving = threading.Thread(target=leave)
    with os.fdopen(terminal) as stdin:
        leaving.start()
        done = cdpr_here("robot", "new", path, stdin=stdin)
        over.set()
        leaving.join()
    os.close(person)
    assert done.returncode == 2 and not path.exists()
    assert "no answer to 'kind'" in done.stderr and "Name of the robot" not in done.stderr


def test_all_wrong_keys_are_named_with_those_of_the_kind(tmp_path: Path) -> None:
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
        ("mass_kg", "nan", "--set mass_kg: value 'nan'; allowed: a number from 0.01 to 100000"),
        ("exit_1_m", "1,2,3", "--set exit_1_m: value '1,2,3'; allowed: two numbers"),
        ("frame_m", "3x2", "value '3x2'; allowed: two numbers in m, such as `4, 3`"),
        ("frame_m", "3000, 2000", "allowed: up to 300 m each (in metres, not millimetres)"),
        ("name", "two\nlines", "allowed: one line of text"),
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


def test_the_size_is_asked_again_if_a_default_point_is_at_fault(tmp_path: Path) -> None:
    answers = usual_answers("planar-4")
    found = [
        Finding("axes[2].anchor_point_m", "", impossible=True),
        Finding("axes[1].exit_point_m", "", impossible=True),
        Finding("platform.workspace_max_m[1]", "", impossible=True),
        Finding("sync_period_s", "", impossible=True),
    ]
    assert questioned(found, answers, {}) == {"side_m", "frame_m", "high_m"}
    typed = {"anchor_3_m": "0, 0", "exit_2_m": "1, 1"}
    assert questioned(found, answers, typed) == {"anchor_3_m", "exit_2_m", "high_m"}


def test_a_file_in_a_missing_folder_is_rejected(tmp_path: Path) -> None:
    done = cdpr_here("robot", "new", tmp_path / "nowhere" / "mine.toml", "--yes")
    assert done.returncode == 2
    assert "allowed: NAME.toml in an existing folder" in done.stderr


def test_names_in_the_picture_stay_inside_its_axes(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    given = {"kind": "suspended-8", "frame_m": "3 2 2"}
    robot, _ = write_robot(answers_of(path, given, usual), path)
    assert robot is not None and robot.platform is not None
    assert robot.platform.home_m[:2] == (0.0, 0.0)
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
    ("kind", "under_m"),
    [("suspended-6", 0.4), ("point-4", 0.4)],
)
def test_a_platform_that_cables_hold_down_to_the_floor_has_a_stand(
    kind: str, under_m: float
) -> None:
    answers = usual_answers(kind)
    assert answers["home_m"][-1] >= under_m
    assert answers["low_m"][-1] > answers["home_m"][-1]


# Robots with other numbers of cables than `cdpr robot new` writes, as the pages describe.


def _point(axis: str, key: str, point_m: tuple[float, ...]) -> str:
    return re.sub(rf"^{key} = \[.*?\]", f"{key} = {list(point_m)}", axis, flags=re.MULTILINE)


def _file_of(kind: str) -> tuple[str, list[str]]:
    """Return the head and the axes of a file as `cdpr robot new` writes it."""
    head, *axes = text_of(usual_answers(kind)).split("\n[[axes]]\n")
    return head, axes


def _require_works(path: Path, head: str, axes: list[str]) -> None:
    path.write_text("\n[[axes]]\n".join([head, *axes]))
    robot = load_robot(path)
    require_fit(robot)
    refuse_impossible(robot)
    assert robot.platform is not None and len(robot.axes) == len(axes)
    box = robot.platform.workspace_min_m, robot.platform.workspace_max_m
    assert statics_of(robot).is_target(np.mean(box, axis=0))


@pytest.mark.parametrize(
    ("kind", "above"),
    [("planar-4", False), ("suspended-6", True), ("suspended-8", False), ("spatial-8", True)],
)
def test_a_further_cable_straight_below_or_above_the_middle_works(
    kind: str, above: bool, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    head, axes = _file_of(kind)
    answers = usual_answers(kind)
    size = len(answers["home_m"])
    top_m = max(answers[f"exit_{i + 1}_m"][-1] for i in range(len(axes)))
    place_m = (*(0.0,) * (size - 1), top_m if above else answers["home_m"][-1] - 0.2)
    more = _point(axes[-1], "exit_point_m", place_m)
    more = _point(more, "anchor_point_m", (0.0,) * size)
    more = re.sub(r"node_id = \d+", f"node_id = {len(axes) + 1}", more)
    more = re.sub(r"^name = .*", 'name = "middle"', more, flags=re.MULTILINE)
    head = head.replace("sync_period_s = 0.001 ", "sync_period_s = 0.00125 ")
    _require_works(path, head, [*axes, more])


def test_a_point_on_two_cables_in_a_plane_is_feasible(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    head, axes = _file_of("planar-3")
    head = re.sub(r"^mass_kg = \S+", "mass_kg = 10.0", head, flags=re.MULTILINE)
    upper = [_point(axis, "anchor_point_m", (0.0, 0.0)) for axis in axes[:2]]
    _require_works(path, head, upper)


def test_a_point_on_three_cables_from_above_is_feasible(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    head, axes = _file_of("point-4")
    _, y_m, z_m = (float(x) for x in re.findall(r"exit_point_m = \[(.*?)\]", axes[2])[0].split(","))
    _require_works(path, head, [*axes[:2], _point(axes[2], "exit_point_m", (0.0, y_m, z_m))])
