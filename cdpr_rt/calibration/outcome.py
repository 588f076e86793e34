"""A calibration that has verified itself: its verdict in words, in JSON and as a file."""

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
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera.camera_faults import UNDECIDED
from cdpr_rt.calibration.estimation.faults import Fault
from cdpr_rt.calibration.estimation.fit import Fit
from cdpr_rt.calibration.estimation.parameters import DRUM
from cdpr_rt.calibration.markers.coverage import Coverage, listed
from cdpr_rt.calibration.verification.held_out import Unused
from cdpr_rt.calibration.verification.more_poses import MORE
from cdpr_rt.calibration.verification.verdict import (
    CalibrationChange,
    OpenDirection,
    camera_table,
    parameter_table,
)
from cdpr_rt.calibration.verification.verification import Verification

CalibrationMethod = Literal["points", "redundancy", "camera"]
_WANTED_mm_PER_m = 0.3
"""1.5 mm for 5 m of frame, 3 sigma."""
_MOST_OVER_WANTED = 3.0
"""Ratio of predicted to wanted error above which a calibration is not adopted."""
_MISFIT = 9.0
LEAST_POINTS = 3
"""Poses that have to be measured to tell where the robot is in its room."""
_MOST_LEFT_OUT = 0.1


@dataclass(frozen=True)
class Outcome:
    """A calibration: the fit, what was wrong, what stays open, and how it did on other poses."""

    robot: Robot
    found: Fit
    method: CalibrationMethod
    faults: list[Fault]
    open_directions: list[OpenDirection]
    verified: Verification
    before: Verification
    """Verification of the robot's file, whose lengths are those at the start."""
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
    change: CalibrationChange
    """Change of the robot's file."""
    birge_ratio: float
    """Ratio of errors at unused measured points to predicted ones (Birge); nan without points."""
    adopt: bool = False
    """Whether it is to be taken over even where its changes are not significant."""
    cover: Coverage | None = None
    """Connection of the images; None without any."""

    @property
    def worse(self) -> bool:
        """Whether errors at poses held out are larger than before, and not by noise alone."""
        return self.verified.worse_than(self.before)

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
        if self.worse and (self.change.significant or self.adopt):
            told.append(
                "poses that the fit had not seen are told worse than by the robot's file, and not "
                "by noise alone: take more poses, further apart"
            )
        if self.method == "camera" and self.verified.kind == "none":
            told.append(
                "no three of the poses not used show two markers of the map, so nothing verifies "
                "it: take more poses, or lay more sheets"
            )
        return told + self._islands() + self._impossible()

    def _islands(self) -> list[str]:
        """Return which markers no image connects with the others, as the thesis' 3.7.3 looks for.

        The map leaves them out, and poses of which only they were seen have no image then.
        """
        if self.cover is None or not self.cover.apart:
            return []
        return [
            f"markers fall into {1 + len(self.cover.apart)} islands that no image connects: the "
            f"map leaves out all that are not with {listed(self.cover.islands[0])}"
        ]

    def insignificance(self) -> str | None:
        """Return why nothing is to be changed though nothing is wrong; None where it is."""
        change = self.change
        if change.significant:
            return None
        return (
            f"not significant: noise alone changes parameters as much as this in "
            f"{100.0 * change.chance:.0f} % of cases; positions would move by "
            f"{1e3 * change.moved_m:.2f} mm (root mean square), and the robot's file may be right "
            "already"
        )

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
        """Relative reduction of the predicted error by ten more poses."""
        return 1.0 - self.with_more_3_sigma_mm / max(self.predicted_3_sigma_mm, 1e-9)

    def verdict(self) -> list[str]:
        """Return the calibration in words."""
        against = self.objections()
        lines = [fault.text for fault in self.faults if fault.text not in against]
        lines += [f"NOT GOOD: {text}" for text in against]
        if (little := self.insignificance()) and not against:
            lines.append(little)
        wanted = wanted_mm(self.robot)
        if not against:
            enough = self.predicted_3_sigma_mm <= wanted
            lines.append(
                f"positions are known to {self.predicted_3_sigma_mm:.2f} mm (3 sigma, predicted)"
                + (": good" if enough else f", {wanted:.2f} mm wanted: {self.advice()}")
            )
        lines += self.proof()
        lines += [] if self.cover is None else self.cover.lines()
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
        if math.isfinite(self.verified.scale.factor):
            lines.append(
                f"distances between them are {self.verified.scale.text} times those that lengths "
                f"tell (1 sigma; by the robot's file: {self.before.scale.text})"
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

    def as_json(self) -> dict[str, Any]:
        """Return everything for JSON."""
        return {
            "good": self.good,
            "verdict": self.verdict(),
            "objections": self.objections(),
            "change": {
                "significant": self.change.significant,
                "chance": self.change.chance,
                "chi_squared": self.change.chi_squared,
                "parameters_told": self.change.degrees_of_freedom,
                "positions_move_by_mm": 1e3 * self.change.moved_m,
            },
            "poses": self.found.seen.poses,
            "converged": self.found.converged,
            "variance_factor": self.found.variance_factor,
            "predicted_3_sigma_mm": self.predicted_3_sigma_mm,
            "with_10_more_poses_3_sigma_mm": self.with_more_3_sigma_mm,
            "frame": frame_of(self),
            "corner_factor": self.found.corner_factor,
            "parameters": parameter_table(self.found),
            "faults": [fault.as_json() for fault in self.faults],
            "open": [
                {"what": one.what, "advice": one.advice, "share": one.share}
                for one in self.open_directions
            ],
            "verification": {
                "poses": self.verified.poses,
                "readings_left_out": self.verified_left_out,
                "mean_position_error_mm": number_or_none(self.verified.mean_mm),
                "worst_position_error_mm": number_or_none(self.verified.worst_mm),
                "mean_position_error_before_mm": number_or_none(self.before.mean_mm),
                "mean_orientation_error_deg": number_or_none(self.verified.mean_deg),
                "mean_orientation_error_before_deg": number_or_none(self.before.mean_deg),
                "scale_factor": number_or_none(self.verified.scale.factor),
                "scale_factor_std": number_or_none(self.verified.scale.std),
                "scale_factor_before": number_or_none(self.before.scale.factor),
                "reference": self.verified.kind,
                "by": self.verified.reference,
                "birge_ratio": number_or_none(self.birge_ratio),
                "length_residual_mm": 1e3 * self.verified.residual_m,
                "length_residual_before_mm": 1e3 * self.before.residual_m,
            },
            "camera": camera_table(self.found),
            "coverage": None if self.cover is None else self.cover.as_json(),
        }


def number_or_none(value: float) -> float | None:
    """Return a number for JSON, which has no nan."""
    return value if math.isfinite(value) else None


def frame_of(outcome: Outcome) -> str:
    """Return in words what the identified coordinates are relative to."""
    if outcome.found.seen.measured.sum() >= LEAST_POINTS:
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
        verified_mean_mm=number_or_none(verified.mean_mm),
        verified_worst_mm=number_or_none(verified.worst_mm),
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


def wanted_mm(robot: Robot) -> float:
    """Return what is wanted of positions, by the longest side of the box around exit points."""
    assert robot.platform is not None
    frame_m = float(np.ptp(np.array(robot.platform.exit_points_m), axis=0).max())
    return _WANTED_mm_PER_m * frame_m
