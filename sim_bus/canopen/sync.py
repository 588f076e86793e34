"""SYNC consumer: 1005h identifier, 1006h period, 1007h window, 1019h counter."""

from __future__ import annotations

from cdpr_sim_bus.canopen import cob_ids, emcy
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.dictionary.datatypes import Value
from cdpr_sim_bus.canopen.slave import NmtState, Slave

_PRODUCER = 0x40000000
_MAX_COUNTER = 240


class SyncConsumer:
    """Takes SYNC in PRE-OPERATIONAL and OPERATIONAL."""

    def __init__(self, slave: Slave) -> None:
        self._slave = slave
        self.counted = False
        """Whether SYNC carries a counter (1019h not 0)."""
        self.identifier = 0x80
        self._operational = False
        self._length_error = False
        od = slave.od
        for index, hook in (
            (0x1005, self._write_cob_id),
            (0x1006, lambda value: self._store(0x1006, int(value))),
            (0x1007, lambda value: self._store(0x1007, int(value))),
            (0x1019, self._write_overflow),
        ):
            if (index, 0) in od:
                od.on_write(index, 0, hook)

    def configure(self) -> None:
        """Take the parameters from the dictionary."""
        slave, od = self._slave, self._slave.od
        self.identifier = od.get_int(0x1005, 0, 0x80) & 0x7FF
        self.counted = od.get_int(0x1019, 0, 0) > 1
        slave.sync_period_s = od.get_int(0x1006, 0, 0) * 1e-6
        slave.pdo.window_s = od.get_int(0x1007, 0, 0) * 1e-6
        self._length_error = False

    def set_state(self) -> None:
        """Follow the NMT state."""
        self._operational = self._slave.nmt_state == NmtState.OPERATIONAL

    def receive(self, frame: bytes, now: float) -> None:
        """Take a SYNC frame."""
        if frame[4] != self.counted:
            self._length_error = True
            self._slave.communication_error(emcy.SYNC_LENGTH)
            return
        if self._length_error:
            self._length_error = False
            self._slave.communication_error_clear(emcy.SYNC_LENGTH)
        slave = self._slave
        slave.app.before_sync(now)
        if self._operational:
            slave.pdo.at_sync(now, frame[8])

    def _write_cob_id(self, value: Value) -> None:
        new = int(value)
        if new & _PRODUCER or cob_ids.is_restricted(new & 0x1FFFFFFF) or new & 0x20000000:
            raise SdoAbort(Abort.INVALID_VALUE)
        self._store(0x1005, new)
        self._slave.rebuild_handlers()

    def _write_overflow(self, value: Value) -> None:
        new = int(value)
        if new == 1 or new > _MAX_COUNTER:
            raise SdoAbort(Abort.INVALID_VALUE)
        if self._slave.od.get_int(0x1006, 0, 0):
            raise SdoAbort(Abort.DEVICE_STATE)
        self._store(0x1019, new)
        self._slave.pdo.set_state()

    def _store(self, index: int, value: int) -> None:
        self._slave.od.set(index, 0, value)
        self.configure()
