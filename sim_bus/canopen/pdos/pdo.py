"""PDOs of a slave: each one received or sent, and what happens to all at a SYNC and between.

Received frames go into the dictionary at the SYNC or at once, with deadline monitoring; mapped
objects are sampled and sent by the transmission types of CiA 301."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable

from cdpr_sim_bus.canopen import cob_ids, emcy
from cdpr_sim_bus.canopen.abort import SdoAbort
from cdpr_sim_bus.canopen.dictionary.datatypes import Value
from cdpr_sim_bus.canopen.dictionary.od import Entry
from cdpr_sim_bus.canopen.pdos.pdo_parameters import PdoRecord
from cdpr_sim_bus.canopen.slave import NmtState, Slave
from cdpr_sim_bus.frame import RTR_FLAG


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


ACYCLIC = 0
EVERY_SYNC = 1
RTR_SYNCHRONOUS = 252
RTR_EVENT = 253


class Tpdo:
    """One transmit PDO.

    Event-driven ones (254, 255) go out when their content differs from what was sent last, when
    the event timer runs out and when the application asks, never within the inhibit time, and
    once at the start. Type 0 goes out at the SYNC after its content changed.
    """

    def __init__(self, slave: Slave, number: int) -> None:
        self._slave = slave
        self.record = PdoRecord(slave.od, number, transmit=True, changed=self._changed)
        self._event = slave.timers.add(self.force)
        self._inhibit = slave.timers.add(self.offer)
        self.sample: Callable[[], bytes] = bytes
        """Build the frame from the present values."""
        self._last = b""
        self.configure()

    def configure(self) -> None:
        """Take parameters and mapping from the dictionary."""
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
        """Forget what was sent and stop the timers."""
        self._last = b""
        self._forced = False
        self._free_at = -math.inf
        self._countdown = 0
        self._event.stop()
        self._inhibit.stop()

    def start(self, now: float) -> None:
        """Begin transmission (the node became operational or the PDO was switched on)."""
        transmission = self.parameters.transmission
        waits = self._slave.sync.counted and self.parameters.sync_start
        self._countdown = -1 if waits else max(transmission, 1)
        if self.event_driven:
            self.offer(now)

    def at_sync(self, counter: int) -> None:
        """Sample, and send what the transmission type asks for."""
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
        """Send an event-driven PDO whose content changed, or once the inhibit time allows."""
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
        """Send an event-driven PDO whether its content changed or not."""
        self._forced = True
        self.offer(now)

    def answer_remote(self, _frame: bytes, _now: float) -> None:
        """Answer a remote request: with the SYNC's sample for type 252, else with a fresh one."""
        if self.parameters.transmission != RTR_SYNCHRONOUS:
            self._slave.outbox.append(self.sample())
        elif self._last:
            self._slave.outbox.append(self._last)


def _sampler(identifier: int, entries: list[Entry]) -> Callable[[], bytes]:
    """Return a function that packs a whole frame; spelt out for the usual numbers of objects."""
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
    """The PDOs of one slave. They exist on the bus in OPERATIONAL only."""

    def __init__(self, slave: Slave) -> None:
        self._slave = slave
        od = slave.od
        numbers = range(1, _MAX_PDOS + 1)
        self._rpdos = [Rpdo(slave, n) for n in numbers if (0x13FF + n, 1) in od]
        self._tpdos = [Tpdo(slave, n) for n in numbers if (0x17FF + n, 1) in od]
        self.window_s = 0.0
        """Synchronous window length (1007h), 0 for none."""
        self._rpdos_in_use: list[Rpdo] = []
        self._tpdos_in_use: list[Tpdo] = []
        self._sync_rpdos: list[Rpdo] = []
        self._every_sync: list[Callable[[], bytes]] = []
        self._other_sync: list[Tpdo] = []
        self.event_driven: list[Tpdo] = []
        """Event-driven TPDOs that are in use now."""

    def set_state(self) -> None:
        """Start or stop with the NMT state; parameters and the device's hooks are taken anew."""
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
        """Sort the PDOs in use by what they do, and have their frames delivered."""
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
        """Frame handlers by identifier; RPDOs that share one all get the frame."""
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
        """Forget what was wrong with RPDOs (communication starts afresh)."""
        for rpdo in self._rpdos:
            rpdo.fault = 0

    def report_faults(self) -> None:
        """Bring the EMCYs of RPDOs in line with what is wrong with them."""
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
