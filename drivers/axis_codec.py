"""Compiled kernels between CAN frames and arrays over axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.exchange import BoolArray, FloatArray, WordArray
from cdpr_rt.jit import jit

Bytes2 = NDArray[np.uint8]
Ints = NDArray[np.int64]

FRAME_DATA = 8
"""Where the data begin in a packed frame."""

STATUSWORD, POSITION, TORQUE, MODE_DISPLAY, PROBE_STATUS, PROBE_POSITION = range(6)
FIELDS = 6
CONTROLWORD, TARGET_TORQUE = 0, 1

# columns of the integer state of an axis
TARGET, STATE, WAS_ENABLED, FAULTED, MODE_WANTED, MODE_SHOWN, PROBE_ARMED, EXTRA_WORD = range(8)
STATE_COLUMNS = 8

ALARM_NONE, ALARM_FAULT, ALARM_LEFT_ENABLED, ALARM_MODE, ALARM_NOT_FINITE = range(5)

_DISABLED, _ENABLED, _REACTION, _FAULT = 1, 4, 6, 7
_PROBE_LATCHED = 0x02
_FAULT_RESET = 0x80


@jit
def _signed(frame: NDArray[np.uint8], start: int, size: int) -> int:
    value = np.int64(0)
    for k in range(size):
        value |= np.int64(frame[start + k]) << np.int64(8 * k)
    if value >> np.int64(8 * size - 1):
        value -= np.int64(1) << np.int64(8 * size)
    return int(value)


@jit
def decode(
    frames: Bytes2,
    first: int,
    last: int,
    slots: Ints,
    layout: Ints,
    scale: FloatArray,
    state_table: Ints,
    state: Ints,
    statusword: WordArray,
    position: FloatArray,
    torque: FloatArray,
    index: FloatArray,
    index_known: BoolArray,
    valid: BoolArray,
    alarm: Ints,
) -> int:
    """Decode frames `first` up to `last` (k, 16) into the arrays of n axes.

    `slots` (2048,) gives axis·4 + TPDO number for an identifier, -1 for none; `layout`
    (n, FIELDS, 3) has TPDO, first byte and size of each field, size 0 where it is not mapped;
    `scale` (n, 2) holds rad per count and Nm per unit. Returns how many more axes have answered.
    """
    answered = 0
    for f in range(first, last):
        frame = frames[f]
        identifier = np.int64(frame[0]) | np.int64(frame[1]) << 8
        if identifier > 0x7FF or frame[2] or frame[3]:
            continue
        slot = slots[identifier]
        if slot < 0:
            continue
        i, pdo = slot >> 2, slot & 3
        for field in range(FIELDS):
            size = layout[i, field, 2]
            if size == 0 or layout[i, field, 0] != pdo:
                continue
            if layout[i, field, 1] + size > frame[4]:
                continue
            value = _signed(frame, FRAME_DATA + layout[i, field, 1], size)
            if field == STATUSWORD:
                statusword[i] = value & 0xFFFF
                if not valid[i]:
                    answered += 1
                valid[i] = True
                _follow_state(i, state_table[value & 0x7F], state, alarm)
            elif field == POSITION:
                position[i] = value * scale[i, 0]
            elif field == TORQUE:
                torque[i] = value * scale[i, 1]
            elif field == MODE_DISPLAY:
                state[i, MODE_SHOWN] = value
            elif field == PROBE_STATUS:
                if state[i, PROBE_ARMED] and value & _PROBE_LATCHED:
                    state[i, PROBE_ARMED] = 2
            elif state[i, PROBE_ARMED] == 2:
                index[i] = value * scale[i, 0]
                index_known[i] = True
                state[i, PROBE_ARMED] = 0
    return answered


@jit
def _follow_state(i: int, now: int, state: Ints, alarm: Ints) -> None:
    state[i, STATE] = now
    if now == _ENABLED:
        state[i, WAS_ENABLED] = 1
        if state[i, MODE_SHOWN] != state[i, MODE_WANTED]:
            alarm[i] = ALARM_MODE
    elif now in (_FAULT, _REACTION):
        state[i, WAS_ENABLED] = 0
        if state[i, EXTRA_WORD] & _FAULT_RESET:
            return  # it is being acknowledged
        # a fault takes the request away: only a new one enables again
        state[i, TARGET] = _DISABLED
        state[i, FAULTED] = 1
        alarm[i] = ALARM_FAULT
    else:
        if state[i, WAS_ENABLED] and state[i, TARGET] == _ENABLED:
            state[i, TARGET] = _DISABLED
            alarm[i] = ALARM_LEFT_ENABLED
        state[i, WAS_ENABLED] = 0


@jit
def encode(
    frames: Bytes2,
    layout: Ints,
    words: Ints,
    state: Ints,
    scale: FloatArray,
    limit: FloatArray,
    residual: FloatArray,
    wanted: FloatArray,
    sent: FloatArray,
    alarm: Ints,
) -> bool:
    """Write controlword and target torque of n axes into their RPDOs `frames` (n, 16).

    The torque is rounded to the drive's unit; what rounding left over is carried into the next
    cycle (first-order error feedback), so that the mean is kept below the unit. `layout` (n, 2)
    holds the first byte of controlword and target torque, `words` the controlword by target and
    present state. Returns whether any axis has raised an alarm.
    """
    alarmed = False
    for i in range(wanted.size):
        units = 0
        # in homing and the like the drive makes its own torque; here it must be asked for none
        if state[i, STATE] == _ENABLED and state[i, TARGET] == _ENABLED:
            if np.isfinite(wanted[i]):
                exact = min(max(wanted[i], -limit[i]), limit[i]) / scale[i, 1] + residual[i]
                units = int(np.rint(exact))
                residual[i] = exact - units
            else:
                alarm[i] = ALARM_NOT_FINITE
                residual[i] = 0.0
        else:
            residual[i] = 0.0
        sent[i] = units * scale[i, 1]
        alarmed = alarmed or alarm[i] != ALARM_NONE
        word = words[state[i, TARGET], state[i, STATE]] | state[i, EXTRA_WORD]
        at = FRAME_DATA + layout[i, CONTROLWORD]
        frames[i, at] = word & 0xFF
        frames[i, at + 1] = (word >> 8) & 0xFF
        at = FRAME_DATA + layout[i, TARGET_TORQUE]
        frames[i, at] = units & 0xFF
        frames[i, at + 1] = (units >> 8) & 0xFF
    return alarmed
