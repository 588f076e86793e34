"""The right to move, given and lost in bus time."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from cdpr_rt.runtime.shared_block import SharedBlock
from cdpr_rt.service.lease import Lease, LeaseError

_TTL_S: Final = 2.0
_RENEWED_NS: Final = 500_000_000
_FAR_NS: Final = 10**15
"""Beyond any run, by the clock that the loop compares with."""


class RightInBusTime:
    """The daemon's lease on a clock that stands still between cycles.

    Whoever takes it here keeps it until `drop` or `fall_silent`; a stream's right is its own.
    """

    def __init__(self, block: SharedBlock, clock_ns: Callable[[], int]) -> None:
        self._published = block.counters["lease_ns"]
        self._clock_ns = clock_ns
        self._until_ns = 0
        self.token: str | None = None
        """That of the right which is held here, None while none is."""
        self._renew_ns = 0
        self.lease = Lease(self._publish, clock_ns)

    def take(self, client: str) -> str:
        """Take the right and keep it; return the token. Raises LeaseError where another has it."""
        self.token = self.lease.take(client, _TTL_S)
        self._renew_ns = self._clock_ns() + _RENEWED_NS
        return self.token

    def drop(self) -> None:
        """Give the right back."""
        token, self.token = self.token, None
        with suppress(LeaseError):  # it has run out
            self.lease.release(token)

    def fall_silent(self) -> None:
        """Renew it no more: it runs out by itself."""
        self.token = None

    def look(self) -> None:
        """Renew what is held, end what has run out; called every cycle."""
        now_ns = self._clock_ns()
        if self.token is not None and now_ns >= self._renew_ns:
            self._renew_ns = now_ns + _RENEWED_NS
            self.lease.renew(self.token)
        if self._until_ns and now_ns >= self._until_ns:
            self._publish(0)

    def _publish(self, until_ns: int) -> None:
        self._until_ns = until_ns
        self._published[0] = time.monotonic_ns() + _FAR_NS if until_ns else 0
