"""Records what the loop publishes, every cycle of it, from a thread of the service process."""

from __future__ import annotations

import json
import re
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from foxglove import Channel, Context

from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowReader, SharedBlock, SharedBlockError
from cdpr_rt.errors import ControlError
from cdpr_rt.service.part import Part
from cdpr_rt.service.recordings import recording_schema as topics
from cdpr_rt.service.recordings.recording_events import EventDetector
from cdpr_rt.service.recordings.recording_file import NameTakenError, RecordingError, RecordingFile
from cdpr_rt.service.recordings.recording_json import RowTexts
from cdpr_rt.service.recordings.retention import Retention, size_text
from cdpr_rt.service.rows import plain

MOST_BYTES: Final = 1 << 30
_RESERVE_BYTES: Final = 64 << 20
_RESERVE_PART: Final = 20
_INTERVAL_S: Final = 0.1
_SYNC_S: Final = 0.4
"""With the interval and a disk at its usual pace, nothing older than a second is ever lost."""
_MOST_ROWS: Final = 4096
_MOST_REMARKS: Final = 1000
_PASSING: Final = ("since_ns", "count", "slowest_exchange_s", "url")


class Recorder(Part):
    """Writes rows, status, description and events of a block into MCAP files in `folder`.

    A file is named ROBOT-DATE-NNN.mcap; a session keeps its date, the next file begins where one
    has `most_bytes`. Before each, what `retention` does not keep is removed.
    A disk that takes no more, or has less than `reserve_bytes` left (without:
    64 MB, or a twentieth of a small disk), ends the recording for good: `status` says why, `ended`
    is called with it, and nobody else is concerned.
    A recorder that follows on another one of the same block goes on at the first row that was not
    safe yet.
    It has a thread of its own between `start` and `stop`; or, where what is recorded is to depend
    on no other clock than the loop's, `look` is called between its `begin` and `finish`.
    """

    name = "recording"

    def __init__(
        self,
        block: SharedBlock,
        folder: Path,
        robot: str,
        most_bytes: int = MOST_BYTES,
        reserve_bytes: int | None = None,
        ended: Callable[[str], None] | None = None,
        retention: Retention | None = None,
    ) -> None:
        super().__init__("recorder", ended)
        self._block = block
        self._folder = folder
        self._robot = re.sub(r"[^\w.-]", "_", robot)
        self._most_bytes = most_bytes
        self._reserve_bytes = reserve_bytes
        self._retention = retention or Retention()
        self._wall = WallClock(block)
        self._texts = RowTexts(block.n, topics.CYCLE_FIELDS)
        self._timing_texts = RowTexts(block.n, topics.TIMING_FIELDS)
        self._reader = RowReader(block)
        self._reader.next = int(block.counters["recorded"][0])
        self._context = Context()
        self._cycle = self._channel(topics.CYCLE, topics.cycle_schema(block.n))
        self._timing = self._channel(topics.TIMING, topics.timing_schema())
        self._status = self._channel(topics.STATUS, topics.STATUS_SCHEMA)
        self._description = self._channel(topics.DESCRIPTION, topics.DESCRIPTION_SCHEMA)
        self._event = self._channel(topics.EVENTS, topics.EVENT_SCHEMA)
        self._remarks: deque[tuple[dict[str, Any], int]] = deque(maxlen=_MOST_REMARKS)
        self._seen: dict[str, int] = {}
        self._events = EventDetector()
        self._told_status: dict[str, Any] = {}
        self._synced_s = time.monotonic()
        self._told_lost = 0
        self._rows = 0
        self._bytes = 0
        self._file: RecordingFile | None = None
        self._path: Path | None = None

    def start(self) -> None:
        """Open the first file and record from now on, until `stop`; see `status`."""
        self.begin()
        if not self._error:
            super().start()

    def begin(self) -> None:
        """Open the first file; see `status`."""
        with self._failing():
            self._open()

    def look(self) -> None:
        """Record what has come since the last time."""
        if self._error:
            return
        with self._failing():
            self._take()
            if time.monotonic() - self._synced_s >= _SYNC_S:
                self._synced_s = time.monotonic()
                self._sync()

    def finish(self) -> None:
        """Record what is left and close the file."""
        if self._error:
            return
        with self._failing():
            self._take()
            self._close()

    def remark(self, text: str, **values: Any) -> None:
        """Put a text for people among the events, with values that JSON knows; from any thread."""
        self._remarks.append(({"text": text, **values}, time.monotonic_ns()))

    def status(self) -> dict[str, Any]:
        """Return figures: `recording`, `file`, `rows`, `lost_rows`, `bytes`, `error`."""
        file = self._file
        return {
            "recording": file is not None,
            "file": str(self._path) if self._path else None,
            "rows": self._rows,
            "lost_rows": self._reader.lost,
            "bytes": self._bytes + (file.size if file else 0),
            "error": self._error,
        }

    # -- the thread

    def _serve(self) -> None:
        while not self._error and not self._end.wait(_INTERVAL_S):
            self.look()
        self.finish()

    @contextmanager
    def _failing(self) -> Iterator[None]:
        """End the recording where something fails."""
        try:
            yield
        except (ControlError, OSError) as error:
            self._fail(str(error))
        except BaseException as error:
            self._fail(self._ended_by(error))
            raise

    def _fail(self, text: str) -> None:
        super()._fail(text)
        file, self._file = self._file, None
        if file is not None:
            with suppress(ControlError, OSError):
                file.close()
            self._bytes += file.size

    def _channel(self, topic: str, schema: dict[str, Any]) -> Channel:
        return Channel(topic, schema=schema, context=self._context)

    def _open(self) -> None:
        if removed := self._retention.prune(self._folder, self._robot):
            names = ", ".join(path.name for path in removed)
            self.remark(f"removed {len(removed)} old recordings: {names}")
        date = datetime.fromtimestamp(self._wall.start_ns / 1e9, UTC)
        session = f"{self._robot}-{date:%Y%m%dT%H%M%SZ}"
        numbers = [path.stem.rpartition("-")[2] for path in self._folder.glob(f"{session}-*.mcap")]
        part = max((int(number) for number in numbers if number.isdecimal()), default=0)
        while self._file is None:
            part += 1
            metadata = {
                "robot": self._robot,
                "axes": str(self._block.n),
                "session": session,
                "part": str(part),
                "start_realtime_ns": str(self._wall.start_ns),
                "start_monotonic_ns": str(self._wall.start_monotonic_ns),
                "version": version("cdpr-rt"),
            }
            self._path = self._folder / f"{session}-{part:03d}.mcap"
            with suppress(NameTakenError):  # a daemon that began in the same second was faster
                self._file = RecordingFile(self._path, self._context, metadata)
        self._seen.clear()

    def _sync(self) -> None:
        file = self._file
        if file is None:
            return
        file.sync()
        self._block.counters["recorded"][0] = self._reader.next
        if not file.is_there:
            raise RecordingError(f"{file.path}: recording ended: the file has been removed")
        free, size = file.free_space()
        least = reserve_of(size) if self._reserve_bytes is None else self._reserve_bytes
        if free < least:
            raise RecordingError(
                f"{self._folder}: recording ended: {size_text(free)} free, less than the "
                f"{size_text(least)} that are left to others"
            )
        if file.size >= self._most_bytes:
            self._close()
            self._open()

    def _close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._block.counters["recorded"][0] = self._reader.next
            self._bytes += self._file.size
            self._file = None

    def _take(self) -> None:
        """Log what has come since the last time."""
        self._take_text("description", self._description, self._block.description)
        self._take_text("status", self._status, self._block.status)
        before = self._rows
        newest = int(self._block.counters["rows"][0])  # later ones wait, or there were no end of it
        while self._reader.next < newest:
            self._take_rows(self._reader.read(_MOST_ROWS))
        if self._rows == before and (event := self._events.of_state(self._told_status)):
            self._log_event(event, time.monotonic_ns())
        while self._remarks:
            self._log_event(*self._remarks.popleft())
        if self._reader.lost > self._told_lost:
            lost, self._told_lost = self._reader.lost - self._told_lost, self._reader.lost
            text = f"{lost} rows were overwritten before they could be recorded"
            self._log_event({"text": text, "lost_rows": lost}, time.monotonic_ns())

    def _take_text(self, name: str, channel: Channel, read: Callable[[], dict[str, Any]]) -> None:
        counter = int(self._block.counters[name][0])
        if counter in (0, self._seen.get(name)):
            return
        try:
            value = read()
        except SharedBlockError:
            return  # its writer ended in the middle of it; its end is told elsewhere
        is_new_file = name not in self._seen
        self._seen[name] = counter
        now_ns = time.monotonic_ns()
        if name == "description":
            channel.log(_text(value), log_time=self._wall(now_ns))
            self._events.describe(value)
            return
        lasting = _lasting(value)
        if is_new_file or lasting != self._told_status:
            channel.log(_text(lasting), log_time=self._wall(now_ns))
        self._told_status = lasting
        for event in self._events.of_status(value):
            self._log_event(event, now_ns)

    def _take_rows(self, rows: Row) -> None:
        log, log_timing = self._cycle.base.log, self._timing.base.log
        stamps = (rows["stamp_ns"] + self._wall.offset_ns).tolist()
        texts, timings = self._texts(rows), self._timing_texts(rows)
        for text, timing, stamp in zip(texts, timings, stamps, strict=True):
            log_timing(timing, stamp)  # first: a file cut short then has it for each of its rows
            log(text, stamp)
        self._rows += rows.size
        for event, stamp_ns in self._events.of_rows(rows):
            self._log_event(event, stamp_ns)

    def _log_event(self, event: dict[str, Any], stamp_ns: int) -> None:
        self._event.log(_text(event), log_time=self._wall(stamp_ns))


