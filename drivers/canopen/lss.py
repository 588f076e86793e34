"""LSS master of CiA 305: find drives by their identity, set their node id and bit rate.

The `canopen` package's master is not used, because it accepts any frame as the answer to the last
request. With several drives without a node id, its fastscan can assemble an identity that none of
them has. It also waits 0.2 s for each number of an address and drops the error codes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Self

from cdpr_drivers.bus.frames import EFF_FLAG, FRAME, RTR_FLAG
from cdpr_drivers.bus.url import BusUrl
from cdpr_drivers.canopen.network import BusMember
from cdpr_drivers.canopen.sdo import ANSWER, REQUEST, SdoClient
from cdpr_drivers.errors import BusError, DriverError, SdoAbortError, SdoTimeoutError
from cdpr_rt.core.clock import Clock

# Frames between the LSS master and the devices on one bus: requests, answers, timeouts.

_MASTER, _SLAVE = 0x7E5, 0x7E4
_NMT, _HEARTBEAT = 0x000, 0x700
_EXACT_ID_MASK = 0x7FF | EFF_FLAG | RTR_FLAG
_ANY_NODE = 0x780 | EFF_FLAG | RTR_FLAG
_RESET_COMMUNICATION = 130
_SETTLE_S = 0.005
_SDO_TIMEOUTS = 3.0
_SDO_BYTES = 8
_LONGEST_DRAIN_S = 0.3
_MOST_WAITING = 1024


class LssError(DriverError):
    """A device refused a setting or did not answer over LSS; names the setting and the reason."""


__all__ = [
    "BITRATE_INDEX",
    "NODE_ID_UNKNOWN",
    "UNCONFIGURED",
    "LssAddress",
    "LssError",
    "LssMaster",
]

UNCONFIGURED = 255
"""Node id of a device without one."""
NODE_ID_UNKNOWN = 0
"""Stands for the node id of a device that cannot report it, such as an early LSS device."""

BITRATE_INDEX = {
    1_000_000: 0,
    800_000: 1,
    500_000: 2,
    250_000: 3,
    125_000: 4,
    50_000: 6,
    20_000: 7,
    10_000: 8,
}
"""Index of CiA 305's table by bit rate, bit/s."""

_SWITCH_GLOBAL, _WAITING, _CONFIGURATION = 0x04, 0, 1
_SELECT, _SELECTED = 0x40, 0x44
_IDENTIFY, _IDENTIFIED = 0x46, 0x4F
_IDENTIFY_UNCONFIGURED, _UNCONFIGURED_IDENTIFIED = 0x4C, 0x50
_FASTSCAN, _FROM_THE_START = 0x51, 128
_INQUIRE, _INQUIRE_NODE_ID = 0x5A, 0x5E
_SET_NODE_ID, _SET_BIT_TIMING, _ACTIVATE, _STORE = 0x11, 0x13, 0x15, 0x17
_REASONS = {
    (_SET_NODE_ID, 1): "it accepts only node ids 1 to 127",
    (_SET_BIT_TIMING, 1): "it does not support this bit rate",
    (_STORE, 1): "it cannot store node id and bit rate",
    (_STORE, 2): "its memory could not be written",
}
_VENDOR_SPECIFIC = 255
_NO_ANSWER = {
    _SET_BIT_TIMING: "the device does not answer to a bit rate: it lacks this LSS service, so set "
    "the bit rate with the manufacturer's tool, and the node id without --bitrate",
    _STORE: "the device does not answer to the request to store its settings",
}
"""Problems with a device that has answered before, by the request that it does not answer."""

_SEARCHES = 4
_ALL = (0, 0xFFFFFFFF)


@dataclass(frozen=True, order=True)
class LssAddress:
    """The four numbers of 1018h, which together identify a single device."""

    vendor_id: int
    product_code: int
    revision: int
    serial: int

    @property
    def numbers(self) -> tuple[int, int, int, int]:
        """The numbers in the standard's order."""
        return self.vendor_id, self.product_code, self.revision, self.serial

    def __str__(self) -> str:
        vendor, product, revision, _ = (f"{number:08X}h" for number in self.numbers)
        return f"vendor {vendor}, product {product}, revision {revision}, serial {self.serial}"


