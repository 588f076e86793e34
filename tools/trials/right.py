"""The right to move, given and lost in bus time."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.runtime.right import PublishedRight
from cdpr_rt.service.lease import Lease, LeaseError

_TTL_S: Final = 2.0
_RENEWED_NS: Final = 500_000_000


class RightInBusTime:
    """The daemon's lease on a clock that stands still between cycles.

    Whoever takes it here keeps it until `drop` or `fall_silent`; a stream's right is its own.
    """

    def __init__(self, block: SharedBlock, clock_ns: Callable[[], int]) -> None:
        self._clock_ns = clock_ns
        self.token: str | None = None
        """The token of the right held here, None while none is."""
        self.number = 0
        """The number of the newest grant here, which commands carry."""
        self._renewed_ns = 0
        self.lease = Lease(PublishedRight(block), clock_ns)

    def take(self, client: str) -> str:
        """Take the right and keep it; return the token. Raises LeaseError where another has it."""
        self.token = self.lease.take(client, _TTL_S)
        self._renew(self.token)
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
        """Renew the right where that is due; called every cycle."""
        if self.token is not None and abs(self._clock_ns() - self._renewed_ns) >= _RENEWED_NS:
            self._renew(self.token)

    def _renew(self, token: str) -> None:
        self._renewed_ns = self._clock_ns()
        self.number = self.lease.renew(token).number
