"""Listening: sockets, and connections that nobody can hold open for nothing."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import socket
import stat
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

from cdpr_rt.errors import ControlError
from cdpr_rt.service.auth import MOST_BODY_BYTES

_MOST_CONNECTIONS: Final = 64
_MOST_OF_ONE: Final = 24
_REQUEST_S, _ANSWER_S, _LOOK_S = 10.0, 90.0, 2.0
_LEAVE_S: Final = 5.0
_MOST_UNSENT_BYTES: Final = 1 << 20
_UNREAD_BYTES: Final = 1 << 16
_MOST_FRAGMENTS: Final = 64
_FULL: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})
_FULL_AGAIN_S: Final = 10.0
_NO_UTF8: Final = 1007  # RFC 6455, 7.4.1


class ListenError(ControlError):
    """An address cannot be listened at; the message says which and why."""


class _Http(H11Protocol):
    """Ends a connection that neither asks anything nor takes its answer, and one too many."""

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        peers = [getattr(one, "client", None) for one in self.connections]
        of_this = sum(peer[0] == self.client[0] for peer in peers if peer and self.client)
        if len(peers) > _MOST_CONNECTIONS or of_this > _MOST_OF_ONE:
            transport.abort()
            return
        self._watch(None, 0.0)

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


class _WebSocket(WebSocketsSansIOProtocol):
    """Lets its handler cut the connection, and does so itself where nothing is read."""

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        # what one is behind is held here for some kilobytes only; more would be old when it is read
        transport.get_extra_info("socket").setsockopt(
            socket.SOL_SOCKET, socket.SO_SNDBUF, _UNREAD_BYTES
        )

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        # answers to pings are queued without limit otherwise
        if self.transport.get_write_buffer_size() > _MOST_UNSENT_BYTES:
            self.transport.abort()

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

    async def run_asgi(self) -> None:
        self.scope["state"]["abort"] = self.transport.abort
        try:
            await super().run_asgi()
        finally:
            self.loop.call_later(_LEAVE_S, self.transport.abort)


class Server(uvicorn.Server):
    """Serves an application on one socket, in the caller's asyncio loop, under its signals."""

    def __init__(self, app: ASGIApp, listener: socket.socket) -> None:
        super().__init__(
            uvicorn.Config(
                app,
                http=_Http,
                ws=_WebSocket,
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
                backlog=2 * _MOST_CONNECTIONS,
                h11_max_incomplete_event_size=MOST_BODY_BYTES,
            )
        )
        self._listener = listener

    async def run_until_told(self) -> None:
        """Serve until `should_exit` is set."""
        await self.serve(sockets=[self._listener])

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the process."""
        yield


def watch_tables(loop: asyncio.AbstractEventLoop, tell: Callable[[str], None]) -> None:
    """Have `tell` told, now and then, that the system gives no descriptor for a connection more.

    asyncio waits for a second and tries again, but logs hundreds of tracebacks each time.
    """
    told_s = -_FULL_AGAIN_S

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        nonlocal told_s
        error = context.get("exception")
        if not isinstance(error, OSError) or error.errno not in _FULL:
            loop.default_exception_handler(context)
        elif time.monotonic() - told_s >= _FULL_AGAIN_S:
            told_s = time.monotonic()
            tell(f"no connection more can be taken: {error.strerror}")

    loop.set_exception_handler(handle)


def listen_unix(path: Path) -> socket.socket:
    """Return a socket at `path` that this user alone may connect to; raises ListenError.

    What a daemon that was killed has left there is replaced, a daemon that answers is not.
    """
    if path.exists() or path.is_symlink():
        if not stat.S_ISSOCK(path.lstat().st_mode):
            raise ListenError(f"socket {path}: is something else than a socket")
        if _answers(path):
            raise ListenError(f"socket {path}: another daemon listens there")
        path.unlink()
    listener = socket.socket(socket.AF_UNIX)
    mask = os.umask(0o177)
    try:
        listener.bind(str(path))
        listener.listen()  # whoever sees the socket can connect
    except OSError as error:
        listener.close()
        raise ListenError(f"socket {path}: {error.strerror or error}") from None
    finally:
        os.umask(mask)
    return listener


def listen_tcp(host: str, port: int) -> socket.socket:
    """Return a socket at one address of `host`; raises ListenError."""
    try:
        family, kind, proto, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, proto)
    except OSError as error:
        raise ListenError(f"{host}:{port}: {error.strerror or error}") from None
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(address)
    except OSError as error:
        listener.close()
        raise ListenError(f"{host}:{port}: {error.strerror or error}") from None
    return listener


def _is_text(fragments: list[bytes]) -> bool:
    try:
        b"".join(fragments).decode()
    except UnicodeDecodeError:
        return False
    return True


def _answers(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(1.0)
        failed = probe.connect_ex(str(path))
    return failed not in (errno.ECONNREFUSED, errno.ENOENT)
