"""What a run is asked for, looked at before anything moves."""

from __future__ import annotations

from pathlib import Path

from cdpr_profiles import Robot
from cdpr_rt.calibration.readings.data import load_points
from cdpr_tools.calibrate.measuring.run import PoseSource
from cdpr_tools.errors import BadInputError


def check_points(path: Path, poses: int | None) -> None:
    """Raise BadInputError for points of poses that will not be, ProfileError for no such file."""
    for point in load_points(path):
        if poses is not None and point.pose >= poses:
            raise BadInputError(
                f"--points {path}: pose {point.pose + 1}; allowed: 1 to {poses} (--poses)"
            )


def source_of(robot: Robot, asked: list[PoseSource]) -> PoseSource:
    """Return what a run is to use besides lengths and tensions; raises BadInputError."""
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
    return asked[0]
