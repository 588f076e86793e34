"""Errors of the runtime; each message gives the problem, its place, and the allowed values."""

from __future__ import annotations

import sys
import traceback
from pathlib import Path
from typing import Final

_NOT_THE_USERS: Final = sys.stdlib_module_names | {"numba", "numpy", "scipy"}
"""Packages, besides those of this project, whose lines say nothing about a mistake."""


def error_text(error: BaseException) -> str:
    """Return type and text of an exception, with the innermost line of the user's own code."""
    place = ""
    for frame, line in traceback.walk_tb(error.__traceback__):
        package = str(frame.f_globals.get("__name__")).partition(".")[0]
        if not package.startswith("cdpr_") and package not in _NOT_THE_USERS:
            place = f" ({Path(frame.f_code.co_filename).name}:{line})"
    return f"{type(error).__name__}: {error}{place}"


class ControlError(Exception):
    """An operation of the runtime failed."""


class InvalidRequestError(ControlError):
    """A procedure cannot begin or continue as requested; no motor has power."""


class TripError(ControlError):
    """The supervisor or the device ended the motion; the message says which limit and value."""


class NotInTimeError(TripError):
    """A procedure that runs in the device took longer than allowed."""


class InterruptedMotionError(ControlError):
    """The operator requested a stop; the motion ended under control."""


class RawLogError(ControlError):
    """A raw measurement file cannot be written or read."""


class GeometryError(ControlError):
    """A geometry that is impossible; the message names the cable and the value."""
