"""A verified calibration: its verdict as text and as JSON, and its file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

import numpy as np
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from cdpr_profiles import Robot
from cdpr_profiles.geometry_calibration import GeometryCalibration, geometry_sha256
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.faults import UNDECIDED, Fault
from cdpr_rt.calibration.fit import Fit
from cdpr_rt.calibration.marker_map import Coverage, listed
from cdpr_rt.calibration.noise import NoiseSeen
from cdpr_rt.calibration.parameters import DRUM
from cdpr_rt.calibration.verification import (
    LEAST_VERIFYING,
    MORE,
    SHARED_SCALE_STD,
    CalibrationChange,
    Honesty,
    OpenDirection,
    Predicted3Sigma,
    Unused,
    Verification,
    camera_table,
    parameter_table,
)

CalibrationMethod = Literal["points", "redundancy", "camera"]
_WANTED_mm_PER_m = 0.3
"""Wanted 3 sigma of positions per size of the frame: 1.5 mm for 5 m."""
_WANTED_deg = 0.15
"""Wanted 3 sigma of orientations, as for the targets of a trial."""
_MOST_OVER_WANTED = 3.0
"""Ratio of predicted to wanted error above which a calibration is not adopted."""
_MISFIT = 9.0
_DISHONEST = 3.0
"""Ratio of actual to predicted errors above which a calibration is not adopted."""
LEAST_POINTS = 3
"""Smallest number of measured poses that determine the robot's position in its room."""
_MOST_LEFT_OUT = 0.1
_MOST_POINTS_LEFT_OUT = 0.25


@dataclass(frozen=True)
class CalibrationFiles:
    """Files from which a calibration was made."""

    raw_data: str
    points: str = ""
    hand_eye: str = ""


