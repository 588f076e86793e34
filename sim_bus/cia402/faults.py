"""Faults that a drive finds by itself, and whom it tells of them."""

from __future__ import annotations

from typing import Protocol

from sim_bus import servo
from sim_bus.cia402.words import ErrorCode

FAULTS = (
    (servo.OVERCURRENT, ErrorCode.OVERCURRENT, True),
    (servo.OVERSPEED, ErrorCode.SPEED, False),
    (servo.I2T_TRIP, ErrorCode.LOAD_LEVEL, False),
    (servo.FOLLOWING_ERROR, ErrorCode.FOLLOWING_ERROR, False),
)
LASTING = servo.OVERCURRENT | servo.OVERSPEED | servo.I2T_WARNING
"""What refuses a fault reset; an overload must have cooled down to below the warning."""
ALWAYS_WATCHED = LASTING | servo.I2T_TRIP | servo.FOLLOWING_ERROR


class ErrorReporter(Protocol):
    """What the state machine tells the communication part."""

    def emergency(self, code: int, register_bits: int) -> None:
        """Report an error."""

    def emergency_clear(self, code: int | None = None) -> None:
        """Take an error back."""
