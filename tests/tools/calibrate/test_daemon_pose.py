"""Poses are read from the status of a stand-in for a daemon, and stored or rejected."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.geometry_calibration import geometry_sha256
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.calibration.readings import CalibrationData, load_data
from cdpr_tools.calibrate import daemon_run, pose_camera, run
from cdpr_tools.calibrate.measure_poses import DATA, PoseOperator, StoredPoses, TakeImage
from cdpr_tools.client.daemon_robot import commanded
from cdpr_tools.errors import BadInputError, CommandError, WorkFailedError
from cdpr_tools.output import Output

pytestmark = pytest.mark.usefixtures("daemon_time")

ROBOT = load_robot("planar-4")
LENS = "width_px = 64\nheight_px = 48\nfocal_px = [50.0, 50.0]\ncentre_px = [32.0, 24.0]\n"


class StandingDaemon:
    """A stand-in for a daemon at rest, whose clock advances with each request."""

    def __init__(self) -> None:
        self.description: dict[str, Any] = {
            "reference": "planar-4", "calibration": None, "simulated": False,
            "geometry_sha256": geometry_sha256(ROBOT), "robot": "told",
            "axes": [{"name": axis.name} for axis in ROBOT.axes],
        }  # fmt: skip
        assert ROBOT.platform is not None
        self.description["platform"] = asdict(ROBOT.platform)
        self.place = [*ROBOT.platform.home_m, 0.0]
        self.angle_rad, self.counted_m, self.moving_m = 1.0, 2.0, 0.0
        self.time_s, self.state, self.tight = 0.0, "active", True
        self.silent_s = 0.0

    def get(self, path: str) -> dict[str, Any]:
        if path == "/description":
            return self.description
        self.time_s += 0.05
        per_rad = [axis.winch.cable_m_per_motor_rad for axis in ROBOT.axes]
        axes = [
            {
                "cable_length_m": self.counted_m + m * self.angle_rad + self.moving_m * self.time_s,
                "tension_N": 40.0 + i,
                "position_rad": self.angle_rad,
            }
            for i, m in enumerate(per_rad)
        ]
        progress = {
            "tight": self.tight, "position_m": self.place[:2], "rotation_rad": self.place[2:]
        }  # fmt: skip
        return {
            "state": self.state, "program": "hold", "program_progress": progress, "axes": axes,
            "lockstep": True, "reacting": "none", "busy": False, "reason": "", "reason_limit": None,
            "parts": {},
            "cycle": {"time_s": self.time_s}, "loop": {"silent_s": self.silent_s},
        }  # fmt: skip


def read(told: StandingDaemon, folder: Path, image: TakeImage | None = None) -> CalibrationData:
    robot, kept = kept_in(told, folder)
    with commanded(told) as running:  # type: ignore[arg-type]
        daemon_run.read_into(PoseOperator(running, robot, image or (lambda _: None)), robot, kept)
    return kept.data


def kept_in(told: StandingDaemon, folder: Path) -> tuple[Robot, StoredPoses]:
    robot, description = daemon_run.robot_of(told)  # type: ignore[arg-type]
    data = daemon_run.data_of(folder, robot, description["simulated"])
    return robot, StoredPoses(folder, data)


def test_poses_are_appended_and_restarted_lengths_detected(tmp_path: Path) -> None:
    told = StandingDaemon()
    home = read(told, tmp_path).poses[0]
    assert home.target == tuple(told.place) and home.tension_N == (40.0, 41.0, 42.0, 43.0)
    per_rad = np.array([axis.winch.cable_m_per_motor_rad for axis in ROBOT.axes])
    assert home.length_m == pytest.approx(tuple(2.0 + per_rad))
    told.place, told.angle_rad = [0.3, 1.6, 0.1], 5.0
    assert read(told, tmp_path).restarts == ()
    told.counted_m = 2.001
    assert read(told, tmp_path).restarts == (2,)
    assert read(told, tmp_path).restarts == (2,)
    data = load_data(tmp_path / "data.json")
    assert len(data.poses) == 4 and not data.simulated
    assert data.poses[1].target == (0.3, 1.6, 0.1)
    assert "get new offsets" in "".join(
        daemon_run.lines(ROBOT, data.model_copy(update={"poses": data.poses[:3]}))
    )


def shift(key: str, value: object) -> Callable[[StandingDaemon, Path], None]:
    return lambda told, _: told.description.update({key: value})


def away(told: StandingDaemon, _: Path) -> None:
    told.place = [0.3, 1.6, 0.0]


def unpowered(told: StandingDaemon, _: Path) -> None:
    told.state = "ready"


def lowered(told: StandingDaemon, _: Path) -> None:
    told.tight = False


def hung(told: StandingDaemon, _: Path) -> None:
    told.silent_s = 5.5


def swinging(told: StandingDaemon, _: Path) -> None:
    told.moving_m = 0.01


def of_the_simulator(told: StandingDaemon, folder: Path) -> None:
    told.description["simulated"] = True
    read(told, folder)
    told.description["simulated"] = False


def of_a_run(told: StandingDaemon, folder: Path) -> None:
    """Store a run that was started with --overwrite over poses read by hand."""
    told.description["simulated"] = True  # as in all runs
    read(told, folder)
    run.StoredRun.new(folder, ROBOT, None).data.save(folder / DATA)


@pytest.mark.parametrize(
    ("spoil", "kind", "named"),
    [
        (shift("reference", "bench-2"), BadInputError, "has no platform"),
        (shift("calibration", {"version": 1}), BadInputError, "cdpr calibrate undo planar-4"),
        (shift("geometry_sha256", "0"), BadInputError, "changed since the robot"),
        (away, BadInputError, "mm from home, where the first pose must be"),
        (unpowered, WorkFailedError, "the cables do not hold the platform .ready, hold."),
        (lowered, WorkFailedError, "the cables do not hold the platform .active, hold."),
        (hung, WorkFailedError, "the loop has run no cycle for"),
        (swinging, WorkFailedError, "did not come to rest"),
        (of_the_simulator, BadInputError, "of another robot, another bus"),
        (of_a_run, BadInputError, "contains an automatic run"),
    ],
)
def test_poses_of_a_different_robot_state_or_source_are_rejected(
    spoil: Callable[[StandingDaemon, Path], None],
    kind: type[CommandError],
    named: str,
    tmp_path: Path,
) -> None:
    told = StandingDaemon()
    spoil(told, tmp_path)
    with pytest.raises(kind, match=named):
        read(told, tmp_path)


def test_each_pose_has_an_image_and_the_first_also_the_camera_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lens, sheets = tmp_path / "lens.toml", tmp_path / "sheets.toml"
    lens.write_text(LENS)
    sheets.write_text("size_m = 0.1\n")
    told, folder = StandingDaemon(), tmp_path / "cal"
    folder.mkdir()

    class Camera:
        def __init__(self, *_: Any) -> None:
            pass

        def see(self, number: int, wait: Callable[[float], None]) -> Sighting:
            return Sighting(f"pose {number}", {number: np.zeros((4, 2))})

        def close(self) -> None:
            pass

    monkeypatch.setattr(pose_camera, "PoseCamera", Camera)

    def look(where: Path, *files: Path | None) -> None:
        robot, kept = kept_in(told, where)
        with (
            daemon_run.image_taker("opencv:0", *files, kept, Output(as_json=False)) as image,
            commanded(told) as running,  # type: ignore[arg-type]
        ):
            daemon_run.read_into(PoseOperator(running, robot, image), robot, kept)

    with pytest.raises(BadInputError, match="also needs --intrinsics and --markers"):
        look(folder, lens, None)
    look(folder, lens, sheets)
    look(folder, None, None)
    differs = tmp_path / "other.toml"
    differs.write_text("size_m = 0.2\n")
    with pytest.raises(BadInputError, match=r"--markers .*: size_m 0.2, 0.1 at the first pose"):
        look(folder, lens, differs)
    differs.write_text(LENS.replace("width_px = 64", "width_px = 80"))
    with pytest.raises(BadInputError, match=r"--intrinsics .*: width_px 80, 64 at the first pose"):
        look(folder, differs, sheets)
    kept = json.loads((folder / "data.json").read_text())
    assert [one["image"]["markers"][0]["id"] for one in kept["poses"]] == [1, 2]
    assert kept["camera"]["intrinsics"]["width_px"] == 64
    other = tmp_path / "other"
    other.mkdir()
    read(told, other)
    with pytest.raises(BadInputError, match="read without"):
        look(other, lens, sheets)
