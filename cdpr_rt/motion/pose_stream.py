"""A stream of poses from an input device, played with the delay that its jitter requires.

Samples may be late, repeated, out of order or lost. Each sample contains its time of sending. The
shortest transit time of the last seconds gives the offset of the sender's clock. The longest gives
the playback delay after which the next sample has always arrived.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.core.shared_block import SAMPLES, SharedBlock
from cdpr_rt.jit import bound, jit

# Jitter buffer of the pose stream: it sorts samples and plays them with an adaptive delay. Times
# are in seconds: `NOW` and `ARRIVED` are counted in cycles, the others by the sender's clock since
# the first sample.

QUEUE_LENGTH = 64
"""Largest number of samples that wait to be played."""
SCALE, BUTTONS, COLUMNS = 7, 8, 9
"""Columns of a row, after the pose: x y z, quaternion w x y z."""
PLAYED, ARRIVED, NOW, EARLIEST, EARLIEST_BEFORE = range(5)
_LATEST, _LATEST_BEFORE, _WINDOW_START, _SENDER_ZERO, _INTERVAL = range(5, 10)
SCALARS = 10
"""Places in `scalars`: time played, arrival of the newest sample, the cycle's time, shortest and
longest transits of this window and the previous one, its start, the sender's zero, the interval
between samples."""
SIZE, SESSION, EPOCH, _PLAYED_UP_TO, _HIGHEST = range(5)
ACCEPTED, REPEATED, LATE, REFUSED, MISSING, OVERRUN, OTHER_RIGHT = range(5, 12)
COUNTS = 12
"""Places in `counts`: waiting samples, the session, starts of the stream, the sequence numbers
played and seen, and samples by outcome."""
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


class Posted(NamedTuple):
    """Fields of the posted samples, one slot each."""

    sequence: IntArray
    session: NDArray[np.uint32]
    right: IntArray
    sent_ns: IntArray
    position: FloatArray
    quaternion: FloatArray
    scale: FloatArray
    buttons: NDArray[np.uint32]


class Buffer(NamedTuple):
    """State of the buffer: the row played last, and the waiting samples in order."""

    played: FloatArray
    """The row played last, (COLUMNS,)."""
    times: FloatArray
    """Times of sending, (QUEUE_LENGTH,)."""
    sequences: IntArray
    rows: FloatArray
    """The waiting samples, (QUEUE_LENGTH, COLUMNS)."""
    scalars: FloatArray
    counts: IntArray

    @classmethod
    def empty(cls) -> Buffer:
        """Return a buffer without samples."""
        return cls(
            np.zeros(COLUMNS), np.zeros(QUEUE_LENGTH), np.zeros(QUEUE_LENGTH, np.int64),
            np.zeros((QUEUE_LENGTH, COLUMNS)), np.zeros(SCALARS), np.zeros(COUNTS, np.int64),
        )  # fmt: skip


@jit
def _begin(sent_s: float, sequence: int, session: int, row: FloatArray, buffer: Buffer) -> None:
    """Start the stream with one sample, which is played after an initial delay."""
    scalars, counts = buffer.scalars, buffer.counts
    now = scalars[NOW]
    scalars[_SENDER_ZERO] = sent_s
    scalars[_INTERVAL] = _FIRST_INTERVAL_S
    scalars[_WINDOW_START] = now
    scalars[EARLIEST] = scalars[EARLIEST_BEFORE] = now
    scalars[_LATEST] = scalars[_LATEST_BEFORE] = now
    scalars[PLAYED] = -_INTERVALS_WAITED * _FIRST_INTERVAL_S
    buffer.played[:] = row
    counts[SIZE] = 0
    counts[SESSION] = session
    counts[_PLAYED_UP_TO] = sequence - 1
    counts[_HIGHEST] = sequence
    counts[EPOCH] += 1


@jit
def _valid(row: FloatArray) -> bool:
    """Return whether a sample is valid; normalise its quaternion."""
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
def _insertion_index(sequence: int, sequences: IntArray, size: int) -> int:
    """Return the place of a sample in the queue, -1 if it is a repetition."""
    place = size
    while place > 0 and sequences[place - 1] >= sequence:
        place -= 1
    return -1 if place < size and sequences[place] == sequence else place


@jit
def _continues(
    place: int,
    sent: float,
    row: FloatArray,
    most_m_s: float,
    most_rad_s: float,
    buffer: Buffer,
) -> bool:
    """Return whether clock and pose continue those of the previous sample."""
    scalars, times = buffer.scalars, buffer.times
    before, last = scalars[PLAYED], buffer.played
    if place > 0:
        before, last = times[place - 1], buffer.rows[place - 1]
    earliest = min(scalars[EARLIEST], scalars[EARLIEST_BEFORE])
    transit = scalars[NOW] - sent
    if sent <= before or abs(transit - earliest) > _LARGEST_STEP_OF_CLOCK_S:
        return False
    if place < buffer.counts[SIZE] and sent >= times[place]:
        return False
    squared, along = 0.0, 0.0
    for i in range(3):
        squared += (row[i] - last[i]) ** 2
    for i in range(3, 7):
        along += row[i] * last[i]
    passed = max(sent - before, _SHORTEST_INTERVAL_S)
    turned = 2.0 * math.acos(min(abs(along), 1.0))
    return bool(math.sqrt(squared) <= most_m_s * passed and turned <= most_rad_s * passed)


@jit
def _update_transit(transit: float, scalars: FloatArray) -> None:
    """Update the extreme transit times, also with late samples: otherwise all later ones would be
    late.
    """
    now = scalars[NOW]
    if now - scalars[_WINDOW_START] > _WINDOW_S:
        scalars[_WINDOW_START] = now
        scalars[EARLIEST_BEFORE] = scalars[EARLIEST]
        scalars[_LATEST_BEFORE] = scalars[_LATEST]
        scalars[EARLIEST] = scalars[_LATEST] = transit
    scalars[EARLIEST] = min(scalars[EARLIEST], transit)
    scalars[_LATEST] = max(scalars[_LATEST], transit)


@jit
def _insert(place: int, sent: float, sequence: int, row: FloatArray, buffer: Buffer) -> None:
    """Insert a sample into the queue, and update interval and transits."""
    _, times, sequences, rows, scalars, counts = buffer
    size, now = counts[SIZE], scalars[NOW]
    if place == size and size > 0:
        interval = (sent - times[size - 1]) / (sequence - sequences[size - 1])
        interval = min(max(interval, _SHORTEST_INTERVAL_S), _LONGEST_INTERVAL_S)
        scalars[_INTERVAL] += _INTERVAL_WEIGHT * (interval - scalars[_INTERVAL])
    for k in range(size, place, -1):
        times[k] = times[k - 1]
        sequences[k] = sequences[k - 1]
        rows[k] = rows[k - 1]
    times[place] = sent
    sequences[place] = sequence
    rows[place] = row
    counts[SIZE] = size + 1
    ahead = sequence - counts[_HIGHEST]
    counts[MISSING] += ahead - 1 if ahead > 0 else -1 if ahead < 0 else 0
    counts[_HIGHEST] = max(counts[_HIGHEST], sequence)
    counts[ACCEPTED] += 1
    scalars[ARRIVED] = now
    _update_transit(now - sent, scalars)


@jit
def _accept(
    sequence: int,
    session: int,
    sent_s: float,
    row: FloatArray,
    most_m_s: float,
    most_rad_s: float,
    stopped: bool,
    buffer: Buffer,
) -> None:
    """Accept one sample, or count why it is rejected."""
    scalars, counts = buffer.scalars, buffer.counts
    if not _valid(row):
        counts[REFUSED] += 1
        return
    known = session == counts[SESSION]
    sent = sent_s - scalars[_SENDER_ZERO]
    transit = scalars[NOW] - sent
    if known and sequence <= counts[_PLAYED_UP_TO]:
        counts[LATE] += 1
        if transit - scalars[EARLIEST] < _LONGEST_DELAY_S:
            _update_transit(transit, scalars)
        return
    place = _insertion_index(sequence, buffer.sequences, counts[SIZE]) if known else 0
    if place == -1:
        counts[REPEATED] += 1
        return
    steady = known and not stopped
    if steady and not _continues(place, sent, row, most_m_s, most_rad_s, buffer):
        if sequence < counts[_HIGHEST]:
            counts[LATE] += 1
            return
        steady = False
    if steady and counts[SIZE] == QUEUE_LENGTH:
        counts[REFUSED] += 1
        return
    if not steady:
        _begin(sent_s, sequence, session, row, buffer)
        place, sent = 0, 0.0
    _insert(place, sent, sequence, row, buffer)


@jit
def receive(
    most_m_s: float,
    most_rad_s: float,
    silence_s: float,
    posted: Posted,
    row: FloatArray,
    buffer: Buffer,
    first: int,
    last: int,
    mover: int,
) -> None:
    """Process the posted samples numbered `first` up to `last`; `row` (COLUMNS,) is overwritten.

    Samples of another grant of the right to move than `mover` are only counted.
    """
    scalars = buffer.scalars
    for k in range(first, last):
        slot = k % SAMPLES
        if posted.right[slot] != mover:
            buffer.counts[OTHER_RIGHT] += 1
            continue
        for i in range(3):
            row[i] = posted.position[slot, i]
        for i in range(4):
            row[3 + i] = posted.quaternion[slot, i]
        row[SCALE] = posted.scale[slot]
        row[BUTTONS] = posted.buttons[slot]
        _accept(
            posted.sequence[slot], posted.session[slot], 1e-9 * np.float64(posted.sent_ns[slot]),
            row, most_m_s, most_rad_s, scalars[NOW] - scalars[ARRIVED] > silence_s, buffer,
        )  # fmt: skip


@jit
def _slerp(part: float, towards: FloatArray, quaternion: FloatArray) -> None:
    """Interpolate a unit quaternion towards another, spherically and linearly, in place."""
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
def play(period: float, silence_s: float, buffer: Buffer) -> int:
    """Advance the playback by a cycle, at most to the newest sample; return the state."""
    played, times, sequences, rows, scalars, counts = buffer
    earliest = min(scalars[EARLIEST], scalars[EARLIEST_BEFORE])
    latest = max(scalars[_LATEST], scalars[_LATEST_BEFORE])
    delay = min(latest - earliest + _INTERVALS_WAITED * scalars[_INTERVAL], _LONGEST_DELAY_S)
    behind = scalars[NOW] - earliest - delay - scalars[PLAYED] - period
    pace = min(max(1.0 + behind / _CATCH_UP_S, _SLOWEST), _QUICKEST)
    until = scalars[PLAYED] + pace * period
    passed = 0
    while passed < counts[SIZE] and times[passed] <= until:
        passed += 1
    if passed > 0:
        played[:] = rows[passed - 1]
        scalars[PLAYED] = times[passed - 1]
        counts[_PLAYED_UP_TO] = sequences[passed - 1]
        counts[SIZE] -= passed
        for k in range(counts[SIZE]):
            times[k] = times[k + passed]
            sequences[k] = sequences[k + passed]
            rows[k] = rows[k + passed]
    if counts[SIZE] > 0:
        part = (until - scalars[PLAYED]) / (times[0] - scalars[PLAYED])
        for i in range(3):
            played[i] += part * (rows[0, i] - played[i])
        _slerp(part, rows[0, 3:7], played[3:7])
        scalars[PLAYED] = until
    if scalars[NOW] - scalars[ARRIVED] > silence_s:
        return STOPPED
    return FRESH if counts[SIZE] > 0 else HELD


class StreamState(IntEnum):
    """State of the stream."""

    STOPPED = STOPPED
    """No sample yet, or none within the timeout: the motion must be braked."""
    HELD = HELD
    """All samples have been played, and the last pose is held."""
    FRESH = FRESH
    """A later sample exists, and the pose is interpolated."""


_STATES = tuple(StreamState)
SILENCE_s: Final = 0.5
"""Timeout: the motion must be braked after this time without a sample."""
FASTEST_m_s: Final = 10.0
FASTEST_rad_s: Final = 30.0
"""A faster step between samples is a discontinuity: the stream restarts."""


class PoseStream:
    """Plays the samples of the set-point stream, cycle by cycle; allocates nothing in `update`.

    It plays only samples that were sent under the program's grant of the right to move. It uses no
    clock: each call advances time by one period. The pose is interpolated between samples, never
    extrapolated, and is continuous while `epoch` does not change. The stream restarts with a new
    sender, after a timeout, or after a jump of pose or clock.
    """

    def __init__(self, block: SharedBlock, period_s: float) -> None:
        self._period_s = period_s
        self._posted = block.counters["samples"]
        self._mover = block.counters["mover"]
        samples = block.samples
        posted = Posted(
            samples["sequence"].view(np.int64),  # kernels mix no signed and unsigned numbers
            samples["session"],
            samples["right"].view(np.int64),
            samples["sent_ns"],
            samples["position_m"],
            samples["quaternion"],
            samples["scale"],
            samples["buttons"],
        )
        buffer = Buffer.empty()
        self._played, self._scalars, self._counts = buffer.played, buffer.scalars, buffer.counts
        self._receive = bound(
            receive, FASTEST_m_s, FASTEST_rad_s, SILENCE_s, posted,
            np.zeros(COLUMNS), buffer, then=(0, 0, 0),
        )  # fmt: skip
        self._play = bound(play, period_s, SILENCE_s, buffer)
        self._next = 0
        self._cycles = 0
        self.state = StreamState.STOPPED
        self.pose: FloatArray = self._played[:7]
        """The played pose, (7,): x y z in m, quaternion w x y z. The program interprets it."""
        self.reset()

    def reset(self) -> None:
        """Drop all samples; the next one restarts the stream."""
        self._next = int(self._posted[0])
        self._cycles = 0
        self._scalars[:] = 0.0
        self._scalars[ARRIVED] = -math.inf
        self._counts[SIZE] = 0
        self._counts[SESSION] = -1
        self._counts[EPOCH] += 1
        self._played[:] = 0.0
        self._played[3] = self._played[SCALE] = 1.0
        self.state = StreamState.STOPPED

    def update(self) -> StreamState:
        """Take new samples, advance by one period, and return the state."""
        self._cycles += 1
        self._scalars[NOW] = self._cycles * self._period_s
        posted = int(self._posted[0])
        # one slot may be incomplete, and a new writer may count from 0
        first = min(max(self._next, posted - SAMPLES + 1), posted)
        self._receive(first, posted, int(self._mover[0]))
        if int(self._posted[0]) - first >= SAMPLES:
            self._counts[OVERRUN] += posted - first
            self.reset()  # the samples may have been overwritten while they were read
            return self.state
        self._counts[OVERRUN] += max(0, first - self._next)
        self._next = posted
        self.state = _STATES[self._play()]
        return self.state

    @property
    def epoch(self) -> int:
        """Return a number that changes whenever the stream restarts."""
        return int(self._counts[EPOCH])

    @property
    def session(self) -> int:
        """Return the session's number, -1 before the first sample."""
        return int(self._counts[SESSION])

    @property
    def scale(self) -> float:
        """Return the scale of the stream's motion."""
        return float(self._played[SCALE])

    @property
    def buttons(self) -> int:
        """Return the buttons that are pressed, bit by bit."""
        return int(self._played[BUTTONS])

    @property
    def age_s(self) -> float:
        """Return the age of the newest sample, nan before the first."""
        age = self._scalars[NOW] - self._scalars[ARRIVED]
        return float(age) if math.isfinite(age) else math.nan

    @property
    def delay_s(self) -> float:
        """Return the delay of the playback behind the fastest samples, 0 if stopped."""
        if self.state is StreamState.STOPPED:
            return 0.0
        scalars = self._scalars
        earliest = min(scalars[EARLIEST], scalars[EARLIEST_BEFORE])
        return float(scalars[NOW] - earliest - scalars[PLAYED])

    def counts(self) -> dict[str, int]:
        """Return the numbers of samples accepted, and rejected by reason."""
        counts = self._counts
        return {
            "accepted": int(counts[ACCEPTED]),
            "repeated": int(counts[REPEATED]),
            "late": int(counts[LATE]),
            "refused": int(counts[REFUSED]),
            "missing": int(counts[MISSING]),
            "overrun": int(counts[OVERRUN]),
            "other_right": int(counts[OTHER_RIGHT]),
        }


# Meaning of the 32 button bits of a set-point sample.

_Buttons = TypeVar("_Buttons", int, NDArray[np.int64])

CLUTCH: Final = 1
"""Clutch: while this bit is set, the device moves without the robot."""
_CONFIRMED_AT: Final = 8
_MOST: Final = 255


def stream_buttons(clutch: bool, confirmed: int) -> int:
    """Return the button bits for the clutch's state and the number of confirmations.

    Bits 8 to 15 contain the number: 0 before the first confirmation, then 1 to 255 and again from
    1. So a lost packet does not lose a confirmation.
    """
    count = 0 if confirmed <= 0 else (confirmed - 1) % _MOST + 1
    return (CLUTCH if clutch else 0) | count << _CONFIRMED_AT


def confirmation(buttons: _Buttons) -> _Buttons:
    """Return the number of the last confirmation, 0 before the first; arrays are allowed."""
    return buttons >> _CONFIRMED_AT & _MOST
