"""SDO transfers of one node followed frame by frame (CiA 301): expedited, segmented and block."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum, auto

_MULTIPLEXOR = struct.Struct("<HB")
_SEGMENT_BYTES = 7
_ABORT = 0x80


class Step(Enum):
    """What an SDO frame does in its transfer."""

    ASK_READ = auto()
    ASK_WRITE = auto()
    ANNOUNCE = auto()
    """The server announces a value of `size` bytes."""
    VALUE = auto()
    """The server has delivered the last of a value; `data` is all of it where all was seen."""
    WRITTEN = auto()
    """The server has confirmed a write; `data` is what was written where it was seen."""
    SEGMENT = auto()
    CONTROL = auto()
    ABORT = auto()
    UNEXPECTED = auto()
    """It does not belong to the transfer as far as that was seen."""


@dataclass(frozen=True)
class SdoEvent:
    """One decoded SDO frame; `index` is None where no transfer is known."""

    step: Step
    index: int | None = None
    sub: int = 0
    data: bytes | None = None
    size: int | None = None
    """Bytes announced, or so far."""
    code: int = 0
    """Abort code."""
    note: str = ""


@dataclass
class _Transfer:
    index: int
    sub: int
    data: bytearray = field(default_factory=bytearray)
    whole: bool = True
    """Whether nothing of it was missed."""
    block_size: int = 127
    block: list[bytes] = field(default_factory=list)
    """Segments of the present block, in order."""
    last: bool = False
    """Whether the latest segment says that it is the last."""
    toggle: int = 0


class SdoDecoder:
    """Decodes the transfers between any client and one server; takes any bytes."""

    def __init__(self) -> None:
        self._transfer: _Transfer | None = None
        self._streams: str = ""
        """Who sends block segments now, without command specifiers: "client" or "server"."""
        self._from_client: dict[int, _Reader] = {
            0: self._segment,
            1: self._ask_download,
            2: self._ask_upload,
            3: self._ask_segment,
            5: self._block_upload_control,
            6: self._block_download_control,
        }
        self._from_server: dict[int, _Reader] = {
            0: self._upload_segment,
            1: self._segment_taken,
            2: self._upload_begins,
            3: self._download_confirmed,
            5: self._block_download_answer,
            6: self._block_upload_answer,
        }

    def request(self, data: bytes) -> SdoEvent:
        """Take a frame of the client (600h + node)."""
        return self._take(data, "client", self._from_client)

    def response(self, data: bytes) -> SdoEvent:
        """Take a frame of the server (580h + node)."""
        return self._take(data, "server", self._from_server)

    def _take(self, data: bytes, sender: str, readers: dict[int, _Reader]) -> SdoEvent:
        if len(data) != 8:
            return SdoEvent(Step.UNEXPECTED, note=f"{len(data)} bytes, not 8")
        if data[0] == _ABORT:
            self._transfer, self._streams = None, ""
            index, sub = _MULTIPLEXOR.unpack_from(data, 1)
            return SdoEvent(Step.ABORT, index, sub, code=int.from_bytes(data[4:], "little"))
        if self._streams == sender:
            return self._block_segment(data)
        reader = readers.get(data[0] >> 5)
        return reader(data) if reader else SdoEvent(Step.UNEXPECTED, note="no such command")

    def _begin(self, data: bytes) -> _Transfer:
        index, sub = _MULTIPLEXOR.unpack_from(data, 1)
        self._transfer, self._streams = _Transfer(index, sub), ""
        return self._transfer

    def _event(self, step: Step, *, data: bytes | None = None, note: str = "") -> SdoEvent:
        transfer = self._transfer
        if transfer is None:
            return SdoEvent(step, data=data, note=note)
        return SdoEvent(step, transfer.index, transfer.sub, data, len(transfer.data), note=note)

    # -- download: the client writes

    def _ask_download(self, data: bytes) -> SdoEvent:
        transfer = self._begin(data)
        if data[0] & 0x02:
            transfer.data += _expedited(data)
            return self._event(Step.ASK_WRITE, data=bytes(transfer.data))
        size = int.from_bytes(data[4:], "little") if data[0] & 0x01 else None
        return SdoEvent(Step.ASK_WRITE, transfer.index, transfer.sub, size=size)

    def _segment_taken(self, _: bytes) -> SdoEvent:
        if self._transfer is not None and self._transfer.last:
            return self._end_transfer(Step.WRITTEN)
        return self._event(Step.CONTROL, note="segment taken")

    def _download_confirmed(self, data: bytes) -> SdoEvent:
        index, sub = _MULTIPLEXOR.unpack_from(data, 1)
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
        index, sub = _MULTIPLEXOR.unpack_from(data, 1)
        if data[0] & 0x02:
            self._transfer, self._streams = None, ""
            return SdoEvent(Step.VALUE, index, sub, _expedited(data))
        self._begin(data)
        size = int.from_bytes(data[4:], "little") if data[0] & 0x01 else None
        return SdoEvent(Step.ANNOUNCE, index, sub, size=size)

    def _ask_segment(self, _: bytes) -> SdoEvent:
        return self._event(Step.CONTROL, note="next segment")

    def _upload_segment(self, data: bytes) -> SdoEvent:
        event = self._segment(data)
        if self._transfer is not None and self._transfer.last:
            return self._end_transfer(Step.VALUE)
        return event

    # -- segments

    def _segment(self, data: bytes) -> SdoEvent:
        transfer = self._transfer
        if transfer is None:
            return SdoEvent(Step.UNEXPECTED, note="segment of a transfer whose begin was not seen")
        toggle = data[0] >> 4 & 1
        if toggle != transfer.toggle or transfer.last:
            transfer.whole = False  # sent again, or one was missed
        transfer.toggle, transfer.last = 1 - toggle, bool(data[0] & 1)
        transfer.data += data[1 : 8 - (data[0] >> 1 & 7)]
        return self._event(Step.SEGMENT, note="last" if transfer.last else "")

    def _end_transfer(self, step: Step) -> SdoEvent:
        transfer = self._transfer
        assert transfer is not None  # asked by those who have one
        event = self._event(step, data=bytes(transfer.data) if transfer.whole else None)
        self._transfer, self._streams = None, ""
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
            return SdoEvent(Step.CONTROL, note=f"segments up to {data[1]} taken")
        missed = len(transfer.block) > data[1]
        transfer.data += b"".join(transfer.block[: data[1]])
        transfer.block.clear()
        transfer.block_size = data[2]
        # after the last segment the next frame is a command again
        self._streams = "" if transfer.last and not missed else sender
        again = ", the others again" if missed else ""
        return self._event(Step.CONTROL, note=f"segments up to {data[1]} taken{again}")

    def _drop_padding(self, data: bytes) -> None:
        """Drop the padding of the last segment; the end of a block transfer has its length."""
        unused = data[0] >> 2 & 7
        if self._transfer is not None and unused:
            del self._transfer.data[-unused:]

    def _block_download_control(self, data: bytes) -> SdoEvent:
        if data[0] & 1:
            self._streams = ""
            self._drop_padding(data)
            return self._event(Step.CONTROL, note="end of block transfer")
        transfer = self._begin(data)
        size = int.from_bytes(data[4:], "little") if data[0] & 0x02 else None
        return SdoEvent(Step.ASK_WRITE, transfer.index, transfer.sub, size=size, note="in blocks")

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
        if self._transfer is not None:
            self._transfer, self._streams = None, ""
        return self._event(Step.CONTROL, note="end of block transfer taken")

    def _block_upload_answer(self, data: bytes) -> SdoEvent:
        if data[0] & 1:
            self._streams = ""
            self._drop_padding(data)
            if self._transfer is None:
                return self._event(Step.VALUE)
            # the client still says that it has taken the end
            return self._end_transfer(Step.VALUE)
        index, sub = _MULTIPLEXOR.unpack_from(data, 1)
        size = int.from_bytes(data[4:], "little") if data[0] & 0x02 else None
        return SdoEvent(Step.ANNOUNCE, index, sub, size=size, note="in blocks")


_Reader = Callable[[bytes], SdoEvent]


def _expedited(data: bytes) -> bytes:
    """Return the value of an expedited transfer; without its size given, all 4 bytes."""
    return data[4 : 8 - (data[0] >> 2 & 3)] if data[0] & 1 else data[4:]
