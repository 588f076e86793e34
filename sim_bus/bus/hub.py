"""The bus: clients on sockets and nodes of this process, joined frame by frame."""

from __future__ import annotations

import contextlib
import errno
import functools
import heapq
import json
import math
import os
import select
import socket
import struct
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cdpr_profiles.bounded_input import parse_json
from cdpr_profiles.errors import ProfileError
from cdpr_sim_bus.bus.client import (
    PACKET_BYTES,
    BusLoad,
    Client,
    Contention,
    Listener,
    LocalNode,
    PreparingNode,
    Route,
)
from cdpr_sim_bus.clock import HOLD_S, BusClock, ClockMode
from cdpr_sim_bus.errors import RequestError, SimulatorError
from cdpr_sim_bus.frame import FRAME_BYTES, HEADER, RTR_FLAG

FINE_WAIT_S = 0.01
"""Waits shorter than this need finer resolution than epoll's whole milliseconds."""
_EVENTS = 64


class Watcher:
    """An epoll with a handler for each descriptor, and a way to wake it from other threads."""

    def __init__(self) -> None:
        self._poller = select.epoll()
        self.handlers: dict[int, Callable[[], None]] = {}
        """Handlers by descriptor."""
        self.looked_s = 0.0
        """Monotonic time just before the last poll; everything sent before it has been found."""
        self._wake = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self.add(self._wake, lambda: None)

    def add(self, descriptor: int, handler: Callable[[], None]) -> None:
        """Call `handler` whenever `descriptor` is readable."""
        self._poller.register(descriptor, select.EPOLLIN)
        self.handlers[descriptor] = handler

    def remove(self, descriptor: int) -> None:
        """Stop watching `descriptor`."""
        del self.handlers[descriptor]
        self._poller.unregister(descriptor)

    def wake(self) -> None:
        """End the present or next wait; may be called from a signal handler or a thread."""
        os.eventfd_write(self._wake, 1)

    def fileno(self) -> int:
        """Return the descriptor that is readable when a watched descriptor is."""
        return self._poller.fileno()

    def readable(self, wait_s: float | None, *, exactly: bool) -> list[tuple[int, int]]:
        """Return the readable descriptors, each with its events.

        Wait up to `wait_s` (None: indefinitely) for one. With `exactly`, the wait is not rounded to
        milliseconds. `looked_s` is the time of the last check.
        """
        if wait_s != 0.0 and (exactly or (wait_s is not None and wait_s < FINE_WAIT_S)):
            select.select([self._poller], [], [], wait_s)
            wait_s = 0.0
        self.looked_s = time.monotonic()
        return self._poller.poll(wait_s, _EVENTS)

    def after_fork(self) -> None:
        """Watch the same descriptors as before, apart from the process that has forked."""
        poller = select.epoll()
        for descriptor in self.handlers:
            poller.register(descriptor, select.EPOLLIN)
        os.dup2(poller.fileno(), self._poller.fileno(), inheritable=False)
        poller.close()

    def close(self) -> None:
        """Close its own descriptors."""
        self._poller.close()
        os.close(self._wake)


# Control messages, JSON packets beside the frames; and the client that leads the bus.

_PACKET = struct.Struct("<8sdd")
_GO, _TIME, _FRAMES = b"bus-go\0\0", b"bus-time", b"bus-data"
_STEPS_A_TURN = 16
_MOST_HELD = 128


def frames_of(packet: bytes) -> list[bytes]:
    """Return the frames of a packet that has several of them; an empty list for any other."""
    if not packet.startswith(_FRAMES) or (len(packet) - _PACKET.size) % FRAME_BYTES:
        return []
    return [packet[at : at + FRAME_BYTES] for at in range(_PACKET.size, len(packet), FRAME_BYTES)]


def is_go(packet: bytes) -> bool:
    """Return whether a packet is a time grant ("bus-go")."""
    return len(packet) == _PACKET.size and packet.startswith(_GO)


