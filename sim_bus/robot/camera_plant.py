"""The plant file of a simulated camera: the truth about lens, sensor, mount, light and markers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field
from typing_extensions import override

from cdpr_profiles.bounded_input import read_toml
from cdpr_profiles.reader import Profile, validated
from cdpr_sim_bus.plant_file import PlantFile

_Length_m = Annotated[float, Field(ge=-1000.0, le=1000.0)]
_Angle_deg = Annotated[float, Field(ge=-360.0, le=360.0)]
Vector = Annotated[tuple[_Length_m, ...], Field(min_length=3, max_length=3)]
Turn = Annotated[tuple[_Angle_deg, ...], Field(min_length=3, max_length=3)]
_Size_m = Annotated[float, Field(ge=0.001, le=10.0)]
_Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Id = Annotated[int, Field(ge=0, lt=1024)]
_Count = Annotated[int, Field(ge=1, le=64)]


class LensPlant(Profile):
    """Pinhole camera with the distortion of Brown and Conrady."""

    width_px: Annotated[int, Field(ge=64, le=8192)] = 1280
    height_px: Annotated[int, Field(ge=64, le=8192)] = 1024
    focal_px: Annotated[tuple[float, ...], Field(min_length=2, max_length=2)] = (1104.0, 1106.0)
    centre_px: Annotated[tuple[float, ...], Field(min_length=2, max_length=2)] = (645.3, 505.8)
    distortion: Annotated[tuple[float, ...], Field(min_length=5, max_length=5)] = (
        *(-0.112, 0.083, 4e-4, -3e-4, -0.012),
    )
    """k1, k2, p1, p2, k3."""
    blur_px: Annotated[float, Field(ge=0.0, le=50.0)] = 0.6
    """Standard deviation of the blur of a point; a large value means out of focus."""


class SensorPlant(Profile):
    """Conversion from light to grey levels."""

    exposure_s: Annotated[float, Field(gt=0.0, le=1.0)] = 0.005
    shutter: Literal["global", "rolling"] = "global"
    readout_s: Annotated[float, Field(ge=0.0, le=1.0)] = 0.02
    """Time from the first row's exposure to the last row's, for a rolling shutter."""
    noise: Annotated[float, Field(ge=0.0, le=100.0)] = 1.5
    """Standard deviation of a dark pixel, in grey levels of 0 to 255."""
    shot_noise: Annotated[float, Field(ge=0.0, le=100.0)] = 2.0
    """Additional noise of a white pixel; it grows with the square root of the light."""


class MountPlant(Profile):
    """True pose of the camera on its platform: z is the optical axis, x points to the right."""

    position_m: Vector = (0.02, -0.01, -0.28)
    rotation_deg: Turn = (180.0, 0.0, 0.0)
    """Rotation vector from the camera's frame to the platform's."""


class LightPlant(Profile):
    """Illumination."""

    white: Annotated[float, Field(gt=0.0, le=1000.0)] = 205.0
    """Grey level of paper in the middle of the image."""
    paper_to_black: Annotated[float, Field(gt=1.0, le=100.0)] = 8.0
    floor: _Share = 0.45
    """Reflectance of the floor, relative to paper."""
    gradient: _Share = 0.25
    """Decrease of the light from one side of the image to the other."""
    vignetting: _Share = 0.25
    """Decrease of the light towards the corners."""


class MarkerPlant(Profile):
    """True pose of one printed marker: position of its centre; z points out of the sheet."""

    id: _Id
    size_m: _Size_m
    """Side of the black square."""
    position_m: Vector
    rotation_deg: Turn = (0.0, 0.0, 0.0)
    mirrored: bool = False
    moves_after_image: Annotated[int, Field(ge=0)] | None = None
    """Number of images after which somebody moves the marker."""
    moves_m: Vector = (0.05, 0.0, 0.0)


class GridPlant(Profile):
    """Markers in rows on a plane, placed by hand."""

    first_id: _Id = 0
    rows: _Count = 6
    columns: _Count = 7
    pitch_m: _Size_m = 0.32
    size_m: _Size_m = 0.15
    origin_m: Vector = (-0.15, 0.1, 0.0)
    """Centre of the grid."""
    rotation_deg: Turn = (0.0, 0.0, 0.0)
    """Rotation vector from the grid's frame, whose z points out of its sheets, to the room."""
    position_sigma_m: Annotated[float, Field(ge=0.0, le=1.0)] = 0.03
    height_sigma_m: Annotated[float, Field(ge=0.0, le=1.0)] = 0.001
    """Standard deviation of the distance from the plane."""
    turn_sigma_deg: Annotated[float, Field(ge=0.0, le=360.0)] = 10.0
    """Standard deviation of the rotation in the plane."""
    tilt_sigma_deg: Annotated[float, Field(ge=0.0, le=45.0)] = 0.3


