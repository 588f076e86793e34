"""Robots with other numbers of cables than `cdpr robot new` describes, as the pages say."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from cdpr_drivers.robot.bus_fit import require_fit
from cdpr_profiles import load_robot
from cdpr_rt.robots.feasibility.checks import refuse_impossible
from cdpr_rt.robots.statics import statics_of
from cdpr_tools.robots.new_robot import answers_of, write_robot
from cdpr_tools.robots.questions import Question


def _usual(_: Question, default: str, wrong: str) -> str:
    assert not wrong
    return default


def _point(axis: str, key: str, point_m: tuple[float, ...]) -> str:
    return re.sub(rf"^{key} = \[.*?\]", f"{key} = {list(point_m)}", axis, flags=re.MULTILINE)


def _file_of(kind: str, path: Path) -> tuple[str, list[str]]:
    """Return the head and the axes of a file as `cdpr robot new` writes it."""
    write_robot(answers_of(path, {"kind": kind}, _usual), path)
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
def test_one_more_cable_straight_below_or_above_the_middle(
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


def test_a_point_on_two_cables_in_a_plane(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    head, axes = _file_of("planar-3", path)
    head = re.sub(r"^mass_kg = \S+", "mass_kg = 6.5", head, flags=re.MULTILINE)
    upper = [_point(axis, "anchor_point_m", (0.0, 0.0)) for axis in axes[:2]]
    _require_works(path, head, upper)


def test_a_point_on_three_cables_from_above(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    head, axes = _file_of("point-4", path)
    _, y_m, z_m = (float(x) for x in re.findall(r"exit_point_m = \[(.*?)\]", axes[2])[0].split(","))
    _require_works(path, head, [*axes[:2], _point(axes[2], "exit_point_m", (0.0, y_m, z_m))])
