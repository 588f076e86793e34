"""How often each of many may do something: a steady rate and a burst."""

from __future__ import annotations

from collections import OrderedDict
from typing import Final

MOST_PEERS: Final = 1024
"""Who was not seen for longest is forgotten beyond these."""


class TokenBuckets:
    """A bucket of `burst` tokens for each peer, filled at `rate_Hz`."""

    def __init__(self, rate_Hz: float, burst: float) -> None:
        self._rate_Hz = rate_Hz
        self._burst = burst
        self._peers: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def take(self, peer: str, now_s: float) -> bool:
        """Take a token of `peer`; return whether there was one."""
        left, before_s = self._peers.pop(peer, (self._burst, now_s))
        left = min(self._burst, left + (now_s - before_s) * self._rate_Hz)
        allowed = left >= 1.0
        self._peers[peer] = (left - 1.0 if allowed else left), now_s
        if len(self._peers) > MOST_PEERS:
            self._peers.popitem(last=False)
        return allowed
