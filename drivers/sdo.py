"""SDO client of one node (CiA 301): one transfer at a time, which may be cancelled."""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NoReturn

from cdpr_rt.clock import Clock
from drivers import sdo_abort
from drivers.errors import BusError, SdoAbortError, SdoCancelledError, SdoTimeoutError

Send = Callable[[bytes], None]
Accept = Callable[[bytes], bool]

_MULTIPLEXER = struct.Struct("<BHB")
_LONG = struct.Struct("<BHBI")
_END = struct.Struct("<BH")
_ABORT = 0x80
_TOGGLE = 0x10
_BLOCK_SEGMENTS = 127
_MOST_WAITING = 1024
"""Frames kept for a transfer; a node that floods its SDO identifier fills no memory."""
_MOST_BYTES = 1 << 18
"""An upload that goes on and on is given up after so many."""
_UPLOAD, _DOWNLOAD, _BLOCK_UPLOAD = 2, 3, 6
"""What the top three bits of an answer to the first request say."""


class SdoClient:
    """Transfers to and from one node; `send` puts a request of 8 bytes on the bus.

    Of several tasks the next one begins when the one before has ended.

    An answer that belongs to no request (a duplicate, another client's, a second device's) is
    left aside and counted. Uploads and downloads raise SdoAbortError, SdoTimeoutError,
    SdoCancelledError and BusError, all without naming node and object.
    """

    def __init__(self, send: Send, clock: Clock) -> None:
        self.strays = 0
        """Answers that nobody had asked for, since it was set to 0 or an answer was late."""
        self._send = send
        self._clock = clock
        self._answers: deque[bytes] = deque()
        self._busy = self._cancelled = False
        self._lost: BusError | None = None
        self._multiplexer = bytes(3)
        self._timeout_s = 0.0

    def on_answer(self, data: bytes) -> None:
        """Take an answer of 8 bytes from the bus."""
        if len(self._answers) < _MOST_WAITING:
            self._answers.append(data)

    def await_strays(self, seconds: float) -> int:
        """Return how many answers nobody had asked for, after waiting for more of them."""
        with self._alone():
            self._clock.wait(lambda: self._lost, self._clock.now_s + seconds)
            self._leave_strays()
            return self.strays

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
                    return self._block_upload(index, sub)
                except SdoAbortError as error:
                    if error.code != sdo_abort.UNKNOWN_COMMAND:
                        raise
            return self._plain_upload(self._initiate(0x40, index, sub, bytes(4), (_UPLOAD,)))

    def download(self, index: int, sub: int, data: bytes, timeout_s: float) -> None:
        """Write the data of an object, expedited up to 4 bytes, else in segments."""
        with self._transfer(index, sub, timeout_s):
            if 0 < len(data) <= 4:
                command = 0x23 | (4 - len(data)) << 2
                self._initiate(command, index, sub, data.ljust(4, b"\0"), (_DOWNLOAD,))
                return
            size = len(data).to_bytes(4, "little")
            self._initiate(0x21, index, sub, size, (_DOWNLOAD,))
            toggle = 0
            for start in range(0, max(len(data), 1), 7):
                part = data[start : start + 7]
                last = start + 7 >= len(data)
                command = toggle | (7 - len(part)) << 1 | last
                self._ask(bytes([command]) + part, _segment(1, toggle))
                toggle ^= _TOGGLE

    # -- the kinds of upload

    def _plain_upload(self, answer: bytes) -> bytes:
        command = answer[0]
        if command & 0x02:
            return answer[4 : 8 - (command >> 2 & 0x03) if command & 0x01 else 8]
        size = int.from_bytes(answer[4:8], "little") if command & 0x01 else None
        data = bytearray()
        toggle = 0
        for _ in range(_MOST_BYTES // 7):
            segment = self._ask(bytes([0x60 | toggle]), _segment(0, toggle))
            data += segment[1 : 8 - (segment[0] >> 1 & 0x07)]
            last = bool(segment[0] & 0x01)
            if size is not None and (len(data) > size or (last and len(data) < size)):
                self._abort(sdo_abort.LENGTH)
            if last:
                return bytes(data)
            toggle ^= _TOGGLE
        return self._abort(sdo_abort.OUT_OF_MEMORY)

    def _block_upload(self, index: int, sub: int) -> bytes:
        request = bytes([_BLOCK_SEGMENTS, 0, 0, 0])
        answer = self._initiate(0xA4, index, sub, request, (_BLOCK_UPLOAD, _UPLOAD))
        if answer[0] >> 5 == _UPLOAD:
            return self._plain_upload(answer)
        checked = bool(answer[0] & 0x04)
        data = bytearray()
        request = b"\xa3"
        last = False
        while not last:
            if len(data) > _MOST_BYTES:
                self._abort(sdo_abort.OUT_OF_MEMORY)
            self._put(request)
            good, last = self._block(data)
            request = bytes([0xA2, good, _BLOCK_SEGMENTS])
        end = self._ask(request, lambda frame: frame[0] & 0xE3 == 0xC1)
        command, checksum = _END.unpack_from(end)
        del data[len(data) - (command >> 2 & 0x07) :]
        if checked and crc_hqx(data, 0) != checksum:
            self._abort(sdo_abort.CRC)
        self._put(b"\xa1")
        return bytes(data)

    def _block(self, data: bytearray) -> tuple[int, bool]:
        """Take the segments of one block; return how many came in order, and if the last did.

        What follows a lost segment is left aside: the node sends it again.
        """
        good = 0
        while True:
            frame = self._next(self._clock.now_s + self._timeout_s)
            if frame is None:
                if not good:
                    self._give_up()
                return good, False
            number, last = frame[0] & 0x7F, bool(frame[0] & 0x80)
            if number == good + 1:
                good = number
                data += frame[1:]
                if last:
                    return good, True
            if last or number == _BLOCK_SEGMENTS:
                return good, False

    # -- requests and answers

    @contextmanager
    def _alone(self) -> Iterator[None]:
        self._clock.wait(lambda: not self._busy)
        self._busy, self._cancelled = True, False
        try:
            yield
        finally:
            self._busy = False

    @contextmanager
    def _transfer(self, index: int, sub: int, timeout_s: float) -> Iterator[None]:
        with self._alone():
            self._multiplexer = _MULTIPLEXER.pack(0, index, sub)[1:]
            self._timeout_s = timeout_s
            yield

    def _initiate(
        self, command: int, index: int, sub: int, data: bytes, kinds: tuple[int, ...]
    ) -> bytes:
        def accept(frame: bytes) -> bool:
            return frame[0] >> 5 in kinds and frame[1:4] == self._multiplexer

        return self._ask(_MULTIPLEXER.pack(command, index, sub) + data, accept)

    def _ask(self, request: bytes, accept: Accept) -> bytes:
        self._clock.look()
        self._leave_strays()
        self._put(request)
        deadline = self._clock.now_s + self._timeout_s
        others = 0
        while True:
            frame = self._next(deadline)
            if frame is None:
                self._give_up(others)
            elif accept(frame):
                return frame
            else:
                others += 1
                self.strays += 1

    def _leave_strays(self) -> None:
        self.strays += len(self._answers)
        self._answers.clear()

    def _put(self, request: bytes) -> None:
        self._look_for_end()
        self._send(request.ljust(8, b"\0"))

    def _next(self, deadline: float) -> bytes | None:
        """Return the next frame of the node, None when none came; raises what ends the transfer."""
        self._clock.wait(lambda: self._answers or self._cancelled or self._lost, deadline)
        self._look_for_end()
        if not self._answers:
            return None
        frame = self._answers.popleft()
        if frame[0] == _ABORT and frame[1:4] in (self._multiplexer, bytes(3)):
            raise SdoAbortError(int.from_bytes(frame[4:8], "little"))
        return frame

    def _look_for_end(self) -> None:
        if self._lost is not None:
            raise BusError(str(self._lost))
        if self._cancelled:
            self._tell(sdo_abort.GENERAL)
            raise SdoCancelledError("the transfer was cancelled")

    def _give_up(self, others: int = 0) -> NoReturn:
        self._tell(sdo_abort.TIMED_OUT)
        self.strays = 0  # the answer may still come: then it is late
        what = f" (frames that do not answer the request: {others})" if others else ""
        raise SdoTimeoutError(f"no answer within {self._timeout_s:g} s{what}")

    def _abort(self, code: int) -> NoReturn:
        """End the transfer for a reason of ours; raises SdoAbortError."""
        self._tell(code)
        raise SdoAbortError(code)

    def _tell(self, code: int) -> None:
        index, sub = struct.unpack("<HB", self._multiplexer)
        self._send(_LONG.pack(_ABORT, index, sub, code))


def _segment(kind: int, toggle: int) -> Accept:
    return lambda frame: frame[0] >> 5 == kind and frame[0] & _TOGGLE == toggle
