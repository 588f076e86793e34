"""Compiled kernels between CAN frames and arrays over axes.

The state of a group is in a few two-dimensional arrays, because every array passed to a kernel
costs time in each cycle. A row is a quantity, named below; a column is an axis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import BoolArray, FloatArray, WordArray
from cdpr_rt.jit import jit

Frames = NDArray[np.uint8]
Ints = NDArray[np.int64]

# kinds of frames besides the TPDOs 0, 1, ... of the profile
EMCY, HEARTBEAT = 100, 101

MAX_FIELDS = 8
# columns of `command_offsets`
CONTROLWORD_FRAME, CONTROLWORD, TORQUE_FRAME, TARGET_TORQUE, TORQUE_BYTES = range(5)

# rows of `ints`; the first ones are filled from TPDOs when they arrive
(
    STATUSWORD,
    RAW_POSITION,
    TORQUE_UNITS,
    MODE_DISPLAYED,
    PROBE_STATUS,
    PROBE_POSITION,
    POSITION,
    LAST_RAW_POSITION,
    STATE,
    TARGET,
    WAS_ENABLED,
    FAULTED,
    MODE_REQUESTED,
    PROBE_ARMED,
    EXTRA_BITS,
    ACKNOWLEDGE,
    ALARM,
    SILENT_CYCLES,
    SILENCE_LIMIT,
    HEARTBEAT_AGE,
    HEARTBEAT_LIMIT,
    EMERGENCY,
    NMT_STATE,
    MISSED,
    TPDOS_EXPECTED,
    TPDOS_RECEIVED,
    EXTRA,
    REPEATED,
    LATE,
    FRAMES,
    FRAMES_ALLOWED,
    FLOOD,
) = range(32)
INT_ROWS = 32

# rows of `floats`
(
    POSITION_RAD,
    TORQUE_NM,
    INDEX_RAD,
    COMMAND_NM,
    SENT_NM,
    RAD_PER_COUNT,
    NM_PER_UNIT,
    LIMIT_UNITS,
    RESIDUAL_UNITS,
    IRREGULAR,
) = range(10)
FLOAT_ROWS = 10

# rows of `flags`
VALID, INDEX_KNOWN, ALIVE, RATE_OK = range(4)
FLAG_ROWS = 4

# bits of ALARM, latched until they are acknowledged
FAULT, LEFT_ENABLED, WRONG_MODE, NOT_FINITE, SILENT, NO_HEARTBEAT, RESTARTED, NOT_OPERATIONAL = (
    1 << bit for bit in range(8)
)
EMERGENCY_MESSAGE, UNSTEADY, FLOODING = 1 << 8, 1 << 9, 1 << 10
LOST = WRONG_MODE | RESTARTED | NOT_OPERATIONAL
"""Alarms of an axis that cannot be relied on to accept torques from the cycle.

