"""WebSockets: figures as they come, and the right to move for as long as a connection lives."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from typing import Annotated, Any, Final

from fastapi import FastAPI, Query, WebSocket
from starlette.websockets import WebSocketDisconnect

from cdpr_rt.core.cycle_row import FIELDS
from cdpr_rt.runtime.right import LONGEST_S
from cdpr_rt.service.http.control_socket import BUSY, REFUSED, UNFIT, ControlSocket, reason, send
from cdpr_rt.service.lease import SHORTEST_S, LeaseError
from cdpr_rt.service.rows import newest_row, row_table
from cdpr_rt.service.service import Service

FASTEST_HZ: Final = 50.0
_MOST_LIVE = 16
_STATUS_S = 1.0


class WebSocketRoutes:
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
            wanted = tuple(name for name in fields.split(",") if name) or tuple(FIELDS)
            unknown = [name for name in wanted if name not in FIELDS]
            await socket.accept()
            if unknown:
                await socket.close(UNFIT, reason(f"fields: {unknown[0]} is none of a cycle's"))
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
                await socket.close(REFUSED, reason(str(error)))
                return
            # who holds the right is not kept waiting by those who ask without
            socket.state.connection.note_authenticated()
            await ControlSocket(self._service, socket, client, token, ttl_s).run()

    # -- looking on

    async def _show(self, socket: WebSocket, rate_Hz: float, fields: tuple[str, ...]) -> None:
        updates = _Updates(self._service)
        async with self._viewing(socket) as gone:
            while not gone.done():
                for message in updates.all():
                    await send(socket, json.dumps(message))
                cycle = self._cycle(updates, fields)
                if cycle:
                    await send(socket, cycle)
                await asyncio.wait({gone}, timeout=1.0 / rate_Hz)

    @asynccontextmanager
    async def _viewing(self, socket: WebSocket) -> AsyncIterator[asyncio.Task[None]]:
        """Count one that looks on; drop it when it reads too slowly or talks too much."""
        counts = self._service.counts
        counts["live_clients"] += 1
        gone = asyncio.create_task(_discard_incoming(socket))
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

    def _cycle(self, updates: _Updates, fields: tuple[str, ...]) -> str:
        """Return the newest cycle as text, "" where it has been shown already."""
        rows = int(self._service.block.counters["rows"][0])
        if rows == updates.rows:
            return ""
        skipped, updates.rows = rows - updates.rows - 1, rows
        key = (rows, fields)
        if self._cached[0] != key:  # many may look at the same
            row = newest_row(self._service.block)
            table = {} if row is None else row_table(row, fields)
            self._cached = key, json.dumps(table)[1:]
        return f'{{"kind": "cycle", "skipped": {skipped}, {self._cached[1]}'


class _Updates:
    """Data not yet sent to one client."""

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


async def _discard_incoming(socket: WebSocket) -> None:
    """Take what a client that only looks on sends; return when it has gone, or says too much."""
    for _ in range(1000):
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return
        await asyncio.sleep(0.05)
