"""Recorded sessions: read from a file, paced as recorded, sent to a bus."""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

import can

from cdpr_drivers.bus import BusUrl, FramePort, open_port
from cdpr_drivers.bus.simbus_can import packet_of
from cdpr_drivers.decode import Frame, LogEntry, read_log
from cdpr_drivers.errors import BusError
from cdpr_profiles.bounded_input import open_regular
from cdpr_profiles.errors import ProfileError
from cdpr_tools.busview.monitor import Viewer
from cdpr_tools.errors import BadInputError, WorkFailedError, raised_as

_LOOK_S = 0.1
_MOST_LINE = 4096
_MOST_MEMORY = 1 << 29
BLOCK = 200
"""Number of frames to show together; this speeds up long files."""
_DISABLE_VOLTAGE = bytes.fromhex("2B40600000000000")
"""SDO request that writes 0 to the controlword (6040h)."""
_SDO_REQUEST, _NODE, _FUNCTION = 0x600, 0x07F, 0x780
_COMMANDS = (0x200, 0x300, 0x400, 0x500, _SDO_REQUEST)
_CANDUMP = (".log", ".txt", ".candump", "")


def read_frames(path: Path, channel: str | None) -> Iterator[LogEntry]:
    """Yield the frames of one bus in a file; `-` is standard input.

    Candump files are read by this package, others (.asc, .blf, .trc, ...) by python-can.
    Raises LogError, or BadInputError for a file that cannot be read or contains several buses.
    """
    read_channel = channel
    there: set[str] = set()
    for logged in _frames(path):
        there.add(logged.channel)
        read_channel = read_channel or logged.channel
        if logged.channel == read_channel:
            yield logged
        elif channel is None:
            names = ", ".join(sorted(there))
            raise BadInputError(
                f"{path}: contains several buses ({names}); choose one with --channel"
            )
    if channel is not None and channel not in there:
        names = ", ".join(sorted(there)) or "nothing"
        raise BadInputError(f"--channel {channel}: {path} holds {names}")


def check(path: Path, channel: str | None) -> None:
    """Read a file to its end, so that nothing of a broken file is sent; see `read_frames`.

    Standard input can be read only once: it cannot be checked before it is sent.
    """
    if str(path) != "-":
        for _ in read_frames(path, channel):
            pass


def _frames(path: Path) -> Iterator[LogEntry]:
    try:
        if str(path) == "-":
            yield from read_log("standard input", sys.stdin)
        elif path.suffix.lower() in _CANDUMP:
            with os.fdopen(open_regular(path), encoding="ascii", errors="replace") as lines:
                # An endless line is not a candump line. Do not read the whole line to detect that.
                yield from read_log(str(path), iter(partial(lines.readline, _MOST_LINE), ""))
        else:
            if path.suffix.lower() == ".gz":  # a compressed file may expand to any size
                raise BadInputError(f"{path}: is compressed; unpack it first")
            os.close(open_regular(path))  # python-can would open a file of any kind
            yield from _python_can_frames(path)
    except ProfileError as error:
        raise BadInputError(str(error)) from None
    except OSError as error:
        raise BadInputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise BadInputError("standard input: is not text, so it is not a candump log") from error


@contextmanager
def _bounded_memory() -> Iterator[None]:
    """Limit the memory that the block may take, because a packed file may unpack to any size."""
    limits = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + _MOST_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)


def _python_can_frames(path: Path) -> Iterator[LogEntry]:
    """Yield the frames of a file in a format of python-can."""
    try:
        with _bounded_memory(), can.LogReader(path) as reader:
            for message in reader:
                if not message.is_fd:
                    frame = Frame.unpack(message.timestamp, packet_of(message))
                    yield LogEntry(str(message.channel), frame)
    except OSError:
        raise
    except Exception as error:  # python-can's readers raise various errors for a broken file
        reason = str(error) or type(error).__name__
        raise BadInputError(f"{path}: python-can cannot read it: {reason}") from error


