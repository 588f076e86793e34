"""The calibrated geometry of a robot: what is taken in place of what its file says."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from cdpr_profiles.errors import ProfileError
from cdpr_profiles.platform import Point
from cdpr_profiles.reading.bounded_input import read_text
from cdpr_profiles.reading.reader import Profile, read_toml_model
from cdpr_profiles.robot import Robot, RobotAxis

_HASH_CHARS = 12
_MOST_BYTES = 1 << 20
_FURTHEST_m = 0.5
"""A calibration that moves an exit point by more is of another robot."""


class GeometryCalibration(Profile):
    """Exit points, home, drums and elongation of a robot as calibrated; the rest is its file's."""

    robot: str
    robot_sha256: str
    """Of the robot's file when it was calibrated: one that has been changed is another robot."""
    version: int = Field(ge=1)
    date: datetime
    method: Literal["points", "redundancy", "camera", "points and camera"]
    frame: str
    """What the coordinates are relative to, in words."""
    exit_points_m: tuple[Point, ...]
    anchor_points_m: tuple[Point, ...] | None = None
    home_m: Point
    """Where the platform stands on its stand."""
    home_rotation_rad: tuple[float, ...]
    drum_scales: tuple[float, ...]
    """Cable paid out by a turn of each motor over what the file says."""
    elongation_scale: float = Field(gt=0, le=10)
    poses: int = Field(ge=1)
    exit_std_m: tuple[float, ...]
    """Predicted standard deviation of each exit point, its worst coordinate."""
    predicted_3_sigma_mm: float = Field(ge=0)
    """Of a position in the workspace, by what the fit does not know."""
    verified_poses: int = Field(ge=0)
    verified_mean_mm: float | None = None
    """On poses that the fit had not seen, against what was measured there; none without points."""
    verified_worst_mm: float | None = None
    raw_data: str

    @property
    def identity(self) -> str:
        """Short hash of everything it says."""
        text = self.model_dump_json().encode()
        return hashlib.sha256(text).hexdigest()[:_HASH_CHARS]

    def faults(self, robot: Robot) -> list[tuple[str, str]]:
        """Return (key, problem) for what cannot be of `robot`."""
        platform = robot.platform
        if platform is None:
            return [("robot", f"{robot.profile} has no platform")]
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
        if found:
            return found
        for i, (here, file) in enumerate(
            zip(self.exit_points_m, platform.exit_points_m, strict=True)
        ):
            if max(abs(a - b) for a, b in zip(here, file, strict=True)) > _FURTHEST_m:
                problem = f"more than {_FURTHEST_m:g} m from the robot's file"
                found.append((f"exit_points_m[{i}]", problem))
        for i, scale in enumerate(self.drum_scales):
            if not 0.5 < scale < 2.0:
                found.append((f"drum_scales[{i}]", f"value {scale:g}; allowed: 0.5 to 2"))
        return found

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
        lines = ["# Geometry of a robot as calibrated; `cdpr calibrate undo` takes it away."]
        for key, value in self.model_dump().items():
            if value is None:
                continue
            is_date = isinstance(value, datetime)
            text = value.isoformat() if is_date else json.dumps(value, ensure_ascii=False)
            lines.append(f"{key} = {text}")
        return "\n".join(lines) + "\n"

    def summary(self) -> dict[str, Any]:
        """Return what descriptions and recordings tell of it."""
        return {
            "version": self.version,
            "identity": self.identity,
            "date": self.date.isoformat(),
            "method": self.method,
            "frame": self.frame,
            "predicted_3_sigma_mm": self.predicted_3_sigma_mm,
            "verified_mean_mm": self.verified_mean_mm,
            "verified_worst_mm": self.verified_worst_mm,
        }


def load_geometry_calibration(path: Path) -> GeometryCalibration:
    """Return the calibration in a file; raises ProfileError."""
    return read_toml_model(path, GeometryCalibration)


def file_sha256(path: Path) -> str:
    """Return the hash of a file's text; raises ProfileError."""
    return hashlib.sha256(read_text(path, _MOST_BYTES).encode()).hexdigest()


def write_text(path: Path, text: str) -> None:
    """Replace a file as a whole; raises ProfileError naming it."""
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        raise ProfileError(path, "", f"cannot be written: {error.strerror}") from None
