"""Client end of the simulated bus: AF_UNIX SEQPACKET socket and its control messages."""

from __future__ import annotations

import contextlib
import json
import socket
from collections.abc import Iterable
from typing import Any

from cdpr_drivers.errors import BusError
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.bounded_input import parse_json

FRAME_BYTES = 16
Filters = Iterable[tuple[int, int]]
"""Pairs (identifier, mask); a frame passes when (frame id & mask) == (identifier & mask)."""

_ANSWER_TIMEOUT_S = 5.0
_CONTROL_BYTES = 65536
_CLOSED = "the simulated bus closed the connection; it takes the user who runs it, and root"
# the hub takes control messages below 448 bytes; a pair has up to 24
_FILTERS_A_MESSAGE = 16


def passes(can_id: int, filters: Filters | None) -> bool:
    """Return whether a frame with this identifier, flags included, passes; None lets all pass."""
    if filters is None:
        return True
    return any((can_id & mask) == (filter_id & mask) for filter_id, mask in filters)


def connect(name: str) -> socket.socket:
    """Return a blocking socket connected to the bus `name`.

    Raises:
        BusError: no simulated bus of that name runs on this machine.
    """
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        sock.connect(f"\0cdpr-rt/simbus/{name}")
    except OSError as error:
        sock.close()
        raise BusError(
            f"simbus:{name}: no simulated bus of that name is running ({error.strerror}); "
            f"`cdpr sim up` starts one"
        ) from None
    return sock


def control_message(message: dict[str, Any]) -> bytes:
    """Return `message` as a packet: JSON, padded so that its length is not that of a frame."""
    text = json.dumps(message, separators=(",", ":")).encode()
    return text + b" " if len(text) == FRAME_BYTES else text


def set_filters(sock: socket.socket, filters: Filters) -> None:
    """Ask the hub to send only what passes one of `filters`; takes effect some time after."""
    pairs = [[can_id, mask] for can_id, mask in filters]
    sock.send(control_message({"filters": pairs[:_FILTERS_A_MESSAGE]}))
    for start in range(_FILTERS_A_MESSAGE, len(pairs), _FILTERS_A_MESSAGE):
        part = pairs[start : start + _FILTERS_A_MESSAGE]
        sock.send(control_message({"more_filters": part}))


def exchange(sock: socket.socket, filters: Filters | None) -> dict[str, Any]:
    """Set `filters` (None: everything) and return the hub's status.

    Frames that came before the answer are dropped, so that nothing unfiltered is left behind.

    Raises:
        BusError: the hub did not answer in time, refused, or went away.
    """
    before = sock.gettimeout()
    sock.settimeout(_ANSWER_TIMEOUT_S)
    try:
        if filters is not None:
            set_filters(sock, filters)
        sock.send(control_message({"status": True}))
        while True:
            packet = sock.recv(_CONTROL_BYTES)
            if not packet:
                raise BusError(_CLOSED)
            if len(packet) == FRAME_BYTES:
                continue
            answer = parse_json(packet, "its answer")
            if "error" in answer:
                raise BusError(f"the simulated bus refused: {answer['error']}")
            return dict(answer["status"])
    except (ProfileError, LookupError, TypeError, ValueError) as error:
        raise BusError(f"the simulated bus answered what is no status: {error}") from None
    except TimeoutError:
        raise BusError(f"the simulated bus did not answer in {_ANSWER_TIMEOUT_S:g} s") from None
    except (BrokenPipeError, ConnectionResetError):
        raise BusError(_CLOSED) from None
    except OSError as error:
        raise BusError(f"the simulated bus went away ({error.strerror})") from None
    finally:
        sock.settimeout(before)


def query_status(name: str) -> dict[str, Any]:
    """Return the status of the simulated bus `name`: see docs/wire.md for its keys.

    Raises:
        BusError: there is no such bus, or it does not answer.
    """
    with contextlib.closing(connect(name)) as sock:
        return exchange(sock, [])
