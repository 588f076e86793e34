"""Acyclic side of a CANopen bus: SDO, NMT, EMCY, heartbeats and the state of the wire."""

from __future__ import annotations

import math
from collections.abc import Iterable

from canopen.objectdictionary import ObjectDictionary

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.frames import EFF_FLAG, ERR_FLAG, FRAME, RTR_FLAG
from cdpr_drivers.bus.health import BusState
from cdpr_drivers.bus.member import BusMember
from cdpr_drivers.canopen import emergency as emcy
from cdpr_drivers.canopen import error_control as nmt
from cdpr_drivers.canopen.emergency import Emergency, EmergencyLog
from cdpr_drivers.canopen.error_control import ErrorControl
from cdpr_drivers.canopen.sdo_access import ObjectAccess
from cdpr_drivers.canopen.sdo_frames import ANSWER
from cdpr_drivers.cia402 import DISABLE_VOLTAGE, POWER_OFF, state_of
from cdpr_drivers.errors import BusError, DriverError, SdoError
from cdpr_rt.core.clock import Clock

_SYNC, _EMCY, _HEARTBEAT = 0x080, 0x080, 0x700
_FUNCTION, _NODE = 0x780, 0x07F
_EXACT_ID_MASK = 0x7FF | EFF_FLAG | RTR_FLAG
_RPDO_TIMEOUT = 0x8250
_START, _ENTER_PRE_OPERATIONAL, _RESET_NODE, _RESET_COMMUNICATION = 1, 128, 129, 130
_LOOK_S = 0.1
"""How often heartbeats are checked."""
_LOCKSTEP_SLACK_S = 1.0
"""Slack for heartbeats of a bus in lockstep that another process leads: its time may stand."""
_FEWEST_SYNCS = 2
"""A single SYNC may be the last of a master that has just ended."""
_FEWEST_UNEXPECTED = 3
_MOST_BOOT_UPS = 4
_OPERATIONAL_DATA = bytes([nmt.OPERATIONAL])
_LATE_ANSWERS_S = 0.05
"""A second device may be slower than the first."""


