"""Acyclic side of a CANopen bus: SDO, NMT, EMCY, heartbeats and the state of the wire."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable

import can
from canopen.objectdictionary import ObjectDictionary

from drivers import emergency as emcy
from drivers import error_control as nmt
from drivers.bus import BusUrl, bus_gone, open_python_can
from drivers.bus.health import BusHealth, BusState
from drivers.bus.packed import EFF_FLAG, RTR_FLAG
from drivers.cia402 import POWER_OFF, state_of
from drivers.emergency import Emergency, EmergencyLog
from drivers.error_control import ErrorControl
from drivers.errors import BusError, DriverError
from drivers.objects import SDO_ANSWER, ObjectAccess

_EMCY, _HEARTBEAT = 0x080, 0x700
_FUNCTION, _NODE = 0x780, 0x07F
_EXACT = 0x7FF | EFF_FLAG | RTR_FLAG
_RPDO_TIMEOUT = 0x8250
_START, _ENTER_PRE_OPERATIONAL, _RESET_NODE, _RESET_COMMUNICATION = 1, 128, 129, 130
_LOOK_S = 0.1
"""How often the receiving thread looks for nodes that are lost, and whether it is to end."""
_HELD_CLOCK_S = 1.0
"""Slack for heartbeats of a simulated bus, whose time may stand for half a second."""
_SOME_STRAYS = 3
_MOST_TWINS = 4
_LATE_ANSWERS_S = 0.05
"""A second device may be slower than the first."""


class CanNetwork(ObjectAccess):
    """CANopen master's acyclic work on one bus.

    Its receive filters keep SYNC and PDOs away, so that cycles never wake its thread. While no
    cycles run it produces the master's heartbeat and watches those of the nodes; `claim_cycle`
    hands both duties to the cycle, so that a hung loop is silent and the drives stop. Raises
    BusError when the bus cannot be opened.
    """

    def __init__(
        self, url: BusUrl, node_ids: Iterable[int], master_node_id: int, heartbeat_s: float
    ) -> None:
        super().__init__(self.send)
        self.url = url
        self.health = BusHealth()
        """What the controller's error frames tell of the wire."""
        self.log = EmergencyLog()
        self.emergencies = self.log.kept
        self.alarm_text = ""
        """Why the drives must not go on being driven; latched until `clear_alarm`."""
        self.cycling = False
        self.foreign_master = threading.Event()
        """Set when somebody else has produced the master's heartbeat, before our cycles ran."""
        ids = list(node_ids)
        filters = [(base + node, _EXACT) for node in ids for base in (_EMCY, SDO_ANSWER)]
        filters += [(_HEARTBEAT + node, _EXACT) for node in (*ids, master_node_id)]
        self._bus = open_python_can(url, filters, self.health)
        self._send_lock = threading.Lock()
        held = url.is_simulated or url.asks_for_lockstep
        slack_s = _HELD_CLOCK_S if held else 0.0
        self._errors = ErrorControl(self.raise_alarm, slack_s)
        self.restarted = self._errors.restarted
        """Nodes that booted unasked: their configuration and encoder positions are void."""
        self._heartbeat_s = heartbeat_s
        self._master_node_id = master_node_id
        self._has_cycled = False
        self._stop = threading.Event()
        self._threads = [threading.Thread(target=self._receive, name="canopen", daemon=True)]
        self._threads[0].start()

    def add_node(self, node_id: int, dictionary: ObjectDictionary) -> None:
        """Make a node known, with the object dictionary its EDS describes."""
        self._errors.add(node_id)
        super().add_node(node_id, dictionary)

    # -- what comes in; one thread of its own, since python-can's prints the end of a bus

    def _receive(self) -> None:
        look_at_s = 0.0
        while not self._stop.is_set():
            due = time.monotonic() >= look_at_s
            try:
                message = self._bus.recv(0.0 if due else _LOOK_S)
            except (can.CanError, OSError) as error:
                if not self._stop.is_set():
                    gone = self._gone(error)
                    self._fail_transfers(gone)
                    self.raise_alarm(str(gone))
                return
            if message is not None:
                self._dispatch(message)
            elif due:
                # nothing waits: who has not been heard by now has not said anything
                look_at_s = time.monotonic() + _LOOK_S
                if not self.cycling:
                    self._errors.look_for_losses()

    def _dispatch(self, message: can.Message) -> None:
        """Hand a frame on; one that no CANopen device sends is noise."""
        if message.is_error_frame:
            self._on_error_frame(message)
            return
        if message.is_extended_id or message.is_remote_frame:
            return
        identifier, data = message.arbitration_id, bytes(message.data)
        node_id = identifier & _NODE
        if identifier == _HEARTBEAT + self._master_node_id:
            if not self._has_cycled:  # the cycle's own heartbeats come back to us as well
                self.foreign_master.set()
        elif node_id not in self.clients:
            return
        elif identifier & _FUNCTION == SDO_ANSWER and len(data) == 8:
            self.clients[node_id].on_answer(data)
        elif identifier & _FUNCTION == _EMCY and len(data) == emcy.LENGTH:
            self._on_emergency(Emergency.from_frame(node_id, data))
        elif identifier & _FUNCTION == _HEARTBEAT and len(data) == 1:
            state = data[0] & 0x7F
            if state == nmt.BOOT_UP:
                self.log.forget(node_id)
            self._errors.take(node_id, state)

    def _on_emergency(self, emergency: Emergency) -> None:
        flood = self.log.add(emergency)
        if flood:
            self.raise_alarm(flood)
        if emergency.code == _RPDO_TIMEOUT and not self.cycling:
            return  # commands are missing because none are sent between cycles
        if not emergency.is_reset:
            self.raise_alarm(f"emergency message: {emergency}")

    def _on_error_frame(self, message: can.Message) -> None:
        self.health.take_message(message)
        if not self.health.usable:
            self.raise_alarm(self._bus_off())

    def _bus_off(self) -> str:
        return (
            f"{self.url}: the CAN controller is {self.health.text}; nothing can be sent. Check "
            "cable, termination and bit rate, then restart the interface (ip link set IFACE type "
            "can restart, or restart-ms)"
        )

    def raise_alarm(self, text: str) -> None:
        """Latch why the drives must not go on being driven; the first reason stands."""
        self.alarm_text = self.alarm_text or text

    def clear_alarm(self) -> None:
        """Forget the latched alarm, after its cause has been dealt with; bus-off stays one."""
        self.alarm_text = "" if self.health.state < BusState.BUS_OFF else self._bus_off()

    # -- what goes out

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame; raises BusError."""
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        try:
            with self._send_lock:
                self._bus.send(message)
        except (can.CanError, OSError) as error:
            raise self._gone(error) from error

    def _gone(self, error: Exception) -> BusError:
        return bus_gone(self.url, error)

    def reset_communication(self, node_id: int, timeout_s: float) -> bool:
        """Reset the node's communication; return whether its boot-up message came in time.

        Raises BusError.
        """
        self.clients[node_id].strays = 0
        self._errors.expect_reset(node_id)
        self._command(_RESET_COMMUNICATION, node_id)
        return self._errors.wait_for_boot_up(node_id, timeout_s)

    def twins(self, node_id: int) -> str:
        """Return what speaks for two devices with this node id since its reset, else nothing."""
        boot_ups = self._errors.boot_ups_since_reset(node_id)
        # without end they are the heartbeats of a device that stays in the state of a restart
        if 1 < boot_ups <= _MOST_TWINS:
            return f"two devices have this node id: {boot_ups} boot-up messages followed one reset"
        strays = self.clients[node_id].await_strays(_LATE_ANSWERS_S)
        if strays >= _SOME_STRAYS:
            return (
                f"two devices have this node id, or another program reads it by SDO at the same "
                f"time: {strays} answers came that we had not asked for"
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

    def release(self, node_id: int) -> None:
        """Leave a node alone: without power it need not watch the master's heartbeat any more.

        Otherwise it would report the missing heartbeat to whoever comes next. Best effort; a node
        that may still have power goes on watching, so that it stops by itself.
        """
        self._errors.release(node_id)
        try:
            if self.pause_watch(node_id) is not None:
                self.stop_process_data(node_id)
        except DriverError:
            return

    def pause_watch(self, node_id: int) -> list[tuple[int, int]] | None:
        """Have a drive without power not watch the master's heartbeat, for `resume_watch` later.

        A master that computes is no reason for a drive at rest to report an error. Returns the
        entries of 1016h that were taken out, None for a drive that may have power: it goes on
        watching. Raises SdoError, BusError.
        """
        if state_of(self.read_int(node_id, 0x6041, attempts=1)) not in POWER_OFF:
            return None
        if 0x1016 not in self.dictionary(node_id):
            return []
        entries = range(1, self.read_int(node_id, 0x1016) + 1)
        watch = [(sub, self.read_int(node_id, 0x1016, sub)) for sub in entries]
        taken = [
            (sub, value) for sub, value in watch if value >> 16 & _NODE == self._master_node_id
        ]
        for sub, _ in taken:
            self.write(node_id, 0x1016, sub, 0)
        return taken

    def resume_watch(self, node_id: int, entries: list[tuple[int, int]]) -> None:
        """Have the drive watch the master's heartbeat again; raises SdoError, BusError."""
        for sub, value in entries:
            self.write(node_id, 0x1016, sub, value)

    def _command(self, command: int, node_id: int) -> None:
        self.send(0, bytes([command, node_id]))

    def wait_for_heartbeat(self, node_id: int, timeout_s: float) -> int | None:
        """Return the NMT state of the node's next heartbeat, None when none came."""
        return self._errors.wait_for_heartbeat(node_id, timeout_s)

    # -- heartbeat of the master

    def claim_cycle(self) -> None:
        """Hand the master's heartbeat to the cycle: from now on a hung cycle is a silent master."""
        self.cycling = self._has_cycled = True

    def release_cycle(self) -> None:
        """Take the master's heartbeat back from the cycle, and the watch on the nodes'."""
        self._errors.restart_watch()
        if self.cycling:
            self.cycling = False
            self._send_heartbeat()  # the cycle's last one may be a whole period ago

    def start_heartbeat(self) -> None:
        """Begin to produce the master's heartbeat; the drives watch it from the first one on."""
        self._send_heartbeat()
        thread = threading.Thread(target=self._produce, name="heartbeat", daemon=True)
        self._threads.append(thread)
        thread.start()

    def _produce(self) -> None:
        # twice as often as promised: this thread has to wait for the interpreter at times
        while not self._stop.wait(0.5 * self._heartbeat_s):
            if not self.cycling:
                self._send_heartbeat()

    def _send_heartbeat(self) -> None:
        try:
            self.send(_HEARTBEAT + self._master_node_id, bytes([nmt.OPERATIONAL]))
        except BusError:
            return  # should the bus not come back, the drives stop by themselves

    def close(self) -> None:
        """Leave the bus; a bus that is lost is no error here."""
        self._stop.set()
        for thread in self._threads:
            thread.join()
        try:
            self._bus.shutdown()
        except (can.CanError, OSError):
            return
