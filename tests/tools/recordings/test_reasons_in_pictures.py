"""What a recording's picture says of the limits that were passed."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from cdpr_profiles.limits.robot_limits import Limit
from cdpr_rt.core.shared_block import RowWriter
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.service.recordings.recording import Recorder
from cdpr_tools.recordings.picture import FIELDS, faults_of
from cdpr_tools.recordings.selection import Selection
from tests.cdpr_rt.service.recordings.recording_rig import block_with_clock, made_rows, put


def test_the_reason_is_told_with_the_cable_that_broke_not_with_the_winch_that_ran_away(
    tmp_path: Path,
) -> None:
    why = "right: the cable seems broken: tension fell to 6.5 N at once, from above 36.0 N"
    rows = made_rows(0, 1000)
    rows["state"][:] = LoopState.ACTIVE
    rows["reaction"][600:], rows["limit_axis"][600:] = Reaction.CONTROLLED_STOP, 1
    rows["limit"][600:602], rows["limit"][602:] = Limit.BROKEN_CABLE, Limit.SPEED
    block = block_with_clock()
    axes = [{"name": "left"}, {"name": "right"}]
    block.write_description({"robot": "bench", "axes": axes, "programs": ["idle", "hold"]})
    recorder, writer = Recorder(block, tmp_path, "bench", reserve_bytes=0), RowWriter(block)
    recorder.begin()
    put(writer, rows[:690])
    limit = {"limit": "broken_cable", "axis": 1, "reaction": "controlled stop"}
    block.write_status({"state": "active", "reason": why, "reason_limit": limit})
    recorder.look()
    put(writer, rows[690:])
    recorder.finish()
    (path,) = tmp_path.iterdir()
    selection = Selection([path], FIELDS)
    told = [text for _, text in faults_of(selection.readers, selection.columns())]
    assert told == [
        f"controlled stop by broken cable: {why}",
        "controlled stop by speed of right",
    ]


def test_a_reason_that_comes_again_is_told_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    why = "emergency stop by cdpr estop"
    rows = made_rows(0, 1000)
    for begin, end, state in ((0, 300, "ACTIVE"), (300, 500, "FAULT"), (500, 700, "ACTIVE")):
        rows["state"][begin:end] = LoopState[state]
    rows["state"][700:] = LoopState.FAULT
    block = block_with_clock()
    block.write_description({"robot": "bench", "axes": [{"name": "left"}], "programs": ["hold"]})
    recorder, writer = Recorder(block, tmp_path, "bench", reserve_bytes=0), RowWriter(block)
    recorder.begin()
    for begin, end, reason in ((0, 310, why), (310, 510, ""), (510, 710, why), (710, 1000, why)):
        put(writer, rows[begin:end])
        now_ns = int(rows["stamp_ns"][end - 1])
        monkeypatch.setattr(time, "monotonic_ns", lambda at_ns=now_ns: at_ns)
        block.write_status({"state": "fault" if reason else "active", "reason": reason})
        recorder.look()
    recorder.finish()
    (path,) = tmp_path.iterdir()
    selection = Selection([path], FIELDS)
    told = [text for _, text in faults_of(selection.readers, selection.columns())]
    assert told == [f"state fault: {why}", f"state fault: {why}"]
