"""SDO client of one node (CiA 301): one transfer at a time, which may be cancelled."""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NoReturn

from cdpr_drivers.canopen import sdo_abort
from cdpr_drivers.canopen import sdo_frames as frames
from cdpr_drivers.canopen.sdo_frames import BLOCK_UPLOAD, DOWNLOAD, UPLOAD
from cdpr_drivers.errors import BusError, SdoAbortError, SdoCancelledError, SdoTimeoutError
from cdpr_rt.core.clock import Clock

Send = Callable[[bytes], None]
Accept = Callable[[bytes], bool]

_END = struct.Struct("<BH")
_BLOCK_SEGMENTS = 127
_MOST_WAITING = 1024
"""Frames kept for a transfer; a node that floods its SDO identifier fills no memory."""
_MOST_BYTES = 1 << 18
"""An upload that goes on and on is given up after so many."""


class SdoClient:
    """Transfers to and from one node; `send` puts a request of 8 bytes on the bus.

    Of several tasks the next one begins when the one before has ended.

    An answer that belongs to no request (a duplicate, another client's, a second device's) is
    discarded and counted. Uploads and downloads raise SdoAbortError, SdoTimeoutError,
    SdoCancelledError and BusError, all without naming node and object.
    """

    def __init__(self, send: Send, clock: Clock) -> None:
        self.unexpected = 0
        """Answers to no request, since it was set to 0 or a request timed out."""
        self._send = send
        self._clock = clock
        self._answers: deque[bytes] = deque()
        self._busy = self._cancelled = False
        self._lost: BusError | None = None
        self._object = (0, 0)
        self._multiplexer = bytes(3)
        self._timeout_s = 0.0

    def on_answer(self, data: bytes) -> None:
        """Take an answer of 8 bytes from the bus."""
        if len(self._answers) < _MOST_WAITING:
            self._answers.append(data)

    def await_unexpected(self, seconds: float) -> int:
        """Return the number of unexpected answers, after waiting for more of them."""
        with self._exclusive():
            self._clock.wait(lambda: self._lost, self._clock.now_s + seconds)
            self._discard_unexpected()
            return self.unexpected

    def cancel(self) -> bool:
        """Have the transfer that runs end with SdoCancelledError; return whether one runs.

        The node gets an abort (08000000h).
        """
        self._cancelled = self._busy
        return self._busy

    def fail(self, error: BusError) -> None:
        """Have transfers end at once, now and later: the bus has gone away."""
        self._lost = error

    def upload(self, index: int, sub: int, timeout_s: float, *, block: bool = False) -> bytes:
        """Return the data of an object; `timeout_s` is that of each answer.

        With `block` a node may answer with many segments at a time; one that cannot is read in
        single segments.
        """
        with self._transfer(index, sub, timeout_s):
            if block:
                try:
                    return self._block_upload()
                except SdoAbortError as error:
                    if error.code != sdo_abort.UNKNOWN_COMMAND:
                        raise
            return self._plain_upload(self._initiate(0x40, bytes(4), UPLOAD))

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

    # -- the kinds of upload

    def _plain_upload(self, answer: bytes) -> bytes:
        value = frames.expedited(answer)
        if value is not None:
            return value
        size = int.from_bytes(answer[4:8], "little") if answer[0] & 0x01 else None
        data = bytearray()
        toggle = 0
        for _ in range(_MOST_BYTES // 7):
            frame = self._ask(frames.segment_request(toggle), _segment(0, toggle))
            part, last = frames.segment(frame)
            data += part
            if size is not None and (len(data) > size or (last and len(data) < size)):
                self._abort(sdo_abort.LENGTH)
            if last:
                return bytes(data)
            toggle ^= 1
        return self._abort(sdo_abort.OUT_OF_MEMORY)

    def _block_upload(self) -> bytes:
        answer = self._initiate(0xA4, bytes([_BLOCK_SEGMENTS]), BLOCK_UPLOAD, UPLOAD)
        if answer[0] >> 5 == UPLOAD:
            return self._plain_upload(answer)
        checked = bool(answer[0] & 0x04)
        data = bytearray()
        request = b"\xa3"
        last = False
        while not last:
            if len(data) > _MOST_BYTES:
                self._abort(sdo_abort.OUT_OF_MEMORY)
            self._request(request)
            in_order, last = self._block(data)
            request = bytes([0xA2, in_order, _BLOCK_SEGMENTS])
        end = self._ask(request, lambda frame: frame[0] & 0xE3 == 0xC1)
        command, checksum = _END.unpack_from(end)
        del data[len(data) - (command >> 2 & 0x07) :]
        if checked and crc_hqx(data, 0) != checksum:
            self._abort(sdo_abort.CRC)
        self._request(b"\xa1")
        return bytes(data)

    def _block(self, data: bytearray) -> tuple[int, bool]:
        """Take the segments of one block; return how many came in order, and if the last did.

        What follows a lost segment is discarded: the node sends it again.
        """
        in_order = 0
        while True:
            frame = self._next(self._clock.now_s + self._timeout_s)
            if frame is None:
                if not in_order:
                    self._time_out()
                return in_order, False
            number, last = frame[0] & 0x7F, bool(frame[0] & 0x80)
            if number == in_order + 1:
                in_order = number
                data += frame[1:]
                if last:
                    return in_order, True
            if last or number == _BLOCK_SEGMENTS:
                return in_order, False

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
            self._object, self._multiplexer = (index, sub), frames.multiplexer(index, sub)
            self._timeout_s = timeout_s
            yield

    def _initiate(self, command: int, data: bytes, *kinds: int) -> bytes:
        request = frames.request(command, *self._object, data)
        return self._ask(request, lambda frame: frames.answers(frame, self._multiplexer, *kinds))

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
        """Return the next frame of the node, None when none came; raises what ends the transfer."""
        self._clock.wait(lambda: self._answers or self._cancelled or self._lost, deadline)
        self._raise_if_ended()
        if not self._answers:
            return None
        frame = self._answers.popleft()
        code = frames.abort_code(frame)
        if code is not None and frames.aborts(frame, self._multiplexer):
            raise SdoAbortError(code)
        return frame

    def _raise_if_ended(self) -> None:
        if self._lost is not None:
            raise BusError(str(self._lost))
        if self._cancelled:
            self._send_abort(sdo_abort.GENERAL)
            raise SdoCancelledError("the transfer was cancelled")

    def _time_out(self, others: int = 0) -> NoReturn:
        self._send_abort(sdo_abort.TIMED_OUT)
        self.unexpected = 0  # the answer may still come: then it is late
        what = f" (frames that do not answer the request: {others})" if others else ""
        raise SdoTimeoutError(f"no answer within {self._timeout_s:g} s{what}")

    def _abort(self, code: int) -> NoReturn:
        """Abort the transfer from this side; raises SdoAbortError."""
        self._send_abort(code)
        raise SdoAbortError(code)

    def _send_abort(self, code: int) -> None:
        self._send(frames.abort_request(*self._object, code))


def _segment(kind: int, toggle: int) -> Accept:
    return lambda frame: frames.is_segment(frame, kind, toggle)
