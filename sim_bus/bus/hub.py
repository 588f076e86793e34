"""The bus: clients on sockets and nodes of this process, joined frame by frame."""

from __future__ import annotations

import functools
import math
import select
import socket
import time
from collections.abc import Callable, Sequence
from typing import Any

from cdpr_sim_bus.bus.client import PACKET_BYTES, Client, Listener
from cdpr_sim_bus.bus.control import Lead, frames_of, handle, is_go
from cdpr_sim_bus.bus.switch import Contention, LocalNode, Route, Switch
from cdpr_sim_bus.bus.watcher import Watcher
from cdpr_sim_bus.clock import HOLD_S, BusClock, ClockMode
from cdpr_sim_bus.errors import SimulatorError
from cdpr_sim_bus.frame import FRAME_BYTES, HEADER

_BURST = 64
_FULL_S = 0.01


class Hub(Switch):
    """A CAN bus in one thread: its clients, bus time, and the loop that drives all.

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
        paced = mode is ClockMode.PACED
        super().__init__(nodes, bitrate, paced=paced)
        self.name = name
        self.truth_log = truth_log
        self.clock = BusClock(mode, time.monotonic())
        self.lead = Lead(self, self.clock)
        self.malformed = 0
        self.robot_hubs: Sequence[Hub] = (self,)
        """The hubs of one robot, this one included; their wall time begins together."""
        self.buses_before: Sequence[Hub] = ()
        """Those of `robot_hubs` to which the master sends its SYNC before it does to this one."""
        self._waiting = Contention(paced=paced, bitrate=bitrate)
        self._just_synced = False
        self._watcher = Watcher()
        self.stopping = False
        """Whether the loop is to end."""
        self._failure: str | None = None
        self._listener: Listener | None = None

    def status(self) -> dict[str, Any]:
        """Return the status of the bus; docs/wire.md lists the keys."""
        now_s = self.clock.peek(time.monotonic())
        return {
            "name": self.name,
            "mode": self.clock.mode.value,
            "led": self.lead.leader is not None,
            "bitrate": self.load.bitrate,
            "bus_time_s": now_s,
            "sync_count": self.sync_count,
            "frames": self.load.frames,
            "load": self.load.load(now_s),
            "peak_cycle_load": self.load.peak_cycle_load,
            "overruns": self.load.overruns,
            "dropped": self.dropped,
            "malformed": self.malformed,
            "truth_log": self.truth_log,
            "nodes": [node.node_id for node in self.nodes if node.node_id],
        }

    # -- what the loop listens to

    def watch(self, descriptor: int, handler: Callable[[], None]) -> None:
        """Call `handler` whenever `descriptor` is readable."""
        self._watcher.add(descriptor, handler)

    def listen(self) -> None:
        """Open the bus under its name.

        Raises:
            BusSetupError: the name is malformed or in use.
        """
        self._listener = Listener(self.name)
        self.watch(self._listener.fileno(), self._accept)

    def attach(self, sock: socket.socket, *, essential: bool = False) -> None:
        """Let the peer of `sock` take part; the end of an essential one ends the hub."""
        client = Client(sock, essential=essential, stamped=self._paced)
        descriptor = sock.fileno()
        self._clients[descriptor] = client
        self._routes.clear()
        self.watch(descriptor, functools.partial(self._serve_client, client))
        if essential:
            # a real interface cannot be led
            self._begin()

    def _accept(self) -> None:
        assert self._listener is not None
        sock = self._listener.accept()
        if sock is not None:
            self.attach(sock)

    def _remove(self, client: Client, reason: str) -> None:
        descriptor = client.sock.fileno()
        if descriptor < 0:
            return
        del self._clients[descriptor]
        self._watcher.remove(descriptor)
        self._waiting.discard(client)
        self.lead.lose(client)
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
            SimulatorError: an essential client has disconnected.
        """
        while not self.stopping:
            self.turn(self.wait_s())
        self.check()

    def check(self) -> None:
        """Raise SimulatorError when an essential client has disconnected."""
        if self._failure is not None:
            raise SimulatorError(self._failure)

    def fileno(self) -> int:
        """Return the descriptor that is readable when a turn has something to do."""
        return self._watcher.fileno()

    def turn(self, wait_s: float | None) -> None:
        """Wait up to `wait_s` for something to do (None: for ever), then do it."""
        events = self._watcher.readable(wait_s, exactly=self._paced)
        self._just_synced = False
        if self.lead.until_s is not None:
            events = self._without_leader(events)
        if self._waiting.heads or len(events) > 1:
            self._serve_all(events)
        elif events:
            self._watcher.handlers[events[0][0]]()
        if self._paced:
            # while frames wait time goes on with them, so that none comes too late
            if not events and not self._waiting.heads:
                self._tick(self.clock.now(self._watcher.looked_s))
        elif self.clock.stopped:
            if self.lead.until_s is not None or self.lead.time_pending:
                self.lead.go_on()
        elif not events or not self.clock.held:
            self._follow(self.clock.now(time.monotonic()))
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
        if self._leftover or self._waiting.heads or self.lead.until_s is not None:
            return 0.0
        if self._just_synced:
            return HOLD_S
        if self.clock.stopped:
            return _FULL_S if self.lead.time_pending else None
        wait_s = self.clock.wall_wait(time.monotonic(), self.next_event_s())
        return None if wait_s == math.inf else wait_s

    def _begin(self) -> None:
        """Let bus time run with the wall clock: a client sends and none leads."""
        self.advance(self.clock.now(0.0))
        wall_s = time.monotonic()
        for hub in self.robot_hubs:
            if hub.lead.leader is None:
                hub.clock.run(wall_s)

    def _without_leader(self, events: list[tuple[int, int]]) -> list[tuple[int, int]]:
        """Skip events of the leader, which waits for the end of its grant, unless it has closed."""
        leader = self.lead.leader
        if leader is None:
            return events
        descriptor = leader.sock.fileno()
        if any(at == descriptor and event & select.EPOLLHUP for at, event in events):
            return events
        return [event for event in events if event[0] != descriptor]

    def _follow(self, now_s: float) -> None:
        """Run the nodes' timers, each at its time, until `now_s`, a limited number in each call.

        What the nodes do does not depend on when wall-clock time is looked at.
        """
        for _ in range(_BURST):
            event_s = self.next_event_s()
            if event_s > now_s:
                return
            self.advance(max(event_s, self._now_s))

    def _tick(self, now_s: float) -> bool:
        """Let the nodes' timers run when one is due; return whether one was."""
        due = any(node.next_event() <= now_s for node in self.nodes)
        if due:
            self.advance(now_s)
        return due

    def _advance_to(self, now_s: float, route: Route) -> None:
        """Advance the nodes that receive a frame to its time, or all nodes if a timer is due."""
        if not self._tick(now_s):
            self._now_s = now_s
            for node in route.nodes:
                node.advance(now_s)

    # -- frames from clients

    def _serve_all(self, events: list[tuple[int, int]]) -> None:
        """Serve several descriptors; clients with frames waiting contend for the bus."""
        contending = []
        for descriptor, _ in events:
            client = self._clients.get(descriptor)
            if client is not None:
                contending.append(client)
            elif descriptor in self._watcher.handlers:
                self._watcher.handlers[descriptor]()
        waiting = self._waiting
        for client in contending:
            if client not in waiting.heads:
                self._fetch(client)
        for _ in range(_BURST):
            if not waiting.heads:
                return
            winner, frame = waiting.pop()
            # the sender of a SYNC waits for the answers, unless time has passed meanwhile
            if not self._take(frame, winner) or self._paced or winner.queued:
                self._fetch(winner)

    def _fetch(self, client: Client) -> None:
        queued = client.queued
        try:
            while not queued:
                packet = client.receive(PACKET_BYTES)
                if len(packet) == FRAME_BYTES:
                    queued.append(packet)
                elif frames := frames_of(packet):
                    queued.extend(frames)
                elif not self._control(client, packet):
                    return
        except (BlockingIOError, ConnectionResetError):  # see `_serve_client`
            return
        except OSError as error:
            self._remove(client, f"lost: {error.strerror}")
            return
        self._waiting.add(client, queued.popleft())

    def _serve_client(self, client: Client) -> None:
        """Take the frames of one client until none waits or a SYNC has been answered.

        The sender of a SYNC waits for the answers, so looking for more would only cost a call.
        """
        try:
            for _ in range(_BURST):
                packet = client.receive(PACKET_BYTES)
                if len(packet) == FRAME_BYTES:
                    if self._take(packet, client):
                        return
                elif frames := frames_of(packet):
                    synced = [self._take(frame, client) for frame in frames]
                    if True in synced:
                        return
                elif not self._control(client, packet):
                    return
        except BlockingIOError:
            return
        except ConnectionResetError:
            return  # it left with frames unread; what it had sent comes next, then the end
        except OSError as error:
            self._remove(client, f"lost: {error.strerror}")

    def _control(self, client: Client, packet: bytes) -> bool:
        """Obey a control message; return False if the client has left or waits for its grant."""
        if not packet:
            self._remove(client, "lost: connection closed")
            return False
        if is_go(packet) and client is self.lead.leader:
            self.lead.go(packet)
            return False
        answer = handle(self.lead, self.status, client, packet)
        if answer is None:
            self._routes.clear()
        else:
            try:
                client.sock.send(answer)
            except OSError as error:
                self._lose(client, error)
        return True

    def _take(self, frame: bytes, source: Client) -> bool:
        """Carry one frame of a client; return whether it was a SYNC."""
        if self.clock.stopped and self.lead.leader is None:
            self._begin()
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
            self._advance_to(now_s, route)
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
            self._deliver_to_nodes(frame, route, now_s)
        return False

    def _deliver_to_nodes(self, frame: bytes, route: Route, now_s: float) -> None:
        answered = False
        for node in route.nodes:
            node.receive(frame, now_s)
            answered = answered or bool(node.outbox)
        if route.configures:
            self._check_accepts()
        if answered:
            self._flush()
            if self._leftover and self.clock.stopped:
                self.settle()

    def _sync(self, frame: bytes, source: Client, route: Route, length: int) -> None:
        """Move bus time, let the nodes come up to it, then let all see the SYNC.

        On a bus that a client leads only that client's SYNC moves time, and what it has sent to the
        buses before this one comes first, even where it was sent since they were looked at: the
        drives of all buses share their physics.
        """
        nodes = self.nodes
        leader = self.lead.leader
        if leader is source:
            for hub in self.buses_before:
                hub.turn(0.0)
        period_s = 0.0
        if leader is None or leader is source:
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
        if leader is not None:
            if self._leftover:
                self.settle()
            if leader is source:
                self.lead.send_time()
