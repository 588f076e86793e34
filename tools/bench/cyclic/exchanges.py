"""Three implementations of an exchange with n axes: ours, the `canopen` library's, bare sockets.

Each sends SYNC, takes the n TPDOs (6041h, 6064h, 6077h) and sends the n RPDOs (6040h, 6071h).
"""

from __future__ import annotations

import math
import socket
import struct
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import canopen
from canopen.objectdictionary import ObjectDictionary

from cdpr_drivers.axes.axis_group import AxisGroup
from cdpr_drivers.bus.adapters import simbus_socket
from cdpr_drivers.errors import BusError

_SYNC_ID, _TPDO1, _RPDO1 = 0x080, 0x180, 0x200
_CONTROLWORD, _TARGET_TORQUE = 0x6040, 0x6071
_FEEDBACK = (0x6041, 0x6064, 0x6077)
_TIMEOUT_S = 2.0
_NOTIFIER_CYCLE_S = 0.05


class OwnExchange:
    """`AxisGroup`, as the control loop calls it."""

    name = "ours"

    def __init__(self, join: Callable[[], AxisGroup]) -> None:
        self._join = join
        self._group: AxisGroup | None = None
        self._statuswords: list[int] = []

    def open(self) -> None:
        """Join the bus."""
        self._group = self._join()

    def cycle(self) -> None:
        """Exchange one cycle; raises BusError when an axis does not answer."""
        group = self._group
        assert group is not None  # opened
        group.sync()
        if group.receive() < group.n:
            raise BusError(f"ours: an axis did not answer: {group.alarm()}")
        group.transmit()

    def close(self) -> None:
        """Leave the bus."""
        if self._group is not None:
            self._statuswords = self._group.feedback.statusword.tolist()
            self._group.close()
            self._group = None

    def statuswords(self) -> list[int]:
        """Return the statusword of each axis in the last cycle."""
        return self._statuswords


class LibraryExchange:
    """The PDO path of the `canopen` package, used as its documentation shows.

    The objects are looked up once and a callback decodes them, so that only what the library
    must do is counted. Its notifier thread is woken by each frame.
    """

    name = "canopen"

    def __init__(self, channel: str, dictionaries: Mapping[int, ObjectDictionary]) -> None:
        """Read the PDO configuration of the nodes, keyed by node id, from the nodes."""
        self._channel = channel
        self._network = canopen.Network()
        # stopping the library takes up to one of its cycles, which are 1 s by default
        self._network.NOTIFIER_CYCLE = _NOTIFIER_CYCLE_S
        self._feedback = [[0] * len(_FEEDBACK) for _ in dictionaries]
        self._commands: list[tuple[Any, Any, Any]] = []
        self._waiting = 0
        self._complete = threading.Event()
        self.open()
        try:
            for i, (node_id, dictionary) in enumerate(dictionaries.items()):
                self._add(i, self._network.add_node(node_id, dictionary))
        finally:
            self.close()

    def _add(self, i: int, node: Any) -> None:
        node.tpdo.read()
        node.rpdo.read()
        answer, order = node.tpdo[1], node.rpdo[1]
        objects = [answer[index] for index in _FEEDBACK]
        feedback = self._feedback[i]

        def take(_pdo: object) -> None:
            feedback[:] = [variable.raw for variable in objects]
            self._waiting -= 1
            if not self._waiting:
                self._complete.set()

        answer.add_callback(take)
        self._commands.append((order, order[_CONTROLWORD], order[_TARGET_TORQUE]))

    def open(self) -> None:
        """Join the bus."""
        self._network.connect(interface="simbus", channel=self._channel)

    def cycle(self) -> None:
        """Exchange one cycle; raises BusError when an axis does not answer."""
        self._waiting = len(self._commands)
        self._complete.clear()
        self._network.sync.transmit()
        if not self._complete.wait(_TIMEOUT_S):
            raise BusError("canopen: an axis did not answer")
        for pdo, controlword, torque in self._commands:
            controlword.raw = 0
            torque.raw = 0
            pdo.transmit()

    def close(self) -> None:
        """Leave the bus."""
        self._network.disconnect()

    def statuswords(self) -> list[int]:
        """Return the statusword of each axis in the last cycle."""
        return [statusword for statusword, _, _ in self._feedback]


class FloorExchange:
    """Bare calls of one blocking socket and `struct`, for these frames and nothing else."""

    name = "floor"

    def __init__(self, channel: str, node_ids: Sequence[int]) -> None:
        self._channel = channel
        self._axis_of = {_TPDO1 + node: i for i, node in enumerate(node_ids)}
        self._rpdo_ids = [_RPDO1 + node for node in node_ids]
        self._sync = struct.pack("=IB3x8x", _SYNC_ID, 0)
        self._buffer = bytearray(16)
        self._feedback = [(0, 0, 0)] * len(node_ids)
        self._unpack = struct.Struct("=IB3xHih").unpack_from
        self._pack = struct.Struct("=IB3xHh4x").pack

    def open(self) -> None:
        """Join the bus."""
        self._sock = sock = simbus_socket.connect(self._channel)
        simbus_socket.exchange(sock, [(identifier, 0x7FF) for identifier in self._axis_of])
        # the kernel's time-out, since Python's own would put a poll before each call
        timeval = struct.pack("ll", math.ceil(_TIMEOUT_S), 0)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, timeval)
        self._send, self._recv_into = sock.send, sock.recv_into

    def cycle(self) -> None:
        """Exchange one cycle; raises OSError when an axis does not answer."""
        send, recv_into, unpack, pack = self._send, self._recv_into, self._unpack, self._pack
        buffer, feedback, axis_of = self._buffer, self._feedback, self._axis_of
        send(self._sync)
        for _ in feedback:
            recv_into(buffer)
            can_id, _, statusword, position, torque = unpack(buffer)
            feedback[axis_of[can_id]] = statusword, position, torque
        for can_id in self._rpdo_ids:
            send(pack(can_id, 4, 0, 0))

    def close(self) -> None:
        """Leave the bus."""
        self._sock.close()

    def statuswords(self) -> list[int]:
        """Return the statusword of each axis in the last cycle."""
        return [statusword for statusword, _, _ in self._feedback]


Exchange = OwnExchange | LibraryExchange | FloorExchange
"""An implementation of the exchange; it is on the bus from `open` to `close` only."""
