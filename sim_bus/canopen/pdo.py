"""PDOs of a slave: how each is received and sent, at SYNC and between SYNCs.

Received frames are written to the dictionary at the SYNC or immediately, and their deadlines are
monitored. Mapped objects are sampled and sent as the transmission types of CiA 301 specify.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cdpr_sim_bus.canopen import emcy
from cdpr_sim_bus.canopen import slave as cob_ids
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.od import CODECS, Codec, DictionaryError, Entry, ObjectDictionary, Value
from cdpr_sim_bus.canopen.slave import NmtState
from cdpr_sim_bus.frame import RTR_FLAG

if TYPE_CHECKING:
    from cdpr_sim_bus.canopen.node import CanopenSlave

# Communication and mapping parameters of one PDO (1400h, 1600h, 1800h, 1A00h and following).

INVALID = 0x80000000
"""Bit 31 of a COB-ID: the PDO does not exist."""
NO_RTR = 0x40000000
EXTENDED = 0x20000000

MAX_BITS = 64


@dataclass(frozen=True, slots=True)
class PdoParameters:
    """The communication parameters, decoded; times in seconds."""

    exists: bool
    identifier: int
    rtr_allowed: bool
    transmission: int
    inhibit_s: float
    event_s: float
    sync_start: int


@dataclass(frozen=True, slots=True)
class Mapped:
    """One mapped object; `entry` is None for a dummy, which only fills space."""

    codec: Codec
    entry: Entry | None


class PdoRecord:
    """Protects the parameters of one PDO from writes that CiA 301 forbids, and reports changes.

    Rules of CiA 301: while a PDO exists, its COB-ID, inhibit time and SYNC start value cannot
    change, and its mapping cannot be written. The entries of a mapping can be written only while
    the count is 0. The count is rejected if an entry cannot be mapped or the sum exceeds 8 bytes.
    """

    def __init__(
        self, od: ObjectDictionary, number: int, *, transmit: bool, changed: Callable[[], None]
    ) -> None:
        self.number = number
        """Number from 1, as in RPDO1."""
        self._od = od
        self._transmit = transmit
        self._changed = changed
        self._com = (0x1800 if transmit else 0x1400) + number - 1
        self._map = (0x1A00 if transmit else 0x1600) + number - 1
        hooks: dict[int, Callable[[int], None]] = {
            1: self._write_cob_id,
            2: self._write_transmission,
            3: self._write_while_absent(3),
            5: lambda value: self._store(5, value),
            6: self._write_while_absent(6),
        }
        for sub, hook in hooks.items():
            if (self._com, sub) in od:
                od.on_write(self._com, sub, lambda value, hook=hook: hook(int(value)))  # type: ignore[misc]
        if (self._map, 0) in od:
            self._drop_impossible_default()
            od.on_write(self._map, 0, self._write_count)
            for entry in od.subs(self._map):
                entry.hook = self._write_mapping

    def _drop_impossible_default(self) -> None:
        """Map nothing by default if the EDS contradicts its own map, as some files do."""
        count = self._od.entry(self._map)
        try:
            self._resolve_all(int(count.default))
        except SdoAbort:
            self._od.set_default(self._map, 0, 0)

    def parameters(self) -> PdoParameters:
        """Present communication parameters."""
        cob_id = self._get(1, INVALID)
        return PdoParameters(
            exists=not cob_id & INVALID,
            identifier=cob_id & 0x7FF,
            rtr_allowed=not cob_id & NO_RTR,
            transmission=self._get(2, 255),
            inhibit_s=self._get(3, 0) * 1e-4,
            event_s=self._get(5, 0) * 1e-3,
            sync_start=self._get(6, 0),
        )

    def mapping(self) -> list[Mapped]:
        """Mapped objects in order; raises DictionaryError for a mapping that is not allowed."""
        try:
            return self._resolve_all(self._od.get_int(self._map, 0, 0))
        except SdoAbort as abort:
            raise DictionaryError(
                f"object {self._map:04X}h: the stored mapping is not possible ({abort})"
            ) from abort

    def _get(self, sub: int, default: int) -> int:
        return self._od.get_int(self._com, sub, default)

    def _store(self, sub: int, value: int) -> None:
        self._od.set(self._com, sub, value)
        self._changed()

    def _locked(self) -> bool:
        """Return whether the map is locked: the PDO exists, and its COB-ID can be written."""
        fixed = (self._com, 1) in self._od and not self._od.entry(self._com, 1).writable
        return not fixed and not self._get(1, INVALID) & INVALID

    def _write_cob_id(self, new: int) -> None:
        old = self._get(1, INVALID)
        identifier = new & 0x1FFFFFFF
        if new & EXTENDED or (not new & INVALID and cob_ids.is_restricted(identifier)):
            raise SdoAbort(Abort.INVALID_VALUE)
        if not (old | new) & INVALID and identifier != old & 0x1FFFFFFF:
            raise SdoAbort(Abort.INVALID_VALUE)
        self._store(1, new)

    def _write_transmission(self, value: int) -> None:
        reserved = range(241, 252) if self._transmit else range(241, 254)
        if value in reserved:
            raise SdoAbort(Abort.INVALID_VALUE)
        self._store(2, value)

    def _write_while_absent(self, sub: int) -> Callable[[int], None]:
        def write(value: int) -> None:
            if self._locked() and value != self._get(sub, 0):
                raise SdoAbort(Abort.INVALID_VALUE)
            self._store(sub, value)

        return write

    def _write_count(self, value: Value) -> None:
        if self._locked():
            raise SdoAbort(Abort.DEVICE_STATE)
        self._resolve_all(int(value))
        self._od.set(self._map, 0, value)
        self._changed()

    def _write_mapping(self, value: Value) -> None:
        if self._locked() or self._od.get_int(self._map) != 0:
            raise SdoAbort(Abort.DEVICE_STATE)
        if value:
            self._resolve(int(value))

    def _resolve_all(self, count: int) -> list[Mapped]:
        if count > len(self._od.subs(self._map)):
            raise SdoAbort(Abort.PDO_LENGTH)
        mapped = [self._resolve(self._od.get_int(self._map, sub)) for sub in range(1, count + 1)]
        if sum(8 * (m.codec.size or 0) for m in mapped) > MAX_BITS:
            raise SdoAbort(Abort.PDO_LENGTH)
        return mapped

    def _resolve(self, value: int) -> Mapped:
        index, sub, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
        if index in self._od.dummies:
            mapped = Mapped(CODECS[index], None)
            allowed = sub == 0 and not self._transmit
        else:
            entry = self._od.find(index, sub)
            mapped = Mapped(entry.codec, entry)
            allowed = entry.transmittable if self._transmit else entry.receivable
        if not allowed or bits != 8 * (mapped.codec.size or 0):
            raise SdoAbort(Abort.NOT_MAPPABLE)
        return mapped


class Rpdo:
    """One receive PDO. A value that the dictionary rejects leaves the object unchanged."""

    def __init__(self, slave: CanopenSlave, number: int) -> None:
        self._slave = slave
        self.record = PdoRecord(slave.od, number, transmit=False, changed=self._changed)
        self._deadline = slave.timers.add(self._miss_deadline)
        self._unpack = struct.Struct("").unpack_from
        self._writers: list[Callable[[Value], None]] = []
        self.pending: bytes | None = None
        """Frame received since the last SYNC."""
        self.window_end = math.inf
        """Bus time after which a synchronous frame is too late (1007h)."""
        self.fault = 0
        """EMCY code of this PDO's error; 0 if it has none."""
        self.configure()

    def configure(self) -> None:
        """Read parameters and mapping from the dictionary."""
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
        """Forget received data; deadline monitoring starts again with the first frame."""
        self.pending = None
        self.window_end = math.inf
        self._deadline.stop()

    def receive(self, frame: bytes, now: float) -> None:
        """Process a frame: keep it for the SYNC, or write it immediately."""
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
            # both lists have the same length, because they are made from the mapping
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


