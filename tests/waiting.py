"""Wait for what other threads and processes do."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def until(what: Callable[[], T], within_s: float = 60.0, pause_s: float = 0.01) -> T:
    """Call `what` until its result is true. Return the result. Fail after this time."""
    end_s = time.monotonic() + within_s
    while not (answer := what()):
        assert time.monotonic() < end_s, f"not within {within_s:g} s: {_source(what)}"
        time.sleep(pause_s)
    return answer


def _source(what: Callable[[], object]) -> str:
    try:
        return inspect.getsource(what).strip()
    except (OSError, TypeError):  # a method of an extension
        return repr(what)
