"""Readings of a calibration: observations at its poses, and its data files."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from cdpr_profiles import Robot
from cdpr_profiles.bounded_input import read_text
from cdpr_profiles.camera import CameraIntrinsics, MarkerSheets
from cdpr_profiles.errors import ProfileError, value_text
from cdpr_profiles.geometry_calibration import geometry_sha256, write_text
from cdpr_profiles.reader import Profile, read_json_model, validated_cells
from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration.marker_map import SeenMarkers, Sighting
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.robot_arrays import limits_of

# Data of the camera on the platform: its setup and its images.

_DECIMALS_px = 4
_Length_m = Annotated[float, Field(ge=-100.0, le=100.0)]
_Angle_deg = Annotated[float, Field(ge=-360.0, le=360.0)]
_Pixel = Annotated[float, Field(ge=-1e5, le=1e5)]
_Pair = Annotated[tuple[_Pixel, ...], Field(min_length=2, max_length=2)]
_Id = Annotated[int, Field(ge=0, lt=1024)]


class HandEye(Profile):
    """Prior knowledge of the camera's pose on the platform."""

    position_m: Annotated[tuple[_Length_m, ...], Field(min_length=3, max_length=3)]
    """Position of the camera's pinhole in the platform's frame."""
    rotation_deg: Annotated[tuple[_Angle_deg, ...], Field(min_length=3, max_length=3)]
    """Rotation vector from the camera's frame to the platform's; the camera looks along z, and x
    points to the right in the image."""
    position_std_m: Annotated[float, Field(ge=1e-6, le=10.0)] = 0.005
    """Standard deviation of each coordinate, measured by ruler."""
    rotation_std_deg: Annotated[float, Field(ge=1e-4, le=180.0)] = 2.0
    """Standard deviation of the rotation about each axis."""


class CameraSetup(Profile):
    """The camera that took the images, and the sheets that it saw."""

    intrinsics: CameraIntrinsics
    """Intrinsics of the camera. The fit corrects them within their `sigmas`; without `sigmas` they
    are fixed."""
    sheets: MarkerSheets
    """Sizes of the markers, and the known marker poses."""
    sigma_px: Annotated[float, Field(ge=1e-3, le=100.0)] | None = None
    """Standard deviation of a coordinate of a corner; by default estimated from the images."""
    size_std: Annotated[float, Field(ge=1e-6, le=0.5)] = 0.002
    """Relative standard deviation of the size that all sheets share."""
    known_std_m: Annotated[float, Field(ge=1e-6, le=1.0)] = 0.001
    """Standard deviation of each coordinate of a corner of a marker with a known pose."""
    hand_eye: HandEye | None = None
    """The hand-eye transform; None if unknown, in which case the robot's rotations determine it."""

    @classmethod
    def of(cls, intrinsics: CameraIntrinsics, sheets: MarkerSheets) -> CameraSetup:
        """Return the setup of two files; that of the sheets gives the accuracy of known poses."""
        setup = cls(intrinsics=intrinsics, sheets=sheets)
        if sheets.known_std_m is None:
            return setup
        return setup.model_copy(update={"known_std_m": sheets.known_std_m})

    def as_found(self, lens: FloatArray, size_change: float) -> CameraSetup:
        """Return the setup with another lens (9,), relatively changed sheets, and no hand_eye."""
        fx, fy, cx, cy, *distortion = lens.tolist()
        found = {"focal_px": (fx, fy), "centre_px": (cx, cy), "distortion": tuple(distortion)}
        sheets, by = self.sheets, 1.0 + size_change
        sizes = tuple(one.model_copy(update={"size_m": by * one.size_m}) for one in sheets.sizes)
        scaled = {"size_m": by * sheets.size_m, "sizes": sizes}
        return self.model_copy(
            update={
                "intrinsics": self.intrinsics.model_copy(update=found),
                "sheets": sheets.model_copy(update=scaled),
                "hand_eye": None,
            }
        )


class MarkerReading(Profile):
    """A marker in an image."""

    id: _Id
    corners_px: Annotated[tuple[_Pair, ...], Field(min_length=4, max_length=4)]
    """Corners in the order of detectors: clockwise from the marker's upper left."""


