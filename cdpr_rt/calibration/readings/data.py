"""Data files of a calibration: its readings, and points that a person measured beside it."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from cdpr_profiles import Robot
from cdpr_profiles.calibration.geometry import geometry_sha256, write_text
from cdpr_profiles.errors import ProfileError, value_text
from cdpr_profiles.reading.bounded_input import read_text
from cdpr_profiles.reading.reader import Profile, read_json_model
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_rt.calibration.readings.camera_data import CameraSetup, ImageReading
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.robots.platform_model import PlatformModel

_MOST_BYTES, _MOST_DATA_BYTES = 4 << 20, 64 << 20
_AXES = "xyz"
_STD_mm = 2.0
_COLUMNS = ("pose", "x_mm", "y_mm", "z_mm", "sigma_mm")
_FURTHEST_mm = 1e6
_ROTATION = 1e-4
_TURNED_rad = 0.2

Numbers = tuple[Annotated[float, Field(ge=-1e6, le=1e6)], ...]


class PoseReading(Profile):
    """Readings while the platform stood at one pose."""

    target: Numbers
    """Where it was to be, (d,), as the program `pose` takes it, or where it stood where it did not
    come there; the first search begins there."""
    length_m: Numbers
    """Lengths without tension as encoders and the robot's file have them, (n,)."""
    tension_N: Numbers
    position_m: Numbers | None = None
    """Measured from outside, (3,)."""
    position_std_m: float | None = Field(default=None, gt=0)
    rotation: tuple[Numbers, ...] | None = None
    rotation_std_rad: float | None = Field(default=None, gt=0)
    image: ImageReading | None = None
    """Image of the camera on the platform there."""

    @model_validator(mode="after")
    def _measured_wholly(self) -> PoseReading:
        if (self.position_m is None) != (self.position_std_m is None):
            raise ValueError("position_m and position_std_m: allowed: both or none")
        if (self.rotation is None) != (self.rotation_std_rad is None):
            raise ValueError("rotation and rotation_std_rad: allowed: both or none")
        if self.position_m is not None and len(self.position_m) != 3:
            raise ValueError(f"position_m: value {value_text(self.position_m)}; allowed: 3 numbers")
        if self.rotation is not None:
            if [len(row) for row in self.rotation] != [3, 3, 3]:
                raise ValueError("rotation: allowed: 3 rows of 3 numbers")
            Q = np.array(self.rotation)
            if np.abs(Q @ Q.T - np.eye(3)).max() > _ROTATION or np.linalg.det(Q) < 0.0:
                raise ValueError("rotation: is none; allowed: an orthogonal matrix, determinant 1")
        return self


class CalibrationData(Profile):
    """Readings at all poses of a calibration; the first is of the platform at home."""

    format: Literal["cdpr-rt geometry data 1"] = "cdpr-rt geometry data 1"
    robot: str
    geometry_sha256: str
    """Digest of the robot's files as loaded when the platform was measured."""
    simulated: bool
    """Whether it was a simulated robot; what is found then moves no other."""
    date: str
    left_out: tuple[str, ...] = ()
    """Poses that were tried in vain, and why."""
    tried: tuple[Numbers, ...] = ()
    """Targets (d,) that were not read, or not reached; a run that goes on leaves them aside."""
    camera: CameraSetup | None = None
    """Where there are images."""
    restarts: tuple[Annotated[int, Field(ge=1)], ...] = ()
    """Poses, counted from 0, before which the encoders had begun to count anew."""
    poses: tuple[PoseReading, ...] = Field(max_length=100_000)

    @model_validator(mode="after")
    def _camera_where_images(self) -> CalibrationData:
        for j, reading in enumerate(self.poses):
            if reading.image is not None and self.camera is None:
                raise ValueError(f"poses[{j}].image: allowed: where `camera` says what took it")
        if any(pose >= len(self.poses) for pose in self.restarts):
            raise ValueError(f"restarts {self.restarts}; allowed: poses of the data")
        return self

    def save(self, path: Path) -> None:
        """Write the file; raises ProfileError."""
        write_text(path, self.model_dump_json(indent=1) + "\n")

    def observations(self, robot: Robot, model: PlatformModel) -> Observations:
        """Return the readings for the fit; raises InvalidRequestError where they do not fit."""
        other = self.geometry_sha256 != geometry_sha256(robot)
        if other and self.robot != robot.profile:
            raise InvalidRequestError(
                f"the data are of robot {self.robot!r}, not of {robot.profile!r}; allowed: "
                f"{self.robot}"
            )
        if other:
            raise InvalidRequestError(
                f"the data are of another state of {self.robot!r}: {robot.path}, or a file of its "
                "winches, has been changed since; allowed: the files they were measured with"
            )
        if not self.poses:
            raise InvalidRequestError("the data hold no poses; allowed: at least a few")
        n, d = len(robot.axes), model.size
        for j, reading in enumerate(self.poses):
            counts = (len(reading.length_m), len(reading.tension_N), len(reading.target))
            if counts != (n, n, d):
                raise InvalidRequestError(
                    f"pose {j + 1} has {counts} lengths, tensions and coordinates; allowed: "
                    f"{(n, n, d)}"
                )
        self._require_home_first(model)
        start = model.poses(np.array([reading.target for reading in self.poses]))
        seen = Observations.of_lengths(
            np.array([reading.length_m for reading in self.poses]),
            np.array([reading.tension_N for reading in self.poses]),
            start,
        )
        anew = tuple((cable, pose) for pose in self.restarts for cable in range(n))
        return replace(self._with_measured(seen, model.positions), jumps=anew)

    def sightings(self) -> list[Sighting]:
        """Return what the images of all poses showed, in their order; nothing where none was."""
        return [
            (reading.image or ImageReading()).sighting(f"pose {j + 1}")
            for j, reading in enumerate(self.poses)
        ]

    def _require_home_first(self, model: PlatformModel) -> None:
        """Raise InvalidRequestError where the first pose, the calibrated home, is another."""
        off = np.abs(np.array(self.poses[0].target) - model.home)
        k = model.positions
        if off[:k].max() > model.platform.home_tolerance_m or (off[k:] > _TURNED_rad).any():
            raise InvalidRequestError(
                f"pose 1 was to be at {list(self.poses[0].target)}; allowed: home, "
                f"{model.home.tolist()}, where the platform stands before it moves"
            )

    def _with_measured(self, seen: Observations, coordinates: int) -> Observations:
        count = seen.poses
        position, std = np.full((count, 3), np.nan), np.ones((count, 3))
        turn, turn_std = np.full((count, 3, 3), np.nan), np.ones((count, 3))
        for j, reading in enumerate(self.poses):
            if reading.position_m is not None and reading.position_std_m is not None:
                position[j, :coordinates] = reading.position_m[:coordinates]
                std[j] = reading.position_std_m
            if reading.rotation is not None and reading.rotation_std_rad is not None:
                turn[j], turn_std[j] = np.array(reading.rotation), reading.rotation_std_rad
        return seen.with_positions(position, std).with_rotations(turn, turn_std)


