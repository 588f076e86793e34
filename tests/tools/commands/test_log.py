"""`cdpr log` on recordings made up of rows that are known."""

import json
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
from cdpr_here import cdpr_here
from matplotlib.image import imread

from cdpr_profiles.limits.robot_limits import Limit
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowWriter
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.service.recordings.recording import Recorder
from cdpr_tools.recordings.picture import FIELDS, faults_of, pose_curves, shades
from cdpr_tools.recordings.selection import Selection
from cdpr_tools.recordings.summary import Reasons, _chosen, worth_telling
from cdpr_tools.report.style import decimated
from tests.cdpr_rt.service.recordings.recording_rig import block_with_clock, made_rows, put


def _log(*arguments: str | Path) -> tuple[int, str, str]:
    """Run `cdpr log`; return its exit status and what it wrote."""
    ended = cdpr_here("log", *arguments)
    return ended.returncode, ended.stdout, ended.stderr


def _done(*arguments: str | Path) -> dict[str, Any]:
    status, out, errors = _log(*arguments, "--json")
    assert status == 0, errors
    told = json.loads(out.splitlines()[-1])
    assert told["ok"] is True
    return dict(told)


def _rows() -> Row:
    rows = made_rows(0, 4000)
    rows["state"][:1000] = LoopState.READY
    rows["state"][3500:] = LoopState.FAULT
    rows["lateness_s"][2000] = 3e-4
    rows["late_cycles"][2000:] = 1
    rows["missed"][3000:] = 2
    return np.delete(rows, slice(2500, 2510))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session of two files, of which the second was cut short by a power cut."""
    folder = tmp_path_factory.mktemp("recordings")
    block = block_with_clock()
    writer = RowWriter(block)
    rows = _rows()
    for first, last in ((0, 2000), (2000, rows.size)):
        recorder = Recorder(block, folder, "bench", reserve_bytes=0)
        put(writer, rows[first:last])
        recorder.start()
        recorder.stop()
    second = sorted(folder.iterdir())[1]
    second.write_bytes(second.read_bytes()[:-100])
    return folder


def test_info_counts_what_is_there_and_what_is_not(folder: Path) -> None:
    one, two = _done("info", folder)["recordings"]
    assert [one["rows"], two["rows"]] == [2000, 1990]
    assert [one["ended"], two["ended"]] == ["closed", "cut short"]
    assert [one["missing_cycles"], two["missing_cycles"]] == [0, 10]
    assert one["states_s"] == pytest.approx({"ready": 0.999, "active": 1.0})
    assert two["states_s"] == pytest.approx({"active": 1.499, "fault": 0.5})
    assert (two["late_cycles"], two["missed"]) == (0, 2)  # since the file's first row
    assert one["longest_lateness_s"] == 0.0 and two["longest_lateness_s"] == 3e-4
    assert one["axes"] == ["left", "right"] and one["robot"] == "bench"
    assert [event["text"] for event in two["events"]] == ["state active", "state fault"]
    _, shown, _ = _log("info", folder)
    assert "cut short" in shown and "10 cycles not recorded" in shown and "state fault" in shown


def test_exports_are_the_rows_that_were_written(folder: Path, tmp_path: Path) -> None:
    rows = _rows()
    for name in ("all.csv", "all.parquet"):
        told = _done("export", folder, "--out", tmp_path / name)
        assert told["rows"] == rows.size
    parquet = pyarrow.parquet.read_table(tmp_path / "all.parquet")
    csv = pyarrow.csv.read_csv(tmp_path / "all.csv")
    assert csv.column_names == parquet.column_names
    for table in (csv, parquet):
        assert table["cycle"].to_pylist() == rows["cycle"].tolist()
        for k in (0, 1):
            read = table[f"position_rad[{k}]"].to_numpy()
            assert np.abs(read - rows["position_rad"][:, k]).max() < 1e-9
            assert table[f"cable_length_m[{k}]"].null_count == rows.size
            assert table[f"valid[{k}]"].to_pylist() == rows["valid"][:, k].tolist()
    stored = pyarrow.parquet.read_metadata(tmp_path / "all.parquet").metadata
    assert json.loads(stored[b"description"])["robot"] == "bench"
    assert not list(tmp_path.glob("*.part"))


def test_export_of_some_fields_and_a_stretch(folder: Path, tmp_path: Path) -> None:
    target = tmp_path / "some.csv"
    arguments = ("--fields", "cycle,tension_N", "--from", "1.9995", "--until", "2.1")
    _done("export", folder, "--out", target, *arguments)
    table = pyarrow.csv.read_csv(target)
    assert table.column_names == ["elapsed_s", "cycle", "tension_N[0]", "tension_N[1]"]
    assert table["cycle"].to_pylist() == list(range(2000, 2101))
    assert np.allclose(table["elapsed_s"].to_numpy(), np.arange(2000, 2101) * 1e-3)


def test_time_goes_on_where_cycles_begin_anew(tmp_path: Path) -> None:
    # as after a fault that made the drives boot again
    again = made_rows(0, 500)
    again["stamp_ns"] += 2_000_000_000
    block = block_with_clock()
    recorder = Recorder(block, tmp_path, "bench", reserve_bytes=0)
    put(RowWriter(block), np.concatenate([made_rows(0, 500), again]))
    recorder.start()
    recorder.stop()
    target = tmp_path / "both.parquet"
    _done("export", tmp_path, "--out", target, "--fields", "cycle")
    elapsed = pyarrow.parquet.read_table(target)["elapsed_s"].to_numpy()
    assert np.diff(elapsed).min() > 0.0
    assert elapsed[500] == pytest.approx(2.0) and elapsed[999] == pytest.approx(2.499)
    (figures,) = _done("info", tmp_path)["recordings"]
    assert figures["restarts"] == 1 and figures["missing_cycles"] == 0


def test_plot_draws_a_picture(folder: Path, tmp_path: Path) -> None:
    target = tmp_path / "run.png"
    assert _done("plot", folder, "--png", target)["rows"] == 3990
    whole = imread(target)
    _done("plot", folder, "--axis", "left", "--out", target)
    one = imread(target)
    assert whole.shape[1] == one.shape[1] and whole.std() > 0.05
    assert whole.shape != one.shape or np.abs(whole - one).max() > 0.1
    copied = shutil.copy(sorted(folder.iterdir())[0], tmp_path)
    _done("plot", copied)
    assert Path(copied).with_suffix(".png").exists()


def _recorded(folder: Path, rows: Row, n: int = 2, **described: Any) -> Path:
    block = block_with_clock(n=n)
    block.write_description({"robot": "bench", **described})
    recorder = Recorder(block, folder, "bench")
    put(RowWriter(block), rows)
    recorder.start()
    recorder.stop()
    return Path(recorder.status()["file"])


@pytest.mark.filterwarnings("error")
def test_a_single_cycle_and_odd_names_are_drawn(tmp_path: Path) -> None:
    axes = [{"name": "_left"}, {"name": r"$\frac{$"}]
    path = _recorded(tmp_path, made_rows(0, 1), axes=axes)
    assert _done("plot", path)["rows"] == 1
    one = imread(path.with_suffix(".png"))
    assert _done("plot", path, "--axis", "_left")["rows"] == 1
    assert one.shape != (other := imread(path.with_suffix(".png"))).shape or (one != other).any()


@pytest.mark.filterwarnings("error")
def test_a_recording_of_nothing_known_is_drawn(tmp_path: Path) -> None:
    rows = made_rows(0, 100)
    for name in ("position_rad", "setpoint_rad", "velocity_rad_s", "torque_sent_Nm", "tension_N"):
        rows[name] = np.nan
    assert _done("plot", _recorded(tmp_path, rows))["rows"] == 100


@pytest.mark.filterwarnings("error")
def test_a_platform_s_pose_is_drawn_as_far_as_it_moves(tmp_path: Path) -> None:
    rows = made_rows(0, 200)
    plain = _recorded(tmp_path / "plain", rows)
    share = np.linspace(0.0, 1.0, 200)
    rows["pose"] = rows["pose_setpoint"] = [0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0]
    rows["pose"][:, 1] = 0.3 * share
    rows["pose"][:, 3], rows["pose"][:, 5] = np.cos(0.1 * share), np.sin(0.1 * share)
    rows["pose"][:10] = np.nan
    curves = pose_curves({name: rows[name] for name in ("pose", "pose_setpoint")})
    assert {label: list(each) for label, each in curves.items()} == {
        "platform (m)": ["y"], "turned (deg)": ["ry"], "off its set-point (mm)": ["distance"],
    }  # fmt: skip
    is_there, wanted = curves["turned (deg)"]["ry"]
    assert np.isnan(is_there[:10]).all()
    assert is_there[10:] == pytest.approx(np.degrees(0.2 * share[10:]))
    assert (wanted == 0.0).all()
    moved = _recorded(tmp_path / "moved", rows)
    _done("plot", plain)
    _done("plot", moved)
    sizes = [imread(path.with_suffix(".png")).shape[:2] for path in (plain, moved)]
    (_, narrow), (_, wide) = sizes
    assert narrow < wide
    assert max(high for high, _ in sizes) < 1800, "more than a screen shows"


def test_a_stop_is_shaded_until_the_robot_is_active_no_more() -> None:
    """The limit may be passed for a moment only: the platform is let down for seconds then."""
    ready, active, fault = LoopState.READY, LoopState.ACTIVE, LoopState.FAULT
    state = np.array([ready, active, active, active, active, active, active, fault, ready, active])
    reaction = np.zeros(state.size, int)
    reaction[2], reaction[4] = Reaction.HOLD, Reaction.CONTROLLED_STOP
    kinds = shades(state, reaction)
    (reacting,) = {int(kind) for kind in kinds[[2, 4, 5, 6]]}
    assert reacting != 0 and (kinds[[1, 3, 9]] == 0).all()
    assert kinds[0] == kinds[8] and len({reacting, int(kinds[7]), int(kinds[8]), 0}) == 4


def test_in_a_plane_a_platform_s_orientation_is_its_angle() -> None:
    pose = np.zeros((50, 7))
    pose[:, 3], pose[:, 6] = np.cos(np.linspace(0, 0.1)), np.sin(np.linspace(0, 0.1))
    for height_m, name in ((0.0, "angle"), (2.0, "rz")):
        pose[:, 2] = height_m
        (curve,) = pose_curves({"pose": pose, "pose_setpoint": pose})["turned (deg)"]
        assert curve == name


def test_curves_with_single_unknown_values_keep_their_extremes() -> None:
    x = np.arange(30_000.0)
    y = np.sin(x / 500.0)
    y[::7] = np.nan
    y[10_000:12_000] = np.nan
    y[20_001] = 9.0
    at, kept = decimated(x, y)
    assert kept.size < 9000 and np.nanmax(kept) == 9.0
    assert np.isnan(kept[(at > 10_100) & (at < 11_900)]).all()
    assert np.isfinite(kept).mean() > 0.9


def test_recordings_of_several_robots_make_no_table(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    _recorded(tmp_path, made_rows(0, 100))
    second = _recorded(tmp_path, made_rows(0, 100, 3), 3)
    for command, name in (("export", "x.csv"), ("export", "x.parquet"), ("plot", "x.png")):
        status, _, errors = _log(command, tmp_path, "--out", tmp_path / name)
        assert status == 2 and errors.count("\n") == 1
        assert f"{second}: of bench with 3 axes, and those before it of bench with 2" in errors
        assert not (tmp_path / name).exists()
    assert capfd.readouterr().err == ""  # no complaint of a table that was not finished
    assert len(_done("info", tmp_path)["recordings"]) == 2


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("info", "missing.mcap"), "missing.mcap: cannot be read: No such file"),
        (("info", "text.mcap"), "text.mcap: not a recording"),
        (("info", "empty"), "empty: no recordings"),
        (("info", "x" * 300), "x: cannot be read: File name too long"),
        (
            ("export", "FOLDER", "--out", f"{'x' * 300}.csv"),
            "cannot be written: File name too long",
        ),
        (("export", "FOLDER", "--out", "x.txt"), "allowed: a name that ends in .csv or .parquet"),
        (("export", "FOLDER", "--out", "there.csv"), "there.csv: exists already"),
        (("export", "FOLDER", "--out", "x.csv", "--fields", "speed"), "--fields speed: allowed:"),
        (("export", "FOLDER", "--out", "x.csv", "--fields", ","), "names none"),
        (("export", "FOLDER", "--out", "x.csv", "--from", "99"), "no cycles in what was asked"),
        (("plot", "FOLDER", "--out", "x.png", "--from", "2", "--until", "1"), "--until 1: allowed"),
        (("plot", "FOLDER", "--out", "x.png", "--axis", "top"), "allowed: left, right"),
        (("plot", "FOLDER", "--out", "x.pdf"), "allowed: a name that ends in .png"),
    ],
)
def test_bad_input_is_one_line(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    complaint: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.mcap").write_text("no recording\n")
    (tmp_path / "there.csv").write_text("kept")
    (tmp_path / "empty").mkdir()
    given = [str(folder) if word == "FOLDER" else word for word in arguments]
    status, _, errors = _log(*given)
    assert status == 2
    assert complaint in errors and errors.count("\n") == 1
    assert (tmp_path / "there.csv").read_text() == "kept"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "text.mcap", "there.csv"]


def test_where_nothing_can_be_written_it_is_said(folder: Path) -> None:
    for command, name in (("export", "run.csv"), ("plot", "run.png")):
        status, _, errors = _log(command, folder, "--out", f"/proc/{name}")
        assert status == 1
        assert f"/proc/{name}: cannot be written" in errors


def test_what_ran_and_what_went_wrong_are_told_with_their_times(tmp_path: Path) -> None:
    rows = made_rows(0, 1000)
    rows["program"][:300], rows["program"][300:600], rows["program"][600:] = 0, 1, 0
    rows["state"][:] = LoopState.ACTIVE
    rows["pose"] = rows["pose_setpoint"] = [0.3, 2.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    rows["pose"][:, 0] += 1e-3 * np.linspace(0.0, 1.0, 1000)
    rows["reaction"][700:], rows["limit"][700:] = Reaction.CONTROLLED_STOP, Limit.BROKEN_CABLE
    rows["limit_axis"][700:], rows["state"][900:] = 1, LoopState.FAULT
    axes = [{"name": "left"}, {"name": "right"}]
    path = _recorded(tmp_path, rows, axes=axes, programs=["hold", "pose"])
    (figures,) = _done("info", path)["recordings"]
    assert [run["program"] for run in figures["runs"]] == ["hold", "pose", "hold"]
    assert [run.get("cut_short_by") for run in figures["runs"]] == [None, None, "a fault"]
    _, shown, _ = _log("info", path)
    assert "pose: ended, platform at 300.6, 2000.0 mm, 0.6 mm from its set-point" in shown

    selection = Selection([path], FIELDS)
    columns = selection.columns()
    (after_s, text), (fault_s, _) = faults_of(selection.readers, columns)
    assert after_s == pytest.approx(0.7, abs=1e-3) and fault_s == pytest.approx(0.9, abs=1e-3)
    assert text == "controlled stop by broken cable of right"
    assert _done("plot", path)["rows"] == 1000


def test_an_emergency_stop_is_named_where_it_cut_a_motion_short(tmp_path: Path) -> None:
    why = "emergency stop by cdpr estop"
    rows = made_rows(0, 1000)
    rows["state"][:], rows["program"][:] = LoopState.ACTIVE, 2
    rows["program"][:200] = 1
    rows["program"][600:] = 0  # the power goes at once, no supervisor reacts
    rows["state"][603:] = LoopState.FAULT
    block = block_with_clock()
    axes = [{"name": "left"}, {"name": "right"}]
    block.write_description({"robot": "bench", "axes": axes, "programs": ["idle", "pose", "path"]})
    recorder, writer = Recorder(block, tmp_path, "bench", reserve_bytes=0), RowWriter(block)
    recorder.begin()
    put(writer, rows[:620])
    block.write_status({"state": "fault", "reason": why, "reason_limit": None})
    recorder.look()
    put(writer, rows[620:])
    recorder.finish()
    (path,) = tmp_path.iterdir()
    _, shown, _ = _log("info", path)
    assert f"path: cut short: {why}; then left" in shown
    assert "pose: ended, left" in shown

    selection = Selection([path], FIELDS)
    told = [text for _, text in faults_of(selection.readers, selection.columns())]
    assert told == [f"state fault: {why}"]


def test_a_program_that_failed_has_not_just_ended(tmp_path: Path) -> None:
    rows = made_rows(0, 1000)
    rows["program"][:300], rows["program"][300:600], rows["program"][600:] = 1, 0, 1
    rows["stamp_ns"] += time.monotonic_ns() - rows["stamp_ns"][599]
    rows["stamp_ns"][600:] += 3600 * 10**9  # tightened again an hour later
    block = block_with_clock()
    axes = [{"name": "left"}, {"name": "right"}]
    block.write_description({"robot": "bench", "axes": axes, "programs": ["hold", "tighten"]})
    recorder, writer = Recorder(block, tmp_path, "bench", reserve_bytes=0), RowWriter(block)
    recorder.begin()
    for first, failure in ((0, ""), (300, "tighten: left: 9 mm reeled in"), (600, "")):
        put(writer, rows[first : first + 300])
        block.write_status({"state": "active", "reason": "", "failure": failure})
        recorder.look()
    recorder.finish()
    (path,) = tmp_path.iterdir()
    (figures,) = _done("info", path)["recordings"]
    assert [run.get("failed_by") for run in figures["runs"]] == ["left: 9 mm reeled in", None, None]
    _, shown, _ = _log("info", path)
    assert "tighten: failed: left: 9 mm reeled in; then left" in shown
    assert "tighten: ended, left" in shown
    assert any(line.endswith("  tighten: left: 9 mm reeled in") for line in shown.splitlines())


def test_a_lowering_by_which_a_robot_was_stopped_has_come_to_its_end(tmp_path: Path) -> None:
    rows = made_rows(0, 1000)
    rows["program"][:300], rows["program"][300:800], rows["program"][800:] = 1, 2, 0
    rows["reaction"][300:320] = Reaction.CONTROLLED_STOP
    rows["state"][803:] = LoopState.FAULT  # the idle program has the last cycles with power
    axes = [{"name": "left"}, {"name": "right"}]
    path = _recorded(tmp_path, rows, axes=axes, programs=["idle", "pose", "lower"])
    _, shown, _ = _log("info", path)
    assert "pose: cut short: a fault; then left" in shown
    assert "lower: ended, left" in shown


def test_a_fault_is_shown_whatever_has_happened_since() -> None:
    fault = {"text": "state fault", "cycle": 7, "reaction": 0}
    reason = {"text": "emergency stop", "limit": None}
    program = {"text": "program path", "cycle": 9, "reaction": 0}
    moves = [{"text": f"hold by me {k}", "kind": "command"} for k in range(50)]
    kept = _chosen(worth_telling([fault, reason, program, *moves]), 10)
    texts = [event["text"] for event in kept]
    assert texts == ["state fault", "emergency stop", *(f"hold by me {k}" for k in range(42, 50))]


def test_each_reaction_has_the_reason_that_came_with_it() -> None:
    reasons = Reasons(
        [
            (10**9, {"text": "slack", "limit": None}),
            (3 * 10**9, {"text": "too fast", "kind": "reason"}),
            (2 * 10**9, {"text": "state fault", "cycle": 1, "limit": 3}),
            (2 * 10**9, {"text": "a command", "kind": "command"}),
        ]
    )
    assert reasons.after(10**9 + 20_000_000) == "slack"
    assert reasons.after(2 * 10**9) == "too fast"
    assert reasons.after(2 * 10**9, 25 * 10**8) == ""
    assert reasons.after(4 * 10**9) == ""


def test_who_may_move_and_refusals_over_and_over_do_not_fill_the_list() -> None:
    texts = ["pose by me: refused: a", "pose by me: refused: b", "state fault"]
    events = [{"text": text, "kind": "command"} for text in texts]
    events.insert(0, {"text": "me may move", "kind": "control"})
    told = worth_telling(events)
    assert [(event["text"], event["times"]) for event in told] == [(texts[0], 2), (texts[2], 1)]
