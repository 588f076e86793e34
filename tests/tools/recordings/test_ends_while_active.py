"""`cdpr log` of recordings that end while the robot is active."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from cdpr_here import cdpr_here
from matplotlib.image import imread

from cdpr_rt.core.shared_block import RowWriter
from cdpr_rt.service.recordings.recording import Recorder
from cdpr_tools.recordings.picture import FIELDS, end_while_active
from cdpr_tools.recordings.selection import Selection
from tests.cdpr_rt.service.recordings.recording_rig import block_with_clock, made_rows, put


def _ends_active(folder: Path, state: str) -> tuple[Path, list[tuple[float, str]]]:
    """Record a motion whose cycles end while it is active, and what its picture tells of that."""
    rows = made_rows(0, 1000)
    rows["program"][:] = 2
    block = block_with_clock()
    block.write_description({"robot": "bench", "programs": ["idle", "hold", "path"]})
    recorder = Recorder(block, folder, "bench", reserve_bytes=0)
    recorder.begin()
    put(RowWriter(block), rows)
    block.write_status({"state": "active"})
    recorder.look()
    block.write_status({"state": state, "reason": "the loop has died: killed by signal 9"})
    recorder.finish()
    (path,) = folder.glob("*.mcap")
    selection = Selection([path], FIELDS)
    return path, end_while_active(selection, selection.columns())


def test_a_recording_that_a_killed_loop_has_ended_says_so(tmp_path: Path) -> None:
    path, ((end_s, told),) = _ends_active(tmp_path, "dead")
    assert end_s == pytest.approx(0.999) and "while the robot was active" in told
    shown = cdpr_here("log", "info", path).stdout
    assert f"{told}\n" in shown and "path: cut short: the control loop ended without a" in shown
    assert cdpr_here("log", "plot", path).returncode == 0
    marked = imread(path.with_suffix(".png"))
    selection = Selection([path], FIELDS, until_s=0.5)
    assert end_while_active(selection, selection.columns()) == []
    other, told_of_it = _ends_active(tmp_path / "other", "active")
    assert told_of_it == []  # closed in order: the next file goes on from there
    assert cdpr_here("log", "plot", other).returncode == 0
    red = np.array([0xB3, 0x26, 0x1E]) / 255
    reds = [
        np.count_nonzero(np.abs(picture[..., :3] - red).max(axis=2) < 0.01)
        for picture in (marked, imread(other.with_suffix(".png")))
    ]
    assert reds[0] > 1000 and reds[1] == 0
    shown = cdpr_here("log", "info", other).stdout
    assert "while the robot was active" not in shown


def test_a_recording_that_breaks_off_while_active_says_so_unless_another_goes_on(
    tmp_path: Path,
) -> None:
    path, _ = _ends_active(tmp_path, "active")
    path.write_bytes(path.read_bytes()[:-100])
    shown = cdpr_here("log", "info", path).stdout
    assert "ends while the robot was active: its writer was ended, or still writes" in shown
    shutil.copy(path, path.with_name(path.name.replace("-001", "-002")))
    shown = cdpr_here("log", "info", path).stdout
    assert "while the robot was active" not in shown
