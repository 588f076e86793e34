"""The bus: clients on sockets and nodes of this process, joined frame by frame."""

from __future__ import annotations

import errno
import functools
import math
import socket
import time
from collections.abc import Callable, Sequence

from sim_bus.bus_load import BusLoad
from sim_bus.client import PACKET_BYTES, Client, listening_socket
from sim_bus.clock import BusClock, ClockMode
from sim_bus.contention import Contention
from sim_bus.control import handle
from sim_bus.errors import SimulatorError
from sim_bus.frame import FRAME_BYTES, HEADER, RTR_FLAG
from sim_bus.node_protocol import LocalNode
from sim_bus.route import Route
from sim_bus.watcher import Watcher

_BURST = 64
_MOST_ROUTES = 4096


class Hub:
    """A CAN bus in one thread: routing, bus time, accounting, and the loop that drives them.

    Frames that wait together are sent in the order of arbitration: those of the nodes after one
    SYNC, and those of several clients found waiting at the same moment.
    """

    def __init__(
        self,
        nodes: Sequence[LocalNode] = (),
        *,
        mode: ClockMode = ClockMode.LOCKSTEP,
        bitrate: int = 1_000_000,
        name: str = "",
        truth_log: str | None = None,
    ) -> None:
        self.name = name
        self.truth_log = truth_log
        self.nodes = tuple(nodes)
        self.clock = BusClock(mode, time.monotonic())
        self.load = BusLoad(bitrate, lockstep=mode is ClockMode.LOCKSTEP)
        self.sync_count = 0
        self.malformed = 0
        self.dropped = 0
        self._paced = mode is ClockMode.PACED
        self._waiting = Contention(paced=self._paced, bitrate=bitrate)
        self._clients: dict[int, Client] = {}
        self._routes: dict[int, Route] = {}
        self._accepts = [node.accepts for node in self.nodes]
        self._now_s = 0.0
        self._just_synced = False
        self._leftover = False
        self._batch: list[tuple[int, int, int, Route, bytes, LocalNode]] = []
        self._watcher = Watcher()
        self.stopping = False
        """Whether the loop is to end."""
        self._failure: str | None = None
        self._listener: socket.socket | None = None

    # -- what the loop listens to

    def watch(self, descriptor: int, handler: Callable[[], None]) -> None:
        """Call `handler` whenever `descriptor` is readable."""
        self._watcher.add(descriptor, handler)

    def listen(self) -> None:
        """Open the bus under its name.

        Raises:
            BusSetupError: the name is malformed or in use.
        """
        self._listener = listening_socket(self.name)
        self.watch(self._listener.fileno(), self._accept)

    def attach(self, sock: socket.socket, *, essential: bool = False) -> None:
        """Let the peer of `sock` take part; the end of an essential one ends the hub."""
        client = Client(sock, essential=essential, stamped=self._paced)
        descriptor = sock.fileno()
        self._clients[descriptor] = client
        self._routes.clear()
        self.watch(descriptor, functools.partial(self._pump, client))

    def _accept(self) -> None:
        assert self._listener is not None
        try:
            sock, _ = self._listener.accept()
        except OSError:
            # the peer has gone already
            return
        self.attach(sock)

    def _remove(self, client: Client, reason: str) -> None:
        descriptor = client.sock.fileno()
        if descriptor < 0:
            return
        del self._clients[descriptor]
        self._watcher.remove(descriptor)
        self._waiting.discard(client)
        client.sock.close()
        self._routes.clear()
        if client.essential:
            self._failure = reason
            self.stopping = True

    # -- the loop

    def stop(self) -> None:
        """End `run` soon; may be called from a signal handler or another thread."""
        self.stopping = True
        self._watcher.wake()

    def run(self) -> None:
        """Carry frames until `stop` is called.

        Raises:
            SimulatorError: an essential client has gone.
        """
        while not self.stopping:
            self.turn(self.wait_s())
        self.check()

    def check(self) -> None:
        """Raise SimulatorError when an essential client has gone."""
        if self._failure is not None:
            raise SimulatorError(self._failure)

    def fileno(self) -> int:
        """Return the descriptor that is readable when a turn has something to do."""
        return self._watcher.fileno()

    def turn(self, wait_s: float | None) -> None:
        """Wait up to `wait_s` for something to do (None: for ever), then do it."""
        events = self._watcher.readable(wait_s, exactly=self._paced)
        self._just_synced = False
        if self._waiting or len(events) > 1:
            self._serve_all(events)
        elif events:
            self._watcher.handlers[events[0][0]]()
        if self._paced:
            # while frames wait time goes on with them, so that none comes too late
            if not events and not self._waiting:
                self._tick(self.clock.now(self._watcher.looked_s))
        elif not self.clock.held:
            self._tick(self.clock.now(time.monotonic()))
        elif not events:
            self._advance(self.clock.now(time.monotonic()))
        if self._leftover:
            self._flush()

    def close(self) -> None:
        """Close the nodes and every socket."""
        for node in self.nodes:
            node.close()
        for client in self._clients.values():
            client.sock.close()
        self._clients.clear()
        if self._listener is not None:
            self._listener.close()
        self._watcher.close()

    def wait_s(self) -> float | None:
        """Return for how long the next turn may wait, None for ever."""
        if self._leftover or self._waiting:
            return 0.0
        if self._just_synced:
            return self.clock.hold_s
        event_s = min((node.next_event() for node in self.nodes), default=math.inf)
        wait_s = self.clock.wall_wait(time.monotonic(), event_s)
        return None if wait_s == math.inf else wait_s

    def _tick(self, now_s: float) -> bool:
        """Let the nodes' timers run when one is due; return whether one was."""
        due = any(node.next_event() <= now_s for node in self.nodes)
        if due:
            self._advance(now_s)
        return due

    def _advance(self, now_s: float) -> None:
        self._now_s = now_s
        for node in self.nodes:
            node.advance(now_s)
        self._check_accepts()
        self._flush()

    def _reach(self, now_s: float, route: Route) -> None:
        """Bring those nodes up to the time of a frame which it concerns, or all if one is due."""
        if not self._tick(now_s):
            self._now_s = now_s
            for node in route.nodes:
                node.advance(now_s)

    def _check_accepts(self) -> None:
        for i, node in enumerate(self.nodes):
            if node.accepts is not self._accepts[i]:
                self._accepts[i] = node.accepts
                self._routes.clear()

    # -- frames from clients

    def _serve_all(self, events: list[tuple[int, int]]) -> None:
        """Serve several descriptors; clients with frames waiting contend for the bus."""
        contenders = []
        for descriptor, _ in events:
            client = self._clients.get(descriptor)
            if client is not None:
                contenders.append(client)
            elif descriptor in self._watcher.handlers:
                self._watcher.handlers[descriptor]()
        waiting = self._waiting
        for client in contenders:
            if client not in waiting:
                self._fetch(client)
        for _ in range(_BURST):
            if not waiting:
                return
            winner, frame = waiting.pop()
            # the sender of a SYNC waits for the answers, unless time has passed meanwhile
            if not self._take(frame, winner) or self._paced:
                self._fetch(winner)

    def _fetch(self, client: Client) -> None:
        try:
            packet = client.receive(PACKET_BYTES)
            while len(packet) != FRAME_BYTES:
                if not self._control(client, packet):
                    return
                packet = client.receive(PACKET_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._remove(client, f"lost: {error.strerror}")
            return
        self._waiting.add(client, packet)

    def _pump(self, client: Client) -> None:
        """Take the frames of one client until none waits or a SYNC has been answered.

        The sender of a SYNC waits for the answers, so looking for more would only cost a call.
        """
        try:
            for _ in range(_BURST):
                packet = client.receive(PACKET_BYTES)
                if len(packet) == FRAME_BYTES:
                    if self._take(packet, client):
                        return
                elif not self._control(client, packet):
                    return
        except BlockingIOError:
            return
        except OSError as error:
            self._remove(client, f"lost: {error.strerror}")

    def _control(self, client: Client, packet: bytes) -> bool:
        """Obey a control message; return False when the client has gone."""
        if not packet:
            self._remove(client, "lost: connection closed")
            return False
        answer = handle(self, client, packet)
        if answer is None:
            self._routes.clear()
        else:
            self._deliver(answer, client)
        return True

    def _take(self, frame: bytes, source: Client) -> bool:
        """Carry one frame of a client; return whether it was a SYNC."""
        can_id, length = HEADER.unpack_from(frame)
        route = self._routes.get(can_id) or self._route(can_id)
        if length > route.longest:
            self.malformed += 1
            return False
        load = self.load
        load.frames += 1
        if route.sync:
            self._sync(frame, source, route, length)
            return True
        now_s = self.clock.now(source.sent_s if self._paced else time.monotonic())
        if now_s > self._now_s:
            self._reach(now_s, route)
        if route.acyclic:
            load.acyclic_bits += route.bits[length]
        else:
            load.cycle_bits += route.bits[length]
            if self._paced:
                load.occupy(now_s, route.bits[length])
        for peer in route.clients:
            if peer is not source:
                self._deliver(frame, peer)
        if route.nodes:
            answered = False
            for node in route.nodes:
                node.receive(frame, now_s)
                answered = answered or bool(node.outbox)
            if route.configures:
                self._check_accepts()
            if answered:
                self._flush()
        return False

    def _sync(self, frame: bytes, source: Client, route: Route, length: int) -> None:
        """Move bus time, let the nodes come up to it, then let all see the SYNC."""
        nodes = self.nodes
        period_s = 0.0
        for node in nodes:
            period_s = max(period_s, node.sync_period_s)
        wall_s = source.sent_s if self._paced else time.monotonic()
        self._now_s = now_s = self.clock.sync(wall_s, period_s)
        self._just_synced = self.clock.held
        for node in nodes:
            node.advance(now_s)
        # timers that ran out before the SYNC send before it
        self._flush()
        self._count_sync(now_s, route.bits[length])
        for peer in route.clients:
            if peer is not source:
                self._deliver(frame, peer)
        for node in route.nodes:
            node.receive(frame, now_s)
        self._flush()

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

    # -- frames from nodes

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
        if len(batch) > 1:
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
