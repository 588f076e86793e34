"""Compare the calibration of a simulated robot with its scanner and with the truth.

The calibration uses neither; they are read after it has finished.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.camera_geometry import logarithms
from cdpr_rt.calibration.fit import Fit, locate
from cdpr_rt.calibration.marker_map import best_fit
from cdpr_rt.calibration.outcome import Outcome, number_or_none
from cdpr_rt.calibration.parameters import DRUM, OFFSET, CableGeometry
from cdpr_rt.calibration.verification import Scale, relative_errors
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.calibrate.rig import OutsidePoses
from cdpr_tools.composition.robot_physics import TrueGeometry, true_geometry


@dataclass(frozen=True)
class PoseErrors:
    """Errors of held-out poses, computed from lengths alone."""

    position_m: FloatArray
    """(M, 3)"""
    turn_rad: FloatArray
    """(M, 3)"""
    scale: Scale
    """Ratio of the distances between these poses to those computed from lengths."""

    @classmethod
    def from_first(cls, poses: FloatArray, others: FloatArray) -> PoseErrors:
        """Return the errors of poses (M + 1, 4, 3) relative to the first pose."""
        scale = Scale.of(poses[1:, 0], others[1:, 0])
        return cls(*relative_errors(poses, others), scale)

    @classmethod
    def absolute(cls, poses: FloatArray, others: FloatArray) -> PoseErrors:
        """Return the errors of poses (M, 4, 3) in the frame that both share."""
        turned = logarithms(poses[:, 1:] @ np.swapaxes(others[:, 1:], 1, 2))
        return cls(poses[:, 0] - others[:, 0], turned, Scale.of(poses[:, 0], others[:, 0]))

    def as_json(self) -> dict[str, Any]:
        """Return the errors for JSON."""
        far_mm = 1e3 * np.linalg.norm(self.position_m, axis=1)
        turned_deg = np.degrees(np.linalg.norm(self.turn_rad, axis=1))
        return {
            "poses": len(far_mm),
            "mean_position_error_mm": float(far_mm.mean()),
            "worst_position_error_mm": float(far_mm.max()),
            "mean_orientation_error_deg": float(turned_deg.mean()),
            "worst_orientation_error_deg": float(turned_deg.max()),
            "scale_factor": number_or_none(self.scale.factor),
            "scale_factor_std": number_or_none(self.scale.std),
        }


@dataclass(frozen=True)
class TruthComparison:
    """Errors of a calibration against scanner and truth, on held-out poses."""

    scanner: PoseErrors
    """Errors against the scanner, relative to the first pose."""
    scanner_before: PoseErrors
    """The same with the geometry of the robot's file."""
    scanner_alone: tuple[float, float]
    """Average share of the mean errors that the scanner's own errors cause, m and rad."""
    in_marker_frame: PoseErrors | None
    """Errors against the scanner, in the frame of a marker."""
    marker: int | None
    truth: PoseErrors
    absolute: PoseErrors
    """Errors against the truth, in the frame of the robot's file."""
    absolute_before: PoseErrors
    index: IntArray
    """Numbers of the poses, counted from 0."""
    places_m: FloatArray
    """True positions of the poses of `truth`, (M, 3)."""
    parameters: list[dict[str, Any]]
    """Error of each identified parameter; exit points after the best fit if the room is unknown."""

    def verification(self) -> dict[str, Any]:
        """Return the comparison with the scanner, for JSON."""
        before = self.scanner_before.as_json()
        frame = None
        if self.in_marker_frame is not None:
            frame = {"marker": self.marker, **self.in_marker_frame.as_json()}
        return {
            "reference": "scanner",
            "by": "the simulated scanner, relative to the first pose",
            **self.scanner.as_json(),
            "of_which_scanner_mm": 1e3 * self.scanner_alone[0],
            "of_which_scanner_deg": float(np.degrees(self.scanner_alone[1])),
            "mean_position_error_before_mm": before["mean_position_error_mm"],
            "worst_position_error_before_mm": before["worst_position_error_mm"],
            "mean_orientation_error_before_deg": before["mean_orientation_error_deg"],
            "scale_factor_before": before["scale_factor"],
            "in_marker_frame": frame,
        }

    def lines(self) -> list[str]:
        """Return the errors as lines of text."""
        shown = (
            ("the scanner, relative to the first pose", self.scanner),
            ("the same with the robot's file", self.scanner_before),
            (f"the scanner, in the frame of marker {self.marker}", self.in_marker_frame),
            ("truth, relative to the first pose", self.truth),
            ("truth, absolute, with the robot's file", self.absolute),
            ("truth, absolute, with the robot's file", self.absolute_before),
        )
        lines = []
        for what, errors in shown:
            if errors is not None:
                figures = errors.as_json()
                lines.append(
                    f"poses that the fit has not used, against {what}: mean "
                    f"{figures['mean_position_error_mm']:.2f} mm and "
                    f"{figures['mean_orientation_error_deg']:.3f} deg, worst "
                    f"{figures['worst_position_error_mm']:.2f} mm and "
                    f"{figures['worst_orientation_error_deg']:.3f} deg; distances between them are "
                    f"{errors.scale.text} times those from cable lengths"
                )
        far_mm, turned_deg = 1e3 * self.scanner_alone[0], np.degrees(self.scanner_alone[1])
        lines.insert(
            1,
            f"on average, {far_mm:.2f} mm and {turned_deg:.3f} deg of that are errors of the "
            "scanner itself",
        )
        return lines

    def true_errors(self) -> dict[str, Any]:
        """Return the errors against the truth, for JSON."""
        return {
            **self.truth.as_json(),
            "absolute": self.absolute.as_json(),
            "absolute_before": self.absolute_before.as_json(),
            "parameters": self.parameters,
        }


