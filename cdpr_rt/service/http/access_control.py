"""Access control: middleware before the control interface, with a policy for each listener."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import ipaddress
import json
import socket
import time
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, Final
from urllib.parse import parse_qs

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from cdpr_rt.service.http.connections import TokenBuckets
from cdpr_rt.service.http.tickets import Tickets
from cdpr_rt.service.link import URGENT

MOST_BODY_BYTES: Final = 16384
MOST_PATH_BYTES: Final = 1 << 21
"""Longest body of `POST /path`, a path's file."""
_PATH_PATH: Final = "/path"
_BODY_S = 5.0
_REQUESTS_PER_S, _BURST = 200.0, 400.0
_FAILURES_PER_S, _FAILURES = 2.0, 10.0
_FAILURES_OF_ALL_PER_S, _FAILURES_OF_ALL = 20.0, 100.0
_THROTTLE_S = 1.0
"""A wrong key or token is answered so late, once there have been too many."""
_MOST_FIELDS = 16
URGENT_PATHS: Final = frozenset(f"/{do}" for do in URGENT)
_PUBLIC_PATHS = frozenset({"/", "/status", "/docs", "/openapi.json"})
_KEYLESS_STOPS = frozenset({("http", "POST", "/hold"), ("http", "POST", "/disable")})
_LIVE_PATH = "/live"
_HEADERS = [(b"x-content-type-options", b"nosniff"), (b"cache-control", b"no-store")]


class _RefusedError(Exception):
    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status = status


@dataclass(frozen=True)
class AccessPolicy:
    """Access policy of one listener."""

    key: bytes | None = None
    """The shared key, asked for beyond the status; without one nobody moves or ends anything here.

    Who can reach an address on loopback is any user of the machine: they may look on and stop.
    """
    local: bool = False
    """A Unix socket: its file's permissions say who may connect, who then may do everything."""
    hosts: frozenset[str] = frozenset()
    """Names of this machine, beside localhost and addresses in figures."""

    @classmethod
    def on_tcp(cls, key: bytes | None, host: str, *, loopback: bool = False) -> AccessPolicy:
        """Return the policy of a listener on TCP at `host`.

        It answers to this machine's names too, unless on loopback: there nobody needs them, and on
        a network without DNS anybody may answer to them.
        """
        names = frozenset[str]() if loopback else names_of_this_machine()
        return cls(key, hosts=names | {host.lower()})


def names_of_this_machine() -> frozenset[str]:
    """Return this machine's names: its host name, and that on a network without DNS (mDNS)."""
    name = socket.gethostname().lower()
    return frozenset({name, f"{name}.local"})


def is_own_host(host: str, names: Container[str]) -> bool:
    """Whether a request's `Host` is localhost, an address in figures, or one of `names`.

    The name of a page's own host that was pointed to this machine afterwards is none of these.
    """
    name = host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() else host
    name = name.removeprefix("[").removesuffix("]").lower()
    if name == "localhost" or name in names:
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


