"""What runs beside the control interface in the service's process: recorder, live view, stream."""

from __future__ import annotations

from typing import Any, Protocol


class Part(Protocol):
    """Something with a thread of its own that the service starts, shows and stops.

    None of them may hold up the others: what one cannot do it says, and leaves it at that.
    """

    name: str
    """A short word; its figures are shown under it."""

    def start(self) -> None:
        """Begin; raises an error where it cannot, and the service goes on without it."""

    def stop(self) -> None:
        """End within a second or two, with everything that is to be kept on the disk."""

    def status(self) -> dict[str, Any]:
        """Return what a person would want to know of it, as JSON; its numbers become metrics.

        Called from another thread, several times a second: no waiting, no I/O.
        """
