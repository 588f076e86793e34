"""Options that several commands of `cdpr calibrate` share, and their evaluation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdpr_profiles import Robot

if TYPE_CHECKING:
    from cdpr_rt.calibration.estimation.parameters import CableGeometry
    from cdpr_rt.calibration.readings.camera_data import HandEye

PointsOption = Annotated[
    Path | None,
    typer.Option(
        help="Measured positions, CSV with the columns pose (from 1), x_mm, y_mm, z_mm, sigma_mm.",
        metavar="FILE",
    ),
]
IdentifyOption = Annotated[
    str | None,
    typer.Option(
        help="What is identified, with commas between: exit, offset, drum, elongation (these by "
        "default), anchor, pulley.",
        metavar="LIST",
    ),
]
KnownMmOption = Annotated[
    float | None,
    typer.Option(
        "--known-mm", min=0.1, max=500.0,
        help="Standard deviation with which the exit points of the robot's file are known; 50 by "
        "default, as with a tape.",
    ),
]  # fmt: skip
CalibrationPlantOption = Annotated[
    Path | None,
    typer.Option(help="Plant file: the truth about robot, cables, motors and camera."),
]
DryRunOption = Annotated[
    bool, typer.Option("--dry-run", help="Tell what is found; take nothing over.")
]
AdoptOption = Annotated[
    bool,
    typer.Option("--adopt", help="Take it over even if its changes are not significant."),
]
PosesOption = Annotated[
    str | None,
    typer.Option(
        metavar="N|FILE",
        help="How many poses, home among them, or a list as `cdpr poses` writes it; else up to "
        "100, while more bring something.",
    ),
]
ScannerOption = Annotated[
    bool, typer.Option("--scanner", help="With poses that the simulated scanner measures.")
]
OutDirOption = Annotated[
    Path | None,
    typer.Option(
        "--out", help="Folder for data, images, result and report; else out/calibrate-ROBOT."
    ),
]
CameraUrlOption = Annotated[
    str | None,
    typer.Option("--camera", help="Take images with it, such as opencv:0.", metavar="CAMERA"),
]
IntrinsicsOption = Annotated[
    Path | None, typer.Option(help="Of the camera, for the first pose.", metavar="FILE")
]
MarkersOption = Annotated[
    Path | None, typer.Option(help="Sizes of the sheets, for the first pose.", metavar="FILE")
]


def hand_eye_of(path: Path | None) -> HandEye | None:
    """Return what `--hand-eye` says; raises ProfileError."""
    from cdpr_rt.calibration.readings.camera_data import HandEye  # noqa: PLC0415  # slow to load

    return None if path is None else HandEye.load_file(path)


def geometry_of(robot: Robot, identify: str | None, known_mm: float | None) -> CableGeometry:
    """Return what is identified of a robot; raises InvalidRequestError for an unknown kind."""
    from cdpr_rt.calibration.estimation.parameters import (  # noqa: PLC0415  # slow to load
        USUAL,
        CableGeometry,
        Knowledge,
    )

    known = Knowledge() if known_mm is None else Knowledge(exit_m=1e-3 * known_mm)
    kinds = USUAL if identify is None else tuple(part.strip() for part in identify.split(","))
    return CableGeometry.of(robot, kinds, known)
