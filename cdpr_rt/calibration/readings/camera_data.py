"""Data of a camera on the platform in a calibration: its setup, and its images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from pydantic import Field

from cdpr_profiles.devices.camera import CameraIntrinsics, MarkerSheets
from cdpr_profiles.reading.reader import Profile
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.sighting import Sighting

_DECIMALS_px = 4
_Length_m = Annotated[float, Field(ge=-100.0, le=100.0)]
_Angle_deg = Annotated[float, Field(ge=-360.0, le=360.0)]
_Pixel = Annotated[float, Field(ge=-1e5, le=1e5)]
_Pair = Annotated[tuple[_Pixel, ...], Field(min_length=2, max_length=2)]
_Id = Annotated[int, Field(ge=0, lt=1024)]


class HandEye(Profile):
    """Prior knowledge of the camera's pose on the platform."""

    position_m: Annotated[tuple[_Length_m, ...], Field(min_length=3, max_length=3)]
    """Position of the camera's pinhole in the platform's frame."""
    rotation_deg: Annotated[tuple[_Angle_deg, ...], Field(min_length=3, max_length=3)]
    """Rotation vector from the camera's frame, z where it looks and x to the right of the image,
    to the platform's."""
    position_std_m: Annotated[float, Field(ge=1e-6, le=10.0)] = 0.005
    """Standard deviation of each coordinate: a ruler's."""
    rotation_std_deg: Annotated[float, Field(ge=1e-4, le=180.0)] = 2.0
    """About each axis."""


class CameraSetup(Profile):
    """The camera that took the images, and the sheets that it saw."""

    intrinsics: CameraIntrinsics
    """With `sigmas` the fit corrects them as far as these allow; without they are held."""
    sheets: MarkerSheets
    """Sizes of the markers, and places of those that are known."""
    sigma_px: Annotated[float, Field(ge=1e-3, le=100.0)] | None = None
    """Standard deviation of a coordinate of a corner; as the images show it where left out."""
    size_std: Annotated[float, Field(ge=1e-6, le=0.5)] = 0.002
    """Relative: how well the size of the sheets, all alike, is known."""
    known_std_m: Annotated[float, Field(ge=1e-6, le=1.0)] = 0.001
    """Standard deviation of each coordinate of a corner of a marker whose place is known."""
    hand_eye: HandEye | None = None
    """None where nothing is known of it: the robot's own turning tells it."""

    @classmethod
    def of(cls, intrinsics: CameraIntrinsics, sheets: MarkerSheets) -> CameraSetup:
        """Return that of two files, with places known as well as the sheets' file says."""
        setup = cls(intrinsics=intrinsics, sheets=sheets)
        if sheets.known_std_m is None:
            return setup
        return setup.model_copy(update={"known_std_m": sheets.known_std_m})

    def as_found(self, lens: FloatArray, size_change: float) -> CameraSetup:
        """Return it with another lens (9,), sheets larger by a relative change, and no hand_eye."""
        fx, fy, cx, cy, *distortion = lens.tolist()
        found = {"focal_px": (fx, fy), "centre_px": (cx, cy), "distortion": tuple(distortion)}
        sheets, by = self.sheets, 1.0 + size_change
        sizes = tuple(one.model_copy(update={"size_m": by * one.size_m}) for one in sheets.sizes)
        scaled = {"size_m": by * sheets.size_m, "sizes": sizes}
        return self.model_copy(
            update={
                "intrinsics": self.intrinsics.model_copy(update=found),
                "sheets": sheets.model_copy(update=scaled),
                "hand_eye": None,
            }
        )


class MarkerReading(Profile):
    """A marker in an image."""

    id: _Id
    corners_px: Annotated[tuple[_Pair, ...], Field(min_length=4, max_length=4)]
    """As a detector orders them: the marker's from above on the left, clockwise."""


class ImageReading(Profile):
    """Image of a pose; `markers` is empty where none could be used."""

    markers: Annotated[tuple[MarkerReading, ...], Field(max_length=1024)] = ()
    repeated: tuple[_Id, ...] = ()
    """Ids that it shows more than once."""
    mirrored: tuple[_Id, ...] = ()
    """Ids that only its mirror image shows."""
    problem: Annotated[str, Field(max_length=500)] | None = None
    """Fault of the image as a whole in words, "" for none."""

    @classmethod
    def of(cls, seen: Sighting) -> Self:
        """Return what a detector found."""
        markers = tuple(
            MarkerReading(
                id=marker, corners_px=tuple(map(tuple, np.round(corners, _DECIMALS_px).tolist()))
            )
            for marker, corners in sorted(seen.corners_px.items())
        )
        return cls(
            markers=markers, repeated=seen.repeated, mirrored=seen.mirrored, problem=seen.problem
        )

    def sighting(self, name: str) -> Sighting:
        """Return it as a detector would; an id that is listed twice counts as repeated."""
        ids = [one.id for one in self.markers]
        twice = {marker for marker in ids if ids.count(marker) > 1}
        corners = {one.id: np.array(one.corners_px) for one in self.markers if one.id not in twice}
        repeated = tuple(sorted({*self.repeated, *twice}))
        return Sighting(
            name, corners, repeated=repeated, mirrored=self.mirrored, problem=self.problem
        )


@dataclass(frozen=True)
class Images:
    """Images of the camera on the platform, one for each pose, and its setup."""

    setup: CameraSetup
    sightings: Sequence[Sighting]
