"""CANopen slave: one node of CiA 301 and CiA 305 without an application."""

from __future__ import annotations

import struct

from cdpr_sim_bus.canopen import emcy
from cdpr_sim_bus.canopen import slave as cob_ids
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.emcy import EmergencyProducer
from cdpr_sim_bus.canopen.heartbeat import HeartbeatConsumers, HeartbeatProducer
from cdpr_sim_bus.canopen.lss import UNCONFIGURED, LssSlave
from cdpr_sim_bus.canopen.od import APPLICATION, COMMUNICATION, ObjectDictionary, Value
from cdpr_sim_bus.canopen.pdo import PdoService
from cdpr_sim_bus.canopen.sdo import SdoServer
from cdpr_sim_bus.canopen.slave import NmtState, SlaveApplication, Timers
from cdpr_sim_bus.canopen.store import (
    ConfigurationStamp,
    ParameterStore,
    add_store_objects,
)
from cdpr_sim_bus.frame import RTR_FLAG

# SYNC consumer: 1005h identifier, 1006h period, 1007h window, 1019h counter.

_PRODUCER = 0x40000000
_MAX_COUNTER = 240


class SyncConsumer:
    """Processes SYNC in PRE-OPERATIONAL and OPERATIONAL."""

    def __init__(self, slave: CanopenSlave) -> None:
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
        """Read the parameters from the dictionary."""
        slave, od = self._slave, self._slave.od
        self.identifier = od.get_int(0x1005, 0, 0x80) & 0x7FF
        self.counted = od.get_int(0x1019, 0, 0) > 1
        slave.sync_period_s = od.get_int(0x1006, 0, 0) * 1e-6
        slave.pdo.window_s = od.get_int(0x1007, 0, 0) * 1e-6
        self._length_error = False

    def set_state(self) -> None:
        """Adapt to the NMT state."""
        self._operational = self._slave.nmt_state == NmtState.OPERATIONAL

    def receive(self, frame: bytes, now: float) -> None:
        """Process a SYNC frame."""
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


_IDENTIFIER = struct.Struct("<I").unpack_from
_NMT_COMMANDS = {
    1: NmtState.OPERATIONAL,
    2: NmtState.STOPPED,
    128: NmtState.PRE_OPERATIONAL,
}
_RESET_NODE = 129
_RESET_COMMUNICATION = 130


