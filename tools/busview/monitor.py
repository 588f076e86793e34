"""Show, log and count the frames of a bus, live or from a file; and what passed over it in all."""

from __future__ import annotations

import os
import queue
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

from cdpr_drivers.bus.budget import worst_case_bits
from cdpr_drivers.decode import Decoder, Frame, Record, format_line
from cdpr_tools.busview.source import FrameSource
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as

_MORE_BITS_EXTENDED = 25
"""20 bits of the identifier and the 5 that they may have stuffed."""


@dataclass
class Summary:
    """Counts what it is given; `bitrate_bit_s` is what the load is relative to."""

    bitrate_bit_s: int
    frames: int = 0
    problems: int = 0
    bits: int = 0
    first_s: float | None = None
    last_s: float = 0.0
    time_s: float | None = None
    """What the traffic took, where something else than its time stamps tells."""
    untimed: bool = False
    """Whether the time stamps are not those of the traffic and nothing else tells its time."""
    missed: int | None = None
    """Frames that went past the monitor, where that is known."""
    led: bool | None = None
    """Whether a master leads the bus at the end, where that is known."""
    _by_id: Counter[tuple[str, str, int | None]] = field(default_factory=Counter)

    def add(self, record: Record) -> None:
        """Count one frame."""
        frame = record.frame
        if self.first_s is None:
            self.first_s = frame.time_s
        self.last_s = frame.time_s
        self.frames += 1
        self.problems += record.problem
        self.bits += _bits(frame)
        self._by_id[frame.id_text, record.kind, record.node_id] += 1

    @property
    def duration_s(self) -> float:
        """Return what the traffic took: as reported, or from the first frame to the last."""
        if self.time_s is not None:
            return self.time_s
        return 0.0 if self.first_s is None else self.last_s - self.first_s

    @property
    def load(self) -> float | None:
        """Return the share of time that the wire was in use at most; None for a moment only."""
        return self.bits / self.bitrate_bit_s / self.duration_s if self._has_rates else None

    @property
    def _has_rates(self) -> bool:
        return self.duration_s > 0 and not self.untimed

    def rows(self) -> list[dict[str, Any]]:
        """Return frames and frames a second by identifier, in the order of their priority."""
        rows = []
        for (identifier, kind, node_id), frames in sorted(self._by_id.items()):
            row = {"id": identifier, "kind": kind, "node_id": node_id, "frames": frames}
            rate = frames / self.duration_s if self._has_rates else None
            rows.append({**row, "per_s": rate})
        return rows

    def table(self) -> dict[str, Any]:
        """Return the summary for programs."""
        return {
            "frames": self.frames,
            "duration_s": self.duration_s,
            "load": self.load,
            "bitrate_bit_s": self.bitrate_bit_s,
            "problems": self.problems,
            "missed": self.missed,
            "led": self.led,
            "ids": self.rows(),
        }

    def lines(self) -> list[str]:
        """Return the summary for people."""
        whose = " of bus time" if self.time_s is not None else ""
        what = "1 frame" if self.frames == 1 else f"{self.frames} frames"
        totals = [f"{what} in {self.duration_s:.3f} s{whose}"]
        if self.load is not None:
            rate = f"{self.bitrate_bit_s / 1e3:g} kbit/s"
            totals.append(f"bus load {100 * self.load:.1f} % of {rate}, stuffed as badly as can be")
        totals.append(f"{self.problems} told of trouble (marked !)")
        lines = ["; ".join(totals)]
        if self.missed:
            lines.append(
                f"{self.missed} frames went by unseen: the bus was faster than the monitor"
            )
        if self.led:
            lines.append("a master leads this bus: its time moves by that master's packets alone")
        if self._by_id:
            lines.append(f"{'id':>8} {'node':>5}  {'what':<10}{'frames':>9}{'per s':>10}")
        for row in self.rows():
            node = "" if row["node_id"] is None else row["node_id"]
            rate = "" if row["per_s"] is None else f"{row['per_s']:.1f}"
            line = f"{row['id']:>8} {node:>5}  {row['kind']:<10}{row['frames']:>9}{rate:>10}"
            lines.append(line.rstrip())
        return lines


def _bits(frame: Frame) -> int:
    if frame.error:
        return 0
    return worst_case_bits(len(frame.data)) + (_MORE_BITS_EXTENDED if frame.extended else 0)


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
        with os_error_as(BadInputError, f"--log {path}: cannot be written"):
            self._file = path.open("w", encoding="ascii")

    def write(self, channel: str, frames: Iterable[Frame]) -> None:
        """Append frames."""
        with os_error_as(WorkFailedError, f"--log {self._path}: cannot be written"):
            self._file.writelines(f"{format_line(channel, frame)}\n" for frame in frames)
            self._file.flush()

    def __enter__(self) -> LogFile:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(OSError):
            self._file.close()


def watch(
    source: FrameSource,
    viewer: Viewer,
    log: LogFile | None,
    seconds: float | None,
    stop_requested: Callable[[], bool],
) -> None:
    """Show what comes until the time is up, the user wants an end, or the bus is lost.

    Frames that have arrived are received before any is decoded, so that a fast bus fills our
    memory and not the bus' buffer, where they would be lost.
    """
    deadline = None if seconds is None else time.monotonic() + seconds
    more = False
    while True:
        left_s = _WAIT_S if deadline is None else min(_WAIT_S, deadline - time.monotonic())
        ended = left_s <= 0.0 or stop_requested() or viewer.closed or source.lost is not None
        if not ended:
            source.receive(0.0 if more else left_s)
        frames = source.next_frames(_BATCH)
        if ended and not frames:
            return
        if log is not None:
            log.write(source.name, frames)
        viewer.show(source.name, frames)
        more = len(frames) == _BATCH
