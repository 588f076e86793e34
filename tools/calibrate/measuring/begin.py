"""What a run is asked for, looked at before anything moves."""

from __future__ import annotations

from pathlib import Path
from typing import Final, get_args

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.calibration.readings.data import MeasuredPoint, load_points
from cdpr_tools.calibrate.measuring.run import PoseSource
from cdpr_tools.errors import BadInputError

_METRES: Final = 300.0
"""By how many times nearer to the room's origin than targets are points may not all be."""


def points_of(path: Path, robot: Robot) -> list[MeasuredPoint]:
    """Return the points of a file; raises BadInputError where metres were typed, ProfileError."""
    points, platform = load_points(path), robot.platform
    assert platform is not None  # asked for by who has one
    box_m = np.abs([platform.workspace_min_m, platform.workspace_max_m])
    furthest_m = float(np.linalg.norm(box_m.max(axis=0)))
    at_m = float(np.abs([np.nan_to_num(point.position_m) for point in points]).max(initial=0.0))
    if 0.0 < at_m < furthest_m / _METRES:
        raise BadInputError(
            f"--points {path}: all within {1e3 * at_m:.3g} mm of the room's origin, where targets "
            f"are up to {1e3 * furthest_m:.0f} mm from it; were metres typed? allowed: mm"
        )
    return points


def check_points(path: Path, robot: Robot, poses: int | None) -> None:
    """Raise BadInputError for points of poses that will not be, and what `points_of` raises."""
    for point in points_of(path, robot):
        if poses is not None and point.pose >= poses:
            raise BadInputError(
                f"--points {path}: pose {point.pose + 1}; allowed: 1 to {poses} (--poses)"
            )


def source_of(robot: Robot, **given: bool) -> PoseSource:
    """Return what a run is to use besides lengths and tensions, by which options are given.

    Raises BadInputError.
    """
    asked = [source for source in get_args(PoseSource) if given.get(source)]
    if not asked and robot.platform is not None and len(robot.platform.controlled) == 6:
        return "camera"
    if asked == ["camera", "points"]:
        asked = ["camera"]  # points are taken besides
    if len(asked) != 1:
        raise BadInputError(
            "give one of --camera, --redundancy, --scanner and --points, or --camera with --points"
        )
    if asked[0] == "camera" and robot.platform is not None and len(robot.platform.controlled) < 6:
        raise BadInputError(
            f"--camera: {robot.profile} does not turn its platform about two axes, which is what "
            "tells where the camera sits on it; allowed: --scanner, --points, --redundancy"
        )
    chosen: PoseSource = asked[0]
    return chosen
