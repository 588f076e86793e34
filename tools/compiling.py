"""Report that kernels are compiled: the first time on a machine this takes minutes."""

from __future__ import annotations

import logging
import os
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from typing_extensions import override

NOTICE = "compiling"
"""Start of each notice line; a command that hides its simulator's output forwards these lines."""

_EVERY_S = 5.0
_LOG = logging.getLogger("cdpr.compiling")


_listeners: list[Callable[[str], None]] = []

_NAME = "CDPR_COMPILING_TOLD"
"""Environment variable with the name of a socket that accepts one connection. The process that
connects is the one that reports the compilation."""
_sockets: list[socket.socket] = []
"""Sockets that stay open until the process ends."""


@contextmanager
def compiling_notices_to(listener: Callable[[str], None]) -> Iterator[None]:
    """Call `listener` with the progress for each kernel that the block compiles.

    The compiling thread calls it. Each notice that another process forwards also leads to a call.
    Call `announce_compiling` first.
    """
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def pass_on(line: str) -> None:
    """Print a notice, a whole line, for another process."""
    print(line, end="", file=sys.stderr, flush=True)
    _tell_listeners(line)


def _tell_listeners(text: str) -> None:
    for listener in _listeners:
        listener(text.rstrip(" .\n"))


def _first_to_tell() -> bool:
    """Return whether no other process of the command has reported the compiling yet."""
    visitor = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    visitor.setblocking(False)
    try:
        visitor.connect("\0" + os.environ.get(_NAME, ""))
    except BlockingIOError:
        return False
    except OSError:  # the command that started this process has ended
        pass
    finally:
        visitor.close()  # the connection stays in the queue, which nobody empties
    return True


def _share_with_children() -> None:
    """Create the socket that this process and its children share."""
    if _NAME in os.environ:
        return
    name, listener = f"cdpr-compiling-{os.getpid()}", socket.socket(socket.AF_UNIX)
    try:
        listener.bind("\0" + name)
        listener.listen(0)
    except OSError:
        listener.close()
        return
    _sockets.append(listener)
    os.environ[_NAME] = name


class _Notice(logging.Handler):
    """Reports the compilation once per command, then each process' progress, on standard error."""

    def __init__(self, what: str) -> None:
        super().__init__()
        self._what = what
        self._kernels = 0
        self._teller: threading.Thread | None = None

    @override
    def emit(self, record: logging.LogRecord) -> None:
        self._kernels += 1
        _tell_listeners(self._how_far())
        if self._kernels == 1 and _first_to_tell():
            self._say(f"{NOTICE} {self._what} once for this machine; this may take minutes ...")
        if self._teller is None:
            self._teller = threading.Thread(target=self._go_on_telling, daemon=True)
            self._teller.start()

    def _go_on_telling(self) -> None:
        """Report the number of compiled kernels from time to time while it grows."""
        noted, never = 0, threading.Event()
        while noted != self._kernels:
            noted = self._kernels
            never.wait(_EVERY_S)
            if noted != self._kernels:
                self._say(self._how_far())
        self._teller = None

    def _how_far(self) -> str:
        return f"{NOTICE} {self._what} continues: {self._kernels} kernels so far ..."

    def _say(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)


def announce_compiling(what: str = "the numerics") -> None:
    """Report from now on when kernels must be compiled; `what` names the kernels in the message."""
    _share_with_children()
    _LOG.handlers[:] = [_Notice(what)]
    _LOG.propagate = False
    _LOG.setLevel(logging.INFO)
