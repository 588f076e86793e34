"""Who is let in: a door before the control interface, one for each address it listens at."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import ipaddress
import json
import socket
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

MOST_BODY_BYTES: Final = 16384
_BODY_S = 5.0
_REQUESTS_PER_S, _BURST = 200.0, 400.0
_URGENT_PER_S, _URGENT_BURST = 20.0, 40.0
_MOST_PEERS = 1024
_URGENT = frozenset({"/hold", "/disable", "/shutdown"})
_OPEN = frozenset({"/", "/status", "/docs", "/openapi.json"})
_HEADERS = [(b"x-content-type-options", b"nosniff"), (b"cache-control", b"no-store")]


class _RefusedError(Exception):
    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status = status


@dataclass(frozen=True)
class Door:
    """What is asked of those who come by one address."""

    key: bytes | None = None
    """The shared key; without one nobody is asked for it."""
    local: bool = False
    """A Unix socket: its file's permissions say who may connect."""
    hosts: frozenset[str] = frozenset()
    """Names of this machine, beside localhost and addresses in figures."""

    @classmethod
    def named(cls, key: bytes | None, host: str) -> Door:
        """Return a door on TCP at `host`, known by this machine's names too."""
        return cls(key, hosts=frozenset({host.lower(), socket.gethostname().lower()}))


class Gate:
    """Asks for the key, sees to it that no web page reaches in, and bounds what comes through.

    A page that a browser has open can send requests to this machine. Those carry the page's
    `Origin`; and where its name was pointed to this machine afterwards, that name as `Host`.
    `refused` is called for everybody who is not let in; `leads` says whether a token is that of
    the client that may move, whom a flood from its own address shall not silence.
    """

    def __init__(
        self,
        app: ASGIApp,
        door: Door,
        refused: Callable[[], None],
        leads: Callable[[str], bool],
    ) -> None:
        self._app = app
        self._door = door
        self._refused = refused
        self._leads = leads
        self._usual = _Buckets(_REQUESTS_PER_S, _BURST)
        self._urgent = _Buckets(_URGENT_PER_S, _URGENT_BURST)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or answer it here."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        try:
            self._check(scope)
            if scope["type"] == "http":
                receive = await _whole_body(receive)
        except _RefusedError as refused:
            self._refused()
            await _answer(scope, send, refused)
            return

        async def send_on(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", ()), *_HEADERS]}
            await send(message)

        await self._app(scope, receive, send_on)

    def _check(self, scope: Scope) -> None:
        headers = {name.lower(): value for name, value in scope["headers"]}
        peer = "" if self._door.local or not scope["client"] else scope["client"][0]
        if self._leads(headers.get(b"x-control-token", b"").decode("latin-1")):
            peer = "the one that may move"
        buckets = self._urgent if scope["path"] in _URGENT else self._usual
        if not buckets.take(peer):
            raise _RefusedError(HTTPStatus.TOO_MANY_REQUESTS, "too many requests; go slower")
        if b"content-length" in headers and b"transfer-encoding" in headers:
            # a proxy may see its end elsewhere, and what follows as somebody else's request
            raise _RefusedError(
                HTTPStatus.BAD_REQUEST, "Content-Length and Transfer-Encoding; allowed: one of them"
            )
        host = headers.get(b"host", b"").decode("latin-1")
        guarded = self._door.local or self._door.key is not None
        if not guarded and not self._is_ours(host):
            raise _RefusedError(
                HTTPStatus.FORBIDDEN, "Host: not a name of this machine; use its address"
            )
        origin = headers.get(b"origin")
        if origin is not None and origin.decode("latin-1").lower() != f"http://{host}".lower():
            raise _RefusedError(
                HTTPStatus.FORBIDDEN, "Origin: pages of other hosts may not do this"
            )
        self._check_key(scope, headers.get(b"authorization", b""))

    def _is_ours(self, host: str) -> bool:
        name = host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() else host
        name = name.removeprefix("[").removesuffix("]").lower()
        if name == "localhost" or name in self._door.hosts:
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True

    def _check_key(self, scope: Scope, given: bytes) -> None:
        key = self._door.key
        reads_only = scope["type"] == "http" and scope["method"] in ("GET", "HEAD")
        if key is None or (reads_only and scope["path"] in _OPEN):
            return
        scheme, _, secret = given.partition(b" ")
        # digests: the comparison's time tells nothing, not even the key's length
        right = hmac.compare_digest(_digest(secret.strip()), _digest(key))
        if scheme.lower() != b"bearer" or not right:
            raise _RefusedError(
                HTTPStatus.UNAUTHORIZED, "Authorization: Bearer KEY is missing or wrong"
            )


class _Buckets:
    """A steady rate and a burst for each peer; peers not seen for long are forgotten."""

    def __init__(self, rate_Hz: float, burst: float) -> None:
        self._rate_Hz = rate_Hz
        self._burst = burst
        self._peers: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def take(self, peer: str) -> bool:
        now = time.monotonic()
        left, before = self._peers.pop(peer, (self._burst, now))
        left = min(self._burst, left + (now - before) * self._rate_Hz)
        allowed = left >= 1.0
        self._peers[peer] = (left - 1.0 if allowed else left), now
        if len(self._peers) > _MOST_PEERS:
            self._peers.popitem(last=False)
        return allowed


async def _whole_body(receive: Receive) -> Receive:
    """Return a `receive` that gives the body at once, which was neither large nor slow."""
    body = bytearray()
    try:
        async with asyncio.timeout(_BODY_S):
            while True:
                message = await receive()
                if message["type"] == "http.disconnect":
                    raise _RefusedError(HTTPStatus.BAD_REQUEST, "the body is not whole")
                body += message.get("body", b"")
                if len(body) > MOST_BODY_BYTES:
                    raise _RefusedError(
                        HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
                        f"the body has more than {MOST_BODY_BYTES} bytes",
                    )
                if not message.get("more_body"):
                    break
    except TimeoutError:
        raise _RefusedError(
            HTTPStatus.REQUEST_TIMEOUT, f"the body did not come within {_BODY_S:g} s"
        ) from None
    whole: list[Message] = [{"type": "http.request", "body": bytes(body), "more_body": False}]

    async def receive_on() -> Message:
        return whole.pop() if whole else await receive()

    return receive_on


async def _answer(scope: Scope, send: Send, refused: _RefusedError) -> None:
    body = json.dumps({"error": str(refused)}).encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        *_HEADERS,
    ]
    if refused.status is HTTPStatus.UNAUTHORIZED:
        headers.append((b"www-authenticate", b"Bearer"))
    if scope["type"] == "http":
        headers.append((b"connection", b"close"))  # whatever of the body is still to come
    kind = "http" if scope["type"] == "http" else "websocket.http"
    start: dict[str, Any] = {"status": refused.status.value, "headers": headers}
    await send({"type": f"{kind}.response.start", **start})
    await send({"type": f"{kind}.response.body", "body": body})


def _digest(value: bytes) -> bytes:
    return hashlib.sha256(value).digest()
