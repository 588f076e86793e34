"""`cdpr log` on synthetic recordings with known rows."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
from cdpr_here import cdpr_here
from matplotlib.figure import Figure
from matplotlib.image import imread

from cdpr_profiles.geometry_calibration import write_text
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowWriter
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.service.recording import Recorder
from cdpr_tools.recordings.picture import pose_curves, recorded_stretches, shades
from cdpr_tools.saving import save
from cdpr_tools.style import save_figure
from tests.cdpr_rt.service.recording_rig import block_with_clock, made_rows, put
from tests.tools.recordings.made_recording import record


def _log(*arguments: str | Path) -> tuple[int, str, str]:
    """Run `cdpr log`. Return its exit status and output."""
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
    """Return a session of two files. A power cut truncated the second."""
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


def test_info_counts_recorded_and_missing_cycles(folder: Path) -> None:
    one, two = _done("info", folder)["recordings"]
    assert [one["rows"], two["rows"]] == [2000, 1990]
    assert [one["ended"], two["ended"]] == ["closed", "cut short"]
    assert [one["missing_cycles"], two["missing_cycles"]] == [0, 10]
    assert one["states_s"] == pytest.approx({"ready": 0.999, "active": 1.0})
    assert two["states_s"] == pytest.approx({"active": 1.499, "fault": 0.5})
    assert (two["late_cycles"], two["missed"]) == (0, 2)  # since the first row of the file
    assert one["longest_lateness_s"] == 0.0 and two["longest_lateness_s"] == 3e-4
    assert one["axes"] == ["left", "right"] and one["robot"] == "bench"
    assert [event["text"] for event in two["events"]] == ["state active", "state fault"]
    _, shown, _ = _log("info", folder)
    assert "truncated" in shown and "10 cycles not recorded" in shown and "state fault" in shown


def test_exports_contain_the_recorded_rows(folder: Path, tmp_path: Path) -> None:
    rows = _rows()
    for name in ("all.csv", "all.parquet"):
        told = _done("export", folder, "--out", tmp_path / name)
        assert told["rows"] == rows.size
    parquet = pyarrow.parquet.read_table(tmp_path / "all.parquet")
    csv = pyarrow.csv.read_csv(tmp_path / "all.csv")
    assert csv.column_names == parquet.column_names
    for table in (csv, parquet):
        assert table["cycle"].to_pylist() == rows["cycle"].tolist()
        assert {"pose[x]", "pose[qz]"} <= set(table.column_names)
        for k, axis in enumerate(("left", "right")):
            read = table[f"position_rad[{axis}]"].to_numpy()
            assert np.abs(read - rows["position_rad"][:, k]).max() < 1e-9
            assert table[f"cable_length_m[{axis}]"].null_count == rows.size
            assert table[f"valid[{axis}]"].to_pylist() == rows["valid"][:, k].tolist()
    stored = pyarrow.parquet.read_metadata(tmp_path / "all.parquet").metadata
    assert json.loads(stored[b"description"])["robot"] == "bench"
    assert not list(tmp_path.glob("*.part"))


def test_files_of_the_user_ending_in_part_are_kept(folder: Path, tmp_path: Path) -> None:
    names = ("some.csv", "page.html", "curve.png", "left.toml")
    for name in names:
        (tmp_path / f"{name}.part").write_text("of the user")
    _done("export", folder, "--out", tmp_path / names[0], "--fields", "cycle")
    save(tmp_path / names[1], "<!-- cdpr-rt -->")
    save_figure(Figure(), tmp_path / names[2])
    write_text(tmp_path / names[3], "a = 1")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        [*names, *(f"{name}.part" for name in names)]
    )
    assert all((tmp_path / f"{name}.part").read_text() == "of the user" for name in names)
    usual = tmp_path / "usual"
    usual.touch()
    assert {(tmp_path / name).stat().st_mode for name in names} == {usual.stat().st_mode}


def test_export_can_select_fields_and_a_period(folder: Path, tmp_path: Path) -> None:
    target = tmp_path / "some.csv"
    arguments = ("--fields", "cycle,tension_N", "--from", "1.9995", "--until", "2.1")
    _done("export", folder, "--out", target, *arguments)
    table = pyarrow.csv.read_csv(target)
    assert table.column_names == ["elapsed_s", "cycle", "tension_N[left]", "tension_N[right]"]
    assert table["cycle"].to_pylist() == list(range(2000, 2101))
    assert np.allclose(table["elapsed_s"].to_numpy(), np.arange(2000, 2101) * 1e-3)


def test_time_continues_when_cycles_restart(tmp_path: Path) -> None:
    # as after a fault, when the drives boot again
    again = made_rows(0, 500)
    again["stamp_ns"] += 2_000_000_000
    record(tmp_path, np.concatenate([made_rows(0, 500), again]))
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


@pytest.fixture
def three_sessions(folder: Path, tmp_path: Path) -> Path:
    """Return a folder with an older session, one of two files, and one of another robot."""
    one, two = sorted(folder.iterdir())
    for name, source in (
        ("bench-20260101T000000Z-001", two),
        ("bench-20260102T000000Z-001", one),
        ("bench-20260102T000000Z-002", two),
        ("other-20250101T000000Z-001", one),
    ):
        shutil.copy(source, tmp_path / f"{name}.mcap")
    return tmp_path


def test_list_shows_sessions_with_the_newest_last(three_sessions: Path) -> None:
    found = _done("list", three_sessions)["sessions"]
    assert [(one["session"], len(one["files"])) for one in found] == [
        ("other-20250101T000000Z", 1),
        ("bench-20260101T000000Z", 1),
        ("bench-20260102T000000Z", 2),
    ]


def test_list_reports_a_folder_without_recordings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    status, out, errors = _log("list")
    assert (status, errors) == (0, "")
    assert out.strip() == f"no recordings in {tmp_path / 'cdpr-rt' / 'recordings'}"
    assert _done("list")["sessions"] == []
    for folder, told in ((tmp_path, "no recordings"), (tmp_path / "absent", "No such file")):
        status, _, errors = _log("list", folder)
        assert status == 2
        assert str(folder) in errors and told in errors and "Traceback" not in errors


def test_a_session_is_found_by_its_name_in_the_list(
    three_sessions: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = three_sessions / "cdpr-rt" / "recordings"
    usual.mkdir(parents=True)
    for path in three_sessions.glob("*.mcap"):
        path.rename(usual / path.name)
    monkeypatch.setenv("XDG_STATE_HOME", str(three_sessions))
    name = _done("list")["sessions"][-1]["session"]
    files = [Path(one["file"]).stem for one in _done("info", name)["recordings"]]
    assert files == [f"{name}-001", f"{name}-002"]


def test_plot_draws_the_newest_session_and_names_the_picture_after_it(
    three_sessions: Path,
) -> None:
    told = _done("plot", *sorted(three_sessions.glob("*.mcap")))
    assert (told["out"], told["rows"]) == (str(three_sessions / "bench-20260102T000000Z.png"), 3990)


def test_curves_have_gaps_where_nothing_was_recorded() -> None:
    elapsed = np.array([0.0, 0.1, 0.2, 440.0, 440.1])
    assert recorded_stretches(elapsed) == [(0, 3), (3, 5)]
    assert recorded_stretches(elapsed[:3]) == [(0, 3)]


@pytest.mark.filterwarnings("error")
def test_a_single_cycle_and_odd_names_are_drawn(tmp_path: Path) -> None:
    axes = [{"name": "_left"}, {"name": r"$\frac{$"}]
    path = record(tmp_path, made_rows(0, 1), axes=axes)
    assert _done("plot", path)["rows"] == 1
    one = imread(path.with_suffix(".png"))
    assert _done("plot", path, "--axis", "_left")["rows"] == 1
    assert one.shape != (other := imread(path.with_suffix(".png"))).shape or (one != other).any()


@pytest.mark.filterwarnings("error")
def test_a_recording_with_only_nan_is_drawn(tmp_path: Path) -> None:
    rows = made_rows(0, 100)
    for name in ("position_rad", "setpoint_rad", "velocity_rad_s", "torque_sent_Nm", "tension_N"):
        rows[name] = np.nan
    assert _done("plot", record(tmp_path, rows))["rows"] == 100


@pytest.mark.filterwarnings("error")
def test_a_pose_is_drawn_for_the_directions_that_move(tmp_path: Path) -> None:
    rows = made_rows(0, 200)
    plain = record(tmp_path / "plain", rows)
    share = np.linspace(0.0, 1.0, 200)
    rows["pose"] = rows["pose_setpoint"] = [0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0]
    rows["pose"][:, 1] = 0.3 * share
    rows["pose"][:, 3], rows["pose"][:, 5] = np.cos(0.1 * share), np.sin(0.1 * share)
    rows["pose"][:10] = np.nan
    curves = pose_curves({name: rows[name] for name in ("pose", "pose_setpoint")})
    assert {label: list(each) for label, each in curves.items()} == {
        "platform (m)": ["y"], "turned (deg)": ["ry"], "distance from set-point (mm)": ["distance"],
    }  # fmt: skip
    is_there, wanted = curves["turned (deg)"]["ry"]
    assert np.isnan(is_there[:10]).all()
    assert is_there[10:] == pytest.approx(np.degrees(0.2 * share[10:]))
    assert (wanted == 0.0).all()
    moved = record(tmp_path / "moved", rows)
    _done("plot", plain)
    _done("plot", moved)
    sizes = [imread(path.with_suffix(".png")).shape[:2] for path in (plain, moved)]
    (_, narrow), (_, wide) = sizes
    assert narrow < wide
    assert max(high for high, _ in sizes) < 1800, "taller than a screen"


def test_a_stop_is_shaded_until_the_robot_is_not_active() -> None:
    """The limit may be exceeded only briefly, but lowering the platform takes seconds."""
    ready, active, fault = LoopState.READY, LoopState.ACTIVE, LoopState.FAULT
    state = np.array([ready, active, active, active, active, active, active, fault, ready, active])
    reaction = np.zeros(state.size, int)
    reaction[2], reaction[4] = Reaction.HOLD, Reaction.CONTROLLED_STOP
    kinds = shades(state, reaction)
    (reacting,) = {int(kind) for kind in kinds[[2, 4, 5, 6]]}
    assert reacting != 0 and (kinds[[1, 3, 9]] == 0).all()
    assert kinds[0] == kinds[8] and len({reacting, int(kinds[7]), int(kinds[8]), 0}) == 4


def test_orientation_in_a_plane_is_one_angle() -> None:
    pose = np.zeros((50, 7))
    pose[:, 3], pose[:, 6] = np.cos(np.linspace(0, 0.1)), np.sin(np.linspace(0, 0.1))
    for height_m, name in ((0.0, "angle"), (2.0, "rz")):
        pose[:, 2] = height_m
        (curve,) = pose_curves({"pose": pose, "pose_setpoint": pose})["turned (deg)"]
        assert curve == name


def test_recordings_of_several_robots_cannot_be_exported_together(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    record(tmp_path, made_rows(0, 100))
    second = record(tmp_path, made_rows(0, 100, 3), 3)
    for command, name in (("export", "x.csv"), ("export", "x.parquet"), ("plot", "x.png")):
        status, _, errors = _log(command, tmp_path, "--out", tmp_path / name)
        assert status == 2 and errors.count("\n") == 1
        assert (
            f"{second}: records bench with 3 axes, but earlier files record bench with 2" in errors
        )
        assert not (tmp_path / name).exists()
    assert capfd.readouterr().err == ""  # no warning about an unfinished table
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
        (("export", "FOLDER", "--out", "there.csv"), "there.csv: already exists"),
        (("export", "FOLDER", "--out", "x.csv", "--fields", "speed"), "--fields speed: allowed:"),
        (("export", "FOLDER", "--out", "x.csv", "--fields", ","), "is empty"),
        (("export", "FOLDER", "--out", "x.csv", "--from", "99"), "no cycles in the selected time"),
        (("plot", "FOLDER", "--out", "x.png", "--from", "2", "--until", "1"), "--until 1: allowed"),
        (("plot", "FOLDER", "--out", "x.png", "--axis", "top"), "allowed: left, right"),
        (("plot", "FOLDER", "--out", "x.pdf"), "allowed: a name that ends in .png"),
    ],
)
def test_invalid_input_prints_one_line(
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


def test_an_unwritable_output_is_reported(folder: Path) -> None:
    for command, name in (("export", "run.csv"), ("plot", "run.png")):
        status, _, errors = _log(command, folder, "--out", f"/proc/{name}")
        assert status == 1
        assert f"/proc/{name}: cannot be written" in errors
