"""Acyclic side of a CANopen bus: SDO, NMT, EMCY and heartbeats, on the `canopen` library."""

from __future__ import annotations

import logging
import struct
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import can
import canopen
from canopen.objectdictionary import ObjectDictionary, ObjectDictionaryError
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError
from canopen.sdo.exceptions import SdoError as CanopenSdoError

from drivers.bus import BusUrl, open_python_can
from drivers.bus.packed import EFF_FLAG, RTR_FLAG
from drivers.cia402 import POWER_OFF, fault_text, state_of
from drivers.errors import BusError, DriverError, SdoError

_EMCY, _SDO_ANSWER, _HEARTBEAT, _LSS_ANSWER = 0x080, 0x580, 0x700, 0x7E4
_FUNCTION, _NODE = 0x780, 0x07F
_EXACT = 0x7FF | EFF_FLAG | RTR_FLAG
_EMCY_LAYOUT = struct.Struct("<HB5s")
_KEPT_EMERGENCIES = 256
_RPDO_TIMEOUT = 0x8250
_BOOT_UP = 0
_START, _ENTER_PRE_OPERATIONAL, _RESET_NODE, _RESET_COMMUNICATION = 1, 128, 129, 130
_OPERATIONAL = 5
_SDO_TIMEOUT_S = 0.5
_ATTEMPTS = 2
_LOOK_S = 0.1
"""How often the receiving thread looks whether it is to end."""

# the library logs what is raised here as errors of our own
logging.getLogger("canopen").setLevel(logging.CRITICAL)


@dataclass(frozen=True)
class Emergency:
    """One EMCY message (CiA 301): what the node said when."""

    node_id: int
    code: int
    register: int
    vendor: bytes
    at_s: float
    """Wall time of reception, monotonic."""

    def __str__(self) -> str:
        return f"node {self.node_id}: {fault_text(self.code)} (error register {self.register:02X}h)"


class _Peer:
    """What is known of one node from its error control messages."""

    def __init__(self, node_id: int, node: canopen.RemoteNode) -> None:
        self.node_id = node_id
        self.node = node
        self.lock = threading.Lock()
        """One SDO transfer at a time: the library's client has no lock."""
        self.boot_ups = 0
        self.heartbeats = 0
        self.nmt_state: int | None = None
        self.expects_boot_up = False
        self.started = False
        """Whether it has been seen operational since it was started."""
        self.starting = False


