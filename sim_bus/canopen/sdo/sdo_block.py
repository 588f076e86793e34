"""SDO block transfer of CiA 301, server side; CRC when the client asks for it."""

from __future__ import annotations

import struct
from binascii import crc_hqx
from typing import TYPE_CHECKING

from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.sdo.sdo_transfer import TransferServer, announced_size, check_size

if TYPE_CHECKING:
    from cdpr_sim_bus.canopen.dictionary.od import Entry

BLOCK_SIZE = 127
"""Segments in a block that this server asks for in a download."""

_CRC_SUPPORTED = 0x04
_LAST = 0x80
_LONG = struct.Struct("<BHBI")
_END = struct.Struct("<BH")


class BlockUpload:
    """Upload in blocks of segments that the client acknowledges together."""

    def __init__(self, server: TransferServer, entry: Entry, data: bytes, request: bytes) -> None:
        if not 1 <= request[4] <= 127:
            raise SdoAbort(Abort.BLOCK_SIZE)
        self.index, self.sub = entry.index, entry.sub
        self._server = server
        self._data = data
        self._block_size = request[4]
        self._position = 0
        self._sent = 0
        self._last_sent = False
        self._crc = request[0] & _CRC_SUPPORTED
        self._state = "start"
        server.send(_LONG.pack(0xC2 | self._crc, entry.index, entry.sub, len(data)))

    def handles(self, command: int) -> bool:
        """Take the other block upload requests."""
        return command >> 5 == 5 and command & 0x03 != 0

    def step(self, data: bytes) -> None:
        """Start, continue or end."""
        request = data[0] & 0x03
        if request == 3 and self._state == "start":
            self._state = "block"
            self._send_block()
        elif request == 2 and self._state == "block":
            self._acknowledged(data[1], data[2])
        elif request == 1 and self._state == "end":
            self._server.finish()
        else:
            raise SdoAbort(Abort.UNKNOWN_COMMAND)

    def _send_block(self) -> None:
        data, position = self._data, self._position
        for number in range(1, self._block_size + 1):
            segment = data[position : position + 7]
            position += 7
            self._sent = number
            self._last_sent = position >= len(data)
            self._server.send(bytes([number | (_LAST if self._last_sent else 0)]) + segment)
            if self._last_sent:
                return

    def _acknowledged(self, sequence: int, block_size: int) -> None:
        if sequence > self._sent:
            raise SdoAbort(Abort.SEQUENCE_NUMBER)
        if not 1 <= block_size <= 127:
            raise SdoAbort(Abort.BLOCK_SIZE)
        self._block_size = block_size
        self._position += 7 * sequence
        if not (self._last_sent and sequence == self._sent):
            self._send_block()
            return
        self._state = "end"
        unused = self._position - len(self._data)
        checksum = crc_hqx(self._data, 0) if self._crc else 0
        self._server.send(_END.pack(0xC1 | unused << 2, checksum))


class BlockDownload:
    """Download in blocks of segments; the object is written at the end request."""

    def __init__(self, server: TransferServer, entry: Entry, request: bytes) -> None:
        self.index, self.sub = entry.index, entry.sub
        self._server = server
        self._entry = entry
        self._size = announced_size(entry, request, 0x02)
        self._crc = request[0] & _CRC_SUPPORTED
        self._data = bytearray()
        self._sequence = 0
        self._complete = False
        server.send(_LONG.pack(0xA0 | self._crc, entry.index, entry.sub, BLOCK_SIZE))

    def handles(self, command: int) -> bool:
        """Take every frame while segments come, then only the end request."""
        return not self._complete or command & 0xE3 == 0xC1

    def step(self, data: bytes) -> None:
        """Take a segment or the end request."""
        if self._complete:
            self._end(data)
            return
        last = bool(data[0] & _LAST)
        number = data[0] & 0x7F
        if number == 0:
            raise SdoAbort(Abort.SEQUENCE_NUMBER)
        if number == self._sequence + 1:
            self._sequence = number
            self._data += data[1:]
            self._complete = last
            # The last segment's padding is known only at the end request.
            check_size(self._entry, len(self._data) - 7, self._size, complete=False)
        if last or number == BLOCK_SIZE:
            self._server.send(bytes([0xA2, self._sequence, BLOCK_SIZE]))
            self._sequence = 0

    def _end(self, data: bytes) -> None:
        command, checksum = _END.unpack_from(data)
        content = bytes(self._data[: len(self._data) - (command >> 2 & 0x07)])
        check_size(self._entry, len(content), self._size, complete=True)
        if self._crc and crc_hqx(content, 0) != checksum:
            raise SdoAbort(Abort.CRC)
        self._server.write(self._entry, content)
        self._server.finish()
        self._server.send(b"\xa1")