class ImageReading(Profile):
    """Image at a pose; `markers` is empty if no marker was usable."""

    markers: Annotated[tuple[MarkerReading, ...], Field(max_length=1024)] = ()
    repeated: tuple[_Id, ...] = ()
    """Ids that the image shows more than once."""
    mirrored: tuple[_Id, ...] = ()
    """Ids that only the mirror image shows."""
    problem: Annotated[str, Field(max_length=500)] | None = None
    """Fault of the image as a whole, as text, or None."""

    @classmethod
    def of(cls, seen: Sighting) -> Self:
        """Return the reading of a detector's result."""
        markers = tuple(
            MarkerReading(
                id=marker, corners_px=tuple(map(tuple, np.round(corners, _DECIMALS_px).tolist()))
            )
            for marker, corners in sorted(seen.corners_px.items())
        )
        return cls(
            markers=markers, repeated=seen.repeated, mirrored=seen.mirrored, problem=seen.problem
        )

    def sighting(self, name: str) -> Sighting:
        """Return the equivalent sighting of a detector; an id listed twice counts as repeated."""
        ids = [one.id for one in self.markers]
        twice = {marker for marker in ids if ids.count(marker) > 1}
        corners = {one.id: np.array(one.corners_px) for one in self.markers if one.id not in twice}
        repeated = tuple(sorted({*self.repeated, *twice}))
        return Sighting(
            name, corners, repeated=repeated, mirrored=self.mirrored, problem=self.problem
        )


@dataclass(frozen=True)
class Images:
    """Images of the camera on the platform, one for each pose, and its setup."""

    setup: CameraSetup
    sightings: Sequence[Sighting]


# Observations at the poses of a calibration: lengths, tensions, measured poses, markers.


