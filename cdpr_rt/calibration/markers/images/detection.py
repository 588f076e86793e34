"""Finds markers in images, and says of an image what is wrong with it."""

from __future__ import annotations

from collections import Counter
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.images.dictionaries import opencv_dictionary
from cdpr_rt.calibration.markers.images.edge_fit import fit_corners
from cdpr_rt.calibration.markers.sighting import Sighting

_DARK, _FLAT = 30.0, 12.0
"""Grey levels: the brightest of an image, and its contrast, below which nothing can be seen."""
_BRIGHT, _BURNT_SHARE = 250, 0.6
_SOFT_SHARE = 0.12
"""Of its contrast, by which the steepest edges of an image must rise from pixel to pixel."""
_BLURRED_px = 6.0


class MarkerDetector:
    """Finds the markers of one dictionary, by OpenCV; corners by `fit_corners`."""

    def __init__(self, dictionary: str) -> None:
        """Raise InvalidRequestError for a dictionary that OpenCV does not have."""
        self._dictionary: Any = opencv_dictionary(dictionary)
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
            self._mirrored(pixels, corners) if mirrors else (),
            _sharpness_problem(pixels, len(ids), width),
        )

    def _find(self, pixels: NDArray[np.uint8]) -> tuple[list[int], FloatArray]:
        corners, ids, _ = self._detector.detectMarkers(pixels)
        found = np.array(corners, float).reshape(-1, 4, 2)
        return ([] if ids is None else [int(marker) for marker in ids.ravel()]), found

    def _mirrored(self, pixels: NDArray[np.uint8], read: FloatArray) -> tuple[int, ...]:
        """Return ids in the mirror image where no marker of the image itself, (m, 4, 2), was read.

        A sheet that reads as another one, or the same, the other way round is no mirrored one.
        """
        flipped = np.ascontiguousarray(pixels[:, ::-1])
        ids, corners = self._find(flipped)
        if not ids:
            return ()
        middles = corners.mean(axis=1)
        middles[:, 0] = pixels.shape[1] - 1 - middles[:, 0]
        away = np.linalg.norm(middles[:, None] - read.mean(axis=1), axis=2)
        width = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
        own = away.min(axis=1, initial=np.inf) > 0.5 * width
        good = fit_corners(flipped, corners, self._squares).good & own
        return tuple(sorted({i for i, right in zip(ids, good, strict=True) if right}))


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
