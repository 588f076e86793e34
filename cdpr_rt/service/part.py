"""Base class of the parts of the service besides the control interface: recorder, live view,
stream."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any


class Part(ABC):
    """Part with its own thread, which the service starts, reports on and stops.

    A part must not delay the others: it reports its failures and continues. If a part ends without
    `stop`, it calls `ended` with the reason.
    """

    name: str
    """Short name of the part in the status."""

    def __init__(self, thread_name: str, ended: Callable[[str], None] | None) -> None:
        self._ended = ended
        self._error = ""
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name=thread_name, daemon=True)

    def start(self) -> None:
        """Begin; if this raises an error, the service continues without the part."""
        self._thread.start()

    def stop(self) -> None:
        """End within two seconds; all recorded data must be on the disk then."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()

    @abstractmethod
    def status(self) -> dict[str, Any]:
        """Return the part's status for users, as JSON; its numbers become metrics.

        Another thread calls this several times a second, so it must not wait or do I/O.
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
