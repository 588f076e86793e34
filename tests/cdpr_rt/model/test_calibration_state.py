"""The file that says whether a robot is calibrated."""

from __future__ import annotations

import json
import multiprocessing
import os
import re
from pathlib import Path

import pytest

from cdpr_rt.model.calibration_state import (
    calibrated_flag_file,
    calibration_state,
    mark_calibrated,
    mark_not_calibrated,
    not_calibrated_reason,
)
from cdpr_rt.state_file import StateFileError


@pytest.fixture(autouse=True)
def state_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def test_a_robot_is_calibrated_only_after_it_was_marked() -> None:
    assert not calibration_state("spatial-8").calibrated
    assert not_calibrated_reason("spatial-8") == "", "it has the geometry of its file"
    mark_calibrated("spatial-8", "camera calibration of 40 poses")
    told = calibration_state("spatial-8")
    assert told.calibrated and told.why == "camera calibration of 40 poses" and told.date
    assert not_calibrated_reason("spatial-8") == ""
    mark_not_calibrated("spatial-8", "rail 3 was moved")
    assert re.search(
        r"'spatial-8' is not .* since 20\d\d-.*: rail 3", not_calibrated_reason("spatial-8")
    )
    assert not calibration_state("planar-3").calibrated


@pytest.mark.parametrize(
    "held", [b"", b"{", b"\xff\xfe", b"[1]", b'{"calibrated": 1, "why": "", "date": ""}']
)
def test_a_damaged_file_counts_as_not_calibrated_and_is_replaced(held: bytes) -> None:
    path = calibrated_flag_file("spatial-8")
    path.parent.mkdir(parents=True)
    path.write_bytes(held)
    state = calibration_state("spatial-8")
    assert not state.calibrated
    assert str(path) in state.why and "damaged" in state.why
    assert "damaged" in not_calibrated_reason("spatial-8")
    mark_calibrated("spatial-8", "again")
    assert calibration_state("spatial-8").calibrated


def test_an_error_names_the_file_that_cannot_be_written(state_home: Path) -> None:
    (state_home / "cdpr-rt").write_text("a file where the folder should be")
    with pytest.raises(StateFileError, match=str(state_home)):
        mark_not_calibrated("spatial-8", "rail 3 was moved")


def test_a_robot_name_cannot_lead_out_of_the_folder(state_home: Path) -> None:
    mark_not_calibrated("../../etc/x", "moved")
    assert calibrated_flag_file("../../etc/x").parent == state_home / "cdpr-rt"
    assert len(list((state_home / "cdpr-rt").iterdir())) == 1


def _write_many(count: int) -> None:
    for number in range(count):
        mark_not_calibrated("spatial-8", f"{os.getpid()} {number} " + "x" * 5000)


def test_a_reader_never_sees_half_a_file() -> None:
    mark_not_calibrated("spatial-8", "first")
    writers = [
        multiprocessing.get_context("fork").Process(target=_write_many, args=(30,))
        for _ in range(2)
    ]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        assert "damaged" not in calibration_state("spatial-8").why
        json.loads(calibrated_flag_file("spatial-8").read_bytes())
    for writer in writers:
        writer.join()
        assert writer.exitcode == 0
