"""The calibrated geometry of a robot, which replaces that of its file."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from cdpr_profiles.bounded_input import replacing
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.platform import NO_PLATFORM, Platform, Point
from cdpr_profiles.reader import Profile
from cdpr_profiles.robot import Robot, RobotAxis

_HASH_CHARS = 12
_FURTHEST_m, _ANCHOR_m = 0.2, 0.05
"""If an exit or anchor point moves by more, the calibration belongs to another robot."""
_TURNED_rad = 0.2
_DRUM, _ELONGATION = (0.9, 1.1), (0.1, 10.0)


class GeometryCalibration(Profile):
    """Calibrated exit points, home, drums and elongation; the robot's file has all other values."""

    robot: str
    geometry_sha256: str
    """Hash of the replaced and scaled values of the file; if it differs, so does the robot."""
    simulated: bool
    """Whether it was measured on a simulated robot; then it is valid only on a simulated bus."""
    distrusted_before: str = ""
    """Why the previous geometry was not trusted when this one replaced it; empty if it was."""
    version: int = Field(ge=1)
    date: datetime
    method: Literal["points", "redundancy", "camera"]
    frame: str
    """Frame of the coordinates, as text."""
    exit_points_m: tuple[Point, ...]
    anchor_points_m: tuple[Point, ...] | None = None
    home_m: Point
    """Position of the platform on its stand."""
    home_rotation_rad: tuple[float, ...]
    drum_scales: tuple[float, ...]
    """Cable paid out per turn of each motor, divided by the file's value."""
    elongation_scale: float
    poses: int = Field(ge=1)
    exit_std_m: tuple[float, ...]
    """Predicted standard deviation of each exit point, in its worst coordinate."""
    predicted_3_sigma_mm: float = Field(ge=0)
    """Uncertainty of a position in the workspace, from the covariance of the fit."""
    predicted_3_sigma_deg: float | None = Field(default=None, ge=0)
    """Uncertainty of relative orientations; None if the platform's is not estimated."""
    absolute_3_sigma_mm: float | None = Field(default=None, ge=0)
    """Uncertainty of an absolute position, including that of the frame."""
    absolute_3_sigma_deg: float | None = Field(default=None, ge=0)
    verified_poses: int = Field(ge=0)
    verified_mean_mm: float | None = None
    """Mean error against measurements at poses that the fit did not use; None without points."""
    verified_worst_mm: float | None = None
    raw_data: str
    points_file: str = ""
    """File of additional measured positions; empty without."""
    hand_eye_file: str = ""
    """File with the pose of the camera on its platform; empty if the raw data have it."""
    identified: tuple[str, ...] = ("exit", "offset", "drum", "elongation")
    known_exit_m: float = Field(default=0.05, gt=0)
    """Assumed standard deviation of exit points in the robot's file."""

    @property
    def identity(self) -> str:
        """Short hash of the whole content."""
        text = self.model_dump_json().encode()
        return hashlib.sha256(text).hexdigest()[:_HASH_CHARS]

    def faults(self, robot: Robot) -> list[tuple[str, str]]:
        """Return (key, problem) for values that cannot belong to `robot`."""
        platform = robot.platform
        if platform is None:
            return [("robot", f"{robot.profile}: {NO_PLATFORM}")]
        found, n, k = [], len(robot.axes), len(platform.home_m)
        for key in ("exit_points_m", "drum_scales", "exit_std_m"):
            if len(getattr(self, key)) != n:
                problem = f"{len(getattr(self, key))} entries; allowed: {n}, one for each axis"
                found.append((key, problem))
        points = [*self.exit_points_m, self.home_m, *(self.anchor_points_m or ())]
        if any(len(point) != k for point in points):
            found.append(("exit_points_m, home_m", f"allowed: {k} coordinates"))
        if len(self.home_rotation_rad) != len(platform.home_rotation_rad):
            problem = f"allowed: {len(platform.home_rotation_rad)} numbers"
            found.append(("home_rotation_rad", problem))
        if self.anchor_points_m is not None and len(self.anchor_points_m) != n:
            found.append(("anchor_points_m", f"{len(self.anchor_points_m)} entries; allowed: {n}"))
        if self.robot != robot.profile:
            found.append(("robot", f"value {self.robot!r}; allowed: {robot.profile!r}"))
        return found or [*self._far_points(platform), *self._far_values(platform)]

    def _far_points(self, platform: Platform) -> Iterator[tuple[str, str]]:
        """Return points that differ from the robot's file by more than measurement errors."""
        exits = list(zip(self.exit_points_m, platform.exit_points_m, strict=True))
        anchors = zip(self.anchor_points_m or (), platform.anchor_points_m, strict=False)
        moved_m = min(max(math.dist(calibrated, file) for calibrated, file in exits), _FURTHEST_m)
        for key, pairs, most_m in (
            ("exit_points_m", exits, _FURTHEST_m),
            ("anchor_points_m", anchors, _ANCHOR_m),
            ("home_m", [(self.home_m, platform.home_m)], platform.home_tolerance_m + moved_m),
        ):
            for i, (calibrated, file) in enumerate(pairs):
                if not math.dist(calibrated, file) <= most_m:  # true also for nan
                    yield f"{key}[{i}]", f"more than {most_m:.3g} m from the robot's file"

    def _far_values(self, platform: Platform) -> Iterator[tuple[str, str]]:
        if not math.dist(self.home_rotation_rad, platform.home_rotation_rad) <= _TURNED_rad:
            yield "home_rotation_rad", f"more than {_TURNED_rad:g} rad from the robot's file"
        values = [(f"drum_scales[{i}]", x, _DRUM) for i, x in enumerate(self.drum_scales)]
        for key, value, (low, high) in [
            *values, ("elongation_scale", self.elongation_scale, _ELONGATION),
        ]:  # fmt: skip
            if not low <= value <= high:
                yield key, f"value {value:g}; allowed: {low:g} to {high:g}"

    def applied(self, robot: Robot) -> Robot:
        """Return `robot` with this geometry."""
        assert robot.platform is not None  # see `faults`
        platform = replace(
            robot.platform,
            exit_points_m=self.exit_points_m,
            anchor_points_m=self.anchor_points_m or robot.platform.anchor_points_m,
            home_m=self.home_m,
            home_rotation_rad=self.home_rotation_rad,
        )
        axes = tuple(
            self._axis(axis, scale)
            for axis, scale in zip(robot.axes, self.drum_scales, strict=True)
        )
        return replace(robot, platform=platform, axes=axes, calibration=self)

    def _axis(self, axis: RobotAxis, scale: float) -> RobotAxis:
        cable = axis.winch.cable
        percent = cable.elongation_percent_per_N * self.elongation_scale
        winch = replace(
            axis.winch,
            drum_radius_m=axis.winch.drum_radius_m * scale,
            cable=cable.model_copy(update={"elongation_percent_per_N": percent}),
        )
        return replace(axis, winch=winch)

    def to_toml(self) -> str:
        """Return the text of the file."""
        return self.toml_text("Calibrated geometry of a robot; `cdpr calibrate undo` removes it.")

    def summary(self) -> dict[str, Any]:
        """Return the data for descriptions and recordings."""
        return {
            "version": self.version,
            "identity": self.identity,
            "date": self.date.isoformat(),
            "method": self.method,
            "frame": self.frame,
            "simulated": self.simulated,
            "poses": self.poses,
            "predicted_3_sigma_mm": self.predicted_3_sigma_mm,
            "predicted_3_sigma_deg": self.predicted_3_sigma_deg,
            "absolute_3_sigma_mm": self.absolute_3_sigma_mm,
            "absolute_3_sigma_deg": self.absolute_3_sigma_deg,
            "verified_mean_mm": self.verified_mean_mm,
            "verified_worst_mm": self.verified_worst_mm,
        }


def geometry_sha256(robot: Robot) -> str:
    """Return the hash of the values in the robot's files that a calibration replaces or scales."""
    platform = robot.platform
    points: tuple[Any, ...] = ()
    if platform is not None:
        points = (
            platform.exit_points_m, platform.anchor_points_m, platform.home_m,
            platform.home_rotation_rad,
        )  # fmt: skip
    winches = [
        (w.drum_radius_m, w.gear_ratio, w.cable.elongation_percent_per_N)
        for w in (axis.winch for axis in robot.axes)
    ]
    return hashlib.sha256(json.dumps([points, winches]).encode()).hexdigest()


def write_text(path: Path, text: str) -> None:
    """Replace a file as a whole, so that a power failure leaves the old file or the new one.

    Raises ProfileError with the file's name.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(text.encode())
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise ProfileError(path, "", f"cannot be written: {error.strerror}") from None
