"""Receive PDO: frames into the dictionary, at the SYNC or at once, with deadline monitoring."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable

from cdpr_sim_bus.canopen import emcy
from cdpr_sim_bus.canopen.abort import SdoAbort
from cdpr_sim_bus.canopen.dictionary.datatypes import Value
from cdpr_sim_bus.canopen.dictionary.od import Entry
from cdpr_sim_bus.canopen.pdos.pdo_parameters import PdoRecord
from cdpr_sim_bus.canopen.slave import Slave


class Rpdo:
    """One receive PDO. A value the dictionary refuses leaves the object as it was."""

    def __init__(self, slave: Slave, number: int) -> None:
        self._slave = slave
        self.record = PdoRecord(slave.od, number, transmit=False, changed=self._changed)
        self._deadline = slave.timers.add(self._miss_deadline)
        self._unpack = struct.Struct("").unpack_from
        self._writers: list[Callable[[Value], None]] = []
        self.pending: bytes | None = None
        """Frame received since the last SYNC."""
        self.window_end = math.inf
        """Bus time after which a synchronous frame comes too late (1007h)."""
        self.fault = 0
        """EMCY code of what is wrong with this PDO, 0 if nothing."""
        self.configure()

    def configure(self) -> None:
        """Take parameters and mapping from the dictionary."""
        self.parameters = self.record.parameters()
        mapping = self.record.mapping()
        layout = struct.Struct(
            "<" + "".join(m.codec.letter if m.entry else f"{m.codec.size}x" for m in mapping)
        )
        self._size = layout.size
        self._unpack = layout.unpack_from
        self._writers = [_writer(m.entry) for m in mapping if m.entry]
        self.synchronous = self.parameters.transmission <= 240
        self.usable = self.parameters.exists and bool(mapping)
        self.stop()

    def _changed(self) -> None:
        self.configure()
        self._slave.pdo.collect()

    def stop(self) -> None:
        """Forget what was received; deadline monitoring waits for the first frame again."""
        self.pending = None
        self.window_end = math.inf
        self._deadline.stop()

    def receive(self, frame: bytes, now: float) -> None:
        """Take a frame: keep it for the SYNC, or write it at once."""
        if frame[4] != self._size:
            self._set_fault(emcy.PDO_TOO_LONG if frame[4] > self._size else emcy.PDO_TOO_SHORT)
            if frame[4] < self._size:
                return
        elif self.fault:
            self._set_fault(0)
        if self.parameters.event_s:
            self._deadline.arm(now + self.parameters.event_s)
        if not self.synchronous:
            self.pending = frame
            self.apply()
            self._slave.app.after_rpdo(now)
        elif now <= self.window_end:
            self.pending = frame

    def apply(self) -> None:
        """Write the pending frame into the dictionary."""
        frame, self.pending = self.pending, None
        if frame is not None:
            # as many as each other: both are made from the mapping
            for write, value in zip(self._writers, self._unpack(frame, 8)):  # noqa: B905
                write(value)

    def _miss_deadline(self, _now: float) -> None:
        self._set_fault(emcy.RPDO_TIMEOUT)
        self._slave.app.on_rpdo_timeout(self.record.number)

    def _set_fault(self, code: int) -> None:
        if code != self.fault:
            self.fault = code
            self._slave.pdo.report_faults()


def _writer(entry: Entry) -> Callable[[Value], None]:
    codec = entry.codec
    if entry.hook is None and (entry.low, entry.high) == (codec.low, codec.high):

        def store(value: Value) -> None:
            entry.value = value

        return store

    def write(value: Value) -> None:
        try:
            entry.write(value)
        except SdoAbort:
            return

    return write
