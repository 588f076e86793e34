"""WebSockets: figures as they come, and the right to move for as long as a connection lives."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from typing import Annotated, Any, Final, Literal

from fastapi import FastAPI, Query, WebSocket
from pydantic import Field, TypeAdapter, ValidationError
from starlette.websockets import WebSocketDisconnect

from cdpr_rt.errors import ControlError
from cdpr_rt.runtime.right import LONGEST_S
from cdpr_rt.service import models
from cdpr_rt.service.lease import SHORTEST_S, LeaseError
from cdpr_rt.service.rows import FIELDS, newest_row, row_table
from cdpr_rt.service.service import Service

FASTEST_HZ: Final = 50.0
_MOST_LIVE = 16
_SLOW_S = 1.0
_STATUS_S = 1.0
_MESSAGES_PER_S = 100.0
BUSY, REFUSED, SILENT, UNFIT = 1013, 4409, 4408, 1008
"""Codes that a connection is closed with, beside the usual ones."""
_MOST_REASON_BYTES = 123  # RFC 6455, 5.5


class Order(models.Who):
    """What the holder of the right to move sends over its connection."""

    do: Literal["renew", "hold", "program", "set"]
    program: str = ""
    wanted: dict[str, Any] = Field(default_factory=dict)
    id: int | None = None


_PROGRAM: Final = TypeAdapter(models.Program)
_SET: Final = TypeAdapter(models.Set)


class LiveSockets:
    """`/live` and the WebSocket of `/control`."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._cached: tuple[object, str] = (None, "")

    def add(self, app: FastAPI) -> None:
        """Add both routes."""

        @app.websocket("/live")
        async def live(
            socket: WebSocket,
            rate_Hz: Annotated[float, Query(gt=0.0, le=FASTEST_HZ)] = 10.0,
            fields: Annotated[str, Query(max_length=1000)] = "",
        ) -> None:
            wanted = tuple(name for name in fields.split(",") if name) or FIELDS
            unknown = [name for name in wanted if name not in FIELDS]
            await socket.accept()
            if unknown:
                await socket.close(UNFIT, _reason(f"fields: {unknown[0]} is none of a cycle's"))
            elif self._service.counts["live_clients"] >= _MOST_LIVE:
                await socket.close(BUSY, f"{_MOST_LIVE} others look on already")
            else:
                await self._show(socket, rate_Hz, wanted)

        @app.websocket("/control")
        async def control(
            socket: WebSocket,
            client: Annotated[str, Query(pattern=r"^[ -~]{1,64}$")],
            ttl_s: Annotated[float, Query(ge=SHORTEST_S, le=LONGEST_S)] = 2.0,
        ) -> None:
            await socket.accept()
            try:
                token = self._service.lease.take(client, ttl_s)
            except LeaseError as error:
                await socket.close(REFUSED, _reason(str(error)))
                return
            try:
                await self._obey(socket, client, token, ttl_s)
            except WebSocketDisconnect:
                pass
            finally:
                self._give_back(token)

    # -- looking on

    async def _show(self, socket: WebSocket, rate_Hz: float, fields: tuple[str, ...]) -> None:
        news = _News(self._service)
        async with self._guest(socket) as gone:
            while not gone.done():
                for message in news.all():
                    await _send(socket, json.dumps(message))
                cycle = self._cycle(news, fields)
                if cycle:
                    await _send(socket, cycle)
                await asyncio.wait({gone}, timeout=1.0 / rate_Hz)

    @asynccontextmanager
    async def _guest(self, socket: WebSocket) -> AsyncIterator[asyncio.Task[None]]:
        """Count one that looks on; drop it when it reads too slowly or talks too much."""
        counts = self._service.counts
        counts["live_clients"] += 1
        gone = asyncio.create_task(_swallow(socket))
        try:
            yield gone
        except TimeoutError:
            counts["slow_clients_dropped"] += 1
            self._service.events.add("live", "a client that read too slowly was dropped")
            socket.state.abort()
        except WebSocketDisconnect:
            pass
        finally:
            counts["live_clients"] -= 1
            gone.cancel()

    def _cycle(self, news: _News, fields: tuple[str, ...]) -> str:
        """Return the newest cycle as text, "" where it has been shown already."""
        rows = int(self._service.block.counters["rows"][0])
        if rows == news.rows:
            return ""
        skipped, news.rows = rows - news.rows - 1, rows
        key = (rows, fields)
        if self._cached[0] != key:  # many may look at the same
            row = newest_row(self._service.block)
            table = {} if row is None else row_table(row, fields)
            self._cached = key, json.dumps(table)[1:]
        return f'{{"kind": "cycle", "skipped": {skipped}, {self._cached[1]}'

    # -- moving

    async def _obey(self, socket: WebSocket, client: str, token: str, ttl_s: float) -> None:
        await _send(socket, json.dumps({"kind": "held", "token": token, "ttl_s": ttl_s}))
        allowed, before = _MESSAGES_PER_S, time.monotonic()
        while True:
            try:
                message = await asyncio.wait_for(socket.receive(), ttl_s)
            except TimeoutError:
                await socket.close(SILENT, f"nothing came for {ttl_s:g} s")
                return
            if message["type"] != "websocket.receive":
                return
            now = time.monotonic()
            allowed = min(_MESSAGES_PER_S, allowed + _MESSAGES_PER_S * (now - before)) - 1.0
            before = now
            if allowed < 0.0:
                await socket.close(UNFIT, f"more than {_MESSAGES_PER_S:g} messages a second")
                return
            answer = await self._order(message.get("text") or "", client, token)
            await _send(socket, json.dumps({"kind": "reply", **answer}))

    async def _order(self, text: str, client: str, token: str) -> dict[str, Any]:
        """Do what one message asks for; return the answer."""
        number = None
        try:
            order = Order.model_validate_json(text)
            number = order.id
            state, said = await self._do(order, client, token)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(part) for part in first["loc"])
            return {"id": number, "ok": False, "error": f"{where}: {first['msg']}"[:300]}
        except ControlError as error:
            return {"id": number, "ok": False, "error": str(error)}
        return {"id": number, "ok": not said, "error": said or None, "state": state}

    async def _do(self, order: Order, client: str, token: str) -> tuple[str, str]:
        """Return the loop's state, and why it refused or ""."""
        service = self._service
        if order.do == "renew":
            service.lease.renew(token)
            return service.link.state(), ""
        if order.do == "hold":
            with suppress(LeaseError):  # who has lost the right meanwhile may stop all the same
                service.lease.renew(token)
            reply = await service.tell("hold", client)
        elif order.do == "program":
            program = _PROGRAM.validate_python({"program": order.program, "wanted": order.wanted})
            fields = {"program": program.program, "wanted": program.wanted}
            reply = await service.ask("program", client, token, _is_here, **fields)
        else:
            change = _SET.validate_python({"wanted": order.wanted})
            reply = await service.ask("set", client, token, _is_here, wanted=change.wanted)
        return reply.state, "" if reply.ok else reply.text or "refused"

    def _give_back(self, token: str) -> None:
        try:
            self._service.lease.release(token)
        except LeaseError:  # it has run out, or somebody else's turn it is
            return


