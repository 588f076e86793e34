"""The experiment with a robot on its bus: recorded, evaluated from files, and resumed."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cdpr_here import cdpr_here

from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.teleop import experiment
from cdpr_tools.teleop.experiment_operator import OperatorParameters, Station
from cdpr_tools.teleop.experiment_trial import (
    Condition,
    ExperimentSettings,
    points_of_session,
    run_session,
)

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("slower_profiles")]

OFFSETS_M = ((0.05, 0.02), (0.0, 0.0))
CONDITION = Condition("A", 4.0, 0.35, 1)
SETTINGS = ExperimentSettings(
    robot="planar-3", plant=None, commissioned=None, compensated=False, seed=1,
    operator=OperatorParameters(tolerance_m=2.5e-3), station=Station(),
    places=("A",), scales=(4.0,), round_trips_s=(0.35,), repeats=1,
)  # fmt: skip


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run two targets with unidentified motors and an easily satisfied operator."""
    folder = tmp_path_factory.mktemp("experiment") / "A-350ms-1"
    with pytest.MonkeyPatch.context() as patch:
        short = "cdpr_tools.teleop.experiment_trial.targets_m"
        patch.setattr(short, lambda centre: centre + np.array(OFFSETS_M))
        run_session(SETTINGS, [CONDITION], folder)
    return folder


def test_errors_come_from_the_recording_and_the_true_poses(session: Path) -> None:
    points = points_of_session(session)
    assert points["target"].tolist() == [0, 1]
    assert points["scale"].tolist() == [4.0, 4.0]
    assert np.abs(points["error_m"]).max() < 8e-3
    assert np.abs(points["error_m"]).max() > 1e-6
    assert np.abs(points["hand_m"]).max() < 1e-4  # the clutch was closed
    parts = points["judged_m"] + points["hand_m"] + points["robot_m"]
    assert parts == pytest.approx(points["error_m"], abs=1e-12)


def test_true_positions_of_packets_agree_with_the_log(session: Path) -> None:
    """They are compared at the confirmations."""
    ticks = np.load(session / f"{CONDITION.name}.npy")
    points = points_of_session(session)
    for point in points:
        target_m = OFFSETS_M[point["target"]]
        near = np.argmin(np.abs(ticks["time_s"] - point["pressed_s"]))
        centre_m = ticks["truth_m"][0]
        off_m = ticks["truth_m"][near] - centre_m - target_m
        assert off_m == pytest.approx(point["error_m"], abs=4e-3)


def test_an_incomplete_session_is_not_evaluated(session: Path, tmp_path: Path) -> None:
    with pytest.raises(WorkFailedError, match="not finished"):
        half = tmp_path / "half"
        half.mkdir()
        for path in session.glob("*"):
            data = path.read_bytes()
            (half / path.name).write_bytes(
                data[: len(data) // 2] if path.suffix == ".mcap" else data
            )
        points_of_session(half)


def test_an_experiment_is_resumed_and_evaluated_from_its_files(
    session: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "whole"
    experiment.begin(SETTINGS, folder)
    (name,) = SETTINGS.sessions()
    kept = folder / "sessions" / name
    shutil.copytree(session, kept)
    with pytest.raises(BadInputError, match="no session has ended"):
        experiment.judge(folder, 1)
    (kept / "done").touch()
    experiment.begin(SETTINGS, folder)
    experiment.perform(SETTINGS, folder, 1, Output(as_json=True))  # nothing remains to be run
    result = experiment.judge(folder, 1)
    assert result["sessions"] == "1 of 1"
    points = points_of_session(session)
    (of_place,) = [row for row in result["rows"] if row["level"] == "A"]
    spread_mm = 3e3 * points["error_m"].std(axis=0, ddof=1)
    assert of_place["three_sigma_mm"] == pytest.approx(spread_mm)
    assert json.loads((folder / "result.json").read_text())["reached"] == result["reached"]
    assert all(Path(picture).exists() for picture in result["pictures"])
    with pytest.raises(BadInputError, match="other options"):
        experiment.begin(replace(SETTINGS, seed=2), folder)


def test_the_operator_alone_gives_one_line_of_json() -> None:
    few = ("--places", "A", "--scales", "2:1", "--repeats", "1")
    done = cdpr_here("teleop", "experiment", "--perfect-robot", *few, "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert [row["level"] for row in told["rows"]] == ["0 ms", "350 ms", "730 ms", "2:1", "A"]
    assert all(row["reached"] for row in told["rows"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--places", "A,X"], "allowed: A, B, C"),
        (["--scales", "none"], "--scale none"),
        (["--round-trips", "-1"], "--round-trips -1: allowed: 0 to 10000 ms"),
        (["--operator", "mood=2"], "--operator mood=2: allowed: NAME=VALUE, reaction_s"),
        (["--operator", "tolerance_m=0"], "allowed: a number above 0"),
        (["--again"], "--again: needs --out"),
        (["--again", "--out", "no-such-folder"], "no-such-folder/experiment.json: cannot be read"),
        (["--plant", "no-such-plant.toml"], "no-such-plant.toml"),
        (["winch-mpp0923d", "--perfect-robot"], "has no platform; allowed"),
    ],
)
def test_invalid_input_prints_one_message(
    arguments: list[str], message: str, tmp_path: Path
) -> None:
    where = [] if "--out" in arguments or "--again" in arguments else ["--out", str(tmp_path / "x")]
    result = cdpr_here("teleop", "experiment", *arguments, *where)
    assert (result.returncode, message in result.stderr) == (2, True), result.stderr
    assert not (tmp_path / "x").exists()
