"""Cameras and markers as in their files: intrinsics, sheets, known layouts."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from cdpr_profiles.reader import Profile, closest, require_unique

_Pixels = Annotated[int, Field(ge=16, le=20000)]
_Focal = Annotated[float, Field(gt=1.0, le=1e6)]
_Centre = Annotated[float, Field(ge=-1e5, le=1e5)]
_Sigma = Annotated[float, Field(ge=0.0, le=1e6)]
_Size_m = Annotated[float, Field(ge=0.001, le=10.0)]
_Length_m = Annotated[float, Field(ge=-1000.0, le=1000.0)]
_Angle_deg = Annotated[float, Field(ge=-360.0, le=360.0)]
_Id = Annotated[int, Field(ge=0, lt=1024)]

DICTIONARIES = (
    *(f"{bits}X{bits}_{count}" for bits in (4, 5, 6, 7) for count in (50, 100, 250, 1000)),
    *("ARUCO_ORIGINAL", "ARUCO_MIP_36H12"),
    *("APRILTAG_16H5", "APRILTAG_25H9", "APRILTAG_36H10", "APRILTAG_36H11"),
)
"""Names of the marker dictionaries, as in OpenCV but without DICT_."""


class CameraIntrinsics(Profile):
    """A pinhole camera with the lens distortion of Brown and Conrady, as in OpenCV.

    A point in direction x, y (X/Z, Y/Z) is seen at u, v; with s = x² + y²:

        u = fx x' + cx,  x' = x (1 + k1 s + k2 s² + k3 s³) + 2 p1 x y + p2 (s + 2 x²)
        v = fy y' + cy,  y' = y (1 + k1 s + k2 s² + k3 s³) + p1 (s + 2 y²) + 2 p2 x y

    (0, 0) is in the middle of the first pixel.
    """

    width_px: _Pixels
    height_px: _Pixels
    focal_px: Annotated[tuple[_Focal, ...], Field(min_length=2, max_length=2)]
    """fx, fy."""
    centre_px: Annotated[tuple[_Centre, ...], Field(min_length=2, max_length=2)]
    """cx, cy."""
    distortion: Annotated[tuple[float, ...], Field(min_length=5, max_length=5)] = (0.0,) * 5
    """k1, k2, p1, p2, k3."""
    rms_px: _Sigma | None = None
    """Residual of the fit of the intrinsics."""
    sigmas: Annotated[tuple[_Sigma, ...], Field(min_length=9, max_length=9)] | None = None
    """Standard deviations of fx, fy, cx, cy, k1, k2, p1, p2, k3."""

    @property
    def parameters(self) -> tuple[float, ...]:
        """fx, fy, cx, cy, k1, k2, p1, p2, k3."""
        return (*self.focal_px, *self.centre_px, *self.distortion)


class KnownMarker(Profile):
    """Measured place of a marker's middle; x is along its upper edge, z points out of the sheet."""

    id: _Id
    position_m: Annotated[tuple[_Length_m, ...], Field(min_length=3, max_length=3)]
    rotation_deg: Annotated[tuple[_Angle_deg, ...], Field(min_length=3, max_length=3)] = (0.0,) * 3
    """Rotation vector from the marker's frame to that of the layout."""


class MarkerSize(Profile):
    """Markers that have another size than the others."""

    ids: Annotated[tuple[_Id, ...], Field(min_length=1, max_length=1024)]
    size_m: _Size_m


class MarkerSheets(Profile):
    """The markers in use: their dictionary, their sizes, and the known places of some.

    A size is the side of the whole black square, to the outer edges of its border.
    """

    dictionary: str = "4X4_100"
    size_m: _Size_m
    sizes: tuple[MarkerSize, ...] = ()
    placed: Annotated[tuple[_Id, ...], Field(max_length=1024)] = ()
    """Ids of all markers that were laid out, if known."""
    known: Annotated[tuple[KnownMarker, ...], Field(max_length=1024)] = ()
    known_std_m: Annotated[float, Field(ge=1e-6, le=1.0)] | None = None
    """Standard deviation of each coordinate of the corners of `known`; None if unknown."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.dictionary not in DICTIONARIES:
            near = closest(self.dictionary, DICTIONARIES)
            hint = f"did you mean {near!r}?" if near else f"allowed: {', '.join(DICTIONARIES)}"
            raise ValueError(f"dictionary {self.dictionary!r}; {hint}")
        require_unique("ids of sizes", [i for one in self.sizes for i in one.ids])
        require_unique("ids of known markers", [one.id for one in self.known])
        require_unique("placed", list(self.placed))
        return self

    def size_of(self, marker: int) -> float:
        """Return the size of a marker, m."""
        return next((one.size_m for one in self.sizes if marker in one.ids), self.size_m)


def rotation_vector_rad(rotation_deg: tuple[float, ...]) -> tuple[float, ...]:
    """Return a rotation vector in radians."""
    return tuple(math.radians(angle) for angle in rotation_deg)
