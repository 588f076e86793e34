"""WebSockets: live values, and the right to move for as long as a connection lasts."""

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

from cdpr_rt.core.cycle_row import FIELDS
from cdpr_rt.core.shared_block import RowReader, SharedBlock
from cdpr_rt.errors import ControlError
from cdpr_rt.loop.right import LONGEST_S
from cdpr_rt.service import http_models as models
from cdpr_rt.service.access_control import LIVE_PATH, TokenBuckets
from cdpr_rt.service.lease import SHORTEST_S, LeaseError
from cdpr_rt.service.link import Reply
from cdpr_rt.service.recording import RowTexts
from cdpr_rt.service.rows import newest_row, row_table
from cdpr_rt.service.service import Service

# The WebSocket of `/control`: the right to move for as long as the connection lasts.

BUSY, REFUSED, SILENT, UNFIT = 1013, 4409, 4408, 1008
"""Codes with which a connection is closed, in addition to the usual ones."""
_MESSAGES_PER_S = 100.0
_MOST_WAITING = 100
_SLOW_S = 1.0
_MOST_REASON_BYTES = 123  # RFC 6455, 5.5


class Order(models.ClientRequest):
    """Message of the holder of the right to move."""

    do: Literal["renew", "hold", "program", "set"]
    program: str = ""
    wanted: dict[str, Any] = Field(default_factory=dict)
    id: int | None = None
    stops_seen: int | None = Field(None, ge=0, le=2**53)


class Stop(models.ClientRequest):
    """Message of a viewer, who needs no right to move for it."""

    do: Literal["hold", "disable"]
    id: int | None = None


def _stop_in(text: str) -> Stop | None:
    """Return the stop in a viewer's message; one with a wrong name or key is a stop too."""
    with suppress(ValidationError):
        return Stop.model_validate_json(text)
    with suppress(ValueError, RecursionError, AttributeError):
        return Stop(do=json.loads(text).get("do"))
    return None


_PROGRAM: Final = TypeAdapter(models.ProgramRequest)
_SET: Final = TypeAdapter(models.Set)


