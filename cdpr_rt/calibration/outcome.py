"""From observations to a calibration that has verified itself, with a verdict in words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

import numpy as np
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from cdpr_profiles import Robot
from cdpr_profiles.calibration.geometry import GeometryCalibration, geometry_sha256
from cdpr_profiles.platform import Platform
from cdpr_rt.calibration.camera.camera_faults import UNDECIDED, map_faults, told_right
from cdpr_rt.calibration.camera.camera_start import camera_start
from cdpr_rt.calibration.estimation.faults import Fault, fit_without_faults, parameter_faults
from cdpr_rt.calibration.estimation.fit import Fit
from cdpr_rt.calibration.estimation.noise import fit_with_noise_seen
from cdpr_rt.calibration.estimation.parameters import DRUM, CableGeometry
from cdpr_rt.calibration.markers.map_fit import MapFit
from cdpr_rt.calibration.readings.camera_data import Images
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.calibration.verification.held_out import LEAST_POSES, Unused, held_out, hold_out
from cdpr_rt.calibration.verification.more_poses import MORE, with_more_poses
from cdpr_rt.calibration.verification.verdict import (
    OpenDirection,
    camera_table,
    open_directions,
    parameter_table,
    predicted_std,
    require_enough,
)
from cdpr_rt.calibration.verification.verification import Verification
from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.robots.robot_arrays import limits_of

Method = Literal["points", "redundancy", "camera"]
_GRID = 4
_WANTED_mm_PER_m = 0.3
"""1.5 mm for 5 m of frame, 3 sigma."""
_MOST_OVER_WANTED = 3.0
"""What is known worse than so many times what is wanted is not taken over."""
_LESS_CONTRADICTION = 0.5
_MISFIT = 9.0
_SLACK_SHARE = 0.5
_LEAST_POINTS = 3
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
    """Readings at those poses of cables that hung slack, or next to a slip, which are left out."""
    predicted_3_sigma_mm: float
    """Of a position in the workspace; without measured points, of its shape. Errors at poses not
    used that are larger than predicted have made it larger by as much."""
    with_more_3_sigma_mm: float
    """The same with ten more poses that tell as much as those so far."""
    known_room: bool
    """Whether anything was measured in the room: points, or places of markers."""
    unused: Unused
    birge_ratio: float
    """How many times as large errors at measured points not used are as predicted; nan without."""

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
        told += [fault.text for fault in self.faults if fault.text.startswith(UNDECIDED)]
        if found.corner_factor > _MISFIT:
            told.append(
                f"corners fit {math.sqrt(found.corner_factor):.1f} times worse together with the "
                "cables than by themselves: the camera moved on the platform, or the platform "
                "while images were taken"
            )
        left_out = [fault for fault in self.faults if fault.kind in ("outlier", "slack", "jump")]
        if len(left_out) > _MOST_LEFT_OUT * found.seen.used.size:
            told.append(f"{len(left_out)} readings contradict the others: measure anew")
        most_mm = _MOST_OVER_WANTED * wanted_mm(self.robot)
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
        if self.method == "camera" and self.verified.kind == "none":
            told.append(
                "no three of the poses not used show two markers of the map, so nothing verifies "
                "it: take more poses, or lay more sheets"
            )
        if self._is_insignificant():
            told.append(
                f"the file's geometry is off by {self.before.mean_mm:.2f} mm here, less than the "
                f"{self.predicted_3_sigma_mm:.2f} mm that this calibration is uncertain by, and "
                "lengths contradict each other hardly less than by the file, which may be right "
                "already: take more poses, or larger markers"
            )
        return told + self._impossible()

    def _is_insignificant(self) -> bool:
        """Return whether the camera tells too little to know better than the robot's file.

        What lengths contradict each other by does not depend on how good the camera's map is.
        """
        verified, before = self.verified, self.before
        contradicts_less = verified.residual_m < _LESS_CONTRADICTION * before.residual_m
        within = before.mean_mm < self.predicted_3_sigma_mm
        return verified.by_camera and within and not contradicts_less

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
        return (
            f"{MORE} more poses would bring {self.predicted_3_sigma_mm:.2f} mm to "
            f"{self.with_more_3_sigma_mm:.2f} mm (3 sigma, predicted)"
        )

    @property
    def gain_of_more(self) -> float:
        """What ten more poses would take off, relative."""
        return 1.0 - self.with_more_3_sigma_mm / max(self.predicted_3_sigma_mm, 1e-9)

    def verdict(self) -> list[str]:
        """Return the calibration in words."""
        against = self.objections()
        lines = [fault.text for fault in self.faults if fault.text not in against]
        lines += [f"NOT GOOD: {text}" for text in against]
        wanted = wanted_mm(self.robot)
        if not against:
            enough = self.predicted_3_sigma_mm <= wanted
            lines.append(
                f"positions are known to {self.predicted_3_sigma_mm:.2f} mm (3 sigma, predicted)"
                + (": good" if enough else f", {wanted:.2f} mm wanted: {self.advice()}")
            )
        lines += self.proof()
        return lines + [f"not known: {one.what}; {one.advice}" for one in self.open_directions]

    def proof(self) -> list[str]:
        """Return in words how it does at the poses that verify it."""
        lines = []
        if self.verified.errors_m.size:
            lines.append(
                f"verified on {len(self.verified.errors_m)} poses not used: mean "
                f"{self.verified.mean_mm:.2f} mm, worst {self.verified.worst_mm:.2f} mm off "
                f"{self.verified.reference} (by the robot's file: {self.before.mean_mm:.2f} and "
                f"{self.before.worst_mm:.2f})"
            )
        if self.verified.turn_errors_rad.size:
            lines.append(
                f"orientations there: mean {self.verified.mean_deg:.2f} deg off (before: "
                f"{self.before.mean_deg:.2f})"
            )
        lines.append(
            f"lengths at poses not used contradict each other by "
            f"{1e3 * self.verified.residual_m:.2f} mm rms (before: "
            f"{1e3 * self.before.residual_m:.2f})"
        )
        if self.verified_left_out:
            lines.append(
                f"{self.verified_left_out} readings at poses not used are of slack cables, or next "
                "to a slip, and count for nothing there"
            )
        return lines

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
            "with_10_more_poses_3_sigma_mm": self.with_more_3_sigma_mm,
            "frame": frame_of(self),
            "corner_factor": self.found.corner_factor,
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
                "mean_orientation_error_deg": _number(self.verified.mean_deg),
                "mean_orientation_error_before_deg": _number(self.before.mean_deg),
                "reference": self.verified.kind,
                "by": self.verified.reference,
                "birge_ratio": _number(self.birge_ratio),
                "length_residual_mm": 1e3 * self.verified.residual_m,
                "length_residual_before_mm": 1e3 * self.before.residual_m,
            },
            "camera": camera_table(self.found),
        }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def calibrate(
    robot: Robot,
    geometry: CableGeometry,
    seen: Observations,
    method: Method,
    images: Images | None = None,
) -> Outcome:
    """Return the calibration that observations support; raises InvalidRequestError for too few.

    With images it is fitted together with camera and markers. It is fitted to all poses, with what
    is at fault left out, and anew without one pose in five, which verify it: these count for
    nothing there, not even to find what is at fault.
    """
    if seen.poses < LEAST_POSES:
        raise InvalidRequestError(
            f"{seen.poses} poses; allowed: {LEAST_POSES} and more, some of which verify what the "
            "others tell"
        )
    held = held_out(seen.poses)
    slack = _SLACK_SHARE * np.asarray(limits_of(robot).slack_N, float)
    known_room = bool(seen.measured.sum() >= _LEAST_POINTS)
    first_map: MapFit | None = None
    if images is None:
        base = seen
        require_enough(geometry, base.some(~held))
        found, faults = fit_without_faults(geometry, base, slack)
        found, weighed = fit_with_noise_seen(found, geometry)
    else:
        start = camera_start(geometry, seen, images.setup, images.sightings)
        base = start.seen
        require_enough(geometry, base.some(~held))
        found, faults = fit_without_faults(geometry, base, slack, start.camera)
        known_room = known_room or start.known_room
        found, wrong = told_right(geometry, found, start.map)
        found, weighed = fit_with_noise_seen(found, geometry)
        readings = [one for one in faults if one.kind not in ("drum", "elongation")]
        of_map = map_faults(start.map, images.sightings)
        told = {(one.kind, one.cable) for one in wrong}
        others = [one for one in parameter_faults(found) if (one.kind, one.cable) not in told]
        faults = [*of_map, *readings, *wrong, *others]
        first_map = start.map
    unused = hold_out(geometry, weighed, base, slack, found, first_map, images)
    verified, before = unused.verified(), unused.before(geometry)
    birge = unused.birge_ratio()
    larger = max(birge, 1.0) if known_room and math.isfinite(birge) else 1.0
    sigma_mm, with_more_mm = (
        larger * _three_sigma_mm(one, known_room) for one in (found, with_more_poses(found))
    )
    left_out = int((~unused.seen.used).sum())
    return Outcome(
        robot, found, method, faults, open_directions(found), verified, before, left_out,
        sigma_mm, with_more_mm, known_room, unused, birge,
    )  # fmt: skip


def _three_sigma_mm(found: Fit, known_room: bool) -> float:
    """Return what positions in the workspace are known to, the worst coordinate's rms."""
    geometry = found.geometry
    predicted = predicted_std(found, _grid(geometry), relative=not known_room)
    return 3e3 * float(np.sqrt((predicted[:, : geometry.coordinates] ** 2).mean(axis=0).max()))


def frame_of(outcome: Outcome) -> str:
    """Return in words what the identified coordinates are relative to."""
    if outcome.found.seen.measured.sum() >= _LEAST_POINTS:
        return "the room in which the platform was measured"
    if outcome.known_room:
        return "the room in which places of markers are known"
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
        frame=frame_of(outcome),
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


def wanted_mm(robot: Robot) -> float:
    """Return what is wanted of positions, by the longest side of the box around exit points."""
    assert robot.platform is not None
    frame_m = float(np.ptp(np.array(robot.platform.exit_points_m), axis=0).max())
    return _WANTED_mm_PER_m * frame_m