class CanNetwork(BusMember, ObjectAccess):
    """Acyclic side of a CANopen master on one bus; it waits by `clock` only.

    While no cycles run it produces the master's heartbeat and watches those of the nodes, whenever
    somebody waits; `hand_heartbeat_to_cycle` hands both duties to the cycle, so that a hung loop is
    silent and the drives stop. It has the only port on the bus: a cycle uses `reader` as well.
    Raises BusError when the bus cannot be opened.
    """

    def __init__(
        self,
        url: BusUrl,
        clock: Clock,
        node_ids: Iterable[int],
        master_node_id: int,
        heartbeat_s: float,
    ) -> None:
        ids = list(node_ids)
        self._filters = [(base + node, _EXACT_ID_MASK) for node in ids for base in (_EMCY, ANSWER)]
        self._filters += [(_HEARTBEAT + node, _EXACT_ID_MASK) for node in (*ids, master_node_id)]
        self._filters.append((_SYNC, _EXACT_ID_MASK))
        self.log = EmergencyLog()
        self.emergencies = self.log.kept
        self.alarm_text = ""
        """Why the drives must not go on being driven; latched until `clear_alarm`."""
        self.cycling = False
        self.heartbeat_s = heartbeat_s
        self.heartbeat_frame = FRAME.pack(_HEARTBEAT + master_node_id, 1, _OPERATIONAL_DATA)
        self._master_node_id = master_node_id
        self._other_heartbeats = self._other_syncs = 0
        self._heartbeat_at_s = math.inf
        self._look_at_s = 0.0
        BusMember.__init__(self, url, clock, self._filters)
        ObjectAccess.__init__(self, self.send, clock)
        self.lockstep = self.reader.leads_time or (
            url.asks_for_lockstep or self.reader.port.status.get("mode") == "lockstep"
        )
        """Whether the bus' time advances by SYNC."""
        lockstep_of_another = self.lockstep and not self.reader.leads_time
        self._errors = ErrorControl(
            self.raise_alarm, clock, _LOCKSTEP_SLACK_S if lockstep_of_another else 0.0
        )
        self.restarted = self._errors.restarted
        """Nodes that restarted unexpectedly: their configuration and encoder positions are void."""

    def add_node(self, node_id: int, dictionary: ObjectDictionary) -> None:
        """Add a node with the object dictionary of its EDS."""
        self._errors.add(node_id)
        super().add_node(node_id, dictionary)

    # -- as a source of the clock

    def tick(self, now_s: float) -> float:
        """Send the master's heartbeat where it is due, and look for nodes that are lost."""
        if self.cycling:
            return math.inf
        if now_s >= self._heartbeat_at_s:
            self.start_heartbeat()
        # only when no frame waits: the heartbeat may be among those
        if now_s >= self._look_at_s and not self.poll():
            self._look_at_s = now_s + _LOOK_S
            self._errors.look_for_losses()
        return min(self._heartbeat_at_s, self._look_at_s)

    def on_loss(self, error: BusError) -> None:
        """End transfers at once and raise the alarm."""
        self._fail_transfers(error)
        self.raise_alarm(str(error))

    # -- what comes in

    def set_extra_filters(self, identifiers: Iterable[int]) -> None:
        """Receive these identifiers too, in place of those of an earlier call; raises BusError."""
        self.reader.set_filters([*self._filters, *((i, _EXACT_ID_MASK) for i in identifiers)])

    def take_frame(self, frame: memoryview) -> None:
        """Process one frame; one that is no valid CANopen message is ignored."""
        identifier, length, data = FRAME.unpack_from(frame)
        if identifier & ERR_FLAG:
            self._on_error_frame(identifier, data)
            return
        if identifier & (EFF_FLAG | RTR_FLAG):
            return
        node_id, function = identifier & _NODE, identifier & _FUNCTION
        if identifier == _SYNC:
            self._other_syncs += 1
        elif identifier == _HEARTBEAT + self._master_node_id:
            self._other_heartbeats += 1
        elif node_id not in self.clients:
            return
        elif function == ANSWER and length == 8:
            self.clients[node_id].on_answer(data)
        elif function == _EMCY and length == emcy.LENGTH:
            self._on_emergency(Emergency.from_frame(node_id, data, self.clock.now_s))
        elif function == _HEARTBEAT and length == 1:
            state = data[0] & 0x7F
            if state == nmt.BOOT_UP:
                self.log.forget(node_id)
            self._errors.take(node_id, state)

    def detect_master(self, seconds: float) -> str:
        """Return what another master sends within `seconds` (heartbeat, SYNC), or an empty text."""
        self._other_syncs = 0
        self.clock.wait(self._detected_master, self.clock.now_s + seconds)
        return self._detected_master()

    def _detected_master(self) -> str:
        if self._other_heartbeats:
            return "heartbeat"
        return "SYNC" if self._other_syncs >= _FEWEST_SYNCS else ""

    def _on_emergency(self, emergency: Emergency) -> None:
        flood = self.log.add(emergency)
        if flood:
            self.raise_alarm(flood)
        if emergency.code == _RPDO_TIMEOUT and not self.cycling:
            return  # commands are missing because none are sent between cycles
        if not emergency.is_reset:
            self.raise_alarm(f"emergency message: {emergency}")

    def _on_error_frame(self, identifier: int, data: bytes) -> None:
        self.health.take_error(identifier, data)
        if not self.health.usable:
            self.raise_alarm(self._bus_off())

    def _bus_off(self) -> str:
        return (
            f"{self.url}: the CAN controller is {self.health.text}; nothing can be sent. Check "
            "cable, termination and bit rate, then restart the interface (ip link set IFACE type "
            "can restart, or restart-ms)"
        )

    def raise_alarm(self, text: str) -> None:
        """Latch an alarm, which stops the drives; the first reason is kept."""
        self.alarm_text = self.alarm_text or text

    def clear_alarm(self) -> None:
        """Clear the latched alarm, except for bus-off while it lasts."""
        self.alarm_text = "" if self.health.state < BusState.BUS_OFF else self._bus_off()

    # -- what goes out

    def reset_communication(self, node_id: int, timeout_s: float) -> bool:
        """Reset the node's communication; return whether its boot-up message came in time.

        Raises BusError.
        """
        self.clients[node_id].unexpected = 0
        self._errors.expect_reset(node_id)
        self._command(_RESET_COMMUNICATION, node_id)
        return self._errors.wait_for_boot_up(node_id, timeout_s)

    def duplicate_node(self, node_id: int) -> str:
        """Return evidence of two devices with this node id since its reset, or an empty text."""
        boot_ups = self._errors.boot_ups_since_reset(node_id)
        # more of them are the heartbeats of a device that stays in NMT state initialising
        if 1 < boot_ups <= _MOST_BOOT_UPS:
            return f"two devices have this node id: {boot_ups} boot-up messages followed one reset"
        unexpected = self.clients[node_id].await_unexpected(_LATE_ANSWERS_S)
        if unexpected >= _FEWEST_UNEXPECTED:
            return (
                f"two devices have this node id, or another program reads it by SDO at the same "
                f"time: {unexpected} answers came that we had not asked for"
            )
        return ""

    def start(self, node_id: int, heartbeat_s: float = 0.0) -> None:
        """Command the node to operational, and watch from now on that it stays so; BusError.

        `heartbeat_s` is the period of its heartbeat, whose loss between cycles is an alarm then.
        """
        self._errors.expect_start(node_id, heartbeat_s)
        self._command(_START, node_id)

    def stop_process_data(self, node_id: int) -> None:
        """Command the node to pre-operational, where it takes and sends no PDOs; BusError."""
        self._errors.expect_stop(node_id)
        self._command(_ENTER_PRE_OPERATIONAL, node_id)

    def reset(self, node_id: int) -> None:
        """Reset the whole node, as the last resort to take its power away; BusError."""
        self._errors.expect_reset(node_id)
        self._command(_RESET_NODE, node_id)

    def switch_off(self, node_id: int) -> bool:
        """Take the power from one drive by SDO and return whether it says that it has none.

        For when no cycles run or it does not follow them. One that does not say so is reset, as the
        last resort. Raises BusError.
        """
        try:
            self.write(node_id, 0x6040, 0, DISABLE_VOLTAGE)
            if state_of(self.read_int(node_id, 0x6041)) in POWER_OFF:
                return True
        except SdoError:
            pass  # it does not listen to SDO either
        self.reset(node_id)
        return False

    def release(self, node_id: int) -> None:
        """Leave a node alone: without power it need not watch the master's heartbeat any more.

        Otherwise it would report the missing heartbeat to the next master. Best effort; a node
        that may still have power goes on watching, so that it stops by itself.
        """
        self._errors.release(node_id)
        try:
            if state_of(self.read_int(node_id, 0x6041, attempts=1)) in POWER_OFF:
                self._stop_watch(node_id)
                self.stop_process_data(node_id)
        except DriverError:
            return

    def _stop_watch(self, node_id: int) -> None:
        """Take this master out of the consumer heartbeats of a node (1016h)."""
        if 0x1016 not in self.dictionary(node_id):
            return
        entries = range(1, self.read_int(node_id, 0x1016) + 1)
        watch = [(sub, self.read_int(node_id, 0x1016, sub)) for sub in entries]
        for sub, value in watch:
            if value >> 16 & _NODE == self._master_node_id:
                self.write(node_id, 0x1016, sub, 0)

    def _command(self, command: int, node_id: int) -> None:
        self.send(0, bytes([command, node_id]))

    def wait_for_heartbeat(self, node_id: int, timeout_s: float) -> int | None:
        """Return the NMT state of the node's next heartbeat, None when none came."""
        return self._errors.wait_for_heartbeat(node_id, timeout_s)

    # -- heartbeat of the master

    def hand_heartbeat_to_cycle(self) -> None:
        """Hand the master's heartbeat to the cycle, so that it stops with a hung cycle."""
        self.cycling = True

    def release_cycle(self) -> None:
        """Take the master's heartbeat back from the cycle, and the watch on the nodes'."""
        self._errors.restart_watch()
        if self.cycling:
            self.cycling = False
            self.start_heartbeat()  # the cycle's last one may be a whole period ago

    def start_heartbeat(self) -> None:
        """Begin to produce the master's heartbeat; the drives watch it from the first one on."""
        # twice as often as configured: a master that computes for a while does not wait
        self._heartbeat_at_s = self.clock.now_s + 0.5 * self.heartbeat_s
        try:
            self.send_frame(self.heartbeat_frame)
        except BusError:
            return  # should the bus not come back, the drives stop by themselves
