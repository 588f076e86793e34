"""A device on the simulated bus that answers as a test defines, through python-can."""

from __future__ import annotations

import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import can

Answer = Callable[[bytes], list[bytes]]


class ScriptedNode:
    """Answer each SDO request with the frames that `answer` returns, and keep the requests."""

    def __init__(self, bus: str, node_id: int, answer: Answer) -> None:
        self.node_id = node_id
        self.answer = answer
        self.requests: list[bytes] = []
        filters = [{"can_id": 0x600 + node_id, "can_mask": 0x7FF, "extended": False}]
        self.bus = can.Bus(interface="simbus", channel=bus[7:], can_filters=filters)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def send(self, identifier: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def _serve(self) -> None:
        while not self._stop.is_set():
            message = self.bus.recv(0.05)
            if message is None:
                continue
            request = bytes(message.data)
            self.requests.append(request)
            for data in self.answer(request):
                self.send(0x580 + self.node_id, data.ljust(8, b"\0"))

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self.bus.shutdown()


@contextmanager
def scripted(bus: str, node_id: int, answer: Answer) -> Iterator[ScriptedNode]:
    node = ScriptedNode(bus, node_id, answer)
    try:
        yield node
    finally:
        node.close()


def abort(request: bytes, code: int) -> bytes:
    return b"\x80" + request[1:4] + struct.pack("<I", code)


def expedited(request: bytes, value: int) -> bytes:
    return b"\x43" + request[1:4] + struct.pack("<I", value)


def endless(request: bytes) -> list[bytes]:
    """Serve a segmented upload that never ends."""
    if request[0] == 0x40:
        return [b"\x41" + request[1:4] + struct.pack("<I", 1 << 30)]
    if request[0] >> 5 == 3:
        return [bytes([request[0] & 0x10]) + bytes(7)]
    return []