class CanopenSlave:
    """Communication part of a simulated device; all times are bus time in seconds.

    The first `advance` boots it. `outbox` always stays the same list: the sender of its frames
    empties it with `clear()`. A node id stored by LSS overrides `node_id`; 255 starts it
    unconfigured, with LSS only. `bitrate` is that of the bus; a node that LSS set to another rate
    receives nothing. `lss_hides_others`: see `LssSlave`. Raises DictionaryError if the EDS cannot
    be used.
    """

    def __init__(
        self,
        od: ObjectDictionary,
        node_id: int,
        app: SlaveApplication,
        *,
        store: ParameterStore | None = None,
        bitrate: int = 1_000_000,
        lss_hides_others: bool = False,
    ) -> None:
        self.od = od
        self.app = app
        self.store = store or ParameterStore()
        self.store.check(od)
        self.node_id = self.store.node_id or node_id
        """Active node id; 255 while unconfigured."""
        self.bus_bitrate = bitrate
        self.bitrate = self.store.bitrate or bitrate
        self.nmt_state = NmtState.INITIALISING
        self.sync_period_s = 0.0
        """Communication cycle period (1006h)."""
        self.outbox: list[bytes] = []
        """16-byte frames to send."""
        self.accepts: frozenset[int] = frozenset()
        """CAN identifiers that concern this node now."""
        self.now = 0.0
        """Bus time of the last call."""
        self.muted = self.bitrate != self.bus_bitrate
        """Whether the node is off the bus: its bit timing differs, or LSS is switching it."""
        self.timers = Timers()
        self.timers.add(self._boot).arm(0.0)
        self._handlers: dict[int, cob_ids.Handler] = {}
        od.set_node_id(self.node_id)
        od.power_on(COMMUNICATION)
        add_store_objects(self.store, od)
        self.stamp = ConfigurationStamp(od, self.store)
        self._emcy = EmergencyProducer(self)
        self._heartbeat = HeartbeatProducer(self)
        self._consumers = HeartbeatConsumers(self)
        self._sdo = SdoServer(self)
        self._lss = LssSlave(self, hides_others=lss_hides_others)
        self.sync = SyncConsumer(self)
        self.pdo = PdoService(self)

    def receive(self, frame: bytes, now: float) -> None:
        """Process a frame (16 bytes, struct can_frame) seen on the bus."""
        self.now = now
        handler = self._handlers.get(_IDENTIFIER(frame)[0])
        if handler is not None:
            handler(frame, now)
            if self.pdo.event_driven:
                self.pdo.offer_events(now)

    def advance(self, now: float) -> None:
        """Run the timers due until `now`, and check event-driven TPDOs for changes."""
        self.now = now
        if now >= self.timers.next_due:
            self.timers.run(now)
        if self.muted:
            self.outbox.clear()
        if self.pdo.event_driven and not self.muted:
            self.pdo.offer_events(now)

    def next_event(self) -> float:
        """Bus time by which `advance` must be called next; math.inf if there is no event."""
        return self.timers.next_due

    def emergency(self, code: int, register_bits: int, vendor: bytes = b"") -> None:
        """Report an error (EMCY, 1001h with bit 0 added, 1003h) unless it is already active."""
        self._emcy.raise_error(code, register_bits, vendor)

    def emergency_clear(self, code: int | None = None) -> None:
        """Clear one error, or all; send the EMCY error reset if there was any."""
        self._emcy.clear(code)

    def communication_error(self, code: int, vendor: bytes = b"") -> None:
        """Report an error of the communication itself."""
        self._emcy.raise_error(code, emcy.COMMUNICATION_BIT, vendor, emcy.COMMUNICATION)

    def communication_error_clear(self, code: int) -> None:
        """Clear a communication error; it stays active if the application has raised it too."""
        self._emcy.clear(code, emcy.COMMUNICATION)

    def delay_heartbeat(self, by_s: float) -> None:
        """Let the next heartbeat be late."""
        self._heartbeat.delay(by_s)

    def set_nmt_state(self, state: NmtState) -> None:
        """Change the NMT state, by command or because of the application (6007h)."""
        if state == self.nmt_state:
            return
        self.nmt_state = state
        if state in (NmtState.STOPPED, NmtState.INITIALISING):
            self._sdo.finish()
        self.sync.set_state()
        self.pdo.set_state()
        self._emcy.flush(self.now)
        self.app.on_nmt(state)

    def reset_node(self) -> None:
        """Restart the whole node with its power-on values."""
        self.set_nmt_state(NmtState.INITIALISING)
        self.store.load(self.od)
        self.od.power_on(APPLICATION)
        self._emcy.reset_node()
        self.stamp.reset_node()
        self.app.on_reset_node()
        self.reset_communication()

    def reset_communication(self) -> None:
        """Restart communication with its power-on values and the node id that LSS may have set."""
        self.set_nmt_state(NmtState.INITIALISING)
        self.node_id = self._lss.pending_node_id
        self.store.load(self.od)
        self.od.set_node_id(self.node_id)
        self.od.power_on(COMMUNICATION)
        self.stamp.reset_communication()
        self._emcy.reset_communication()
        self.pdo.forget_faults()
        self._consumers.configure()
        self.sync.configure()
        if self.node_id == UNCONFIGURED:
            self.rebuild_handlers()
            return
        self._heartbeat.boot()
        self.set_nmt_state(NmtState.PRE_OPERATIONAL)

    def rebuild_handlers(self) -> None:
        """Recompute the identifiers that the node receives."""
        handlers: dict[int, cob_ids.Handler] = {}
        state = self.nmt_state
        if state != NmtState.INITIALISING:
            handlers.update(self.pdo.handlers())
            handlers.update(self._consumers.handlers())
            if state != NmtState.STOPPED:
                handlers[self.sync.identifier] = self.sync.receive
                handlers[cob_ids.SDO_REQUEST + self.node_id] = self._sdo.receive
            guarding = cob_ids.ERROR_CONTROL + self.node_id | RTR_FLAG
            handlers[guarding] = self._heartbeat.answer_guarding
            handlers[cob_ids.NMT_COMMAND] = self._receive_nmt
        handlers[cob_ids.LSS_MASTER] = self._lss.receive
        if self.muted:
            handlers.clear()
        self._handlers = handlers
        self.accepts = frozenset(identifier & ~RTR_FLAG for identifier in handlers)

    def close(self) -> None:
        """Do nothing: the communication part has no open file."""

    def _boot(self, _now: float) -> None:
        self.reset_node()

    def _receive_nmt(self, frame: bytes, _now: float) -> None:
        command, node = frame[8], frame[9]
        if frame[4] != 2 or node not in (0, self.node_id):
            return
        if command == _RESET_NODE:
            self.reset_node()
        elif command == _RESET_COMMUNICATION:
            self.reset_communication()
        elif command in _NMT_COMMANDS:
            self.set_nmt_state(_NMT_COMMANDS[command])
