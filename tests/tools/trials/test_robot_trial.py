"""`cdpr robot trial`: its figures agree with its files, read independently."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from cdpr_drivers.errors import ConfigurationError
from cdpr_profiles import load_robot
from cdpr_profiles.calibration_in_force import take_over, undo
from cdpr_profiles.errors import ProfileError
from cdpr_tools.commands import robot_trial
from cdpr_tools.commands.robot_trial import KindOfTrial
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.trials.recorded import Recorded
from tests.profiles.test_geometry_calibration import calibration

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("slower_profiles")]

ROOT = Path(__file__).parents[3]
BEHIND = 1024  # header of a log of true poses


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("trial") / "targets"
    what = ["planar-3", "targets", "--minutes", "0.12", "--out", str(folder), "--json"]
    command = [sys.executable, "-m", "cdpr_tools.cli", "robot", "trial", *what]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout.splitlines()[-1])


def test_an_interrupted_trial_is_reported(tmp_path):
    what = ["robot", "trial", "planar-3", "targets", "--out", str(tmp_path / "trial")]
    command = [sys.executable, "-m", "cdpr_tools.cli", *what]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stderr is not None
        # on a machine without compiled kernels, a notice precedes this
        assert any("starting the simulated robot" in line for line in process.stderr)
        process.terminate()
        *_, last = process.stderr.read().splitlines()
    assert (process.returncode, last) == (1, "cdpr: interrupted")


def test_figures_agree_with_the_files(trial):
    folder, told = trial
    assert told["speed_m_s"] is None, "targets have no speed"
    (recording,) = (folder / "run").glob("*.mcap")
    with recording.open("rb") as file:
        marks = [
            json.loads(message.data)
            for _, _, message in make_reader(file).iter_messages(topics=["/events"])
        ]
    (begin,) = [mark for mark in marks if mark.get("mark") == "begin"]
    measured = [mark for mark in marks if mark.get("mark") == "measured"]
    log = (folder / "run" / "truth.log").read_bytes()
    header = json.loads(log[:BEHIND])
    kinds = [(name, kind, *map(tuple, shape)) for name, kind, *shape in header["fields"]]
    true = np.frombuffer(log[BEHIND:], kinds)
    errors = []
    for mark in measured:
        last = mark["cycle"] - 1 + begin["sync_offset"]
        rows = true[(true["sync_index"] > last - 25) & (true["sync_index"] <= last)]
        assert rows.size == 25  # 0.1 s
        errors.append(1e3 * (rows["position_m"][:, :2].mean(axis=0) - mark["target_m"]))
    mean, sigma = np.mean(errors, axis=0), np.std(errors, axis=0, ddof=1)
    figures = {key: figure["value"] for key, figure in told["figures"].items()}
    assert figures["targets"] == len(measured) >= 2
    assert [figures["mean_x_mm"], figures["mean_y_mm"]] == pytest.approx(np.abs(mean))
    assert [figures["three_sigma_x_mm"], figures["three_sigma_y_mm"]] == pytest.approx(3 * sigma)
    assert figures["worst_mm"] < 10.0
    assert marks[-1]["mark"] == "end" and marks[-1]["notices"] == []
    assert (folder / "trial.png").read_bytes().startswith(b"\x89PNG")


def test_a_trial_can_be_evaluated_again(trial, capsys):
    folder, told = trial
    robot_trial.trial("planar-3", KindOfTrial.TARGETS, out_dir=folder, again=True, as_json=True)
    again = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert again["figures"] == told["figures"]
    with pytest.raises(BadInputError, match="contains a trial of targets, not line"):
        robot_trial.trial("planar-3", KindOfTrial.LINE, out_dir=folder, again=True)


def test_notices_at_the_end_of_a_trial_are_reported(
    trial: tuple[Path, dict[str, Any]], monkeypatch: pytest.MonkeyPatch, capsys
):
    def marked(recorded: Recorded, what: str) -> list[dict[str, Any]]:
        return [mark | {"notices": ["winch 1 swings"]} for mark in really_marked(recorded, what)]

    (folder, told), really_marked = trial, Recorded.marked
    assert told["notices"] == {"run": []}
    monkeypatch.setattr(Recorded, "marked", marked)
    robot_trial.trial("planar-3", KindOfTrial.TARGETS, out_dir=folder, again=True, as_json=True)
    out = capsys.readouterr()
    assert "note: winch 1 swings" in out.out + out.err
    assert json.loads(out.out.splitlines()[-1])["notices"] == {"run": ["winch 1 swings"]}


def test_the_calibration_in_force_is_reported_with_the_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    robot = load_robot("planar-3")
    known = calibration(robot, move_m=0.0).model_copy(
        update={"drum_scales": (1.0, 1.0, 1.0), "elongation_scale": 1.0}
    )
    take_over(robot, known)
    folder = tmp_path / "trial"
    robot_trial.trial("planar-3", KindOfTrial.TARGETS, minutes=0.12, out_dir=folder, as_json=True)
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told["calibration"]["identity"] == known.identity
    undo(robot)  # a trial is evaluated with the calibration during its run
    robot_trial.trial("planar-3", KindOfTrial.TARGETS, out_dir=folder, again=True)
    out = capsys.readouterr()
    assert f"calibration 1 ({known.identity})" in out.out + out.err


@pytest.mark.parametrize("by", [1, -30])
def test_a_log_of_different_syncs_is_rejected(trial, tmp_path, by):
    folder, _ = trial
    part = tmp_path / "run"
    shutil.copytree(folder / "run", part)
    Recorded(part)
    log = part / "truth.log"
    data = log.read_bytes()
    size = json.loads(data[:BEHIND])["record_bytes"]
    records = np.frombuffer(data[BEHIND:], np.uint8).reshape(-1, size)
    moved = np.roll(records, by, axis=0)
    moved[:, :4] = records[:, :4]  # SYNC numbers do not change
    log.write_bytes(data[:BEHIND] + moved.tobytes())
    with pytest.raises(WorkFailedError, match="do not belong together"):
        Recorded(part)


@pytest.mark.parametrize(
    ("robot", "kind", "options", "told"),
    [
        ("planar-3", KindOfTrial.LINE, {"minutes": 1.0}, "cannot be set"),
        ("planar-3", KindOfTrial.LINE, {}, "--commissioned DIR"),
        ("planar-3", KindOfTrial.TARGETS, {"speed_mm_s": 20.0}, "20: allowed only with line"),
        ("planar-3", KindOfTrial.LINE, {"speed_mm_s": 900.0}, "900: allowed: up to 500"),
        ("planar-3", KindOfTrial.TAPE, {"plant": Path("/nowhere.toml")}, "/nowhere.toml"),
        ("bench-2", KindOfTrial.TARGETS, {}, "has no platform; allowed"),
        ("nothing", KindOfTrial.TARGETS, {}, "nothing"),
        ("planar-3", KindOfTrial.TARGETS, {"again": True, "out_dir": None}, "needs --out"),
        ("planar-3", KindOfTrial.TARGETS, {"commissioned": Path("/nowhere")}, "/nowhere"),
    ],
)
def test_an_impossible_trial_is_rejected(tmp_path, robot, kind, options, told):
    with pytest.raises((BadInputError, ConfigurationError, ProfileError), match=told):
        robot_trial.trial(robot, kind, **{"out_dir": tmp_path / "out", **options})


def test_an_earlier_trial_is_not_overwritten(trial):
    folder, _ = trial
    with pytest.raises(BadInputError, match="is not empty"):
        robot_trial.trial("planar-3", KindOfTrial.TARGETS, minutes=0.1, out_dir=folder)


def test_delayed_angles_of_oscillating_motors_are_accepted(trial):
    recorded = Recorded(trial[0] / "run")
    time_s, rad_s = recorded.time_s[:, None], 2.0 * np.pi * 36.0
    recorded.truth["motor_rad"] = 0.2 * np.sin(rad_s * time_s)
    for age_s in (0.0005, 0.005):
        recorded.cycles["position_rad"] = 0.2 * np.sin(rad_s * (time_s - age_s))
        recorded._require_alignment()
    for age_s in (-0.002, 0.012, 0.05):
        recorded.cycles["position_rad"] = 0.2 * np.sin(rad_s * (time_s - age_s))
        with pytest.raises(WorkFailedError, match="do not belong together"):
            recorded._require_alignment()
