"""Access control: middleware before the control interface, with a policy for each listener."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import ipaddress
import json
import secrets
import socket
import time
from collections import Counter, OrderedDict
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, Final
from urllib.parse import parse_qs

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from cdpr_profiles.bounded_input import is_mostly_text
from cdpr_rt.loop.stop_socket import STOPS
from cdpr_rt.service.page import PAGE_PREFIX, REPORTS_PREFIX

# A ticket replaces the key for opening one WebSocket or downloading one recording, because browsers
# cannot send a header with these requests.

VALID_S: Final = 30.0
MOST_TICKETS: Final = 64
"""Largest number of valid tickets; if there are more, the oldest becomes void."""


class Tickets:
    """Random tickets, each valid once and for `VALID_S`; for one asyncio loop."""

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._clock_s = clock_s
        self._until_s: OrderedDict[str, float] = OrderedDict()

    def issue(self) -> str:
        """Return a new ticket."""
        ticket = secrets.token_urlsafe(24)
        self._until_s[ticket] = self._clock_s() + VALID_S
        if len(self._until_s) > MOST_TICKETS:
            self._until_s.popitem(last=False)
        return ticket

    def redeem(self, ticket: str) -> bool:
        """Use a ticket, which is then void; return whether it was valid."""
        until_s = self._until_s.pop(ticket, None)
        return until_s is not None and self._clock_s() < until_s


MOST_BODY_BYTES: Final = 16384
MOST_PATH_BYTES: Final = 1 << 21
"""Longest body of `POST /path`, which contains the file of a path."""
_PATH_PATH: Final = "/path"
_MOST_STRINGS, _MOST_OTHER_BYTES = 32, 1024
"""Largest number of keys and texts in a body longer than `MOST_BODY_BYTES`, and of bytes besides
them.

The file is one of the texts. Validating 100,000 keys would occupy the event loop for a second.
"""
_BODY_S = 5.0
_REQUESTS_PER_S, _BURST = 200.0, 400.0
_FAILURES_PER_S, _FAILURES = 2.0, 10.0
_FAILURES_OF_ALL_PER_S, _FAILURES_OF_ALL = 20.0, 100.0
_THROTTLE_S, _MOST_THROTTLED = 1.0, 64
"""Delay of the answer to a wrong key or token after too many of them; largest number of delayed
answers."""
_MOST_AT_ONCE: Final = 24
"""Largest number of requests of one client that are processed at the same time."""
LIVE_PATH: Final = "/live"
_MOST_PEERS: Final = 1024
_MOST_FIELDS = 16
STOP_PATHS: Final = frozenset(f"/{do}" for do in STOPS)
_PUBLIC_PATHS = frozenset({"/", "/status", "/docs", "/openapi.json"})
_PUBLIC_PREFIXES: Final = (PAGE_PREFIX, REPORTS_PREFIX)
_LOCAL_PATHS: Final = frozenset({"/page-address"})
_KEYLESS_STOPS = frozenset({("http", "POST", "/hold"), ("http", "POST", "/disable")})
_LIVE_PATH = "/live"
_DOWNLOADS: Final = "/recordings/"
PROGRESS: Final = "cdpr_rt.progress"
"""Key of a scope: a number that grows while an answer is being made or sent."""
STOPS_BEFORE: Final = "cdpr_rt.stops"
"""Key of a scope: the number of stops when the request arrived, perhaps before its body."""
_HEADERS: Final = {
    b"content-security-policy": b"default-src 'none'; frame-ancestors 'none'",
    b"cross-origin-resource-policy": b"same-origin",
    b"referrer-policy": b"no-referrer",
    b"x-content-type-options": b"nosniff",
    b"cache-control": b"no-store",
}
"""Headers of every answer that does not have them."""


class _RefusedError(Exception):
    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status = status


@dataclass(frozen=True)
class AccessPolicy:
    """Access policy of one listener."""

    key: bytes | None = None
    """The key, required for everything except the status and the page's files; without a key no
    client can move the robot."""
    open_reading: bool = False
    """Whether every client that can connect may watch, hold and disable without the key.

    This is for a loopback address without a key file, which every user of the machine can reach.
    """
    local: bool = False
    """Whether it is a Unix socket: file permissions limit who may connect, and clients may do
    everything."""
    hosts: frozenset[str] = frozenset()
    """Names of this machine, in addition to localhost and numeric addresses."""

    @classmethod
    def on_tcp(
        cls, key: bytes | None, host: str, *, loopback: bool = False, open_reading: bool = False
    ) -> AccessPolicy:
        """Return the policy of a listener on TCP at `host`.

        The listener also accepts this machine's names, except on loopback: no client needs them
        there, and on a network without DNS any machine may claim them.
        """
        names = frozenset[str]() if loopback else names_of_this_machine()
        return cls(key, open_reading, hosts=names | {host.lower()})


def names_of_this_machine() -> frozenset[str]:
    """Return this machine's names: its host name, and its name on a network without DNS (mDNS)."""
    name = socket.gethostname().lower()
    return frozenset({name, f"{name}.local"})


