"""A stream of poses from an input device, played with the delay that its jitter needs.

Samples come late, twice, out of order or not at all. Each carries its time of sending; the shortest
transit of the last seconds gives the offset of the sender's clock, the longest the delay after
which the next sample has arrived before it is due.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.shared_block import SAMPLES, SharedBlock
from cdpr_rt.jit import bound
from cdpr_rt.motion import jitter_buffer as playback


class StreamState(IntEnum):
    """State of the stream."""

    STOPPED = playback.STOPPED
    """No sample yet, or none within the time-out: the motion is to be braked."""
    HELD = playback.HELD
    """All samples have been played: the last pose is held."""
    FRESH = playback.FRESH
    """There is a later sample: the pose is interpolated."""


_STATES = tuple(StreamState)
SILENCE_s: Final = 0.5
"""Time-out: the motion is to be braked after so long without a sample."""
FASTEST_m_s: Final = 10.0
FASTEST_rad_s: Final = 30.0
"""A faster step between samples is a discontinuity: the stream starts anew."""


class PoseStream:
    """Plays the samples of the set-point stream, cycle by cycle; allocates nothing in `update`.

    Only samples of the grant of the right to move under which the program runs are played. It knows
    no clock: time passes by one period a call. The pose is interpolated between samples, never
    extrapolated, and is continuous while `epoch` stays the same: with a new sender, after a
    time-out, or after a jump of pose or clock the stream starts anew.
    """

    def __init__(self, block: SharedBlock, period_s: float) -> None:
        self._period_s = period_s
        self._posted = block.counters["samples"]
        self._mover = block.counters["mover"]
        samples = block.samples
        posted = playback.Posted(
            samples["sequence"].view(np.int64),  # kernels mix no signed and unsigned numbers
            samples["session"],
            samples["right"].view(np.int64),
            samples["sent_ns"],
            samples["position_m"],
            samples["quaternion"],
            samples["scale"],
            samples["buttons"],
        )
        buffer = playback.Buffer.empty()
        self._played, self._scalars, self._counts = buffer.played, buffer.scalars, buffer.counts
        self._receive = bound(
            playback.receive, FASTEST_m_s, FASTEST_rad_s, SILENCE_s, posted,
            np.zeros(playback.COLUMNS), buffer, then=(0, 0, 0),
        )  # fmt: skip
        self._play = bound(playback.play, period_s, SILENCE_s, buffer)
        self._next = 0
        self._cycles = 0
        self.state = StreamState.STOPPED
        self.pose: FloatArray = self._played[:7]
        """The pose played, (7,): x y z in m, quaternion w x y z. Its meaning is the program's."""
        self.reset()

    def reset(self) -> None:
        """Drop all samples; the next one starts the stream anew."""
        self._next = int(self._posted[0])
        self._cycles = 0
        self._scalars[:] = 0.0
        self._scalars[playback.ARRIVED] = -math.inf
        self._counts[playback.SIZE] = 0
        self._counts[playback.SESSION] = -1
        self._counts[playback.EPOCH] += 1
        self._played[:] = 0.0
        self._played[3] = self._played[playback.SCALE] = 1.0
        self.state = StreamState.STOPPED

    def update(self) -> StreamState:
        """Take new samples, advance by one period, and return the state."""
        self._cycles += 1
        self._scalars[playback.NOW] = self._cycles * self._period_s
        posted = int(self._posted[0])
        # one slot may be being written; a new writer may count from 0
        first = min(max(self._next, posted - SAMPLES + 1), posted)
        self._receive(first, posted, int(self._mover[0]))
        if int(self._posted[0]) - first >= SAMPLES:
            self._counts[playback.OVERRUN] += posted - first
            self.reset()  # they may have been overwritten while they were read
            return self.state
        self._counts[playback.OVERRUN] += max(0, first - self._next)
        self._next = posted
        self.state = _STATES[self._play()]
        return self.state

    @property
    def epoch(self) -> int:
        """Return a number that changes whenever the stream starts anew."""
        return int(self._counts[playback.EPOCH])

    @property
    def session(self) -> int:
        """Return the session's number, -1 before the first sample."""
        return int(self._counts[playback.SESSION])

    @property
    def scale(self) -> float:
        """Return the scale of the stream's motion."""
        return float(self._played[playback.SCALE])

    @property
    def buttons(self) -> int:
        """Return the buttons that are pressed, bit by bit."""
        return int(self._played[playback.BUTTONS])

    @property
    def age_s(self) -> float:
        """Return how long ago the newest sample came, nan before the first."""
        age = self._scalars[playback.NOW] - self._scalars[playback.ARRIVED]
        return float(age) if math.isfinite(age) else math.nan

    @property
    def delay_s(self) -> float:
        """Return the delay of the playback behind the fastest samples, 0 where stopped."""
        if self.state is StreamState.STOPPED:
            return 0.0
        scalars = self._scalars
        earliest = min(scalars[playback.EARLIEST], scalars[playback.EARLIEST_BEFORE])
        return float(scalars[playback.NOW] - earliest - scalars[playback.PLAYED])

    def counts(self) -> dict[str, int]:
        """Return how many samples were accepted, and how many refused, by reason."""
        counts = self._counts
        return {
            "accepted": int(counts[playback.ACCEPTED]),
            "repeated": int(counts[playback.REPEATED]),
            "late": int(counts[playback.LATE]),
            "refused": int(counts[playback.REFUSED]),
            "missing": int(counts[playback.MISSING]),
            "overrun": int(counts[playback.OVERRUN]),
            "other_right": int(counts[playback.OTHER_RIGHT]),
        }