class ControlSocket:
    """One accepted connection of `client`, which holds the right under `token`.

    Orders are carried out one after the other, except `hold`, which overtakes all others. The loop
    rejects orders from before a stop.
    """

    def __init__(
        self, service: Service, socket: WebSocket, client: str, token: str, ttl_s: float
    ) -> None:
        self._service = service
        self._socket = socket
        self._client, self._token, self._ttl_s = client, token, ttl_s
        self._orders: asyncio.Queue[tuple[Order, int]] = asyncio.Queue(_MOST_WAITING)
        self._is_working = False
        self._holds: set[asyncio.Task[None]] = set()
        self._reading: asyncio.Task[tuple[int, str] | None] | None = None

    async def run(self) -> None:
        """Carry out orders until the client has gone, is silent or sends too much; release the
        right.
        """
        held = {"kind": "held", "token": self._token, "ttl_s": self._ttl_s}
        working = asyncio.create_task(self._work())
        try:
            await send(self._socket, json.dumps(held))
            reading = self._reading = asyncio.create_task(self._read())
            await asyncio.wait({reading, working}, return_when=asyncio.FIRST_COMPLETED)
        except (TimeoutError, WebSocketDisconnect):
            return
        finally:
            tasks = [working, *self._holds, *([self._reading] if self._reading else [])]
            unfinished = [task for task in tasks if task.cancel()]
            with suppress(LeaseError):  # the right has expired, or another client has it now
                self._service.lease.release(self._token)
            await asyncio.gather(*unfinished, return_exceptions=True)
        if working not in unfinished:
            working.result()  # raises the exception that ended the task
        if reading in unfinished or reading.cancelled():
            return
        if end := reading.result():
            await self._socket.close(*end)

    async def _read(self) -> tuple[int, str] | None:
        """Read messages until the end; return code and reason for closing a live connection."""
        messages = TokenBuckets(_MESSAGES_PER_S, _MESSAGES_PER_S)
        while True:
            try:
                async with asyncio.timeout(self._ttl_s):
                    message = await self._socket.receive()
            except TimeoutError:
                if self._is_working or self._holds:  # the client waits for its answer
                    continue
                return SILENT, f"no message for {self._ttl_s:g} s"
            if message["type"] != "websocket.receive":
                return None
            if not messages.take("", time.monotonic()):
                return UNFIT, f"more than {_MESSAGES_PER_S:g} messages a second"
            await self._take(message.get("text") or "")

    async def _take(self, text: str) -> None:
        try:
            order = Order.model_validate_json(text)
        except ValidationError as error:
            await self._refuse(None, _first_of(error))
            return
        if order.do == "hold":
            hold = asyncio.create_task(self._carry_out(order, 0))
            self._holds.add(hold)
            hold.add_done_callback(self._holds.discard)
            await asyncio.sleep(0.0)  # the hold counts as a stop before the next order is read
        elif self._orders.full():
            await self._refuse(order.id, f"{_MOST_WAITING} orders are already waiting")
        else:
            stops, seen = self._service.block.stops, order.stops_seen
            self._orders.put_nowait((order, stops if seen is None else min(stops, seen)))

    async def _work(self) -> None:
        while True:
            order, stops = await self._orders.get()
            self._is_working = True
            await self._carry_out(order, stops)
            self._is_working = False

    async def _carry_out(self, order: Order, stops: int) -> None:
        try:
            state, refused = await self._do(order, stops)
        except ValidationError as error:
            await self._refuse(order.id, _first_of(error))
        except ControlError as error:
            await self._refuse(order.id, str(error))
        else:
            if refused is None:
                await self._reply(id=order.id, ok=True, error=None, state=state)
            else:
                why: dict[str, Any] = {"error": refused.text or "refused", "state": state}
                why |= {"refusal": refused.refusal} if refused.refusal else {}
                await self._reply(id=order.id, ok=False, **why)

    async def _do(self, order: Order, stops: int) -> tuple[str, Reply | None]:
        """Return the loop's state, and its reply if it rejected the order."""
        service, client, token = self._service, self._client, self._token
        if order.do == "renew":
            service.lease.renew(token)
            return service.link.state(), None
        if order.do == "hold":
            with suppress(LeaseError):  # a client that has lost the right may still stop
                service.lease.renew(token)
            reply = await service.command("hold", client)
        elif order.do == "program":
            program = _PROGRAM.validate_python({"program": order.program, "wanted": order.wanted})
            fields = {"program": program.program, "wanted": program.wanted}
            reply = await service.command_with_right(
                "program", client, token, _is_here, stops=stops, **fields
            )
        else:
            change = _SET.validate_python({"wanted": order.wanted})
            reply = await service.command_with_right(
                "set", client, token, _is_here, stops=stops, wanted=change.wanted
            )
        return reply.state, None if reply.ok else reply

    async def _refuse(self, number: int | None, why: str) -> None:
        await self._reply(id=number, ok=False, error=why)

    async def _reply(self, **answer: Any) -> None:
        try:
            await send(self._socket, json.dumps({"kind": "reply", **answer}))
        except TimeoutError:
            if self._reading is not None:
                self._reading.cancel()  # ends the connection
        except WebSocketDisconnect:  # the reader also notices this
            return


def reason(text: str) -> str:
    """Return why a connection is closed, shortened to fit into a close frame."""
    return text.encode("ascii", "backslashreplace")[:_MOST_REASON_BYTES].decode()


async def send(socket: WebSocket, text: str) -> None:
    """Send a text; raises TimeoutError if the other side does not read."""
    async with asyncio.timeout(_SLOW_S):
        try:
            await socket.send_text(text)
        except (
            RuntimeError
        ):  # the server has closed the connection, because a ping was not answered
            raise WebSocketDisconnect from None


def _first_of(error: ValidationError) -> str:
    return models.fault_text(error.errors()[0])


async def _is_here() -> bool:
    """Return False for "not gone", because pending requests are cancelled if the client leaves."""
    return False


FASTEST_HZ: Final = 50.0
_MOST_LIVE = 64
_MOST_ALL_CYCLES: Final = 8
"""Largest number of them that watch every cycle; each takes 2 % of a core."""
_STATUS_S = 1.0
_MOST_CYCLES = 1000
_MOST_STOPS: Final = 1000
"""Messages of one viewer, after which it must connect again."""


