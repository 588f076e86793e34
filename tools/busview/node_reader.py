"""Read objects of one node by raw SDO requests, watching for answers without a request."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import NamedTuple

from cdpr_drivers.canopen import sdo_frames as frames
from cdpr_drivers.canopen.sdo_abort import TIMED_OUT

_CIA_402 = 402
_TIMEOUT_S = 0.4
_ATTEMPTS = 2
_MOST_BYTES = 1024
SETTLE_S = 0.15
"""For how long a second node may still answer what a first one has answered."""

Object = tuple[int, int]
_NO_OBJECT = bytes(3)
FIRST: Object = (0x1000, 0)
ALWAYS: tuple[Object, ...] = (
    (0x1018, 1),
    (0x1018, 2),
    (0x1018, 3),
    (0x1018, 4),
    (0x1001, 0),
    (0x1008, 0),
    (0x1017, 0),
)
DRIVE: tuple[Object, ...] = ((0x6502, 0), (0x6041, 0), (0x6061, 0), (0x603F, 0))


@dataclass
class NodeInfo:
    """What one node id has shown of itself."""

    node_id: int
    nmt_state: int | None = None
    """Of its latest heartbeat."""
    heartbeats: int = 0
    answers: bool = False
    objects: dict[Object, bytes] = field(default_factory=dict)
    refused: dict[Object, int] = field(default_factory=dict)
    """Abort codes of objects it does not give."""
    repeated: set[str] = field(default_factory=set)
    """Objects whose value came more often than asked for: several nodes have this id."""
    differing: set[str] = field(default_factory=set)
    """Those of them that came with differing values."""

    def number(self, index: int, sub: int = 0) -> int | None:
        """Return an unsigned object, None where it was not given."""
        raw = self.objects.get((index, sub))
        return int.from_bytes(raw, "little") if raw else None

    def text(self, index: int) -> str | None:
        """Return a text object, None where it was not given."""
        raw = self.objects.get((index, 0))
        if raw is None:
            return None
        printed = raw.decode("ascii", "replace").rstrip("\0 ")
        return "".join(c if c.isprintable() else "?" for c in printed)  # no escapes to a terminal

    @property
    def is_drive(self) -> bool:
        """Whether its device type (1000h) is that of CiA 402."""
        return (self.number(0x1000) or 0) & 0xFFFF == _CIA_402


class _Request(NamedTuple):
    """What to send, and for how long to wait for its answer."""

    data: bytes
    wait_s: float


_Dialogue = Generator[_Request, bytes | None, None]
"""Gets the answer to each turn, None when the time was up."""


class NodeReader:
    """The objects of one node, read one after the other; `done` after the last."""

    def __init__(self, found: NodeInfo) -> None:
        self.found = found
        self.done = False
        self._dialogue = self._read_objects()
        self._deadline: float | None = None
        self._asked: Object | None = None
        """Whose answer, or next segment, is waited for."""
        self._toggle: int | None = None
        """Of the segment that is waited for; None while no value comes in segments."""
        self._requests: dict[Object, int] = {}
        self._answers: dict[Object, list[bytes]] = {}

    def due(self, now_s: float) -> bytes | None:
        """Return the SDO request to send now, if any."""
        if self._deadline is not None and now_s < self._deadline:
            return None
        return self._advance(None, now_s)

    def take(self, data: bytes, now_s: float) -> bytes | None:
        """Process an SDO answer of 8 bytes; return the request to send next, if any."""
        return self._advance(data, now_s) if self._is_awaited(data) else None

    def _advance(self, answer: bytes | None, now_s: float) -> bytes | None:
        if self.done:
            return None
        try:
            begun = self._deadline is not None
            turn = self._dialogue.send(answer) if begun else next(self._dialogue)
        except StopIteration:
            self.done = True
            self._asked = self._toggle = None
            return None
        self._deadline = now_s + turn.wait_s
        return turn.data

    # -- what is said, turn by turn

    def _read_objects(self) -> _Dialogue:
        yield from self._read(FIRST)
        if not self.found.answers:
            return
        for what in ALWAYS + (DRIVE if self.found.is_drive else ()):
            yield from self._read(what)

    def _read(self, what: Object) -> _Dialogue:
        """Read one object; what is missing in the end is neither given nor refused."""
        for _ in range(_ATTEMPTS):
            self._asked = what
            self._requests[what] = self._requests.get(what, 0) + 1
            answer = yield _Request(frames.upload_request(*what), _TIMEOUT_S)
            if answer is None:
                continue
            self.found.answers = True
            code, value = frames.abort_code(answer), frames.expedited(answer)
            if code is not None:
                self.found.refused[what] = code
            elif value is not None:
                self.found.objects[what] = value
            else:
                yield from self._read_segments(what)
            return

    def _read_segments(self, what: Object) -> _Dialogue:
        value = bytearray()
        toggle = 0
        while len(value) < _MOST_BYTES:
            self._toggle = toggle
            answer = yield _Request(frames.segment_request(toggle), _TIMEOUT_S)
            self._toggle = None
            if answer is None or frames.abort_code(answer) is not None:
                break
            part, last = frames.segment(answer)
            value += part
            toggle = 1 - toggle
            if last:
                self.found.objects[what] = bytes(value)
                return
        self._asked = None
        yield _Request(frames.abort_request(*what, TIMED_OUT), 0.0)

    # -- whose answers come

    def _is_awaited(self, data: bytes) -> bool:
        """Return whether an answer is the one waited for; note one without a request."""
        if any(frames.is_segment(data, 0, toggle) for toggle in (0, 1)):
            if self._toggle is not None and frames.is_segment(data, 0, self._toggle):
                return True
            self.found.repeated.add("segments")
            return False
        what = self._object_of(data)
        if what is None:
            return False
        if self._toggle is not None and frames.abort_code(data) is not None:
            return what == self._asked
        answers = self._answers.setdefault(what, [])
        answers.append(data)
        if len(answers) > self._requests[what]:
            name = f"{what[0]:04X}h:{what[1]}" if what[1] else f"{what[0]:04X}h"
            self.found.repeated.add(name)
            if len(set(answers)) > 1:
                self.found.differing.add(name)
        return what == self._asked and self._toggle is None

    def _object_of(self, data: bytes) -> Object | None:
        """Return the object that was asked for, to which this is the first answer or an abort."""
        if frames.aborts(data, _NO_OBJECT):
            return self._asked
        for what in self._requests:
            named = frames.multiplexer(*what)
            if frames.answers(data, named, frames.UPLOAD) or frames.aborts(data, named):
                return what
        return None
