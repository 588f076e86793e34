"""Emergency producer: 1001h error register, 1003h history, 1014h COB-ID, 1015h inhibit time."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from cdpr_sim_bus.canopen import slave as cob_ids
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.od import Value
from cdpr_sim_bus.canopen.slave import NmtState
from cdpr_sim_bus.frame import pack_frame

if TYPE_CHECKING:
    from cdpr_sim_bus.canopen.node import CanopenSlave

SYNC_LENGTH = 0x8240
HEARTBEAT = 0x8130
PDO_TOO_SHORT = 0x8210
PDO_TOO_LONG = 0x8220
RPDO_TIMEOUT = 0x8250

COMMUNICATION_BIT = 0x10
"""Communication error in 1001h."""
COMMUNICATION = "communication"
"""Source of errors that the communication part detects; the application's source is ""."""

_INVALID = 0x80000000
_QUEUE_LENGTH = 16
_LAYOUT = struct.Struct("<HB5s")


class EmergencyProducer:
    """Active errors, their EMCY messages and their history."""

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave = slave
        self._od = od = slave.od
        self._active: dict[int, int] = {}
        self._sources: dict[int, set[str]] = {}
        self._queue: deque[bytes] = deque(maxlen=_QUEUE_LENGTH)
        self._history: list[int] = []
        self._history_length = len(od.subs(0x1003))
        self._free_at = 0.0
        self._timer = slave.timers.add(self._send)
        if (0x1003, 0) in od:
            od.on_read(0x1003, 0, lambda: len(self._history))
            od.on_write(0x1003, 0, self._clear_history)
            for entry in od.subs(0x1003):
                entry.getter = self._history_reader(entry.sub - 1)
        if (0x1014, 0) in od:
            od.on_write(0x1014, 0, self._check_cob_id)

    def raise_error(
        self, code: int, register_bits: int, vendor: bytes = b"", source: str = ""
    ) -> None:
        """Raise an error for `source`, and report it if it is not active yet.

        The error stays active until each source that raised it has cleared it.
        `register_bits` are its bits in 1001h, `vendor` is up to 5 bytes for the EMCY frame.
        """
        self._sources.setdefault(code, set()).add(source)
        if code in self._active:
            return
        self._active[code] = register_bits | 1
        self._update_register()
        self._history.insert(0, code | int.from_bytes(vendor[:2], "little") << 16)
        del self._history[self._history_length :]
        self._enqueue(code, vendor)

    def clear(self, code: int | None = None, source: str = "") -> None:
        """Clear one error of `source`, or all errors of all sources.

        When the last source clears an error, an EMCY with code 0000h reports the remaining
        register.
        """
        if code is None:
            standing = bool(self._active)
            self._active.clear()
            self._sources.clear()
        else:
            sources = self._sources.get(code, set())
            sources.discard(source)
            standing = not sources and self._active.pop(code, None) is not None
        if standing:
            self._update_register()
            self._enqueue(0, b"")

    def reset_communication(self) -> None:
        """Forget unsent frames and communication errors; keep the application's errors."""
        for sources in self._sources.values():
            sources.discard(COMMUNICATION)
        self._active = {c: bits for c, bits in self._active.items() if self._sources.get(c)}
        self._queue.clear()
        self._timer.stop()
        self._free_at = 0.0
        self._update_register()

    def reset_node(self) -> None:
        """Forget every error and the history."""
        self._active.clear()
        self._sources.clear()
        self._history.clear()
        self._update_register()

    def flush(self, now: float) -> None:
        """Send the frames that had to wait for the NMT state."""
        if self._queue:
            self._send(now)

    def _update_register(self) -> None:
        register = 0
        for bits in self._active.values():
            register |= bits
        self._od.set(0x1001, 0, register)

    def _enqueue(self, code: int, vendor: bytes) -> None:
        register = self._od.get_int(0x1001)
        self._queue.append(_LAYOUT.pack(code, register, vendor))
        self._send(self._slave.now)

    def _send(self, now: float) -> None:
        slave = self._slave
        if slave.nmt_state not in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            return
        cob_id = self._od.get_int(0x1014, 0, cob_ids.EMCY + slave.node_id)
        inhibit_s = self._od.get_int(0x1015, 0, 0) * 1e-4
        while self._queue:
            if now < self._free_at - 1e-9:
                self._timer.arm(self._free_at)
                return
            data = self._queue.popleft()
            if not cob_id & _INVALID:
                slave.outbox.append(pack_frame(cob_id & 0x7FF, data))
                self._free_at = now + inhibit_s

    def _history_reader(self, position: int) -> Callable[[], Value]:
        def read() -> int:
            if position >= len(self._history):
                raise SdoAbort(Abort.NO_DATA)
            return self._history[position]

        return read

    def _clear_history(self, value: Value) -> None:
        if value != 0:
            raise SdoAbort(Abort.INVALID_VALUE)
        self._history.clear()

    def _check_cob_id(self, value: Value) -> None:
        new, old = int(value), self._od.get_int(0x1014)
        identifier = new & 0x1FFFFFFF
        both_valid = not (new | old) & _INVALID
        if new & 0x60000000 or (both_valid and identifier != old & 0x1FFFFFFF):
            raise SdoAbort(Abort.INVALID_VALUE)
        if not new & _INVALID and cob_ids.is_restricted(identifier):
            raise SdoAbort(Abort.INVALID_VALUE)