def is_own_host(host: str, names: Container[str]) -> bool:
    """Whether a request's `Host` is localhost, a numeric address, or one of `names`.

    It is False for the host name of a web page that was redirected to this machine (DNS rebinding).
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
    """Checks the key, blocks web pages, and limits the rate and size of requests.

    A web page that is open in a browser can send requests to this machine. They carry the `Origin`
    of the page. If the page's host name was later redirected to this machine, they carry that name
    as `Host`. No limit here applies to stops, but the server's limit of TCP connections applies to
    all requests. Clients of the Unix socket all belong to one user and have no common rate limit.
    `refused` is called for every rejected client. `holds_right` returns whether a token belongs to
    the client that may move the robot. A flood from the address of that client must not block it.
    `stops` returns the number of stops so far.
    If a key is required, one of `tickets` opens a WebSocket, or downloads one recording.
    """

    def __init__(
        self,
        app: ASGIApp,
        policy: AccessPolicy,
        refused: Callable[[], None],
        holds_right: Callable[[str], bool],
        tickets: Tickets,
        stops: Callable[[], int],
    ) -> None:
        self._app = app
        self._policy = policy
        self._refused = refused
        self._holds_right = holds_right
        self._tickets = tickets
        self._stops = stops
        self._requests = TokenBuckets(_REQUESTS_PER_S, _BURST)
        self._failures = TokenBuckets(_FAILURES_PER_S, _FAILURES)
        self._failures_of_all = TokenBuckets(_FAILURES_OF_ALL_PER_S, _FAILURES_OF_ALL)
        self._throttled = 0
        self._serving = Counter[str]()
        self._turns = asyncio.Lock()
        """One request begins in each pass of the event loop, so a stop waits for at most one
        request."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request to the application, or answer it here."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        scope[STOPS_BEFORE] = self._stops()
        who = ""
        try:
            who = await self._check(scope)
            if who and self._serving[who] >= _MOST_AT_ONCE:
                who = ""
                raise _RefusedError(
                    HTTPStatus.TOO_MANY_REQUESTS,
                    f"more than {_MOST_AT_ONCE} requests at the same time",
                )
            self._serving[who] += 1
            if scope["type"] == "http":
                most = MOST_PATH_BYTES if scope["path"] == _PATH_PATH else MOST_BODY_BYTES
                receive = await _read_body(receive, most)

            async def send_on(message: Message) -> None:
                if message["type"] == "http.response.start":
                    headers = _HEADERS | dict(message.get("headers", ()))
                    message = {**message, "headers": list(headers.items())}
                await send(message)
                note_progress(scope)

            if not _is_stop(scope):
                async with self._turns:
                    await asyncio.sleep(0.0)
            await self._app(scope, receive, send_on)
        except _RefusedError as refused:
            self._refused()
            await _answer(scope, send, refused)
        finally:
            self._serving[who] -= 1
            if self._serving[who] <= 0:
                del self._serving[who]

    async def _check(self, scope: Scope) -> str:
        """Return the client for which the request counts, "" if this kind of request is not
        limited.
        """
        headers = {name.lower(): value for name, value in scope["headers"]}
        if b"content-length" in headers and b"transfer-encoding" in headers:
            # a proxy may see the end of the request elsewhere, and treat the rest as another
            # client's request
            raise _RefusedError(
                HTTPStatus.BAD_REQUEST, "Content-Length and Transfer-Encoding; allowed: one of them"
            )
        self._check_page(headers)
        peer = scope["client"][0] if scope["client"] else ""
        has_key = self._has_key(headers.get(b"authorization", b"")) or self._has_ticket(scope)
        if not has_key and not self._is_public(scope):
            await self._throttle(peer)
            raise _RefusedError(
                HTTPStatus.UNAUTHORIZED,
                "this daemon has no key file: over TCP everybody may read, hold and disable; for "
                "everything else use the Unix socket or the page (`cdpr page` prints its address), "
                "or start the daemon with --key-file"
                if self._policy.key is None or self._policy.open_reading
                else "Authorization: Bearer KEY is missing or wrong",
            )
        if scope["path"] in _LOCAL_PATHS and not self._policy.local:
            raise _RefusedError(HTTPStatus.FORBIDDEN, f"{scope['path']}: only on the Unix socket")
        if _is_stop(scope):
            return ""
        token = headers.get(b"x-control-token", b"").decode("latin-1")
        if self._holds_right(token):
            who = "the one that may move"
        elif token:
            await self._throttle(peer)
            who = peer
        else:
            who = f"{peer}, with the key" if has_key and self._policy.key else peer
        if self._policy.local:
            return ""
        if not self._requests.take(who, time.monotonic()):
            raise _RefusedError(HTTPStatus.TOO_MANY_REQUESTS, "too many requests; send fewer")
        is_live = scope["type"] == "websocket" and scope["path"] == LIVE_PATH
        return "" if is_live else who  # viewers have their own limit

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
        # digests are compared, so that the duration does not even reveal the length of the key
        right = hmac.compare_digest(_digest(secret.strip()), _digest(key))
        return right and scheme.lower() == b"bearer"

    def _has_ticket(self, scope: Scope) -> bool:
        downloads = scope.get("method") == "GET" and scope["path"].startswith(_DOWNLOADS)
        if self._policy.key is None or not (scope["type"] == "websocket" or downloads):
            return False
        try:
            query = parse_qs(scope["query_string"].decode("latin-1"), max_num_fields=_MOST_FIELDS)
        except ValueError:
            return False
        return self._tickets.redeem(query.get("ticket", [""])[0])

    def _is_public(self, scope: Scope) -> bool:
        """Whether every client that can connect may make this request, with or without the key."""
        kind, method, path = scope["type"], scope.get("method", ""), scope["path"]
        reads = kind == "http" and method in ("GET", "HEAD")
        if self._policy.key is not None and not self._policy.open_reading:
            return reads and (path in _PUBLIC_PATHS or path.startswith(_PUBLIC_PREFIXES))
        looks_on = kind == "websocket" and path == _LIVE_PATH
        return reads or looks_on or (kind, method, path) in _KEYLESS_STOPS

    async def _throttle(self, peer: str) -> None:
        """Count a wrong key or token; after too many, delay the answer to this client, or to all.

        Clients with the right key are not affected. If too many answers are delayed already, reject
        this request.
        """
        now_s = time.monotonic()
        of_this, of_all = self._failures.take(peer, now_s), self._failures_of_all.take("", now_s)
        if of_this and of_all:
            return
        if self._throttled >= _MOST_THROTTLED:
            raise _RefusedError(HTTPStatus.TOO_MANY_REQUESTS, "too many wrong keys or tokens")
        self._throttled += 1
        try:
            await asyncio.sleep(_THROTTLE_S)
        finally:
            self._throttled -= 1


