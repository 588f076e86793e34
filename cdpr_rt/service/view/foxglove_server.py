"""Foxglove's WebSocket protocol, served to whoever may look on, and bounded in what they cost."""

from __future__ import annotations

import contextlib
import json
import logging
import socket
import struct
import time
from base64 import b64encode
from collections.abc import AsyncIterator, Collection
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from typing import Any, Final

from foxglove import Schema
from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from cdpr_rt.service.http.access_control import is_own_host

MOST_VIEWERS: Final = 16
PROTOCOL: Final = Subprotocol("foxglove.sdk.v1")
_OPEN_S, _TIMEOUT_S = 5.0, 10.0
_UNREAD_BYTES: Final = 1 << 16
_MOST_UNSENT_BYTES: Final = 1 << 18
_MOST_RECEIVED_BYTES: Final = 1 << 16
"""Rate limit of a viewer's messages: at once, and in each second."""
_MOST_REASON: Final = 200
_MOST_ID: Final = (1 << 32) - 1
_DATA: Final = struct.Struct("<BIQ")
_MESSAGE_DATA: Final = 1  # the opcode of binary frames that carry a message


@dataclass(frozen=True)
class Topic:
    """Topic that can be subscribed to; `encoding` of its messages is `json` or `protobuf`."""

    number: int
    name: str
    encoding: str
    schema: Schema

    def advertisement(self) -> dict[str, Any]:
        """Return the topic as it is advertised."""
        data = self.schema.data
        is_text = self.encoding == "json"
        return {
            "id": self.number,
            "topic": self.name,
            "encoding": self.encoding,
            "schemaName": self.schema.name,
            "schemaEncoding": self.schema.encoding,
            "schema": data.decode() if is_text else b64encode(data).decode(),
        }


class FoxgloveServer:
    """Lets viewers in, tells them the topics, and sends each what it has subscribed to.

    All methods belong to the asyncio loop that serves, but `status`. `name` is that of the server;
    `origins` are the web pages that may look on, as a browser writes them; programs send no
    `Origin`. Nobody waits for a viewer that does not read: it misses messages, and is cut off.
    """

    def __init__(self, name: str, origins: Collection[str]) -> None:
        self._name = name
        self._origins = {origin.lower().rstrip("/") for origin in origins}
        self._topics: dict[int, Topic] = {}
        self._numbers = 0
        self._session = str(time.time_ns())
        self._handshaking: dict[_Viewer, None] = {}
        self._viewers: set[_Viewer] = set()
        self._is_ending = False
        self._refused = 0
        self._refused_last = ""
        # it has lines for each client that talks nonsense: they could fill a disk with them
        self._logger = logging.getLogger(f"{__name__}.silent")
        self._logger.disabled = True

    @contextlib.asynccontextmanager
    async def serving(self, listener: socket.socket) -> AsyncIterator[None]:
        """Let people in at `listener`, and cut all connections at the end."""
        async with serve(
            self._serve_viewer,
            sock=listener,
            backlog=2 * MOST_VIEWERS,
            create_connection=partial(_Viewer, self),  # type: ignore[arg-type]  # as a class is
            subprotocols=[PROTOCOL],
            process_request=self._check,
            process_response=self._on_response,
            compression=None,  # it would keep 300 kB for each
            server_header=None,
            open_timeout=_OPEN_S,
            close_timeout=1.0,
            max_size=_MOST_RECEIVED_BYTES,
            max_queue=4,
            logger=self._logger,
        ):
            try:
                yield
            finally:
                self._is_ending = True
                for one in (*self._handshaking, *self._viewers):
                    one.transport.abort()

    def advertise(self, name: str, encoding: str, schema: Schema) -> Topic:
        """Offer a topic to all viewers."""
        self._numbers += 1
        topic = self._topics[self._numbers] = Topic(self._numbers, name, encoding, schema)
        self._send_json_to_all({"op": "advertise", "channels": [topic.advertisement()]})
        return topic

    def withdraw(self) -> None:
        """Take all topics back."""
        self._send_json_to_all({"op": "unadvertise", "channelIds": list(self._topics)})
        self._topics.clear()
        for viewer in self._viewers:
            viewer.subscriptions.clear()

    def is_wanted(self, topic: Topic) -> bool:
        """Whether anybody has subscribed to it."""
        return any(topic.number in viewer.subscriptions for viewer in self._viewers)

    def send(self, topic: Topic, data: bytes, time_ns: int) -> None:
        """Send a message, of `time_ns` since 1970, to who has subscribed and has read so far."""
        for viewer in self._viewers:
            number = viewer.subscriptions.get(topic.number)
            if number is not None and viewer.has_room():
                broadcast([viewer], _DATA.pack(_MESSAGE_DATA, number, time_ns) + data)

    def status(self) -> dict[str, Any]:
        """Return how many look on, how many were refused, and why the last of them."""
        return {
            "viewers": len(self._viewers),
            "refused": self._refused,
            "refused_last": self._refused_last,
        }

    def admit(self, viewer: _Viewer) -> None:
        """Take a new connection; who says nothing leaves first where many wait."""
        if self._is_ending:  # it would be waited for
            viewer.transport.abort()
        if len(self._handshaking) >= MOST_VIEWERS:
            oldest = next(iter(self._handshaking))
            del self._handshaking[oldest]
            oldest.transport.abort()
        self._handshaking[viewer] = None

    def remove(self, viewer: _Viewer) -> None:
        """Leave out a connection that is lost."""
        self._handshaking.pop(viewer, None)
        self._viewers.discard(viewer)

    def _check(self, viewer: ServerConnection, request: Request) -> Response | None:
        """Return the answer to who may not look on."""
        status = HTTPStatus.FORBIDDEN
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        strange = [origin for origin in origins if origin.lower() not in self._origins]
        if strange:
            reason = f"Origin: {strange[0] or 'null'} may not look on; see --live-origin"
        elif len(hosts) != 1 or not is_own_host(
            hosts[0], ()
        ):  # on loopback no program needs a name
            given = ", ".join(hosts)
            reason = f"Host: {given}: allowed: localhost, or an address in figures"
        elif len(self._viewers) >= MOST_VIEWERS:
            status = HTTPStatus.SERVICE_UNAVAILABLE
            reason = f"{MOST_VIEWERS} others look on already"
        else:
            return None
        return viewer.respond(status, f"{self._note(reason)}\n")

    def _on_response(self, viewer: ServerConnection, _: Request, response: Response) -> None:
        if response.status_code == HTTPStatus.SWITCHING_PROTOCOLS:
            assert isinstance(viewer, _Viewer)  # they are made so
            self._handshaking.pop(viewer, None)
            self._viewers.add(viewer)
        elif error := viewer.protocol.handshake_exc:
            self._note(str(error))

    def _note(self, reason: str) -> str:
        self._refused += 1
        # the library's older versions leave lone surrogates, which no answer can carry
        printable = reason.encode("utf-8", "backslashreplace").decode()
        self._refused_last = printable[:_MOST_REASON]
        return self._refused_last

    async def _serve_viewer(self, viewer: ServerConnection) -> None:
        assert isinstance(viewer, _Viewer)  # they are made so
        about = {"name": self._name, "capabilities": [], "metadata": {}}
        viewer.send_json({"op": "serverInfo", **about, "sessionId": self._session})
        topics = [topic.advertisement() for topic in self._topics.values()]
        viewer.send_json({"op": "advertise", "channels": topics})
        viewer.is_greeted = True
        async for message in viewer:
            if isinstance(message, str):
                self._handle_message(viewer, message)

    def _handle_message(self, viewer: _Viewer, message: str) -> None:
        """Subscribe or unsubscribe; all else a viewer may say means nothing here."""
        try:
            asked = json.loads(message)
        except (ValueError, RecursionError):
            return
        match asked:
            case {"op": "subscribe", "subscriptions": list(wishes)}:
                for wish in wishes:
                    match wish:
                        case {"id": int(number), "channelId": int(topic)}:
                            if topic in self._topics and 0 <= number <= _MOST_ID:
                                viewer.subscriptions[topic] = number
            case {"op": "unsubscribe", "subscriptionIds": list(given)}:
                kept = {topic: n for topic, n in viewer.subscriptions.items() if n not in given}
                viewer.subscriptions = kept

    def _send_json_to_all(self, what: dict[str, Any]) -> None:
        for viewer in self._viewers:
            if viewer.is_greeted:
                viewer.send_json(what)