class AccessControl:
    """Asks for the key, sees to it that no web page reaches in, and bounds what comes through.

    A page that a browser has open can send requests to this machine. Those carry the page's
    `Origin`; and where its name was pointed to this machine afterwards, that name as `Host`.
    A stop is never refused for being one too many. `refused` is called for everybody who is not
    let in; `holds_right` says whether a token is that of the client that may move, whom a flood
    from its own address shall not silence. Where a key is asked one of `tickets` opens a WebSocket.
    """

    def __init__(
        self,
        app: ASGIApp,
        policy: AccessPolicy,
        refused: Callable[[], None],
        holds_right: Callable[[str], bool],
        tickets: Tickets,
    ) -> None:
        self._app = app
        self._policy = policy
        self._refused = refused
        self._holds_right = holds_right
        self._tickets = tickets
        self._requests = TokenBuckets(_REQUESTS_PER_S, _BURST)
        self._failures = TokenBuckets(_FAILURES_PER_S, _FAILURES)
        self._failures_of_all = TokenBuckets(_FAILURES_OF_ALL_PER_S, _FAILURES_OF_ALL)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or answer it here."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        try:
            await self._check(scope)
            if scope["type"] == "http":
                most = MOST_PATH_BYTES if scope["path"] == _PATH_PATH else MOST_BODY_BYTES
                receive = await _read_body(receive, most)
        except _RefusedError as refused:
            self._refused()
            await _answer(scope, send, refused)
            return

        async def send_on(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", ()), *_HEADERS]}
            await send(message)

        await self._app(scope, receive, send_on)

    @property
    def is_local(self) -> bool:
        """Whether this is the Unix socket's, which only its user reaches."""
        return self._policy.local

    @property
    def anyone_may_stop(self) -> bool:
        """Whether everybody who can connect may stop the robot, without a key."""
        return self._policy.key is None

    def is_authenticated(self, head: bytes) -> bool:
        """Whether a request's head, up to its blank line, shows the key or who may move's token.

        It decides on places and order only: the request itself is checked when it is processed.
        """
        lines, end, _ = head.partition(b"\r\n\r\n")
        if not end:
            return False
        pairs = (line.partition(b":") for line in lines.split(b"\r\n")[1:])
        headers = {name.lower(): value.strip() for name, _, value in pairs}
        has_key = self._policy.key is not None and self._has_key(headers.get(b"authorization", b""))
        return has_key or self._holds_right(headers.get(b"x-control-token", b"").decode("latin-1"))

    async def _check(self, scope: Scope) -> None:
        headers = {name.lower(): value for name, value in scope["headers"]}
        if b"content-length" in headers and b"transfer-encoding" in headers:
            # a proxy may see its end elsewhere, and what follows as somebody else's request
            raise _RefusedError(
                HTTPStatus.BAD_REQUEST, "Content-Length and Transfer-Encoding; allowed: one of them"
            )
        self._check_page(headers)
        peer = scope["client"][0] if scope["client"] else ""
        has_key = self._has_key(headers.get(b"authorization", b"")) or self._has_ticket(scope)
        if not has_key and not self._is_public(scope):
            await self._throttle(peer, scope)
            raise _RefusedError(
                HTTPStatus.UNAUTHORIZED,
                "Authorization: Bearer KEY is missing or wrong"
                if self._policy.key
                else "nobody can show a key here: everybody may look on, hold and disable; for the "
                "rest use the Unix socket, or start the daemon with --key-file",
            )
        if _is_stop(scope):
            return
        token = headers.get(b"x-control-token", b"").decode("latin-1")
        if self._holds_right(token):
            who = "the one that may move"
        elif token:
            await self._throttle(peer, scope)
            who = peer
        else:
            who = f"{peer}, with the key" if has_key and self._policy.key else peer
        if (
            who != peer
            and (connection := scope["state"].get("connection"))
            and not connection.is_authenticated
        ):
            connection.note_authenticated()
        if not self._requests.take(who, time.monotonic()):
            raise _RefusedError(HTTPStatus.TOO_MANY_REQUESTS, "too many requests; go slower")

    def _check_page(self, headers: Mapping[bytes, bytes]) -> None:
        host = headers.get(b"host", b"").decode("latin-1")
        if not self._policy.local and not is_own_host(host, self._policy.hosts):
            raise _RefusedError(
                HTTPStatus.FORBIDDEN, "Host: not a name of this machine; use its address"
            )
        origin = headers.get(b"origin")
        if origin is not None and origin.decode("latin-1").lower() != f"http://{host}".lower():
            raise _RefusedError(
                HTTPStatus.FORBIDDEN, "Origin: pages of other hosts may not do this"
            )

    def _has_key(self, given: bytes) -> bool:
        key = self._policy.key
        if key is None:
            return self._policy.local
        scheme, _, secret = given.partition(b" ")
        # digests: the comparison's time tells nothing, not even the key's length
        right = hmac.compare_digest(_digest(secret.strip()), _digest(key))
        return right and scheme.lower() == b"bearer"

    def _has_ticket(self, scope: Scope) -> bool:
        if scope["type"] != "websocket" or self._policy.key is None:
            return False
        try:
            query = parse_qs(scope["query_string"].decode("latin-1"), max_num_fields=_MOST_FIELDS)
        except ValueError:
            return False
        return self._tickets.redeem(query.get("ticket", [""])[0])

    def _is_public(self, scope: Scope) -> bool:
        """Whether this is for everybody who can connect, the key or not."""
        kind, method, path = scope["type"], scope.get("method", ""), scope["path"]
        reads = kind == "http" and method in ("GET", "HEAD")
        if self._policy.key is not None:
            return reads and path in _PUBLIC_PATHS
        looks_on = kind == "websocket" and path == _LIVE_PATH
        return reads or looks_on or (kind, method, path) in _KEYLESS_STOPS

    async def _throttle(self, peer: str, scope: Scope) -> None:
        """Note a wrong key or token; have who tries too many, or all who do, wait for the answer.

        Who has the right one never comes here. Whose connection waits here leaves first where
        there are too many.
        """
        now_s = time.monotonic()
        of_this, of_all = self._failures.take(peer, now_s), self._failures_of_all.take("", now_s)
        if of_this and of_all:
            return
        if connection := scope["state"].get("connection"):
            connection.is_refused = True
        await asyncio.sleep(_THROTTLE_S)
        if connection:
            connection.is_refused = False


def _is_stop(scope: Scope) -> bool:
    """Whether this asks for a stop; another method at the same path does not."""
    is_post = scope["type"] == "http" and scope["method"] == "POST"
    return is_post and scope["path"] in URGENT_PATHS


async def _read_body(receive: Receive, most: int) -> Receive:
    """Return a `receive` that gives the body at once, which was neither large nor slow."""
    body = bytearray()
    try:
        async with asyncio.timeout(_BODY_S):
            while True:
                message = await receive()
                if message["type"] == "http.disconnect":
                    raise _RefusedError(HTTPStatus.BAD_REQUEST, "the body is not whole")
                body += message.get("body", b"")
                if len(body) > most:
                    raise _RefusedError(
                        HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
                        f"the body has more than {most} bytes",
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
