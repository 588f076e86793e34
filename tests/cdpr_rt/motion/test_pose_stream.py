"""Playback of the set-point stream: continuous, in order, never ahead of the samples sent."""

import heapq
import itertools

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from cdpr_rt.core.shared_block import SAMPLE, SharedBlock
from cdpr_rt.motion.pose_stream import PoseStream, SILENCE_s, StreamState

PERIOD_S = 0.004
IDENTITY = (1.0, 0.0, 0.0, 0.0)


class Sender:
    """A sender with a separate clock, and a network with delays."""

    def __init__(self, offset_ns: int = 7_000_000_000_000) -> None:
        self.block = SharedBlock.create(1, 1.0, 100.0)
        self.stream = PoseStream(self.block, PERIOD_S)
        self.offset_ns = offset_ns
        self.now_s = 0.0
        self._number = itertools.count()
        self._waiting: list[tuple[float, int, np.void]] = []

    def send(
        self,
        sequence: int,
        sent_s: float,
        position: tuple[float, float, float],
        transit_s: float = 0.0,
        quaternion: tuple[float, ...] = IDENTITY,
        session: int = 1,
        scale: float = 1.0,
        buttons: int = 0,
        right: int = 0,
    ) -> None:
        row = np.zeros((), SAMPLE)
        row["sequence"], row["session"], row["scale"] = sequence, session, scale
        row["sent_ns"] = self.offset_ns + round(sent_s * 1e9)
        row["position_m"], row["quaternion"], row["buttons"] = position, quaternion, buttons
        row["right"] = right
        heapq.heappush(self._waiting, (sent_s + transit_s, next(self._number), row))

    def cycle(self) -> StreamState:
        self.now_s += PERIOD_S
        while self._waiting and self._waiting[0][0] <= self.now_s:
            self.block.post_sample(heapq.heappop(self._waiting)[2])
        return self.stream.update()

    def run(self, seconds: float) -> tuple[np.ndarray, np.ndarray]:
        """Return poses (k, 7) and states (k,)."""
        poses, states = [], []
        for _ in range(round(seconds / PERIOD_S)):
            states.append(self.cycle())
            poses.append(self.stream.pose.copy())
        return np.array(poses), np.array(states)


def wave(t: float) -> tuple[float, float, float]:
    return (0.1 * np.sin(2.0 * t), 0.05 * np.cos(3.0 * t), 0.02 * t)


def test_an_even_stream_is_interpolated_at_its_delay() -> None:
    sender = Sender()
    for k in range(120):
        sender.send(k, k / 60.0, wave(k / 60.0), transit_s=0.02)
    poses, states = sender.run(1.8)
    played = np.arange(1, len(poses) + 1) * PERIOD_S - 0.02 - sender.stream.delay_s
    settled = slice(250, None)
    assert np.all(states[settled] == StreamState.FRESH)
    assert 0.02 < sender.stream.delay_s < 0.04  # one and a half intervals of 1/60 s
    ticks = np.arange(120) / 60.0
    expected = np.interp(played[settled], ticks, [wave(t)[0] for t in ticks])
    np.testing.assert_allclose(poses[settled, 0], expected, atol=1e-4)
    counts = sender.stream.counts()
    assert counts == {**dict.fromkeys(counts, 0), "accepted": counts["accepted"]}


transits = st.lists(st.floats(0.0, 0.05), min_size=60, max_size=60)
dropped = st.sets(st.integers(1, 59), max_size=12)
doubled = st.lists(st.booleans(), min_size=60, max_size=60)


@settings(max_examples=60)
@given(transits, dropped, doubled, st.sampled_from([30.0, 60.0]), st.integers(0, 1 << 61))
def test_loss_jitter_duplicates_and_reordering_cause_no_leaps(
    transits: list[float], dropped: set[int], doubled: list[bool], rate: float, offset_ns: int
) -> None:
    sender = Sender(offset_ns)
    speed = 0.3
    for k, (transit, twice) in enumerate(zip(transits, doubled, strict=True)):
        t = k / rate
        if k not in dropped:
            sender.send(k, t, (speed * t, 0.0, 0.0), transit)
        if twice:
            sender.send(k, t, (speed * t, 0.0, 0.0), transit + 0.01)
    poses, states = sender.run(60 / rate + 0.45)
    begun = np.flatnonzero(states != StreamState.STOPPED)[0]
    x = poses[begun:, 0]
    steps = np.diff(x)
    # playback goes at up to twice the speed, never backwards, and up to the last sample
    assert np.all(steps >= -1e-12)
    assert np.all(steps <= 2.0 * speed * PERIOD_S + 1e-9)
    sent = [k for k in range(60) if doubled[k] or k not in dropped]
    assert x[-1] == pytest.approx(speed * sent[-1] / rate, abs=1e-9)
    counts = sender.stream.counts()
    assert counts["accepted"] + counts["late"] >= len(set(sent))
    assert counts["refused"] == counts["overrun"] == 0


