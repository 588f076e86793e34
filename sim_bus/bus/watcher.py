"""Event poller of the hub: descriptors and their handlers."""

from __future__ import annotations

import os
import select
import time
from collections.abc import Callable

FINE_WAIT_S = 0.01
"""Below this a wait in whole milliseconds, as epoll has it, is too coarse."""
_EVENTS = 64


class Watcher:
    """An epoll with a handler for each descriptor, and a way to wake it from elsewhere."""

    def __init__(self) -> None:
        self._poller = select.epoll()
        self.handlers: dict[int, Callable[[], None]] = {}
        """What to call, by descriptor."""
        self.looked_s = 0.0
        """Monotonic time just before the last poll: what was sent by then has been found."""
        self._wake = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self.add(self._wake, lambda: None)

    def add(self, descriptor: int, handler: Callable[[], None]) -> None:
        """Call `handler` whenever `descriptor` is readable."""
        self._poller.register(descriptor, select.EPOLLIN)
        self.handlers[descriptor] = handler

    def remove(self, descriptor: int) -> None:
        """Stop watching `descriptor`."""
        del self.handlers[descriptor]
        self._poller.unregister(descriptor)

    def wake(self) -> None:
        """End the present wait, or the next; may be called from a signal handler or a thread."""
        os.eventfd_write(self._wake, 1)

    def fileno(self) -> int:
        """Return the descriptor that is readable when one of the watched is."""
        return self._poller.fileno()

    def readable(self, wait_s: float | None, *, exactly: bool) -> list[tuple[int, int]]:
        """Return the readable descriptors, each with its events.

        Wait up to `wait_s` (None: for ever) for one; with `exactly` look once more after the
        wait, at `looked_s`.
        """
        if wait_s != 0.0 and (exactly or (wait_s is not None and wait_s < FINE_WAIT_S)):
            select.select([self._poller], [], [], wait_s)
            wait_s = 0.0
        self.looked_s = time.monotonic()
        return self._poller.poll(wait_s, _EVENTS)

    def close(self) -> None:
        """Free what it holds itself."""
        self._poller.close()
        os.close(self._wake)