class Lead:
    """The leading client of a bus, and the time grant in progress."""

    def __init__(self, hub: Hub, clock: BusClock) -> None:
        self._hub = hub
        self._clock = clock
        self.leader: Client | None = None
        self.until_s: float | None = None
        """Bus time up to which a grant runs; None without a grant."""
        self.time_pending = False
        """Whether a time packet waits for room in the leader's socket."""
        self._held: list[bytes] = []
        """Frames for the leader, to be sent with the next time packet."""

    def take(self, client: Client) -> dict[str, Any]:
        """Make `client` the leader; return the answer for it."""
        clock = self._clock
        if clock.mode is ClockMode.PACED:
            return {"error": "lead: this bus is paced; its time is that of the clock"}
        if self.leader not in (None, client):
            return {"error": "lead: another client leads this bus"}
        clock.stop(time.monotonic())
        now_s = clock.now(0.0)
        self._hub.advance(now_s)
        self._hub.settle()
        self.leader = client
        client.send = self._hold
        client.delivered = False
        next_s = self._hub.next_event_s()
        return {"lead": {"now_s": now_s, "next_s": None if next_s == math.inf else next_s}}

    def release(self, client: Client) -> None:
        """End the lead of `client`; bus time stands still until a client sends or leads."""
        if client is self.leader:
            client.send = client.sock.send
            with contextlib.suppress(OSError):  # the client does not read
                self._send_held(client)
            self._end()

    def lose(self, client: Client) -> None:
        """Let bus time run with wall time if the disconnected `client` was the leader."""
        if client is self.leader:
            self._end()
            self._clock.run(time.monotonic())

    def _end(self) -> None:
        self.leader = self.until_s = None
        self.time_pending = False
        self._held.clear()

    def _hold(self, frame: bytes) -> None:
        """Keep a frame for the leader; if many wait, send them now if there is room."""
        held = self._held
        if len(held) == _MOST_HELD and self.leader is not None:
            self._send_held(self.leader)
        held.append(frame)

    def _send_held(self, leader: Client) -> None:
        if self._held:
            leader.sock.send(_PACKET.pack(_FRAMES, 0.0, 0.0) + b"".join(self._held))
            self._held.clear()

    def go(self, packet: bytes) -> None:
        """Accept a grant of the leader; `go_on` executes it. A grant without a finite time only
        requests a time packet."""
        until_s = _PACKET.unpack(packet)[1]
        self.until_s = until_s if math.isfinite(until_s) else -math.inf

    def go_on(self) -> None:
        """Advance bus time from event to event up to the grant, some events in each call.

        First send a pending time packet.
        """
        leader, until_s, hub, clock = self.leader, self.until_s, self._hub, self._clock
        if self.time_pending:
            self.send_time()
        if leader is None or until_s is None:
            return
        for _ in range(_STEPS_A_TURN):
            now_s = clock.now(0.0)
            if leader.delivered or until_s <= now_s:
                self.until_s = None
                self.send_time()
                return
            step_s = max(now_s, min(hub.next_event_s(), until_s))
            clock.move(step_s)
            hub.advance(step_s)
            hub.settle()

    def send_time(self) -> None:
        """Send the leader a time packet, now or as soon as its socket has room."""
        leader = self.leader
        if leader is None:
            return
        packet = _PACKET.pack(_TIME, self._clock.now(0.0), self._hub.next_event_s())
        self.time_pending = False
        try:
            leader.sock.send(packet + b"".join(self._held))
            self._held.clear()
            leader.delivered = False
        except BlockingIOError:
            self.time_pending = True
        except OSError:
            # the leader has disconnected, which the next read from its socket shows
            return


_KEYS = ("filters", "lead", "more_filters", "status")


def encode(message: dict[str, Any]) -> bytes:
    """Return `message` as a packet: JSON, padded so that its length is not that of a frame."""
    text = json.dumps(message, separators=(",", ":")).encode()
    return text + b" " if len(text) == FRAME_BYTES else text


def _request(packet: bytes) -> tuple[str, Any]:
    """Return key and value of a message."""
    if len(packet) == PACKET_BYTES:
        raise RequestError(f"a control message has less than {PACKET_BYTES} bytes; send several")
    if is_go(packet):
        raise RequestError("go: only the client that leads the bus may move its time")
    try:
        ((key, value),) = parse_json(packet, "message").items()
    except (ProfileError, ValueError, AttributeError):
        raise RequestError(
            f"neither a frame of {FRAME_BYTES} bytes nor a JSON object with one key of: "
            f"{', '.join(_KEYS)}"
        ) from None
    return key, value