@dataclass(frozen=True)
class Outcome:
    """A calibration: the fit, faults, undetermined directions, and errors at held-out poses."""

    robot: Robot
    found: Fit
    method: CalibrationMethod
    faults: list[Fault]
    open_directions: list[OpenDirection]
    verified: Verification
    before: Verification
    """Verification of the robot's file, with its initial lengths."""
    verified_left_out: int
    """Number of readings left out at the held-out poses, because the cable was slack or near a
    slip."""
    predicted: Predicted3Sigma
    """Predicted accuracy in the workspace; if nothing determines the room's frame, accuracy of
    positions relative to each other. It is increased if errors at held-out poses are larger than
    predicted."""
    with_more_3_sigma_mm: float
    """The same for positions, with ten more poses that are as informative as the present ones."""
    absolute: Predicted3Sigma
    """Predicted accuracy in the frame, including the uncertainty of the frame itself."""
    known_room: bool
    """Whether anything was measured in the room: points, or poses of markers."""
    shift_m: FloatArray
    """Mean displacement of absolute positions in the workspace, (k,)."""
    unused: Unused
    change: CalibrationChange
    """Change relative to the robot's file."""
    honesty: Honesty
    """Errors at held-out measured points, and predicted errors."""
    adopt: bool = False
    """Whether to adopt the calibration even if its changes are not significant."""
    wanted_mm: float | None = None
    """Largest allowed 3 sigma of positions; None means that errors must be less than with the
    file."""
    verifying_points_left_out: int = 0
    """Number of measured points at poses for verification that contradict all other readings."""
    noise: NoiseSeen | None = None
    """Noise estimated from the data; None with images."""
    cover: Coverage | None = None
    """Connection of the images by common markers; None without images."""

    @property
    def predicted_3_sigma_mm(self) -> float:
        """Predicted 3 sigma of positions."""
        return self.predicted.position_mm

    @property
    def differs_from_file(self) -> bool:
        """Whether the readings show a significant difference from the robot's file.

        Parameters change by more than noise, and the change has an effect. Either positions or
        orientations move by more than their uncertainty, or held-out poses are predicted much
        better.
        """
        if self.change.by_noise:
            return False
        return self.change.exceeds(self.predicted) or self.verified.much_better_than(self.before)

    @property
    def worse(self) -> bool:
        """Whether errors at held-out poses are larger than before by more than noise."""
        return self.verified.worse_than(self.before)

    @property
    def good(self) -> bool:
        """Whether there is no objection to adopting the calibration."""
        return not self.objections()

    def objections(self) -> list[str]:
        """Return the objections to adopting the calibration, each with the action to take."""
        found, found_wrong = self.found, []
        if not found.converged:
            found_wrong.append(
                "the fit did not converge: its start is too far off, or the data contradict "
                "each other"
            )
        if found.variance_factor > _MISFIT:
            found_wrong.append(
                f"lengths disagree {math.sqrt(found.variance_factor):.1f} times as much as "
                "expected: a part that should be fixed moves (an anchor, a pulley, a frame)"
            )
        found_wrong += [
            fault.text
            for fault in self.faults
            if fault.kind == "points" or fault.text.startswith(UNDECIDED)
        ]
        if found.corner_factor > _MISFIT:
            found_wrong.append(
                f"corners fit {math.sqrt(found.corner_factor):.1f} times worse together with "
                "the cables than alone: the camera moved on the platform, or the platform "
                "moved while images were taken"
            )
        left_out = [fault for fault in self.faults if fault.kind in ("outlier", "slack", "jump")]
        if len(left_out) > _MOST_LEFT_OUT * found.seen.used.size:
            found_wrong.append(f"{len(left_out)} readings contradict the others: measure again")
        found_wrong += self._too_uncertain()
        if self.worse and (self.differs_from_file or self.adopt):
            found_wrong.append(
                "at the poses kept for verification the errors are significantly larger than with "
                "the robot's file: take more poses, further apart"
            )
        if self.method == "camera" and self.verified.kind == "none":
            found_wrong.append(
                "fewer than three held-out poses show two markers of the map, so the "
                "calibration is not verified: take more poses, or lay out more sheets"
            )
        return found_wrong + self._points() + self._islands() + self._impossible()

    def _too_uncertain(self) -> list[str]:
        """Return objections if the predicted error is large, or the actual error much larger.

        Errors at poses that were measured show whether a calibration is better than the file. Then
        only the user decides how accurate it must be; otherwise the prediction must be small.
        """
        most_mm, known_mm = self.wanted_mm, self.predicted_3_sigma_mm
        if any(fault.kind == "points" for fault in self.faults):
            return []
        if math.isfinite(self.honesty.ratio) and self.honesty.ratio > _DISHONEST:
            return [
                f"errors at the poses kept for verification are {self.honesty.ratio:.1f} times as "
                "large as predicted: something moves or bends that the fit assumes to be fixed, or "
                "the measured points are less accurate than sigma_mm says"
            ]
        if most_mm is None:
            most_mm = _MOST_OVER_WANTED * wanted_mm(self.robot)
            if len(self.verified.errors_m) >= LEAST_VERIFYING and self._better:
                # held-out poses may lie close together: elsewhere it must be no worse than the file
                most_mm = max(most_mm, 3.0 * self.before.mean_mm)
        if known_mm <= most_mm:
            return []
        how = "measure points, or state how well the exit points of the robot's file are known"
        if self.wanted_mm is not None:
            how = "measure more poses, further apart, or more accurately, or raise --wanted-mm"
        return [
            f"positions would be uncertain by {known_mm:.1f} mm (3 sigma, predicted; allowed: "
            f"{most_mm:.1f} mm): {how}" + (" (--known-mm)" if self.wanted_mm is None else "")
        ]

    @property
    def _better(self) -> bool:
        """Whether the calibration predicts held-out poses better than the robot's file does."""
        return self.verified.mean_mm < self.before.mean_mm and not self.worse

    def _points(self) -> list[str]:
        """Return objections to the measured points: too many are wrong, or too few verify."""
        kinds = [fault.kind for fault in self.faults]
        wrong, used = kinds.count("point"), int(self.found.seen.measured.sum())
        objections = []
        if wrong > _MOST_POINTS_LEFT_OUT * (wrong + used):
            objections.append(
                f"{wrong} of {wrong + used} measured points contradict the others: measure again"
            )
        verifying = len(self.verified.errors_m)
        by_points = self.method == "points" or self.verifying_points_left_out > 0
        if by_points and "points" not in kinds and verifying < LEAST_VERIFYING:
            objections.append(
                f"not verified: the position was measured at {verifying} of the held-out poses, "
                f"but {LEAST_VERIFYING} are needed: measure all coordinates at "
                f"{2 * LEAST_VERIFYING} poses or more, far apart"
            )
        return objections

    def _islands(self) -> list[str]:
        """Return the markers that no image connects with the others, thesis, section 3.7.3.

        The map leaves these markers out. Poses at which the camera saw no other markers then have
        no image.
        """
        if self.cover is None or not self.cover.apart:
            return []
        return [
            f"markers fall into {1 + len(self.cover.apart)} islands that no image connects: "
            f"the map contains only the markers with {listed(self.cover.islands[0])}"
        ]

    def insignificance(self) -> str | None:
        """Return the reason why the change is not significant; None if it is significant."""
        change = self.change
        if self.differs_from_file:
            return None
        moved = f"positions would move by {1e3 * change.moved_m:.2f} mm (root mean square)"
        if change.by_noise:
            return (
                "not significant: noise alone causes changes of this size in "
                f"{100.0 * change.chance:.0f} % of cases; {moved}, and the robot's file may "
                "already be right"
            )
        return (
            f"not significant: {moved}, less than their uncertainty, and held-out poses do "
            "not improve much; the robot's file may already be right"
        )

    def _impossible(self) -> list[str]:
        """Return texts about identified values that are impossible for this robot."""
        try:
            faults = calibration_of(self, 1, CalibrationFiles(""), simulated=False).faults(
                self.robot
            )
        except ValidationError as error:
            return [f"the result is not a possible geometry: {error.errors()[0]['msg']}"]
        what = "is the robot's file wrong, or was pose 1 not home?"
        return [f"{key}: {problem}: {what}" for key, problem in faults]

    def advice(self) -> str:
        """Return the benefit of more poses as text."""
        return (
            f"{MORE} more poses would improve {self.predicted_3_sigma_mm:.2f} mm to "
            f"{self.with_more_3_sigma_mm:.2f} mm (3 sigma, predicted)"
        )

    @property
    def gain_of_more(self) -> float:
        """Relative reduction of the predicted error by ten more poses."""
        return 1.0 - self.with_more_3_sigma_mm / max(self.predicted_3_sigma_mm, 1e-9)

    def verdict(self) -> list[str]:
        """Return the calibration as text."""
        against = self.objections()
        lines = [fault.text for fault in self.faults if fault.text not in against]
        lines += [f"NOT GOOD: {text}" for text in against]
        if (little := self.insignificance()) and not against:
            lines.append(little)
        if not against:
            lines.append(self.accuracy())
            lines.append(self.frame())
        lines += self.proof()
        lines += [] if self.cover is None else self.cover.lines()
        return lines + [f"not known: {one.what}; {one.advice}" for one in self.open_directions]

    def accuracy(self) -> str:
        """Return the accuracy of positions and orientations as text, and whether it suffices."""
        wanted, known = self.wanted_mm or wanted_mm(self.robot), self.predicted
        relative = "" if self.known_room else "  relative to each other"
        text = f"positions are uncertain by {known.position_mm:.2f} mm{relative}"
        enough = known.position_mm <= wanted
        if known.orientation_deg is not None:
            text += f", orientations by {known.orientation_deg:.3f} deg relative to each other"
            enough &= known.orientation_deg <= _WANTED_deg
        text += " (3 sigma, predicted)"
        if enough:
            return f"{text}: good"
        turned = "" if known.orientation_deg is None else f" and {_WANTED_deg:.2f} deg"
        return f"{text}, {wanted:.2f} mm{turned} wanted: {self.advice()}"

    def frame(self) -> str:
        """Return the shift of absolute positions, and their accuracy, as text."""
        axes = ", ".join(
            f"{1e3 * moved:+.2f} mm in {axis}"
            for axis, moved in zip("xyz", self.shift_m.tolist(), strict=False)
        )
        text = (
            f"absolute positions change by {axes} on average, and are uncertain by "
            f"{self.absolute.position_mm:.1f} mm"
        )
        if (turned := self.absolute.orientation_deg) is not None:
            text += f", absolute orientations by {turned:.2f} deg"
        text += f" (3 sigma, predicted) in the frame of {frame_of(self)}"
        if self.known_room:
            return (
                f"{text}, if the scale of the measurements in the room is right to "
                f"{300.0 * SHARED_SCALE_STD:.1f} % (3 sigma); the other figures do not include "
                "errors that all points share (scale, origin, axes)"
            )
        return (
            f"{text}: the measurements do not determine where the robot is in its room "
            "(measured points or known markers do)"
        )

    def proof(self) -> list[str]:
        """Return the errors at the poses that verify the calibration, as text."""
        lines = [] if self.noise is None else self.noise.lines()
        if self.verified.errors_m.size:
            lines.append(
                f"verified on {len(self.verified.errors_m)} held-out poses: mean "
                f"{self.verified.mean_mm:.2f} mm, worst {self.verified.worst_mm:.2f} mm off "
                f"{self.verified.reference} (with the robot's file: {self.before.mean_mm:.2f} "
                "and "
                f"{self.before.worst_mm:.2f})"
            )
        if math.isfinite(self.honesty.ratio):
            lines.append(
                f"a coordinate there is off by {self.honesty.actual_mm:.2f} mm rms, "
                f"{self.honesty.predicted_mm:.2f} mm were predicted (standard deviation)"
            )
        if count := self.verifying_points_left_out:
            lines.append(
                f"the verification leaves out {count} of the measured points at its poses, "
                "because they contradict all other readings"
            )
        if math.isfinite(self.verified.scale.factor):
            lines.append(
                f"distances between them are {self.verified.scale.text} times those from cable "
                f"lengths (± is 3 sigma; with the robot's file: {self.before.scale.text})"
            )
        if self.verified.turn_errors_rad.size:
            lines.append(
                f"orientations there: mean {self.verified.mean_deg:.2f} deg off (before: "
                f"{self.before.mean_deg:.2f})"
            )
        lines.append(
            f"lengths at held-out poses contradict each other by "
            f"{1e3 * self.verified.residual_m:.2f} mm rms (before: "
            f"{1e3 * self.before.residual_m:.2f})"
        )
        if self.verified_left_out:
            lines.append(
                f"{self.verified_left_out} readings at held-out poses are of slack cables, or "
                "next to a slip, and are not used"
            )
        return lines

    def as_json(self) -> dict[str, Any]:
        """Return the whole outcome as JSON."""
        return {
            "good": self.good,
            "verdict": self.verdict(),
            "objections": self.objections(),
            "change": {
                "significant": self.differs_from_file,
                "chance": self.change.chance,
                "chi_squared": self.change.chi_squared,
                "parameters_determined": self.change.degrees_of_freedom,
                "positions_move_by_mm": 1e3 * self.change.moved_m,
            },
            "poses": self.found.seen.poses,
            "converged": self.found.converged,
            "variance_factor": self.found.variance_factor,
            "predicted_3_sigma_mm": self.predicted_3_sigma_mm,
            "predicted_3_sigma_deg": self.predicted.orientation_deg,
            "absolute_3_sigma_mm": self.absolute.position_mm,
            "absolute_3_sigma_deg": self.absolute.orientation_deg,
            "absolute_shift_mm": (1e3 * self.shift_m).tolist(),
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
                "points_left_out": self.verifying_points_left_out,
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
                "birge_ratio": number_or_none(self.honesty.ratio),
                "coordinate_error_rms_mm": number_or_none(self.honesty.actual_mm),
                "coordinate_error_predicted_mm": number_or_none(self.honesty.predicted_mm),
                "length_residual_mm": 1e3 * self.verified.residual_m,
                "length_residual_before_mm": 1e3 * self.before.residual_m,
            },
            "noise": None if self.noise is None else self.noise.as_json(),
            "camera": camera_table(self.found),
            "coverage": None if self.cover is None else self.cover.as_json(),
        }


