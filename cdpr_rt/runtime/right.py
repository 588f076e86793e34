"""The right to move in the shared memory: a number that grows with every taking, and its end.

An order or a sample counts only with the number of the taking that holds just now. Numbers never
come again, so that nothing that was asked for under one taking goes on under the next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cdpr_rt.runtime.shared_block import SharedBlock

LONGEST_S: Final = 10.0
"""The longest that the right may be given for at a time."""
_LONGEST_NS: Final = round(LONGEST_S * 1e9)


class PublishedRight:
    """The service's side: tells the loop which taking holds, and until when (CLOCK_MONOTONIC)."""

    def __init__(self, block: SharedBlock) -> None:
        self._number = block.counters["right_number"]
        self._until_ns = block.counters["right_until_ns"]
        self.until(0)

    @property
    def number(self) -> int:
        """The number of the newest taking, 0 before the first."""
        return int(self._number[0])

    def begin(self, until_ns: int) -> int:
        """Publish a new taking that holds until then; return its number."""
        self._until_ns[0] = 0  # whoever reads between sees nobody, not the next under a past time
        self._number[0] += 1
        self._until_ns[0] = until_ns
        return self.number

    def until(self, until_ns: int) -> None:
        """Have the newest taking hold until then; 0 ends it."""
        self._until_ns[0] = until_ns


class RightToMove:
    """The loop's side: which taking holds now, and on whose behalf the present program moves."""

    def __init__(self, block: SharedBlock, clock_ns: Callable[[], int]) -> None:
        self._number = block.counters["right_number"]
        self._until_ns = block.counters["right_until_ns"]
        self._mover = block.counters["mover"]
        self._clock_ns = clock_ns
        self.mover = 0

    @property
    def current(self) -> int:
        """The number of the taking that holds now, 0 where nobody has the right.

        A time further ahead than `LONGEST_S` is none that the service gives: nobody's.
        """
        number = int(self._number[0])
        left_ns = int(self._until_ns[0]) - self._clock_ns()
        changed = int(self._number[0]) != number
        return 0 if changed or not 0 < left_ns <= _LONGEST_NS else number

    @property
    def mover(self) -> int:
        """The number on whose behalf the present program moves, 0 for nobody's."""
        return int(self._mover[0])

    @mover.setter
    def mover(self, number: int) -> None:
        self._mover[0] = number

    def missing(self, number: int) -> str:
        """Return why an order with this number is not obeyed, "" where it is."""
        current = self.current
        if current == 0:
            return "nobody holds the right to move; take it first"
        return "" if number == current else "the right to move is somebody else's by now"

    def lost(self) -> str:
        """Return why the present motion is nobody's any more, "" while it is the holder's."""
        current = self.current
        if current == 0:
            return "nobody holds the right to move any more"
        return "" if self.mover == current else "the right to move has changed hands"
