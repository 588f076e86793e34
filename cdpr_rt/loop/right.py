"""The right to move: a lease with a fencing token, in the shared memory.

Every grant has a number, higher than all numbers before, and an expiry time. A command or a sample
is valid only with the number of the current grant. So a motion commanded under one grant does not
continue under the next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cdpr_rt.core.shared_block import SharedBlock

LONGEST_S: Final = 10.0
"""The longest time for which the right is granted or renewed."""
_LONGEST_NS: Final = round(LONGEST_S * 1e9)


class PublishedRight:
    """The service's side: publishes the current grant and its expiry (CLOCK_MONOTONIC)."""

    def __init__(self, block: SharedBlock) -> None:
        self._number = block.counters["right_number"]
        self._until_ns = block.counters["right_until_ns"]
        self.until(0)

    @property
    def number(self) -> int:
        """The number of the newest grant, 0 before the first."""
        return int(self._number[0])

    def begin(self, until_ns: int) -> int:
        """Publish a new grant that is valid until `until_ns`; return its number."""
        self._until_ns[0] = (
            0  # a reader in between sees no grant, not the new one with the old expiry
        )
        self._number[0] += 1
        self._until_ns[0] = until_ns
        return self.number

    def until(self, until_ns: int) -> None:
        """Set the expiry of the newest grant; 0 ends it."""
        self._until_ns[0] = until_ns


class RightToMove:
    """The loop's side: the current grant, and the grant under which the program runs."""

    def __init__(self, block: SharedBlock, clock_ns: Callable[[], int]) -> None:
        # read in every cycle: a memoryview is faster
        self._number = block.counters["right_number"].data
        self._until_ns = block.counters["right_until_ns"].data
        self._mover = block.counters["mover"].data
        self._clock_ns = clock_ns
        self.mover = 0

    @property
    def current(self) -> int:
        """The number of the current grant, or 0.

        An expiry more than `LONGEST_S` ahead cannot come from the service and counts as no grant.
        """
        number: int = self._number[0]
        left_ns = self._until_ns[0] - self._clock_ns()
        changed = self._number[0] != number
        return 0 if changed or not 0 < left_ns <= _LONGEST_NS else number

    @property
    def mover(self) -> int:
        """The number of the grant under which the program runs, 0 for none."""
        mover: int = self._mover[0]
        return mover

    @mover.setter
    def mover(self, number: int) -> None:
        self._mover[0] = number

    def refusal(self, number: int) -> str:
        """Return the reason why a command with this number is rejected, or ""."""
        current = self.current
        if current == 0:
            return "nobody holds the right to move; take it first"
        return "" if number == current else "another client has the right to move now"

    def loss(self) -> str:
        """Return the reason why the program's grant is not the current one, or ""."""
        current = self.current
        if current == 0:
            return "nobody holds the right to move now"
        return "" if self.mover == current else "another client has taken the right to move"
