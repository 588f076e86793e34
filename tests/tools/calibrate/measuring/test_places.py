"""Which poses `--poses` has a calibration go to, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.robots.platform_model import platform_model_of
from cdpr_rt.robots.reach.reachable import Reach
from cdpr_tools.calibrate.measuring.places import listed_places, poses_wanted
from cdpr_tools.errors import BadInputError
from cdpr_tools.robots.poses.choice import write_poses

ROBOT = load_robot("spatial-8")
MODEL = platform_model_of(ROBOT)


def listed(path: Path, count: int = 20) -> np.ndarray:
    places = Reach(MODEL).draw(count, 3).positions
    write_poses(path, places, MODEL.platform.controlled, MODEL.positions)
    return places


@pytest.mark.parametrize("name", ["poses.csv", "poses.toml"])
def test_a_list_is_gone_to_wholly_and_home_besides(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    places = listed(path)
    count, found = poses_wanted(ROBOT, str(path))
    assert count == 21 and found is not None
    assert np.array(found) == pytest.approx(places, abs=1e-6)
    batches = np.concatenate(list(listed_places(ROBOT, np.array(found)).batches()))
    assert sorted(map(tuple, batches.tolist())) == sorted(found)


def test_a_number_is_how_many() -> None:
    assert poses_wanted(ROBOT, None) == (None, None)
    assert poses_wanted(ROBOT, "15") == (15, None)
    for text in ("14", "1001", "-20"):
        with pytest.raises(BadInputError, match=f"--poses {text}: allowed: 15 to 1000, or a file"):
            poses_wanted(ROBOT, text)
    with pytest.raises(BadInputError, match=r"1\.5: allowed: NAME\.csv or NAME\.toml"):
        poses_wanted(ROBOT, "1.5")


@pytest.mark.parametrize(
    ("line", "cell", "text", "named"),
    [
        (2, 0, "9.0", r"poses\.csv:3: pose at 9\.000, .* outside the workspace; allowed: \[-0\.5"),
        (2, 5, "0.5", r"poses\.csv:3: .*: turned by .* deg; allowed: up to 15\.0 deg"),
        (2, 1, "much", r"poses\.csv:3: y: value 'much': no number"),
        (2, 5, None, r"poses\.csv:3: 5 cells; allowed: 6"),
        (0, 5, None, r"column rz is missing; allowed: the columns x_m,.*,rz_rad"),
        (0, 0, "q_m", r"column x is missing"),
    ],
)
def test_lists_that_cannot_be_gone_to_are_refused(
    tmp_path: Path, line: int, cell: int, text: str | None, named: str
) -> None:
    path = tmp_path / "poses.csv"
    listed(path)
    lines = [row.split(",") for row in path.read_text().splitlines()]
    lines[line][cell : cell + 1] = [] if text is None else [text]
    path.write_text("\n".join(",".join(row) for row in lines) + "\n")
    with pytest.raises((BadInputError, InvalidRequestError), match=named):
        poses_wanted(ROBOT, str(path))


def test_a_list_of_too_few_poses_is_refused(tmp_path: Path) -> None:
    listed(tmp_path / "poses.csv", 13)
    with pytest.raises(BadInputError, match="13 poses; allowed: 14 to 999, home is read besides"):
        poses_wanted(ROBOT, str(tmp_path / "poses.csv"))
