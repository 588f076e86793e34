"""Words and codes of CiA 402: states, modes of operation, error codes."""

from __future__ import annotations

from enum import IntEnum

from cdpr_sim_bus.robot import servo


class State(IntEnum):
    """States of the drive; the value is the state's part of the statusword."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08


VOLTAGE_ENABLED = 1 << 4
WARNING = 1 << 7
REMOTE = 1 << 9
TARGET_REACHED = 1 << 10
INTERNAL_LIMIT = 1 << 11
BIT_12 = 1 << 12
"""Set-point acknowledge, speed zero, homing attained or drive follows, by mode."""
BIT_13 = 1 << 13
"""Following error or homing error, by mode."""

BIT_4 = 1 << 4
"""Controlword: new set-point or homing start, by mode."""
BIT_5 = 1 << 5
"""Controlword: change set immediately."""
BIT_6 = 1 << 6
"""Controlword: relative target."""
FAULT_RESET = 1 << 7
HALT = 1 << 8


class ModeNumber(IntEnum):
    """Modes of operation (6060h) that this drive has."""

    NONE = 0
    PROFILE_POSITION = 1
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10


class ErrorCode(IntEnum):
    """Error codes (603Fh, EMCY) that this drive raises."""

    OVERCURRENT = 0x2310
    LOAD_LEVEL = 0x2350
    CONTACTOR = 0x5441
    COMMUNICATION = 0x8100
    HEARTBEAT = 0x8130
    BUS_OFF = 0x8140
    RPDO_TIMEOUT = 0x8250
    SPEED = 0x8400
    FOLLOWING_ERROR = 0x8611


def error_register_bits(code: int) -> int:
    """Return the bits of the error register (1001h) that belong to an error code (CiA 301)."""
    group = code >> 8
    if group >> 4 == 0x2:
        return 0x02
    if group >> 4 == 0x3:
        return 0x04
    if group >> 4 == 0x4:
        return 0x08
    if group in (0x81, 0x82):
        return 0x10
    if group >> 4 in (0x7, 0x8):
        return 0x20
    return 0x80 if group == 0xFF else 0x01


FAULTS = (
    (servo.OVERCURRENT, ErrorCode.OVERCURRENT, True),
    (servo.OVERSPEED, ErrorCode.SPEED, False),
    (servo.I2T_TRIP, ErrorCode.LOAD_LEVEL, False),
    (servo.FOLLOWING_ERROR, ErrorCode.FOLLOWING_ERROR, False),
)
LASTING = servo.OVERCURRENT | servo.OVERSPEED | servo.I2T_WARNING
"""Flags that prevent a fault reset; an overload must have cooled below the warning."""
ALWAYS_WATCHED = LASTING | servo.I2T_TRIP | servo.FOLLOWING_ERROR
