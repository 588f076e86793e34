"""What the 32 buttons of a set-point mean to the programs and to recordings."""

from __future__ import annotations

from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

_Buttons = TypeVar("_Buttons", int, NDArray[np.int64])

CLUTCH: Final = 1
"""While this bit is set the hand moves without leading; from where it is then it leads on."""
_CONFIRMED_AT: Final = 8
_MOST: Final = 255


def stream_buttons(clutch: bool, confirmed: int) -> int:
    """Return the buttons of a hand whose clutch is open or not, and that has confirmed so often.

    The number itself is sent, in bits 8 to 15 and counted 1 to 255 and on from 1, so that no lost
    packet loses a confirmation; 0 before the first.
    """
    count = 0 if confirmed <= 0 else (confirmed - 1) % _MOST + 1
    return (CLUTCH if clutch else 0) | count << _CONFIRMED_AT


def confirmation(buttons: _Buttons) -> _Buttons:
    """Return the number of the last confirmation, 0 before the first; arrays are taken too."""
    return buttons >> _CONFIRMED_AT & _MOST
