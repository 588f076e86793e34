"""All PDOs of a slave: what happens at a SYNC and between."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_sim_bus.canopen import cob_ids, emcy
from cdpr_sim_bus.canopen.application import NmtState
from cdpr_sim_bus.canopen.pdos.rpdo import Rpdo
from cdpr_sim_bus.canopen.pdos.tpdo import EVERY_SYNC, RTR_SYNCHRONOUS, Tpdo
from cdpr_sim_bus.canopen.slave import Slave
from cdpr_sim_bus.frame import RTR_FLAG

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