class TokenBuckets:
    """A bucket of `burst` tokens for each peer, filled at `rate_Hz`.

    If there are too many peers, the one with the oldest last request is removed first.
    """

    def __init__(self, rate_Hz: float, burst: float) -> None:
        self._rate_Hz = rate_Hz
        self._burst = burst
        self._peers: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def take(self, peer: str, now_s: float, cost: float = 1.0) -> bool:
        """Take `cost` tokens of `peer`; return whether there were enough."""
        left, before_s = self._peers.pop(peer, (self._burst, now_s))
        left = min(self._burst, left + (now_s - before_s) * self._rate_Hz)
        allowed = left >= cost
        self._peers[peer] = (left - cost if allowed else left), now_s
        if len(self._peers) > _MOST_PEERS:
            self._peers.popitem(last=False)
        return allowed


def note_progress(scope: Scope) -> None:
    """Note that the answer to a request advances, so that its connection is not ended."""
    scope[PROGRESS] = scope.get(PROGRESS, 0) + 1


def _is_stop(scope: Scope) -> bool:
    """Whether the request is a stop; other methods at the same path are not."""
    is_post = scope["type"] == "http" and scope["method"] == "POST"
    return is_post and scope["path"] in STOP_PATHS


async def _read_body(receive: Receive, most: int) -> Receive:
    """Read a body within limits of size and time; return a `receive` that returns it."""
    body = bytearray()
    try:
        async with asyncio.timeout(_BODY_S):
            while True:
                message = await receive()
                if message["type"] == "http.disconnect":
                    raise _RefusedError(HTTPStatus.BAD_REQUEST, "the body is incomplete")
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
    content = bytes(body)
    if len(body) > MOST_BODY_BYTES and not is_mostly_text(
        content, _MOST_STRINGS, _MOST_OTHER_BYTES
    ):
        raise _RefusedError(
            HTTPStatus.UNPROCESSABLE_ENTITY,
            f"body: more than {MOST_BODY_BYTES} bytes; allowed: up to {MOST_PATH_BYTES} with up to "
            f"{_MOST_STRINGS} keys and texts, including the file",
        )
    whole: list[Message] = [{"type": "http.request", "body": content, "more_body": False}]

    async def receive_on() -> Message:
        return whole.pop() if whole else await receive()

    return receive_on


async def _answer(scope: Scope, send: Send, refused: _RefusedError) -> None:
    body = json.dumps({"error": str(refused)}).encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        *_HEADERS.items(),
    ]
    if refused.status is HTTPStatus.UNAUTHORIZED:
        headers.append((b"www-authenticate", b"Bearer"))
    if scope["type"] == "http":
        headers.append((b"connection", b"close"))  # the rest of the body is not read
    kind = "http" if scope["type"] == "http" else "websocket.http"
    start: dict[str, Any] = {"status": refused.status.value, "headers": headers}
    await send({"type": f"{kind}.response.start", **start})
    await send({"type": f"{kind}.response.body", "body": body})


def _digest(value: bytes) -> bytes:
    return hashlib.sha256(value).digest()