@settings(max_examples=40)
@given(st.lists(st.floats(0.0, 0.15), min_size=30, max_size=30))
def test_the_delay_adapts_to_jitter_within_seconds(transits: list[float]) -> None:
    sender = Sender()
    for k in range(150):
        sender.send(k, k / 30.0, wave(k / 30.0), transits[k % 30])
    sender.run(3.0)
    late = sender.stream.counts()["late"]
    _, states = sender.run(1.7)
    assert sender.stream.counts()["late"] == late
    assert np.all(states == StreamState.FRESH)
    assert sender.stream.delay_s <= max(transits) - min(transits) + 0.06


def test_a_silent_stream_holds_then_stops_and_later_samples_start_again() -> None:
    sender = Sender()
    for k in range(31):
        sender.send(k, k / 30.0, (k / 30.0, 0.0, 0.0))
    for k in range(31, 60):
        sender.send(k, 1.0 + k / 30.0, (5.0 + k / 30.0, 0.0, 0.0))
    _, states = sender.run(1.6)
    changes = states[1:][np.diff(states) != 0]
    order = [StreamState.FRESH, StreamState.HELD, StreamState.STOPPED]
    assert list(changes) == order[1:]
    assert states[0] == StreamState.FRESH
    stopped_s = (np.flatnonzero(states == StreamState.STOPPED)[0] + 1) * PERIOD_S
    assert stopped_s == pytest.approx(1.0 + SILENCE_s, abs=2 * PERIOD_S)
    assert sender.stream.pose[0] == 1.0
    epoch = sender.stream.epoch
    poses, _ = sender.run(1.5)
    assert sender.stream.epoch == epoch + 1
    assert poses[-1, 0] == pytest.approx(5.0 + 59 / 30.0)


def test_a_new_session_starts_again_and_samples_of_the_old_one_are_ignored() -> None:
    sender = Sender()
    for k in range(30):
        sender.send(k, k / 30.0, (0.1, 0.0, 0.0))
        sender.send(500 - k, k / 30.0 + 1.0, (0.2, 0.0, 0.0), session=2)
    sender.run(0.9)
    first = sender.stream.epoch
    sender.run(0.3)
    assert (sender.stream.session, sender.stream.epoch) == (2, first + 1)
    assert sender.stream.pose[0] == 0.2


@pytest.mark.parametrize(
    "change",
    [
        {"position": (np.nan, 0.0, 0.0)},
        {"position": (0.0, np.inf, 0.0)},
        {"quaternion": (0.0, 0.0, 0.0, 0.0)},
        {"quaternion": (np.nan, 0.0, 0.0, 1.0)},
        {"scale": -1.0},
        {"scale": np.nan},
        {"scale": 1e9},
    ],
)
def test_implausible_samples_are_rejected(change: dict[str, object]) -> None:
    sender = Sender()
    sender.send(0, 0.0, (0.0, 0.0, 0.0))
    bad: dict[str, object] = {"sequence": 1, "sent_s": 0.03, "position": (0.01, 0.0, 0.0)}
    sender.send(**{**bad, **change})  # type: ignore[arg-type]
    sender.send(2, 0.06, (0.02, 0.0, 0.0))
    poses, _ = sender.run(0.3)
    assert np.all(np.isfinite(poses))
    assert sender.stream.counts()["refused"] == 1
    assert sender.stream.pose[0] == 0.02


@pytest.mark.parametrize(
    ("position", "sent_s"),
    [((1.5, 0.0, 0.0), 0.5 + 1 / 30), ((0.5, 0.0, 0.0), -100.0), ((0.5, 0.0, 0.0), 100.0)],
    ids=["the hand leaps", "the clock goes back", "the clock goes forth"],
)
def test_a_leap_of_position_or_clock_starts_again(
    position: tuple[float, float, float], sent_s: float
) -> None:
    sender = Sender()
    for k in range(16):
        sender.send(k, k / 30.0, (k / 30.0, 0.0, 0.0))
    sender.run(0.51)
    epoch = sender.stream.epoch
    sender.send(16, sent_s, position, transit_s=0.52 - sent_s)
    sender.send(17, sent_s + 1 / 30, position, transit_s=0.52 - sent_s)
    sender.run(0.2)
    assert sender.stream.epoch == epoch + 1
    assert sender.stream.pose[0] == position[0]
    assert sender.stream.state == StreamState.HELD


