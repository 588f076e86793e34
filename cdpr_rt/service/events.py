"""Event log of the daemon: states, reasons, commands, faults of its own parts."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any, Final

_KEPT: Final = 512
_LONGEST: Final = 1000


class EventLog:
    """The last events; any thread adds and reads. The same event again is counted, not repeated."""

    def __init__(self, wall_ns: Callable[[], int]) -> None:
        self._wall_ns = wall_ns
        self._events: deque[dict[str, Any]] = deque(maxlen=_KEPT)
        self._number = 0
        self._lock = threading.Lock()
        self.listeners: list[Callable[..., None]] = []
        """Called with the text, and the kind and the detail by name, for every event."""

    def add(self, kind: str, text: str, **detail: Any) -> None:
        """Note an event of a kind ("state", "reason", "command", "control", the name of a part)."""
        text = text[:_LONGEST]
        time = datetime.fromtimestamp(self._wall_ns() * 1e-9, UTC).isoformat("T", "milliseconds")
        with self._lock:
            last = self._events[-1] if self._events else {}
            same = (last.get("kind"), last.get("text")) == (kind, text)
            self._number += 1
            if same:
                self._events.pop()
            self._events.append(
                {
                    "number": self._number,
                    "time": time,
                    "kind": kind,
                    "text": text,
                    "times": last["times"] + 1 if same else 1,
                    "detail": detail,
                }
            )
        for listener in self.listeners:
            listener(text, kind=kind, detail=detail)

    def since(self, number: int = 0, most: int = _KEPT) -> list[dict[str, Any]]:
        """Return the events after a number, oldest first, at most the newest `most`."""
        with self._lock:
            found = [dict(event) for event in self._events if event["number"] > number]
        return found[len(found) - min(most, len(found)) :]
