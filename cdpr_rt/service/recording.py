"""Records every cycle that the loop publishes, in a separate thread of the service process."""

from __future__ import annotations

import json
import re
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from enum import IntEnum
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np
from foxglove import Channel, Context
from numpy.typing import NDArray

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import Row, cycle_dtype
from cdpr_rt.core.shared_block import RowReader, SharedBlock
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.errors import ControlError
from cdpr_rt.jit import jit
from cdpr_rt.motion.pose_stream import confirmation
from cdpr_rt.service import recording_file as topics
from cdpr_rt.service.part import Part
from cdpr_rt.service.recording_file import NameTakenError, RecordingError, RecordingFile
from cdpr_rt.service.retention import Retention, size_text
from cdpr_rt.service.rows import PublishedText, WallClock, plain

# Rows of cycles as JSON texts, fast enough for every cycle of a robot with sixteen axes.

_FLOAT, _INTEGER, _BOOLEAN, _NOTHING = 0, 1, 2, 3
_KINDS: Final = {"f": _FLOAT, "i": _INTEGER, "u": _INTEGER, "b": _BOOLEAN}
_MOST_CHARS: Final = 26
"""Longest text of one value: sign, 19 digits, point and exponent of a float64."""
_BATCH: Final = 256

Bytes = NDArray[np.uint8]
Numbers = NDArray[np.int64]


class RowTexts:
    """Converts the fields `names` of each row for n axes into a JSON object, in this order.

    Numbers are rounded to 1e-9 of their unit; values that are not finite become null.
    """

    def __init__(self, n: int, names: Sequence[str]) -> None:
        self._fields: list[tuple[str, bool, slice]] = []
        used = {True: 0, False: 0}
        literals: list[str] = []
        kinds: list[int] = []
        columns: list[int] = []
        dtype = cycle_dtype(n)
        before = "{"
        for name in names:
            kind = _KINDS[dtype[name].base.kind]
            shape = dtype[name].shape
            width = shape[0] if shape else 1
            first = used[kind == _FLOAT]
            used[kind == _FLOAT] += width
            self._fields.append((name, kind == _FLOAT, slice(first, first + width)))
            literals += [f'{before}"{name}":{"[" if shape else ""}', *[","] * (width - 1)]
            kinds += [kind] * width
            columns += range(first, first + width)
            before = "]," if shape else ","
        literals.append(before.replace(",", "}"))
        self._literals = np.frombuffer("".join(literals).encode(), np.uint8)
        self._literal_ends = np.cumsum([len(text) for text in literals], dtype=np.int64)
        self._kinds = np.array([*kinds, _NOTHING], np.uint8)
        self._columns = np.array([*columns, 0], np.int64)
        self._floats = np.empty((_BATCH, used[True]))
        self._integers = np.empty((_BATCH, used[False]), np.int64)
        self._text = np.empty(_BATCH * (self._literals.size + _MOST_CHARS * len(kinds)), np.uint8)
        self._ends = np.empty(_BATCH, np.int64)
        self(np.zeros(1, dtype))  # compiles the kernel before rows arrive

    def __call__(self, rows: Row) -> list[bytes]:
        """Return the text of each of `rows` (m,)."""
        texts: list[bytes] = []
        for first in range(0, rows.size, _BATCH):
            texts += self._batch(rows[first : first + _BATCH])
        return texts

    def _batch(self, rows: Row) -> list[bytes]:
        m = rows.size
        for name, is_float, columns in self._fields:
            values = self._floats if is_float else self._integers
            values[:m, columns] = rows[name].reshape(m, -1)
        size = _write(
            self._literals, self._literal_ends, self._kinds, self._columns, self._floats[:m],
            self._integers[:m], self._text, self._ends,
        )  # fmt: skip
        text = self._text[:size].tobytes()
        ends = self._ends[:m].tolist()
        return [text[a:b] for a, b in zip([0, *ends[:-1]], ends, strict=True)]


