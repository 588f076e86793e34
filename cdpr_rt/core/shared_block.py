"""The memory that the loop's process shares with others: rows out, commands in, without locks.

Each part has one writer. A counter next to it shows which data are complete: a reader that finds
the same counter before and after copying has a consistent copy. Neither side waits for the other.
"""

from __future__ import annotations

import fcntl
import json
import mmap
import os
import platform
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.core.cycle_row import Row, cycle_dtype
from cdpr_rt.errors import ControlError

MAGIC: Final = 0x63647072_72743033
MOST_AXES: Final = 16
# on other processors a reader may see a counter before the data that it counts
_IN_ORDER: Final = ("x86_64", "i686", "i386")
DESCRIPTION_BYTES: Final = 1 << 17
STATUS_BYTES: Final = 1 << 15
MESSAGE_BYTES: Final = 1 << 12
MESSAGES: Final = 64
URGENT_MESSAGES: Final = 16
SAMPLES: Final = 64
# if the file were shortened, every process that reads behind its end would be killed (SIGBUS)
_SEALS: Final = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL

PATH: Final = np.dtype([("name", "S32"), ("time_s", "<f8"), ("over", "<i8")])
"""A planned path, the time up to which the platform has followed it, and whether it is finished."""
_COUNTERS: Final = np.dtype(
    [
        ("magic", "<u8"),
        ("axes", "<u8"),
        ("capacity", "<u8"),
        ("loop_pid", "<i8"),
        ("service_pid", "<i8"),
        ("procedure_pid", "<i8"),  # process that the service runs on the loop's buses, or 0
        ("start_monotonic_ns", "<i8"),  # the same instant on both clocks, read once
        ("start_realtime_ns", "<i8"),
        ("loop_alive_ns", "<i8"),  # CLOCK_MONOTONIC of the loop's last turn, cycling or not
        ("service_alive_ns", "<i8"),  # time of the service's last turn, 0 before the first
        ("right_number", "<u8"),  # grows with every grant of the right to move
        ("right_until_ns", "<i8"),  # expiry of the newest grant, 0 if it has ended
        ("mover", "<u8"),  # number of the grant under which the loop moves, 0 for none
        ("rows", "<u8"),  # rows written since the beginning
        ("recorded", "<u8"),  # rows that are safe in the recording
        ("description", "<u8"),  # versions of the texts; odd while one is being written
        ("status", "<u8"),
        ("commands", "<u8"),  # messages written since the beginning, and messages taken
        ("commands_taken", "<u8"),
        ("stops_requested", "<u8"),  # stops that came to the service, and to the loop's own socket
        ("stops_taken", "<u8"),
        ("urgent", "<u8"),  # stops: read before commands
        ("urgent_taken", "<u8"),
        ("replies", "<u8"),
        ("replies_taken", "<u8"),
        ("samples", "<u8"),
        ("path", PATH),  # written by the loop
    ]
)
SAMPLE: Final = np.dtype(
    [
        ("sequence", "<u8"),
        ("sent_ns", "<i8"),  # the sender's clock
        ("arrived_ns", "<i8"),  # CLOCK_MONOTONIC
        ("position_m", "<f8", (3,)),
        ("quaternion", "<f8", (4,)),  # w x y z, of length 1
        ("scale", "<f8"),
        ("buttons", "<u4"),
        ("session", "<u4"),
        (
            "right",
            "<u8",
        ),  # number of the grant of the right to move under which the sample was sent
    ]
)
"""One sample of the set-point stream; `sequence` only grows within a session."""


class SharedBlockError(ControlError):
    """The shared memory has a wrong format, or a text does not fit into it."""


