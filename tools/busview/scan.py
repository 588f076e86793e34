"""Scan of a bus: listening, then reading objects of all nodes at once."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field

from cdpr_drivers.bus import BusUrl, FramePort, open_port
from cdpr_drivers.decode import Frame
from cdpr_drivers.errors import BusError
from cdpr_tools.busview.node_reader import SETTLE_S, NodeInfo, NodeReader
from cdpr_tools.errors import BadInputError

LISTEN_S = 1.2
"""Long enough for heartbeats of a second."""
_IN_FLIGHT = 64
_POLL_S = 0.005
_FRAME_BYTES, _CONTROL_BYTES = 16, 4096
_REQUEST, _ANSWER, _HEARTBEAT = 0x600, 0x580, 0x700
_NODE, _FUNCTION = 0x07F, 0x780
_RPDOS = (0x200, 0x300, 0x400, 0x500)
_FILTERS = [(0x000, 0x7FF), (0x080, 0x7FF)]
_FILTERS += [(base, _FUNCTION) for base in (*_RPDOS, _ANSWER, _REQUEST, _HEARTBEAT)]
_AT_ONCE = 100


@dataclass
class Traffic:
    """What others say on the bus."""

    sdo_requests: set[int] = field(default_factory=set)
    """Nodes that another SDO client reads or writes."""
    heard: set[str] = field(default_factory=set)
    """SYNC, NMT, RPDO: signs of a master at work."""


class Scan:
    """A visit to a bus; `listen` sends nothing, `ask` reads and never writes.

    Raises BadInputError for a bus that cannot be opened, BusError when it is lost.
    """

    def __init__(self, url: BusUrl, node_ids: Iterable[int]) -> None:
        self.traffic = Traffic()
        self.found = {node_id: NodeInfo(node_id) for node_id in node_ids}
        self._asking: dict[int, NodeReader] = {}
        self._packet = bytearray(_CONTROL_BYTES)
        try:
            self._port: FramePort = open_port(url, _FILTERS)
        except BusError as error:
            raise BadInputError(str(error)) from error
        self._port.settimeout(_POLL_S)

    def listen(self, seconds: float) -> None:
        """Receive for so long without sending."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._receive()

    def ask(self) -> None:
        """Read the objects of all nodes, many at once, and note who answers one request twice."""
        waiting = [NodeReader(found) for found in self.found.values()]
        waiting.reverse()
        self._asking = {asking.found.node_id: asking for asking in waiting}
        active: list[NodeReader] = []
        while waiting or active:
            while waiting and len(active) < _IN_FLIGHT:
                active.append(waiting.pop())
            now = time.monotonic()
            for asking in active:
                self._send(asking.found.node_id, asking.due(now))
            active = [asking for asking in active if not asking.done]
            for _ in range(_AT_ONCE):
                if not self._receive():
                    break
        self.listen(SETTLE_S)
        for node_id in self.traffic.sdo_requests & self.found.keys():
            # another client may have asked for what came
            self.found[node_id].repeated.clear()
            self.found[node_id].differing.clear()

    def _send(self, node_id: int, data: bytes | None) -> None:
        if data is None:
            return
        try:
            self._port.send(Frame(0.0, _REQUEST + node_id, data).pack())
        except OSError as error:
            raise self._port.lost(error) from error

    def _receive(self) -> bool:
        """Receive and process one frame, or wait a little for it; return whether one came."""
        try:
            length = self._port.recv_into(self._packet)
        except BlockingIOError:
            return False
        except OSError as error:
            raise self._port.lost(error) from error
        if length == 0:
            raise self._port.lost()
        if length == _FRAME_BYTES:
            frame = Frame.unpack(0.0, self._packet[:_FRAME_BYTES])
            if not (frame.error or frame.extended or frame.remote):
                self._take(frame.can_id, frame.data)
        return True

    def _take(self, identifier: int, data: bytes) -> None:
        node_id, function = identifier & _NODE, identifier & _FUNCTION
        if function == _HEARTBEAT and node_id in self.found and len(data) == 1:
            found = self.found[node_id]
            found.heartbeats += 1
            found.nmt_state = data[0] & 0x7F
        elif function == _ANSWER and len(data) == 8:
            asking = self._asking.get(node_id)
            if asking is not None:
                self._send(node_id, asking.take(data, time.monotonic()))
        elif function == _REQUEST and node_id:
            self.traffic.sdo_requests.add(node_id)
        elif identifier == 0x080:
            self.traffic.heard.add("SYNC")
        elif identifier == 0x000:
            self.traffic.heard.add("NMT commands")
        elif function in _RPDOS and node_id:
            self.traffic.heard.add("RPDOs")

    def __enter__(self) -> Scan:
        return self

    def __exit__(self, *_: object) -> None:
        self._port.close()