class _News:
    """What one client has not been told yet."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._described: object = None
        self._seen: object = None
        self._event = max((event["number"] for event in service.events.since()), default=0)
        self._told_s = 0.0
        self.rows = 0

    def all(self) -> Iterator[dict[str, Any]]:
        service = self._service
        description = service.link.description()
        if description is not self._described:
            self._described = description
            yield {"kind": "description", "description": description}
        for event in service.events.since(self._event):
            self._event = event["number"]
            yield {"kind": "event", "event": event}
        now = time.monotonic()
        holder = service.lease.holder()
        seen = (id(service.link.status()), service.link.state(), holder and holder.client)
        if seen != self._seen or now - self._told_s > _STATUS_S:
            self._seen, self._told_s = seen, now
            yield {"kind": "status", "status": service.status()}


def _reason(text: str) -> str:
    """Return why a connection is closed as a close frame has room for it."""
    return text.encode("ascii", "backslashreplace")[:_MOST_REASON_BYTES].decode()


async def _send(socket: WebSocket, text: str) -> None:
    """Send; raises TimeoutError where the other side does not read."""
    async with asyncio.timeout(_SLOW_S):
        await socket.send_text(text)


async def _swallow(socket: WebSocket) -> None:
    """Take what a client that only looks on sends; return when it has gone, or says too much."""
    for _ in range(1000):
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return
        await asyncio.sleep(0.05)


async def _is_here() -> bool:
    return False
