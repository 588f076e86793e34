"""Error control of CiA 301: heartbeat producer (1017h), node guarding answer, consumers (1016h)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cdpr_sim_bus.canopen import emcy
from cdpr_sim_bus.canopen import slave as cob_ids
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.od import Value
from cdpr_sim_bus.canopen.slave import NmtState
from cdpr_sim_bus.frame import pack_frame

if TYPE_CHECKING:
    from cdpr_sim_bus.canopen.node import CanopenSlave


class HeartbeatProducer:
    """Sends the NMT state every 1017h ms, the first one a period after the boot-up message."""

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave = slave
        self._timer = slave.timers.add(self._beat)
        self._period_s = 0.0
        self._next = 0.0
        self._toggle = 0
        if (0x1017, 0) in slave.od:
            slave.od.on_write(0x1017, 0, lambda value: self._start(int(value)))

    def boot(self) -> None:
        """Send the boot-up message and read the period from 1017h."""
        slave = self._slave
        slave.outbox.append(pack_frame(cob_ids.ERROR_CONTROL + slave.node_id, b"\x00"))
        self._toggle = 0
        self._start(slave.od.get_int(0x1017, 0, 0))

    def delay(self, by_s: float) -> None:
        """Send the next heartbeat, and all that follow, this much later."""
        if self._period_s:
            self._next += by_s
            self._timer.arm(self._next)

    def answer_guarding(self, _frame: bytes, _now: float) -> None:
        """Answer a remote request as a guarded node would, unless heartbeats are in use."""
        if self._period_s == 0.0:
            state = self._slave.nmt_state | self._toggle
            self._send(state)
            self._toggle ^= 0x80

    def _start(self, period_ms: int) -> None:
        self._period_s = period_ms * 1e-3
        self._timer.stop()
        if period_ms:
            self._next = self._slave.now + self._period_s
            self._timer.arm(self._next)

    def _beat(self, now: float) -> None:
        self._send(self._slave.nmt_state)
        self._next += self._period_s
        if self._next <= now:
            self._next = now + self._period_s
        self._timer.arm(self._next)

    def _send(self, state: int) -> None:
        slave = self._slave
        slave.outbox.append(pack_frame(cob_ids.ERROR_CONTROL + slave.node_id, bytes([state])))


class _Consumer:
    """Monitor of one node, configured by one sub-index of 1016h."""

    def __init__(self, owner: HeartbeatConsumers, slave: CanopenSlave) -> None:
        self._owner = owner
        self._timer = slave.timers.add(lambda _now: self._lose())
        self.node = 0
        self.period_s = 0.0
        self.running = False
        self.lost = False

    def configure(self, value: int) -> None:
        """Apply a value of 1016h (node << 16 | ms); monitoring begins with a heartbeat."""
        self.node = value >> 16 & 0x7F
        self.period_s = (value & 0xFFFF) * 1e-3
        self.running = self.lost = False
        self._timer.stop()

    def receive(self, frame: bytes, now: float) -> None:
        """Process a heartbeat or boot-up message of the node."""
        if frame[4] != 1:
            return
        if frame[8] == 0:
            if self.running:
                self._lose()
            return
        self.running = True
        self._timer.arm(now + self.period_s)
        if self.lost:
            self.lost = False
            self._owner.recovered()

    def _lose(self) -> None:
        self.running = False
        self.lost = True
        self._timer.stop()
        self._owner.node_lost(self.node)


class HeartbeatConsumers:
    """Monitor the nodes of 1016h: silence or restart is error 8130h, with the reaction of 1029h.

    Monitoring of a node starts with its first heartbeat, and again with the first one after a
    loss, which clears the error.
    """

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave = slave
        self._consumers: list[_Consumer] = []
        for entry in slave.od.subs(0x1016):
            consumer = _Consumer(self, slave)
            self._consumers.append(consumer)
            entry.hook = lambda value, consumer=consumer: self._write(consumer, value)

    def configure(self) -> None:
        """Apply the present value of 1016h in the dictionary."""
        for consumer, entry in zip(self._consumers, self._slave.od.subs(0x1016), strict=True):
            value = entry.value
            consumer.configure(value if isinstance(value, int) else 0)

    def handlers(self) -> dict[int, cob_ids.Handler]:
        """Frame handlers by identifier for the nodes monitored now."""
        return {
            cob_ids.ERROR_CONTROL + consumer.node: consumer.receive
            for consumer in self._consumers
            if consumer.node and consumer.period_s
        }

    def node_lost(self, node: int) -> None:
        """React to the loss of a node: EMCY, NMT state from 1029h:01, the application."""
        slave = self._slave
        slave.communication_error(emcy.HEARTBEAT, bytes([node]))
        # Inform the application first: it must see the loss itself, not a change of NMT state.
        slave.app.on_heartbeat_lost(node)
        behaviour = slave.od.get_int(0x1029, 1, 0)
        if behaviour == 0 and slave.nmt_state == NmtState.OPERATIONAL:
            slave.set_nmt_state(NmtState.PRE_OPERATIONAL)
        elif behaviour == 2:
            slave.set_nmt_state(NmtState.STOPPED)

    def recovered(self) -> None:
        """Clear the error when no node is missing."""
        if not any(consumer.lost for consumer in self._consumers):
            self._slave.communication_error_clear(emcy.HEARTBEAT)

    def _write(self, consumer: _Consumer, value: Value) -> None:
        new = int(value)
        node, period_ms = new >> 16 & 0xFF, new & 0xFFFF
        if new >> 24:
            raise SdoAbort(Abort.INVALID_VALUE)
        if node and period_ms:
            if node > 127:
                raise SdoAbort(Abort.INVALID_VALUE)
            others = (c for c in self._consumers if c is not consumer and c.period_s)
            if any(other.node == node for other in others):
                raise SdoAbort(Abort.INCOMPATIBLE_PARAMETER)
        else:
            new = 0
        consumer.configure(new)
        self.recovered()
        self._slave.rebuild_handlers()