class SharedBlock:
    """All parts as arrays over one file descriptor, which `create` makes and `attach` maps.

    Child processes inherit the descriptor. When the last process has ended, the memory is freed.
    With a descriptor that was opened for reading only, the arrays are read-only.
    """

    def __init__(self, fd: int, n: int, capacity: int, *, private: bool = False) -> None:
        self.fd = fd
        self.n = n
        self.capacity = capacity
        """Number of rows kept; a reader that is further behind has lost rows."""
        sizes = _sizes(n, capacity)
        reads_only = fcntl.fcntl(fd, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY
        access = mmap.ACCESS_READ if reads_only else mmap.ACCESS_WRITE
        if private:
            access = mmap.ACCESS_COPY
        self._map = mmap.mmap(fd, sum(sizes), access=access)
        views, first = [], 0
        for size in sizes:
            views.append(np.frombuffer(self._map, np.uint8, size, first))
            first += size
        self.counters: Row = views[0][: _COUNTERS.itemsize].view(_COUNTERS)
        """One row of counters, such as `counters["rows"][0]`."""
        self._description, self._status = views[1], views[2]
        self._commands = views[3].reshape(MESSAGES, MESSAGE_BYTES)
        self._urgent = views[4].reshape(URGENT_MESSAGES, MESSAGE_BYTES)
        self._replies = views[5].reshape(MESSAGES, MESSAGE_BYTES)
        self.samples: Row = views[6].view(SAMPLE)
        self.rows: Row = views[7].view(cycle_dtype(n))

    @classmethod
    def create(
        cls, n: int, seconds: float, rate_Hz: float, *, private: bool = False
    ) -> SharedBlock:
        """Make a block for n axes whose ring holds `seconds` of cycles at `rate_Hz`.

        With `private`, only this process sees the data, and a fork of it has a copy. Raises
        SharedBlockError if there are more axes than a loop can run.
        """
        if not 1 <= n <= MOST_AXES:
            raise SharedBlockError(f"{n} axes; allowed: 1 to {MOST_AXES}")
        capacity = max(256, round(seconds * rate_Hz))
        fd = os.memfd_create("cdpr-rt", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        os.set_inheritable(fd, True)
        os.ftruncate(fd, sum(_sizes(n, capacity)))
        fcntl.fcntl(fd, fcntl.F_ADD_SEALS, _SEALS)
        block = cls(fd, n, capacity, private=private)
        block.counters["axes"], block.counters["capacity"] = n, capacity
        block.counters["magic"] = MAGIC
        return block

    @classmethod
    def attach(cls, fd: int) -> SharedBlock:
        """Map the block of an inherited descriptor; raises SharedBlockError.

        It also raises SharedBlockError on a processor on which other processes may see stores out
        of order.
        """
        if (machine := platform.machine()) not in _IN_ORDER:
            raise SharedBlockError(
                f"this machine's processor is {machine}; allowed: {', '.join(_IN_ORDER)}, because "
                "the processes share memory without a lock and need stores to be visible in order"
            )
        size = os.fstat(fd).st_size
        if size < _COUNTERS.itemsize:
            raise SharedBlockError("the shared memory is empty")
        try:
            sealed = fcntl.fcntl(fd, fcntl.F_GET_SEALS) & _SEALS == _SEALS
        except OSError:  # the file cannot be sealed
            sealed = False
        if not sealed:
            raise SharedBlockError("the shared memory can be resized by others")
        with mmap.mmap(fd, _COUNTERS.itemsize, prot=mmap.PROT_READ) as head:
            row = np.frombuffer(bytes(head), _COUNTERS)[0]
        if row["magic"] != MAGIC:
            raise SharedBlockError("the shared memory was made by another version")
        n, capacity = int(row["axes"]), int(row["capacity"])
        if not 1 <= n <= MOST_AXES or sum(_sizes(n, capacity)) != size:
            raise SharedBlockError(
                f"the shared memory has {size} bytes, which does not fit {n} axes"
            )
        return cls(fd, n, capacity)

    # -- texts: the loop writes, others read

    def write_description(self, value: Mapping[str, Any]) -> None:
        """Publish data that do not change after a boot: the robot, its axes, limits, programs."""
        self._write_text("description", self._description, value)

    def write_status(self, value: Mapping[str, Any]) -> None:
        """Publish data that change occasionally: state, program, reasons, notices."""
        self._write_text("status", self._status, value)

    def description(self) -> dict[str, Any]:
        """Return the last published description, an empty table before the first."""
        return self._read_text("description", self._description)

    def status(self) -> dict[str, Any]:
        """Return the last published status, an empty table before the first."""
        return self._read_text("status", self._status)

    def _write_text(self, name: str, area: NDArray[np.uint8], value: Mapping[str, Any]) -> None:
        data = json.dumps(value).encode()
        if len(data) + 8 > area.size:
            raise SharedBlockError(f"{name}: {len(data)} bytes, {area.size - 8} allowed")
        counter = self.counters[name]
        version = int(counter[0]) // 2 * 2
        counter[0] = version + 1
        area[:8].view("<u8")[0] = len(data)
        area[8 : 8 + len(data)] = np.frombuffer(data, np.uint8)
        counter[0] = version + 2

    def _read_text(self, name: str, area: NDArray[np.uint8]) -> dict[str, Any]:
        counter = self.counters[name]
        for _ in range(1000):
            before = int(counter[0])
            if before == 0:
                return {}
            size = min(int(area[:8].view("<u8")[0]), area.size - 8)
            data = area[8 : 8 + size].tobytes()
            if before % 2 == 0 and int(counter[0]) == before:
                value: dict[str, Any] = json.loads(data)
                return value
        raise SharedBlockError(f"{name}: its writer ended while writing")

    # -- messages: commands to the loop, replies from it

    @property
    def stops(self) -> int:
        """The number of stops so far; no command from before the last one may start motion."""
        return int(self.counters["stops_requested"][0]) + int(self.counters["stops_taken"][0])

    def count_stop(self) -> None:
        """Prevent all commands requested so far from starting motion; for the service."""
        self.counters["stops_requested"][0] += 1

    def post_command(self, value: Mapping[str, Any]) -> int:
        """Queue a command; return its number, which its reply repeats. Raises SharedBlockError.

        Its `stops` is the number of stops when it was requested, by default the present one.
        """
        return self._post("commands", self._commands, {"stops": self.stops, **value})

    def take_command(self) -> dict[str, Any] | None:
        """Return the next command, or None."""
        return self._take("commands", self._commands)

    def post_urgent(self, value: Mapping[str, Any]) -> int:
        """Queue a stop, in a separate queue from commands; return its number, which is negative.

        Raises SharedBlockError.
        """
        return self._post("urgent", self._urgent, value, sign=-1)

    def take_urgent(self) -> dict[str, Any] | None:
        """Return the next stop, or None; its number is negative."""
        return self._take("urgent", self._urgent)

    def post_reply(self, value: Mapping[str, Any]) -> int:
        """Queue a reply. Raises SharedBlockError if no process takes replies."""
        return self._post("replies", self._replies, value)

    def take_reply(self) -> dict[str, Any] | None:
        """Return the next reply, or None."""
        return self._take("replies", self._replies)

    def _post(
        self, name: str, slots: NDArray[np.uint8], value: Mapping[str, Any], sign: int = 1
    ) -> int:
        written, taken = int(self.counters[name][0]), int(self.counters[f"{name}_taken"][0])
        if written - taken >= len(slots):
            raise SharedBlockError(f"{name}: {len(slots)} messages are already waiting")
        number = sign * (written + 1)
        data = json.dumps({**value, "number": number}).encode()
        slot = slots[written % len(slots)]
        if len(data) + 8 > slot.size:
            raise SharedBlockError(f"{name}: {len(data)} bytes, {slot.size - 8} allowed")
        slot[:8].view("<u8")[0] = len(data)
        slot[8 : 8 + len(data)] = np.frombuffer(data, np.uint8)
        self.counters[name][0] = written + 1
        return number

    def _take(self, name: str, slots: NDArray[np.uint8]) -> dict[str, Any] | None:
        written, taken = int(self.counters[name][0]), int(self.counters[f"{name}_taken"][0])
        if taken >= written:
            return None
        slot = slots[taken % len(slots)]
        size = min(int(slot[:8].view("<u8")[0]), slot.size - 8)
        value: dict[str, Any] = json.loads(slot[8 : 8 + size].tobytes())
        self.counters[f"{name}_taken"][0] = taken + 1
        return value

    # -- samples of the set-point stream: the service writes, the loop reads

    def post_sample(self, sample: Row) -> None:
        """Append one sample, a scalar of type `SAMPLE`; the oldest is overwritten."""
        written = int(self.counters["samples"][0])
        self.samples[written % SAMPLES] = sample
        self.counters["samples"][0] = written + 1


class RowReader:
    """Reads new rows from the ring; any number of readers may do so, each at its own pace."""

    def __init__(self, block: SharedBlock) -> None:
        self._block = block
        self.next = int(block.counters["rows"][0])
        """Number of the next row to read."""
        self.lost = 0
        """Rows that were overwritten before they were read."""

    def read(self, most: int = 1 << 30) -> Row:
        """Return a copy of the new rows, oldest first, at most `most`; it may be empty."""
        block = self._block
        capacity = block.capacity
        head = int(block.counters["rows"][0])
        oldest = head - capacity
        if oldest > self.next:
            self.lost += oldest - self.next
            self.next = oldest
        last = min(head, self.next + most)
        numbers = np.arange(self.next, last, dtype=np.int64) % capacity
        rows = block.rows[numbers]
        # the writer may have overtaken the copy, and may be writing one row
        overwritten = int(block.counters["rows"][0]) - capacity + 1
        stale = min(max(0, overwritten - self.next), rows.size)
        self.lost += stale
        self.next = last
        return rows[stale:]


class RowWriter:
    """Writes rows into the ring; never waits for a reader, and overwrites the oldest."""

    def __init__(self, block: SharedBlock) -> None:
        self._rows = block.rows
        self._counter = block.counters["rows"].data
        self._capacity = block.capacity
        self._written = int(self._counter[0])

    def slot(self) -> Row:
        """Return the row to fill for this cycle, of shape (1,), a view."""
        k = self._written % self._capacity
        return self._rows[k : k + 1]

    def commit(self) -> None:
        """Make the filled row visible."""
        self._written += 1
        self._counter[0] = self._written


def _sizes(n: int, capacity: int) -> tuple[int, ...]:
    sizes = (
        _COUNTERS.itemsize,
        DESCRIPTION_BYTES,
        STATUS_BYTES,
        MESSAGES * MESSAGE_BYTES,
        URGENT_MESSAGES * MESSAGE_BYTES,
        MESSAGES * MESSAGE_BYTES,
        SAMPLES * SAMPLE.itemsize,
        capacity * cycle_dtype(n).itemsize,
    )
    return tuple(size + -size % 64 for size in sizes[:-1]) + sizes[-1:]