def number_or_none(value: float) -> float | None:
    """Return a number for JSON, which has no nan."""
    return value if math.isfinite(value) else None


def frame_of(outcome: Outcome) -> str:
    """Return the frame of the identified coordinates, as text."""
    if outcome.found.seen.measured.sum() >= LEAST_POINTS:
        return "the room, given by measured points"
    if outcome.known_room:
        return "the room, given by known places of markers"
    return "the robot's file, given by its exit points and home"


def calibration_of(
    outcome: Outcome,
    version: int,
    files: CalibrationFiles,
    *,
    simulated: bool,
    distrusted_before: str = "",
) -> GeometryCalibration:
    """Return the file of a calibration; raises pydantic's ValidationError for invalid values."""
    robot, found = outcome.robot, outcome.found
    platform = robot.platform
    assert platform is not None  # the fit needs a platform
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
        predicted_3_sigma_deg=outcome.predicted.orientation_deg,
        absolute_3_sigma_mm=outcome.absolute.position_mm,
        absolute_3_sigma_deg=outcome.absolute.orientation_deg,
        verified_poses=verified.poses,
        verified_mean_mm=number_or_none(verified.mean_mm),
        verified_worst_mm=number_or_none(verified.worst_mm),
        raw_data=files.raw_data,
        points_file=files.points,
        hand_eye_file=files.hand_eye,
        identified=geometry.identified,
        known_exit_m=geometry.knowledge.exit_m,
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
    """Return the wanted accuracy of positions, by the longest side of the exit points' box."""
    assert robot.platform is not None
    frame_m = float(np.ptp(np.array(robot.platform.exit_points_m), axis=0).max())
    return _WANTED_mm_PER_m * frame_m