@dataclass(frozen=True)
class Observations:
    """Readings at N poses of n cables; the standard deviation is inf for unmeasured values.

    Positions may belong to another point of the platform than its origin: `target_m` in the
    platform's frame, for example the reflector that a tracker sees.
    """

    length_m: FloatArray
    """Unstretched cable lengths from the robot's file and its encoders, (N, n)."""
    tension_N: FloatArray
    """(N, n)"""
    start: FloatArray
    """Poses at which the search begins, as arrays of `Pose`, (N, 4, 3)."""
    used: BoolArray
    """Whether a length is used, (N, n)."""
    position_m: FloatArray
    """Measured positions in the room, (N, 3)."""
    position_std_m: FloatArray
    """Standard deviations of these positions, (N, 3)."""
    rotation: FloatArray
    """Measured rotations, (N, 3, 3)."""
    rotation_std_rad: FloatArray
    """Standard deviations of rotations about each of the room's axes, (N, 3)."""
    target_m: FloatArray
    """Point of the platform to which `position_m` belongs, (3,)."""
    reference_m: FloatArray
    """Lengths when the encoders began to count; drum errors have no effect there, (n,)."""
    target_rotation: FloatArray
    """Rotations that were commanded, (N, 3, 3)."""
    jumps: tuple[tuple[int, int], ...] = ()
    """(cable, pose) at which a cable's length jumped: from this pose on it has another offset."""
    markers: SeenMarkers | None = None
    """Markers seen by the camera on the platform, an image for each pose."""
    tension_free: FloatArray | None = None
    """Projections (N, n, n) onto the noise of tensions that remains after the correction by
    equilibrium; None if nothing was corrected."""
    time_s: FloatArray | None = None
    """Times of readings while the platform moves, (N,); None if the platform stood still."""
    every: int = 1
    """The fit uses one in this many readings; the readings between have similar errors."""
    tension_assumed: bool = False
    """Whether no tension was measured, so that the elongation cannot be identified."""
    std_guessed: bool = False
    """Whether the standard deviation of positions is not known: the fit then estimates it."""

    @classmethod
    def of_lengths(
        cls, length_m: FloatArray, tension_N: FloatArray, start: FloatArray
    ) -> Observations:
        """Return observations with lengths and tensions (N, n) only."""
        lengths, tensions = np.array(length_m, float), np.array(tension_N, float)
        poses, count = np.array(start, float), len(lengths)
        nowhere = np.full((count, 3), np.inf)
        turn = np.broadcast_to(np.eye(3), (count, 3, 3)).copy()
        used = np.ones(lengths.shape, bool)
        zero = np.zeros((count, 3))
        first = lengths[0].copy() if count else np.zeros(lengths.shape[1])
        return cls(
            lengths, tensions, poses, used, zero, nowhere, turn, nowhere.copy(), np.zeros(3), first,
            poses[:, 1:].copy(),
        )  # fmt: skip

    @property
    def poses(self) -> int:
        """Number of poses."""
        return len(self.length_m)

    @property
    def measured(self) -> BoolArray:
        """Whether a pose has external measurements, (N,)."""
        any_position = np.isfinite(self.position_std_m).any(axis=1)
        return np.asarray(any_position | np.isfinite(self.rotation_std_rad).any(axis=1))

    def with_positions(
        self, position_m: FloatArray, std_m: FloatArray | float, target_m: FloatArray | None = None
    ) -> Observations:
        """Return the same with positions (N, 3); nan for coordinates that were not measured."""
        measured = np.array(position_m, float)
        known = np.isfinite(measured)
        std = np.where(known, np.broadcast_to(std_m, measured.shape), np.inf)
        point = np.zeros(3) if target_m is None else np.array(target_m, float)
        return replace(
            self, position_m=np.where(known, measured, 0.0), position_std_m=std, target_m=point
        )

    def with_rotations(self, rotation: FloatArray, std_rad: FloatArray | float) -> Observations:
        """Return the same with rotations (N, 3, 3); nan for those that were not measured."""
        measured = np.array(rotation, float)
        known = np.isfinite(measured).all(axis=(1, 2))
        std = np.where(known[:, None], np.broadcast_to(std_rad, (len(measured), 3)), np.inf)
        return replace(
            self, rotation=np.where(known[:, None, None], measured, np.eye(3)), rotation_std_rad=std
        )

    def unmeasured(self) -> Observations:
        """Return the observations with lengths and tensions only."""
        away = np.full_like(self.position_std_m, np.inf)
        return replace(self, position_std_m=away, rotation_std_rad=away.copy(), markers=None)

    def some(self, chosen: IntArray | BoolArray) -> Observations:
        """Return the chosen poses; jumps stay at the same time."""
        index = np.arange(self.poses)[chosen]
        jumps = tuple((cable, int((index < pose).sum())) for cable, pose in self.jumps)
        of_poses: dict[str, Any] = {
            name: value[index]
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray) and name not in ("target_m", "reference_m")
        }
        markers = None if self.markers is None else self.markers.of_images(index)
        return replace(self, **of_poses, jumps=jumps, markers=markers)

    def number(self, pose: int) -> int:
        """Return the number of a pose in the data, counted from 1, for an index from 0."""
        return self.every * pose + 1

    def without_jumps(self, offsets_m: FloatArray) -> Observations:
        """Return lengths after correcting jumps by one offset each."""
        length = self.length_m.copy()
        for (cable, pose), offset in zip(self.jumps, offsets_m, strict=True):
            length[pose:, cable] += offset
        return replace(self, length_m=length, jumps=())


_MOST_BYTES, _MOST_DATA_BYTES = 4 << 20, 64 << 20
_TURNS = ("rx_deg", "ry_deg", "rz_deg")
_REQUIRED = ("pose", "x_mm", "y_mm")
_ROTATION = 1e-4
_TURNED_rad = 0.2

Numbers = tuple[Annotated[float, Field(ge=-1e6, le=1e6)], ...]


