"""Base class of what runs beside the control interface: recorder, live view, stream."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any


class Part(ABC):
    """Something with a thread of its own that the service starts, shows and stops.

    None of them may hold up the others: what one cannot do it says, and leaves it at that. `ended`
    is told why it ended, where it did other than by `stop`.
    """

    name: str
    """A short word; its figures are shown under it."""

    def __init__(self, thread_name: str, ended: Callable[[str], None] | None) -> None:
        self._ended = ended
        self._error = ""
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name=thread_name, daemon=True)

    def start(self) -> None:
        """Begin; raises an error where it cannot, and the service goes on without it."""
        self._thread.start()

    def stop(self) -> None:
        """End within a second or two, with everything that is to be kept on the disk."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()

    @abstractmethod
    def status(self) -> dict[str, Any]:
        """Return what a person would want to know of it, as JSON; its numbers become metrics.

        Called from another thread, several times a second: no waiting, no I/O.
        """

    @abstractmethod
    def _serve(self) -> None:
        """Do the work of its thread until `_end` is set."""

    def _run(self) -> None:
        try:
            self._serve()
        except Exception as error:
            if not self._error:
                self._fail(self._ended_by(error))

    def _ended_by(self, error: BaseException) -> str:
        return f"the {self._thread.name} ended: {type(error).__name__}: {error}"

    def _fail(self, text: str) -> None:
        self._error = text
        if self._ended is not None:
            self._ended(text)
