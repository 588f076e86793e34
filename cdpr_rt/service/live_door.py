"""The door before the live view: no web page comes in that was not asked in by name."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from collections.abc import Collection
from http import HTTPStatus
from typing import Any, Final

import h11

from cdpr_rt.service.auth import is_ours

MOST_VIEWERS: Final = 16
_MOST_HEAD_BYTES, _HEAD_S = 8192, 5.0
_CHUNK_BYTES: Final = 1 << 16
_MOST_REASON = 200


class _RefusedError(Exception):
    def __init__(self, text: str, status: HTTPStatus = HTTPStatus.FORBIDDEN) -> None:
        super().__init__(text)
        self.status = status


class LiveDoor:
    """Listens on loopback, looks at who asks, and passes on what comes to the server behind it.

    That server looks at no header. It has a loopback address of its own (127.x.y.z) and port, which
    change with each start and which a page cannot find out. `origins` are the pages that may come
    in, as a browser writes them; programs send no `Origin`.
    """

    def __init__(self, listener: socket.socket, inner: tuple[str, int], origins: Collection[str]):
        self._listener = listener
        self._inner = inner
        self._origins = {origin.lower().rstrip("/") for origin in origins}
        self.refused = 0
        """Connections that were not let in."""
        self.refused_last = ""
        """Why the last of them was not."""
        self.viewers = 0
        self._open: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        self._strangers: dict[asyncio.StreamWriter, None] = {}
        self._loop = asyncio.new_event_loop()
        self._ended = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="live door", daemon=True)

    def start(self) -> None:
        """Let people in from now on."""
        self._thread.start()

    def stop(self) -> None:
        """Cut all connections."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ended.set)
            self._thread.join()
        self._listener.close()

    def _run(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._serve())

    async def _serve(self) -> None:
        server = await asyncio.start_server(
            self._meet, sock=self._listener, limit=_MOST_HEAD_BYTES, backlog=2 * MOST_VIEWERS
        )
        async with server:
            await self._ended.wait()
            for writer in self._open.values():
                writer.transport.abort()
            await asyncio.gather(*self._open)

    async def _meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        meeting = asyncio.current_task()
        assert meeting is not None
        self._open[meeting] = writer
        try:
            await self._let_in(reader, writer)
        finally:
            del self._open[meeting]

    async def _let_in(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Look at one connection and pass it on, or refuse it."""
        try:
            head = await self._head(reader, writer)
            self._check(head)
        except _RefusedError as refused:
            self._note(str(refused))
            await _answer(writer, refused)
            return
        self.viewers += 1  # in one step with the look at it: others are looked at meanwhile
        try:
            await self._pass_on(head, reader, writer)
        finally:
            self.viewers -= 1

    async def _pass_on(
        self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        """Carry both ways until one end closes."""
        try:
            inner_reader, inner_writer = await asyncio.open_connection(*self._inner)
        except OSError:
            writer.transport.abort()
            return
        inner_writer.write(head)
        pumps = {
            asyncio.ensure_future(_pump(reader, inner_writer)),
            asyncio.ensure_future(_pump(inner_reader, writer)),
        }
        try:
            await asyncio.wait(pumps, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for pump in pumps:
                pump.cancel()
            for end in (writer, inner_writer):
                end.transport.abort()

    async def _head(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bytes:
        """Return the request for a WebSocket; who says nothing leaves first where many wait."""
        if len(self._strangers) >= MOST_VIEWERS:
            oldest = next(iter(self._strangers))
            del self._strangers[oldest]
            oldest.transport.abort()
        self._strangers[writer] = None
        try:
            async with asyncio.timeout(_HEAD_S):
                return await reader.readuntil(b"\r\n\r\n")
        except (TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            raise _RefusedError("no request", HTTPStatus.BAD_REQUEST) from None
        finally:
            self._strangers.pop(writer, None)

    def _check(self, head: bytes) -> None:
        """Raise _RefusedError for who may not look."""
        connection = h11.Connection(h11.SERVER, max_incomplete_event_size=_MOST_HEAD_BYTES)
        connection.receive_data(head)
        try:
            request = connection.next_event()
        except h11.RemoteProtocolError:
            raise _RefusedError("no request", HTTPStatus.BAD_REQUEST) from None
        assert isinstance(request, h11.Request)  # it is whole
        host = origin = ""
        for name, value in request.headers:
            text = value.decode("latin-1")
            if name == b"host":
                host = text
            if name == b"origin":
                origin = text or "null"
                if origin.lower() not in self._origins:
                    raise _RefusedError(f"Origin: {origin} may not look on; see --live-origin")
        if not is_ours(host, ()):  # on loopback no program needs a name
            raise _RefusedError(f"Host: {host}: allowed: localhost, or an address in figures")
        if self.viewers >= MOST_VIEWERS:
            raise _RefusedError(
                f"{MOST_VIEWERS} others look on already", HTTPStatus.SERVICE_UNAVAILABLE
            )

    def _note(self, text: str) -> None:
        self.refused += 1
        self.refused_last = text[:_MOST_REASON]

    def told(self) -> dict[str, Any]:
        """Return how many look on, how many were refused, and why the last of them."""
        return {
            "viewers": self.viewers,
            "refused": self.refused,
            "refused_last": self.refused_last,
        }


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(ConnectionError):
        while data := await reader.read(_CHUNK_BYTES):
            writer.write(data)
            await writer.drain()


async def _answer(writer: asyncio.StreamWriter, refused: _RefusedError) -> None:
    body = f"{refused}\n".encode("utf-8", "backslashreplace")
    status = f"HTTP/1.1 {refused.status.value} {refused.status.phrase}\r\n"
    rest = f"Content-Type: text/plain\r\nContent-Length: {len(body)}\r\nConnection: close\r\n\r\n"
    with contextlib.suppress(OSError, TimeoutError):
        writer.write((status + rest).encode() + body)
        writer.close()
        async with asyncio.timeout(_HEAD_S):
            await writer.wait_closed()
