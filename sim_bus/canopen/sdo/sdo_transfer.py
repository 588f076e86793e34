"""SDO transfers of more than one request: what they have in common, and the segmented ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from cdpr_sim_bus.canopen.abort import Abort, SdoAbort

if TYPE_CHECKING:
    from cdpr_sim_bus.canopen.dictionary.od import Entry

MAX_TRANSFER_BYTES = 1 << 20
"""Largest block of data taken in one download."""

_TOGGLE = 0x10
_LAST = 0x01


class TransferServer(Protocol):
    """Interface of the server to its transfers."""

    def send(self, data: bytes) -> None:
        """Send a response of up to 8 bytes."""

    def write(self, entry: Entry, data: bytes) -> None:
        """Write what a download carried; raises SdoAbort."""

    def finish(self) -> None:
        """End the transfer."""


class Transfer(Protocol):
    """A transfer that takes more than one request."""

    index: int
    sub: int

    def handles(self, command: int) -> bool:
        """Whether a request's first byte belongs to this transfer now."""

    def step(self, data: bytes) -> None:
        """Take a request (8 bytes); raises SdoAbort."""


class SegmentedUpload:
    """Upload in segments of 7 bytes, each asked for by the client."""

    def __init__(self, server: TransferServer, entry: Entry, data: bytes) -> None:
        self.index, self.sub = entry.index, entry.sub
        self._server = server
        self._data = data
        self._position = 0
        self._toggle = 0

    def handles(self, command: int) -> bool:
        """Take upload segment requests."""
        return command >> 5 == 3

    def step(self, data: bytes) -> None:
        """Send the next segment."""
        if data[0] & _TOGGLE != self._toggle:
            raise SdoAbort(Abort.TOGGLE_BIT)
        segment = self._data[self._position : self._position + 7]
        self._position += len(segment)
        command = self._toggle | (7 - len(segment)) << 1
        self._toggle ^= _TOGGLE
        if self._position >= len(self._data):
            command |= _LAST
            self._server.finish()
        self._server.send(bytes([command]) + segment)


class SegmentedDownload:
    """Download in segments of up to 7 bytes; the object is written after the last one."""

    def __init__(self, server: TransferServer, entry: Entry, size: int | None) -> None:
        self.index, self.sub = entry.index, entry.sub
        self._server = server
        self._entry = entry
        self._size = size
        self._data = bytearray()
        self._toggle = 0

    def handles(self, command: int) -> bool:
        """Take download segments."""
        return command >> 5 == 0

    def step(self, data: bytes) -> None:
        """Collect a segment."""
        command = data[0]
        if command & _TOGGLE != self._toggle:
            raise SdoAbort(Abort.TOGGLE_BIT)
        self._data += data[1 : 8 - (command >> 1 & 0x07)]
        check_size(self._entry, len(self._data), self._size, complete=bool(command & _LAST))
        if command & _LAST:
            self._server.write(self._entry, bytes(self._data))
            self._server.finish()
        self._server.send(bytes([0x20 | self._toggle]))
        self._toggle ^= _TOGGLE


def announced_size(entry: Entry, data: bytes, flag: int) -> int | None:
    """Size a download announces, None when it does not; raises SdoAbort when it cannot fit."""
    if not data[0] & flag:
        return None
    size = int.from_bytes(data[4:8], "little")
    entry.check_length(size)
    if size > MAX_TRANSFER_BYTES:
        raise SdoAbort(Abort.OUT_OF_MEMORY)
    return size


def check_size(entry: Entry, received: int, announced: int | None, *, complete: bool) -> None:
    """Compare what a download brought with what it announced; raises SdoAbort."""
    limit = announced if announced is not None else entry.codec.size
    if received > (MAX_TRANSFER_BYTES if limit is None else limit):
        raise SdoAbort(Abort.OUT_OF_MEMORY if limit is None else Abort.LENGTH_TOO_HIGH)
    if complete and announced is not None and received < announced:
        raise SdoAbort(Abort.LENGTH_TOO_LOW)
