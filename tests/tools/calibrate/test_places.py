"""`--poses` selects the poses of a calibration by number or list."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.model.reachable import CONTACT, Reach
from cdpr_tools.calibrate.places import listed_places, poses_wanted
from cdpr_tools.errors import BadInputError
from cdpr_tools.robots.pose_choice import write_poses

ROBOT = load_robot("spatial-8")
MODEL = platform_model_of(ROBOT)


def listed(path: Path, count: int = 20) -> np.ndarray:
    places = Reach(MODEL).draw(count, 3).positions
    write_poses(path, places, MODEL.platform.controlled, MODEL.positions)
    return places


@pytest.mark.parametrize("name", ["poses.csv", "poses.toml"])
def test_a_list_gives_all_its_poses_and_home(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    places = listed(path)
    count, found = poses_wanted(ROBOT, str(path))
    assert count == 21 and found is not None
    assert np.array(found) == pytest.approx(places, abs=1e-6)
    batches = np.concatenate(list(listed_places(ROBOT, np.array(found)).batches()))
    assert sorted(map(tuple, batches.tolist())) == sorted(found)


def test_the_option_poses_takes_a_number_from_15_to_1000() -> None:
    assert poses_wanted(ROBOT, None) == (None, None)
    assert poses_wanted(ROBOT, "15") == (15, None)
    for text in ("14", "1001", "-20", "1.5", "", "9" * 5000):
        allowed = r".*: allowed: 15 to 1000, or NAME\.csv or NAME\.toml"
        with pytest.raises(BadInputError, match=f"--poses {text[:20]}{allowed}"):
            poses_wanted(ROBOT, text)


@pytest.mark.parametrize(
    ("line", "cell", "text", "named"),
    [
        (2, 0, "9.0", r"poses\.csv:3: pose at 9, .* outside the workspace; allowed: \[-0\.5"),
        (2, 5, "0.5", r"poses\.csv:3: .*: turned by .* deg; allowed: up to 15\.0 deg"),
        (2, 1, "much", r"poses\.csv:3: y: value 'much' is not a number"),
        (2, 5, None, r"poses\.csv:3: 5 cells; allowed: 6"),
        (0, 5, None, r"poses\.csv:1: column rz is missing; allowed: x, .*, rz, each with"),
        (0, 0, "q_m", r"poses\.csv:1: .*'q_m'"),
        (2, 1, "1" * 200_000, r"poses\.csv:3: field larger than"),
    ],
)
def test_invalid_lists_are_rejected(
    tmp_path: Path, line: int, cell: int, text: str | None, named: str
) -> None:
    path = tmp_path / "poses.csv"
    listed(path)
    lines = [row.split(",") for row in path.read_text().splitlines()]
    lines[line][cell : cell + 1] = [] if text is None else [text]
    path.write_text("\n".join(",".join(row) for row in lines) + "\n")
    with pytest.raises((BadInputError, InvalidRequestError), match=named):
        poses_wanted(ROBOT, str(path))


def test_a_list_of_too_few_poses_is_rejected(tmp_path: Path) -> None:
    listed(tmp_path / "poses.csv", 13)
    with pytest.raises(BadInputError, match="13 poses; allowed: 14 to 999, home is read besides"):
        poses_wanted(ROBOT, str(tmp_path / "poses.csv"))


def test_byte_order_mark_and_comments_may_precede_the_columns(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    places = listed(path)
    path.write_text("\ufeff# drawn by hand\n\n" + path.read_text(), encoding="utf-8")
    assert np.array(poses_wanted(ROBOT, str(path))[1]) == pytest.approx(places, abs=1e-6)


def test_a_duplicate_pose_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    listed(path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines, lines[5]]) + "\n")
    with pytest.raises(InvalidRequestError, match=r"poses\.csv:22: occurs twice"):
        poses_wanted(ROBOT, str(path))


def test_a_pose_with_contact_on_the_way_is_rejected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    listed(tmp_path / "poses.csv")
    shares, why = np.ones(20), np.zeros(20, int)
    shares[3], why[3] = 0.4, CONTACT
    monkeypatch.setattr(Reach, "shares", lambda *_: (shares, why))
    said = r"poses\.csv:5: the straight line from the middle, .* m, touches something after 40%"
    with pytest.raises(InvalidRequestError, match=said):
        poses_wanted(ROBOT, str(tmp_path / "poses.csv"))
