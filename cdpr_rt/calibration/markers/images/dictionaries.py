"""OpenCV's sets of markers by name."""

from __future__ import annotations

from typing import Any

import cv2

from cdpr_profiles.devices.camera import DICTIONARIES
from cdpr_profiles.reading.reader import closest
from cdpr_rt.errors import InvalidRequestError


def opencv_dictionary(name: str) -> Any:
    """Return OpenCV's set of this name, without its DICT_; raises InvalidRequestError."""
    number = getattr(cv2.aruco, f"DICT_{name}", None)
    if number is None:
        near = closest(name.upper().removeprefix("DICT_"), DICTIONARIES)
        hint = f"did you mean {near!r}?" if near else f"allowed: {', '.join(DICTIONARIES)}"
        raise InvalidRequestError(f"dictionary {name!r}; {hint}")
    return cv2.aruco.getPredefinedDictionary(number)
