"""A network that loses, delays, duplicates, reorders and alters packets between hand and robot."""

from __future__ import annotations

import heapq
import itertools
import math
import random
import select
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

LOSS, COPIES, JITTER_S = 0.2, 0.05, 0.05
_SETPOINT, _KIND_AT, _POSITION_AT = 3, 5, 48  # as described in docs/reference/setpoint-stream.md


class Proxy:
    """Forward datagrams in both directions through the same bad network and count them."""

    def __init__(self, port: int, seed: int, altered: float) -> None:
        self._rng = random.Random(seed)
        self._altered = altered
        self._front = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._front.bind(("127.0.0.1", 0))
        self._back = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._back.connect(("127.0.0.1", port))
        self.port = int(self._front.getsockname()[1])
        self.came = self.passed = self.spoilt = self._setpoints = 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self._front.close()
        self._back.close()

    def _run(self) -> None:
        late: list[tuple[float, int, bytes, bool]] = []
        numbers = itertools.count()
        sender = None
        while not self._over.is_set():
            ready, _, _ = select.select([self._front, self._back], [], [], 0.002)
            for sock in ready:
                try:
                    data, address = sock.recvfrom(2048)
                except ConnectionRefusedError:
                    continue
                onward = sock is self._front
                if onward:
                    sender = address
                self.came += 1
                for due_s in self._copies():
                    heapq.heappush(late, (due_s, next(numbers), data, onward))
            while late and late[0][0] <= time.monotonic():
                _, _, data, onward = heapq.heappop(late)
                self.passed += 1
                if onward:
                    self._back.send(self._spoil(data))
                elif sender is not None:
                    self._front.sendto(data, sender)

    def _copies(self) -> list[float]:
        """Return the times at which a datagram is forwarded: none, one or two."""
        weights = (LOSS, 1.0 - LOSS - COPIES, COPIES)
        count = self._rng.choices((0, 1, 2), weights)[0]
        now_s = time.monotonic()
        return [now_s + self._rng.uniform(0.0, JITTER_S) for _ in range(count)]

    def _spoil(self, data: bytes) -> bytes:
        """Change some set-points to NaN or by a metre."""
        if data[_KIND_AT] != _SETPOINT:
            return data
        self._setpoints += 1
        # by count, because random choice among some tens could spoil none or many
        if self.spoilt >= self._altered * self._setpoints:
            return data
        self.spoilt += 1
        (x,) = struct.unpack_from("<d", data, _POSITION_AT)
        wrong = self._rng.choice((math.nan, x + 1.0, x - 1.0, 1e300))
        spoilt = bytearray(data)
        struct.pack_into("<d", spoilt, _POSITION_AT, wrong)
        return bytes(spoilt)


@contextmanager
def hostile(port: int, seed: int, altered: float = 0.0) -> Iterator[Proxy]:
    """Yield a proxy before a local port. It spoils the share `altered` of set-points."""
    proxy = Proxy(port, seed, altered)
    try:
        yield proxy
    finally:
        proxy.close()
