"""HTTP server with time-outs and stop priority."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

from cdpr_rt.service.http.acceptor import LONGEST_STOP, STOPS, Acceptor, may_stop
from cdpr_rt.service.http.access_control import MOST_BODY_BYTES, AccessControl
from cdpr_rt.service.http.connections import ConnectionLimiter, FairQueue, TokenBuckets, peer_of

_REQUEST_S, _ANSWER_S, _LOOK_S = 10.0, 90.0, 2.0
_LEAVE_S: Final = 5.0
_MOST_UNSENT_BYTES: Final = 1 << 20
_UNREAD_BYTES: Final = 1 << 16
_MOST_FRAGMENTS: Final = 64
_MOST_UNPARSED_BYTES: Final = 1 << 20
_PIECE_BYTES: Final = 2048
_STOP_AGAIN_S: Final = 0.2
"""A connection that asks for a stop this soon after another is queued as all else is."""
_ANONYMOUS_STOPS_PER_S, _ANONYMOUS_STOPS = 20.0, 4.0
"""Stops over TCP without key or token that have priority."""
_NO_UPGRADE: Final = b"HTTP/1.1 400 Bad Request\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"
_NO_UTF8: Final = 1007  # RFC 6455, 7.4.1


class _HttpProtocol(H11Protocol):
    """Ends a connection that neither asks anything nor takes its answer, and one too many.

    Its requests are queued; a stop is not where `has_priority` says so of an authenticated
    connection or an anonymous one, unless the last one came just before. Of its first request that
    is said by `first_has_priority`.
    """

    def __init__(
        self,
        limiter: ConnectionLimiter,
        queue: FairQueue,
        has_priority: Callable[[bool], bool],
        is_authenticated: bool,
        first_has_priority: bool,
        **given: Any,
    ) -> None:
        super().__init__(**given)
        self.app_state = {**self.app_state, "connection": self}
        self.peer = ""
        self.is_authenticated = is_authenticated
        self.is_refused = self.stops_only = False
        self.since_s = 0.0
        self._limiter, self._queue = limiter, queue
        self._has_priority, self._first_has_priority = has_priority, first_has_priority
        self._is_queued = self._is_stop = False
        self._stopped_s = -_STOP_AGAIN_S

    @property
    def is_idle(self) -> bool:
        """Whether it has no complete request that waits for its answer."""
        asked = self.cycle is not None and not self.cycle.response_complete
        return self.is_refused or not (self._is_queued or (asked and not self.cycle.more_body))

    def note_authenticated(self) -> None:
        """It has shown the key, or the token of who may move."""
        self._limiter.note_authenticated(self)

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        try:
            self.client = peer_of(transport.get_extra_info("socket"))
        except OSError:  # it has gone already
            transport.abort()
            return
        self.peer = self.client[0]
        self.since_s = self.loop.time()
        if not self._limiter.admit(self):
            transport.abort()
            return
        self._watch(None, 0.0)

    def connection_lost(self, exc: Exception | None) -> None:
        self._limiter.remove(self)
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        super().handle_websocket_upgrade(event)
        successor: Any = self.transport.get_protocol()
        self._limiter.replace(self, successor)
        if not successor.handshake_initiated:
            # it bears shorter lines and fewer of them, and would neither answer nor end
            self.transport.write(_NO_UPGRADE)
            self.transport.close()

    def send_400_response(self, msg: str) -> None:
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            super().send_400_response(msg)
        else:  # its answer has begun: no second one can be sent
            self.transport.close()
        if self.cycle is not None:  # whoever works on this request has nobody to answer any more
            self.cycle.disconnected = True
            self.cycle.message_event.set()

    def on_response_complete(self) -> None:
        self.since_s = self.loop.time()
        super().on_response_complete()

    def handle_events(self) -> None:
        if self.conn.their_state is h11.IDLE:
            head = self.conn.trailing_data[0][:LONGEST_STOP]
            if self.stops_only and not may_stop(head):
                self.transport.abort()
                return
            self._is_stop = head.startswith(STOPS) and self._takes_priority()
            if not head:
                super().handle_events()  # no more has come yet
                return
        if self._is_stop:
            super().handle_events()
        elif not self._is_queued:
            self._is_queued = True
            self.flow.pause_reading()
            self._queue.submit(self._run_queued, self.is_authenticated)

    def _takes_priority(self) -> bool:
        first_has_priority, self._first_has_priority = self._first_has_priority, False
        now_s = self.loop.time()
        if now_s - self._stopped_s < _STOP_AGAIN_S:
            return False
        if not (first_has_priority or self._has_priority(self.is_authenticated)):
            return False
        self._stopped_s = now_s
        return True

    def _run_queued(self) -> bool:
        self._is_queued = False
        if self.transport.is_closing():
            return False
        self.flow.resume_reading()
        super().handle_events()
        return True

    def _watch(self, before: object, waited_s: float) -> None:
        if self not in self.connections:  # lost, or a WebSocket's by now
            return
        answering = self.cycle is not None and not self.cycle.response_complete
        phase = (self.cycle, answering)
        waited_s = waited_s + _LOOK_S if phase == before else 0.0
        if waited_s > (_ANSWER_S if answering else _REQUEST_S):
            self.transport.abort()
            return
        self.loop.call_later(_LOOK_S, self._watch, phase, waited_s)


class _WebSocketProtocol(WebSocketsSansIOProtocol):
    """Lets its handler cut the connection, and does so itself where nothing is read.

    What comes is parsed by the piece, each by way of the queue.
    """

    def __init__(self, limiter: ConnectionLimiter, queue: FairQueue, **given: Any) -> None:
        super().__init__(**given)
        self.app_state = {**self.app_state, "connection": self}
        self.peer = ""
        self.is_authenticated = self.is_refused = self.stops_only = False
        self.since_s = 0.0
        self._limiter, self._queue = limiter, queue
        self._unparsed = bytearray()

    @property
    def is_idle(self) -> bool:
        """Whether it only takes its leave, or has never been let in."""
        return self.is_refused or self.close_sent

    def note_authenticated(self) -> None:
        """It has shown the key, or the token of who may move."""
        self._limiter.note_authenticated(self)

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        with contextlib.suppress(OSError):  # it has gone already
            self.client = peer_of(transport.get_extra_info("socket"))
            self.peer = self.client[0]
        self.since_s = self.loop.time()
        # what one is behind is held here for some kilobytes only; more would be old when it is read
        transport.get_extra_info("socket").setsockopt(
            socket.SOL_SOCKET, socket.SO_SNDBUF, _UNREAD_BYTES
        )

    def connection_lost(self, exc: Exception | None) -> None:
        self._limiter.remove(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if not self.handshake_initiated:
            super().data_received(data)
            return
        if not self._unparsed:
            self._queue.submit(self._run_queued, self.is_authenticated)
        self._unparsed += data
        self.transport.pause_reading()
        if len(self._unparsed) > _MOST_UNPARSED_BYTES:
            self.transport.abort()

    def _run_queued(self) -> bool:
        if self.transport.is_closing():
            return False
        piece = bytes(self._unparsed[:_PIECE_BYTES])
        del self._unparsed[:_PIECE_BYTES]
        super().data_received(piece)
        # answers to pings are queued without limit otherwise
        if self.transport.get_write_buffer_size() > _MOST_UNSENT_BYTES:
            self.transport.abort()
        elif self._unparsed:
            self._queue.submit(self._run_queued, self.is_authenticated)
        elif not self.read_paused and not self.transport.is_closing():
            self.transport.resume_reading()
        return True

    def handle_cont(self, event: Frame) -> None:
        if len(self.frames) >= _MOST_FRAGMENTS:  # empty ones count as nothing in `ws_max_size`
            self.transport.abort()
            return
        super().handle_cont(event)

    def send_receive_event_to_app(self) -> None:
        if self.curr_msg_data_type == "text" and not _is_text(self.frames):
            # as the base class does, but not with a traceback in the journal for each
            self.frames = []
            self.conn.send_close(_NO_UTF8)
            self.handle_parser_exception()
            return
        super().send_receive_event_to_app()

    async def send(self, message: Any) -> None:
        if self.close_sent and message["type"] == "websocket.send":
            # it has answered no ping: the base class has sent the close frame, and would log what
            # the handler sends meanwhile as its error
            raise ClientDisconnected
        await super().send(message)
        if message["type"] == "websocket.http.response.body":
            # refused: the base class takes it for one never answered, and logs each as an error
            self.handshake_complete = True

    async def run_asgi(self) -> None:
        self.scope["state"]["abort"] = self.transport.abort
        try:
            await super().run_asgi()
        finally:
            self.loop.call_later(_LEAVE_S, self.transport.abort)


class Server(uvicorn.Server):
    """Serves an application on one socket, in the caller's asyncio loop, under its signals.

    All servers of a process share their `queue`. `tell` is told when no connection more can be
    taken.
    """

    def __init__(
        self,
        app: AccessControl,
        listener: socket.socket,
        queue: FairQueue,
        tell: Callable[[str], None],
    ) -> None:
        limiter = ConnectionLimiter()
        super().__init__(
            uvicorn.Config(
                app,
                http=partial(_HttpProtocol, limiter, queue, self._has_priority),  # type: ignore[arg-type]  # called as a class is
                ws=partial(_WebSocketProtocol, limiter, queue),  # type: ignore[arg-type]
                lifespan="off",
                log_config=None,
                access_log=False,
                server_header=False,
                proxy_headers=False,
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
        self._app = app
        self._queue, self._tell = queue, tell
        self._anonymous_stops = TokenBuckets(_ANONYMOUS_STOPS_PER_S, _ANONYMOUS_STOPS)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen; called by `serve`."""
        await self.lifespan.startup()
        assert sockets is not None  # by `serve_until_stopped`
        made: Any = self.config.http_protocol_class
        given = {"config": self.config, "server_state": self.server_state}

        def factory(is_authenticated: bool, first_has_priority: bool) -> asyncio.Protocol:
            protocol: asyncio.Protocol = made(
                is_authenticated=is_authenticated,
                first_has_priority=first_has_priority,
                **given,
                app_state=self.lifespan.state,
            )
            return protocol

        shared = self._app.is_authenticated, self._has_priority, self._queue, self._tell
        acceptors: Any = [Acceptor(one, factory, *shared) for one in sockets]
        self.servers = acceptors
        self.started = True

    def _has_priority(self, is_authenticated: bool) -> bool:
        """Whether a stop, of an authenticated connection or not, goes before all that is queued.

        On the Unix socket, and of the authenticated, it does, and what is queued yields. Of the
        anonymous on TCP so many a second do, all together, as they may have any number of
        addresses; more than that are queued, and so is one that will be refused.
        """
        if is_authenticated or self._app.is_local:
            self._queue.yield_to_stop()
            return True
        return self._app.anyone_may_stop and self._anonymous_stops.take("", time.monotonic())

    async def serve_until_stopped(self) -> None:
        """Serve until `should_exit` is set."""
        await self.serve(sockets=[self._listener])

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the process."""
        yield


def _is_text(fragments: list[bytes]) -> bool:
    try:
        b"".join(fragments).decode()
    except UnicodeDecodeError:
        return False
    return True
