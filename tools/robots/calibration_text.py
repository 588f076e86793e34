"""Text on the calibration in force."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from cdpr_profiles import Robot
from cdpr_profiles.geometry_calibration import GeometryCalibration


def calibration_text(known: dict[str, Any]) -> str:
    """Return which calibration is in force and its accuracy, from `GeometryCalibration.summary`.

    Status, trials and recordings contain only this summary.
    """
    return "; ".join([_which(known), *_known_to(known)])


def calibration_lines(known: GeometryCalibration, robot: Robot) -> list[str]:
    """Return which calibration is in force, how good it is, and how to remove it."""
    summary = known.summary()
    lines = [_which(summary), *_known_to(summary)]
    if known.verified_mean_mm is not None and known.verified_worst_mm is not None:
        lines.append(
            f"verified on {known.verified_poses} poses: mean {known.verified_mean_mm:.2f} mm, "
            f"worst {known.verified_worst_mm:.2f} mm"
        )
    lines.append(f"remove it: cdpr calibrate undo {robot.reference}")
    return [lines[0], *(f"           {line}" for line in lines[1:])]


def _which(known: dict[str, Any]) -> str:
    date = datetime.fromisoformat(known["date"])
    return (
        f"calibration {known['version']} ({known['identity']}) of {date:%Y-%m-%d %H:%M} UTC is in "
        f"force, from {known['method']}, {known['poses']} poses"
    )


def _known_to(known: dict[str, Any]) -> list[str]:
    """Return the accuracy of positions, orientations and absolute positions."""
    against = f"positions are uncertain by {known['predicted_3_sigma_mm']:.2f} mm"
    if known["predicted_3_sigma_deg"] is not None:
        against += f" and orientations by {known['predicted_3_sigma_deg']:.3f} deg"
    lines = [f"{against} relative to each other (3 sigma, predicted)"]
    frame = f"in the frame of {known['frame']}"
    if known["absolute_3_sigma_mm"] is None:  # the calibration did not compute it
        return [*lines, frame]
    absolute = f"absolute positions are uncertain by {known['absolute_3_sigma_mm']:.1f} mm"
    if known["absolute_3_sigma_deg"] is not None:
        absolute += f" and absolute orientations by {known['absolute_3_sigma_deg']:.2f} deg"
    return [*lines, f"{absolute} (3 sigma, predicted) {frame}"]
