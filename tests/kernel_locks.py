"""A kernel that several test processes want at once is compiled by one of them; the others wait.

A fresh clone has no machine code, the first tests of each process want much of it, and numba keeps
only processes that come later from compiling it again.
"""

from __future__ import annotations

import fcntl
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher

_compile = Dispatcher.compile
_held: set[Path] = set()
"""A kernel that calls itself is compiled within its own compilation."""


def install() -> None:
    """Have this process, and those that are forked from it, wait for the kernels of others."""
    Dispatcher.compile = _compile_alone


class Kernels:
    """The kernels of the modules that are loaded, and which of their machine code is."""

    def __init__(self) -> None:
        ours = [module for name, module in sys.modules.items() if name.startswith("cdpr_")]
        found = {id(value): value for module in ours for value in vars(module).values()}
        kernels = [value for value in found.values() if isinstance(value, Dispatcher)]
        self._seen_ns = {kernel: 0 for kernel in kernels if _index(kernel) is not None}

    def load(self) -> None:
        """Load what there is on disk by now, but for kernels that somebody is compiling."""
        for kernel, seen_ns in self._seen_ns.items():
            index = _index(kernel)
            assert index is not None
            try:
                changed_ns = index.stat().st_mtime_ns
            except FileNotFoundError:
                continue
            if changed_ns == seen_ns:
                continue
            with _lock(kernel, fcntl.LOCK_EX | fcntl.LOCK_NB) as locked:
                if locked:
                    for signature, *_ in kernel._cache._cache_file._load_index():
                        _compile(kernel, signature)
                    self._seen_ns[kernel] = changed_ns


def _compile_alone(kernel: Any, signature: Any) -> Any:
    with _lock(kernel, fcntl.LOCK_EX):
        return _compile(kernel, signature)


def _index(kernel: Any) -> Path | None:
    return (
        None
        if isinstance(kernel._cache, NullCache)
        else Path(kernel._cache._cache_file._index_path)
    )


@contextmanager
def _lock(kernel: Any, how: int) -> Iterator[bool]:
    index = _index(kernel)
    if index is None or index in _held:
        yield True
        return
    index.parent.mkdir(parents=True, exist_ok=True)
    try:
        file = index.with_suffix(".lock").open("w")
    except OSError:  # a kernel that is kept nowhere on this machine
        yield True
        return
    with file:
        try:
            fcntl.flock(file, how)
        except BlockingIOError:
            yield False
            return
        _held.add(index)
        try:
            yield True
        finally:
            _held.discard(index)
