"""Control messages of the bus: JSON packets beside the frames."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any

from sim_bus.client import PACKET_BYTES, Client
from sim_bus.frame import FRAME_BYTES

if TYPE_CHECKING:
    from sim_bus.hub import Hub

_KEYS = "filters, more_filters, status"


def encode(message: dict[str, Any]) -> bytes:
    """Return `message` as a packet: JSON, padded so that its length is not that of a frame."""
    text = json.dumps(message, separators=(",", ":")).encode()
    return text + b" " if len(text) == FRAME_BYTES else text


def handle(hub: Hub, client: Client, packet: bytes) -> bytes | None:
    """Obey one message of `client` and return the answer, None where there is none to give."""
    if len(packet) == PACKET_BYTES:
        return _refuse(f"a control message has less than {PACKET_BYTES} bytes; send several")
    try:
        ((key, value),) = json.loads(packet).items()
    except (ValueError, AttributeError):
        return _refuse(
            f"neither a frame of {FRAME_BYTES} bytes nor a JSON object with one key of: {_KEYS}"
        )
    if key == "status" and value is True:
        return encode({"status": status(hub)})
    if key in ("filters", "more_filters"):
        filters = _filters(value)
        if filters is None:
            return _refuse(f"{key}: expected a list of [identifier, mask], 32-bit numbers each")
        client.filters = filters if key == "filters" else (client.filters or []) + filters
        return None
    return _refuse(f"unknown request {key!r}; known: {_KEYS}")


def status(hub: Hub) -> dict[str, Any]:
    """Return what the bus tells about itself; docs/wire.md lists the keys."""
    now_s = hub.clock.ask(time.monotonic())
    return {
        "name": hub.name,
        "mode": hub.clock.mode.value,
        "bitrate": hub.load.bitrate,
        "bus_time_s": now_s,
        "sync_count": hub.sync_count,
        "frames": hub.load.frames,
        "load": hub.load.load(now_s),
        "peak_cycle_load": hub.load.peak_cycle_load,
        "overruns": hub.load.overruns,
        "dropped": hub.dropped,
        "malformed": hub.malformed,
        "truth_log": hub.truth_log,
        "nodes": [node.node_id for node in hub.nodes],
    }


def _refuse(reason: str) -> bytes:
    return encode({"error": reason})


def _filters(value: object) -> list[tuple[int, int]] | None:
    if not isinstance(value, list):
        return None
    filters = []
    for pair in value:
        if not isinstance(pair, list) or len(pair) != 2:
            return None
        if not all(isinstance(word, int) and 0 <= word < 1 << 32 for word in pair):
            return None
        filters.append((pair[0], pair[1]))
    return filters
