"""Acyclic side of a CANopen bus: SDO, NMT, EMCY, heartbeats and the state of the wire."""

from __future__ import annotations

import math
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, TypeVar

from canopen.objectdictionary import ObjectDictionary, ObjectDictionaryError, ODVariable

from cdpr_drivers.bus import BusHealth, BusState, BusUrl, Filters, open_port
from cdpr_drivers.bus.frames import EFF_FLAG, ERR_FLAG, FRAME, RTR_FLAG, FrameReader
from cdpr_drivers.bus.simbus import SimulatedBusClock
from cdpr_drivers.canopen import emergency as emcy
from cdpr_drivers.canopen import error_control as nmt
from cdpr_drivers.canopen.emergency import Emergency, EmergencyLog, ErrorRecord
from cdpr_drivers.canopen.error_control import ErrorControl
from cdpr_drivers.canopen.sdo import ANSWER, NO_DATA, NO_SUBINDEX, REQUEST, SdoClient
from cdpr_drivers.cia402 import DISABLE_VOLTAGE, POWER_OFF, fault_text, state_of
from cdpr_drivers.errors import (
    BusError,
    DriverError,
    SdoAbortError,
    SdoCancelledError,
    SdoError,
    SdoTimeoutError,
)
from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core import fault as faults
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.fault import BUS_LOST, BUS_OFF, Fault


