"""CiA 402: states, the controlword towards a target state, modes, fault texts."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray


class State(IntEnum):
    """State of the CiA 402-2 drive state machine, as reported in the statusword (6041h)."""

    NOT_READY = 0
    SWITCH_ON_DISABLED = 1
    READY = 2
    SWITCHED_ON = 3
    OPERATION_ENABLED = 4
    QUICK_STOP = 5
    FAULT_REACTION = 6
    FAULT = 7
    UNKNOWN = 8

    @property
    def label(self) -> str:
        """The standard's name of the state, for messages."""
        return _LABELS[self]


_LABELS: Final = {
    State.NOT_READY: "not ready to switch on",
    State.SWITCH_ON_DISABLED: "switch on disabled",
    State.READY: "ready to switch on",
    State.SWITCHED_ON: "switched on",
    State.OPERATION_ENABLED: "operation enabled",
    State.QUICK_STOP: "quick stop active",
    State.FAULT_REACTION: "fault reaction active",
    State.FAULT: "fault",
    State.UNKNOWN: "unknown",
}

# CiA 402-2, statusword: (mask, value, state).
_STATUSWORD_STATES: Final = (
    (0x4F, 0x00, State.NOT_READY),
    (0x4F, 0x40, State.SWITCH_ON_DISABLED),
    (0x6F, 0x21, State.READY),
    (0x6F, 0x23, State.SWITCHED_ON),
    (0x6F, 0x27, State.OPERATION_ENABLED),
    (0x6F, 0x07, State.QUICK_STOP),
    (0x4F, 0x0F, State.FAULT_REACTION),
    (0x4F, 0x08, State.FAULT),
)

SHUTDOWN: Final = 0x06
SWITCH_ON: Final = 0x07
ENABLE_OPERATION: Final = 0x0F
DISABLE_VOLTAGE: Final = 0x00
QUICK_STOP_COMMAND: Final = 0x02
FAULT_RESET: Final = 0x80
HALT: Final = 0x100
START_HOMING: Final = 0x10


def _state_of_low_byte() -> NDArray[np.int64]:
    table = np.full(128, int(State.UNKNOWN), np.int64)
    for word in range(128):
        for mask, value, state in _STATUSWORD_STATES:
            if word & mask == value:
                table[word] = int(state)
                break
    return table


STATE_TABLE: Final = _state_of_low_byte()
"""State by the low 7 bits of the statusword; shape (128,)."""


def state_of(statusword: int) -> State:
    """Return the state that a statusword (6041h) reports."""
    return State(int(STATE_TABLE[statusword & 0x7F]))


POWER_OFF: Final = (State.NOT_READY, State.SWITCH_ON_DISABLED, State.READY, State.FAULT)
"""States in which the power stage is off; in "switched on" it may have voltage."""

TARGETS: Final = (
    State.SWITCH_ON_DISABLED,
    State.READY,
    State.SWITCHED_ON,
    State.OPERATION_ENABLED,
    State.QUICK_STOP,
)
"""States that can be requested of a drive."""


def _next_word(target: State, state: State) -> int:
    """Return the controlword of one step from `state` towards `target`; CiA 402-2, transitions."""
    if target == State.SWITCH_ON_DISABLED or state not in TARGETS:
        return DISABLE_VOLTAGE  # also in a fault, so that bit 7 has a rising edge later
    if target == State.QUICK_STOP:
        stopping = state in (State.OPERATION_ENABLED, State.QUICK_STOP)
        return QUICK_STOP_COMMAND if stopping else DISABLE_VOLTAGE
    if state == State.QUICK_STOP:
        return DISABLE_VOLTAGE  # the standard makes enabling from a quick stop optional
    if target == State.READY or state == State.SWITCH_ON_DISABLED:
        return SHUTDOWN
    if target == State.SWITCHED_ON or state == State.READY:
        return SWITCH_ON
    return ENABLE_OPERATION


def _controlword_table() -> NDArray[np.int64]:
    table = np.zeros((len(State), len(State)), np.int64)
    for target in TARGETS:
        for state in State:
            table[target, state] = _next_word(target, state)
    return table


