"""SDO client of one node (CiA 301): one transfer at a time, which can be cancelled."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, NoReturn

from cdpr_drivers.errors import BusError, SdoAbortError, SdoCancelledError, SdoTimeoutError
from cdpr_rt.core.clock import Clock, TaskCancelled

# Frames of SDO transfers (CiA 301), built and matched by a client; no waiting.

REQUEST: Final = 0x600
ANSWER: Final = 0x580
"""Base identifiers of requests and answers, to which the node id is added."""
UPLOAD, DOWNLOAD = 2, 3
"""Meaning of the top three bits of an answer to the first request."""

ABORT: Final = 0x80
"""First byte of a frame that ends a transfer."""
# abort codes
TIMED_OUT: Final = 0x05040000
OUT_OF_MEMORY: Final = 0x05040005
LENGTH: Final = 0x06070010
NO_SUBINDEX: Final = 0x06090011
GENERAL: Final = 0x08000000
NO_DATA: Final = 0x08000024
ABSENT: Final = (0x06020000, NO_SUBINDEX, NO_DATA)
"""Codes by which a node reports that the object does not exist or is empty."""

_FIRST = struct.Struct("<BHB4s")


def multiplexer(index: int, sub: int) -> bytes:
    """Return the 3 bytes that identify an object in frames."""
    return struct.pack("<HB", index, sub)


def request_frame(command: int, index: int, sub: int, data: bytes = b"") -> bytes:
    """Return the first request of a transfer; `data` are the last 4 bytes, padded with zeros."""
    return _FIRST.pack(command, index, sub, data)


def upload_request(index: int, sub: int) -> bytes:
    """Return the request for an object's value."""
    return request_frame(0x40, index, sub)


def answers(frame: bytes, what: bytes, *kinds: int) -> bool:
    """Return whether a frame answers the first request for the object of this multiplexer."""
    return len(frame) == 8 and frame[0] >> 5 in kinds and frame[1:4] == what


def abort_code(frame: bytes) -> int | None:
    """Return the code of a frame that aborts a transfer; None for any other frame."""
    return int.from_bytes(frame[4:8], "little") if frame[0] == ABORT else None


def expedited(frame: bytes) -> bytes | None:
    """Return the value in the answer to an upload request; None if it is sent in segments."""
    if not frame[0] & 0x02:
        return None
    return frame[4 : 8 - (frame[0] >> 2 & 0x03) if frame[0] & 0x01 else 8]


def segment(frame: bytes) -> tuple[bytes, bool]:
    """Return the data of a segment, and whether it is the last."""
    return frame[1 : 8 - (frame[0] >> 1 & 0x07)], bool(frame[0] & 0x01)


Send = Callable[[bytes], None]
Accept = Callable[[bytes], bool]

_MOST_WAITING = 1024
"""Maximum number of frames kept for a transfer, so that a flood cannot fill the memory."""
_MOST_BYTES = 1 << 18
"""Size at which an endless upload is aborted."""


