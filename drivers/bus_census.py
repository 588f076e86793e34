"""Who talks on a bus: frames and load by identifier, for the case that somebody talks too much."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from cdpr_rt.clock import Clock
from drivers.bus import BusUrl, open_port
from drivers.bus.budget import worst_case_bits
from drivers.bus.intake import Intake
from drivers.bus.packed import FRAME
from drivers.errors import BusError

_BITRATE = 1_000_000
_FLOOD_LOAD = 0.5
_LISTEN_S = 0.1
_LOOK_S = 0.01
_MOST_FRAMES = 20_000


@dataclass(frozen=True)
class Talker:
    """What was heard with one identifier."""

    identifier: int
    frames_per_s: float
    load: float
    """Share of the wire's time, at worst-case bit stuffing."""

    @property
    def node_id(self) -> int | None:
        """Node id the predefined connection set (CiA 301) gives this identifier to, if any."""
        node = self.identifier & 0x7F
        return node if 0x080 < self.identifier < 0x780 and node else None


def census(url: BusUrl, clock: Clock, seconds: float, bitrate: int = _BITRATE) -> list[Talker]:
    """Listen to everything on a bus for a while; return who talked, the busiest first.

    Raises BusError.
    """
    frames: Counter[int] = Counter()
    bits: Counter[int] = Counter()
    intake = Intake(open_port(url))

    def take(last: int) -> None:
        for row in intake.frames.rows[:last]:
            identifier, length, _ = FRAME.unpack_from(row)
            frames[identifier & 0x1FFFFFFF] += 1
            bits[identifier & 0x1FFFFFFF] += worst_case_bits(length)

    intake.take = take
    begin_s = clock.now_s
    try:
        while clock.now_s < begin_s + seconds and frames.total() < _MOST_FRAMES:
            clock.sleep(_LOOK_S)
            while intake.poll() and frames.total() < _MOST_FRAMES:
                continue
    finally:
        intake.close()
    elapsed_s = max(clock.now_s - begin_s, 1e-6)
    return [
        Talker(identifier, frames[identifier] / elapsed_s, count / elapsed_s / bitrate)
        for identifier, count in bits.most_common()
    ]


def flood_text(url: BusUrl, clock: Clock, bitrate: int = _BITRATE) -> str:
    """Return who loads a bus by more than half, in words; empty where nobody does.

    For the explanation of another failure: a bus that cannot be listened to says nothing.
    """
    try:
        talkers = census(url, clock, _LISTEN_S, bitrate)
    except BusError:
        return ""
    load = sum(talker.load for talker in talkers)
    if not talkers or load < _FLOOD_LOAD:
        return ""
    loudest = talkers[0]
    whose = f" (node {loudest.node_id} by the usual numbering)" if loudest.node_id else ""
    return (
        f"the bus is flooded: {load:.0%} load, most of it {loudest.frames_per_s:.0f} frames/s with "
        f"identifier {loudest.identifier:03X}h{whose}; switch that device off"
    )
