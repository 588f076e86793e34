"""HTTP server: uvicorn on one socket, and limits of idle connections."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

import h11
import uvicorn

from cdpr_rt.service.access_control import MOST_BODY_BYTES, PROGRESS, AccessControl

MOST_IDLE_OF_PEER: Final = 32
MOST_IDLE: Final = 256
_LOOK_S: Final = 0.1
IDLE_S, ANSWER_S, _CLOSE_S = 10.0, 90.0, 2.0
"""Longest times for which a connection may send no request, not read more of its answer, or not
end."""
_READ_S: Final = 0.5
"""A connection that is younger may have sent a request that has not been read yet."""
_MOST_UNSENT_BYTES: Final = 1 << 20
_MOST_CONNECTIONS: Final = 1024
"""Largest number of connections; if there are more, requests over TCP are answered with 503."""
_PIECE_BYTES: Final = 512
"""Bytes read from a WebSocket in one call. The default of 256 kB holds 40,000 pings, which would
occupy the event loop for some seconds."""
_SEND_BUFFER_BYTES: Final = 1 << 16
"""Largest unread backlog of a TCP connection; a client that is further behind would read outdated
data."""
_CLIENTS_MISTAKES: Final = ("Invalid UTF-8", "ASGI callable returned without completing")
"""First words of uvicorn's errors that clients cause: invalid text, a rejected WebSocket."""


class Server(uvicorn.Server):
    """Serves an application on one socket, in the caller's asyncio loop; leaves signals to the
    caller.
    """

    def __init__(self, app: AccessControl, listener: socket.socket) -> None:
        logging.getLogger("uvicorn.error").addFilter(_is_ours)
        local = listener.family == socket.AF_UNIX
        if not local:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        super().__init__(
            uvicorn.Config(
                app,
                http="h11",
                ws="websockets-sansio",
                lifespan="off",
                log_config=None,
                access_log=False,
                server_header=False,
                proxy_headers=False,
                backlog=1024,
                limit_concurrency=None if local else _MOST_CONNECTIONS,
                ws_max_size=MOST_BODY_BYTES,
                ws_per_message_deflate=False,
                ws_ping_interval=5.0,
                ws_ping_timeout=5.0,
                timeout_keep_alive=10,
                timeout_graceful_shutdown=2,
                h11_max_incomplete_event_size=MOST_BODY_BYTES,
            )
        )
        self._listener = listener

    async def serve_until_stopped(self) -> None:
        """Serve until `should_exit` is set."""
        async with asyncio.TaskGroup() as tasks:
            watching = tasks.create_task(_watch_connections(self.server_state.connections))
            await self.serve(sockets=[self._listener])
            watching.cancel()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the process."""
        yield


def _is_ours(record: logging.LogRecord) -> bool:
    if record.exc_info and isinstance(record.exc_info[1], h11.LocalProtocolError):
        return False  # the data are not HTTP: uvicorn answers before the application does
    return not str(record.msg).startswith(_CLIENTS_MISTAKES)


async def _watch_connections(connections: set[Any]) -> None:
    """End connections that stay too long in one phase, and the oldest of too many idle ones.

    uvicorn ends a connection that is silent after an answer. It does not end a connection that has
    never sent a request, or that does not read its answer.
    """
    loop = asyncio.get_running_loop()
    since: dict[Any, tuple[object, float]] = {}
    while True:
        await asyncio.sleep(_LOOK_S)
        now_s, before, since = loop.time(), since, {}
        idle = []
        for one in list(connections):
            phase, most_s = _phase(one)
            if phase == "open":
                one.transport.max_size = _PIECE_BYTES
            known = before.get(one)
            since[one] = known if known is not None and known[0] == phase else (phase, now_s)
            unsent = one.transport.get_write_buffer_size()
            if now_s - since[one][1] > most_s or unsent > _MOST_UNSENT_BYTES:
                one.transport.abort()
            elif most_s == IDLE_S and now_s - since[one][1] > _READ_S:
                idle.append(one)
        idle.sort(key=lambda one: since[one][1], reverse=True)
        kept = Counter[Any]()
        for one in idle:  # the newest connections stay
            peer = one.client and one.client[0]
            if kept[peer] >= MOST_IDLE_OF_PEER or kept.total() >= MOST_IDLE:
                one.transport.abort()
            else:
                kept[peer] += 1


def _phase(connection: Any) -> tuple[object, float]:
    """Return the present phase of a connection, and how long it may last."""
    if connection.transport.is_closing():
        return "closing", _CLOSE_S
    if hasattr(connection, "handshake_complete"):  # a WebSocket: pings end it if it is silent
        return "open", float("inf") if connection.handshake_complete else IDLE_S
    cycle = connection.cycle
    if cycle is None or cycle.response_complete:
        return cycle, IDLE_S
    return (cycle, "asking", cycle.scope.get(PROGRESS)), ANSWER_S
