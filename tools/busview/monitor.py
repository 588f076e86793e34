"""Frames of a bus, live or from a file: stored, decoded, shown, logged and counted."""

from __future__ import annotations

import os
import queue
import select
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import can

from cdpr_drivers.bus import BusUrl, Filters, open_port, query_status
from cdpr_drivers.bus.budget import worst_case_bits
from cdpr_drivers.bus.frames import EFF_FLAG, FRAME_BYTES
from cdpr_drivers.decode import Decoder, Frame, KnownNode, Record, format_line
from cdpr_drivers.errors import BusError
from cdpr_profiles import Robot, load_drive, load_robot, load_winch
from cdpr_profiles.bounded_input import may_replace
from cdpr_profiles.errors import printable
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as, raised_as
from cdpr_tools.streams import OutputLostError

_MOST_WAITING = 1 << 20
"""Frames kept for decoding; further frames stay in the bus' own buffer."""
_AT_ONCE = 1000


class FrameSource:
    """A bus to listen to: frames are kept with their time of arrival until they are decoded.

    Raises BadInputError for a bus that cannot be opened.
    """

    def __init__(self, url: BusUrl, filters: Filters | None = None) -> None:
        self.name = url.channel.rpartition("/")[2]
        """Name of the bus in log files."""
        self.lost: BusError | None = None
        """Why no more frames arrive."""
        self.seen = 0
        """Frames received so far."""
        self._url = url
        with raised_as(BadInputError, BusError):
            self._port = open_port(url, filters, receive_errors=True)
        self._port.settimeout(0)
        self._readable = select.poll()
        self._readable.register(self._port.fileno(), select.POLLIN)
        self._waiting: deque[tuple[float, bytes]] = deque()

    def receive(self, timeout_s: float) -> None:
        """Keep arrived frames, waiting up to `timeout_s`; if the bus is lost, `lost` is set."""
        if self.lost or len(self._waiting) >= _MOST_WAITING:
            return
        if not self._readable.poll(timeout_s * 1e3):
            return
        packet = bytearray(FRAME_BYTES)
        port, receive, keep = self._port, self._port.recv_into, self._waiting.append
        try:
            for _ in range(_AT_ONCE):
                if not receive(packet):
                    self.lost = port.lost()
                    return
                keep((port.arrival_s(), bytes(packet)))
                self.seen += 1
        except BlockingIOError:
            return
        except OSError as error:
            self.lost = port.lost(error)

    def next_frames(self, most: int) -> list[Frame]:
        """Return received frames, the oldest first."""
        count = min(most, len(self._waiting))
        return [Frame.unpack(*self._waiting.popleft()) for _ in range(count)]

    def ask(self) -> dict[str, float] | None:
        """Return the report of a simulated bus, None for any other bus; raises BusError.

        The report has `frames` and `bus_time_s` since this client joined, and whether the bus is
        `led`.
        """
        before = self._port.status
        if not before:
            return None
        if self.lost is not None:
            raise self.lost
        now = query_status(self._url.channel)
        passed = {key: now[key] - before[key] for key in ("frames", "bus_time_s")}
        return passed | {"led": now["led"]}

    def close(self) -> None:
        """Leave the bus."""
        self._port.close()


_MORE_BITS_EXTENDED = 25
"""Additional bits of an extended frame: 20 bits, and up to 5 stuff bits."""


@dataclass
class Summary:
    """Counts of records, and the load of a bus with `bitrate_bit_s`."""

    bitrate_bit_s: int
    frames: int = 0
    problems: int = 0
    bits: int = 0
    first_s: float | None = None
    last_s: float = 0.0
    time_s: float | None = None
    """Duration of the traffic, if it is known from another source than the time stamps."""
    untimed: bool = False
    """Whether the time stamps are not those of the traffic, so that its duration is unknown."""
    missed: int | None = None
    """Frames that the monitor missed, if known."""
    led: bool | None = None
    """Whether a master leads the bus at the end, if known."""
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
        """Return the duration of the traffic: as reported, or from the first frame to the last."""
        if self.time_s is not None:
            return self.time_s
        return 0.0 if self.first_s is None else self.last_s - self.first_s

    @property
    def load(self) -> float | None:
        """Return the largest share of time for which the wire was busy; None without a duration."""
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
        """Return the summary as data for programs."""
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
        """Return the summary as readable lines."""
        whose = " of bus time" if self.time_s is not None else ""
        what = "1 frame" if self.frames == 1 else f"{self.frames} frames"
        totals = [f"{what} in {self.duration_s:.3f} s{whose}"]
        if self.load is not None:
            rate = f"{self.bitrate_bit_s / 1e3:g} kbit/s"
            totals.append(
                f"bus load {100 * self.load:.1f} % of {rate}, with worst-case bit stuffing"
            )
        totals.append(f"{self.problems} with a problem (marked !)")
        lines = ["; ".join(totals)]
        if self.missed:
            lines.append(
                f"{self.missed} frames were lost because the bus was faster than the monitor"
            )
        if self.led:
            lines.append("a master leads this bus: bus time advances only with its packets")
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
"""Blocks of lines that may wait for a reader before the monitor waits too."""


