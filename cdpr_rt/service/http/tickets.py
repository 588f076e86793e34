"""Tickets: what opens one WebSocket in the key's place, as browsers send no header with those."""

from __future__ import annotations

import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import Final

VALID_S: Final = 30.0
MOST_TICKETS: Final = 64
"""The oldest is void beyond these."""


class Tickets:
    """Random tickets, each of use once and for `VALID_S`; of one asyncio loop."""

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
        """Use a ticket up; return whether it was good."""
        until_s = self._until_s.pop(ticket, None)
        return until_s is not None and self._clock_s() < until_s
