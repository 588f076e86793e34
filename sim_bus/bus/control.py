"""Control messages of the bus, JSON packets beside the frames; and the client that leads it."""

from __future__ import annotations

import contextlib
import json
import math
import struct
import time
from collections.abc import Callable
from typing import Any

from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.bounded_input import parse_json
from cdpr_sim_bus.bus.client import PACKET_BYTES, Client
from cdpr_sim_bus.bus.switch import Switch
from cdpr_sim_bus.clock import BusClock, ClockMode
from cdpr_sim_bus.frame import FRAME_BYTES

_PACKET = struct.Struct("<8sdd")
_GO, _TIME, _FRAMES = b"bus-go\0\0", b"bus-time", b"bus-data"
_STEPS_A_TURN = 16
_MOST_HELD = 128


def frames_of(packet: bytes) -> list[bytes]:
    """Return the frames of a packet that has several of them, an empty list for any other."""
    if not packet.startswith(_FRAMES) or (len(packet) - _PACKET.size) % FRAME_BYTES:
        return []
    return [packet[at : at + FRAME_BYTES] for at in range(_PACKET.size, len(packet), FRAME_BYTES)]


def is_go(packet: bytes) -> bool:
    """Return whether a packet is a time grant ("bus-go")."""
    return len(packet) == _PACKET.size and packet.startswith(_GO)


class Lead:
    """The leading client of a bus, and the grant that is being carried out."""

    def __init__(self, switch: Switch, clock: BusClock) -> None:
        self._switch = switch
        self._clock = clock
        self.leader: Client | None = None
        self.until_s: float | None = None
        """Bus time up to which a grant runs, None without one."""
        self.time_pending = False
        """Whether a time packet waits for room in the leader's socket."""
        self._held: list[bytes] = []
        """Frames for the leader, which go with the next time packet."""

    def take(self, client: Client) -> dict[str, Any]:
        """Make `client` the leader; return the answer to it."""
        clock = self._clock
        if clock.mode is ClockMode.PACED:
            return {"error": "lead: this bus is paced, its time is the clock's"}
        if self.leader not in (None, client):
            return {"error": "lead: another client leads this bus"}
        clock.stop(time.monotonic())
        now_s = clock.now(0.0)
        self._switch.advance(now_s)
        self._switch.settle()
        self.leader = client
        client.send = self._hold
        client.delivered = False
        next_s = self._switch.next_event_s()
        return {"lead": {"now_s": now_s, "next_s": None if next_s == math.inf else next_s}}

    def release(self, client: Client) -> None:
        """End the lead of `client`; bus time stands until a client sends or leads."""
        if client is self.leader:
            client.send = client.sock.send
            with contextlib.suppress(OSError):  # it does not read
                self._send_held(client)
            self._end()

    def lose(self, client: Client) -> None:
        """Let bus time run with wall time where the disconnected `client` was the leader."""
        if client is self.leader:
            self._end()
            self._clock.run(time.monotonic())

    def _end(self) -> None:
        self.leader = self.until_s = None
        self.time_pending = False
        self._held.clear()

    def _hold(self, frame: bytes) -> None:
        """Keep a frame for the leader; where many wait they go at once, if there is room."""
        held = self._held
        if len(held) == _MOST_HELD and self.leader is not None:
            self._send_held(self.leader)
        held.append(frame)

    def _send_held(self, leader: Client) -> None:
        if self._held:
            leader.sock.send(_PACKET.pack(_FRAMES, 0.0, 0.0) + b"".join(self._held))
            self._held.clear()

    def go(self, packet: bytes) -> None:
        """Take a grant of the leader; `go_on` carries it out. One without a finite time only
        asks for a time packet."""
        until_s = _PACKET.unpack(packet)[1]
        self.until_s = until_s if math.isfinite(until_s) else -math.inf

    def go_on(self) -> None:
        """Advance bus time from event to event up to the grant, some events in each call.

        Sends the time packet that is pending first.
        """
        leader, until_s, switch, clock = self.leader, self.until_s, self._switch, self._clock
        if self.time_pending:
            self.send_time()
        if leader is None or until_s is None:
            return
        for _ in range(_STEPS_A_TURN):
            now_s = clock.now(0.0)
            if leader.delivered or until_s <= now_s:
                self.until_s = None
                self.send_time()
                return
            step_s = max(now_s, min(switch.next_event_s(), until_s))
            clock.move(step_s)
            switch.advance(step_s)
            switch.settle()

    def send_time(self) -> None:
        """Send the leader a time packet, now or as soon as its socket has room."""
        leader = self.leader
        if leader is None:
            return
        packet = _PACKET.pack(_TIME, self._clock.now(0.0), self._switch.next_event_s())
        self.time_pending = False
        try:
            leader.sock.send(packet + b"".join(self._held))
            self._held.clear()
            leader.delivered = False
        except BlockingIOError:
            self.time_pending = True
        except OSError:
            # it has disconnected, which reading from it shows
            return


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