class SdoClient:
    """Transfers to and from one node; `send` puts a request of 8 bytes on the bus.

    If several tasks transfer, each waits until the previous transfer has ended.

    An answer without a request (a duplicate, another client's, a second device's) is
    discarded and counted. Uploads and downloads raise SdoAbortError, SdoTimeoutError,
    SdoCancelledError and BusError, all without naming node and object.
    """

    def __init__(self, send: Send, clock: Clock, most_bytes: int = _MOST_BYTES) -> None:
        """Give an upload up after `most_bytes`."""
        self._most_bytes = most_bytes
        self.unexpected = 0
        """Number of answers without a request, since it was set to 0 or a request timed out."""
        self._send = send
        self._clock = clock
        self._answers: deque[bytes] = deque()
        self._busy = self._cancelled = False
        self._lost: BusError | None = None
        self._object = (0, 0)
        self._multiplexer = bytes(3)
        self._timeout_s = 0.0

    def on_answer(self, data: bytes) -> None:
        """Process an answer of 8 bytes from the bus."""
        if len(self._answers) < _MOST_WAITING:
            self._answers.append(data)

    def await_unexpected(self, seconds: float) -> int:
        """Wait for more unexpected answers; return their number."""
        with self._exclusive():
            self._clock.wait(lambda: self._lost, self._clock.now_s + seconds)
            self._discard_unexpected()
            return self.unexpected

    def cancel(self) -> bool:
        """End the running transfer with SdoCancelledError; return whether one runs.

        The node gets an abort (08000000h).
        """
        self._cancelled = self._busy
        return self._busy

    def fail(self, error: BusError) -> None:
        """End transfers immediately, now and later, because the bus is gone."""
        self._lost = error

    def upload(self, index: int, sub: int, timeout_s: float) -> bytes:
        """Return the data of an object; `timeout_s` applies to each answer."""
        with self._transfer(index, sub, timeout_s):
            answer = self._initiate(0x40, bytes(4), UPLOAD)
            value = expedited(answer)
            if value is not None:
                return value
            size = int.from_bytes(answer[4:8], "little") if answer[0] & 0x01 else None
            data = bytearray()
            toggle = 0
            for _ in range(self._most_bytes // 7):
                frame = self._ask(bytes([0x60 | toggle << 4]), _segment(0, toggle))
                part, last = segment(frame)
                data += part
                if size is not None and (len(data) > size or (last and len(data) < size)):
                    self._abort(LENGTH)
                if last:
                    return bytes(data)
                toggle ^= 1
            return self._abort(OUT_OF_MEMORY)

    def download(self, index: int, sub: int, data: bytes, timeout_s: float) -> None:
        """Write the data of an object, expedited up to 4 bytes, else in segments."""
        with self._transfer(index, sub, timeout_s):
            if 0 < len(data) <= 4:
                command = 0x23 | (4 - len(data)) << 2
                self._initiate(command, data, DOWNLOAD)
                return
            size = len(data).to_bytes(4, "little")
            self._initiate(0x21, size, DOWNLOAD)
            toggle = 0
            for start in range(0, max(len(data), 1), 7):
                part = data[start : start + 7]
                last = start + 7 >= len(data)
                command = toggle << 4 | (7 - len(part)) << 1 | last
                self._ask(bytes([command]) + part, _segment(1, toggle))
                toggle ^= 1

    # -- requests and answers

    @contextmanager
    def _exclusive(self) -> Iterator[None]:
        self._clock.wait(lambda: not self._busy)
        self._busy, self._cancelled = True, False
        try:
            yield
        finally:
            self._busy = False

    @contextmanager
    def _transfer(self, index: int, sub: int, timeout_s: float) -> Iterator[None]:
        with self._exclusive():
            self._object, self._multiplexer = (index, sub), multiplexer(index, sub)
            self._timeout_s = timeout_s
            try:
                yield
            except TaskCancelled:
                self._send_abort(GENERAL)
                raise

    def _initiate(self, command: int, data: bytes, *kinds: int) -> bytes:
        request = request_frame(command, *self._object, data)
        return self._ask(request, lambda frame: answers(frame, self._multiplexer, *kinds))

    def _ask(self, request: bytes, accept: Accept) -> bytes:
        self._clock.poll()
        self._discard_unexpected()
        self._request(request)
        deadline = self._clock.now_s + self._timeout_s
        others = 0
        while True:
            frame = self._next(deadline)
            if frame is None:
                self._time_out(others)
            elif accept(frame):
                return frame
            else:
                others += 1
                self.unexpected += 1

    def _discard_unexpected(self) -> None:
        self.unexpected += len(self._answers)
        self._answers.clear()

    def _request(self, request: bytes) -> None:
        self._raise_if_ended()
        self._send(request.ljust(8, b"\0"))

    def _next(self, deadline: float) -> bytes | None:
        """Return the next frame of the node, or None; raises the error that ends the transfer."""
        self._clock.wait(lambda: self._answers or self._cancelled or self._lost, deadline)
        self._raise_if_ended()
        if not self._answers:
            return None
        frame = self._answers.popleft()
        code = abort_code(frame)
        # some nodes leave out index and sub-index
        if code is not None and frame[1:4] in (self._multiplexer, bytes(3)):
            raise SdoAbortError(code)
        return frame

    def _raise_if_ended(self) -> None:
        if self._lost is not None:
            raise BusError(str(self._lost))
        if self._cancelled:
            self._send_abort(GENERAL)
            raise SdoCancelledError("the transfer was cancelled")

    def _time_out(self, others: int = 0) -> NoReturn:
        self._send_abort(TIMED_OUT)
        self.unexpected = 0  # the answer may still arrive: then it is late
        what = f" (frames that do not answer the request: {others})" if others else ""
        raise SdoTimeoutError(f"no answer within {self._timeout_s:g} s{what}")

    def _abort(self, code: int) -> NoReturn:
        """Abort the transfer; raises SdoAbortError."""
        self._send_abort(code)
        raise SdoAbortError(code)

    def _send_abort(self, code: int) -> None:
        self._send(request_frame(ABORT, *self._object, code.to_bytes(4, "little")))


def _segment(kind: int, toggle: int) -> Accept:
    """Accept a frame with this toggle bit: a segment (0), or the confirmation of a segment (1)."""
    return lambda frame: frame[0] >> 4 & 0x0F == kind << 1 | toggle
