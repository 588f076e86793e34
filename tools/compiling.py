"""Say that kernels are compiled: the first time on a machine this takes minutes."""

from __future__ import annotations

import logging
import os
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from typing_extensions import override

NOTICE = "compiling"
"""What each line begins with: a command that hides what its simulator says passes these on."""

_EVERY_S = 5.0
_LOG = logging.getLogger("cdpr.compiling")


_listeners: list[Callable[[str], None]] = []

_NAME = "CDPR_COMPILING_TOLD"
"""Variable with the name of a socket that has room for one: who gets in tells of compiling."""
_sockets: list[socket.socket] = []
"""Kept open as long as the process lasts."""


@contextmanager
def compiling_notices_to(listener: Callable[[str], None]) -> Iterator[None]:
    """Call `listener` with how far it is for each kernel that the block compiles.

    In the thread that compiles, and with each notice of another process that is passed on.
    Only where `announce_compiling` is in force.
    """
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def pass_on(line: str) -> None:
    """Say a notice of another process, a whole line, in the place of that process."""
    print(line, end="", file=sys.stderr, flush=True)
    _tell_listeners(line)


def _tell_listeners(text: str) -> None:
    for listener in _listeners:
        listener(text.rstrip(" .\n"))


def _first_to_tell() -> bool:
    """Whether no other process of the command, and none that it has started, has told of it."""
    visitor = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    visitor.setblocking(False)
    try:
        visitor.connect("\0" + os.environ.get(_NAME, ""))
    except BlockingIOError:
        return False
    except OSError:  # the command that has started this process has ended
        pass
    finally:
        visitor.close()  # it stays in the queue, which nobody serves
    return True


def _share_with_children() -> None:
    """Make the socket that this process and those that it starts share."""
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
    """Says it once in a command, then how far each of its processes is; on standard error."""

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
        """Tell now and then how many kernels there are, as long as there are more and more."""
        noted, never = 0, threading.Event()
        while noted != self._kernels:
            noted = self._kernels
            never.wait(_EVERY_S)
            if noted != self._kernels:
                self._say(self._how_far())
        self._teller = None

    def _how_far(self) -> str:
        return f"{NOTICE} {self._what} goes on: {self._kernels} kernels so far ..."

    def _say(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)


def announce_compiling(what: str = "the numerics") -> None:
    """Say from now on when kernels have to be compiled; `what` names them all."""
    _share_with_children()
    _LOG.handlers[:] = [_Notice(what)]
    _LOG.propagate = False
    _LOG.setLevel(logging.INFO)


class _NotWantedError(Exception):
    """What is compiled is not wanted any more."""


class _EndsCompiling(logging.Handler):
    """Raises where the next kernel would be compiled, once that is not wanted any more."""

    def __init__(self, ended: Callable[[], bool]) -> None:
        super().__init__()
        self._ended = ended

    @override
    def emit(self, record: logging.LogRecord) -> None:
        if self._ended():
            raise _NotWantedError


@contextmanager
def compiling_until(ended: Callable[[], bool]) -> Iterator[None]:
    """Leave the block before the next kernel that it compiles once `ended` says so.

    Only where `announce_compiling` is in force: nothing else tells of each kernel.
    """
    handler = _EndsCompiling(ended)
    _LOG.addHandler(handler)
    try:
        with suppress(_NotWantedError):
            yield
    finally:
        _LOG.removeHandler(handler)
