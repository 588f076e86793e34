"""Show on a terminal that libraries are loading, if that takes a moment."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_SOON_S = 0.2
"""Shorter loading is not reported."""
_TEXT, _WIPE = "loading ...", "\r\x1b[K"


@contextmanager
def loading_notice() -> Iterator[None]:
    """Show it on a terminal soon after the block begins, and erase it at the end."""
    # a shell that requests completions has its line there
    if not sys.stderr.isatty() or "_CDPR_COMPLETE" in os.environ or os.getenv("TERM") == "dumb":
        yield
        return
    said = threading.Event()

    def say() -> None:
        print(_TEXT, end="", file=sys.stderr, flush=True)
        said.set()

    timer = threading.Timer(_SOON_S, say)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        if said.is_set():
            print(_WIPE, end="", file=sys.stderr, flush=True)