def _filters(key: str, value: object) -> list[tuple[int, int]]:
    filters = []
    for pair in value if isinstance(value, list) else [None]:
        match pair:
            case [int(identifier), int(mask)] if min(pair) >= 0 and max(pair) < 1 << 32:
                filters.append((identifier, mask))
            case _:
                raise RequestError(
                    f"{key}: expected a list of [identifier, mask], 32-bit numbers each"
                )
    return filters


class Plan:
    """Actions of a bus at given bus times; simultaneous ones run in the order of their arrival."""

    def __init__(self) -> None:
        self.next_s = math.inf
        """Bus time of the next action; `math.inf` without one."""
        self._waiting: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0

    def add(self, at_s: float, action: Callable[[], None]) -> None:
        """Call `action` at bus time `at_s`."""
        self._count += 1
        heapq.heappush(self._waiting, (at_s, self._count, action))
        self.next_s = self._waiting[0][0]

    def run(self, now_s: float) -> None:
        """Call the actions that are due at `now_s`."""
        while self.next_s <= now_s:
            action = heapq.heappop(self._waiting)[2]
            self.next_s = self._waiting[0][0] if self._waiting else math.inf
            action()


_BURST = 64
_MOST_ROUTES = 4096
_MOST_ANSWERS = 64
_FULL_S = 0.01