def load_data(path: Path) -> CalibrationData:
    """Return the data in a file; raises ProfileError."""
    return read_json_model(path, CalibrationData, _MOST_DATA_BYTES)


@dataclass(frozen=True)
class MeasuredPoint:
    """Measured position of the platform's origin at a pose; nan where not measured."""

    pose: int
    """Counted from 0."""
    position_m: FloatArray
    std_m: float


def load_points(path: Path) -> list[MeasuredPoint]:
    """Return measured points: CSV, columns pose,x_mm,y_mm,z_mm,sigma_mm, poses counted from 1.

    Coordinates may be left empty; sigma_mm is 2 where it is. Raises ProfileError.
    """
    try:
        rows = list(csv.reader(io.StringIO(read_text(path, _MOST_BYTES))))
    except csv.Error as error:
        raise ProfileError(path, "", f"is no CSV: {error}") from None
    rows = [row for row in rows if row and not row[0].lstrip().startswith("#")]
    if not rows or [name.strip() for name in rows[0]] not in (
        [c for c in _COLUMNS if c not in left]
        for left in ((), ("z_mm",), ("sigma_mm",), ("z_mm", "sigma_mm"))
    ):
        raise ProfileError(path, "line 1", f"allowed: the columns {','.join(_COLUMNS)}")
    names = [name.strip() for name in rows[0]]
    return [_point(path, k + 2, _cells(path, k + 2, names, row)) for k, row in enumerate(rows[1:])]


def _cells(path: Path, line: int, names: list[str], row: list[str]) -> dict[str, str]:
    if len(row) > len(names):
        problem = f"{len(row)} cells; allowed: up to {len(names)}, one for each column"
        raise ProfileError(path, f"line {line}", problem)
    return dict(zip(names, row, strict=False))  # what is left out at the end is empty


def _point(path: Path, line: int, row: dict[str, str]) -> MeasuredPoint:
    def number(key: str, otherwise: float) -> float:
        text = row.get(key, "").strip()
        if not text:
            return otherwise
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not abs(value) <= _FURTHEST_mm:
            raise ProfileError(path, f"line {line}: {key}", f"value {text!r}; allowed: a number")
        return value

    pose, sigma = number("pose", math.nan), number("sigma_mm", _STD_mm)
    if not (pose >= 1.0 and pose.is_integer()):
        raise ProfileError(path, f"line {line}: pose", "allowed: a pose's number, from 1")
    if not sigma > 0.0:
        raise ProfileError(path, f"line {line}: sigma_mm", f"value {sigma:g}; allowed: above 0")
    at = np.array([number(f"{axis}_mm", math.nan) for axis in _AXES])
    return MeasuredPoint(int(pose) - 1, 1e-3 * at, 1e-3 * sigma)


def with_points(
    seen: Observations, points: Sequence[MeasuredPoint], coordinates: int
) -> Observations:
    """Return observations with points in place of what else was measured of positions there."""
    position = np.where(np.isfinite(seen.position_std_m), seen.position_m, np.nan)
    std = np.where(np.isfinite(seen.position_std_m), seen.position_std_m, 1.0)
    for point in points:
        if point.pose >= seen.poses:
            raise InvalidRequestError(
                f"pose {point.pose + 1}; allowed: 1 to {seen.poses}, the poses of the data"
            )
        position[point.pose, :coordinates] = point.position_m[:coordinates]
        std[point.pose] = point.std_m
    return replace(seen.with_positions(position, std, seen.target_m), used=seen.used)