@jit
def _write_integer(out: Bytes, at: int, value: int) -> int:
    """Write a number that is not negative; return the position after it."""
    digits = 1
    power = 10
    while digits < 19 and value >= power:
        digits += 1
        power *= 10
    rest = value
    for k in range(digits - 1, -1, -1):
        out[at + k] = 48 + rest % 10
        rest //= 10
    return at + digits


@jit
def _write_float(out: Bytes, at: int, value: float) -> int:
    """Write a number to nine places, without trailing zeros; return the position after it."""
    if not np.isfinite(value):
        for code in (110, 117, 108, 108):  # null
            out[at] = code
            at += 1
        return at
    size = min(abs(value), 1e308)  # rounding of the last digit must not make the value infinite
    exponent = 0
    while size >= 9e9:  # a larger value, in billionths, would not fit into 64 bits
        size /= 10.0
        exponent += 1
    billionths = int(size * 1e9 + 0.5)
    if value < 0.0 and billionths > 0:
        out[at] = 45  # -
        at += 1
    at = _write_integer(out, at, billionths // 1_000_000_000)
    fraction = billionths % 1_000_000_000
    if fraction > 0:
        out[at] = 46  # .
        places = 9
        while fraction % 10 == 0:
            fraction //= 10
            places -= 1
        for k in range(places, 0, -1):
            out[at + k] = 48 + fraction % 10
            fraction //= 10
        at += places + 1
    if exponent > 0:
        out[at] = 101  # e
        at = _write_integer(out, at + 1, exponent)
    return at


@jit
def _write(
    literals: Bytes,
    literal_ends: Numbers,
    kinds: Bytes,
    columns: Numbers,
    floats: FloatArray,
    integers: Numbers,
    out: Bytes,
    ends: Numbers,
) -> int:
    """Write the text of each row of `floats` and `integers`; return the position after the last.

    A text is a sequence of literals, each followed by the value of one column, or by nothing.
    """
    at = 0
    for row in range(floats.shape[0]):
        literal = 0
        for k in range(kinds.size):
            while literal < literal_ends[k]:
                out[at] = literals[literal]
                at += 1
                literal += 1
            kind, column = kinds[k], columns[k]
            if kind == _FLOAT:
                at = _write_float(out, at, floats[row, column])
            elif kind == _INTEGER:
                value = integers[row, column]
                if value < 0:
                    out[at] = 45
                    at += 1
                at = _write_integer(out, at, abs(value))
            elif kind == _BOOLEAN:
                is_true = integers[row, column] != 0
                word = (116, 114, 117, 101, 32) if is_true else (102, 97, 108, 115, 101)
                for j in range(4 if is_true else 5):
                    out[at] = word[j]
                    at += 1
        ends[row] = at
    return at


# Events as text, found in recorded rows.

FAILURE: Final = "failure"
"""Kind of the event of a failed program; its text begins with the name of the program."""
_WATCHED = ("state", "program", "reaction", "limit", "limit_axis", "stream_buttons")


class EventDetector:
    """Finds events: changes of state, program, reaction and confirmations in rows.

    A status adds the reason of a stop and failed programs.

    Clamping is not an event, because it may begin and end in every cycle.
    """

    def __init__(self) -> None:
        self._programs: list[str] = []
        self._axes: list[str] = []
        self._last: tuple[int, ...] | None = None
        self._label = ""
        self._reason = self._failure = ""

    def describe(self, description: dict[str, Any]) -> None:
        """Take the names of programs and axes."""
        self._programs = list(description.get("programs", []))
        self._axes = [axis.get("name", "") for axis in description.get("axes", [])]

    def of_status(self, status: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the events of the failure and the reason in `status`, if they are new."""
        reason, self._reason = self._reason, str(status.get("reason") or "")
        failure, self._failure = self._failure, str(status.get("failure") or "")
        events: list[dict[str, Any]] = []
        if self._failure not in ("", failure):
            events.append({"text": self._failure, "kind": FAILURE})
        if self._reason not in ("", reason):
            events.append({"text": self._reason, "limit": status.get("reason_limit")})
        return events

    def of_state(self, status: dict[str, Any]) -> dict[str, Any] | None:
        """Return a change of state that only `status` shows; call it while no cycles run."""
        label = str(status.get("state") or "")
        if label in ("", self._label):
            return None
        self._label = label
        number = LoopState[label.upper()].value if label.upper() in LoopState.__members__ else -1
        self._last = (number, *(self._last or (0,) * len(_WATCHED))[1:])
        return {"text": f"state {label}"}

    def of_rows(self, rows: Row) -> list[tuple[dict[str, Any], int]]:
        """Return the changes within `rows` (m,), and since the previous rows, with stamps."""
        if not rows.size:
            return []
        seen = np.stack([rows[name].astype(np.int64) for name in _WATCHED], axis=1)
        seen[seen[:, 2] <= Reaction.CLAMP, 2:5] = 0
        seen[:, 5] = confirmation(seen[:, 5])
        last = self._last if self._last is not None else (-1, *seen[0, 1:])
        before = np.vstack([np.array(last), seen[:-1]])
        self._last = tuple(int(value) for value in seen[-1])
        self._label = _label(LoopState, self._last[0])
        events = []
        for k in np.flatnonzero((seen != before).any(axis=1)):
            words = self._words(before[k].tolist(), seen[k].tolist())
            if not words:
                continue  # the state after a reaction shows that the reaction has ended
            event = {
                "text": words,
                "cycle": int(rows["cycle"][k]),
                "time_s": float(rows["time_s"][k]),
                **{name: int(rows[name][k]) for name in _WATCHED},
            }
            events.append((event, int(rows["stamp_ns"][k])))
        return events

    def _words(self, before: list[int], now: list[int]) -> str:
        words = []
        if now[0] != before[0]:
            words.append(f"state {_label(LoopState, now[0])}")
        if now[1] != before[1]:
            words.append(f"program {_name(self._programs, now[1])}")
        if now[2] and now[2:5] != before[2:5]:
            words.append(_label(Reaction, now[2]))
            if now[3]:
                axis = f" of {_name(self._axes, now[4])}" if now[4] >= 0 else ""
                words[-1] += f" by {_label(Limit, now[3])}{axis}"
        if now[5] and now[5] != before[5]:
            words.append(f"the operator confirmed target number {now[5]}")
        return ", ".join(words)


def _label(kind: type[IntEnum], value: int) -> str:
    return kind(value).name.lower().replace("_", " ") if value in list(kind) else str(value)


def _name(names: list[str], number: int) -> str:
    return names[number] if number < len(names) else str(number)


MOST_BYTES: Final = 1 << 30
_RESERVE_BYTES: Final = 64 << 20
_RESERVE_PART: Final = 20
_INTERVAL_S: Final = 0.1
_SYNC_S: Final = 0.4
"""With this interval and a disk of normal speed, at most the last second is lost."""
_MOST_ROWS: Final = 4096
_MOST_REMARKS: Final = 1000
_PASSING: Final = ("since_ns", "count", "slowest_exchange_s", "url")


class Recorder(Part):
    """Writes rows, status, description and events of a block into MCAP files in `folder`.

    A file is named ROBOT-DATE-NNN.mcap; a session keeps its date, and the next file begins when one
    has `most_bytes`. Before each file, recordings beyond `retention` are removed. If the disk
    fails, or has less than `reserve_bytes` left (by default 64 MB, or a twentieth of a small disk),
    the recording ends permanently. `status` then gives the reason, `ended` is called with it, and
    the rest of the service continues. A later recorder for the same block continues at the first
    row that was not yet safe on the disk. The recorder has its own thread between `start` and
    `stop`. If recordings must not depend on another clock than the loop's, call `begin`, `look` and
    `finish` instead.
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
        self._robot = file_name_of(robot)
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
        self._published = {name: PublishedText(block, name) for name in ("description", "status")}
        self._is_new_file = True
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
        """Record all rows and texts that are new since the last call."""
        if self._error:
            return
        with self._failing():
            self._take()
            if time.monotonic() - self._synced_s >= _SYNC_S:
                self._synced_s = time.monotonic()
                self._sync()

    def finish(self) -> None:
        """Record the rest and close the file."""
        if self._error:
            return
        with self._failing():
            self._take()
            self._close()

    def remark(self, text: str, **values: Any) -> None:
        """Add a text to the events, with JSON values; any thread may call this."""
        self._remarks.append(({"text": text, **values}, time.monotonic_ns()))

    def status(self) -> dict[str, Any]:
        """Return the status: `recording`, `file`, `rows`, `lost_rows`, `bytes`, `error`.

        `file_bytes` of the file are complete on the disk.
        """
        file = self._file
        path = self._path if file is None else file.path
        return {
            "recording": file is not None,
            "file": str(path) if path else None,
            "file_bytes": file.size if file else 0,
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
        """End the recording if something fails."""
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
            with suppress(
                NameTakenError
            ):  # another daemon began in the same second and took the name
                self._file = RecordingFile(self._path, self._context, metadata)
        self._is_new_file = True

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
                f"{size_text(least)} reserved for other uses"
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
        """Log all rows and texts that are new since the last call."""
        self._take_texts()
        before = self._rows
        newest = int(
            self._block.counters["rows"][0]
        )  # later rows wait for the next call; otherwise this loop might never end
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

    def _take_texts(self) -> None:
        now_ns, is_new_file = time.monotonic_ns(), self._is_new_file
        self._is_new_file = False
        description, status = self._published["description"], self._published["status"]
        if (description.update() or is_new_file) and description.value:
            self._description.log(_text(description.value), log_time=self._wall(now_ns))
            self._events.describe(description.value)
        if not (status.update() or is_new_file) or not status.value:
            return
        lasting = _lasting(status.value)
        if is_new_file or lasting != self._told_status:
            self._status.log(_text(lasting), log_time=self._wall(now_ns))
        self._told_status = lasting
        for event in self._events.of_status(status.value):
            self._log_event(event, now_ns)

    def _take_rows(self, rows: Row) -> None:
        log, log_timing = self._cycle.base.log, self._timing.base.log
        stamps = (rows["stamp_ns"] + self._wall.offset_ns).tolist()
        texts, timings = self._texts(rows), self._timing_texts(rows)
        for text, timing, stamp in zip(texts, timings, stamps, strict=True):
            log_timing(
                timing, stamp
            )  # written first, so that even a truncated file has the timing of each row
            log(text, stamp)
        self._rows += rows.size
        for event, stamp_ns in self._events.of_rows(rows):
            self._log_event(event, stamp_ns)

    def _log_event(self, event: dict[str, Any], stamp_ns: int) -> None:
        self._event.log(_text(event), log_time=self._wall(stamp_ns))


def file_name_of(robot: str) -> str:
    """Return how the names of a robot's recordings begin."""
    return re.sub(r"[^\w.-]", "_", robot)


def reserve_of(disk_bytes: int) -> int:
    """Return the space to leave free on a disk of this size for other programs."""
    return min(_RESERVE_BYTES, disk_bytes // _RESERVE_PART)


def _lasting(status: dict[str, Any]) -> dict[str, Any]:
    """Return a status without values that rows contain, or that depend on process and time."""
    return {
        name: _lasting(value) if isinstance(value, dict) else value
        for name, value in status.items()
        if name not in _PASSING
    }


def _text(value: dict[str, Any]) -> bytes:
    """Return the value as strict JSON, whatever it contains."""
    return json.dumps(plain(value), default=str).encode()