class PoseReading(Profile):
    """Readings while the platform stood at one pose."""

    target: Numbers
    """The target (d,), as for the program `pose`, or the actual position if the platform did not
    reach the target. The first search begins there."""
    length_m: Numbers
    """Unstretched lengths from encoders and the robot's file, (n,)."""
    tension_N: Numbers | None = None
    """Tensions (n,); None if not measured, in which case the middle of the allowed range is
    assumed."""
    time_s: float | None = None
    """Time of the readings; only for readings while the platform moves."""
    position_m: Numbers | None = None
    """Externally measured position, (3,)."""
    position_std_m: float | None = Field(default=None, gt=0)
    rotation: tuple[Numbers, ...] | None = None
    rotation_std_rad: float | None = Field(default=None, gt=0)
    image: ImageReading | None = None
    """Image by the camera on the platform at this pose."""

    @model_validator(mode="after")
    def _measured_wholly(self) -> PoseReading:
        if (self.position_m is None) != (self.position_std_m is None):
            raise ValueError("position_m and position_std_m: give both or neither")
        if (self.rotation is None) != (self.rotation_std_rad is None):
            raise ValueError("rotation and rotation_std_rad: give both or neither")
        if self.position_m is not None and len(self.position_m) != 3:
            raise ValueError(f"position_m: value {value_text(self.position_m)}; allowed: 3 numbers")
        if self.rotation is not None:
            if [len(row) for row in self.rotation] != [3, 3, 3]:
                raise ValueError("rotation: allowed: 3 rows of 3 numbers")
            Q = np.array(self.rotation)
            if np.abs(Q @ Q.T - np.eye(3)).max() > _ROTATION or np.linalg.det(Q) < 0.0:
                raise ValueError(
                    "rotation: not a rotation matrix; allowed: an orthogonal matrix, determinant 1"
                )
        return self


