"""Run as a program: ask a daemon for everything at once, as fast as it goes, for a while.

The argument is JSON: `socket`, `http` and `stream` (addresses), `key`, `nice`, and `seconds`,
after which it ends if no SIGTERM has ended it. Then it tells one line of JSON: how much of what
was sent.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sys
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass

_BODY = json.dumps({"client": "flood"}).encode()
_UPGRADE = (
    b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)
_PING = b"\x89\x80\x00\x00\x00\x00"  # masked, empty
_IDLE, _A_CONNECTION = 40, 50
_PAUSE_S, _IDLE_S = 0.001, 0.5
_PACKETS = 20

Connection = tuple[asyncio.StreamReader, asyncio.StreamWriter]


@dataclass(frozen=True)
class Target:
    """Where a daemon can be reached, and for how long it is flooded."""

    socket: str
    http: str
    stream: str
    key: str
    seconds: float
    nice: int
    """Its nice value; 19 leaves the processors to the daemon, as clients elsewhere do."""

    async def unix(self) -> Connection:
        """Connect to the Unix socket."""
        return await asyncio.open_unix_connection(self.socket)

    async def tcp(self) -> Connection:
        """Connect over TCP."""
        host, _, port = self.http.rpartition(":")
        return await asyncio.open_connection(host, int(port))


def _request(line: str, key: str = "", body: bytes = b"", more: bytes = b"") -> bytes:
    head = f"{line} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(body)}\r\n"
    if key:
        head += f"Authorization: Bearer {key}\r\n"
    return head.encode() + more + b"\r\n" + body


class Flood:
    """All that one client does to one daemon."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self.sent: Counter[str] = Counter()

    async def run(self) -> None:
        """Flood for the time that was asked for."""
        target, key = self._target, self._target.key
        lines = ("POST /hold", "POST /disable", "GET /status", "POST /program", "GET /events")
        floods = [self._stream(), self._idle(target.unix), self._idle(target.tcp)]
        for line in lines:
            floods += [
                self._ask("unix", target.unix, _request(line, body=_BODY)),
                self._ask("http_with_key", target.tcp, _request(line, key, _BODY)),
                self._ask("http_without_key", target.tcp, _request(line, body=_BODY)),
            ]
        live = _request("GET /live?rate_Hz=50", key, more=_UPGRADE)
        refused = _request("GET /live", more=_UPGRADE)
        floods += [
            self._ask("websocket", target.tcp, live, _PING * 200),
            self._ask("websocket", target.unix, live, _PING * 200),
            self._ask("websocket_refused", target.tcp, refused),
        ]
        tasks = [asyncio.ensure_future(flood) for flood in floods]
        ended = asyncio.Event()
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
        with suppress(TimeoutError):
            await asyncio.wait_for(ended.wait(), target.seconds)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _ask(
        self,
        kind: str,
        connect: Callable[[], Awaitable[Connection]],
        first: bytes,
        then: bytes = b"",
    ) -> None:
        """Send the same over and over, many times on each connection; answers are not looked at."""
        while True:
            with suppress(OSError):
                reader, writer = await connect()
                try:
                    for sent in range(_A_CONNECTION):
                        writer.write(then if then and sent else first)
                        await writer.drain()
                        self.sent[kind] += 1
                        if not await reader.read(1 << 16):
                            break
                finally:
                    writer.transport.abort()
            await asyncio.sleep(_PAUSE_S)

    async def _idle(self, connect: Callable[[], Awaitable[Connection]]) -> None:
        """Keep connections that say nothing, new ones in the place of those that were ended."""
        while True:
            idle: list[asyncio.StreamWriter] = []
            with suppress(OSError):
                for _ in range(_IDLE):
                    idle.append((await connect())[1])
                    self.sent["idle_connections"] += 1
            await asyncio.sleep(_IDLE_S)
            for writer in idle:
                writer.transport.abort()

    async def _stream(self) -> None:
        host, _, port = self._target.stream.rpartition(":")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            sock.setblocking(False)
            while True:
                for _ in range(_PACKETS):
                    with suppress(OSError):
                        sock.sendto(os.urandom(100), (host, int(port)))
                        self.sent["stream_packets"] += 1
                await asyncio.sleep(_PAUSE_S)


def main() -> None:
    """Flood, then tell how much."""
    target = Target(**json.loads(sys.argv[1]))
    os.nice(target.nice)
    flood = Flood(target)
    asyncio.run(flood.run())
    print(json.dumps({"sent": flood.sent}), flush=True)


if __name__ == "__main__":
    main()
