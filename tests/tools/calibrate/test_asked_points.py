"""Points that a person measures and types while the platform stands."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.readings import load_points
from cdpr_tools.calibrate import daemon_run
from cdpr_tools.calibrate.daemon_run import AskedPoints, require_points_of
from cdpr_tools.calibrate.measure_poses import StoppedError
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output


class Standing:
    """A platform at rest until a test moves it. Text is typed when its pose is read."""

    def __init__(self, typed: int) -> None:
        self.place, self.typed = np.array([0.01, 0.02, 0.3]), typed
        self.later: list[bytes] = []
        self.looks = 0

    def __call__(self) -> FloatArray:
        self.looks += 1
        if self.looks > 1 and self.later:
            os.write(self.typed, self.later.pop(0))
        return self.place


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Return the end of a pipe that replaces typed input."""
    source, sink = os.pipe()
    with os.fdopen(source) as stdin:
        monkeypatch.setattr(daemon_run.sys, "stdin", stdin)
        yield sink


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Return the end of a terminal that replaces typed input."""
    ours, theirs = os.openpty()
    with os.fdopen(theirs) as stdin:
        monkeypatch.setattr(daemon_run.sys, "stdin", stdin)
        yield ours
    os.close(ours)


def asked(folder: Path, coordinates: int, place: Standing) -> AskedPoints:
    return AskedPoints(Output(as_json=False), folder / "points.csv", coordinates, place)


def test_typed_measurements_are_stored_as_points(
    tmp_path: Path, typed: int, capsys: pytest.CaptureFixture[str]
) -> None:
    ask = asked(tmp_path, 3, Standing(typed))
    os.write(typed, b"1 2\n1.5 -2 3e2\n\n4 5 306 0.3\n7 8 9 -1\nnan 0 0\n0,5 1 2\n10 11 312\n13 14")
    os.close(typed)
    for pose in (1, 2, 3, 4, 5, 6):
        ask(pose)
    points = load_points(tmp_path / "points.csv")
    assert [point.pose for point in points] == [0, 2, 3]
    assert points[0].position_m.tolist() == [0.0015, -0.002, 0.3]
    assert [point.std_m for point in points] == [0.002, 0.0003, 0.002]
    said = capsys.readouterr().err.splitlines()
    assert sum("allowed: x y z" in line for line in said) == 4
    assert said[-1].startswith(
        "the platform stands at pose 5"
    )  # after the end of input there are no questions


def test_a_point_far_from_the_pose_by_cables_is_asked_again(
    tmp_path: Path, typed: int, capsys: pytest.CaptureFixture[str]
) -> None:
    ask = asked(tmp_path, 3, Standing(typed))
    os.write(typed, b"0.01 0.02 0.3\n10 20 301\n410 20 300\n410 20 300\n")
    ask(1)  # metres, then the right numbers
    ask(2)  # the same numbers twice
    points = load_points(tmp_path / "points.csv")
    assert [point.position_m[0] for point in points] == pytest.approx([0.01, 0.41])
    said = capsys.readouterr().err
    assert "that is 301 mm from the position given by the cable lengths, 10 20 300;" in said
    assert said.count("type it again") == 2
    os.close(typed)


def test_input_typed_before_the_platform_stood_is_discarded(tmp_path: Path, terminal: int) -> None:
    place = Standing(terminal)
    ask = asked(tmp_path, 3, place)
    os.write(terminal, b"11 22 310\n12 22 310\n")
    place.later = [b"13 22 310\n"]
    ask(1)
    place.later, place.looks = [b"14 22 310\n"], 0
    ask(2)
    points = load_points(tmp_path / "points.csv")
    assert [point.position_m[0] for point in points] == pytest.approx([0.013, 0.014])


def test_no_point_is_stored_if_the_platform_moved_meanwhile(tmp_path: Path, typed: int) -> None:
    place = Standing(typed)

    def moved() -> FloatArray:
        here = place()
        return here if place.looks == 1 else here + 0.01

    ask = AskedPoints(Output(as_json=False), tmp_path / "points.csv", 3, moved)
    os.write(typed, b"10 20 300\n")
    with pytest.raises(WorkFailedError, match="moved after pose 4 was read"):
        ask(4)
    assert not load_points(tmp_path / "points.csv")
    os.close(typed)


def test_measuring_without_an_input_is_rejected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(daemon_run.sys, "stdin", None)
    asked(tmp_path, 2, Standing(0))(1)


def test_points_of_missing_poses_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    require_points_of(0, path)
    path.write_text("pose,x_mm,y_mm,sigma_mm\n")
    require_points_of(0, path)
    path.write_text("pose,x_mm,y_mm,sigma_mm\n1,0,0\n3,0,0\n")
    require_points_of(3, path)
    with pytest.raises(BadInputError, match="point of pose 3, but only 2 poses were read"):
        require_points_of(2, path)


def test_a_stop_ends_the_questions(tmp_path: Path, typed: int) -> None:
    def stopped() -> FloatArray:
        raise StoppedError

    ask = AskedPoints(Output(as_json=False), tmp_path / "points.csv", 2, stopped)
    with pytest.raises(StoppedError):
        ask(1)
    os.close(typed)
