"""The WebSocket of `/control`: the right to move for as long as the connection lives."""

from __future__ import annotations

import asyncio
import json
import time
from contextlib import suppress
from typing import Any, Final, Literal

from fastapi import WebSocket
from pydantic import Field, TypeAdapter, ValidationError
from starlette.websockets import WebSocketDisconnect

from cdpr_rt.errors import ControlError
from cdpr_rt.service.http import models
from cdpr_rt.service.lease import LeaseError
from cdpr_rt.service.link import Reply
from cdpr_rt.service.service import Service

BUSY, REFUSED, SILENT, UNFIT = 1013, 4409, 4408, 1008
"""Codes that a connection is closed with, beside the usual ones."""
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


_PROGRAM: Final = TypeAdapter(models.ProgramRequest)
_SET: Final = TypeAdapter(models.Set)


class ControlSocket:
    """One accepted connection of `client`, which holds the right under `token`.

    Orders are carried out one after the other, but `hold`: it goes before all of them, and those
    that were sent before it and have not begun are refused.
    """

    def __init__(
        self, service: Service, socket: WebSocket, client: str, token: str, ttl_s: float
    ) -> None:
        self._service = service
        self._socket = socket
        self._client, self._token, self._ttl_s = client, token, ttl_s
        self._orders: asyncio.Queue[Order] = asyncio.Queue(_MOST_WAITING)
        self._is_working = False
        self._holds: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Obey until the client has gone, is silent or asks for too much; give the right back."""
        held = {"kind": "held", "token": self._token, "ttl_s": self._ttl_s}
        reading: asyncio.Task[tuple[int, str] | None] | None = None
        working = asyncio.create_task(self._work())
        try:
            await send(self._socket, json.dumps(held))
            reading = asyncio.create_task(self._read())
            await asyncio.wait({reading, working}, return_when=asyncio.FIRST_COMPLETED)
        except (TimeoutError, WebSocketDisconnect):
            return
        finally:
            tasks = [working, *self._holds, *([reading] if reading else [])]
            unfinished = [task for task in tasks if task.cancel()]
            with suppress(LeaseError):  # it has run out, or is somebody else's by now
                self._service.lease.release(self._token)
            await asyncio.gather(*unfinished, return_exceptions=True)
        if working not in unfinished:
            working.result()  # raises what ended it
        if reading is not None and reading not in unfinished and (end := reading.result()):
            await self._socket.close(*end)

    async def _read(self) -> tuple[int, str] | None:
        """Take messages until the end; return what to close the connection with, if it lives."""
        allowed, before = _MESSAGES_PER_S, time.monotonic()
        while True:
            try:
                async with asyncio.timeout(self._ttl_s):
                    message = await self._socket.receive()
            except TimeoutError:
                if self._is_working or self._holds:  # its answer is waited for
                    continue
                return SILENT, f"nothing came for {self._ttl_s:g} s"
            if message["type"] != "websocket.receive":
                return None
            now = time.monotonic()
            allowed = min(_MESSAGES_PER_S, allowed + _MESSAGES_PER_S * (now - before)) - 1.0
            before = now
            if allowed < 0.0:
                return UNFIT, f"more than {_MESSAGES_PER_S:g} messages a second"
            await self._take(message.get("text") or "")

    async def _take(self, text: str) -> None:
        try:
            order = Order.model_validate_json(text)
        except ValidationError as error:
            await self._refuse(None, _first_of(error))
            return
        if order.do == "hold":
            before = [self._orders.get_nowait() for _ in range(self._orders.qsize())]
            hold = asyncio.create_task(self._carry_out(order))
            self._holds.add(hold)
            hold.add_done_callback(self._holds.discard)
            for one in before:
                await self._refuse(one.id, f"{one.do}: a stop was asked for after it")
        elif self._orders.full():
            await self._refuse(order.id, f"{_MOST_WAITING} orders wait already")
        else:
            self._orders.put_nowait(order)

    async def _work(self) -> None:
        while True:
            order = await self._orders.get()
            self._is_working = True
            await self._carry_out(order)
            self._is_working = False

    async def _carry_out(self, order: Order) -> None:
        try:
            state, refused = await self._do(order)
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

    async def _do(self, order: Order) -> tuple[str, Reply | None]:
        """Return the loop's state, and its refusal where it refused."""
        service, client, token = self._service, self._client, self._token
        if order.do == "renew":
            service.lease.renew(token)
            return service.link.state(), None
        if order.do == "hold":
            with suppress(LeaseError):  # who has lost the right meanwhile may stop all the same
                service.lease.renew(token)
            reply = await service.command("hold", client)
        elif order.do == "program":
            program = _PROGRAM.validate_python({"program": order.program, "wanted": order.wanted})
            fields = {"program": program.program, "wanted": program.wanted}
            reply = await service.command_with_right("program", client, token, _is_here, **fields)
        else:
            change = _SET.validate_python({"wanted": order.wanted})
            wanted = {"wanted": change.wanted}
            reply = await service.command_with_right("set", client, token, _is_here, **wanted)
        return reply.state, None if reply.ok else reply

    async def _refuse(self, number: int | None, why: str) -> None:
        await self._reply(id=number, ok=False, error=why)

    async def _reply(self, **answer: Any) -> None:
        try:
            await send(self._socket, json.dumps({"kind": "reply", **answer}))
        except TimeoutError:
            self._socket.state.abort()
        except WebSocketDisconnect:  # who reads here learns it as well
            return


def reason(text: str) -> str:
    """Return why a connection is closed as a close frame has room for it."""
    return text.encode("ascii", "backslashreplace")[:_MOST_REASON_BYTES].decode()


async def send(socket: WebSocket, text: str) -> None:
    """Send; raises TimeoutError where the other side does not read."""
    async with asyncio.timeout(_SLOW_S):
        await socket.send_text(text)


def _first_of(error: ValidationError) -> str:
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"])
    return f"{where}: {first['msg']}"[:300]


async def _is_here() -> bool:
    """Whether the client has gone; its pending requests are cancelled then."""
    return False
