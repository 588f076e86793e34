"""From observations to a calibration that has verified itself, with a verdict in words."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, Literal

import numpy as np
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from cdpr_profiles import Robot
from cdpr_profiles.calibration.geometry import GeometryCalibration, geometry_sha256
from cdpr_profiles.platform import Platform
from cdpr_rt.calibration.faults import Fault, fit_without_faults
from cdpr_rt.calibration.fit import Fit, fit
from cdpr_rt.calibration.observations import Observations
from cdpr_rt.calibration.parameters import DRUM, CableGeometry
from cdpr_rt.calibration.verdict import (
    OpenDirection,
    Verification,
    open_directions,
    parameter_table,
    predicted_std,
    require_enough,
    verify,
)
from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.robots.robot_arrays import limits_of

Method = Literal["points", "redundancy"]
_EACH = 5
"""One pose in so many is kept from the fit and verifies it."""
_LEAST_HELD_OUT = 3
_GRID = 4
_WANTED_mm_PER_m = 0.3
"""1.5 mm for 5 m of frame, 3 sigma."""
_MOST_OVER_WANTED = 3.0
"""What is known worse than so many times what is wanted is not taken over."""
_MISFIT = 9.0
_SLACK_SHARE = 0.5
_MOST_LEFT_OUT = 0.1


@dataclass(frozen=True)
class Outcome:
    """A calibration: the fit, what was wrong, what stays open, and how it did on other poses."""

    robot: Robot
    found: Fit
    method: Method
    faults: list[Fault]
    open_directions: list[OpenDirection]
    verified: Verification
    before: Verification
    """The same by the robot's file, whose lengths are those at the start."""
    verified_left_out: int
    """Readings at those poses that were found to be at fault, with all poses, and left out."""
    predicted_3_sigma_mm: float
    """Of a position in the workspace; without measured points, of its shape."""

    @property
    def good(self) -> bool:
        """Whether there is nothing that speaks against taking it over."""
        return not self.objections()

    def objections(self) -> list[str]:
        """Return what speaks against taking it over, each with what to do."""
        found, told = self.found, []
        if not found.converged:
            told.append("the fit did not settle: the start is too far off, or data contradict")
        if found.variance_factor > _MISFIT:
            told.append(
                f"lengths disagree {math.sqrt(found.variance_factor):.1f} times as much as they "
                "should: something moves that is taken to be fixed (an anchor, a pulley, a frame)"
            )
        left_out = [fault for fault in self.faults if fault.kind in ("outlier", "slack", "jump")]
        if len(left_out) > _MOST_LEFT_OUT * found.seen.used.size:
            told.append(f"{len(left_out)} readings contradict the others: measure anew")
        most_mm = _MOST_OVER_WANTED * _wanted_mm(self.robot)
        if self.predicted_3_sigma_mm > most_mm:
            told.append(
                f"positions would be known to {self.predicted_3_sigma_mm:.1f} mm only (3 sigma, "
                f"predicted; allowed: {most_mm:.1f} mm): measure points, or say how well the exit "
                "points of the robot's file are known (--known-mm)"
            )
        worse = self.verified.residual_m > self.before.residual_m
        if self.verified.errors_m.size:
            worse = self.verified.mean_mm > self.before.mean_mm
        if worse:
            told.append(
                "poses that the fit had not seen are told no better than by the robot's file: take "
                "more poses, further apart"
            )
        return told + self._impossible()

    def _impossible(self) -> list[str]:
        """Return which values cannot be of this robot."""
        try:
            faults = calibration_of(self, 1, "", simulated=False).faults(self.robot)
        except ValidationError as error:
            return [f"the result is no geometry: {error.errors()[0]['msg']}"]
        what = "is something of the robot's file wrong, or was pose 1 not home?"
        return [f"{key}: {problem}: {what}" for key, problem in faults]

    def advice(self) -> str:
        """Return what more poses would bring."""
        poses, sigma = self.found.seen.poses, self.predicted_3_sigma_mm
        more = max(10, poses // 4)
        then = sigma * math.sqrt(poses / (poses + more))
        return f"{more} more poses would bring {sigma:.2f} mm to {then:.2f} mm (3 sigma, predicted)"

    def verdict(self) -> list[str]:
        """Return the calibration in words."""
        lines = [fault.text for fault in self.faults]
        against = self.objections()
        lines += [f"NOT GOOD: {text}" for text in against]
        wanted = _wanted_mm(self.robot)
        if not against:
            enough = self.predicted_3_sigma_mm <= wanted
            lines.append(
                f"positions are known to {self.predicted_3_sigma_mm:.2f} mm (3 sigma, predicted)"
                + (": good" if enough else f", {wanted:.2f} mm wanted: {self.advice()}")
            )
        if self.verified.errors_m.size:
            lines.append(
                f"verified on {len(self.verified.errors_m)} poses not used: mean "
                f"{self.verified.mean_mm:.2f} mm, worst {self.verified.worst_mm:.2f} mm off what "
                f"was measured (before: {self.before.mean_mm:.2f} and {self.before.worst_mm:.2f})"
            )
        lines.append(
            f"lengths at poses not used contradict each other by "
            f"{1e3 * self.verified.residual_m:.2f} mm rms (before: "
            f"{1e3 * self.before.residual_m:.2f})"
        )
        if self.verified_left_out:
            lines.append(
                f"{self.verified_left_out} readings at poses not used were at fault, and count "
                "for nothing there"
            )
        return lines + [f"not known: {one.what}; {one.advice}" for one in self.open_directions]

    def told(self) -> dict[str, Any]:
        """Return everything for JSON."""
        return {
            "good": self.good,
            "verdict": self.verdict(),
            "objections": self.objections(),
            "poses": self.found.seen.poses,
            "converged": self.found.converged,
            "variance_factor": self.found.variance_factor,
            "predicted_3_sigma_mm": self.predicted_3_sigma_mm,
            "frame": frame_of(self.found.seen),
            "parameters": parameter_table(self.found),
            "faults": [fault.told() for fault in self.faults],
            "open": [
                {"what": one.what, "advice": one.advice, "share": one.share}
                for one in self.open_directions
            ],
            "verification": {
                "poses": self.verified.poses,
                "readings_left_out": self.verified_left_out,
                "mean_position_error_mm": _number(self.verified.mean_mm),
                "worst_position_error_mm": _number(self.verified.worst_mm),
                "mean_position_error_before_mm": _number(self.before.mean_mm),
                "length_residual_mm": 1e3 * self.verified.residual_m,
                "length_residual_before_mm": 1e3 * self.before.residual_m,
            },
        }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def calibrate(robot: Robot, geometry: CableGeometry, seen: Observations, method: Method) -> Outcome:
    """Return the calibration that observations support; raises InvalidRequestError for too few.

    It is fitted without one pose in five first, which verify it, then with all of them.
    """
    held = np.arange(seen.poses) % _EACH == _EACH - 1
    if held.sum() < _LEAST_HELD_OUT:
        raise InvalidRequestError(
            f"{seen.poses} poses; allowed: {_EACH * _LEAST_HELD_OUT} and more, of which one in "
            f"{_EACH} verifies what the others tell"
        )
    require_enough(geometry, seen.some(~held))
    slack = _SLACK_SHARE * np.asarray(limits_of(robot).slack_N, float)
    found, faults = fit_without_faults(geometry, seen, slack)
    clean = replace(found.seen, start=found.poses)
    part = fit(geometry, clean.some(~held))
    other = clean.some(held)
    verified = verify(part.geometry, part.jumps_m, other)
    before = verify(geometry, np.zeros(len(other.jumps)), other)
    predicted = predicted_std(found, _grid(geometry), relative=not seen.measured.any())
    k = geometry.coordinates
    three_sigma_mm = 3e3 * float(np.sqrt((predicted[:, :k] ** 2).mean(axis=0).max()))
    open_ones = open_directions(found)
    left_out = int((~other.used).sum())
    return Outcome(
        robot, found, method, faults, open_ones, verified, before, left_out, three_sigma_mm
    )


def frame_of(seen: Observations) -> str:
    """Return in words what the identified coordinates are relative to."""
    if seen.measured.sum() >= 3:
        return "the room in which the platform was measured"
    return "the exit points of the robot's file, taken together: moved and turned least"


def calibration_of(
    outcome: Outcome, version: int, raw_data: str, *, simulated: bool, distrusted_before: str = ""
) -> GeometryCalibration:
    """Return the file of a calibration; raises ValidationError of pydantic for what is none."""
    robot, found = outcome.robot, outcome.found
    platform = robot.platform
    assert platform is not None  # the fit was of one
    geometry, k = found.geometry, len(platform.home_m)
    kernel = geometry.kernel_geometry()
    rows = len(geometry.rows)
    exits = [i for i, row in enumerate(geometry.rows) if row < 3]
    std = found.std[: geometry.n * rows].reshape(geometry.n, rows)
    home_m, home_rotation = _home(platform, found.poses[0])
    verified = outcome.verified
    anchors = None
    if "anchor" in geometry.identified:
        anchors = _points(kernel[3 : 3 + k].T)
    return GeometryCalibration(
        robot=robot.profile,
        geometry_sha256=geometry_sha256(robot),
        simulated=simulated,
        distrusted_before=distrusted_before,
        version=version,
        date=datetime.now(UTC).replace(microsecond=0),
        method=outcome.method,
        frame=frame_of(found.seen),
        exit_points_m=_points(kernel[:k].T),
        anchor_points_m=anchors,
        home_m=home_m,
        home_rotation_rad=home_rotation,
        drum_scales=tuple((1.0 + geometry.cable[:, DRUM]).tolist()),
        elongation_scale=1.0 + geometry.elongation,
        poses=found.seen.poses,
        exit_std_m=tuple(std[:, exits].max(axis=1).tolist()),
        predicted_3_sigma_mm=outcome.predicted_3_sigma_mm,
        verified_poses=verified.poses,
        verified_mean_mm=_number(verified.mean_mm),
        verified_worst_mm=_number(verified.worst_mm),
        raw_data=raw_data,
    )


def _points(points: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(point) for point in points.tolist())


def _home(platform: Platform, pose: FloatArray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return position and rotation vector of the platform on its stand, the first pose."""
    k, turns = len(platform.home_m), len(platform.home_rotation_rad)
    position = tuple(pose[0, :k].tolist())
    if len(platform.controlled) == k:
        return position, platform.home_rotation_rad
    vector = Rotation.from_matrix(pose[1:]).as_rotvec()
    return position, tuple(vector[3 - turns :].tolist())


def _grid(geometry: CableGeometry) -> FloatArray:
    """Return poses spread over the workspace, at home's orientation."""
    platform = geometry.model.platform
    axes = [
        np.linspace(low, high, _GRID)
        for low, high in zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    return geometry.model.poses(places)


def _wanted_mm(robot: Robot) -> float:
    """Return what is wanted of positions, by the longest side of the box around exit points."""
    assert robot.platform is not None
    frame_m = float(np.ptp(np.array(robot.platform.exit_points_m), axis=0).max())
    return _WANTED_mm_PER_m * frame_m
