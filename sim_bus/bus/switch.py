"""Delivery of frames: routes, order of arbitration, bus load."""

from __future__ import annotations

import errno
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

from cdpr_sim_bus.bus.bus_load import BusLoad
from cdpr_sim_bus.bus.client import Client
from cdpr_sim_bus.bus.node_protocol import LocalNode
from cdpr_sim_bus.bus.route import Route
from cdpr_sim_bus.frame import HEADER, RTR_FLAG

_MOST_ROUTES = 4096
_MOST_ANSWERS = 64


class Switch(ABC):
    """Carries frames between clients on sockets and nodes of this process, at one bus time."""

    def __init__(self, nodes: Sequence[LocalNode], bitrate: int, *, paced: bool) -> None:
        self.nodes = tuple(nodes)
        self.load = BusLoad(bitrate, lockstep=not paced)
        self.sync_count = 0
        self.dropped = 0
        self._paced = paced
        self._clients: dict[int, Client] = {}
        self._routes: dict[int, Route] = {}
        self._accepts = [node.accepts for node in self.nodes]
        # the nodes are switched on at 0
        self._now_s = -1.0
        self._leftover = False
        self._batch: list[tuple[int, int, int, Route, bytes, LocalNode]] = []

    def next_event_s(self) -> float:
        """Return the bus time of the next timer of a node, `math.inf` when none runs."""
        next_s = math.inf
        for node in self.nodes:
            next_s = min(next_s, node.next_event())
        return next_s

    def advance(self, now_s: float) -> None:
        """Advance all nodes to bus time `now_s` and send their frames."""
        self._now_s = now_s
        for node in self.nodes:
            node.advance(now_s)
        self._check_accepts()
        self._flush()

    def settle(self) -> None:
        """Deliver what nodes answer to each other's frames, a limited number of rounds."""
        for _ in range(_MOST_ANSWERS):
            if not self._leftover:
                return
            self._flush()

    @abstractmethod
    def _remove(self, client: Client, reason: str) -> None:
        """Remove a client that has disconnected."""

    def _check_accepts(self) -> None:
        for i, node in enumerate(self.nodes):
            if node.accepts is not self._accepts[i]:
                self._accepts[i] = node.accepts
                self._routes.clear()

    def _count_sync(self, now_s: float, bits: int) -> None:
        self.sync_count += 1
        self.load.sync(now_s)
        self.load.cycle_bits += bits
        if self._paced:
            self.load.occupy(now_s, bits)

    def _deliver(self, packet: bytes, peer: Client) -> None:
        try:
            peer.send(packet)
        except BlockingIOError:
            # a client that does not read loses frames; the bus does not wait for it
            peer.dropped += 1
            self.dropped += 1
        except OSError as error:
            if error.errno not in (errno.EPIPE, errno.ECONNRESET) or peer.essential:
                self._remove(peer, f"lost: {error.strerror}")

    def _route(self, can_id: int) -> Route:
        if len(self._routes) >= _MOST_ROUTES:
            self._routes.clear()
        clients = [client for client in self._clients.values() if client.wants(can_id)]
        # a remote frame has the identifier of what it asks for
        plain = can_id & ~RTR_FLAG
        nodes = [node for node in self.nodes if node.accepts is None or plain in node.accepts]
        self._routes[can_id] = route = Route(can_id, clients, nodes)
        return route

    def _flush(self) -> None:
        """Send what stands in the outboxes, in the order of arbitration.

        Frames that other nodes of this process send in answer wait for the next call, so that a
        ring of nodes that answer each other cannot keep the clients out.
        """
        batch = self._batch
        self._leftover = False
        for node in self.nodes:
            if node.outbox:
                for frame in node.outbox:
                    can_id, length = HEADER.unpack_from(frame)
                    route = self._routes.get(can_id) or self._route(can_id)
                    if route.merges and any(other[4] == frame for other in batch):
                        continue
                    batch.append((route.key, len(batch), length, route, frame, node))
                node.outbox.clear()
        if not batch:
            return
        batch.sort()
        for _, _, length, route, frame, node in batch:
            self._emit(frame, length, route, node)
        batch.clear()

    def _emit(self, frame: bytes, length: int, route: Route, source: LocalNode) -> None:
        load = self.load
        load.frames += 1
        if route.sync:
            self._count_sync(self._now_s, route.bits[length])
        elif route.acyclic:
            load.acyclic_bits += route.bits[length]
        else:
            load.cycle_bits += route.bits[length]
            if self._paced:
                load.occupy(self._now_s, route.bits[length])
        for peer in route.clients:
            peer.delivered = True
            self._deliver(frame, peer)
        for node in route.nodes:
            if node is not source:
                node.receive(frame, self._now_s)
                self._leftover = self._leftover or bool(node.outbox)
