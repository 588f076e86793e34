"""`cdpr robot show` and `new`: what they tell, draw, write and refuse."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from cdpr_here import cdpr_here

from cdpr_profiles import load_robot
from cdpr_profiles.reading.places import SHIPPED
from cdpr_rt.robots.checks import findings
from cdpr_rt.robots.platform_model import RESERVE
from cdpr_rt.robots.statics import statics_of
from cdpr_tools.errors import BadInputError
from cdpr_tools.robots.kinds import KINDS
from cdpr_tools.robots.new_robot import answers_of, write_robot
from cdpr_tools.robots.questions import Question

PLANAR = (SHIPPED / "robots" / "planar-3.toml").read_text()


@pytest.fixture(autouse=True)
def _wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")


def as_json(done: subprocess.CompletedProcess[str]) -> dict[str, object]:
    told = json.loads(done.stdout.splitlines()[-1])
    assert isinstance(told, dict)
    return told


# -- show


def test_the_planar_robot_is_told_sketched_and_drawn(tmp_path: Path) -> None:
    picture = tmp_path / "planar.png"
    shown = cdpr_here("robot", "show", "planar-3", "--png", picture, "--json")
    assert shown.returncode == 0, shown.stderr
    told = as_json(shown)
    assert told["ok"] is True and told["findings"] == []
    assert told["held_share"] == 1.0 and told["reserve_in_motion_N"] > 18.0  # type: ignore[operator]
    lines = shown.stderr.splitlines()
    assert any("hold it in 100 % of the box" in line for line in lines)
    assert any("nothing to object to" in line for line in lines)
    # exit points where they are, the box of targets full, the stand under it
    first = next(i for i, line in enumerate(lines) if line.strip().startswith("1  "))
    assert lines[first].split() == ["1", "2"]
    home = next(line for line in lines[first:] if "o" in line)
    left, right = lines[first].index("1"), lines[first].index("2")
    assert home.index("o") == (left + right) // 2
    assert sum(line.count("#") for line in lines[first:]) > 80
    assert not any("!" in line for line in lines[first:] if "targets" not in line)
    image = matplotlib.image.imread(picture)
    assert image.shape[0] > 400 and image.shape[1] > 800
    assert len(np.unique(image.reshape(-1, image.shape[2]), axis=0)) > 200  # not a blank page


def test_what_cannot_be_held_is_marked_and_ends_with_its_reason(tmp_path: Path) -> None:
    path = tmp_path / "heavy.toml"
    path.write_text(PLANAR.replace("mass_kg = 2.0", "mass_kg = 20.0"))
    shown = cdpr_here("robot", "show", path, "--json")
    assert shown.returncode == 2
    assert "impossible: platform.home_m: at (0.00, 1.30) m the cables would need" in shown.stderr
    assert re.search(r"a platform of up to 1\d\.\d kg is possible there", shown.stderr)
    assert "!!!" in shown.stderr
    told = as_json(shown)
    assert told["ok"] is False and told["held_share"] == 0.0
    # and it is not run either
    run = cdpr_here("run", path, "--bus", "simbus:", "--json")
    assert run.returncode == 2
    assert f"{path}: platform.home_m: at (0.00, 1.30) m" in run.stderr
    assert "Traceback" not in run.stderr


def test_a_robot_in_space_is_told_and_drawn(tmp_path: Path) -> None:
    picture = tmp_path / "suspended.png"
    shown = cdpr_here("robot", "show", "suspended-8", "--png", picture, "--json")
    assert shown.returncode == 0, shown.stderr
    told = as_json(shown)
    assert told["held_share"] == told["target_share"] == 1.0 and told["findings"] == []
    assert told["reserve_in_motion_N"] > told["kept_for_control_N"] > 90.0  # type: ignore[operator]
    assert 6.0 < told["lowest_resonance_Hz"] < 8.0  # type: ignore[operator]
    loop = told["loop"]
    assert 0.45 <= loop["modulus_margin"] < 0.6  # type: ignore[index]
    assert 1.0 < loop["slowest_Hz"] < loop["fastest_Hz"] < 20.0  # type: ignore[index]
    assert re.search(r"its gain may still be 1.8 times off, or its phase 26 deg", shown.stderr)
    assert told["controlled"] == ["x", "y", "z", "rx", "ry", "rz"]
    assert "turns_at_most_rad" not in told
    swings = [axis["broken"]["swing_m"] for axis in told["axes"]]  # type: ignore[attr-defined]
    assert len(swings) == 8 and max(swings) == pytest.approx(0.57, abs=0.02)
    assert "targets up to 15.0 deg from home's orientation" in shown.stderr
    assert re.search(r"axis 6 +at \(.*\) m it swings 0.57 m and turns by 34 deg", shown.stderr)
    assert matplotlib.image.imread(picture).shape[0] > 1200  # three sections


def test_what_a_ceiling_cannot_hold_in_space_is_told_with_what_would_help(tmp_path: Path) -> None:
    path = tmp_path / "heavy.toml"
    suspended = (SHIPPED / "robots" / "suspended-8.toml").read_text()
    path.write_text(suspended.replace("mass_kg = 100.0", "mass_kg = 900.0"))
    told = {f.key: f.text for f in findings(load_robot(path)) if f.impossible}
    assert "the cables would need" in told["platform.home_m"]
    assert re.search(r"a platform of up to \d+ kg is possible there", told["platform.home_m"])
    path.write_text(suspended.replace("tension_max_N = 800.0", "tension_max_N = 1500.0"))
    told = {f.key: f.text for f in findings(load_robot(path)) if f.impossible}
    assert "allowed: up to 1333 N" in told["limits.tension_max_N"]


def test_a_loop_that_has_to_be_slow_is_told(tmp_path: Path) -> None:
    path = tmp_path / "late.toml"
    text = (SHIPPED / "robots" / "suspended-6.toml").read_text()
    path.write_text(re.sub(r"^sync_period_s = .*$", "", text, flags=re.M))
    assert not findings(load_robot(path))
    path.write_text("sync_period_s = 0.005\n" + path.read_text())
    (found,) = findings(load_robot(path))
    assert not found.impossible and "slowest mode at 0.24 Hz" in found.text


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["one-bus-8"], "this robot has none"),
        (["planr-3"], "did you mean 'planar-3'?"),
        (["planar-3", "--png", "/nowhere/robot.png"], "No such file or directory"),
    ],
)
def test_what_cannot_be_shown_is_one_clear_line(arguments: list[str], problem: str) -> None:
    shown = cdpr_here("robot", "show", *arguments)
    assert shown.returncode == 2
    (line,) = shown.stderr.strip().splitlines()
    assert line.startswith("cdpr: ") and problem in line


# -- new


def usual(question: Question, default: str, wrong: str) -> str:
    assert not wrong
    return default


@pytest.mark.parametrize("kind", list(KINDS))
def test_the_defaults_of_every_kind_are_a_robot_that_works(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    robot = write_robot(answers_of(path, {"kind": kind}, usual), path)
    assert [finding for finding in findings(robot) if finding.impossible] == []
    shipped = load_robot(kind)
    assert robot.platform is not None and shipped.platform is not None
    assert robot.platform.controlled == shipped.platform.controlled
    assert robot.platform.workspace_angle_rad == pytest.approx(
        shipped.platform.workspace_angle_rad, abs=1e-3
    )
    assert [len(robot.axes_on(bus.name)) for bus in robot.buses] == [
        len(robot.axes) // len(robot.buses)
    ] * len(robot.buses)


def test_kinds_are_told_before_the_first_question(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    done = cdpr_here("robot", "new", path, stdin="planar-5\n\n")
    assert done.returncode == 2 and not path.exists()
    for kind, what in KINDS.items():
        assert re.search(rf"{kind} +{re.escape(what)}", done.stderr)
    assert "value 'planar-5'; allowed: planar-3, planar-4, point-4" in done.stderr


def test_the_defaults_are_a_robot_that_works(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    done = cdpr_here("robot", "new", path, "--yes", "--json")
    assert done.returncode == 0, done.stderr
    assert as_json(done) == {"ok": True, "file": str(path)}
    robot = load_robot(path)
    assert robot.name == "mine" and findings(robot) == []
    assert [axis.name for axis in robot.axes] == ["upper left", "upper right", "lower"]
    platform, shipped = robot.platform, load_robot("planar-3").platform
    assert platform is not None and shipped is not None
    assert platform.exit_points_m == shipped.exit_points_m
    np.testing.assert_allclose(platform.anchor_points_m, shipped.anchor_points_m, atol=1e-4)
    statics = statics_of(robot)
    spare = RESERVE * (statics.high_N - statics.low_N).min()
    points = statics.box.grid(21, 21)
    assert statics.reserve_N(points, platform.acceleration_m_s2).min() > 0.85 * spare
    again = cdpr_here("robot", "new", path, "--yes")
    assert again.returncode == 2 and "not there yet" in again.stderr
    assert load_robot(path) == robot


def test_defaults_follow_from_where_the_cables_leave(tmp_path: Path) -> None:
    given = {"exit_1_m": "-2, 0", "exit_2_m": "2, 0", "exit_3_m": "0.2, 3", "side_m": "0.2"}
    path = tmp_path / "upright.toml"
    robot = write_robot(answers_of(path, given, usual), path)
    assert findings(robot) == []
    platform = robot.platform
    assert platform is not None
    # one corner up, the others towards their exit points
    (x1, y1), (x2, y2), (x3, y3) = platform.anchor_points_m
    assert x1 < 0 < x2 and y1 < 0 and y2 < 0 and abs(x3) < 1e-9 and y3 > 0
    assert platform.home_m[1] < platform.workspace_min_m[1]
    assert [axis.name for axis in robot.axes] == ["cable 1", "cable 2", "cable 3"]


def test_answers_are_asked_again_until_they_can_be(tmp_path: Path) -> None:
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
    answers += ["", "", "here", "0.1, 0.1", "-1", "0.2", "", "", "", "1.5", "400", "4", "15"]
    answers += ["10", "140", "", "", "", "-5, 0", "0.3, 1.9", "9, 9", ""]
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


def test_questions_nobody_answers_write_nothing(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    done = cdpr_here("robot", "new", path, stdin="\nMine\n\n")
    assert done.returncode == 2
    assert "no answer to 'bus' (--yes takes the defaults); nothing was written" in done.stderr
    assert "Traceback" not in done.stderr and not path.exists()


@pytest.mark.parametrize(
    ("key", "value", "problem"),
    [
        ("mass", "2", "--set mass: no such question; allowed: kind, name, winch,"),
        ("mass_kg", "nan", "--set mass_kg: value 'nan'; allowed: a number from 0.01 to 10000"),
        ("exit_1_m", "1,2,3", "--set exit_1_m: value '1,2,3'; allowed: two numbers"),
        ("name", "two\nlines", "allowed: a text of one line"),
    ],
)
def test_wrong_answers_beforehand_are_refused(
    tmp_path: Path, key: str, value: str, problem: str
) -> None:
    with pytest.raises(BadInputError) as caught:
        answers_of(tmp_path / "mine.toml", {key: value}, usual)
    assert problem in str(caught.value)


def test_what_cannot_work_is_written_and_told(tmp_path: Path) -> None:
    path = tmp_path / "point.toml"
    line = ["exit_1_m=-1,2", "exit_2_m=0,2", "exit_3_m=1,2", "side_m=0", 'name=A "line" é']
    done = cdpr_here("robot", "new", path, "--yes", *(p for text in line for p in ("--set", text)))
    assert done.returncode == 2
    assert "\nimpossible: platform." in done.stdout and "cdpr run" not in done.stdout
    assert load_robot(path).name == 'A "line" é'


def test_a_file_can_only_be_new_toml_in_a_folder(tmp_path: Path) -> None:
    done = cdpr_here("robot", "new", tmp_path / "nowhere" / "mine.toml", "--yes")
    assert done.returncode == 2
    assert "allowed: NAME.toml in a folder that is there" in done.stderr