class _Viewer(ServerConnection):
    """A connection; it is cut off where it says too much or takes too little."""

    def __init__(self, server: FoxgloveServer, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self.subscriptions: dict[int, int] = {}
        """The subscription to each topic, both by number."""
        self.is_greeted = False
        self._foxglove = server
        self._may_say_bytes = float(_MOST_RECEIVED_BYTES)
        self._heard_s = self._kept_up_s = self.loop.time()

    def send_json(self, what: dict[str, Any]) -> None:
        """Send a message of the protocol, without waiting."""
        broadcast([self], json.dumps(what))

    def has_room(self) -> bool:
        """Whether there is room for a message; ends the connection where long there was none."""
        now_s = self.loop.time()
        if self.transport.get_write_buffer_size() <= _MOST_UNSENT_BYTES:
            self._kept_up_s = now_s
            return True
        if now_s - self._kept_up_s > _TIMEOUT_S:
            self.transport.abort()
        return False

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self._foxglove.admit(self)
        # what one is behind is held here for some kilobytes only; more would be old when it is read
        transport.get_extra_info("socket").setsockopt(
            socket.SOL_SOCKET, socket.SO_SNDBUF, _UNREAD_BYTES
        )

    def connection_lost(self, exc: Exception | None) -> None:
        self._foxglove.remove(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        now_s = self.loop.time()
        more_bytes = (now_s - self._heard_s) * _MOST_RECEIVED_BYTES
        self._may_say_bytes = min(_MOST_RECEIVED_BYTES, self._may_say_bytes + more_bytes) - len(
            data
        )
        self._heard_s = now_s
        if self._may_say_bytes < 0.0:
            self.transport.abort()
            return
        super().data_received(data)
        # answers to pings are queued without limit otherwise
        if self.transport.get_write_buffer_size() > 2 * _MOST_UNSENT_BYTES:
            self.transport.abort()
