"""SDO server of CiA 301: expedited, segmented and block transfers, aborts and the timeout."""

from __future__ import annotations

import struct
from binascii import crc_hqx
from typing import TYPE_CHECKING

from cdpr_sim_bus.canopen import slave as cob_ids
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.frame import pack_frame

if TYPE_CHECKING:
    from cdpr_sim_bus.canopen.node import CanopenSlave
    from cdpr_sim_bus.canopen.od import Entry


MAX_TRANSFER_BYTES = 1 << 20
"""Largest amount of data accepted in one download."""

_TOGGLE = 0x10
_LAST = 0x01


class SegmentedUpload:
    """Upload in segments of 7 bytes; the client requests each."""

    def __init__(self, server: SdoServer, entry: Entry, data: bytes) -> None:
        self.index, self.sub = entry.index, entry.sub
        self._server = server
        self._data = data
        self._position = 0
        self._toggle = 0

    def handles(self, command: int) -> bool:
        """Accept upload segment requests."""
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

    def __init__(self, server: SdoServer, entry: Entry, size: int | None) -> None:
        self.index, self.sub = entry.index, entry.sub
        self._server = server
        self._entry = entry
        self._size = size
        self._data = bytearray()
        self._toggle = 0

    def handles(self, command: int) -> bool:
        """Accept download segments."""
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
    """Return the size that a download announces, or None; raises SdoAbort if it is too large."""
    if not data[0] & flag:
        return None
    size = int.from_bytes(data[4:8], "little")
    entry.check_length(size)
    if size > MAX_TRANSFER_BYTES:
        raise SdoAbort(Abort.OUT_OF_MEMORY)
    return size


def check_size(entry: Entry, received: int, announced: int | None, *, complete: bool) -> None:
    """Compare the received length of a download with the announced one; raises SdoAbort."""
    limit = announced if announced is not None else entry.codec.size
    if received > (MAX_TRANSFER_BYTES if limit is None else limit):
        raise SdoAbort(Abort.OUT_OF_MEMORY if limit is None else Abort.LENGTH_TOO_HIGH)
    if complete and announced is not None and received < announced:
        raise SdoAbort(Abort.LENGTH_TOO_LOW)


BLOCK_SIZE = 127
"""Segments per block that this server requests in a download."""

_CRC_SUPPORTED = 0x04
_LAST_BLOCK = 0x80
_LONG = struct.Struct("<BHBI")
_END = struct.Struct("<BH")


class BlockUpload:
    """Upload in blocks of segments that the client acknowledges together."""

    def __init__(self, server: SdoServer, entry: Entry, data: bytes, request: bytes) -> None:
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
        """Return whether this is a block upload request other than the first."""
        return command >> 5 == 5 and command & 0x03 != 0

    def step(self, data: bytes) -> None:
        """Start, continue or end the transfer."""
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
            self._server.send(bytes([number | (_LAST_BLOCK if self._last_sent else 0)]) + segment)
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

    def __init__(self, server: SdoServer, entry: Entry, request: bytes) -> None:
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
        """Accept every frame while segments arrive, then only the end request."""
        return not self._complete or command & 0xE3 == 0xC1

    def step(self, data: bytes) -> None:
        """Process a segment or the end request."""
        if self._complete:
            self._end(data)
            return
        last = bool(data[0] & _LAST_BLOCK)
        number = data[0] & 0x7F
        if number == 0:
            raise SdoAbort(Abort.SEQUENCE_NUMBER)
        if number == self._sequence + 1:
            self._sequence = number
            self._data += data[1:]
            self._complete = last
            # The length of the last segment's padding is known only at the end request.
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


TIMEOUT_S = 5.0
"""Bus time after which a transfer is aborted if the client is silent."""

ABORT_COMMAND = 0x80
_MULTIPLEXER = struct.Struct("<BHB")
Transfer = SegmentedUpload | SegmentedDownload | BlockUpload | BlockDownload
"""A transfer of more than one request."""