class Pacer:
    """Waits between frames as long as in the recording."""

    def __init__(self, speed: float | None, stop_requested: Callable[[], bool]) -> None:
        self._speed = speed
        self._stop_requested = stop_requested
        self._first: tuple[float, float] | None = None

    def wait_for(self, frame: Frame) -> None:
        """Return when the frame is due, or the user requests an end."""
        if self._speed is None:
            return
        if self._first is None:
            self._first = frame.time_s, time.monotonic()
        recorded_s, begun_s = self._first
        due_s = begun_s + (frame.time_s - recorded_s) / self._speed
        while (left_s := due_s - time.monotonic()) > 0.0 and not self._stop_requested():
            time.sleep(min(left_s, _LOOK_S))


class Sender:
    """Sends recorded frames to a bus; at the end it may switch the drives off.

    It switches them off if the bus is real, or if it did not send the whole recording.
    """

    def __init__(self, url: BusUrl, note: Callable[[str], None]) -> None:
        self._url = url
        self._note = note
        self.sent = 0
        self.not_sent = 0
        """Error frames, which cannot be sent."""
        self.complete = False
        """Whether the recording was sent to its end."""
        self._commanded: set[int] = set()
        with raised_as(BadInputError, BusError):
            self._port: FramePort = open_port(url, [])

    def send(self, frame: Frame) -> None:
        """Send a frame as recorded; raises WorkFailedError if the bus does not accept it."""
        if frame.error:
            self.not_sent += 1
            return
        try:
            self._port.send(frame.pack())
        except OSError as error:
            raise WorkFailedError(str(self._port.lost(error))) from error
        self.sent += 1
        node_id = frame.can_id & _NODE
        if not frame.extended and frame.can_id & _FUNCTION in _COMMANDS and node_id:
            self._commanded.add(node_id)

    def _power_off(self) -> None:
        """Request power-off of every node that was commanded."""
        asked = []
        for node_id in sorted(self._commanded):
            # Nothing can be sent on a lost bus. Its drives miss the master and stop.
            with suppress(OSError):
                self._port.send(Frame(0.0, _SDO_REQUEST + node_id, _DISABLE_VOLTAGE).pack())
                asked.append(str(node_id))
        if asked:
            self._note(f"commanded to switch their power off: node {', '.join(asked)}")

    def __enter__(self) -> Sender:
        return self

    def __exit__(self, *_: object) -> None:
        if not self.complete or not self._url.is_simulated:
            self._power_off()
        self._port.close()
        self._note(f"sent {self.sent} frames to {self._url}")


def filtered(log: Iterable[LogEntry], identifiers: frozenset[int] | None) -> Iterator[LogEntry]:
    """Yield the entries with one of these 11-bit identifiers; all for None."""
    for logged in log:
        frame = logged.frame
        if identifiers is None or (not frame.extended and frame.can_id in identifiers):
            yield logged


def play(
    log: Iterable[LogEntry],
    viewer: Viewer,
    pacer: Pacer,
    stop_requested: Callable[[], bool],
    sender: Sender | None = None,
    block: int = 1,
) -> None:
    """Show a recording, and send it if there is a `sender`, until its end or the user's request.

    Frames are processed `block` at a time.

    Raises WorkFailedError if sending ended early.
    """
    pending: list[LogEntry] = []
    try:
        for logged in log:
            pacer.wait_for(logged.frame)
            if stop_requested() or viewer.closed:
                if sender is not None:
                    raise WorkFailedError("stopped on request; not all frames were sent")
                return
            if sender is not None:
                sender.send(logged.frame)
            pending.append(logged)
            if len(pending) >= block:
                _show(viewer, pending)
    finally:
        _show(viewer, pending)
    if sender is not None:
        sender.complete = True


def _show(viewer: Viewer, pending: list[LogEntry]) -> None:
    if pending:
        viewer.show(pending[0].channel, [logged.frame for logged in pending])
        pending.clear()
