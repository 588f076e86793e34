"""Follow the SDO transfers of one node by frame (CiA 301): expedited, segmented and block."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum, auto

from cdpr_drivers.canopen.sdo import abort_code, expedited, segment

_MULTIPLEXOR = struct.Struct("<HB")
_SEGMENT_BYTES = 7


class Step(Enum):
    """Role of an SDO frame in its transfer."""

    ASK_READ = auto()
    ASK_WRITE = auto()
    ANNOUNCE = auto()
    """The server announces a value of `size` bytes."""
    VALUE = auto()
    """The server has sent the end of a value; `data` is the whole value if no part was missed."""
    WRITTEN = auto()
    """The server has confirmed a write; `data` is the written value if it was seen."""
    SEGMENT = auto()
    CONTROL = auto()
    ABORT = auto()
    UNEXPECTED = auto()
    """The frame does not belong to the transfer, as far as that was seen."""


@dataclass(frozen=True)
class SdoEvent:
    """One decoded SDO frame; `index` is None if the transfer is unknown."""

    step: Step
    index: int | None = None
    sub: int = 0
    data: bytes | None = None
    size: int | None = None
    """Number of bytes announced, or seen so far."""
    code: int = 0
    """Abort code."""
    note: str = ""


@dataclass
class _Transfer:
    index: int
    sub: int
    data: bytearray = field(default_factory=bytearray)
    whole: bool = True
    """Whether no part of the value was missed."""
    block_size: int = 127
    block: list[bytes] = field(default_factory=list)
    """Segments of the present block, in order."""
    last: bool = False
    """Whether the latest segment is marked as the last one."""
    toggle: int = 0


class SdoDecoder:
    """Decodes the transfers between any client and one server; accepts any bytes."""

    def __init__(self) -> None:
        self._transfer: _Transfer | None = None
        self._streams: str = ""
        """Sender of block segments, which lack command specifiers: "client" or "server"."""
        self._readers: dict[tuple[str, int], Callable[[bytes], SdoEvent]] = {
            ("client", 0): self._segment,
            ("client", 1): self._ask_download,
            ("client", 2): self._ask_upload,
            ("client", 3): lambda _: self._event(Step.CONTROL, note="next segment"),
            ("client", 5): self._block_upload_control,
            ("client", 6): self._block_download_control,
            ("server", 0): self._upload_segment,
            ("server", 1): self._segment_taken,
            ("server", 2): self._upload_begins,
            ("server", 3): self._download_confirmed,
            ("server", 5): self._block_download_answer,
            ("server", 6): self._block_upload_answer,
        }
        """Handler by sender and command specifier."""

    def request(self, data: bytes) -> SdoEvent:
        """Process a frame of the client (600h + node)."""
        return self._take(data, "client")

    def response(self, data: bytes) -> SdoEvent:
        """Process a frame of the server (580h + node)."""
        return self._take(data, "server")

    def _take(self, data: bytes, sender: str) -> SdoEvent:
        if len(data) != 8:
            return SdoEvent(Step.UNEXPECTED, note=f"{len(data)} bytes, not 8")
        code = abort_code(data)
        if code is not None:
            self._end()
            return SdoEvent(Step.ABORT, *_object(data), code=code)
        if self._streams == sender:
            return self._block_segment(data)
        reader = self._readers.get((sender, data[0] >> 5))
        return reader(data) if reader else SdoEvent(Step.UNEXPECTED, note="no such command")

    def _begin(self, data: bytes) -> _Transfer:
        self._transfer, self._streams = _Transfer(*_object(data)), ""
        return self._transfer

    def _end(self) -> None:
        self._transfer, self._streams = None, ""

    def _announced(self, step: Step, data: bytes, size_bit: int, note: str = "") -> SdoEvent:
        """Return the event of a frame that names an object, with its size if `size_bit` is set."""
        size = int.from_bytes(data[4:], "little") if data[0] & size_bit else None
        return SdoEvent(step, *_object(data), size=size, note=note)

    def _event(self, step: Step, *, data: bytes | None = None, note: str = "") -> SdoEvent:
        transfer = self._transfer
        if transfer is None:
            return SdoEvent(step, data=data, note=note)
        return SdoEvent(step, transfer.index, transfer.sub, data, len(transfer.data), note=note)

    # -- download: the client writes

    def _ask_download(self, data: bytes) -> SdoEvent:
        transfer = self._begin(data)
        value = expedited(data)
        if value is not None:
            transfer.data += value
            return self._event(Step.ASK_WRITE, data=value)
        return self._announced(Step.ASK_WRITE, data, 0x01)

    def _segment_taken(self, _: bytes) -> SdoEvent:
        if self._transfer is not None and self._transfer.last:
            return self._end_transfer(Step.WRITTEN)
        return self._event(Step.CONTROL, note="segment taken")

    def _download_confirmed(self, data: bytes) -> SdoEvent:
        index, sub = _object(data)
        transfer = self._transfer
        if transfer is None or (transfer.index, transfer.sub) != (index, sub):
            return SdoEvent(Step.WRITTEN, index, sub)
        if transfer.data:
            return self._end_transfer(Step.WRITTEN)
        return self._event(Step.CONTROL, note="go on")

    # -- upload: the client reads

    def _ask_upload(self, data: bytes) -> SdoEvent:
        self._begin(data)
        return self._event(Step.ASK_READ)

    def _upload_begins(self, data: bytes) -> SdoEvent:
        value = expedited(data)
        if value is not None:
            self._end()
            return SdoEvent(Step.VALUE, *_object(data), value)
        self._begin(data)
        return self._announced(Step.ANNOUNCE, data, 0x01)

    def _upload_segment(self, data: bytes) -> SdoEvent:
        event = self._segment(data)
        if self._transfer is not None and self._transfer.last:
            return self._end_transfer(Step.VALUE)
        return event

    # -- segments

    def _segment(self, data: bytes) -> SdoEvent:
        transfer = self._transfer
        if transfer is None:
            return SdoEvent(
                Step.UNEXPECTED, note="segment of a transfer whose start was not received"
            )
        toggle = data[0] >> 4 & 1
        if toggle != transfer.toggle or transfer.last:
            transfer.whole = False  # the segment was repeated, or one was missed
        part, transfer.last = segment(data)
        transfer.toggle = 1 - toggle
        transfer.data += part
        return self._event(Step.SEGMENT, note="last" if transfer.last else "")

    def _end_transfer(self, step: Step) -> SdoEvent:
        transfer = self._transfer
        assert transfer is not None  # guaranteed by the callers
        event = self._event(step, data=bytes(transfer.data) if transfer.whole else None)
        self._end()
        return event

    # -- block transfer

    def _block_segment(self, data: bytes) -> SdoEvent:
        transfer = self._transfer
        assert transfer is not None  # a stream begins with its transfer
        number, last = data[0] & 0x7F, bool(data[0] & 0x80)
        del transfer.block[max(number - 1, 0) :]
        if number != len(transfer.block) + 1:
            transfer.whole = False
        transfer.block.append(data[1:])
        transfer.last = last
        if last or number >= transfer.block_size:
            self._streams = ""
        text = len(transfer.data) + _SEGMENT_BYTES * len(transfer.block)
        note = f"number {number}{', last' if last else ''}"
        return SdoEvent(Step.SEGMENT, transfer.index, transfer.sub, size=text, note=note)

    def _acknowledged(self, data: bytes, sender: str) -> SdoEvent:
        transfer = self._transfer
        if transfer is None:
            return SdoEvent(Step.CONTROL, note=f"segments up to {data[1]} acknowledged")
        missed = len(transfer.block) > data[1]
        transfer.data += b"".join(transfer.block[: data[1]])
        transfer.block.clear()
        transfer.block_size = data[2]
        # after the last segment the next frame is a command again
        self._streams = "" if transfer.last and not missed else sender
        again = ", the others again" if missed else ""
        return self._event(Step.CONTROL, note=f"segments up to {data[1]} acknowledged{again}")

    def _drop_padding(self, data: bytes) -> None:
        """Drop the padding of the last segment; the end of a block transfer gives its length."""
        unused = data[0] >> 2 & 7
        if self._transfer is not None and unused:
            del self._transfer.data[-unused:]

    def _block_download_control(self, data: bytes) -> SdoEvent:
        if data[0] & 1:
            self._streams = ""
            self._drop_padding(data)
            return self._event(Step.CONTROL, note="end of block transfer")
        self._begin(data)
        return self._announced(Step.ASK_WRITE, data, 0x02, "in blocks")

    def _block_download_answer(self, data: bytes) -> SdoEvent:
        what = data[0] & 3
        if what == 0 and self._transfer is not None:
            self._transfer.block_size = data[4]
            self._streams = "client"
            return self._event(Step.CONTROL, note=f"go on, {data[4]} segments a block")
        if what == 1:
            if self._transfer is not None:
                return self._end_transfer(Step.WRITTEN)
            return self._event(Step.WRITTEN)
        if what == 2:
            return self._acknowledged(data, "client")
        return self._event(Step.UNEXPECTED, note="no block transfer is under way")

    def _block_upload_control(self, data: bytes) -> SdoEvent:
        what = data[0] & 3
        if what == 0:
            transfer = self._begin(data)
            transfer.block_size = data[4]
            return self._event(Step.ASK_READ, note="in blocks")
        if what == 3:
            self._streams = "server" if self._transfer is not None else ""
            return self._event(Step.CONTROL, note="go on")
        if what == 2:
            return self._acknowledged(data, "server")
        self._end()
        return self._event(Step.CONTROL, note="end of block transfer acknowledged")

    def _block_upload_answer(self, data: bytes) -> SdoEvent:
        if data[0] & 1:
            self._streams = ""
            self._drop_padding(data)
            if self._transfer is None:
                return self._event(Step.VALUE)
            # the client still has to confirm the end
            return self._end_transfer(Step.VALUE)
        return self._announced(Step.ANNOUNCE, data, 0x02, "in blocks")


def _object(data: bytes) -> tuple[int, int]:
    """Return index and sub-index of the object that a frame names."""
    index, sub = _MULTIPLEXOR.unpack_from(data, 1)
    return index, sub
