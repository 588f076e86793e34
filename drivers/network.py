"""Acyclic side of a CANopen bus: SDO, NMT, EMCY and heartbeats, on the `canopen` library."""

from __future__ import annotations

import logging
import struct
import threading
import time
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import can
import canopen
from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivers.bus import BusUrl, open_python_can
from drivers.cia402 import fault_text
from drivers.errors import BusError, SdoError

_EMCY, _SDO_ANSWER, _HEARTBEAT, _LSS_ANSWER = 0x080, 0x580, 0x700, 0x7E4
_EXACT = 0x7FF
_KEPT_EMERGENCIES = 256
_BOOT_UP = 0
_OPERATIONAL_STATE = 5
_SDO_TIMEOUT_S = 0.5

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
        self.lost_index = threading.Event()
        """Set by an unexpected boot-up: encoder positions are void."""
        self._expect_boot_up = False
        ids = list(node_ids)
        filters = [(base + node, _EXACT) for node in ids for base in (_EMCY, _SDO_ANSWER)]
        filters += [(_HEARTBEAT + node, _EXACT) for node in (*ids, master_node_id)]
        filters.append((_LSS_ANSWER, _EXACT))
        self._bus = open_python_can(url, filters)
        self._canopen = canopen.Network(self._bus)
        self._canopen.connect()
        self._nodes: dict[int, canopen.RemoteNode] = {}
        self._lock = threading.Lock()
        self._heartbeat_s = heartbeat_s
        self._heartbeat = can.Message(
            arbitration_id=_HEARTBEAT + master_node_id,
            data=[_OPERATIONAL_STATE],
            is_extended_id=False,
        )
        self.foreign_master = threading.Event()
        """Set when somebody else produces the master's heartbeat."""
        self._canopen.subscribe(_HEARTBEAT + master_node_id, lambda *_: self.foreign_master.set())
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def add_node(self, node_id: int, dictionary: ObjectDictionary) -> None:
        """Make a node known, with the object dictionary its EDS describes."""
        node = self._nodes[node_id] = self._canopen.add_node(node_id, dictionary)
        node.sdo.RESPONSE_TIMEOUT = _SDO_TIMEOUT_S
        node.emcy.add_callback(lambda error: self._on_emergency(node_id, error))
        node.nmt.add_heartbeat_callback(lambda state: self._on_heartbeat(node_id, state))

    def dictionary(self, node_id: int) -> ObjectDictionary:
        """Return the node's object dictionary."""
        return self._nodes[node_id].object_dictionary

    def _on_emergency(self, node_id: int, error: canopen.emcy.EmcyError) -> None:
        emergency = Emergency(node_id, error.code, error.register, error.data, time.monotonic())
        self.emergencies.append(emergency)
        if error.code >> 8 and not self.alarm_text:
            self.alarm_text = f"emergency message: {emergency}"

    def _on_heartbeat(self, node_id: int, state: int) -> None:
        if state == _BOOT_UP and not self._expect_boot_up:
            self.lost_index.set()
            if not self.alarm_text:
                self.alarm_text = f"node {node_id} has restarted (unexpected boot-up message)"

    def clear_alarm(self) -> None:
        """Forget the latched alarm, after its cause has been dealt with."""
        self.alarm_text = ""

    # -- objects

    def read(self, node_id: int, index: int, sub: int = 0) -> int | str | bytes:
        """Return an object's value, decoded by its type; raises SdoError."""
        variable = self._variable(node_id, index, sub)
        with self._lock:
            try:
                value: Any = variable.raw
            except (SdoAbortedError, SdoCommunicationError, can.CanError, OSError) as error:
                raise self._sdo_error(node_id, index, sub, "read", error) from error
        return value if isinstance(value, int | str) else bytes(value)

    def read_int(self, node_id: int, index: int, sub: int = 0) -> int:
        """Return an integer object's value; raises SdoError."""
        value = self.read(node_id, index, sub)
        if not isinstance(value, int):
            raise SdoError(f"node {node_id}: object {index:04X}h:{sub} is no integer: {value!r}")
        return value

    def write(self, node_id: int, index: int, sub: int, value: int) -> None:
        """Write an integer object; raises SdoError."""
        variable = self._variable(node_id, index, sub)
        with self._lock:
            try:
                variable.raw = value
            except (SdoAbortedError, SdoCommunicationError, can.CanError, OSError) as error:
                raise self._sdo_error(node_id, index, sub, f"set to {value}", error) from error
            except struct.error as error:
                raise SdoError(
                    f"node {node_id}: object {index:04X}h:{sub} cannot hold {value}"
                ) from error

    def _variable(self, node_id: int, index: int, sub: int) -> Any:
        try:
            entry: Any = self._nodes[node_id].sdo[index]
            return entry if not hasattr(entry, "values") else entry[sub]
        except KeyError:
            raise SdoError(
                f"node {node_id}: object {index:04X}h:{sub} is not in the drive's EDS"
            ) from None

    @staticmethod
    def _sdo_error(node_id: int, index: int, sub: int, what: str, error: Exception) -> SdoError:
        if isinstance(error, SdoAbortedError):
            reason = f"{SdoAbortedError.CODES.get(error.code, 'refused')} ({error.code:08X}h)"
        else:
            reason = str(error) or type(error).__name__
        return SdoError(f"node {node_id}: object {index:04X}h:{sub} cannot be {what}: {reason}")

    # -- network management

    def reset_communication(self, node_id: int, timeout_s: float) -> bool:
        """Reset the node's communication; return whether its boot-up message came in time."""
        nmt = self._nodes[node_id].nmt
        self._expect_boot_up = True
        try:
            nmt.send_command(130)
            nmt.wait_for_bootup(timeout_s)
        except canopen.nmt.NmtError:
            return False
        except (can.CanError, OSError) as error:
            raise BusError(f"{self.url}: cannot send: {error}") from error
        finally:
            self._expect_boot_up = False
        return True

    def start(self, node_id: int) -> None:
        """Command the node to operational."""
        self._nodes[node_id].nmt.send_command(1)

    def wait_for_heartbeat(self, node_id: int, timeout_s: float) -> int | None:
        """Return the NMT state of the node's next heartbeat, None when none came."""
        nmt = self._nodes[node_id].nmt
        try:
            nmt.wait_for_heartbeat(timeout_s)
        except canopen.nmt.NmtError:
            return None
        return int(nmt._state)

    # -- heartbeat of the master

    def start_heartbeat(self) -> None:
        """Begin to produce the master's heartbeat."""
        self._thread = threading.Thread(target=self._produce, name="heartbeat", daemon=True)
        self._thread.start()

    def _produce(self) -> None:
        while not self._stop.wait(self._heartbeat_s):
            if self.cycling:
                continue
            try:
                self._bus.send(self._heartbeat)
            except (can.CanError, OSError):
                return

    def close(self) -> None:
        """Leave the bus."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self._canopen.disconnect()