An axis that is only silent may still obey; it brakes or lowers with the others.
"""

_SWITCH_ON_DISABLED, _SWITCHED_ON, _ENABLED, _REACTION, _FAULT = 1, 3, 4, 6, 7
_PROBE_LATCHED = 0x02
_FAULT_RESET = 0x80
_OPERATIONAL, _NOT_HEARD = 5, 0
_DATA = 8
_CYCLE_OVER = 1 << 62
"""Bit of TPDOS_RECEIVED that is set from the end of a cycle until the next SYNC."""
_MEMORY_CYCLES = 64.0
_FAIR_SHARE, _WORST_SHARE = 0.05, 0.4
"""Largest shares of cycles without exactly one answer: up to the first, the rate is good; beyond
the second, the loop trips.
"""
_MOST_EXTRA_FRAMES = 400


@jit
def _number(frame: NDArray[np.uint8], start: int, size: int, signed: int) -> int:
    value = np.int64(0)
    for k in range(size):
        value |= np.int64(frame[start + k]) << np.int64(8 * k)
    if signed and value >> np.int64(8 * size - 1):
        value -= np.int64(1) << np.int64(8 * size)
    return int(value)


@jit
def _difference(new: int, old: int) -> int:
    """Return new − old of a 32-bit counter that wraps around: the smallest signed difference."""
    return (new - old + 0x80000000) % 0x100000000 - 0x80000000


@jit
def decode(
    frames: Frames,
    slots: Ints,
    fields: Ints,
    state_table: Ints,
    ints: Ints,
    floats: FloatArray,
    words: WordArray,
    flags: BoolArray,
    others: Ints,
    last: int,
) -> int:
    """Decode the first `last` of `frames` (k, 16 or more) into the state of n axes.

    `slots` (2048, 2) and `fields` (n, 8, 5) are those of `GroupLayout`. `state_table` (128,) gives
    the state by statusword. `ints`, `floats` and `flags` have the rows named above. `words` (1, n)
    is the statusword. Returns how many more axes have answered. Frames that are not TPDOs of these
    axes are listed in `others` (k + 1,): their number, then the row of each.
    """
    answered = others[0] = 0
    for f in range(last):
        frame = frames[f]
        # byte 3 holds the flags of extended, remote and error frames
        identifier = np.int64(frame[0]) | np.int64(frame[1]) << 8
        known = identifier <= 0x7FF and not frame[2] and not frame[3]
        slot = identifier if known else 0  # this slot belongs to no axis
        i, kind = slots[slot, 0], slots[slot, 1]
        if i < 0 or kind >= EMCY:
            others[0] += 1
            others[others[0]] = f
        if i < 0:
            continue
        ints[FRAMES, i] += 1
        if kind == HEARTBEAT:
            if frame[4]:
                _take_heartbeat(i, int(frame[_DATA]) & 0x7F, ints, flags)
        elif kind == EMCY:
            code = np.int64(frame[_DATA]) | np.int64(frame[_DATA + 1]) << 8
            if frame[4] == 8 and code >> 8:
                ints[EMERGENCY, i] = code
                ints[ALARM, i] |= EMERGENCY_MESSAGE
        else:
            answered += _take_tpdo(i, kind, frame, fields, state_table, ints, floats, words, flags)
    return answered


@jit
def _take_heartbeat(i: int, nmt_state: int, ints: Ints, flags: BoolArray) -> None:
    ints[HEARTBEAT_AGE, i] = 0
    ints[NMT_STATE, i] = nmt_state
    if nmt_state == 0:
        flags[INDEX_KNOWN, i] = False  # a drive that has restarted counts from another origin
        ints[ALARM, i] |= RESTARTED
    elif nmt_state != _OPERATIONAL:
        ints[ALARM, i] |= NOT_OPERATIONAL


@jit
def _take_tpdo(
    i: int,
    pdo: int,
    frame: NDArray[np.uint8],
    fields: Ints,
    state_table: Ints,
    ints: Ints,
    floats: FloatArray,
    words: WordArray,
    flags: BoolArray,
) -> int:
    fields_came = 0
    for k in range(MAX_FIELDS):
        size = fields[i, k, 3]
        if size == 0:
            break
        if fields[i, k, 0] != pdo:
            continue
        start = fields[i, k, 2]
        if start + size > frame[4]:
            return 0  # the frame is shorter than configured
        field = fields[i, k, 1]
        ints[field, i] = _number(frame, _DATA + start, size, fields[i, k, 4])
        fields_came |= 1 << field
    if ints[PROBE_ARMED, i] and ints[PROBE_STATUS, i] & _PROBE_LATCHED:
        behind = _difference(ints[PROBE_POSITION, i], ints[LAST_RAW_POSITION, i])
        floats[INDEX_RAD, i] = (ints[POSITION, i] + behind) * floats[RAD_PER_COUNT, i]
        flags[INDEX_KNOWN, i] = True
        ints[PROBE_ARMED, i] = 0
    if fields_came >> RAW_POSITION & 1:
        # 6064h has 32 bits; the position continues beyond them
        ints[POSITION, i] += _difference(ints[RAW_POSITION, i], ints[LAST_RAW_POSITION, i])
        ints[LAST_RAW_POSITION, i] = ints[RAW_POSITION, i]
        floats[POSITION_RAD, i] = ints[POSITION, i] * floats[RAD_PER_COUNT, i]
    if fields_came >> TORQUE_UNITS & 1:
        floats[TORQUE_NM, i] = ints[TORQUE_UNITS, i] * floats[NM_PER_UNIT, i]
    if fields_came >> STATUSWORD & 1:
        words[0, i] = ints[STATUSWORD, i]
        _follow_state(i, state_table[ints[STATUSWORD, i] & 0x7F], ints)
    # if a TPDO arrives twice, the second counts: the first may be late, from the previous cycle
    expected = ints[TPDOS_EXPECTED, i]
    ints[EXTRA, i] += (ints[TPDOS_RECEIVED, i] & expected) >> pdo & 1
    ints[TPDOS_RECEIVED, i] |= 1 << pdo
    if flags[VALID, i] or ints[TPDOS_RECEIVED, i] & expected != expected:
        return 0
    if ints[TPDOS_RECEIVED, i] & _CYCLE_OVER:
        ints[LATE, i] += 1
        return 0
    flags[VALID, i] = True
    return 1


@jit
def _follow_state(i: int, now: int, ints: Ints) -> None:
    ints[STATE, i] = now
    if now == _ENABLED:
        ints[WAS_ENABLED, i] = 1
        if ints[MODE_DISPLAYED, i] != ints[MODE_REQUESTED, i]:
            ints[ALARM, i] |= WRONG_MODE
        return
    left_uncommanded = ints[WAS_ENABLED, i] and ints[TARGET, i] == _ENABLED
    ints[WAS_ENABLED, i] = 0
    if now in (_REACTION, _FAULT):
        if not ints[ACKNOWLEDGE, i]:
            # a fault cancels the request: only a new request enables the drive again
            ints[TARGET, i] = _SWITCH_ON_DISABLED
            ints[FAULTED, i] = 1
            ints[ALARM, i] |= FAULT
    else:
        if ints[ACKNOWLEDGE, i]:
            ints[ACKNOWLEDGE, i] = 0
            ints[FAULTED, i] = 0
        if left_uncommanded:
            ints[TARGET, i] = _SWITCH_ON_DISABLED
            ints[ALARM, i] |= LEFT_ENABLED


@jit
def end_answers(ints: Ints, floats: FloatArray, flags: BoolArray) -> int:
    """Evaluate the answers of a cycle after the wait for them has ended.

    Count silent cycles, irregular answers, frames and heartbeat ages of n axes, and update `alive`
    and `rate_ok`. Returns the alarm bits of all axes.
    """
    alarms = 0
    for i in range(ints.shape[1]):
        _watch(i, ints, floats, flags)
        alarms |= ints[ALARM, i]
    return alarms


@jit
def encode(
    frames: Frames,
    command_offsets: Ints,
    controlwords: Ints,
    ints: Ints,
    floats: FloatArray,
) -> int:
    """Write controlword and target torque of n axes into their RPDOs `frames` (k, 16).

    `command_offsets` (n, 5) holds the frame and first byte of each, and the number of bytes of
    the torque. `controlwords` (9, 9) holds the word for each pair of target and present state.
    Returns the alarm bits of all axes.
    """
    alarms = 0
    for i in range(ints.shape[1]):
        units = _torque_units(i, ints, floats)
        floats[SENT_NM, i] = units * floats[NM_PER_UNIT, i]
        word = _controlword(i, controlwords, ints)
        row, at = command_offsets[i, CONTROLWORD_FRAME], _DATA + command_offsets[i, CONTROLWORD]
        frames[row, at] = word & 0xFF
        frames[row, at + 1] = (word >> 8) & 0xFF
        row, at = command_offsets[i, TORQUE_FRAME], _DATA + command_offsets[i, TARGET_TORQUE]
        for k in range(command_offsets[i, TORQUE_BYTES]):
            frames[row, at + k] = (units >> 8 * k) & 0xFF
        alarms |= ints[ALARM, i]
    return alarms


@jit
def _watch(i: int, ints: Ints, floats: FloatArray, flags: BoolArray) -> None:
    regular = flags[VALID, i] and ints[EXTRA, i] == 0
    ints[REPEATED, i] += ints[EXTRA, i]
    ints[EXTRA, i] = 0
    ints[TPDOS_RECEIVED, i] |= _CYCLE_OVER
    floats[IRREGULAR, i] += ((0.0 if regular else 1.0) - floats[IRREGULAR, i]) / _MEMORY_CYCLES
    flags[RATE_OK, i] = regular and floats[IRREGULAR, i] < _FAIR_SHARE
    if floats[IRREGULAR, i] > _WORST_SHARE:
        ints[ALARM, i] |= UNSTEADY
    ints[FLOOD, i] = max(ints[FLOOD, i] + ints[FRAMES, i] - ints[FRAMES_ALLOWED, i], 0)
    ints[FRAMES, i] = 0
    if ints[FLOOD, i] > _MOST_EXTRA_FRAMES:
        ints[ALARM, i] |= FLOODING
    if flags[VALID, i]:
        ints[SILENT_CYCLES, i] = 0
    else:
        ints[MISSED, i] += 1
        ints[SILENT_CYCLES, i] += 1
        if ints[SILENT_CYCLES, i] >= ints[SILENCE_LIMIT, i]:
            ints[ALARM, i] |= SILENT
    ints[HEARTBEAT_AGE, i] += 1
    heard = ints[HEARTBEAT_AGE, i] <= ints[HEARTBEAT_LIMIT, i]
    if not heard:
        ints[ALARM, i] |= NO_HEARTBEAT
    operational = ints[NMT_STATE, i] == _OPERATIONAL or ints[NMT_STATE, i] == _NOT_HEARD
    flags[ALIVE, i] = heard and operational and not ints[ALARM, i] & RESTARTED
    if ints[ALARM, i] & LOST:
        ints[TARGET, i] = _SWITCH_ON_DISABLED


@jit
def _torque_units(i: int, ints: Ints, floats: FloatArray) -> int:
    """Return 6071h for an axis.

    The rounding remainder is carried into the next cycle (first-order error feedback), so that
    the error of the mean is far below one unit.
    """
    torque_Nm = floats[COMMAND_NM, i]
    if not np.isfinite(torque_Nm):
        ints[ALARM, i] |= NOT_FINITE
        torque_Nm = 0.0
    if ints[STATE, i] != _ENABLED or ints[TARGET, i] != _ENABLED:
        floats[RESIDUAL_UNITS, i] = 0.0
        return 0
    limit = floats[LIMIT_UNITS, i]
    exact = torque_Nm / floats[NM_PER_UNIT, i] + floats[RESIDUAL_UNITS, i]
    units = min(max(np.rint(exact), -limit), limit)
    floats[RESIDUAL_UNITS, i] = min(max(exact - units, -0.5), 0.5)
    return int(units)


@jit
def _controlword(i: int, controlwords: Ints, ints: Ints) -> int:
    state, target = ints[STATE, i], ints[TARGET, i]
    if target == _ENABLED and ints[MODE_DISPLAYED, i] != ints[MODE_REQUESTED, i]:
        target = _SWITCHED_ON  # no torque before the mode is confirmed
    word = controlwords[target, state]
    if state == _FAULT and ints[ACKNOWLEDGE, i]:
        # the words sent in a fault have bit 7 clear, so this is its rising edge
        word = _FAULT_RESET
        ints[ACKNOWLEDGE, i] -= 1
    elif state == _ENABLED:
        word |= ints[EXTRA_BITS, i]
    return int(word)