class LssMaster(BusMember):
    """LSS on one bus; a context manager that leaves every device in the waiting state.

    `timeout_s` is the longest time that a device may take to answer. It also determines the
    duration of a search, because fastscan asks bit by bit and silence is a valid answer. Raises
    BusError if the bus cannot be opened, or is lost later.
    """

    def __init__(self, url: BusUrl, clock: Clock, timeout_s: float = 0.1) -> None:
        self.timeout_s = timeout_s
        self.hides_others = False
        """Whether a device found by the last fastscan answers every request and so hides others."""
        self._frames: deque[tuple[int, bytes]] = deque(maxlen=_MOST_WAITING)
        self._lost: BusError | None = None
        self._clients: dict[int, SdoClient] = {}
        self._answering: set[int] = set()
        heard = [(_SLAVE, _EXACT_ID_MASK), (ANSWER, _ANY_NODE), (_HEARTBEAT, _ANY_NODE)]
        super().__init__(url, clock, heard)
        self._settle_s = _SETTLE_S

    def on_loss(self, error: BusError) -> None:
        """End all transfers and all waits with this error."""
        self._lost = error
        for client in self._clients.values():
            client.fail(error)

    def take_frame(self, frame: memoryview) -> None:
        """Queue a frame for the waiting request."""
        identifier, length, data = FRAME.unpack_from(frame)
        client = self._clients.get(identifier - ANSWER)
        if client is None:
            self._frames.append((identifier, data[:length]))
        elif length == _SDO_BYTES:
            self._answering.add(identifier - ANSWER)
            client.on_answer(data)

    # -- other nodes of the bus

    def node_id_in_use(self, node_id: int, listen_s: float = 0.5) -> str:
        """Return the evidence that a node uses `node_id`; else an empty text."""
        self._collect(0, 0.0)
        self._answering.discard(node_id)
        with suppress(SdoAbortError, SdoTimeoutError):
            self._upload(node_id, 0x1000)
        if node_id in self._answering:  # even if it answers another node
            return "it answers SDO requests"
        deadline = self.clock.now_s + listen_s
        while (frame := self._receive(deadline)) is not None:
            if frame[0] == _HEARTBEAT + node_id:
                return "its heartbeat is on the bus"
        return ""

    def read_object(self, node_id: int, index: int) -> int:
        """Return an unsigned object by SDO; raises SdoAbortError, SdoTimeoutError, BusError."""
        return int.from_bytes(self._upload(node_id, index), "little")

    def _upload(self, node_id: int, index: int) -> bytes:
        if node_id not in self._clients:
            send = partial(self.send, REQUEST + node_id)
            self._clients[node_id] = SdoClient(send, self.clock)
        timeout_s = _SDO_TIMEOUTS * self.timeout_s
        with suppress(SdoTimeoutError):
            return self._clients[node_id].upload(index, 0, timeout_s)
        return self._clients[node_id].upload(index, 0, timeout_s)

    def reset_communication(self, node_id: int) -> None:
        """Restart a node's communication by NMT, so that its new node id takes effect."""
        self.send(_NMT, bytes([_RESET_COMMUNICATION, node_id]))

    def wait_for_boot_up(self, node_id: int, timeout_s: float = 2.0) -> bool:
        """Return whether a node's boot-up message or heartbeat arrives in time."""
        deadline = self.clock.now_s + timeout_s
        while (frame := self._receive(deadline)) is not None:
            if frame[0] == _HEARTBEAT + node_id:
                return True
        return False

    # -- frames

    def _ask_single(self, question: bytes, specifier: int) -> bytes:
        """Return the answer of the one device in the configuration state; raises LssError."""
        answer = self._ask(question, specifier)
        if answer is None:
            raise LssError(
                _NO_ANSWER.get(question[0], f"no device answers (LSS command {question[0]:02X}h)")
            )
        answers = [answer, *self._collect(specifier, self._settle_s)]
        if len(answers) > 1:
            raise LssError(
                f"{len(answers)} devices answer: connect one at a time, or name one by its "
                "profile and serial number"
            )
        return answers[0]

    def _ask(self, question: bytes, specifier: int) -> bytes | None:
        self._collect(specifier, 0.0)
        self._send(question)
        deadline = self.clock.now_s + self.timeout_s
        while (frame := self._receive(deadline)) is not None:
            if frame[0] == _SLAVE and frame[1][:1] == bytes([specifier]):
                return frame[1].ljust(8, b"\0")
        return None

    def _collect(self, specifier: int, wait_s: float) -> list[bytes]:
        """Return the answers that arrive within `wait_s`; with 0.0 discard waiting frames."""
        deadline = self.clock.now_s + wait_s
        answers = []
        while (frame := self._receive(deadline)) is not None:
            if frame[0] == _SLAVE and frame[1][:1] == bytes([specifier]):
                answers.append(frame[1].ljust(8, b"\0"))
        return answers

    def _receive(self, deadline: float) -> tuple[int, bytes] | None:
        """Return the next frame, even one that waits after the deadline; None if no frame waits."""
        if deadline - self.clock.now_s < -_LONGEST_DRAIN_S:
            return None  # otherwise a babbling node would block this loop
        self.poll()
        self.clock.wait(lambda: self._frames or self._lost, deadline)
        if self._lost is not None:
            raise self._lost
        return self._frames.popleft() if self._frames else None

    def _send(self, data: bytes) -> None:
        self.send(_MASTER, data.ljust(8, b"\0"))

    # -- context

    def __enter__(self) -> Self:
        self.release()
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        try:
            self.release()
        except BusError:
            if error is None:
                raise
        finally:
            self.close()

    # -- searching

    def release(self) -> None:
        """Return all devices to the waiting state; one that got its first node id boots now."""
        self._send(bytes([_SWITCH_GLOBAL, _WAITING]))

    def has_unconfigured(self) -> bool:
        """Return whether a device without a node id is on the bus (not all know this request)."""
        return bool(self._ask(bytes([_IDENTIFY_UNCONFIGURED]), _UNCONFIGURED_IDENTIFIED))

    def unconfigured(self) -> list[LssAddress]:
        """Return the devices without a node id, by fastscan, sorted.

        Raises LssError if their answers are inconsistent.
        """
        for _ in range(_SEARCHES):
            found = self._fastscan_all()
            if found is not None and all(self._confirms(address) for address in found):
                self.release()
                return sorted(found)
            self._settle_s *= 2.0  # answers of several devices overlapped the next request
        raise LssError(
            "the devices without a node id give contradictory answers to the fastscan; use "
            "a longer --timeout-ms, or connect one at a time"
        )

    def find(
        self,
        vendor_id: int,
        product_code: int,
        revisions: tuple[int, int] = _ALL,
        serials: tuple[int, int] = _ALL,
        usual_revision: int | None = None,
    ) -> list[LssAddress]:
        """Return the devices of one type, with a node id or without, in inclusive ranges.

        `usual_revision` is tried first: each device that has it needs no search for its revision.
        """
        kind = vendor_id, product_code
        found = []
        for serial in self._bisect(serials, lambda part: self._identify(*kind, revisions, part)):
            one = serial, serial

            def of_one(part: tuple[int, int], one: tuple[int, int] = one) -> bool:
                return self._identify(*kind, part, one)

            if usual_revision is not None and of_one((usual_revision, usual_revision)):
                found.append(LssAddress(*kind, usual_revision, serial))
                continue
            found += [
                LssAddress(*kind, revision, serial) for revision in self._bisect(revisions, of_one)
            ]
        return found

    def select(self, address: LssAddress) -> int:
        """Put one device into the configuration state; return its node id or a constant above.

        Raises LssError if it does not answer.
        """
        self.release()
        for part, number in enumerate(address.numbers):
            question = bytes([_SELECT + part]) + number.to_bytes(4, "little")
            if part < 3:
                self._send(question)
            elif not self._ask(question, _SELECTED):
                raise LssError(f"no device answers to {address}")
        return self._node_id()

    def select_only(self) -> tuple[LssAddress, int]:
        """Put the only device on the bus into the configuration state; return address and node id.

        Raises LssError if none answers, or more than one.
        """
        self._send(bytes([_SWITCH_GLOBAL, _CONFIGURATION]))
        return LssAddress(*self._inquire()), self._node_id()

    def _identify(
        self,
        vendor_id: int,
        product_code: int,
        revisions: tuple[int, int],
        serials: tuple[int, int],
    ) -> bool:
        numbers = (vendor_id, product_code, *revisions, *serials)
        *first, last = (
            bytes([_IDENTIFY + part]) + number.to_bytes(4, "little")
            for part, number in enumerate(numbers)
        )
        for question in first:
            self._send(question)
        return bool(self._ask(last, _IDENTIFIED))

    def _bisect(
        self, whole: tuple[int, int], any_in: Callable[[tuple[int, int]], bool]
    ) -> list[int]:
        """Return the numbers in a range that devices have; `any_in` tests a part of the range."""
        found: list[int] = []
        parts = [whole]
        while parts:
            low, high = parts.pop()
            if not any_in((low, high)):
                continue
            if low == high:
                found.append(low)
                continue
            middle = (low + high) // 2
            parts += [(middle + 1, high), (low, middle)]
        return found

    def _fastscan_all(self) -> set[LssAddress] | None:
        """Return the devices found by repeated fastscans; None if a scan does not complete.

        A device is in the configuration state once it is found; CiA 305 then excludes it from
        fastscans. But devices with the CANopenNode stack answer every request in that state, until
        they have a node id and are released. They hide the devices that are not found yet.
        """
        self.release()
        self.hides_others = False
        found: set[LssAddress] = set()
        while self._scan(0, _FROM_THE_START, 0, 0):
            # every waiting device now expects the first number, so none may answer a request for
            # the last
            self.hides_others = bool(found) and self._scan(0, 31, 3, 3)
            if self.hides_others:
                break
            address = self._scan_address()
            if address is None:
                return None
            if address in found:
                self.hides_others = True
                break
            found.add(address)
        return found

    def _scan_address(self) -> LssAddress | None:
        numbers = []
        for part in range(4):
            number = self._scan_number(part)
            if number is None:
                return None
            numbers.append(number)
        return LssAddress(*numbers)

    def _confirms(self, address: LssAddress) -> bool:
        try:
            return self.select(address) in (UNCONFIGURED, NODE_ID_UNKNOWN)
        except LssError:
            return False

    def _scan_number(self, part: int) -> int | None:
        """Return one number of the lowest address; None if no device confirms it."""
        number = 0
        for bit in range(31, -1, -1):
            if not self._scan(number, bit, part, part):
                number |= 1 << bit
        return number if self._scan(number, 0, part, (part + 1) % 4) else None

    def _scan(self, number: int, bit: int, part: int, following: int) -> bool:
        question = bytes([_FASTSCAN]) + number.to_bytes(4, "little")
        if not self._ask(question + bytes([bit, part, following]), _IDENTIFIED):
            return False
        # each matching device answers, and their delays differ
        self._collect(_IDENTIFIED, self._settle_s)
        return True

    # -- requests to the device in the configuration state

    def _inquire(self) -> tuple[int, int, int, int]:
        numbers = []
        for part in range(4):
            answer = self._ask_single(bytes([_INQUIRE + part]), _INQUIRE + part)
            numbers.append(int.from_bytes(answer[1:5], "little"))
        vendor, product, revision, serial = numbers
        return vendor, product, revision, serial

    def _node_id(self) -> int:
        answer = self._ask(bytes([_INQUIRE_NODE_ID]), _INQUIRE_NODE_ID)
        return NODE_ID_UNKNOWN if answer is None else answer[1]

    def set_node_id(self, node_id: int) -> None:
        """Give the selected device a node id, 1 to 127 or 255; raises LssError if refused.

        It takes effect at the next communication reset, and permanently if stored.
        """
        self._set(_SET_NODE_ID, bytes([node_id]), f"node id {node_id}")

    def set_bitrate(self, bitrate_bit_s: int) -> None:
        """Give the selected device a bit rate of `BITRATE_INDEX`.

        It takes effect at `activate_bitrate` or, if stored, at the next power-on. Raises LssError
        if the device refuses it, or lacks this service.
        """
        table = bytes([0, BITRATE_INDEX[bitrate_bit_s]])
        self._set(_SET_BIT_TIMING, table, f"a bit rate of {bitrate_bit_s // 1000} kbit/s")

    def store(self) -> None:
        """Let the selected device store node id and bit rate; raises LssError if it cannot."""
        self._set(_STORE, b"", "to store its settings")

    def activate_bitrate(self, delay_s: float) -> None:
        """Let the selected device switch its rate, with `delay_s` of silence before and after."""
        self._send(bytes([_ACTIVATE]) + round(delay_s * 1e3).to_bytes(2, "little"))

    def _set(self, command: int, content: bytes, what: str) -> None:
        error, maker_code = self._ask_single(bytes([command]) + content, command)[1:3]
        if error == 0:
            return
        reason = _REASONS.get((command, error), f"LSS error code {error}")
        if error == _VENDOR_SPECIFIC:
            reason = f"for a manufacturer-specific reason, code {maker_code}"
        raise LssError(f"the device rejects {what}: {reason}")
