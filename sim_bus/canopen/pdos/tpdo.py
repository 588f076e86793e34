"""Transmit PDO: sampling of mapped objects and the transmission types of CiA 301."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable

from cdpr_sim_bus.canopen import cob_ids
from cdpr_sim_bus.canopen.application import NmtState
from cdpr_sim_bus.canopen.dictionary.datatypes import Value
from cdpr_sim_bus.canopen.dictionary.od import Entry
from cdpr_sim_bus.canopen.pdos.pdo_parameters import PdoRecord
from cdpr_sim_bus.canopen.slave import Slave

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