def reserve_of(disk_bytes: int) -> int:
    """Return what is left free of a disk of this size, for the others on it."""
    return min(_RESERVE_BYTES, disk_bytes // _RESERVE_PART)


def _lasting(status: dict[str, Any]) -> dict[str, Any]:
    """Return a status without values that are in rows, or differ by process and moment."""
    return {
        name: _lasting(value) if isinstance(value, dict) else value
        for name, value in status.items()
        if name not in _PASSING
    }


def _text(value: dict[str, Any]) -> bytes:
    """Return strict JSON, whatever the value holds."""
    return json.dumps(plain(value), default=str).encode()


class WallClock:
    """Turns CLOCK_MONOTONIC into the time of day, by one instant: a clock that is set later
    changes nothing."""

    def __init__(self, block: SharedBlock) -> None:
        self.start_ns = int(block.counters["start_realtime_ns"][0]) or time.time_ns()
        """The time of day at the beginning of the session."""
        monotonic_ns = int(block.counters["start_monotonic_ns"][0]) or time.monotonic_ns()
        self.start_monotonic_ns = monotonic_ns
        self.offset_ns = self.start_ns - monotonic_ns

    def __call__(self, stamp_ns: int) -> int:
        """Return the time of day in ns since 1970."""
        return stamp_ns + self.offset_ns