CONTROLWORD_TABLE: Final = _controlword_table()
"""Controlword by [target state, present state]; shape (9, 9)."""


class Mode(IntEnum):
    """Mode of operation (6060h, 6061h)."""

    PROFILE_POSITION = 1
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    INTERPOLATED_POSITION = 7
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10


# Bit of 6502h by mode of operation; CiA 402-2, supported drive modes.
_SUPPORTED_BITS: Final = {1: 0, 2: 1, 3: 2, 4: 3, 6: 5, 7: 6, 8: 7, 9: 8, 10: 9}


def mode_name(mode: int) -> str:
    """Return a readable name of a mode of operation."""
    try:
        return f"{mode} ({Mode(mode).name.lower().replace('_', ' ')})"
    except ValueError:
        return f"{mode} ({'no mode' if mode == 0 else 'manufacturer specific or reserved'})"


def supports(supported_drive_modes: int, mode: int) -> bool:
    """Return whether 6502h announces `mode`; manufacturer modes (negative) count as announced."""
    if mode < 0:
        return True
    bit = _SUPPORTED_BITS.get(mode)
    return bit is not None and bool(supported_drive_modes >> bit & 1)


def mode_bits(modes: Iterable[int]) -> int:
    """Return 6502h of a drive that has these modes of operation."""
    return sum(1 << _SUPPORTED_BITS[mode] for mode in set(modes) if mode in _SUPPORTED_BITS)


def supported_modes(supported_drive_modes: int) -> list[int]:
    """Return the modes of operation that 6502h announces."""
    return [m for m, bit in _SUPPORTED_BITS.items() if supported_drive_modes >> bit & 1]


# CiA 301 and CiA 402-2, error codes: exact codes first, then the groups.
_FAULTS: Final = {
    0x2310: "continuous over current at the output",
    0x2320: "short circuit or earth leakage at the output",
    0x2340: "short circuit in the motor",
    0x2350: "load level fault (I2t, thermal state)",
    0x2351: "load level warning (I2t, thermal state)",
    0x3110: "mains over-voltage",
    0x3120: "mains under-voltage",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x4210: "drive over-temperature",
    0x4310: "drive temperature too high",
    0x5300: "operating unit",
    0x5441: "contactor input",
    0x6320: "parameter error",
    0x7121: "motor blocked",
    0x7180: "motor",
    0x7300: "sensor",
    0x7305: "incremental encoder 1",
    0x7310: "speed",
    0x7320: "position",
    0x7500: "communication",
    0x8110: "CAN overrun, objects lost",
    0x8120: "CAN in error passive",
    0x8130: "heartbeat or life guard lost",
    0x8140: "recovered from bus-off",
    0x8150: "collision of COB-IDs",
    0x8210: "PDO not processed, length error",
    0x8220: "PDO length exceeded",
    0x8240: "unexpected SYNC length",
    0x8250: "RPDO deadline missed",
    0x8300: "torque control",
    0x8311: "excess torque",
    0x8400: "velocity control, overspeed",
    0x8480: "velocity following error",
    0x8500: "position control",
    0x8611: "following error",
    0x8612: "reference limit",
    0x8613: "homing",
    0x8700: "SYNC controller",
}
_FAULT_GROUPS: Final = (
    (0xFF00, 0x0000, "no error"),
    (0xFF00, 0x1000, "generic error"),
    (0xF000, 0x2000, "current"),
    (0xF000, 0x3000, "voltage"),
    (0xF000, 0x4000, "temperature"),
    (0xF000, 0x5000, "device hardware"),
    (0xF000, 0x6000, "device software"),
    (0xF000, 0x7000, "additional modules"),
    (0xFF00, 0x8100, "communication"),
    (0xFF00, 0x8200, "protocol error"),
    (0xF000, 0x8000, "monitoring"),
    (0xF000, 0x9000, "external error"),
    (0xF000, 0xF000, "device specific"),
)


def fault_text(code: int) -> str:
    """Return an error code (603Fh, EMCY) as text, with the number."""
    text = _FAULTS.get(code)
    if text is None:
        text = next((t for mask, value, t in _FAULT_GROUPS if code & mask == value), "unknown")
    return f"{code:04X}h {text}"
