"""Load libraries: quickly, and with a notice on a terminal if it takes a moment."""

from __future__ import annotations

import gc
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_SOON_S = 0.2
"""Shorter loading is not reported."""
_TEXT, _WIPE = "loading ...", "\r\x1b[K"


@contextmanager
def without_collection() -> Iterator[None]:
    """Load modules in the block without garbage collection.

    Collection would take a tenth of the loading time. Afterwards the collector never searches the
    objects that the first block of a process has loaded.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if not gc.get_freeze_count():
            gc.freeze()
        if enabled:
            gc.enable()


@contextmanager
def loading_notice() -> Iterator[None]:
    """Show a notice on a terminal if the block takes a moment, and erase it at the end."""
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
