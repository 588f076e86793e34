"""Run as a program: flood a daemon's interfaces as fast as possible.

The argument is the JSON of a `Target`. The program ends at SIGTERM, or after `seconds`, and prints
one line of JSON: how many of each kind it sent.
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
from typing import Any

_BODY = json.dumps({"client": "flood"}).encode()
_UPGRADE = (
    b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)
_PING = b"\x89\x80\x00\x00\x00\x00"  # masked, empty
_IDLE, _A_CONNECTION, _PACKETS = 40, 50, 20
_PAUSE_S, _IDLE_S = 0.001, 0.5

Connect = Callable[[], Awaitable[tuple[asyncio.StreamReader, asyncio.StreamWriter]]]


@dataclass(frozen=True)
class Target:
    """The addresses of a daemon, and how long to flood it."""

    socket: str
    http: str
    stream: str
    key: str
    seconds: float = 600.0


def _request(line: str, key: str = "", body: bytes = b"", more: bytes = b"") -> bytes:
    head = f"{line} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(body)}\r\n"
    if key:
        head += f"Authorization: Bearer {key}\r\n"
    return head.encode() + more + b"\r\n" + body


class _Flood:
    """The flood from one client to one daemon."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self.sent: Counter[str] = Counter()

    async def run(self) -> None:
        """Flood until SIGTERM, or for the requested time."""
        target, key = self._target, self._target.key
        host, _, port = target.http.rpartition(":")

        def unix() -> Any:
            return asyncio.open_unix_connection(target.socket)

        def tcp() -> Any:
            return asyncio.open_connection(host, int(port))

        lines = ("POST /hold", "POST /disable", "GET /status", "POST /program", "GET /events")
        floods = [self._stream(), self._idle(unix), self._idle(tcp)]
        for line in lines:
            floods += [
                self._ask("unix", unix, _request(line, body=_BODY)),
                self._ask("http_with_key", tcp, _request(line, key, _BODY)),
                self._ask("http_without_key", tcp, _request(line, body=_BODY)),
            ]
        live = _request("GET /live?rate_Hz=50", key, more=_UPGRADE)
        floods += [self._ask("websocket", connect, live, _PING * 200) for connect in (tcp, unix)]
        floods.append(self._ask("websocket_refused", tcp, _request("GET /live", more=_UPGRADE)))
        tasks = [asyncio.ensure_future(flood) for flood in floods]
        ended = asyncio.Event()
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
        with suppress(TimeoutError):
            await asyncio.wait_for(ended.wait(), target.seconds)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _ask(self, kind: str, connect: Connect, first: bytes, then: bytes = b"") -> None:
        """Send the same request repeatedly, many times per connection; ignore the answers."""
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

    async def _idle(self, connect: Connect) -> None:
        """Keep silent connections open, and replace those that were closed."""
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


if __name__ == "__main__":
    _flood = _Flood(Target(**json.loads(sys.argv[1])))
    asyncio.run(_flood.run())
    print(json.dumps({"sent": _flood.sent}), flush=True)
