"""Ctrl-C and SIGTERM as a flag that a loop polls, instead of an exception inside it."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from cdpr_tools.streams import write_notice

_STOPPING = "stopping under control; press Ctrl-C again to remove the power immediately"
HELD = (
    "the motion stops and the motors hold the robot under power; `cdpr disable` or "
    "`cdpr stop` removes the power"
)
"""Effect of a Ctrl-C on a command that moves something through a daemon."""


class StopRequest:
    """Whether the user requests an end: the first request sets a flag, the second interrupts.

    It raises KeyboardInterrupt only once, because later ones would prevent the power from being
    switched off.
    """

    def __init__(self, notice: str = "") -> None:
        self._notice = notice
        self._times = 0
        self._interrupts = True
        self.energised = False
        """Whether the first request prints the effect of a second one."""

    def __call__(self) -> bool:
        """Whether an end is requested."""
        return self._times > 0

    def closing(self) -> None:
        """Interrupt nothing from now on, because the power is being switched off."""
        self._interrupts = False

    def note(self, _number: int, _frame: FrameType | None) -> None:
        """Handle a signal."""
        self._times += 1
        notice = _STOPPING if self.energised else self._notice
        if self._times == 1 and notice and self._interrupts:
            write_notice(notice)  # print is not reentrant
        if self._times > 1 and self._interrupts:
            self._interrupts = False
            raise KeyboardInterrupt


@contextmanager
def interrupted_by_sigterm() -> Iterator[None]:
    """Make SIGTERM end the block as a Ctrl-C does: by KeyboardInterrupt."""

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def stop_on_signals(notice: str = "") -> Iterator[StopRequest]:
    """Yield the stop request of the user; a second request is an interrupt.

    `notice` is printed at the first request. After a Ctrl-C in the block further ones are ignored:
    the command is ending.
    """
    request = StopRequest(notice)
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, request.note) for number in numbers}
    try:
        yield request
    finally:
        # In one step, because an interrupt in between would hit the interpreter during its
        # shutdown.
        signal.signal(signal.SIGINT, signal.SIG_IGN if request() else before[signal.SIGINT])
        signal.signal(signal.SIGTERM, before[signal.SIGTERM])
