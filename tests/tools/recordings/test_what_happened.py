"""`cdpr log` reports programs, faults with their reasons, and the end of a recording."""

from __future__ import annotations

import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from cdpr_here import cdpr_here
from matplotlib.image import imread

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_tools.daemon.paths import default_recordings
from cdpr_tools.output import Output
from cdpr_tools.recordings.picture import FIELDS, end_while_active, faults_of
from cdpr_tools.recordings.selection import Selection
from cdpr_tools.recordings.summary import summarise, summary_lines, worth_telling
from tests.cdpr_rt.service.recording_rig import made_rows
from tests.tools.recordings.made_recording import LEFT_RIGHT, record

ESTOP = "emergency stop by cdpr estop"


def active(*programs: int) -> Row:
    """Return 1000 rows with power, divided equally among the given programs in order."""
    rows = made_rows(0, 1000)
    rows["state"] = LoopState.ACTIVE
    rows["program"] = np.repeat(programs, -(-1000 // len(programs)))[:1000]
    return rows


def shown(path: Path) -> str:
    return cdpr_here("log", "info", path).stdout


def faults(path: Path) -> list[tuple[float, str]]:
    selection = Selection([path], FIELDS)
    return faults_of(selection.readers, selection.columns())


def test_programs_and_faults_are_listed_with_times(tmp_path: Path) -> None:
    rows = active(0, 0, 0, 1, 1, 1, 0, 0, 0, 0)
    rows["pose"] = rows["pose_setpoint"] = [0.3, 2.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    rows["pose"][:, 0] += 1e-3 * np.linspace(0.0, 1.0, 1000)
    rows["reaction"][700:], rows["limit"][700:] = Reaction.CONTROLLED_STOP, Limit.BROKEN_CABLE
    rows["limit_axis"][700:], rows["state"][900:] = 1, LoopState.FAULT
    path = record(tmp_path, rows, axes=LEFT_RIGHT, programs=["hold", "pose"])
    runs = summarise(path, Output(as_json=True))["runs"]
    assert [run["program"] for run in runs] == ["hold", "pose", "hold"]
    assert [run.get("cut_short_by") for run in runs] == [None, None, "a fault"]
    told = shown(path)
    assert "pose: ended, platform at 300.6, 2000.0 mm, 0.6 mm from its set-point" in told
    (after_s, text), (fault_s, _) = faults(path)
    assert after_s == pytest.approx(0.7, abs=1e-3) and fault_s == pytest.approx(0.9, abs=1e-3)
    assert text == "controlled stop by broken cable of right"
    assert cdpr_here("log", "plot", path).returncode == 0


def test_a_motion_ended_by_an_emergency_stop_is_reported_as_such(tmp_path: Path) -> None:
    rows = active(1, 2, 2, 0, 0)
    rows["state"][603:] = (
        LoopState.FAULT
    )  # power is off immediately, without a reaction of the supervisor
    said = [(620, {"state": "fault", "reason": ESTOP, "reason_limit": None})]
    programs = ["idle", "pose", "path"]
    path = record(tmp_path, rows, said=said, axes=LEFT_RIGHT, programs=programs)
    told = shown(path)
    assert f"path: interrupted: {ESTOP}; then left" in told and "pose: ended, left" in told
    assert [text for _, text in faults(path)] == [f"state fault: {ESTOP}"]


def test_a_failed_program_is_reported_as_failed(tmp_path: Path) -> None:
    rows = active(1, 1, 1, 0, 0, 0, 1, 1, 1, 1)
    rows["stamp_ns"] += time.monotonic_ns() - rows["stamp_ns"][599]
    rows["stamp_ns"][600:] += 3600 * 10**9  # tightened again an hour later
    why = "tighten: left: 9 mm reeled in"
    said = [(300, {"failure": ""}), (600, {"failure": why}), (900, {"failure": ""})]
    path = record(tmp_path, rows, said=said, axes=LEFT_RIGHT, programs=["hold", "tighten"])
    runs = summarise(path, Output(as_json=True))["runs"]
    assert [run.get("failed_by") for run in runs] == ["left: 9 mm reeled in", None, None]
    told = shown(path)
    assert "tighten: failed: left: 9 mm reeled in; then left" in told
    assert "tighten: ended, left" in told
    assert any(line.endswith(f"  {why}") for line in told.splitlines())


def test_a_lowering_caused_by_a_stop_is_reported_as_ended(tmp_path: Path) -> None:
    rows = active(1, 1, 1, 2, 2, 2, 2, 2, 0, 0)
    rows["reaction"][300:320] = Reaction.CONTROLLED_STOP
    rows["state"][803:] = LoopState.FAULT  # program idle runs in the last cycles with power
    told = shown(record(tmp_path, rows, axes=LEFT_RIGHT, programs=["idle", "pose", "lower"]))
    assert "pose: interrupted: a fault; then left" in told
    assert "lower: ended, left" in told


def test_the_reason_is_shown_with_the_limit_that_caused_it_and_not_with_the_next(
    tmp_path: Path,
) -> None:
    why = "right: the cable seems broken: tension fell suddenly to 6.5 N, from above 36.0 N"
    rows = active(1)
    rows["reaction"][600:], rows["limit_axis"][600:] = Reaction.CONTROLLED_STOP, 1
    rows["limit"][600:602], rows["limit"][602:] = Limit.BROKEN_CABLE, Limit.SPEED
    limit = {"limit": "broken_cable", "axis": 1, "reaction": "controlled stop"}
    said = [(690, {"reason": why, "reason_limit": limit})]
    path = record(tmp_path, rows, said=said, axes=LEFT_RIGHT, programs=["idle", "hold"])
    assert [text for _, text in faults(path)] == [
        f"controlled stop by broken cable: {why}",
        "controlled stop by speed of right",
    ]


def test_a_repeated_reason_is_reported_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = active(0)
    rows["state"][300:500] = rows["state"][700:] = LoopState.FAULT
    said = [
        (row, {"state": "fault" if reason else "active", "reason": reason})
        for row, reason in ((310, ESTOP), (510, ""), (710, ESTOP), (1000, ESTOP))
    ]

    path = record(
        tmp_path, rows, said=said, clock=monkeypatch, axes=LEFT_RIGHT[:1], programs=["hold"]
    )
    assert [text for _, text in faults(path)] == [f"state fault: {ESTOP}"] * 2


def test_a_fault_is_shown_despite_later_events(tmp_path: Path) -> None:
    figures = summarise(record(tmp_path, active(0), programs=["hold"]), Output(as_json=True))
    events = [
        {"text": "state fault", "cycle": 7, "reaction": 0},
        {"text": "emergency stop", "limit": None},
        {"text": "program path", "cycle": 9, "reaction": 0},
        *({"text": f"hold by me {k}", "kind": "command"} for k in range(50)),
    ]
    figures["events"] = [{"after_s": 1.0, **event} for event in events]
    told = [line.split("  ")[-1] for line in summary_lines(figures, 10)[-10:]]
    assert told == ["state fault", "emergency stop", *(f"hold by me {k}" for k in range(42, 50))]


def test_repeated_rejections_and_grants_do_not_fill_the_list() -> None:
    texts = ["pose by me: refused: a", "pose by me: refused: b", "state fault"]
    events = [{"text": text, "kind": "command"} for text in texts]
    events.insert(0, {"text": "me may move", "kind": "control"})
    told = worth_telling(events)
    assert [(event["text"], event["times"]) for event in told] == [(texts[0], 2), (texts[2], 1)]


def ends_active(folder: Path, state: str) -> tuple[Path, list[tuple[float, str]]]:
    """Record a motion that ends while active. Return the file and the marks of its picture."""
    said = [(1000, {}), (1000, {"state": state, "reason": "the loop has died: signal 9"})]
    path = record(folder, active(2), said=said, programs=["idle", "hold", "path"])
    selection = Selection([path], FIELDS)
    return path, end_while_active(selection, selection.columns())


def test_a_recording_ended_by_a_killed_loop_is_reported_as_such(tmp_path: Path) -> None:
    path, ((end_s, told),) = ends_active(tmp_path, "dead")
    assert end_s == pytest.approx(0.999) and "while the robot was active" in told
    assert f"{told}\n" in shown(path)
    assert "path: interrupted: the control loop ended without a" in shown(path)
    selection = Selection([path], FIELDS, until_s=0.5)
    assert end_while_active(selection, selection.columns()) == []
    other, told_of_it = ends_active(tmp_path / "other", "active")
    assert told_of_it == []  # closed properly: the next file continues it
    assert "while the robot was active" not in shown(other)
    red, reds = np.array([0xB3, 0x26, 0x1E]) / 255, []
    for one in (path, other):
        assert cdpr_here("log", "plot", one).returncode == 0
        pixels = imread(one.with_suffix(".png"))[..., :3]
        reds.append(np.count_nonzero(np.abs(pixels - red).max(axis=2) < 0.01))
    assert reds[0] > 1000 and reds[1] == 0


def test_a_truncated_recording_is_reported_unless_another_file_continues_it(
    tmp_path: Path,
) -> None:
    path, _ = ends_active(tmp_path, "active")
    path.write_bytes(path.read_bytes()[:-100])
    assert "ends while the robot was active: its writer was killed, or a daemon of" in shown(path)
    with path.open("ab"):
        live = shown(path)
    assert "MB, still being recorded" in live
    assert "while the robot was active" not in live
    shutil.copy(path, path.with_name(path.name.replace("-001", "-002")))
    assert "while the robot was active" not in shown(path)


def test_without_a_file_the_newest_session_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    folder = default_recordings()
    folder.mkdir(parents=True)
    path = record(tmp_path, active(0), axes=LEFT_RIGHT, programs=["hold"])
    older, newer = (folder / f"bench-2026010{day}T120000Z-001.mcap" for day in (1, 2))
    shutil.copy(path, newer)
    shutil.copy(path, older)
    result = cdpr_here("log", "info")
    assert result.returncode == 0
    assert newer.name in result.stdout and older.name not in result.stdout
    assert cdpr_here("log", "plot").returncode == 0
    assert newer.with_suffix(".png").exists()
