"""A stream of poses from a hand that leads, played with the delay that its jitter needs.

Samples come late, twice, in another order or not at all. Each says when it was sent; the shortest
transit of the last seconds tells how the sender's clock stands to the time of our cycles, the
longest how long a sample must wait so that the next one is there before it has been played.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime import pose_playback as playback
from cdpr_rt.runtime.shared_block import SAMPLES, SharedBlock


class StreamState(IntEnum):
    """What the stream is worth just now."""

    STOPPED = playback.STOPPED
    """Nothing came for longer than may be, or nothing yet: the motion is to be braked."""
    HELD = playback.HELD
    """All that came has been played: the last pose stays."""
    FRESH = playback.FRESH
    """There is a later sample: the pose is interpolated."""


_STATES = tuple(StreamState)


@dataclass(frozen=True)
class StreamSettings:
    """How long silence is borne, and how fast a hand may be."""

    silence_s: float = 0.5
    """After so long without a sample the motion is to be braked."""
    hand_speed_m_s: float = 10.0
    """Who is faster has let go, or was somewhere else meanwhile: the stream begins anew."""


class PoseStream:
    """Plays the samples of the set-point stream, cycle by cycle; allocates nothing in `update`.

    Only samples that came under the taking of the right to move on whose behalf the loop moves are
    played. It knows no clock: time passes by one period a call. What is played is interpolated
    between samples, never beyond the last one, and is continuous as long as `epoch` stays the same:
    with a new sender, after a silence, or after a leap of hand or clock the stream begins anew.
    """

    def __init__(
        self, block: SharedBlock, period_s: float, settings: StreamSettings = StreamSettings()
    ) -> None:
        self._period_s = period_s
        self._settings = settings
        self._posted = block.counters["samples"]
        self._mover = block.counters["mover"]
        samples = block.samples
        self._fields = (
            samples["sequence"].view(np.int64),  # kernels mix no signed and unsigned numbers
            samples["session"],
            samples["right"].view(np.int64),
            samples["sent_ns"],
            samples["position_m"],
            samples["quaternion"],
            samples["scale"],
            samples["buttons"],
        )
        self._row = np.zeros(playback.COLUMNS)
        self._played = np.zeros(playback.COLUMNS)
        self._numbers = np.zeros(playback.NUMBERS)
        self._whole = np.zeros(playback.WHOLE, np.int64)
        self._kept = (
            self._played,
            np.zeros(playback.KEPT),
            np.zeros(playback.KEPT, np.int64),
            np.zeros((playback.KEPT, playback.COLUMNS)),
            self._numbers,
            self._whole,
        )
        self._next = 0
        self._cycles = 0
        self.state = StreamState.STOPPED
        self.pose: FloatArray = self._played[:7]
        """What is played: x y z in m, quaternion w x y z. Its meaning is the program's."""
        self.update()  # compiled here, not when the first sample comes
        self.reset()

    def reset(self) -> None:
        """Forget what came up to now; the next sample begins anew."""
        self._next = int(self._posted[0])
        self._cycles = 0
        self._numbers[:] = 0.0
        self._numbers[playback.ARRIVED] = -math.inf
        self._whole[playback.SIZE] = 0
        self._whole[playback.SESSION] = -1
        self._whole[playback.EPOCH] += 1
        self._played[:] = 0.0
        self._played[3] = self._played[playback.SCALE] = 1.0
        self.state = StreamState.STOPPED

    def update(self) -> StreamState:
        """Take what came, play one period, and return what the stream is worth."""
        self._cycles += 1
        self._numbers[playback.NOW] = self._cycles * self._period_s
        posted = int(self._posted[0])
        # one slot is perhaps being written; a new writer may begin to count anew
        first = min(max(self._next, posted - SAMPLES + 1), posted)
        self._receive(first, posted)
        if int(self._posted[0]) - first >= SAMPLES:
            self._whole[playback.OVERRUN] += posted - first
            self.reset()  # perhaps overwritten while they were read
            return self.state
        self._whole[playback.OVERRUN] += max(0, first - self._next)
        self._next = posted
        self.state = _STATES[playback.play(self._period_s, self._settings.silence_s, *self._kept)]
        return self.state

    def _receive(self, first: int, last: int) -> None:
        settings = self._settings
        playback.receive(
            first,
            last,
            *self._fields,
            int(self._mover[0]),
            settings.hand_speed_m_s,
            settings.silence_s,
            self._row,
            *self._kept,
        )

    @property
    def epoch(self) -> int:
        """Return a number that is another one whenever the stream has begun anew."""
        return int(self._whole[playback.EPOCH])

    @property
    def session(self) -> int:
        """Return the sender's number, -1 before the first sample."""
        return int(self._whole[playback.SESSION])

    @property
    def scale(self) -> float:
        """Return by how much the leading hand's motion is to be made larger."""
        return float(self._played[playback.SCALE])

    @property
    def buttons(self) -> int:
        """Return the buttons that are pressed, bit by bit."""
        return int(self._played[playback.BUTTONS])

    @property
    def age_s(self) -> float:
        """Return how long ago the newest sample came, nan before the first."""
        age = self._numbers[playback.NOW] - self._numbers[playback.ARRIVED]
        return float(age) if math.isfinite(age) else math.nan

    @property
    def delay_s(self) -> float:
        """Return by how much what is played lies behind the quickest samples, 0 where stopped."""
        if self.state is StreamState.STOPPED:
            return 0.0
        numbers = self._numbers
        earliest = min(numbers[playback.EARLIEST], numbers[playback.EARLIEST_BEFORE])
        return float(numbers[playback.NOW] - earliest - numbers[playback.PLAYED])

    def counts(self) -> dict[str, int]:
        """Return how many samples were accepted, and how many were not, by reason."""
        whole = self._whole
        return {
            "accepted": int(whole[playback.ACCEPTED]),
            "repeated": int(whole[playback.REPEATED]),
            "late": int(whole[playback.LATE]),
            "refused": int(whole[playback.REFUSED]),
            "missing": int(whole[playback.MISSING]),
            "overrun": int(whole[playback.OVERRUN]),
            "other_right": int(whole[playback.OTHER_RIGHT]),
        }