class BusMember(ABC):
    """Base of members that send and receive frames on one bus; a source of `clock`.

    Frames are processed while a task waits by `clock`, which leads the bus if it can.

    Raises BusError if the bus cannot be opened.
    """

    def __init__(self, url: BusUrl, clock: Clock, filters: Filters) -> None:
        self.url = url
        self.clock = clock
        self.health = BusHealth()
        """State of the wire according to the controller's error frames."""
        self.reader = self._open(filters)
        self.reader.take = self.take
        self.reader.on_failure = self._lose
        clock.add(self)

    def _open(self, filters: Filters) -> FrameReader:
        clock = self.clock
        led = clock.acquire(self.url) if isinstance(clock, SimulatedBusClock) else None
        if led is None:
            return FrameReader(open_port(self.url, filters, self.health, receive_errors=True))
        led.set_filters(filters)
        led.settle()  # discards frames that were sent before
        return led

    # -- as a source of the clock

    def fileno(self) -> int:
        """Return the descriptor that is readable when a frame waits."""
        return self.reader.port.fileno()

    def poll(self) -> bool:
        """Process the frames that have arrived; remove a lost bus from the clock."""
        try:
            return self.reader.poll()
        except BusError as error:
            self._lose(error)
            return True

    def tick(self, now_s: float) -> float:  # noqa: ARG002  # no event is ever scheduled
        """Return infinity: no event is ever scheduled."""
        return math.inf

    def _lose(self, error: BusError) -> None:
        self.clock.remove(self)
        self.on_loss(error)

    # -- frames

    @abstractmethod
    def on_loss(self, error: BusError) -> None:
        """Handle the loss of the bus."""

    @abstractmethod
    def take_frame(self, frame: memoryview) -> None:
        """Process one received frame."""

    def take(self, last: int) -> None:
        """Process the first `last` frames of the reader."""
        for row in self.reader.frames.rows[:last]:
            self.take_frame(row)

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame; raises BusError."""
        self.send_frame(FRAME.pack(identifier, len(data), data))

    def send_frame(self, frame: bytes) -> None:
        """Send one packed frame; raises BusError."""
        try:
            self.reader.port.send(frame)
        except OSError as error:
            raise self.reader.lost(error) from error

    def close(self) -> None:
        """Leave the bus; a lost bus or a second call is no error."""
        self.clock.remove(self)
        self.reader.close()


# Objects of the nodes of one bus, read and written by SDO.

TIMEOUT_S = 0.5
"""Default timeout of one answer."""
ATTEMPTS = 2
_HISTORY = 0x1003

T = TypeVar("T")


_SYNC, _EMCY, _HEARTBEAT = 0x080, 0x080, 0x700
_FUNCTION, _NODE = 0x780, 0x07F
_EXACT_ID_MASK = 0x7FF | EFF_FLAG | RTR_FLAG
_RPDO_TIMEOUT = 0x8250
_START, _ENTER_PRE_OPERATIONAL, _RESET_NODE, _RESET_COMMUNICATION = 1, 128, 129, 130
_LOOK_S = 0.1
"""Interval at which heartbeats are checked."""
_LOCKSTEP_SLACK_S = 1.0
"""Slack for heartbeats if another process leads the bus in lockstep: its time may stand still."""
_FEWEST_SYNCS = 2
"""SYNCs that prove a master; a single one may be the last of a master that has just ended."""
_FEWEST_UNEXPECTED = 3
_MOST_BOOT_UPS = 4
_OPERATIONAL_DATA = bytes([nmt.OPERATIONAL])
_LATE_ANSWERS_S = 0.05
"""Wait for the answer of a second device, which may be slower than the first."""


class CanNetwork(BusMember):
    """Acyclic side of a CANopen master on one bus; all its waits use `clock`.

    While no cycles run and a task waits, it sends the master's heartbeat and monitors the nodes'.
    `hand_heartbeat_to_cycle` hands both duties to the cycle: if the loop then hangs, no heartbeat
    is sent and the drives stop. It has the only port on the bus, so a cycle reads through `reader`
    too.
    Raises BusError if the bus cannot be opened.

    In tasks, SDO transfers to different nodes run in parallel. Their errors name node, object and
    reason. A request without an answer is sent up to `attempts` times in all; `timeout_s` applies
    to one answer.
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
        self.alarm: Fault | None = None
        """Why the drives must be stopped; latched until `clear_alarm`."""
        self.cycling = False
        self.heartbeat_s = heartbeat_s
        self.heartbeat_frame = FRAME.pack(_HEARTBEAT + master_node_id, 1, _OPERATIONAL_DATA)
        self._master_node_id = master_node_id
        self._other_heartbeats = self._other_syncs = 0
        self._heartbeat_at_s = math.inf
        self._look_at_s = 0.0
        self.clients: dict[int, SdoClient] = {}
        """The SDO client of each node."""
        self._dictionaries: dict[int, ObjectDictionary] = {}
        super().__init__(url, clock, self._filters)
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
        self._dictionaries[node_id] = dictionary
        self.clients[node_id] = SdoClient(partial(self.send, REQUEST + node_id), self.clock)

    # -- as a source of the clock

    def tick(self, now_s: float) -> float:
        """Send the master's heartbeat if it is due, and check for lost nodes."""
        if self.cycling:
            return math.inf
        if now_s >= self._heartbeat_at_s:
            self.start_heartbeat()
        # only if no frame waits: the heartbeat may be among the waiting frames
        if now_s >= self._look_at_s and not self.poll():
            self._look_at_s = now_s + _LOOK_S
            self._errors.look_for_losses()
        return min(self._heartbeat_at_s, self._look_at_s)

    def on_loss(self, error: BusError) -> None:
        """End transfers immediately and raise the alarm."""
        for client in self.clients.values():
            client.fail(error)
        self.raise_alarm(Fault(Limit.DRIVE, code=BUS_LOST, source=str(self.url), detail=str(error)))

    # -- received frames

    def set_extra_filters(self, identifiers: Iterable[int]) -> None:
        """Also receive these identifiers, instead of those of an earlier call; raises BusError."""
        self.reader.set_filters([*self._filters, *((i, _EXACT_ID_MASK) for i in identifiers)])

    def take_frame(self, frame: memoryview) -> None:
        """Process one frame; ignore it if it is not a valid CANopen message."""
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
        source = f"node {emergency.node_id}"
        code, _, meaning = fault_text(emergency.code).partition(" ")
        if flood:
            self.raise_alarm(Fault(Limit.DRIVE, -1, "flooding", source, detail=flood))
        if emergency.code == _RPDO_TIMEOUT and not self.cycling:
            return  # commands are missing because none are sent between cycles
        if not emergency.is_reset:
            self.raise_alarm(Fault(Limit.DRIVE, -1, code, source, detail=meaning))

    def _on_error_frame(self, identifier: int, data: bytes) -> None:
        self.health.take_error(identifier, data)
        if not self.health.usable:
            self.raise_alarm(self._bus_off())

    def _bus_off(self) -> Fault:
        text = (
            f"{self.url}: the CAN controller is {self.health.text}; nothing can be sent. Check "
            "cable, termination and bit rate, then restart the interface (ip link set IFACE type "
            "can restart, or restart-ms)"
        )
        return Fault(Limit.DRIVE, code=BUS_OFF, source=str(self.url), detail=text)

    @property
    def alarm_text(self) -> str:
        """The alarm as text; "" without one."""
        return faults.fault_text(self.alarm, ()) if self.alarm else ""

    def raise_alarm(self, alarm: Fault) -> None:
        """Latch an alarm, which stops the drives; the first alarm is kept."""
        self.alarm = self.alarm or alarm

    def clear_alarm(self) -> None:
        """Clear the latched alarm, except for bus-off while it lasts."""
        self.alarm = None if self.health.state < BusState.BUS_OFF else self._bus_off()

    # -- sent frames

    def reset_communication(self, node_id: int, timeout_s: float, boot_ups: int = 1) -> bool:
        """Reset the node's communication; return whether its boot-up message arrived in time.

        `boot_ups` is how often the drive sends that message. Raises BusError.
        """
        self.clients[node_id].unexpected = 0
        self._errors.expect_reset(node_id, boot_ups)
        self._command(_RESET_COMMUNICATION, node_id)
        return self._errors.wait_for_boot_up(node_id, timeout_s)

    def duplicate_node(self, node_id: int, usual_boot_ups: int = 1) -> str:
        """Return evidence of two devices with this node id since its reset, or an empty text.

        `usual_boot_ups` is how often a single drive of this type sends its boot-up message.
        """
        boot_ups = self._errors.boot_ups_since_reset(node_id)
        # a device that stays in NMT state initialising sends heartbeats that look like more
        # boot-ups
        if usual_boot_ups < boot_ups <= _MOST_BOOT_UPS:
            return f"two devices have this node id: {boot_ups} boot-up messages followed one reset"
        unexpected = self.clients[node_id].await_unexpected(_LATE_ANSWERS_S)
        if unexpected >= _FEWEST_UNEXPECTED:
            return (
                "two devices have this node id, or another program reads it by SDO at the same "
                f"time: {unexpected} unrequested answers arrived"
            )
        return ""

    def start(self, node_id: int, heartbeat_s: float = 0.0) -> None:
        """Command the node to operational, and monitor that it stays there; raises BusError.

        `heartbeat_s` is the period of its heartbeat; its loss between cycles then raises an alarm.
        """
        self._errors.expect_start(node_id, heartbeat_s)
        self._command(_START, node_id)

    def stop_process_data(self, node_id: int) -> None:
        """Command the node to pre-operational, which has no PDOs; raises BusError."""
        self._errors.expect_stop(node_id)
        self._command(_ENTER_PRE_OPERATIONAL, node_id)

    def reset(self, node_id: int) -> None:
        """Reset the whole node, as the last resort to cut its power; raises BusError."""
        self._errors.expect_reset(node_id)
        self._command(_RESET_NODE, node_id)

    def switch_off(
        self, node_id: int, timeout_s: float = TIMEOUT_S, attempts: int = ATTEMPTS
    ) -> bool:
        """Cut the power of one drive by SDO; return whether the drive confirms it.

        Use it if no cycles run or the drive does not follow them. If the drive does not confirm, or
        does not acknowledge one of `attempts` within `timeout_s`, it is reset (NMT) as last resort.
        A reset cuts the power of any drive. NMT stop would depend on 6007h, which may be set to no
        action, and would end SDO. Raises BusError.
        """
        try:
            self.write(node_id, 0x6040, 0, DISABLE_VOLTAGE, timeout_s=timeout_s, attempts=attempts)
            if state_of(self.read_int(node_id, 0x6041)) in POWER_OFF:
                return True
        except SdoError:
            pass  # the drive does not answer SDO either
        self.reset(node_id)
        return False

    def release(self, node_id: int) -> None:
        """Release a node: without power it no longer needs to monitor the master's heartbeat.

        Otherwise it would report the missing heartbeat to the next master. Best effort; a node that
        may still have power continues to monitor, so that it stops if no master is there.
        """
        self._errors.release(node_id)
        try:
            if state_of(self.read_int(node_id, 0x6041, attempts=1)) in POWER_OFF:
                self._stop_watch(node_id)
                self.stop_process_data(node_id)
        except DriverError:
            return

    def _stop_watch(self, node_id: int) -> None:
        """Remove this master from the consumer heartbeats of a node (1016h)."""
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
        """Return the NMT state of the node's next heartbeat; None if none arrived."""
        return self._errors.wait_for_heartbeat(node_id, timeout_s)

    # -- heartbeat of the master

    def hand_heartbeat_to_cycle(self) -> None:
        """Hand the master's heartbeat to the cycle, so that it ends if the cycle hangs."""
        self.cycling = True

    def release_cycle(self) -> None:
        """Take the master's heartbeat and the monitoring of the nodes back from the cycle."""
        self._errors.restart_watch()
        if self.cycling:
            self.cycling = False
            self.start_heartbeat()  # the cycle's last one may be a whole period old

    def start_heartbeat(self) -> None:
        """Start the master's heartbeat; the drives monitor it from the first one on."""
        # twice as often as configured, because a master that computes for a while misses some
        self._heartbeat_at_s = self.clock.now_s + 0.5 * self.heartbeat_s
        try:
            self.send_frame(self.heartbeat_frame)
        except BusError:
            return  # if the bus does not return, the drives stop without a master

    # -- objects of the nodes, read and written by SDO

    def dictionary(self, node_id: int) -> ObjectDictionary:
        """Return the node's object dictionary."""
        return self._dictionaries[node_id]

    def read(
        self, node_id: int, index: int, sub: int = 0, *, attempts: int = ATTEMPTS
    ) -> int | str | bytes:
        """Return an object's value, decoded by its type; raises SdoError, BusError."""
        variable = self._variable(node_id, index, sub)

        def transfer(client: SdoClient) -> Any:
            data = client.upload(index, sub, TIMEOUT_S)
            # some devices send four bytes for every type
            return variable.decode_raw(data[: len(variable) // 8] if variable.fixed_size else data)

        value = self._transfer(node_id, index, sub, "read", transfer, attempts)
        return value if isinstance(value, int | str) else bytes(value)

    def read_int(self, node_id: int, index: int, sub: int = 0, *, attempts: int = ATTEMPTS) -> int:
        """Return an integer object's value; raises SdoError, BusError."""
        value = self.read(node_id, index, sub, attempts=attempts)
        if not isinstance(value, int):
            raise SdoError(
                f"node {node_id}: object {index:04X}h:{sub} is not an integer: {value!r}"
            )
        return value

    def read_bytes(self, node_id: int, index: int, sub: int = 0) -> bytes:
        """Return an object's raw data, even if the EDS does not have the object.

        Raises SdoError, BusError.
        """
        return self._transfer(
            node_id,
            index,
            sub,
            "read",
            lambda client: client.upload(index, sub, TIMEOUT_S),
            ATTEMPTS,
        )

    def write(
        self,
        node_id: int,
        index: int,
        sub: int,
        value: int,
        *,
        timeout_s: float = TIMEOUT_S,
        attempts: int = ATTEMPTS,
    ) -> None:
        """Write an integer object; raises SdoError, BusError."""
        variable = self._variable(node_id, index, sub)

        def transfer(client: SdoClient) -> None:
            client.download(index, sub, bytes(variable.encode_raw(value)), timeout_s)

        self._transfer(node_id, index, sub, f"set to {value}", transfer, attempts)

    def write_bytes(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        """Write an object's data unchanged; raises SdoError, BusError."""
        number = f"{data[::-1].hex().upper()}h"  # as CiA 301 writes it, the highest byte first
        what = f"set to {number if len(data) <= 8 else f'{len(data)} bytes'}"

        def transfer(client: SdoClient) -> None:
            client.download(index, sub, data, TIMEOUT_S)

        self._transfer(node_id, index, sub, what, transfer, ATTEMPTS)

    def cancel(self, node_id: int) -> bool:
        """Cancel the transfer that a task runs with a node; return whether one ran.

        That task gets SdoCancelledError, the node an abort (08000000h).
        """
        return self.clients[node_id].cancel()

    def error_history(self, node_id: int) -> list[ErrorRecord]:
        """Return the node's own error history (1003h), newest first.

        Raises SdoError, BusError.
        """
        records = []
        for sub in range(1, self.read_int(node_id, _HISTORY) + 1):
            try:
                value = self.read_int(node_id, _HISTORY, sub)
            except SdoAbortError as error:
                if error.code in (NO_DATA, NO_SUBINDEX):
                    break  # cleared meanwhile
                raise
            records.append(ErrorRecord(value & 0xFFFF, value >> 16))
        return records

    def _transfer(
        self,
        node_id: int,
        index: int,
        sub: int,
        what: str,
        transfer: Callable[[SdoClient], T],
        attempts: int,
    ) -> T:
        where = f"node {node_id}: object {index:04X}h:{sub} cannot be {what}: "
        client = self.clients[node_id]
        while True:
            attempts -= 1
            try:
                return transfer(client)
            except SdoTimeoutError as error:
                if not attempts:
                    raise SdoTimeoutError(f"{where}{error}") from error
            except SdoAbortError as error:
                raise SdoAbortError(error.code, where) from error
            except SdoCancelledError as error:
                raise SdoCancelledError(f"{where}{error}") from error
            except (struct.error, ObjectDictionaryError, ValueError, TypeError) as error:
                raise SdoError(
                    f"{where}its value does not fit its type in the EDS ({error})"
                ) from error

    def _variable(self, node_id: int, index: int, sub: int) -> ODVariable:
        try:
            entry: Any = self._dictionaries[node_id][index]
            variable = entry if isinstance(entry, ODVariable) else entry[sub]
        except KeyError:
            variable = None
        if not isinstance(variable, ODVariable):
            raise SdoError(f"node {node_id}: object {index:04X}h:{sub} is not in the drive's EDS")
        return variable
