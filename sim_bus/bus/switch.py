"""Delivery of frames between clients and nodes: routes, order of arbitration, bus load."""

from __future__ import annotations

import errno
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from typing import Protocol

from cdpr_sim_bus.bus.client import Client
from cdpr_sim_bus.frame import (
    ERR_FLAG,
    HEADER,
    LONGEST_FRAME_BITS,
    RTR_FLAG,
    SYNC_ID,
    arbitration_key,
    base_id,
    bits_by_length,
)


class LocalNode(Protocol):
    """A CAN node driven by one thread; frames are 16 bytes, laid out as `struct can_frame`.

    All times are bus time in seconds. After every call the bus sends what stands in `outbox`, in
    the order of arbitration, and clears the list (the list object itself stays the same).
    """

    outbox: list[bytes]

    @property
    def node_id(self) -> int:
        """Node id in use, 0 for a node that only listens."""

    @property
    def sync_period_s(self) -> float:
        """Communication cycle period (1006h), 0 while it is not set."""

    @property
    def accepts(self) -> AbstractSet[int] | None:
        """Identifiers (11 bits, or 29 bits with the EFF flag) the node wants, None for all.

        A node that changes them shows a new set; the bus looks at the attribute again after
        every frame outside the cyclic exchange (anything but SYNC and PDOs) and after `advance`
        while bus time runs by itself.
        """

    def receive(self, frame: bytes, now: float) -> None:
        """Take a frame seen on the bus, SYNC included; never one of the node's own."""

    def advance(self, now: float) -> None:
        """Bring timers and physics to `now`; called before a frame when time has moved."""

    def next_event(self) -> float:
        """Return the bus time of the next timer, `math.inf` when none runs."""

    def close(self) -> None:
        """Flush and close what the node holds open."""


def is_acyclic(can_id: int) -> bool:
    """Return whether the identifier is of acyclic traffic, which waits for gaps between the PDOs.

    SDO, heartbeat and LSS of the predefined connection set (CiA 301): they lose arbitration
    against SYNC and PDOs, so they never make a cycle too long by more than one frame.
    """
    base = base_id(can_id)
    return 0x580 <= base <= 0x67F or 0x700 <= base <= 0x77F or base in (0x7E4, 0x7E5)


class BusLoad:
    """Worst-case bits of all frames compared with bus time.

    In lockstep bus time stands still while a cycle's frames go, so their sum is compared with
    the bus time from SYNC to SYNC. In paced mode the wire is followed frame by frame: a cycle
    overruns when at its end the wire would still be busy for longer than one frame takes.
    """

    def __init__(self, bitrate: int, *, lockstep: bool) -> None:
        self.bitrate = bitrate
        self.frames = 0
        self.overruns = 0
        self.peak_cycle_load = 0.0
        self.cycle_bits = 0
        """Bits of cyclic traffic since the last SYNC; the hub adds to it frame by frame."""
        self.acyclic_bits = 0
        self._lockstep = lockstep
        self._bit_s = 1.0 / bitrate
        self._longest_s = LONGEST_FRAME_BITS * self._bit_s
        self._past_bits = 0
        self._last_sync_s = -1.0
        self._busy_until_s = 0.0

    def occupy(self, now_s: float, bits: int) -> None:
        """Put a cyclic frame of `bits` on the wire at `now_s` (paced mode only)."""
        self._busy_until_s = max(self._busy_until_s, now_s) + bits * self._bit_s

    def sync(self, now_s: float) -> None:
        """Close the cycle that ends with the SYNC at `now_s`."""
        window_s = now_s - self._last_sync_s
        if self._last_sync_s >= 0.0 and window_s > 0.0:
            load = self.cycle_bits * self._bit_s / window_s
            self.peak_cycle_load = max(self.peak_cycle_load, load)
            # a bit of slack for the rounding of bus time
            late = self._busy_until_s - now_s - self._longest_s > 0.0
            if load > 1.0 + 1e-9 if self._lockstep else late:
                self.overruns += 1
        self._past_bits += self.cycle_bits
        self.cycle_bits = 0
        self._last_sync_s = now_s

    def load(self, now_s: float) -> float:
        """Return the share of bus time since the start during which the wire was in use."""
        bits = self._past_bits + self.cycle_bits + self.acyclic_bits
        return bits * self._bit_s / now_s if now_s > 0.0 else 0.0


_LSS_ANSWER = 0x7E4


class Route:
    """Receivers and lengths in bits of the frames with one identifier."""

    __slots__ = (
        *("acyclic", "bits", "clients", "configures"),
        *("key", "longest", "merges", "nodes", "sync"),
    )

    def __init__(self, can_id: int, clients: list[Client], nodes: list[LocalNode]) -> None:
        self.key = arbitration_key(can_id)
        self.bits = bits_by_length(can_id)
        # error frames are no traffic: they have no length
        self.longest = -1 if can_id & ERR_FLAG else 8
        self.acyclic = is_acyclic(can_id)
        self.configures = self.acyclic or base_id(can_id) == 0
        self.sync = can_id == SYNC_ID
        # identical LSS answers at the same time are one frame on a wire
        self.merges = can_id == _LSS_ANSWER
        self.clients = tuple(clients)
        self.nodes = tuple(nodes)


class Contention:
    """The head of each client's queue; the clients' own order is kept.

    In lockstep the smallest identifier wins. In paced mode frames have times: one that was sent
    while the wire could still have been busy with an earlier one contends with it, a later one
    waits, however long the simulator itself was held up and whatever has come together meanwhile.
    """

    def __init__(self, *, paced: bool, bitrate: int) -> None:
        self._paced = paced
        self._window_s = LONGEST_FRAME_BITS / bitrate
        self.heads: dict[Client, tuple[int, bytes]] = {}
        """The frame of each client that waits, with its key of arbitration."""

    def add(self, client: Client, frame: bytes) -> None:
        """Queue the frame that `client` sent last."""
        self.heads[client] = (arbitration_key(HEADER.unpack_from(frame)[0]), frame)

    def discard(self, client: Client) -> None:
        """Discard the frame of a client that has disconnected."""
        self.heads.pop(client, None)

    def pop(self) -> tuple[Client, bytes]:
        """Return the frame that wins arbitration, with its sender; there must be one."""
        heads = self.heads
        if len(heads) == 1:
            client, (_, frame) = heads.popitem()
            return client, frame
        contending = list(heads)
        if self._paced:
            end_s = min(client.sent_s for client in contending) + self._window_s
            contending = [client for client in contending if client.sent_s <= end_s]
        winner = min(contending, key=lambda client: heads[client][0])
        return winner, heads.pop(winner)[1]


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

    def _deliver(self, frame: bytes, peer: Client) -> None:
        peer.delivered = True
        try:
            peer.send(frame)
        except OSError as error:
            self._lose(peer, error)

    def _lose(self, peer: Client, error: OSError) -> None:
        """Count a packet that `peer` could not take, or remove one whose socket has failed."""
        if isinstance(error, BlockingIOError):
            # a client that does not read loses frames; the bus does not wait for it
            peer.dropped += 1
            self.dropped += 1
        elif error.errno not in (errno.EPIPE, errno.ECONNRESET) or peer.essential:
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
            self._deliver(frame, peer)
        for node in route.nodes:
            if node is not source:
                node.receive(frame, self._now_s)
                self._leftover = self._leftover or bool(node.outbox)