class PrintPlant(Profile):
    """Errors of a printed sheet."""

    scale_error: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.002
    """Relative error of the scale, common to all sheets."""
    scale_sigma: Annotated[float, Field(ge=0.0, le=0.1)] = 0.0005
    """Standard deviation of the relative error of scale, per sheet and direction."""
    bend_sigma_m: Annotated[float, Field(ge=0.0, le=0.1)] = 0.0003
    """Standard deviation of the height of a sheet's middle above its edges."""


class OccluderPlant(Profile):
    """A dark ball that hides part of the scene."""

    position_m: Vector
    radius_m: _Size_m


class BoardPlant(Profile):
    """A ChArUco board for intrinsics, in front of a camera without a robot."""

    columns: Annotated[int, Field(ge=3, le=40)] = 9
    rows: Annotated[int, Field(ge=3, le=40)] = 6
    square_m: _Size_m = 0.028
    marker_m: _Size_m = 0.02
    dictionary: str = "5X5_100"
    position_m: Vector = (0.0, 0.0, 0.0)
    rotation_deg: Turn = (0.0, 0.0, 0.0)


class CameraFaultPlant(Profile):
    """A temporary fault of the camera, whose begin and end are counted in requested images."""

    kind: Literal["dark", "defocus", "unplugged"]
    from_image: Annotated[int, Field(ge=0)]
    images: Annotated[int, Field(ge=1)] = 1
    blur_px: Annotated[float, Field(gt=0.0, le=100.0)] = 8.0
    """Standard deviation of the blur of a point, if the focus is at fault."""

    def holds(self, image: int) -> bool:
        """Return whether the fault is active at an image, counted from 0."""
        return self.from_image <= image < self.from_image + self.images


class CameraPlant(PlantFile):
    """The truth about a simulated camera and its scene, which no controller may read."""

    seed: Annotated[int, Field(ge=0, lt=2**32)] = 7
    dictionary: str = "4X4_100"
    samples: Annotated[int, Field(ge=4, le=256)] = 32
    """Rays through each pixel."""
    lens: LensPlant = LensPlant()
    sensor: SensorPlant = SensorPlant()
    mount: MountPlant = MountPlant()
    light: LightPlant = LightPlant()
    printing: PrintPlant = PrintPlant()
    grids: Annotated[tuple[GridPlant, ...], Field(max_length=16)] = ()
    markers: Annotated[tuple[MarkerPlant, ...], Field(max_length=512)] = ()
    occluders: Annotated[tuple[OccluderPlant, ...], Field(max_length=64)] = ()
    board: BoardPlant | None = None
    faults: Annotated[tuple[CameraFaultPlant, ...], Field(max_length=64)] = ()

    @classmethod
    @override
    def load_file(cls, path: str | Path | None) -> Self:
        """Return the content of such a file, or of [camera] in a robot's plant file."""
        if path is None:
            return cls()
        table = read_toml(Path(path))
        section = table.get("camera", table)
        return validated(Path(path), section if isinstance(section, dict) else table, cls)


DEFAULT_SCENE = (GridPlant(),)
"""Sheets on the floor, used if a plant names none."""