rotations = st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3)


@settings(max_examples=50)
@given(rotations, st.booleans())
@example([1e-9, 0.0, 0.0], True)
def test_rotation_is_interpolated_evenly_on_the_shortest_way(
    turn: list[float], flipped: bool
) -> None:
    there = Rotation.from_rotvec(np.array(turn) * (0.9 * np.pi / (2.0 * np.sqrt(3.0))))
    x, y, z, w = there.as_quat()
    sign = -1.0 if flipped else 1.0
    sender = Sender()
    sender.send(0, 0.0, (0.0, 0.0, 0.0))
    sender.send(1, 0.1, (0.1, 0.0, 0.0), quaternion=(sign * w, sign * x, sign * y, sign * z))
    poses, _ = sender.run(0.4)
    parts = poses[:, 0] / 0.1
    between = Slerp([0.0, 1.0], Rotation.concatenate([Rotation.identity(), there]))
    expected = between(np.clip(parts, 0.0, 1.0))
    got = Rotation.from_quat(poses[:, [4, 5, 6, 3]])
    assert np.max((expected.inv() * got).magnitude()) < 1e-6
    np.testing.assert_allclose(np.linalg.norm(poses[:, 3:], axis=1), 1.0, atol=1e-12)


words = st.integers(0, 2**64 - 1)
numbers = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=100)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([0, 1, 2, 2**63 - 1, 2**63, 2**64 - 1]) | words,
            st.integers(-(2**63), 2**63 - 1),
            st.tuples(numbers, numbers, numbers),
            numbers,
            st.integers(0, 2),
            st.integers(0, 90),
        ),
        max_size=40,
    )
)
def test_random_samples_never_give_an_infinite_pose(samples: list[tuple[object, ...]]) -> None:
    sender = Sender()
    row = np.zeros((), SAMPLE)
    for sequence, sent_ns, position, scale, session, copies in samples:
        row["sequence"], row["sent_ns"], row["session"] = sequence, sent_ns, session
        row["position_m"], row["scale"], row["quaternion"] = position, scale, IDENTITY
        for _ in range(copies):  # type: ignore[call-overload]
            sender.block.post_sample(row)
            row["sequence"] += np.uint64(1)
        sender.cycle()
        assert np.all(np.isfinite(sender.stream.pose))
        assert np.isfinite(sender.stream.scale)
    sender.run(0.6)
    assert sender.stream.state == StreamState.STOPPED


def test_samples_beyond_the_ring_are_counted_as_overrun() -> None:
    sender = Sender()
    for k in range(200):
        sender.send(k, k * 1e-3, (0.0, 0.0, 0.0), transit_s=0.3 - k * 1e-3)
    sender.run(0.31)
    counts = sender.stream.counts()
    assert counts["overrun"] == 200 - 63
    assert counts["accepted"] + counts["late"] == 63


def test_samples_overwritten_during_reading_are_ignored() -> None:
    sender = Sender()
    sender.send(0, 0.0, (0.1, 0.0, 0.0))
    sender.run(0.1)
    posted = sender.block.counters["samples"]

    class Racing:
        """The writer's counter, as seen by a reader that is delayed after its first read."""

        looks = 0

        def __getitem__(self, index: int) -> int:
            self.looks += 1
            return int(posted[index]) + (70 if self.looks > 1 else 1)

    sender.stream._posted = Racing()  # type: ignore[assignment]
    assert sender.stream.update() == StreamState.STOPPED
    assert sender.stream.session == -1
    assert sender.stream.counts()["overrun"] == 1


def test_only_samples_of_the_movers_right_are_played() -> None:
    sender = Sender()
    sender.block.counters["mover"] = 5
    for k in range(1, 40):
        for right, place in ((4, -1.0), (5, 0.01 * k), (6, -2.0)):
            sender.send(k, k / 60.0, (place, 0.0, 0.0), right=right, session=right)
    poses, _ = sender.run(40 / 60.0)
    counts = sender.stream.counts()
    assert (counts["accepted"], counts["other_right"]) == (39, 78)
    assert poses[:, 0].min() >= 0.0
    assert poses[-1, 0] > 0.3
    sender.block.counters["mover"] = 6  # another client may move
    sender.send(40, 40 / 60.0, (0.5, 0.0, 0.0), right=5, session=5)
    before = sender.stream.pose[0]
    sender.run(0.1)
    assert sender.stream.counts()["other_right"] == 79
    assert sender.stream.pose[0] <= before + 0.02