def compare_with_truth(
    robot: Robot, plant: Path | None, outcome: Outcome, outside: OutsidePoses
) -> TruthComparison:
    """Return a calibration's errors; raises BadInputError, ProfileError for a bad plant file."""
    unused, part = outcome.unused, outcome.unused.part
    measured = np.array([pose.position_m is not None for pose in outside.poses])
    some = measured[unused.index]
    index = np.append(0, unused.index[some])
    poses, before = (
        np.concatenate(
            [
                locate(geometry, part.seen.some(np.arange(1)).without_jumps(part.jumps_m)).poses,
                locate(geometry, unused.seen.without_jumps(part.jumps_m)).poses[some],
            ]
        )
        for geometry in (part.geometry, CableGeometry.of(robot))
    )
    scanner, true = _outside(outside, index)
    marker, frame = _marker_frame(plant, part, poses, scanner)
    return TruthComparison(
        PoseErrors.from_first(poses, scanner),
        PoseErrors.from_first(before, scanner),
        _scanner_alone(outside, index, scanner),
        frame,
        marker,
        PoseErrors.from_first(poses, true),
        PoseErrors.absolute(poses[1:], true[1:]),
        PoseErrors.absolute(before[1:], true[1:]),
        index[1:],
        true[1:, 0],
        _parameters(outcome, true_geometry(robot, plant)),
    )


def _outside(outside: OutsidePoses, index: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the scanned and the true poses, (M, 4, 3) each."""
    some = [outside.poses[j] for j in index]
    scanner = [[one.position_m, *(one.rotation or ())] for one in some]
    true = [[one.true_position_m, *one.true_rotation] for one in some]
    return np.array(scanner, float), np.array(true, float)


def _scanner_alone(
    outside: OutsidePoses, index: IntArray, poses: FloatArray
) -> tuple[float, float]:
    """Return the mean errors of position and angle that the scanner's noise alone would cause.

    Errors are relative to the first pose. The length of a normal vector of standard deviation s is
    s sqrt(8/pi) on average. An angle error at the first pose acts on the others in proportion to
    their distance.
    """
    stds = [(one.position_std_m or 0.0, one.rotation_std_rad or 0.0) for one in outside.poses]
    std_m, std_rad = np.array(stds)[index].T
    away_m = np.linalg.norm(poses[1:, 0] - poses[0, 0], axis=1)
    variance = std_m[0] ** 2 + std_m[1:] ** 2 + (2.0 / 3.0) * (away_m * std_rad[0]) ** 2
    turned = np.hypot(std_rad[0], std_rad[1:])
    mean = float(np.sqrt(8.0 / np.pi))
    return mean * float(np.sqrt(variance).mean()), mean * float(turned.mean())


def _marker_frame(
    plant: Path | None, part: Fit, poses: FloatArray, others: FloatArray
) -> tuple[int | None, PoseErrors | None]:
    """Return the best known marker, and the errors of poses in its frame, from its true pose."""
    camera = part.camera
    if camera is None:
        return None, None
    from cdpr_sim_bus.camera.scene import build_scene  # noqa: PLC0415  # needs an extra

    of_markers = part.camera_std[camera.first_marker :].reshape(-1, 6)
    k = int(np.linalg.norm(of_markers, axis=1).argmin())
    scene = RobotPlant() if plant is None else RobotPlant.load_file(plant)
    sheets = {sheet.name: sheet for sheet in build_scene(scene.camera)}
    sheet = sheets[str(camera.ids[k])]
    fitted = np.vstack([camera.marker_position_m[k], camera.marker_rotation[k]])
    known = np.vstack([sheet.place(0), sheet.rotation])
    from_marker = np.concatenate([fitted[None], poses[1:]])
    return camera.ids[k], PoseErrors.from_first(
        from_marker, np.concatenate([known[None], others[1:]])
    )


def _parameters(outcome: Outcome, true: TrueGeometry) -> list[dict[str, Any]]:
    """Return the errors of identified parameters, with their predicted standard deviations."""
    found = outcome.found
    geometry, std = found.geometry, found.std
    exits = geometry.kernel_geometry()[:3].T
    if not outcome.known_room:  # the data do not determine the frame of the room
        turn, shift = best_fit(exits, true.exit_points_m)
        exits = exits @ turn.T + shift
    rows: list[dict[str, Any]] = []
    names, place = geometry.names(), 0
    for i in range(geometry.n):
        for row in geometry.rows:
            error = None
            if row < OFFSET:
                error = 1e3 * float(exits[i, row] - true.exit_points_m[i, row])
            elif row == DRUM:
                error = 100.0 * float(geometry.cable[i, DRUM] - true.drum_errors[i])
            if error is not None:
                scale = 100.0 if row == DRUM else 1e3
                rows.append(_row(names[place], scale, error, float(std[place])))
            place += 1
    if geometry.shared:
        error = 100.0 * (geometry.elongation - true.elongation_error)
        rows.append(_row(names[place], 100.0, error, float(std[place])))
    return rows


def _row(name: str, scale: float, error: float, std: float) -> dict[str, Any]:
    return {
        "name": name,
        "unit": "%" if scale == 100.0 else "mm",
        "error": error,
        "std": scale * std,
    }
