"""Ctrl-C and SIGTERM as a question that a loop asks, instead of an exception in its middle."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_STOPPING = "stopping under control; a second Ctrl-C takes the power at once"
HELD = "the motion stops and is held, with power, which `cdpr disable` and `cdpr stop` take"
"""What a Ctrl-C does to a command that has a daemon move something."""


class StopRequest:
    """Whether the user wants an end: asked once it is to be looked at, asked twice it interrupts.

    It interrupts once, by KeyboardInterrupt: what comes later would keep the power from being
    switched off.
    """

    def __init__(self, notice: str = "") -> None:
        self._notice = notice
        self._times = 0
        self._interrupts = True
        self.energised = False
        """Whether the user is told at the first request what a second one does."""

    def __call__(self) -> bool:
        """Whether an end is wanted."""
        return self._times > 0

    def closing(self) -> None:
        """Have nothing interrupted any more, since the power is being switched off."""
        self._interrupts = False

    def note(self, _number: int, _frame: FrameType | None) -> None:
        """Take a signal."""
        self._times += 1
        notice = _STOPPING if self.energised else self._notice
        if self._times == 1 and notice and self._interrupts:
            # printing is not allowed to interrupt itself
            os.write(sys.stderr.fileno(), f"{notice}\n".encode())
        if self._times > 1 and self._interrupts:
            self._interrupts = False
            raise KeyboardInterrupt


@contextmanager
def interrupted_by_sigterm() -> Iterator[None]:
    """Have SIGTERM end what is done in the block as a Ctrl-C does: by KeyboardInterrupt."""

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def stop_on_signals(notice: str = "") -> Iterator[StopRequest]:
    """Yield what tells whether the user wants an end; asked a second time it is an interrupt.

    `notice` is said at the first request. After a Ctrl-C in the block further ones change nothing:
    the command ends already.
    """
    request = StopRequest(notice)
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, request.note) for number in numbers}
    try:
        yield request
    finally:
        # in one step: an interrupt in between would end the interpreter while it takes itself apart
        signal.signal(signal.SIGINT, signal.SIG_IGN if request() else before[signal.SIGINT])
        signal.signal(signal.SIGTERM, before[signal.SIGTERM])
