"""Faults that a drive detects by itself, and the interface to report them."""

from __future__ import annotations

from typing import Protocol

from cdpr_sim_bus.cia402.words import ErrorCode
from cdpr_sim_bus.robot import servo

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
    """Interface through which the state machine reports errors."""

    def emergency(self, code: int, register_bits: int) -> None:
        """Report an error."""

    def emergency_clear(self, code: int | None = None) -> None:
        """Take an error back."""
