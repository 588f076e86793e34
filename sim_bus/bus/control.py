"""Control messages of the bus: JSON packets beside the frames."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.bounded_input import parse_json
from cdpr_sim_bus.bus.client import PACKET_BYTES, Client
from cdpr_sim_bus.bus.lead import Lead, is_go
from cdpr_sim_bus.frame import FRAME_BYTES

_KEYS = "filters, lead, more_filters, status"


def encode(message: dict[str, Any]) -> bytes:
    """Return `message` as a packet: JSON, padded so that its length is not that of a frame."""
    text = json.dumps(message, separators=(",", ":")).encode()
    return text + b" " if len(text) == FRAME_BYTES else text


def handle(
    lead: Lead, status: Callable[[], dict[str, Any]], client: Client, packet: bytes
) -> bytes | None:
    """Obey one message of `client` and return the answer, None where there is none to give."""
    try:
        answer = _obey(lead, status, client, *_request(packet))
    except _RefusedError as error:
        answer = {"error": str(error)}
    return None if answer is None else encode(answer)


class _RefusedError(Exception):
    """A request that the bus refuses, with the reason."""


def _request(packet: bytes) -> tuple[str, Any]:
    """Return key and value of a message."""
    if len(packet) == PACKET_BYTES:
        raise _RefusedError(f"a control message has less than {PACKET_BYTES} bytes; send several")
    if is_go(packet):
        raise _RefusedError("go: only the client that leads the bus moves its time")
    try:
        ((key, value),) = parse_json(packet, "message").items()
    except (ProfileError, ValueError, AttributeError):
        raise _RefusedError(
            f"neither a frame of {FRAME_BYTES} bytes nor a JSON object with one key of: {_KEYS}"
        ) from None
    return key, value


def _obey(
    lead: Lead, status: Callable[[], dict[str, Any]], client: Client, key: str, value: Any
) -> dict[str, Any] | None:
    if key == "status" and value is True:
        return {"status": status()}
    if key == "lead" and isinstance(value, bool):
        if value:
            return lead.take(client)
        lead.release(client)
        return None
    if key in ("filters", "more_filters"):
        filters = _filters(key, value)
        client.filters = filters if key == "filters" else (client.filters or []) + filters
        return None
    raise _RefusedError(f"unknown request {key!r}; known: {_KEYS}")


def _filters(key: str, value: object) -> list[tuple[int, int]]:
    filters = []
    for pair in value if isinstance(value, list) else [None]:
        match pair:
            case [int(identifier), int(mask)] if min(pair) >= 0 and max(pair) < 1 << 32:
                filters.append((identifier, mask))
            case _:
                raise _RefusedError(
                    f"{key}: expected a list of [identifier, mask], 32-bit numbers each"
                )
    return filters
