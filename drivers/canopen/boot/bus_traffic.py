"""Traffic on a bus by identifier, to name the node that floods it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from cdpr_drivers.bus import BusUrl, open_port
from cdpr_drivers.bus.budget import worst_case_bits
from cdpr_drivers.bus.frame_reader import FrameReader
from cdpr_drivers.bus.frames import FRAME
from cdpr_drivers.errors import BusError
from cdpr_rt.core.clock import Clock

USUAL_BITRATE_bit_s = 1_000_000
_FLOOD_LOAD = 0.5
_LISTEN_S = 0.1
_POLL_S = 0.01
_MOST_FRAMES = 20_000


@dataclass(frozen=True)
class IdentifierTraffic:
    """Frame rate and load of one identifier."""

    identifier: int
    frames_per_s: float
    load: float
    """Share of the wire's time, at worst-case bit stuffing."""

    @property
    def node_id(self) -> int | None:
        """Node id the predefined connection set (CiA 301) gives this identifier to, if any."""
        node = self.identifier & 0x7F
        return node if 0x080 < self.identifier < 0x780 and node else None


def measure_traffic(
    url: BusUrl, clock: Clock, seconds: float, bitrate_bit_s: int = USUAL_BITRATE_bit_s
) -> list[IdentifierTraffic]:
    """Receive everything on a bus for `seconds`; return the traffic by identifier, busiest first.

    Raises BusError.
    """
    frames: Counter[int] = Counter()
    bits: Counter[int] = Counter()
    reader = FrameReader(open_port(url))

    def take(last: int) -> None:
        for row in reader.frames.rows[:last]:
            identifier, length, _ = FRAME.unpack_from(row)
            frames[identifier & 0x1FFFFFFF] += 1
            bits[identifier & 0x1FFFFFFF] += worst_case_bits(length)

    reader.take = take
    begin_s = clock.now_s
    try:
        while clock.now_s < begin_s + seconds and frames.total() < _MOST_FRAMES:
            clock.sleep(_POLL_S)
            while reader.poll() and frames.total() < _MOST_FRAMES:
                continue
    finally:
        reader.close()
    elapsed_s = max(clock.now_s - begin_s, 1e-6)
    return [
        IdentifierTraffic(
            identifier, frames[identifier] / elapsed_s, count / elapsed_s / bitrate_bit_s
        )
        for identifier, count in bits.most_common()
    ]


def flood_text(url: BusUrl, clock: Clock, bitrate_bit_s: int = USUAL_BITRATE_bit_s) -> str:
    """Return which identifier floods a bus, where its load is above 50 %, else an empty text.

    It explains another failure, so a bus that cannot be opened gives an empty text too.
    """
    try:
        traffic = measure_traffic(url, clock, _LISTEN_S, bitrate_bit_s)
    except BusError:
        return ""
    load = sum(entry.load for entry in traffic)
    if not traffic or load < _FLOOD_LOAD:
        return ""
    busiest = traffic[0]
    node = f" (node {busiest.node_id} by the usual numbering)" if busiest.node_id else ""
    return (
        f"the bus is flooded: {load:.0%} load, most of it {busiest.frames_per_s:.0f} frames/s with "
        f"identifier {busiest.identifier:03X}h{node}; switch that device off"
    )
