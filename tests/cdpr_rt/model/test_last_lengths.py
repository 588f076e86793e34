"""The lengths of the last stop: the file that keeps them, and their check by index pulses."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from cdpr_rt.core.estimate import AxisEstimate
from cdpr_rt.core.exchange import AxisFeedback
from cdpr_rt.model.last_lengths import LastLengths, index_disagreement, off_index_m
from cdpr_rt.state_file import StateFileError

CABLE_m = np.array([0.026, -0.026, 0.03])
LENGTH_m = np.array([2.0, 2.5, 1.2])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "state" / "lengths.json"


def stopped(path: Path) -> LastLengths:
    """Return what a stop keeps: motors at 1, 2 and 3 rad, the indices of two of them known."""
    estimate, feedback = AxisEstimate(3), AxisFeedback(3)
    estimate.cable_m_per_rad[:], estimate.cable_length_m[:] = CABLE_m, LENGTH_m
    estimate.length_known[:] = True
    feedback.position_rad[:] = (1.0, 2.0, 3.0)
    feedback.index_rad[:], feedback.index_known[:] = (0.5, 2.5, 0.0), (True, True, False)
    last = LastLengths(path)
    last.keep(estimate, feedback)
    return last


def read(path: Path) -> LastLengths:
    last = LastLengths(path)
    last.load(3, 3.0)
    return last


def test_a_start_reads_the_lengths_that_the_stop_has_written(path: Path):
    stopped(path)
    last = read(path)
    assert last.lengths is not None
    assert last.lengths.cable_length_m == pytest.approx(LENGTH_m)
    assert last.lengths.cable_at_index_m[:2] == pytest.approx([2.0 - 0.013, 2.5 - 0.013])
    assert math.isnan(last.lengths.cable_at_index_m[2])
    # drives count from an arbitrary angle after power-on: only later rotation matters
    last.begin_to_move(np.array([70.0, 0.0, -5.0]))
    taken = last.take()
    assert taken is not None
    assert taken.at(np.array([71.0, 1.0, -5.0]), CABLE_m) == pytest.approx([2.026, 2.474, 1.2])
    assert last.lengths is None


def test_a_robot_that_was_not_stopped_leaves_no_lengths(path: Path):
    stopped(path).begin_to_move(np.zeros(3))
    last = read(path)
    assert last.lengths is None
    assert "was moving" in last.why
    assert last.fallen


def test_a_robot_that_was_stopped_with_slack_cables_has_not_fallen(path: Path):
    last = read(path)
    last.begin_to_move(np.zeros(3))
    assert read(path).fallen
    last.keep(AxisEstimate(3), AxisFeedback(3))
    assert not read(path).fallen
    assert "the lengths at its last stop are not known" in read(path).why


@pytest.mark.parametrize("flag", ["fallen", "displaced"])
def test_a_fallen_or_displaced_platform_is_remembered_until_cleared(path: Path, flag: str):
    last = read(path)
    last.begin_to_move(np.zeros(3))
    setattr(last, flag, True)
    for _ in range(2):
        last.keep(AxisEstimate(3), AxisFeedback(3))  # enabled and disabled, no cable wound
        last = read(path)
        assert getattr(last, flag)
        last.begin_to_move(np.zeros(3))
    setattr(last, flag, False)
    last.fallen = False
    last.keep(AxisEstimate(3), AxisFeedback(3))
    assert not getattr(read(path), flag)


def test_lengths_of_motors_that_did_not_move_stay_valid(path: Path):
    stopped(path)
    last = read(path)
    last.begin_to_move(np.zeros(3))
    last.keep(AxisEstimate(3), AxisFeedback(3))
    assert read(path).lengths is not None
    last.take()
    last.begin_to_move(np.zeros(3))
    last.keep(AxisEstimate(3), AxisFeedback(3))
    assert read(path).lengths is None


def held(length_m: list[object], at_index_m: list[object]) -> str:
    lengths = {"cable_length_m": length_m, "cable_at_index_m": at_index_m}
    return json.dumps({"stopped": True, "date": "", **lengths})


@pytest.mark.parametrize(
    "damage",
    [
        "{",
        "[]",
        "{}",
        held([1.0], [1]),
        held([1.0, "x", 2.0], [None] * 3),
        held([1.0, 6.1, 2.0], [None] * 3),  # more than twice the longest cable in use
    ],
)
def test_a_damaged_file_gives_no_lengths_and_is_named(path: Path, damage: str):
    path.parent.mkdir()
    path.write_text(damage)
    last = read(path)
    assert last.lengths is None
    assert last.fallen
    assert str(path) in last.why


def test_a_file_that_cannot_be_written_is_reported(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StateFileError, match="cannot be written"):
        stopped(tmp_path / "file" / "lengths.json")


@pytest.mark.parametrize("turns", [0, 1, -3])
@pytest.mark.parametrize("slip_m", [0.0, 0.02, -0.05])
def test_an_index_shows_a_cables_error_apart_from_whole_turns(
    path: Path, turns: int, slip_m: float
):
    last = stopped(path).lengths
    assert last is not None
    feedback = AxisFeedback(3)
    feedback.position_rad[:] = (10.0, 20.0, 30.0)
    feedback.index_known[:] = (True, False, True)
    # the motors' indices, of cables whose lengths differ from those at the stop by `slip_m`
    feedback.index_rad[:] = 10.0 + (last.cable_at_index_m - LENGTH_m) / CABLE_m + math.tau * turns
    off = off_index_m(last, LENGTH_m + slip_m, feedback, CABLE_m)
    assert off[0] == pytest.approx(slip_m, abs=1e-9)
    assert np.isnan(off[1:]).all()


@pytest.mark.parametrize("m_per_turn", [0.0188, 0.0628, 0.164])  # of gears of 20:1, 10:1, 4:1
def test_a_motor_that_was_turned_by_40_degrees_is_reported_at_any_gear_ratio(
    path: Path, m_per_turn: float
):
    last, feedback = stopped(path).lengths, AxisFeedback(3)
    assert last is not None
    cable_m = np.full(3, m_per_turn / math.tau)
    feedback.index_known[:2] = True
    here = (last.cable_at_index_m - LENGTH_m) / cable_m
    feedback.index_rad[:] = here + np.radians((10.0, -10.0, 90.0))
    names = ("left", "right", "top")
    off_m = off_index_m(last, LENGTH_m, feedback, cable_m)
    assert index_disagreement(off_m, cable_m, 0.03, names) == ""
    feedback.index_rad[1] = here[1] + math.radians(400.0)
    off_m = off_index_m(last, LENGTH_m, feedback, cable_m)
    told = index_disagreement(off_m, cable_m, 0.03, names)
    off_mm, allowed_mm = 1e3 * m_per_turn * 40.0 / 360.0, 1e3 * m_per_turn * 0.05
    assert told == (
        f"right: its motor's index is {off_mm:.1f} mm from its place at the last stop, "
        f"{allowed_mm:.1f} mm allowed: lower the platform, and tighten from home"
    )


def test_lengths_by_another_geometry_are_not_used(path: Path):
    stopped(path)
    last = LastLengths(path)
    last.geometry = "5f3a"
    last.load(3, 3.0)
    assert last.lengths is None and "a calibration other than" in last.why