class SdoServer:
    """The default SDO server; one transfer at a time, a new one replaces the old one."""

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave = slave
        self._transfer: Transfer | None = None
        self._timer = slave.timers.add(self._time_out)

    def receive(self, frame: bytes, now: float) -> None:
        """Process a request frame; a frame that is not 8 bytes long is not SDO."""
        if frame[4] != 8:
            return
        data = frame[8:16]
        index, sub = 0, 0
        try:
            transfer = self._transfer
            if data[0] == ABORT_COMMAND:
                self.finish()
            elif transfer is not None and transfer.handles(data[0]):
                index, sub = transfer.index, transfer.sub
                transfer.step(data)
            elif _is_initiate(data[0]):
                self.finish()
                _, index, sub = _MULTIPLEXER.unpack_from(data)
                self._initiate(data, index, sub)
            else:
                if transfer is not None:
                    index, sub = transfer.index, transfer.sub
                raise SdoAbort(Abort.UNKNOWN_COMMAND)
        except SdoAbort as abort:
            self._abort(index, sub, abort.code)
        if self._transfer is not None:
            self._timer.arm(now + TIMEOUT_S)

    def send(self, data: bytes) -> None:
        """Send a response, padded to 8 bytes."""
        cob_id = cob_ids.SDO_RESPONSE + self._slave.node_id
        self._slave.outbox.append(pack_frame(cob_id, data.ljust(8, b"\x00")))

    def write(self, entry: Entry, data: bytes) -> None:
        """Write the data of a permitted download; raises SdoAbort."""
        before = entry.value
        entry.write_bytes(data)
        self._slave.stamp.written(entry, before)

    def finish(self) -> None:
        """Drop the present transfer, if any."""
        self._transfer = None
        self._timer.stop()

    def upload(self, entry: Entry, data: bytes) -> None:
        """Answer an upload: expedited up to 4 bytes, else segmented."""
        size = len(data)
        if 0 < size <= 4:
            head = _MULTIPLEXER.pack(0x43 | (4 - size) << 2, entry.index, entry.sub)
            self.send(head + data)
        else:
            self._transfer = SegmentedUpload(self, entry, data)
            self.send(_LONG.pack(0x41, entry.index, entry.sub, size))

    def _initiate(self, data: bytes, index: int, sub: int) -> None:
        entry = self._slave.od.find(index, sub)
        kind = data[0] >> 5
        if kind == 2:
            self.upload(entry, entry.read_bytes())
            return
        if kind == 5:
            self._block_upload(entry, data)
            return
        if not entry.writable:
            raise SdoAbort(Abort.READ_ONLY)
        if kind == 6:
            self._transfer = BlockDownload(self, entry, data)
        elif data[0] & 0x02:
            self._expedited_download(entry, data)
        else:
            self._transfer = SegmentedDownload(self, entry, announced_size(entry, data, 0x01))
            self.send(_MULTIPLEXER.pack(0x60, index, sub))

    def _block_upload(self, entry: Entry, request: bytes) -> None:
        content = entry.read_bytes()
        if 0 < len(content) <= request[5]:  # protocol switch threshold
            self.upload(entry, content)
        else:
            self._transfer = BlockUpload(self, entry, content, request)

    def _expedited_download(self, entry: Entry, data: bytes) -> None:
        command = data[0]
        size = 4 - (command >> 2 & 0x03) if command & 0x01 else min(entry.codec.size or 4, 4)
        self.write(entry, data[4 : 4 + size])
        self.send(_MULTIPLEXER.pack(0x60, entry.index, entry.sub))

    def _abort(self, index: int, sub: int, code: int) -> None:
        self.finish()
        self.send(_LONG.pack(ABORT_COMMAND, index, sub, code))

    def _time_out(self, _now: float) -> None:
        if self._transfer is not None:
            self._abort(self._transfer.index, self._transfer.sub, Abort.TIMEOUT)


def _is_initiate(command: int) -> bool:
    kind = command >> 5
    return kind in (1, 2) or (kind == 5 and command & 0x03 == 0) or (kind == 6 and not command & 1)
