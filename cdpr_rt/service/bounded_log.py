"""Log lines that others can provoke, a few of each kind a minute; the rest is counted."""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

_MOST, _WINDOW_S = 5, 60.0
_MOST_KINDS = 64


@dataclass
class _Kind:
    since_s: float
    shown: int = 0
    more: int = 0
    level: int = logging.ERROR
    logger: str = ""
    text: str = ""


class BoundedLog(logging.Filter):
    """Lets 5 lines of a kind through in a minute, and tells afterwards how many more there were.

    A kind is a logger's text before its values are put in; beyond 64 kinds at once, all others
    are one. For a handler, so that all loggers come through it.
    """

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock_s = clock_s
        self._kinds: dict[tuple[str, str], _Kind] = {}
        self._lock = threading.Lock()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether the line is one of the first."""
        if getattr(record, "told_by_bounded_log", False):
            return True
        key = (record.name, str(record.msg))
        with self._lock:
            if key not in self._kinds and len(self._kinds) >= _MOST_KINDS:
                key = ("", "")
            kind = self._kinds.setdefault(key, _Kind(self._clock_s()))
            kind.level, kind.logger, kind.text = record.levelno, record.name, key[1]
            kind.shown += 1
            kind.more += kind.shown > _MOST
            return kind.shown <= _MOST

    def report_suppressed(self) -> None:
        """Log how many more lines there were of the kinds whose minute is over."""
        now_s = self._clock_s()
        with self._lock:
            over = [key for key, kind in self._kinds.items() if now_s - kind.since_s >= _WINDOW_S]
            kinds = [self._kinds.pop(key) for key in over]
        for kind in kinds:
            if kind.more:
                text = f"{kind.more} more within {_WINDOW_S:g} s: {kind.text or 'of other kinds'}"
                extra = {"told_by_bounded_log": True}
                logging.getLogger(kind.logger).log(kind.level, "%s", text, extra=extra)

    async def watch(self) -> None:
        """Tell the rest of each minute, until cancelled."""
        while True:
            await asyncio.sleep(_WINDOW_S / 6)
            self.report_suppressed()