class Hub:
    """A CAN bus in one thread: its clients, bus time, and the loop that runs everything.

    Frames that wait together are sent in the order of arbitration: those of the nodes after one
    SYNC, and those of several clients that wait at the same moment.
    """

    def __init__(
        self,
        nodes: Sequence[LocalNode] = (),
        *,
        mode: ClockMode = ClockMode.LOCKSTEP,
        bitrate: int = 1_000_000,
        name: str = "",
        truth_log: str | None = None,
        ahead: bool = True,
    ) -> None:
        """Make the bus. Nodes may work `ahead` while the master works on the present cycle."""
        paced = mode is ClockMode.PACED
        self.nodes = tuple(nodes)
        self.load = BusLoad(bitrate, lockstep=not paced)
        self.sync_count = 0
        self.dropped = 0
        self._paced = paced
        self._clients: dict[int, Client] = {}
        self._routes: dict[int, Route] = {}
        self._accepts = [node.accepts for node in self.nodes]
        preparing = self.nodes if ahead else ()
        self.prepares = [node.prepare for node in preparing if isinstance(node, PreparingNode)]
        # the nodes are switched on at bus time 0
        self._now_s = -1.0
        self._leftover = False
        self._batch: list[tuple[int, int, int, Route, bytes, LocalNode]] = []
        self.name = name
        self.truth_log = truth_log
        self.clock = BusClock(mode, time.monotonic())
        self.lead = Lead(self, self.clock)
        self.malformed = 0
        self.robot_hubs: Sequence[Hub] = (self,)
        """The hubs of one robot, including this one; their wall time begins together."""
        self.buses_before: Sequence[Hub] = ()
        """Those of `robot_hubs` to which the master sends its SYNC before it sends to this one."""
        self.plan = Plan()
        """Faults to come."""
        self.requests: Mapping[str, Callable[[Any], Any]] = {}
        """Functions that answer further requests of clients; they raise RequestError."""
        self._asked: list[tuple[Client, str, Any]] = []
        self._waiting = Contention(paced=paced, bitrate=bitrate)
        self._just_synced = False
        self._watcher = Watcher()
        self.stopping = False
        """Whether the loop must end."""
        self._failure: str | None = None
        self._listener: Listener | None = None

    def status(self) -> dict[str, Any]:
        """Return the status of the bus; docs/reference/wire.md lists the keys."""
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

    # -- descriptors of the loop

    def watch(self, descriptor: int, handler: Callable[[], None]) -> None:
        """Call `handler` whenever `descriptor` is readable."""
        self._watcher.add(descriptor, handler)

    def after_fork(self) -> None:
        """Stop sharing the loop with the process that has forked."""
        self._watcher.after_fork()

    def listen(self) -> None:
        """Open the bus under its name.

        Raises:
            BusSetupError: the name is malformed or in use.
        """
        self._listener = Listener(self.name)
        self.watch(self._listener.fileno(), self._accept)

    def attach(self, sock: socket.socket, *, essential: bool = False) -> None:
        """Add the peer of `sock` as a client; the end of an essential one ends the hub."""
        client = Client(sock, essential=essential, stamped=self._paced)
        descriptor = sock.fileno()
        self._clients[descriptor] = client
        self._routes.clear()
        self.watch(descriptor, functools.partial(self._serve_client, client))
        if essential:
            # a real interface cannot be a led bus
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
        """Raise SimulatorError if an essential client has disconnected."""
        if self._failure is not None:
            raise SimulatorError(self._failure)

    def fileno(self) -> int:
        """Return a descriptor that is readable if there is work."""
        return self._watcher.fileno()

    def turn(self, wait_s: float | None) -> None:
        """Wait up to `wait_s` for work (None: indefinitely), then do it."""
        events = self._watcher.readable(wait_s, exactly=self._paced)
        self._just_synced = False
        if self.lead.until_s is not None:
            events = self._without_leader(events)
        if self._waiting.heads or len(events) > 1:
            self._serve_all(events)
        elif events:
            self._watcher.handlers[events[0][0]]()
        if self._paced:
            # the times of waiting frames advance the clock; a timer must not overtake them
            if not events and not self._waiting.heads:
                self._tick(self.clock.now(self._watcher.looked_s))
        elif self.clock.stopped:
            if self.lead.until_s is not None or self.lead.time_pending:
                self.lead.go_on()
        elif not events or not self.clock.held:
            self._follow(self.clock.now(time.monotonic()))
        if self._leftover:
            self._flush()
        if self._asked and not self._waiting.heads:
            self._answer()

    def _answer(self) -> None:
        """Answer the requests, after all frames that were sent before them on the robot's buses."""
        asked, self._asked = self._asked, []
        for hub in self.robot_hubs:
            if hub is not self:
                hub.turn(0.0)
        for client, key, value in asked:
            try:
                answer = {key: self.requests[key](value)}
            except RequestError as error:
                answer = {"error": str(error)}
            self._reply(client, answer)

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
        """Return how long the next turn may wait; None without limit."""
        if self._leftover or self._waiting.heads or self._asked or self.lead.until_s is not None:
            return 0.0
        if self._just_synced:
            return HOLD_S
        if self.clock.stopped:
            return _FULL_S if self.lead.time_pending else None
        wait_s = self.clock.wall_wait(time.monotonic(), self.next_event_s())
        return None if wait_s == math.inf else wait_s

    def _begin(self) -> None:
        """Let bus time run with the wall clock: a client sends and no client leads."""
        self.advance(self.clock.now(0.0))
        wall_s = time.monotonic()
        for hub in self.robot_hubs:
            if hub.lead.leader is None:
                hub.clock.run(wall_s)

    def _without_leader(self, events: list[tuple[int, int]]) -> list[tuple[int, int]]:
        """Skip the leader's events while it waits for the end of its grant, unless it has left."""
        leader = self.lead.leader
        if leader is None:
            return events
        descriptor = leader.sock.fileno()
        if any(at == descriptor and event & select.EPOLLHUP for at, event in events):
            return events
        return [event for event in events if event[0] != descriptor]

    def _follow(self, now_s: float) -> None:
        """Run the nodes' timers, each at its time, until `now_s`, a limited number per call.

        The nodes' actions do not depend on when the wall clock is read.
        """
        for _ in range(_BURST):
            event_s = self.next_event_s()
            if event_s > now_s:
                return
            self.advance(max(event_s, self._now_s))

    def _tick(self, now_s: float) -> bool:
        """Run the nodes' timers if one is due; return whether one was."""
        due = self.next_event_s() <= now_s
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
        """Serve several descriptors; clients with waiting frames contend for the bus."""
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
            # after its SYNC a client waits for answers, so read from it only if time has moved
            # since
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
        """Process the frames of one client until none waits or a SYNC has been answered.

        The sender of a SYNC waits for the answers, so another read would only cost a call.
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
            return  # its unread frames are lost; those it has sent come next, then the end
        except OSError as error:
            self._remove(client, f"lost: {error.strerror}")

    def _control(self, client: Client, packet: bytes) -> bool:
        """Execute a control message; return False if the client has left or waits for its grant."""
        if not packet:
            self._remove(client, "lost: connection closed")
            return False
        if is_go(packet) and client is self.lead.leader:
            self.lead.go(packet)
            return False
        try:
            answer = self._obey(client, *_request(packet))
        except RequestError as error:
            answer = {"error": str(error)}
        if answer is None:
            self._routes.clear()
        else:
            self._reply(client, answer)
        return True

    def _reply(self, client: Client, answer: dict[str, Any]) -> None:
        try:
            client.sock.send(encode(answer))
        except OSError as error:
            self._lose(client, error)

    def _obey(self, client: Client, key: str, value: Any) -> dict[str, Any] | None:
        """Execute a request and return the answer; None if it has no answer."""
        if key == "status" and value is True:
            return {"status": self.status()}
        if key == "lead" and isinstance(value, bool):
            if value:
                return self.lead.take(client)
            self.lead.release(client)
            return None
        if key in ("filters", "more_filters"):
            filters = _filters(key, value)
            client.filters = filters if key == "filters" else (client.filters or []) + filters
            return None
        if key in self.requests:
            self._asked.append((client, key, value))
            return None
        raise RequestError(f"unknown request {key!r}; known: {', '.join((*_KEYS, *self.requests))}")

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
        """Move bus time, advance the nodes to it, then deliver the SYNC to all.

        On a bus that a client leads, only that client's SYNC moves time. If the client sent frames
        to other buses before this SYNC, they are processed first, even if they arrived after the
        last poll of those buses. The drives of all buses share their physics.
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
        now_s = self.clock.sync(wall_s, period_s)
        self._just_synced = self.clock.held
        self._act_until(now_s)
        self._now_s = now_s
        for node in nodes:
            node.advance(now_s)
        # timers that expired before the SYNC send before it
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
                if self is self.robot_hubs[-1]:
                    self._prepare(now_s + period_s)

    def _act_until(self, now_s: float) -> None:
        """Run the actions that are planned up to a SYNC, each at its planned time."""
        while self.plan.next_s <= now_s:
            self.advance(max(self.plan.next_s, self._now_s))

    def _prepare(self, until_s: float) -> None:
        """Let the nodes of all buses work on the next period while the master works on this one."""
        for hub in self.robot_hubs:
            for prepare in hub.prepares:
                prepare(until_s)

    # -- frames of nodes

    def next_event_s(self) -> float:
        """Return the bus time of the next timer of a node or action; `math.inf` without one."""
        next_s = self.plan.next_s
        for node in self.nodes:
            next_s = min(next_s, node.next_event())
        return next_s

    def advance(self, now_s: float) -> None:
        """Advance all nodes to bus time `now_s`, act as planned and send the nodes' frames."""
        self._now_s = now_s
        for node in self.nodes:
            node.advance(now_s)
        self.plan.run(now_s)
        self._check_accepts()
        self._flush()

    @property
    def now_s(self) -> float:
        """Bus time now."""
        return self.clock.now(time.monotonic())

    def act(self, at_s: float, action: Callable[[], None]) -> None:
        """Call `action` at bus time `at_s`, which may be now."""
        self.plan.add(at_s, action)
        if at_s <= (now_s := self.now_s):
            self.advance(now_s)
            self.settle()

    def settle(self) -> None:
        """Deliver the nodes' answers to each other's frames, for a limited number of rounds."""
        for _ in range(_MOST_ANSWERS):
            if not self._leftover:
                return
            self._flush()

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
        """Count a packet that `peer` could not receive; remove a peer whose socket has failed."""
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
        # a remote frame has the identifier of the frame that it requests
        plain = can_id & ~RTR_FLAG
        nodes = [node for node in self.nodes if node.accepts is None or plain in node.accepts]
        self._routes[can_id] = route = Route(can_id, clients, nodes)
        return route

    def _flush(self) -> None:
        """Send the frames in the outboxes in the order of arbitration.

        If other nodes of this process answer, their frames wait for the next call. So nodes that
        answer each other in a ring cannot lock out the clients.
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