class CalibrationData(Profile):
    """Readings at all poses of a calibration; the platform is at home at the first."""

    format: Literal["cdpr-rt geometry data 1"] = "cdpr-rt geometry data 1"
    robot: str
    geometry_sha256: str
    """Digest of the robot's files that were loaded during the measurement."""
    simulated: bool
    """Whether the robot was simulated; the result is then not valid for a real robot."""
    date: str
    left_out: tuple[str, ...] = ()
    """Poses that were tried without success, with the reasons."""
    tried: tuple[Numbers, ...] = ()
    """Targets (d,) that were not read, or not reached; a continued run skips them."""
    camera: CameraSetup | None = None
    """Setup of the camera; required if there are images."""
    restarts: tuple[Annotated[int, Field(ge=1)], ...] = ()
    """Poses, counted from 0, before which the encoders began to count again."""
    poses: tuple[PoseReading, ...] = Field(max_length=100_000)

    @model_validator(mode="after")
    def _camera_where_images(self) -> CalibrationData:
        for j, reading in enumerate(self.poses):
            if reading.image is not None and self.camera is None:
                raise ValueError(
                    f"poses[{j}].image: allowed only with `camera`, which describes the camera"
                )
        if any(pose >= len(self.poses) for pose in self.restarts):
            raise ValueError(f"restarts {self.restarts}; allowed: poses of the data")
        return self

    def save(self, path: Path) -> None:
        """Write the file; raises ProfileError."""
        write_text(path, self.model_dump_json(indent=1) + "\n")

    def observations(self, robot: Robot, model: PlatformModel) -> Observations:
        """Return the readings for the fit; raises InvalidRequestError for another robot."""
        other = self.geometry_sha256 != geometry_sha256(robot)
        if other and self.robot != robot.profile:
            raise InvalidRequestError(
                f"the data are of robot {self.robot!r}, not of {robot.profile!r}; allowed: "
                f"{self.robot}"
            )
        if other:
            raise InvalidRequestError(
                f"the data are of another state of {self.robot!r}: {robot.path}, or a file of its "
                "winches, has changed since; use the files with which they were measured"
            )
        if not self.poses:
            raise InvalidRequestError("the data contain no poses")
        n, d = len(robot.axes), model.size
        for j, reading in enumerate(self.poses):
            tensions = n if reading.tension_N is None else len(reading.tension_N)
            counts = (len(reading.length_m), tensions, len(reading.target))
            if counts != (n, n, d):
                raise InvalidRequestError(
                    f"pose {j + 1} has {counts} lengths, tensions and coordinates; allowed: "
                    f"{(n, n, d)}"
                )
        self._require_home_first(model)
        start = model.poses(np.array([reading.target for reading in self.poses]))
        seen = Observations.of_lengths(
            np.array([reading.length_m for reading in self.poses]),
            self._tensions(robot, model, start),
            start,
        )
        jumps = tuple((cable, pose) for pose in self.restarts for cable in range(n))
        seen = self._with_measured(seen, model.positions)
        assumed = all(reading.tension_N is None for reading in self.poses)
        return replace(seen, jumps=jumps, time_s=self._times(), tension_assumed=assumed)

    def _tensions(self, robot: Robot, model: PlatformModel, start: FloatArray) -> FloatArray:
        """Return tensions (N, n); assumed values if no tension was measured.

        A platform that hangs freely has the tensions that the control plans at `start`.
        """
        without = [j for j, reading in enumerate(self.poses) if reading.tension_N is None]
        if without and model.kinematics.turns_freely:
            raise InvalidRequestError(
                f"pose {without[0] + 1} has no tension_N, but the tensions turn this platform; "
                "record the tensions too"
            )
        if model.kinematics.hangs_freely:
            planned, _ = model.planned_tensions(start, np.tile(model.weight(), (len(start), 1)))
            told = [one.tension_N or t for one, t in zip(self.poses, planned, strict=True)]
            return np.array(told, float)
        limits = limits_of(robot)
        least_N = np.maximum(np.asarray(limits.tension_min_N, float), 0.0)
        middle = 0.5 * (least_N + np.asarray(limits.tension_max_N, float))
        assumed = np.broadcast_to(middle, len(robot.axes)).tolist()
        return np.array([one.tension_N or assumed for one in self.poses], float)

    def _times(self) -> FloatArray | None:
        """Return the times of readings (N,), or None; raises InvalidRequestError."""
        times = [reading.time_s for reading in self.poses]
        if all(time is None for time in times):
            return None
        time_s = np.array([math.nan if time is None else time for time in times])
        bad = ~np.isfinite(time_s)
        bad[1:] |= ~(np.diff(time_s) > 0.0)
        if bad.any():
            raise InvalidRequestError(
                f"pose {int(bad.argmax()) + 1}: time_s is missing or not later than that of the "
                "pose before; sort the poses by time, and give all of them a time, or none"
            )
        return time_s

    def sightings(self) -> list[Sighting]:
        """Return the markers in the images of all poses; empty if there is no image."""
        return [
            (reading.image or ImageReading()).sighting(f"pose {j + 1}")
            for j, reading in enumerate(self.poses)
        ]

    def _require_home_first(self, model: PlatformModel) -> None:
        """Raise InvalidRequestError if the first pose is not home."""
        off = np.abs(np.array(self.poses[0].target) - model.home)
        k = model.positions
        if off[:k].max() > model.platform.home_tolerance_m or (off[k:] > _TURNED_rad).any():
            raise InvalidRequestError(
                f"pose 1 has the target {list(self.poses[0].target)}; allowed: home, "
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


_Cell = Annotated[float, Field(ge=-1e6, le=1e6)]
_Sigma = Annotated[float, Field(gt=0.0, le=1e6)]


class _PointRow(Profile):
    """The cells of a line of a file of measured points that are not empty."""

    pose: Annotated[int, Field(ge=1)]
    x_mm: _Cell = math.nan
    y_mm: _Cell = math.nan
    z_mm: _Cell = math.nan
    sigma_mm: _Sigma = 2.0
    rx_deg: _Cell = math.nan
    ry_deg: _Cell = math.nan
    rz_deg: _Cell = math.nan
    sigma_deg: _Sigma = 0.5


@dataclass(frozen=True)
class MeasuredPoint:
    """Measured position of the platform's origin at a pose; nan if not measured."""

    pose: int
    """Index of the pose, counted from 0."""
    position_m: FloatArray
    std_m: float
    std_guessed: bool
    """Whether the file gives no standard deviation for this position."""
    turn_rad: FloatArray | None
    """Measured rotation vector of the platform (3,); nan for a coordinate without a column."""
    turn_std_rad: float


def load_points(path: Path) -> list[MeasuredPoint]:
    """Return measured points: CSV, poses counted from 1.

    Columns are pose, x_mm, y_mm, and optionally z_mm, sigma_mm, the rotation vector rx_deg, ry_deg,
    rz_deg, and sigma_deg. Cells may be empty; sigma_mm is 2 by default, sigma_deg 0.5. Raises
    ProfileError.
    """
    try:
        reader = csv.reader(io.StringIO(read_text(path, _MOST_BYTES)))
        lines = [(reader.line_num, row) for row in reader]
    except csv.Error as error:
        raise ProfileError(path, "", f"is not a CSV file: {error}") from None
    lines = [(line, row) for line, row in lines if row and not row[0].lstrip().startswith("#")]
    first, names = (lines[0][0], [name.strip() for name in lines[0][1]]) if lines else (1, [])
    if not set(_REQUIRED) <= set(names) <= set(_PointRow.model_fields) or len(set(names)) < len(
        names
    ):
        known = ",".join(_PointRow.model_fields)
        problem = f"allowed: the columns {known}; only the first three are required"
        raise ProfileError(path, f"line {first}", problem)
    points: list[MeasuredPoint] = []
    line_of: dict[int, int] = {}
    for line, row in lines[1:]:
        point = _point(path, line, names, row)
        if (other := line_of.setdefault(point.pose, line)) != line:
            problem = f"pose {point.pose + 1} is also in line {other}; keep one of the two lines"
            raise ProfileError(path, f"line {line}: pose", problem)
        points.append(point)
    return points


def _point(path: Path, line: int, names: list[str], row: list[str]) -> MeasuredPoint:
    if len(row) > len(names):
        problem = f"{len(row)} cells; allowed: up to {len(names)}, one for each column"
        raise ProfileError(path, f"line {line}", problem)
    cells = {name: cell.strip() for name, cell in zip(names, row, strict=False) if cell.strip()}
    one = validated_cells(path, line, cells, _PointRow)
    turn_rad, turns = None, [name for name in _TURNS if name in names]
    if cells.keys() & turns:
        if empty := [name for name in turns if name not in cells]:
            problem = "is empty; give all angles of a pose, or none"
            raise ProfileError(path, f"line {line}: {empty[0]}", problem)
        turn_rad = np.radians([one.rx_deg, one.ry_deg, one.rz_deg])
    return MeasuredPoint(
        one.pose - 1, 1e-3 * np.array([one.x_mm, one.y_mm, one.z_mm]), 1e-3 * one.sigma_mm,
        "sigma_mm" not in cells, turn_rad, math.radians(one.sigma_deg),
    )  # fmt: skip


def with_points(
    seen: Observations, points: Sequence[MeasuredPoint], coordinates: int
) -> Observations:
    """Return observations in which points replace other measured positions at their poses."""
    position = np.where(np.isfinite(seen.position_std_m), seen.position_m, np.nan)
    std = np.where(np.isfinite(seen.position_std_m), seen.position_std_m, 1.0)
    turn_std = seen.rotation_std_rad.copy()
    turn = np.where(np.isfinite(turn_std[:, :1, None]), seen.rotation, np.nan)
    turn_std = np.where(np.isfinite(turn_std), turn_std, 1.0)
    about = slice(0, 3) if coordinates == 3 else slice(2, 3)
    for point in points:
        if point.pose >= seen.poses:
            raise InvalidRequestError(
                f"pose {point.pose + 1}; allowed: 1 to {seen.poses}, the poses of the data"
            )
        position[point.pose, :coordinates] = point.position_m[:coordinates]
        std[point.pose] = point.std_m
        if point.turn_rad is None:
            continue
        vector = np.zeros(3)
        vector[about] = point.turn_rad[about]
        if not np.isfinite(vector).all():
            needed = ", ".join(_TURNS[about])
            raise InvalidRequestError(f"a rotation of this robot needs the columns {needed}")
        turn[point.pose] = Rotation.from_rotvec(vector).as_matrix()
        turn_std[point.pose] = point.turn_std_rad
    guessed = bool(points) and all(point.std_guessed for point in points)
    seen = replace(seen.with_positions(position, std, seen.target_m), std_guessed=guessed)
    return seen.with_rotations(turn, turn_std)
