"""SDO server of CiA 301: the choice between the kinds of transfer, aborts and the time-out."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from cdpr_sim_bus.canopen import cob_ids
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.sdo.sdo_block import BlockDownload, BlockUpload
from cdpr_sim_bus.canopen.sdo.sdo_transfer import (
    SegmentedDownload,
    SegmentedUpload,
    Transfer,
    announced_size,
)
from cdpr_sim_bus.canopen.slave import Slave
from cdpr_sim_bus.frame import pack_frame

if TYPE_CHECKING:
    from cdpr_sim_bus.canopen.dictionary.od import Entry

TIMEOUT_S = 5.0
"""Bus time after which a transfer is aborted when the client keeps silent."""

ABORT_COMMAND = 0x80
_MULTIPLEXER = struct.Struct("<BHB")
_LONG = struct.Struct("<BHBI")


class SdoServer:
    """The default SDO server; one transfer at a time, a new one displaces the old."""

    def __init__(self, slave: Slave) -> None:
        self._slave = slave
        self._transfer: Transfer | None = None
        self._timer = slave.timers.add(self._time_out)

    def receive(self, frame: bytes, now: float) -> None:
        """Take a request frame; a frame that is not 8 bytes long is not SDO."""
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
        """Write what a permitted download carried; raises SdoAbort."""
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
