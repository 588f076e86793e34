"""Meaning of the 32 button bits of a set-point sample."""

from __future__ import annotations

from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

_Buttons = TypeVar("_Buttons", int, NDArray[np.int64])

CLUTCH: Final = 1
"""Clutch: while this bit is set the device's motion is not followed."""
_CONFIRMED_AT: Final = 8
_MOST: Final = 255


def stream_buttons(clutch: bool, confirmed: int) -> int:
    """Return the button bits of the clutch's state and the number of confirmations.

    The number is sent in bits 8 to 15, as 0 before the first, then 1 to 255 and on from 1, so that
    no lost packet loses a confirmation.
    """
    count = 0 if confirmed <= 0 else (confirmed - 1) % _MOST + 1
    return (CLUTCH if clutch else 0) | count << _CONFIRMED_AT


def confirmation(buttons: _Buttons) -> _Buttons:
    """Return the number of the last confirmation, 0 before the first; arrays are taken too."""
    return buttons >> _CONFIRMED_AT & _MOST
