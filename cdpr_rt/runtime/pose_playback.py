"""Kernels of the pose stream: samples put in order, and played with the delay they need.

Times are in seconds: `NOW` and `ARRIVED` those of our cycles, the others those of the sender's
clock from the first sample on.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.exchange import FloatArray
from cdpr_rt.jit import jit
from cdpr_rt.runtime.shared_block import SAMPLES

IntArray = NDArray[np.int64]

KEPT = 64
"""Samples that may wait to be played."""
SCALE, BUTTONS, COLUMNS = 7, 8, 9
"""Columns of a row, behind the pose: x y z, quaternion w x y z."""
PLAYED, ARRIVED, NOW, EARLIEST, EARLIEST_BEFORE = range(5)
_LATEST, _LATEST_BEFORE, _TURNED, _BASE, _INTERVAL = range(5, 10)
NUMBERS = 10
"""The numbers that change: time played, arrival of the newest sample, the cycle's time, shortest
and longest transits of this window and the one before, its begin, the sender's zero, the interval
between samples."""
SIZE, SESSION, EPOCH, _DONE, _HIGHEST = range(5)
ACCEPTED, REPEATED, LATE, REFUSED, MISSING, OVERRUN, OTHER_RIGHT = range(5, 12)
WHOLE = 12
"""The whole ones: samples that wait, the sender, how often the stream has begun, the sequence
numbers played and seen, and what became of the samples."""
STOPPED, HELD, FRESH = range(3)

_WINDOW_S = 2.0
_SHORTEST_INTERVAL_S, _FIRST_INTERVAL_S, _LONGEST_INTERVAL_S = 0.002, 1.0 / 30.0, 0.1
_INTERVAL_WEIGHT = 0.1
_INTERVALS_WAITED = 1.5
_LONGEST_DELAY_S = 0.3
_CATCH_UP_S = 0.1
_SLOWEST, _QUICKEST = 0.8, 2.0
_LARGEST_STEP_OF_CLOCK_S = 1.0
_NORM_TOLERANCE = 0.1
_LARGEST_SCALE = 1000.0
_NEARLY_PARALLEL = 1.0 - 1e-9


@jit
def _begin(
    now: float,
    sent_s: float,
    sequence: int,
    session: int,
    row: FloatArray,
    played: FloatArray,
    numbers: FloatArray,
    whole: IntArray,
) -> None:
    """Begin with one sample as if nothing had come before; it is played after a first delay."""
    numbers[_BASE] = sent_s
    numbers[_INTERVAL] = _FIRST_INTERVAL_S
    numbers[_TURNED] = now
    numbers[EARLIEST] = numbers[EARLIEST_BEFORE] = now
    numbers[_LATEST] = numbers[_LATEST_BEFORE] = now
    numbers[PLAYED] = -_INTERVALS_WAITED * _FIRST_INTERVAL_S
    played[:] = row
    whole[SIZE] = 0
    whole[SESSION] = session
    whole[_DONE] = sequence - 1
    whole[_HIGHEST] = sequence
    whole[EPOCH] += 1


@jit
def _sound(row: FloatArray) -> bool:
    """Return whether a sample can be meant, with its quaternion brought to length 1."""
    norm = 0.0
    for i in range(BUTTONS):
        if not math.isfinite(row[i]):
            return False
    for i in range(3, 7):
        norm += row[i] * row[i]
    norm = math.sqrt(norm)
    if abs(norm - 1.0) > _NORM_TOLERANCE or not 0.0 <= row[SCALE] <= _LARGEST_SCALE:
        return False
    for i in range(3, 7):
        row[i] /= norm
    return True


@jit
def _place_of(sequence: int, orders: IntArray, size: int) -> int:
    """Return where a sample belongs among those that wait, -1 where it is one of them."""
    place = size
    while place > 0 and orders[place - 1] >= sequence:
        place -= 1
    return -1 if place < size and orders[place] == sequence else place


@jit
def _fits(
    place: int,
    sent: float,
    row: FloatArray,
    most_m_s: float,
    played: FloatArray,
    times: FloatArray,
    rows: FloatArray,
    numbers: FloatArray,
    whole: IntArray,
) -> bool:
    """Return whether clock and hand go on steadily from the sample before."""
    before, last = numbers[PLAYED], played
    if place > 0:
        before, last = times[place - 1], rows[place - 1]
    earliest = min(numbers[EARLIEST], numbers[EARLIEST_BEFORE])
    transit = numbers[NOW] - sent
    if sent <= before or abs(transit - earliest) > _LARGEST_STEP_OF_CLOCK_S:
        return False
    if place < whole[SIZE] and sent >= times[place]:
        return False
    way = 0.0
    for i in range(3):
        way += (row[i] - last[i]) ** 2
    return bool(math.sqrt(way) <= most_m_s * max(sent - before, _SHORTEST_INTERVAL_S))


@jit
def _learn(transit: float, numbers: FloatArray) -> None:
    """Note how long a sample took, late ones too, lest all that follow are late."""
    now = numbers[NOW]
    if now - numbers[_TURNED] > _WINDOW_S:
        numbers[_TURNED] = now
        numbers[EARLIEST_BEFORE] = numbers[EARLIEST]
        numbers[_LATEST_BEFORE] = numbers[_LATEST]
        numbers[EARLIEST] = numbers[_LATEST] = transit
    numbers[EARLIEST] = min(numbers[EARLIEST], transit)
    numbers[_LATEST] = max(numbers[_LATEST], transit)


@jit
def _keep(
    place: int,
    sent: float,
    sequence: int,
    row: FloatArray,
    times: FloatArray,
    orders: IntArray,
    rows: FloatArray,
    numbers: FloatArray,
    whole: IntArray,
) -> None:
    """Put a sample at its place among those that wait, and learn from its transit."""
    size, now = whole[SIZE], numbers[NOW]
    if place == size and size > 0:
        interval = (sent - times[size - 1]) / (sequence - orders[size - 1])
        interval = min(max(interval, _SHORTEST_INTERVAL_S), _LONGEST_INTERVAL_S)
        numbers[_INTERVAL] += _INTERVAL_WEIGHT * (interval - numbers[_INTERVAL])
    for k in range(size, place, -1):
        times[k] = times[k - 1]
        orders[k] = orders[k - 1]
        rows[k] = rows[k - 1]
    times[place] = sent
    orders[place] = sequence
    rows[place] = row
    whole[SIZE] = size + 1
    ahead = sequence - whole[_HIGHEST]
    whole[MISSING] += ahead - 1 if ahead > 0 else -1 if ahead < 0 else 0
    whole[_HIGHEST] = max(whole[_HIGHEST], sequence)
    whole[ACCEPTED] += 1
    numbers[ARRIVED] = now
    _learn(now - sent, numbers)


@jit
def _take(
    sequence: int,
    session: int,
    sent_s: float,
    row: FloatArray,
    most_m_s: float,
    stopped: bool,
    played: FloatArray,
    times: FloatArray,
    orders: IntArray,
    rows: FloatArray,
    numbers: FloatArray,
    whole: IntArray,
) -> None:
    """Take one sample, or count why it is not taken."""
    if not _sound(row):
        whole[REFUSED] += 1
        return
    known = session == whole[SESSION]
    sent = sent_s - numbers[_BASE]
    transit = numbers[NOW] - sent
    if known and sequence <= whole[_DONE]:
        whole[LATE] += 1
        if transit - numbers[EARLIEST] < _LONGEST_DELAY_S:
            _learn(transit, numbers)
        return
    place = _place_of(sequence, orders, whole[SIZE]) if known else 0
    if place == -1:
        whole[REPEATED] += 1
        return
    steady = known and not stopped
    if steady and not _fits(place, sent, row, most_m_s, played, times, rows, numbers, whole):
        if sequence < whole[_HIGHEST]:
            whole[LATE] += 1
            return
        steady = False
    if steady and whole[SIZE] == KEPT:
        whole[REFUSED] += 1
        return
    if not steady:
        _begin(numbers[NOW], sent_s, sequence, session, row, played, numbers, whole)
        place, sent = 0, 0.0
    _keep(place, sent, sequence, row, times, orders, rows, numbers, whole)


@jit
def receive(
    first: int,
    last: int,
    sequence: IntArray,
    session: NDArray[np.uint32],
    right: IntArray,
    sent_ns: IntArray,
    position: FloatArray,
    quaternion: FloatArray,
    scale: FloatArray,
    buttons: NDArray[np.uint32],
    mover: int,
    most_m_s: float,
    silence_s: float,
    row: FloatArray,
    played: FloatArray,
    times: FloatArray,
    orders: IntArray,
    rows: FloatArray,
    numbers: FloatArray,
    whole: IntArray,
) -> None:
    """Take what was posted since: the samples numbered from `first` up to `last`.

    Those that came under another right to move than the mover's are only counted.
    """
    for k in range(first, last):
        slot = k % SAMPLES
        if right[slot] != mover:
            whole[OTHER_RIGHT] += 1
            continue
        for i in range(3):
            row[i] = position[slot, i]
        for i in range(4):
            row[3 + i] = quaternion[slot, i]
        row[SCALE] = scale[slot]
        row[BUTTONS] = buttons[slot]
        _take(
            sequence[slot],
            session[slot],
            1e-9 * np.float64(sent_ns[slot]),
            row,
            most_m_s,
            numbers[NOW] - numbers[ARRIVED] > silence_s,
            played,
            times,
            orders,
            rows,
            numbers,
            whole,
        )


@jit
def _turn(part: float, towards: FloatArray, quaternion: FloatArray) -> None:
    """Turn a unit quaternion by a part of the shortest way towards another, at constant speed."""
    along = 0.0
    for i in range(4):
        along += quaternion[i] * towards[i]
    sign = 1.0 if along >= 0.0 else -1.0
    here, there = 1.0 - part, sign * part
    if sign * along < _NEARLY_PARALLEL:
        angle = math.acos(min(sign * along, 1.0))
        here = math.sin((1.0 - part) * angle) / math.sin(angle)
        there = sign * math.sin(part * angle) / math.sin(angle)
    norm = 0.0
    for i in range(4):
        quaternion[i] = here * quaternion[i] + there * towards[i]
        norm += quaternion[i] * quaternion[i]
    norm = math.sqrt(norm)
    for i in range(4):
        quaternion[i] /= norm


@jit
def play(
    period: float,
    silence_s: float,
    played: FloatArray,
    times: FloatArray,
    orders: IntArray,
    rows: FloatArray,
    numbers: FloatArray,
    whole: IntArray,
) -> int:
    """Play one cycle's time, never beyond the newest sample; return the state."""
    earliest = min(numbers[EARLIEST], numbers[EARLIEST_BEFORE])
    latest = max(numbers[_LATEST], numbers[_LATEST_BEFORE])
    delay = min(latest - earliest + _INTERVALS_WAITED * numbers[_INTERVAL], _LONGEST_DELAY_S)
    behind = numbers[NOW] - earliest - delay - numbers[PLAYED] - period
    pace = min(max(1.0 + behind / _CATCH_UP_S, _SLOWEST), _QUICKEST)
    until = numbers[PLAYED] + pace * period
    passed = 0
    while passed < whole[SIZE] and times[passed] <= until:
        passed += 1
    if passed > 0:
        played[:] = rows[passed - 1]
        numbers[PLAYED] = times[passed - 1]
        whole[_DONE] = orders[passed - 1]
        whole[SIZE] -= passed
        for k in range(whole[SIZE]):
            times[k] = times[k + passed]
            orders[k] = orders[k + passed]
            rows[k] = rows[k + passed]
    if whole[SIZE] > 0:
        part = (until - numbers[PLAYED]) / (times[0] - numbers[PLAYED])
        for i in range(3):
            played[i] += part * (rows[0, i] - played[i])
        _turn(part, rows[0, 3:7], played[3:7])
        numbers[PLAYED] = until
    if numbers[NOW] - numbers[ARRIVED] > silence_s:
        return STOPPED
    return FRESH if whole[SIZE] > 0 else HELD