class LineWriter:
    """Writes blocks of lines in a separate thread, so that a slow reader delays nothing else.

    Use it as a context; at its end all lines passed to it are written.
    """

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._blocks: queue.Queue[str | None] = queue.Queue(_MOST_BLOCKS)
        self._thread = threading.Thread(target=self._run, name="lines", daemon=True)
        self.closed = False
        """Whether the reader is gone."""
        self._failure: OutputLostError | None = None

    def write(self, lines: list[str]) -> None:
        """Pass lines to the writer."""
        if lines and not self.closed:
            self._blocks.put(printable("\n".join(lines)) + "\n")

    def _run(self) -> None:
        while (block := self._blocks.get()) is not None:
            if self.closed:
                continue
            try:
                self._out.write(block)
                self._out.flush()
            except OutputLostError as error:
                self.closed, self._failure = True, error
            except OSError:
                self.closed = True
                # the rest of the buffer must not cause an error message at the interpreter's end
                with suppress(OSError, ValueError):
                    os.dup2(os.open(os.devnull, os.O_WRONLY), self._out.fileno())

    def __enter__(self) -> LineWriter:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._blocks.put(None)
        self._thread.join()
        if self._failure is not None:
            raise self._failure


class Viewer:
    """Decodes frames, writes a line for each shown frame, and updates the summary.

    SYNC without a counter has no content and is only counted.
    """

    def __init__(self, decoder: Decoder, summary: Summary, out: LineWriter, *, raw: bool) -> None:
        self._decoder = decoder
        self._out = out
        self._raw = raw
        self._start_s: float | None = None
        self.summary = summary

    @property
    def closed(self) -> bool:
        """Whether the reader is gone."""
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
    """A candump log, written as frames arrive; raises BadInputError, WorkFailedError."""

    def __init__(self, path: Path) -> None:
        self._path = path
        if not may_replace(path):
            raise BadInputError(f"--log {path}: already exists; choose another name")
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
    """Show frames until the time is up, the user requests an end, or the bus is lost.

    All received frames are stored before any is decoded. So a fast bus fills this process's memory,
    and not the bus' buffer, in which frames would be lost.
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


# User input: a bus, the nodes on it, identifiers.


def running_bus(text: str) -> BusUrl:
    """Return the bus that `text` names, which must exist; raises BadInputError."""
    with raised_as(BadInputError, BusError):
        url = BusUrl.parse(text)
    if url.starts_own_simulator:
        found = can.detect_available_configs(interfaces=["simbus"])
        running = ", ".join(f"simbus:{config['channel']}" for config in found) or "none"
        raise BadInputError(
            f"--bus {text}: the name is missing; running on this machine: {running}"
        )
    return url


# The nodes of a bus according to a drive's, a winch's or a robot's profile, for decoding.

_USUAL_BITRATE_bit_s = 1_000_000


@dataclass(frozen=True)
class KnownBus:
    """What is known about a bus before any frame arrives."""

    nodes: dict[int, KnownNode] = field(default_factory=dict)
    others: KnownNode | None = None
    bitrate_bit_s: int = _USUAL_BITRATE_bit_s

    def decoder(self) -> Decoder:
        """Return a decoder for a session on this bus."""
        return Decoder(self.nodes, self.others)


def known_bus(
    url: BusUrl | None, drive: str | None, winch: str | None, robot: str | None
) -> KnownBus:
    """Return what the named profile says about a bus; `url` is None for a file.

    Raises BadInputError, ProfileError.
    """
    if sum(name is not None for name in (drive, winch, robot)) > 1:
        raise BadInputError("--profile, --winch, --robot: give only one of them")
    if winch is not None:
        one = load_winch(winch)
        nodes = {one.node_id: KnownNode.of_winch(one)}
        return KnownBus(nodes, bitrate_bit_s=_bitrate(url, one.bitrate_bit_s))
    if robot is not None:
        name, _, bus = robot.partition(":")
        return _of_robot(load_robot(name), bus, url)
    others = None if drive is None else KnownNode(load_drive(drive))
    return KnownBus(others=others, bitrate_bit_s=_bitrate(url, _USUAL_BITRATE_bit_s))


def _bitrate(url: BusUrl | None, otherwise: int) -> int:
    bitrate = url.options.get("bitrate") if url is not None else None
    return bitrate if isinstance(bitrate, int) and bitrate > 0 else otherwise


def _of_robot(robot: Robot, name: str, url: BusUrl | None) -> KnownBus:
    """Return one bus of a robot, or all together if no bus is named and their node ids differ."""
    buses = {bus.name: bus for bus in robot.buses}
    if name and name not in buses:
        allowed = " or ".join(f"--robot {robot.reference}:{one}" for one in buses)
        raise BadInputError(f"--robot {robot.reference}:{name}: no such bus; allowed: {allowed}")
    axes = [axis for axis in robot.axes if axis.bus == (name or _bus_at(robot, url) or axis.bus)]
    nodes = {axis.node_id: KnownNode.of_winch(axis.winch) for axis in axes}
    if len(nodes) < len(axes):
        choice = " or ".join(f"--robot {robot.reference}:{one}" for one in buses)
        raise BadInputError(
            f"--robot {robot.reference}: several of its buses use the same node ids: choose "
            f"{choice}"
        )
    return KnownBus(nodes, bitrate_bit_s=_bitrate(url, buses[axes[0].bus].bitrate_bit_s))


def _bus_at(robot: Robot, url: BusUrl | None) -> str:
    """Return the name of the robot's bus with this URL, real or simulated; "" if none has it."""
    for bus in robot.buses:
        if url is not None and (bus.url == str(url) or f"-{url.channel}".endswith(f"-{bus.name}")):
            return bus.name
    return ""