ACYCLIC = 0
EVERY_SYNC = 1
RTR_SYNCHRONOUS = 252
RTR_EVENT = 253


class Tpdo:
    """One transmit PDO.

    Event-driven PDOs (254, 255) are sent once at the start, when their content has changed, when
    the event timer expires, and when the application requests it. They are never sent within the
    inhibit time. Type 0 is sent at the SYNC after its content changed.
    """

    def __init__(self, slave: CanopenSlave, number: int) -> None:
        self._slave = slave
        self.record = PdoRecord(slave.od, number, transmit=True, changed=self._changed)
        self._event = slave.timers.add(self.force)
        self._inhibit = slave.timers.add(self.offer)
        self.sample: Callable[[], bytes] = bytes
        """Builds the frame from the present values."""
        self._last = b""
        self.configure()

    def configure(self) -> None:
        """Read parameters and mapping from the dictionary."""
        self.parameters = self.record.parameters()
        entries = [m.entry for m in self.record.mapping() if m.entry]
        self.sample = _sampler(self.parameters.identifier, entries)
        self.event_driven = self.parameters.transmission > RTR_EVENT
        self.usable = self.parameters.exists and bool(entries)
        self.stop()

    def _changed(self) -> None:
        self.configure()
        slave = self._slave
        if self.usable and slave.nmt_state == NmtState.OPERATIONAL:
            self.start(slave.now)
        slave.pdo.collect()

    def stop(self) -> None:
        """Forget the sent content and stop the timers."""
        self._last = b""
        self._forced = False
        self._free_at = -math.inf
        self._countdown = 0
        self._event.stop()
        self._inhibit.stop()

    def start(self, now: float) -> None:
        """Start transmission (the node became operational or the PDO was switched on)."""
        transmission = self.parameters.transmission
        waits = self._slave.sync.counted and self.parameters.sync_start
        self._countdown = -1 if waits else max(transmission, 1)
        if self.event_driven:
            self.offer(now)

    def at_sync(self, counter: int) -> None:
        """Sample, and send if the transmission type requires it."""
        transmission = self.parameters.transmission
        if transmission == RTR_SYNCHRONOUS:
            self._last = self.sample()
        elif transmission == ACYCLIC:
            frame = self.sample()
            if frame != self._last:
                self._last = frame
                self._slave.outbox.append(frame)
        elif self._is_turn(counter):
            self._slave.outbox.append(self.sample())

    def _is_turn(self, counter: int) -> bool:
        if self._countdown < 0:
            if counter != self.parameters.sync_start:
                return False
            self._countdown = 1
        self._countdown -= 1
        if self._countdown:
            return False
        self._countdown = self.parameters.transmission
        return True

    def offer(self, now: float) -> None:
        """Send an event-driven PDO if its content changed, as soon as the inhibit time allows."""
        frame = self.sample()
        if frame == self._last and not self._forced:
            return
        if now < self._free_at - 1e-9:
            self._inhibit.arm(self._free_at)
            return
        self._last = frame
        self._forced = False
        self._slave.outbox.append(frame)
        self._free_at = now + self.parameters.inhibit_s
        if self.parameters.event_s:
            self._event.arm(now + self.parameters.event_s)

    def force(self, now: float) -> None:
        """Send an event-driven PDO even if its content has not changed."""
        self._forced = True
        self.offer(now)

    def answer_remote(self, _frame: bytes, _now: float) -> None:
        """Answer a remote request: for type 252 with the SYNC's sample, else with a new one."""
        if self.parameters.transmission != RTR_SYNCHRONOUS:
            self._slave.outbox.append(self.sample())
        elif self._last:
            self._slave.outbox.append(self._last)


