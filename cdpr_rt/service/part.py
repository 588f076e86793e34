"""Base class of services beside the control interface: recorder, live view, stream."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any


class Part(ABC):
    """Part with its own thread that the service starts, shows and stops.

    A part must not delay the others: it reports what it cannot do and continues without it. `ended`
    is called with the reason if it ends without `stop`.
    """

    name: str
    """A short word under which its figures are shown."""

    def __init__(self, thread_name: str, ended: Callable[[str], None] | None) -> None:
        self._ended = ended
        self._error = ""
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name=thread_name, daemon=True)

    def start(self) -> None:
        """Begin; raises an error on failure, and the service continues without the part."""
        self._thread.start()

    def stop(self) -> None:
        """End within a second or two, with all data to keep on the disk."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()

    @abstractmethod
    def status(self) -> dict[str, Any]:
        """Return what users need to know about it, as JSON; its numbers become metrics.

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
