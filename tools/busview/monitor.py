"""Show, log and count the frames of a bus, live or from a file."""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from cdpr_drivers.decode import Decoder, Frame, format_line
from cdpr_tools.busview.source import Source
from cdpr_tools.busview.summary import Summary
from cdpr_tools.errors import BadInputError, WorkFailedError

_BATCH = 200
_WAIT_S = 0.1
_MOST_BLOCKS = 10_000
"""Blocks of lines that may wait for a reader before the monitor waits for it too."""


class LineWriter:
    """Writes blocks of lines from a thread of its own, so that a slow reader delays nobody else.

    Use it as a context; at its end all that was handed over is written.
    """

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._blocks: queue.Queue[str | None] = queue.Queue(_MOST_BLOCKS)
        self._thread = threading.Thread(target=self._run, name="lines", daemon=True)
        self.closed = False
        """Whether nobody reads the lines any more."""

    def write(self, lines: list[str]) -> None:
        """Hand lines over."""
        if lines and not self.closed:
            self._blocks.put("\n".join(lines) + "\n")

    def _run(self) -> None:
        while (block := self._blocks.get()) is not None:
            if self.closed:
                continue
            try:
                self._out.write(block)
                self._out.flush()
            except OSError:
                self.closed = True
                # what is left in the buffer is not to be complained of at the interpreter's end
                with suppress(OSError, ValueError):
                    os.dup2(os.open(os.devnull, os.O_WRONLY), self._out.fileno())

    def __enter__(self) -> LineWriter:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._blocks.put(None)
        self._thread.join()


class Viewer:
    """Decodes frames, hands on a line for each that is shown, and keeps the summary.

    SYNC without a counter says nothing and is counted only.
    """

    def __init__(self, decoder: Decoder, summary: Summary, out: LineWriter, *, raw: bool) -> None:
        self._decoder = decoder
        self._out = out
        self._raw = raw
        self._start_s: float | None = None
        self.summary = summary

    @property
    def closed(self) -> bool:
        """Whether nobody reads the lines any more."""
        return self._out.closed

    def show(self, channel: str, frames: Iterable[Frame]) -> None:
        """Decode frames of one bus and show them."""
        lines = []
        for frame in frames:
            if self._start_s is None:
                self._start_s = frame.time_s
            record = self._decoder.decode(frame)
            self.summary.add(record)
            if self._raw:
                lines.append(format_line(channel, frame))
            elif record.text or record.problem:
                lines.append(record.line(self._start_s))
        self._out.write(lines)


class LogFile:
    """A candump log that is written while frames come; raises BadInputError, WorkFailedError."""

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file = path.open("w", encoding="ascii")
        except OSError as error:
            raise BadInputError(f"--log {path}: cannot be written: {error.strerror}") from error

    def write(self, channel: str, frames: Iterable[Frame]) -> None:
        """Append frames."""
        try:
            self._file.writelines(f"{format_line(channel, frame)}\n" for frame in frames)
            self._file.flush()
        except OSError as error:
            raise self._full(error) from error

    def _full(self, error: OSError) -> WorkFailedError:
        return WorkFailedError(f"--log {self._path}: cannot be written: {error.strerror}")

    def __enter__(self) -> LogFile:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(OSError):
            self._file.close()


def watch(
    source: Source,
    viewer: Viewer,
    log: LogFile | None,
    seconds: float | None,
    stop_wanted: Callable[[], bool],
) -> None:
    """Show what comes until the time is up, the user wants an end, or the bus is lost.

    Frames that have arrived are received before any is decoded, so that a fast bus fills our
    memory and not the bus' buffer, where they would be lost.
    """
    deadline = None if seconds is None else time.monotonic() + seconds
    more = False
    while True:
        left_s = _WAIT_S if deadline is None else min(_WAIT_S, deadline - time.monotonic())
        ended = left_s <= 0.0 or stop_wanted() or viewer.closed or source.lost is not None
        if not ended:
            source.receive(0.0 if more else left_s)
        frames = source.next_frames(_BATCH)
        if ended and not frames:
            return
        if log is not None:
            log.write(source.name, frames)
        viewer.show(source.name, frames)
        more = len(frames) == _BATCH