# Lists of identifiers and node ids as the user types them.

_LAST = 0x7FF
_LAST_NODE = 127


def parse_identifiers(text: str) -> frozenset[int]:
    """Return the 11-bit identifiers in a list as `181,700-77F`, hexadecimal; BadInputError."""
    allowed = "not an identifier; write hexadecimal numbers up to 7FF, such as 181,700-77F"
    return frozenset(_numbers("--ids", text, 16, range(_LAST + 1), allowed))


def parse_node_ids(text: str) -> list[int]:
    """Return the node ids in a list as `1,5,20-23`, decimal, in their order; BadInputError."""
    allowed = "not a node id; allowed: 1 to 127, such as 1,5,20-23"
    return sorted(_numbers("--nodes", text, 10, range(1, _LAST_NODE + 1), allowed))


def _numbers(option: str, text: str, base: int, known: range, allowed: str) -> set[int]:
    found: set[int] = set()
    for part in map(str.strip, text.split(",")):
        first, dash, last = part.partition("-")
        try:
            low = int(first, base)
            high = int(last, base) if dash else low
        except ValueError:
            low, high = 1, 0
        written = (first + last).isalnum()  # int() also accepts signs, blanks and underscores
        if not (written and low in known and high in known and low <= high):
            raise BadInputError(f"{option} {text}: {part!r} is {allowed}")
        found |= set(range(low, high + 1))
    return found


def filters(identifiers: frozenset[int]) -> list[tuple[int, int]]:
    """Return the fewest pairs (identifier, mask) that pass exactly these 11-bit identifiers."""
    return list(_blocks(identifiers, 0, _LAST + 1))


def _blocks(identifiers: frozenset[int], start: int, size: int) -> Iterator[tuple[int, int]]:
    """Yield the aligned power-of-two blocks that lie entirely in `identifiers`."""
    inside = sum(1 for i in range(start, start + size) if i in identifiers)
    if inside == size:
        yield start, (_LAST & ~(size - 1)) | EFF_FLAG
    elif inside:
        yield from _blocks(identifiers, start, size // 2)
        yield from _blocks(identifiers, start + size // 2, size // 2)
