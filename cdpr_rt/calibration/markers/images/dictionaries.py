"""OpenCV's sets of markers by name, and which of them an image shows."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.devices.camera import DICTIONARIES
from cdpr_profiles.reading.reader import closest
from cdpr_rt.errors import InvalidRequestError

_LEAST_READ = 4
"""Ids of a set that is believed to be there: by chance one or two of a large set are read."""


def opencv_dictionary(name: str) -> Any:
    """Return OpenCV's set of this name, without its DICT_; raises InvalidRequestError."""
    number = getattr(cv2.aruco, f"DICT_{name}", None)
    if number is None:
        near = closest(name.upper().removeprefix("DICT_"), DICTIONARIES)
        hint = f"did you mean {near!r}?" if near else f"allowed: {', '.join(DICTIONARIES)}"
        raise InvalidRequestError(f"dictionary {name!r}; {hint}")
    return cv2.aruco.getPredefinedDictionary(number)


def dictionary_shown(pixels: NDArray[np.uint8]) -> str | None:
    """Return the set of which an image (height, width) shows most ids, of equal ones the smallest.

    None where it shows fewer than four of any.
    """
    read = {name: _count(name, pixels) for name in DICTIONARIES}
    best = max(read, key=lambda name: read[name])  # smaller sets of a kind stand first
    return best if read[best] >= _LEAST_READ else None


def _count(name: str, pixels: NDArray[np.uint8]) -> int:
    _, ids, _ = cv2.aruco.ArucoDetector(opencv_dictionary(name)).detectMarkers(pixels)
    return 0 if ids is None else len(np.unique(ids))
