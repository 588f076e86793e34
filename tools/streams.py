"""Standard output and error that may fail: a full disk, a closed terminal, no reader.

Writing to standard error never fails. Standard output has the result of a command: its failure is
raised once, as OutputLostError. Standard input may contain text that was typed before the question.
"""

from __future__ import annotations

import errno
import io
import os
import select
import signal
import sys
import termios
from contextlib import suppress
from typing import Any, Final

from typing_extensions import override

from cdpr_tools.errors import WorkFailedError

_OUT: Final = 1
_ERROR: Final = 2
_PATIENCE_S: Final = 0.2
"""Time that a daemon waits for a reader that reads nothing, such as a paused terminal."""

PROCEDURE_VARIABLE: Final = "CDPR_PROCEDURE"
"""Environment variable of a command that a daemon runs: the token of the right to move."""
procedure_token: Final = os.environ.pop(PROCEDURE_VARIABLE, None)
"""That token; None for a command that no daemon runs. This command does not pass it to its own
children.

A procedure ends with its standard input, and writes its progress as JSON to standard output.
"""


def end_with_stdin() -> None:
    """End this process, as SIGTERM does, when standard input ends."""
    with suppress(OSError, ValueError):
        while os.read(sys.stdin.fileno(), 4096):
            pass
    os.kill(os.getpid(), signal.SIGTERM)


def discard_typed_ahead() -> None:
    """Discard what has been typed at the terminal before the question that is asked now."""
    if sys.stdin.isatty():
        termios.tcflush(sys.stdin, termios.TCIFLUSH)


class OutputLostError(WorkFailedError):
    """Standard output cannot be written."""


class _Standard(io.RawIOBase):
    """Raw output to one of the two descriptors; BufferedWriter and TextIOWrapper write to it."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.name = "<stdout>" if number == _OUT else "<stderr>"
        self.loses = number == _ERROR
        """Whether data that cannot be written are dropped."""
        self.waits = True
        """Whether it waits for a reader without limit."""
        self._fd = number
        """The descriptor in use, a second one if a terminal must not delay the process."""
        self._behind = False

    def outlive(self) -> None:
        """Drop data that cannot be written from now on, even if a reader only pauses."""
        self.loses, self.waits = True, False
        if self._fd != self.number or not os.isatty(self.number):
            return
        # a terminal can be ready for writing and still block; O_NONBLOCK on the inherited file
        # description would also apply to the shell
        flags = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
        with suppress(OSError):  # the terminal belongs to another user, or has just closed
            self._fd = os.open(f"/proc/self/fd/{self.number}", flags)

    @override
    def fileno(self) -> int:
        return self.number

    @override
    def isatty(self) -> bool:
        return os.isatty(self.number)

    @override
    def writable(self) -> bool:
        return True

    @override
    def write(self, data: Any) -> int:
        """Return how many bytes were processed: written, or dropped."""
        try:
            return self._write(bytes(data))
        except OSError as error:
            if self.loses:
                return len(data)
            self.loses = True  # otherwise the interpreter would retry at its end, and fail again
            if error.errno == errno.EPIPE:  # the reader is gone: end without a message
                raise
            why = f"standard output: cannot be written: {error.strerror}"
            raise OutputLostError(why) from None

    def _write(self, data: bytes) -> int:
        if self.waits:
            while True:
                try:
                    return os.write(self.number, data)
                except BlockingIOError:  # another program has made the shared terminal non-blocking
                    _has_room(self.number, None)
        if _has_room(self._fd, 0.0 if self._behind else _PATIENCE_S):
            with suppress(BlockingIOError):
                # a pipe with room accepts this much in one piece
                written = os.write(self._fd, data[: select.PIPE_BUF])
                self._behind = False
                return written
        self._behind = True
        return len(data)

    def notify(self, line: bytes) -> None:
        """Write a line past the buffers, as far as it is accepted; raises OSError."""
        if _has_room(self._fd, _PATIENCE_S):
            os.write(self._fd, line[: select.PIPE_BUF])


_guarded: dict[int, _Standard] = {}


def guard_streams() -> None:
    """Let this process survive the loss of its standard output and error; call it first.

    A closed descriptor then leads to /dev/null, so that no bus or file gets its number.
    """
    for number in range(_ERROR + 1):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number: this one
    for number, name in ((_OUT, "stdout"), (_ERROR, "stderr")):
        before = getattr(sys, name)
        if before is None or _leads_to(before, number):
            setattr(sys, name, _guarded_stream(number, before))


def _guarded_stream(number: int, before: Any) -> io.TextIOWrapper:
    raw = _guarded[number] = _Standard(number)
    with suppress(OSError):
        if before is not None:
            before.flush()
    return io.TextIOWrapper(
        io.BufferedWriter(raw),
        encoding=getattr(before, "encoding", "utf-8"),
        errors=getattr(before, "errors", "backslashreplace"),
        line_buffering=number == _ERROR or raw.isatty(),
    )


def _leads_to(stream: Any, number: int) -> bool:
    """Whether `stream` is the process's own one, not a replacement by a test."""
    try:
        return bool(stream.fileno() == number)
    except (OSError, ValueError, AttributeError):
        return False


def outlive_output() -> None:
    """Do not let either stream end or delay this process, which belongs to a daemon.

    Data that cannot be written are dropped, even if a reader only pauses.
    """
    for stream in _guarded.values():
        stream.outlive()
    signal.signal(
        signal.SIGTTOU, signal.SIG_IGN
    )  # this signal stops background processes that write


def write_notice(text: str) -> None:
    """Write a line to standard error past its buffer, as a signal handler may; never fails."""
    with suppress(OSError, ValueError):
        number = sys.stderr.fileno()
        (_guarded.get(number) or _Standard(number)).notify(f"{text}\n".encode())


def _has_room(number: int, patience_s: float | None) -> bool:
    """Return whether the descriptor accepts data or fails within this time; None: no limit."""
    poll = select.poll()
    poll.register(number, select.POLLOUT)
    return bool(poll.poll(None if patience_s is None else 1000.0 * patience_s))
