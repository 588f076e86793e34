"""Interface of the nodes in the simulator's own process."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from typing import Protocol


class LocalNode(Protocol):
    """A CAN node driven by one thread; frames are 16 bytes, laid out as `struct can_frame`.

    All times are bus time in seconds. After every call the bus sends what stands in `outbox`, in
    the order of arbitration, and clears the list (the list object itself stays the same).
    """

    outbox: list[bytes]

    @property
    def node_id(self) -> int:
        """Node id in use, 0 for a node that only listens."""

    @property
    def sync_period_s(self) -> float:
        """Communication cycle period (1006h), 0 while it is not set."""

    @property
    def accepts(self) -> AbstractSet[int] | None:
        """Identifiers (11 bits, or 29 bits with the EFF flag) the node wants, None for all.

        A node that changes them shows a new set; the bus looks at the attribute again after
        every frame outside the cyclic exchange (anything but SYNC and PDOs) and after `advance`
        while bus time runs by itself.
        """

    def receive(self, frame: bytes, now: float) -> None:
        """Take a frame seen on the bus, SYNC included; never one of the node's own."""

    def advance(self, now: float) -> None:
        """Bring timers and physics to `now`; called before a frame when time has moved."""

    def next_event(self) -> float:
        """Return the bus time of the next timer, `math.inf` when none runs."""

    def close(self) -> None:
        """Flush and close what the node holds open."""
