"""A bad network between a hand and a robot: packets late, lost, twice, in another order."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from itertools import count

import numpy as np


@dataclass(frozen=True)
class Network:
    """What becomes of a packet: probabilities, and times of one way in s."""

    loss: float = 0.2
    duplicates: float = 0.1
    delay_s: float = 0.02
    jitter_s: float = 0.05
    """Each packet's transit is longer than the delay by up to this; so later ones overtake it."""


class Channel:
    """Holds packets until they arrive; `rng` decides what becomes of each."""

    def __init__(self, network: Network, rng: np.random.Generator) -> None:
        self._network = network
        self._rng = rng
        self._under_way: list[tuple[float, int, bytes]] = []
        self._numbers = count()
        self._newest = -1
        self.sent = self.lost = self.doubled = self.overtaken = 0

    def send(self, packet: bytes, now_s: float) -> None:
        """Take a packet that is sent now."""
        network, rng = self._network, self._rng
        self.sent += 1
        if rng.random() < network.loss:
            self.lost += 1
            return
        copies = 1 + (rng.random() < network.duplicates)
        self.doubled += copies - 1
        number = next(self._numbers)
        for _ in range(copies):
            arrives = now_s + network.delay_s + network.jitter_s * rng.random()
            heapq.heappush(self._under_way, (arrives, number, packet))

    def arrived(self, now_s: float) -> list[bytes]:
        """Return the packets that have arrived by now, in the order of their arrival."""
        packets = []
        while self._under_way and self._under_way[0][0] <= now_s:
            _, number, packet = heapq.heappop(self._under_way)
            self.overtaken += number < self._newest
            self._newest = max(self._newest, number)
            packets.append(packet)
        return packets
