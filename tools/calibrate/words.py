"""Text on the calibration in force."""

from __future__ import annotations

from cdpr_profiles import Robot
from cdpr_profiles.calibration.geometry import GeometryCalibration


def geometry_note(robot: Robot) -> str:
    """Return by which calibration a robot runs, "" where its file counts."""
    known = robot.calibration
    return "" if known is None else f"geometry {calibration_lines(known, robot)[0]}"


def calibration_lines(known: GeometryCalibration, robot: Robot) -> list[str]:
    """Return which calibration is in force and how good it is."""
    lines = [
        f"calibrated {known.date:%Y-%m-%d %H:%M} UTC, version {known.version} ({known.identity}), "
        f"from {known.method}, {known.poses} poses",
        f"           in the frame of {known.frame}",
        f"           positions known to {known.predicted_3_sigma_mm:.2f} mm (3 sigma, predicted)",
    ]
    if known.verified_mean_mm is not None and known.verified_worst_mm is not None:
        lines.append(
            f"           verified on {known.verified_poses} poses: mean "
            f"{known.verified_mean_mm:.2f} mm, worst {known.verified_worst_mm:.2f} mm"
        )
    return [*lines, f"           taken back by: cdpr calibrate undo {robot.reference}"]