class CanNetwork:
    """CANopen master's acyclic work on one bus.

    Its receive filters keep SYNC and PDOs away, so that cycles never wake its thread. While no
    cycles run it produces the master's heartbeat; `cycling` hands that duty to the cycle, so
    that a hung loop is silent and the drives stop. Raises BusError when the bus cannot be opened.
    """

    def __init__(
        self, url: BusUrl, node_ids: Iterable[int], master_node_id: int, heartbeat_s: float
    ) -> None:
        self.url = url
        self.emergencies: deque[Emergency] = deque(maxlen=_KEPT_EMERGENCIES)
        self.alarm_text = ""
        """Why the drives must not go on being driven; latched until `clear_alarm`."""
        self.cycling = False
        self.restarted: set[int] = set()
        """Nodes that booted unasked: their configuration and encoder positions are void."""
        ids = list(node_ids)
        filters = [(base + node, _EXACT) for node in ids for base in (_EMCY, _SDO_ANSWER)]
        filters += [(_HEARTBEAT + node, _EXACT) for node in (*ids, master_node_id)]
        filters.append((_LSS_ANSWER, _EXACT))
        self._bus = open_python_can(url, filters)
        self._canopen = canopen.Network(self._bus)
        self._peers: dict[int, _Peer] = {}
        self._news = threading.Condition()
        self._heartbeat_s = heartbeat_s
        self._master_node_id = master_node_id
        self.foreign_master = threading.Event()
        """Set when somebody else has produced the master's heartbeat, before our cycles ran."""
        self._has_cycled = False
        self._lost: Exception | None = None
        self._stop = threading.Event()
        self._threads = [threading.Thread(target=self._receive, name="canopen", daemon=True)]
        self._threads[0].start()

    def add_node(self, node_id: int, dictionary: ObjectDictionary) -> None:
        """Make a node known, with the object dictionary its EDS describes."""
        node = self._canopen.add_node(node_id, dictionary)
        node.sdo.RESPONSE_TIMEOUT = _SDO_TIMEOUT_S
        self._peers[node_id] = _Peer(node_id, node)

    def dictionary(self, node_id: int) -> ObjectDictionary:
        """Return the node's object dictionary."""
        return self._peers[node_id].node.object_dictionary

    # -- what comes in; one thread of its own, since python-can's prints the end of a bus

    def _receive(self) -> None:
        while not self._stop.is_set():
            try:
                message = self._bus.recv(_LOOK_S)
            except (can.CanError, OSError) as error:
                if not self._stop.is_set():
                    self._lost = error
                    self.raise_alarm(f"{self.url}: the bus has gone away")
                return
            if message is not None:
                self._dispatch(message)

    def _dispatch(self, message: can.Message) -> None:
        """Hand a frame on; one that no CANopen device sends is noise."""
        identifier, data = message.arbitration_id, bytes(message.data)
        if message.is_extended_id or message.is_remote_frame or message.is_error_frame:
            return
        if len(data) == 8 and (identifier & _FUNCTION == _SDO_ANSWER or identifier == _LSS_ANSWER):
            self._canopen.notify(identifier, bytearray(data), message.timestamp)
            return
        peer = self._peers.get(identifier & _NODE)
        if identifier == _HEARTBEAT + self._master_node_id:
            if not self._has_cycled:  # the cycle's own heartbeats come back to us as well
                self.foreign_master.set()
        elif peer is None:
            return
        elif identifier & _FUNCTION == _EMCY and len(data) == 8:
            code, register, vendor = _EMCY_LAYOUT.unpack(data)
            self._on_emergency(Emergency(peer.node_id, code, register, vendor, time.monotonic()))
        elif identifier & _FUNCTION == _HEARTBEAT and len(data) == 1:
            with self._news:
                self._on_heartbeat(peer, data[0] & 0x7F)
                self._news.notify_all()

    def _on_emergency(self, emergency: Emergency) -> None:
        self.emergencies.append(emergency)
        if emergency.code == _RPDO_TIMEOUT and not self.cycling:
            return  # commands are missing because none are sent between cycles
        if emergency.code >> 8:
            self.raise_alarm(f"emergency message: {emergency}")

    def _on_heartbeat(self, peer: _Peer, state: int) -> None:
        name = f"node {peer.node_id}"
        peer.nmt_state = state
        if state == _BOOT_UP:
            peer.boot_ups += 1
            if not peer.expects_boot_up:
                self.restarted.add(peer.node_id)
                self.raise_alarm(f"{name} has restarted (unexpected boot-up message)")
            peer.expects_boot_up = peer.started = peer.starting = False
            return
        peer.heartbeats += 1
        if state == _OPERATIONAL:
            peer.started = peer.started or peer.starting
        elif peer.started:
            self.raise_alarm(f"{name} is not operational any more (NMT state {state})")

    def raise_alarm(self, text: str) -> None:
        """Latch why the drives must not go on being driven; the first reason stands."""
        self.alarm_text = self.alarm_text or text

    def clear_alarm(self) -> None:
        """Forget the latched alarm, after its cause has been dealt with."""
        self.alarm_text = ""

    # -- objects

    def read(
        self, node_id: int, index: int, sub: int = 0, *, attempts: int = _ATTEMPTS
    ) -> int | str | bytes:
        """Return an object's value, decoded by its type; raises SdoError, BusError.

        A request without an answer is repeated up to `attempts` in all.
        """
        variable = self._variable(node_id, index, sub)

        def transfer() -> Any:
            return variable.raw

        value = self._transfer(node_id, index, sub, "read", transfer, attempts)
        return value if isinstance(value, int | str) else bytes(value)

    def read_int(self, node_id: int, index: int, sub: int = 0, *, attempts: int = _ATTEMPTS) -> int:
        """Return an integer object's value; raises SdoError, BusError."""
        value = self.read(node_id, index, sub, attempts=attempts)
        if not isinstance(value, int):
            raise SdoError(f"node {node_id}: object {index:04X}h:{sub} is no integer: {value!r}")
        return value

    def write(self, node_id: int, index: int, sub: int, value: int) -> None:
        """Write an integer object; raises SdoError, BusError."""
        variable = self._variable(node_id, index, sub)

        def transfer() -> None:
            variable.raw = value

        self._transfer(node_id, index, sub, f"set to {value}", transfer, _ATTEMPTS)

    def _transfer(
        self,
        node_id: int,
        index: int,
        sub: int,
        what: str,
        transfer: Callable[[], Any],
        attempts: int,
    ) -> Any:
        with self._peers[node_id].lock:
            while True:
                attempts -= 1
                try:
                    return transfer()
                except SdoCommunicationError as error:
                    if not attempts or self._lost is not None:
                        raise self._explain(node_id, index, sub, what, error) from error
                except Exception as error:
                    raise self._explain(node_id, index, sub, what, error) from error

    def _variable(self, node_id: int, index: int, sub: int) -> Any:
        try:
            entry: Any = self._peers[node_id].node.sdo[index]
            return entry if not hasattr(entry, "values") else entry[sub]
        except KeyError:
            raise SdoError(
                f"node {node_id}: object {index:04X}h:{sub} is not in the drive's EDS"
            ) from None

    def _explain(
        self, node_id: int, index: int, sub: int, what: str, error: Exception
    ) -> DriverError:
        """Return the error to raise for one that the library raised in a transfer."""
        if self._lost is not None or isinstance(error, can.CanError | OSError):
            return BusError(f"{self.url}: the bus has gone away ({self._lost or error})")
        if isinstance(error, SdoAbortedError):
            reason = f"{SdoAbortedError.CODES.get(error.code, 'refused')} ({error.code:08X}h)"
        elif isinstance(error, struct.error | ObjectDictionaryError | ValueError):
            reason = f"its value does not fit the type that the EDS gives it ({error})"
        elif isinstance(error, CanopenSdoError):
            reason = str(error) or type(error).__name__
        else:
            raise error
        return SdoError(f"node {node_id}: object {index:04X}h:{sub} cannot be {what}: {reason}")

    # -- network management

    def reset_communication(self, node_id: int, timeout_s: float) -> bool:
        """Reset the node's communication; return whether its boot-up message came in time.

        Raises BusError.
        """
        peer = self._peers[node_id]
        with self._news:
            before = peer.boot_ups
            peer.expects_boot_up = True
            peer.started = peer.starting = False
            self.restarted.discard(node_id)
        self._command(_RESET_COMMUNICATION, node_id)
        with self._news:
            return self._news.wait_for(lambda: peer.boot_ups > before, timeout_s)

    def start(self, node_id: int) -> None:
        """Command the node to operational, and watch from now on that it stays so; BusError."""
        self._peers[node_id].starting = True
        self._command(_START, node_id)

    def stop_process_data(self, node_id: int) -> None:
        """Command the node to pre-operational, where it takes and sends no PDOs; BusError."""
        peer = self._peers[node_id]
        peer.started = peer.starting = False
        self._command(_ENTER_PRE_OPERATIONAL, node_id)

    def reset(self, node_id: int) -> None:
        """Reset the whole node, as the last resort to take its power away; BusError."""
        self._peers[node_id].expects_boot_up = True
        self._command(_RESET_NODE, node_id)

    def release(self, node_id: int) -> None:
        """Leave a node alone: without power it need not watch the master's heartbeat any more.

        Otherwise it would report the missing heartbeat to whoever comes next. Best effort; a node
        that may still have power goes on watching, so that it stops by itself.
        """
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
        try:
            self._canopen.send_message(0, bytes([command, node_id]))
        except (can.CanError, OSError) as error:
            raise BusError(f"{self.url}: cannot send: {error}") from error

    def wait_for_heartbeat(self, node_id: int, timeout_s: float) -> int | None:
        """Return the NMT state of the node's next heartbeat, None when none came."""
        peer = self._peers[node_id]
        with self._news:
            before = peer.heartbeats
            came = self._news.wait_for(lambda: peer.heartbeats > before, timeout_s)
            return peer.nmt_state if came else None

    # -- heartbeat of the master

    def claim_cycle(self) -> None:
        """Hand the master's heartbeat to the cycle: from now on a hung cycle is a silent master."""
        self.cycling = self._has_cycled = True

    def release_cycle(self) -> None:
        """Take the master's heartbeat back from the cycle."""
        self.cycling = False

    def start_heartbeat(self) -> None:
        """Begin to produce the master's heartbeat; the drives watch it from the first one on."""
        self._send_heartbeat()
        thread = threading.Thread(target=self._produce, name="heartbeat", daemon=True)
        self._threads.append(thread)
        thread.start()

    def _produce(self) -> None:
        while not self._stop.wait(self._heartbeat_s):
            if not self.cycling:
                self._send_heartbeat()

    def _send_heartbeat(self) -> None:
        try:
            self._canopen.send_message(_HEARTBEAT + self._master_node_id, bytes([_OPERATIONAL]))
        except (can.CanError, OSError):
            return  # should the bus not come back, the drives stop by themselves

    def close(self) -> None:
        """Leave the bus; a bus that is lost is no error here."""
        self._stop.set()
        for thread in self._threads:
            thread.join()
        try:
            self._canopen.disconnect()
        except (can.CanError, OSError):
            return
