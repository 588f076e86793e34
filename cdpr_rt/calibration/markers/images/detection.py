"""Finds markers in images, and says of an image what is wrong with it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_rt.calibration.markers.geometry.rotations import FloatArray
from cdpr_rt.calibration.markers.images.edge_fit import fit_corners
from cdpr_rt.errors import InvalidRequestError

_DARK, _FLAT = 30.0, 12.0
"""Grey levels: the brightest of an image, and its contrast, below which nothing can be seen."""
_BRIGHT, _BURNT_SHARE = 250, 0.6
_SOFT_SHARE = 0.12
"""Of its contrast, by which the steepest edges of an image must rise from pixel to pixel."""
_BLURRED_px = 6.0


@dataclass(frozen=True)
class Sighting:
    """What one image shows."""

    name: str
    corners_px: Mapping[int, FloatArray]
    """Of each marker that is there once and sharp, (4, 2)."""
    repeated: tuple[int, ...] = ()
    """Ids that are there more than once."""
    unsharp: tuple[int, ...] = ()
    """Ids whose edges are hidden or blurred."""
    mirrored: tuple[int, ...] = ()
    """Ids that only a mirror image of it shows."""
    edge_width_px: float = float("nan")
    """Median over the markers, of their widest edges."""
    problem: str | None = None
    """What is wrong with the image as a whole, in words."""


class MarkerDetector:
    """Finds the markers of one dictionary, by OpenCV; corners by `fit_corners`."""

    def __init__(self, dictionary: str) -> None:
        """Raise InvalidRequestError for a dictionary that OpenCV does not have."""
        number = getattr(cv2.aruco, f"DICT_{dictionary}", None)
        if number is None:
            raise InvalidRequestError(f"dictionary {dictionary!r}; allowed: those of OpenCV")
        self._dictionary: Any = cv2.aruco.getPredefinedDictionary(number)
        self._squares = self._dictionary.markerSize + 2
        self._detector: Any = cv2.aruco.ArucoDetector(
            self._dictionary, cv2.aruco.DetectorParameters()
        )

    def detect(self, pixels: NDArray[np.uint8], name: str, *, mirrors: bool = False) -> Sighting:
        """Return what an image (height, width) shows; with `mirrors`, printed mirror images too."""
        if problem := _exposure_problem(pixels):
            return Sighting(name, {}, problem=problem)
        ids, corners = self._find(pixels)
        counts = Counter(ids)
        repeated = tuple(sorted(marker for marker, count in counts.items() if count > 1))
        fit = fit_corners(pixels, corners, self._squares)
        sharp: dict[int, FloatArray] = {}
        unsharp = []
        for k, marker in enumerate(ids):
            if marker in repeated:
                continue
            if fit.good[k]:
                sharp[marker] = fit.corners_px[k]
            else:
                unsharp.append(marker)
        width = float(np.median(fit.width_px)) if len(ids) else float("nan")
        return Sighting(
            name,
            sharp,
            repeated,
            tuple(unsharp),
            self._mirrored(pixels, set(ids)) if mirrors else (),
            width,
            _sharpness_problem(pixels, len(ids), width),
        )

    def _find(self, pixels: NDArray[np.uint8]) -> tuple[list[int], FloatArray]:
        corners, ids, _ = self._detector.detectMarkers(pixels)
        found = np.array(corners, float).reshape(-1, 4, 2)
        return ([] if ids is None else [int(marker) for marker in ids.ravel()]), found

    def _mirrored(self, pixels: NDArray[np.uint8], known: set[int]) -> tuple[int, ...]:
        """Return ids in the mirror image where the image itself shows no marker."""
        flipped = np.ascontiguousarray(pixels[:, ::-1])
        ids, corners = self._find(flipped)
        if not ids:
            return ()
        # a sheet that reads the same both ways is no mirrored one
        good = fit_corners(flipped, corners, self._squares).good
        return tuple(
            sorted(i for i, sharp in zip(ids, good, strict=True) if sharp and i not in known)
        )


def _exposure_problem(pixels: NDArray[np.uint8]) -> str | None:
    low, high = np.percentile(pixels, (1.0, 99.5))
    if high < _DARK:
        return f"black: hardly a pixel is brighter than {high:.0f} of 255"
    if high - low < _FLAT:
        return f"without contrast: grey levels from {low:.0f} to {high:.0f} of 255"
    return None


def _sharpness_problem(pixels: NDArray[np.uint8], found: int, width_px: float) -> str | None:
    if found:
        if width_px > _BLURRED_px:
            return f"blurred: edges are {width_px:.0f} px wide; allowed: {_BLURRED_px:.0f}"
        return None
    if (pixels >= _BRIGHT).mean() > _BURNT_SHARE:
        return "overexposed: most of it is white"
    smooth = cv2.GaussianBlur(pixels.astype(np.float32), (0, 0), 1.0)  # noise is no edge
    slope = np.hypot(np.diff(smooth, axis=0)[:, :-1], np.diff(smooth, axis=1)[:-1])
    low, high = np.percentile(pixels, (1.0, 99.5))
    if np.percentile(slope, 99.8) < _SOFT_SHARE * (high - low):
        return "blurred: it has no sharp edge"
    return None