def _sampler(identifier: int, entries: list[Entry]) -> Callable[[], bytes]:
    """Return a function that packs a whole frame; unrolled for common numbers of objects."""
    layout = "<" + "".join(entry.codec.letter for entry in entries)
    size = struct.calcsize(layout)
    frame = struct.Struct(f"{cob_ids.FRAME_HEAD}{layout[1:]}{8 - size}x")
    pack = frame.pack
    if len(entries) == 3 and not any(entry.getter for entry in entries):
        x, y, z = entries
        return lambda: pack(identifier, size, x.value, y.value, z.value)
    reads = [_reader(entry) for entry in entries]
    if len(reads) == 1:
        (a,) = reads
        return lambda: pack(identifier, size, a())
    if len(reads) == 2:
        a, b = reads
        return lambda: pack(identifier, size, a(), b())
    if len(reads) == 3:
        a, b, c = reads
        return lambda: pack(identifier, size, a(), b(), c())
    return lambda: pack(identifier, size, *[read() for read in reads])


def _reader(entry: Entry) -> Callable[[], Value]:
    return (lambda: entry.value) if entry.getter is None else entry.getter


_MAX_PDOS = 512


class PdoService:
    """The PDOs of one slave. They exist on the bus only in OPERATIONAL."""

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave = slave
        od = slave.od
        numbers = range(1, _MAX_PDOS + 1)
        self._rpdos = [Rpdo(slave, n) for n in numbers if (0x13FF + n, 1) in od]
        self._tpdos = [Tpdo(slave, n) for n in numbers if (0x17FF + n, 1) in od]
        self.window_s = 0.0
        """Synchronous window length (1007h); 0 for no window."""
        self._rpdos_in_use: list[Rpdo] = []
        self._tpdos_in_use: list[Tpdo] = []
        self._sync_rpdos: list[Rpdo] = []
        self._every_sync: list[Callable[[], bytes]] = []
        self._other_sync: list[Tpdo] = []
        self.event_driven: list[Tpdo] = []
        """Event-driven TPDOs in use now."""

    def set_state(self) -> None:
        """Start or stop with the NMT state; read parameters and the device's hooks again."""
        slave = self._slave
        for rpdo in self._rpdos:
            rpdo.configure()
        for tpdo in self._tpdos:
            tpdo.configure()
        if slave.nmt_state == NmtState.OPERATIONAL:
            for tpdo in self._tpdos:
                if tpdo.usable:
                    tpdo.start(slave.now)
        self.collect()

    def collect(self) -> None:
        """Sort the PDOs in use by type, and register for their frames."""
        slave = self._slave
        running = slave.nmt_state == NmtState.OPERATIONAL
        self._rpdos_in_use = [r for r in self._rpdos if running and r.usable]
        self._tpdos_in_use = [t for t in self._tpdos if running and t.usable]
        self._sync_rpdos = [r for r in self._rpdos_in_use if r.synchronous]
        self.event_driven = [t for t in self._tpdos_in_use if t.event_driven]
        counted = slave.sync.counted
        every, other = [], []
        for tpdo in self._tpdos_in_use:
            if _at_every_sync(tpdo, counted):
                every.append(tpdo.sample)
            elif tpdo.parameters.transmission <= RTR_SYNCHRONOUS:
                other.append(tpdo)
        self._every_sync, self._other_sync = every, other
        slave.rebuild_handlers()

    def handlers(self) -> dict[int, cob_ids.Handler]:
        """Frame handlers by identifier; RPDOs with the same identifier all receive the frame."""
        handlers: dict[int, cob_ids.Handler] = {}
        for rpdo in self._rpdos_in_use:
            identifier = rpdo.parameters.identifier
            earlier = handlers.get(identifier)
            handlers[identifier] = _both(earlier, rpdo.receive) if earlier else rpdo.receive
        for tpdo in self._tpdos_in_use:
            if tpdo.parameters.rtr_allowed:
                handlers[tpdo.parameters.identifier | RTR_FLAG] = tpdo.answer_remote
        return handlers

    def at_sync(self, now: float, counter: int) -> None:
        """Write received PDOs, let the application act, send synchronous TPDOs."""
        for rpdo in self._sync_rpdos:
            if rpdo.pending is not None:
                rpdo.apply()
        slave = self._slave
        slave.app.after_rpdo(now)
        outbox = slave.outbox
        for sample in self._every_sync:
            outbox.append(sample())
        for tpdo in self._other_sync:
            tpdo.at_sync(counter)
        if self.window_s:
            for rpdo in self._sync_rpdos:
                rpdo.window_end = now + self.window_s

    def offer_events(self, now: float) -> None:
        """Send event-driven TPDOs whose content changed."""
        for tpdo in self.event_driven:
            tpdo.offer(now)

    def forget_faults(self) -> None:
        """Clear the errors of RPDOs, because communication restarts."""
        for rpdo in self._rpdos:
            rpdo.fault = 0

    def report_faults(self) -> None:
        """Raise and clear the EMCYs of RPDOs to match their present errors."""
        for code in (emcy.PDO_TOO_SHORT, emcy.PDO_TOO_LONG, emcy.RPDO_TIMEOUT):
            numbers = [r.record.number for r in self._rpdos if r.fault == code]
            if numbers:
                self._slave.communication_error(code, bytes(numbers[:1]))
            else:
                self._slave.communication_error_clear(code)


def _at_every_sync(tpdo: Tpdo, counted: bool) -> bool:
    parameters = tpdo.parameters
    return parameters.transmission == EVERY_SYNC and not (counted and parameters.sync_start)


def _both(first: cob_ids.Handler, second: cob_ids.Handler) -> cob_ids.Handler:
    def receive(frame: bytes, now: float) -> None:
        first(frame, now)
        second(frame, now)

    return receive
