"""Camera readings in the data file of a calibration are written, read back and validated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_profiles.camera import CameraIntrinsics, KnownMarker, MarkerSheets
from cdpr_profiles.errors import ProfileError
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.calibration.readings import (
    CalibrationData,
    CameraSetup,
    HandEye,
    ImageReading,
    PoseReading,
    load_data,
)

CORNERS = np.array([[100.0, 100.0], [150.25, 101.0], [149.0, 152.0], [99.0, 151.0]])


def data() -> CalibrationData:
    intrinsics = CameraIntrinsics(
        width_px=1280, height_px=1024, focal_px=(1104.0, 1106.0), centre_px=(645.0, 505.0)
    )
    known = KnownMarker(id=3, position_m=(0.1, 0.2, 0.0))
    sheets = MarkerSheets(size_m=0.15, known=(known,))
    camera = CameraSetup(
        intrinsics=intrinsics,
        sheets=sheets,
        hand_eye=HandEye(position_m=(0.0, 0.0, -0.28), rotation_deg=(180.0, 0.0, 0.0)),
    )
    seen = Sighting("first", {3: CORNERS, 7: CORNERS + 300.0}, repeated=(4,), mirrored=(9,))
    black = Sighting("second", {}, problem="black")
    reading = PoseReading(
        target=(0.0,) * 6, length_m=(2.0,) * 8, tension_N=(50.0,) * 8, image=ImageReading.of(seen)
    )
    return CalibrationData(
        robot="spatial-8",
        geometry_sha256="0" * 64,
        simulated=True,
        date="2026-01-01",
        camera=camera,
        poses=(
            reading,
            reading.model_copy(update={"image": ImageReading.of(black)}),
            reading.model_copy(update={"image": None}),
        ),
    )


def spoilt(path: Path, change: Any) -> Path:
    table = json.loads(data().model_dump_json())
    change(table)
    path.write_text(json.dumps(table))
    return path


def test_camera_readings_survive_a_round_trip(tmp_path: Path) -> None:
    file = tmp_path / "data.json"
    data().save(file)
    there = load_data(file)
    assert there == data()
    first, second, third = there.sightings()
    assert first.corners_px[7] == pytest.approx(CORNERS + 300.0)
    assert (first.name, first.repeated, first.mirrored) == ("pose 1", (4,), (9,))
    assert second.problem == "black" and not second.corners_px
    assert third.problem is None and not third.corners_px


def test_data_without_camera_keys_are_read(tmp_path: Path) -> None:
    def old(table: Any) -> None:
        del table["camera"]
        for pose in table["poses"]:
            del pose["image"]

    there = load_data(spoilt(tmp_path / "data.json", old))
    assert there.camera is None and there.poses[0].image is None


def test_an_id_listed_twice_counts_as_repeated(tmp_path: Path) -> None:
    def twice(table: Any) -> None:
        table["poses"][0]["image"]["markers"][1]["id"] = 3

    first = load_data(spoilt(tmp_path / "data.json", twice)).sightings()[0]
    assert first.repeated == (3, 4) and not first.corners_px


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda t: t.update(camera=None), r"poses\[0\].image"),
        (lambda t: t["poses"][0]["image"]["markers"][0]["corners_px"].pop(), "corners_px"),
        (lambda t: t["poses"][0]["image"]["markers"][0].update(id=-1), "id"),
        (lambda t: t["camera"].update(sigma_px=0.0), "camera.sigma_px"),
        (lambda t: t["camera"]["hand_eye"].update(position_m=[0.0, 0.0]), "hand_eye.position_m"),
        (lambda t: t["camera"].update(size_m=0.1), "camera.size_m"),
    ],
)
def test_impossible_camera_readings_are_rejected_with_their_key(
    tmp_path: Path, change: Any, told: str
) -> None:
    with pytest.raises(ProfileError, match=told):
        load_data(spoilt(tmp_path / "data.json", change))


def test_uncertainty_of_known_places_is_that_of_the_sheets_file(tmp_path: Path) -> None:
    path, camera = tmp_path / "markers.toml", data().camera
    assert camera is not None
    for line, std_m in (("", 0.001), ("known_std_m = 0.0004", 0.0004)):
        path.write_text(f"size_m = 0.15\n{line}\n[[known]]\nid = 3\nposition_m = [0.1, 0.2, 0.0]\n")
        setup = CameraSetup.of(camera.intrinsics, MarkerSheets.load_file(path))
        assert setup.known_std_m == std_m
    path.write_text("size_m = 0.15\nknown_std_m = 2.0\n")
    with pytest.raises(ProfileError, match="known_std_m"):
        MarkerSheets.load_file(path)