class WebSocketRoutes:
    """`/live` and the WebSocket of `/control`."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._cached: tuple[object, str] = (None, "")
        self._all_cycles = 0

    def add(self, app: FastAPI) -> None:
        """Add both routes."""

        @app.websocket(LIVE_PATH)
        async def live(
            socket: WebSocket,
            rate_Hz: Annotated[float, Query(gt=0.0, le=FASTEST_HZ)] = 10.0,
            fields: Annotated[str, Query(max_length=1000)] = "",
            all_cycles: bool = False,
        ) -> None:
            wanted = tuple(name for name in fields.split(",") if name) or tuple(FIELDS)
            unknown = [name for name in wanted if name not in FIELDS]
            await socket.accept()
            if unknown:
                await socket.close(UNFIT, reason(f"fields: {unknown[0]} is not a field of a cycle"))
            elif self._service.counts["live_clients"] >= _MOST_LIVE:
                await socket.close(BUSY, f"{_MOST_LIVE} others are already watching")
            elif all_cycles and self._all_cycles >= _MOST_ALL_CYCLES:
                text = f"{_MOST_ALL_CYCLES} others are already watching every cycle"
                await socket.close(BUSY, text)
            else:
                self._all_cycles += all_cycles
                try:
                    await self._show(socket, rate_Hz, wanted, all_cycles)
                finally:
                    self._all_cycles -= all_cycles

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
            await ControlSocket(self._service, socket, client, token, ttl_s).run()

    # -- viewers

    async def _show(
        self, socket: WebSocket, rate_Hz: float, fields: tuple[str, ...], all_cycles: bool
    ) -> None:
        updates = _Updates(self._service)
        rows = None
        if all_cycles:  # the first use in a process loads compiled code
            rows = await asyncio.to_thread(_AllCycles, self._service.block, fields)
        async with self._viewing(socket) as gone:
            due_s = time.monotonic()
            while not gone.done():
                for message in updates.all():
                    await send(socket, json.dumps(message))
                cycle = self._cycle(updates, fields) if rows is None else rows.text()
                if cycle:
                    await send(socket, cycle)
                now_s = time.monotonic()
                due_s = max(due_s + 1.0 / rate_Hz, now_s)  # on average at the rate
                await asyncio.wait({gone}, timeout=due_s - now_s)

    @asynccontextmanager
    async def _viewing(self, socket: WebSocket) -> AsyncIterator[asyncio.Task[None]]:
        """Count a viewer and obey its stops; disconnect it if it is too slow or sends too much."""
        counts = self._service.counts
        counts["live_clients"] += 1
        gone = asyncio.create_task(self._obey_stops(socket))
        try:
            yield gone
        except TimeoutError:
            counts["slow_clients_dropped"] += 1
            self._service.events.add("live", "disconnected a client that read too slowly")
        except WebSocketDisconnect:
            pass
        finally:
            counts["live_clients"] -= 1
            gone.cancel()

    async def _obey_stops(self, socket: WebSocket) -> None:
        """Obey a viewer's stops; return when it has gone, or sends too much."""
        obeying: set[asyncio.Task[None]] = set()
        for _ in range(_MOST_STOPS):
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if stop := _stop_in(message.get("text") or ""):
                obeying.add(task := asyncio.create_task(self._obey(socket, stop)))
                task.add_done_callback(obeying.discard)
            await asyncio.sleep(0.05)

    async def _obey(self, socket: WebSocket, stop: Stop) -> None:
        obeyed = asyncio.create_task(self._service.command(stop.do, stop.client))
        with suppress(TimeoutError, WebSocketDisconnect):
            # the reply may follow only when the platform has been lowered
            await send(socket, json.dumps({"kind": "taken", "id": stop.id}))
        try:
            reply = await obeyed
            error = None if reply.ok else reply.text or "refused"
        except ControlError as failure:
            error = str(failure)
        answer = {"kind": "reply", "id": stop.id, "ok": error is None, "error": error}
        with suppress(TimeoutError, WebSocketDisconnect):
            await send(socket, json.dumps(answer))

    def _cycle(self, updates: _Updates, fields: tuple[str, ...]) -> str:
        """Return the newest cycle as text, "" if it was sent before."""
        rows = int(self._service.block.counters["rows"][0])
        if rows == updates.rows:
            return ""
        skipped, updates.rows = rows - updates.rows - 1, rows
        key = (rows, fields)
        if self._cached[0] != key:  # many clients may view the same fields
            row = newest_row(self._service.block)
            table = {} if row is None else row_table(row, fields)
            self._cached = key, json.dumps(table)[1:]
        return f'{{"kind": "cycle", "skipped": {skipped}, {self._cached[1]}'


class _AllCycles:
    """All cycles not yet sent to one client, with states as numbers instead of names."""

    def __init__(self, block: SharedBlock, fields: tuple[str, ...]) -> None:
        self._reader = RowReader(block)
        self._texts = RowTexts(block.n, fields)
        self._lost = 0

    def text(self) -> str:
        """Return the new cycles as a message, "" without any."""
        texts = self._texts(self._reader.read(_MOST_CYCLES))
        if not texts:
            return ""
        lost, self._lost = self._reader.lost - self._lost, self._reader.lost
        return f'{{"kind": "cycles", "skipped": {lost}, "rows": [{b",".join(texts).decode()}]}}'


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
        link = service.link
        seen = (id(link.status()), link.state(), holder and holder.client, service.block.stops)
        if seen != self._seen or now - self._told_s > _STATUS_S:
            self._seen, self._told_s = seen, now
            yield {"kind": "status", "status": service.status()}
