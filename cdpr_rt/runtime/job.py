"""Slow work beside the cycle, in a thread of its own that is asked whether it is done."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Generic, TypeVar, cast

_T = TypeVar("_T")


class Job(Generic[_T]):
    """One call in a thread of ordinary priority on all cores the process may use."""

    def __init__(self, work: Callable[[], _T], cores: set[int]) -> None:
        self._work = work
        self._cores = cores
        self._result: Any = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="job", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        with suppress(OSError):  # cores that have been taken away since
            os.sched_setaffinity(0, self._cores)
        try:
            self._result = self._work()
        except BaseException as error:
            self._error = error

    @property
    def done(self) -> bool:
        """Whether the call has come back."""
        return not self._thread.is_alive()

    def result(self) -> _T:
        """Return what the call returned, or raise what it raised; waits for its end."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        return cast(_T, self._result)
