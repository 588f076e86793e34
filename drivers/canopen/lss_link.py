"""Frames between the LSS master and the devices on one bus: questions, answers, time-outs."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from functools import partial

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.frames import EFF_FLAG, FRAME, RTR_FLAG
from cdpr_drivers.bus.member import BusMember
from cdpr_drivers.canopen.sdo import SdoClient
from cdpr_drivers.canopen.sdo_frames import ANSWER, REQUEST
from cdpr_drivers.errors import BusError, DriverError, SdoAbortError, SdoTimeoutError
from cdpr_rt.core.clock import Clock

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
    """A device refused a setting, or did not answer, over LSS; says which and why."""


class LssLink(BusMember):
    """Frames of an LSS master: requests, answers, and SDO, NMT and heartbeats of other nodes.

    Raises BusError when the bus cannot be opened, or is lost later.
    """

    def __init__(self, url: BusUrl, clock: Clock, timeout_s: float = 0.1) -> None:
        self.timeout_s = timeout_s
        self._frames: deque[tuple[int, bytes]] = deque(maxlen=_MOST_WAITING)
        self._lost: BusError | None = None
        self._clients: dict[int, SdoClient] = {}
        self._answering: set[int] = set()
        heard = [(_SLAVE, _EXACT_ID_MASK), (ANSWER, _ANY_NODE), (_HEARTBEAT, _ANY_NODE)]
        super().__init__(url, clock, heard)
        self._settle_s = _SETTLE_S

    def on_loss(self, error: BusError) -> None:
        """End transfers and waits with the error."""
        self._lost = error
        for client in self._clients.values():
            client.fail(error)

    def take_frame(self, frame: memoryview) -> None:
        """Queue a frame for the request that waits."""
        identifier, length, data = FRAME.unpack_from(frame)
        client = self._clients.get(identifier - ANSWER)
        if client is None:
            self._frames.append((identifier, data[:length]))
        elif length == _SDO_BYTES:
            self._answering.add(identifier - ANSWER)
            client.on_answer(data)

    # -- other nodes of the bus

    def node_id_in_use(self, node_id: int, listen_s: float = 0.5) -> str:
        """Return how a node shows that `node_id` is in use, else an empty text."""
        self._collect(0, 0.0)
        self._answering.discard(node_id)
        with suppress(SdoAbortError, SdoTimeoutError):
            self._upload(node_id, 0x1000)
        if node_id in self._answering:  # whomever it answers
            return "it answers to SDO"
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
        """Restart a node's communication by NMT, so that its new node id counts."""
        self.send(_NMT, bytes([_RESET_COMMUNICATION, node_id]))

    def wait_for_boot_up(self, node_id: int, timeout_s: float = 2.0) -> bool:
        """Tell whether a node's boot-up message or heartbeat comes in time."""
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
            raise LssError(f"no device answers (LSS command {question[0]:02X}h)")
        answers = [answer, *self._collect(specifier, self._settle_s)]
        if len(answers) > 1:
            raise LssError(
                f"{len(answers)} devices answer at once: connect one at a time, or name one by its "
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
        """Return the answers that come within `wait_s`; with 0.0 throw away what waits."""
        deadline = self.clock.now_s + wait_s
        answers = []
        while (frame := self._receive(deadline)) is not None:
            if frame[0] == _SLAVE and frame[1][:1] == bytes([specifier]):
                answers.append(frame[1].ljust(8, b"\0"))
        return answers

    def _receive(self, deadline: float) -> tuple[int, bytes] | None:
        """Return the next frame, also one that waits when the time is over; None without one."""
        if deadline - self.clock.now_s < -_LONGEST_DRAIN_S:
            return None  # a babbling node would keep us for ever
        self.poll()
        self.clock.wait(lambda: self._frames or self._lost, deadline)
        if self._lost is not None:
            raise self._lost
        return self._frames.popleft() if self._frames else None

    def _send(self, data: bytes) -> None:
        self.send(_MASTER, data.ljust(8, b"\0"))
