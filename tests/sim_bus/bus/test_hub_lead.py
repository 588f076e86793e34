"""On a led lockstep bus, only packets of the leading master advance the time."""

from __future__ import annotations

import json
import math
import socket
import struct
import time
from collections.abc import Callable
from typing import Any

from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.bus.server import Fleet
from cdpr_sim_bus.clock import HOLD_S, ClockMode
from cdpr_sim_bus.frame import pack_frame

StartBus = Callable[..., Any]
GO = struct.Struct("<8sdd")
SYNC, ANSWER = pack_frame(0x080), pack_frame(0x181, b"answer")


def beat(node_id: int) -> bytes:
    return pack_frame(0x700 + node_id, b"\x05")


def test_bus_time_is_zero_until_the_first_frame(start_bus: StartBus, stub_node: type) -> None:
    bus = start_bus(node := stub_node(7, timers=(0.0, 0.5)))
    member = bus.join()
    time.sleep(0.1)
    assert member.status()["bus_time_s"] == 0.0
    assert node.advanced == []
    member.send(0x123)
    # first the start, then the frame, then the wall clock
    assert [member.recv(), member.recv()] == [beat(7), beat(7)]
    assert node.advanced[0] == 0.0
    assert node.seen[0][0] == pack_frame(0x123)
    assert node.seen[0][1] > 0.0
    assert 0.5 in node.advanced
    assert not member.status()["led"]


def test_time_of_a_led_bus_stands_while_its_master_pauses(
    start_bus: StartBus, stub_node: type
) -> None:
    node = stub_node(7, sync_period_s=0.01, answers=(ANSWER,), timers=(0.0, 0.025))
    bus = start_bus(node)
    member, other = bus.join(), bus.join()
    assert member.lead() == (0.0, 0.025)
    assert other.recv() == beat(7)
    assert other.status()["led"]
    for k in range(1, 4):
        time.sleep(0.05)
        before = [beat(7)] * (k == 3)
        assert member.sync() == ([*before, ANSWER], k * 0.01, math.inf if k == 3 else 0.025)
    time.sleep(HOLD_S + 0.1)
    assert member.status()["bus_time_s"] == 0.03
    assert node.advanced == [0.0, 0.01, 0.02, 0.03]


def test_go_ends_at_the_first_frame_for_its_sender(start_bus: StartBus, stub_node: type) -> None:
    one, two = stub_node(1, timers=(0.1, 0.4)), stub_node(2, timers=(0.2, 0.3))
    bus = start_bus(one, two)
    member, other = bus.join(), bus.join()
    member.filters((0x701, 0x7FF))
    member.lead()
    assert member.go(1.0) == ([beat(1)], 0.1, 0.2)
    assert member.go(0.15) == ([], 0.15, 0.2)
    assert member.go(1.0) == ([beat(1)], 0.4, math.inf)
    assert member.go(1.0) == ([], 1.0, math.inf)
    assert member.go(0.5) == ([], 1.0, math.inf)
    assert member.go(math.inf) == ([], 1.0, math.inf)
    assert member.go(math.nan) == ([], 1.0, math.inf)
    assert [other.recv() for _ in range(4)] == [beat(1), beat(2), beat(2), beat(1)]
    assert one.advanced == two.advanced == [0.0, 0.1, 0.15, 0.2, 0.3, 0.4, 1.0]


def test_frames_sent_before_a_go_are_processed_before_it(
    start_bus: StartBus, stub_node: type
) -> None:
    node = stub_node(1, accepts=frozenset(range(0x800)))
    bus = start_bus(node)
    member = bus.join()
    member.lead()
    for k in range(200):
        member.send(0x200 + k)
    assert member.go(0.5) == ([], 0.5, math.inf)
    assert [int.from_bytes(frame[:4], "little") for frame, _ in node.seen] == [
        0x200 + k for k in range(200)
    ]
    assert {now for _, now in node.seen} == {0.0}
    assert member.go(0.0) == ([], 0.5, math.inf)


def test_a_frame_that_already_waits_ends_a_go_before_time_advances(
    start_bus: StartBus, stub_node: type
) -> None:
    node = stub_node(1, answers=(ANSWER,))
    bus = start_bus(node)
    member, other = bus.join(), bus.join()
    member.lead()
    other.send(0x123)
    other.status()
    assert member.go(1.0) == ([pack_frame(0x123)], 0.0, math.inf)
    assert member.go(1.0) == ([], 1.0, math.inf)
    # without 1006h a SYNC does not advance the time
    assert member.sync() == ([ANSWER], 1.0, math.inf)


def test_frames_of_others_do_not_advance_a_led_bus(start_bus: StartBus, stub_node: type) -> None:
    node = stub_node(1, sync_period_s=0.01, answers=(ANSWER,))
    bus = start_bus(node)
    member, other = bus.join(), bus.join()
    member.lead()
    member.sync()
    for frame in (SYNC, pack_frame(0x123)):
        other.sock.send(frame)
    other.status()
    assert member.go(0.0) == ([SYNC, ANSWER, pack_frame(0x123)], 0.01, math.inf)
    assert [now for _, now in node.seen] == [0.01] * 3
    assert member.sync() == ([ANSWER], 0.02, math.inf)


def test_frames_between_nodes_are_delivered_before_the_time_is_reported(
    start_bus: StartBus, stub_node: type
) -> None:
    """A frame passes from node to node. The master receives all of them before the time packet."""
    nodes = [stub_node(k, accepts=frozenset((0x300 + k,))) for k in range(1, 6)]
    for k, node in enumerate(nodes, 1):
        node.receive = lambda frame, now, k=k, out=node.outbox: out.append(pack_frame(0x301 + k))
    bus = start_bus(*nodes)
    member = bus.join()
    member.lead()
    member.send(0x301)
    answers = [pack_frame(0x300 + k) for k in range(2, 7)]
    assert member.go(1.0)[0] == answers
    # also if a timer starts it
    nodes[0].accepts = frozenset((0x701,))
    nodes[4].node_id = 1
    nodes[4].timers.append(0.5)
    assert member.go(1.0) == ([beat(1), *answers], 0.5, math.inf)


def test_an_endless_ring_of_nodes_does_not_block_the_master(
    start_bus: StartBus, stub_node: type
) -> None:
    nodes = [stub_node(k, accepts=frozenset((0x300 + k,))) for k in (0, 1)]
    for k, node in enumerate(nodes):
        node.receive = lambda frame, now, k=k, out=node.outbox: out.append(pack_frame(0x301 - k))
    bus = start_bus(*nodes)
    member = bus.join()
    member.filters()
    member.lead()
    member.send(0x300)
    assert member.go(0.0)[1] == 0.0


def test_only_one_client_leads_at_a_time(start_bus: StartBus, stub_node: type) -> None:
    bus = start_bus(stub_node(1))
    member, other = bus.join(), bus.join()
    assert member.lead() == member.lead() == (0.0, math.inf)
    assert other.ask({"lead": True}) == {"error": "lead: another client leads this bus"}
    other.sock.send(GO.pack(b"bus-go\0\0", 1.0, 0.0))
    refused = json.loads(other.recv())
    assert refused == {"error": "go: only the client that leads the bus may move its time"}
    member.go(2.0)
    member.sock.send(b'{"lead": false}  ')
    assert not member.status()["led"]
    assert other.lead() == (2.0, math.inf)
    assert member.ask({"lead": True}) == {"error": "lead: another client leads this bus"}


def test_time_of_a_released_bus_stands_until_the_next_frame(
    start_bus: StartBus, stub_node: type
) -> None:
    bus = start_bus(stub_node(1, timers=(3.05,)))
    member, other = bus.join(), bus.join()
    member.lead()
    member.go(3.0)
    member.sock.send(b'{"lead": false}  ')
    member.sock.close()
    time.sleep(0.1)
    assert other.status()["bus_time_s"] == 3.0
    other.send(0x123)
    assert other.recv() == beat(1)


def test_a_paced_bus_cannot_be_led(start_bus: StartBus) -> None:
    member = start_bus(mode=ClockMode.PACED).join()
    answer = member.ask({"lead": True})
    assert answer == {"error": "lead: this bus is paced; its time is that of the clock"}


def test_time_follows_the_wall_clock_after_the_leader_disconnects(
    start_bus: StartBus, stub_node: type
) -> None:
    timers = tuple(2.0 + 0.01 * k for k in range(1, 30))
    bus = start_bus(node := stub_node(1, timers=timers))
    member, other = bus.join(), bus.join()
    member.lead()
    member.go(2.0)
    started = time.monotonic()
    member.sock.close()
    for _ in timers:
        assert other.recv() == beat(1)
    assert time.monotonic() - started > 0.25
    # each timer had its exact time, independent of when the loop ran
    assert node.advanced == [0.0, 2.0, *timers]
    now_s, _ = other.lead()
    assert now_s >= timers[-1]
    time.sleep(0.05)
    assert other.status()["bus_time_s"] == now_s


def test_a_leader_that_dies_during_its_go_is_detected(start_bus: StartBus, stub_node: type) -> None:
    endless = stub_node(1)
    endless.next_event = lambda: endless.advanced[-1] + 1e-3 if endless.advanced else 0.0
    bus = start_bus(endless)
    member, other = bus.join(), bus.join()
    member.filters()
    member.lead()
    member.sock.send(GO.pack(b"bus-go\0\0", 1e9, 0.0))
    # others are served while it runs
    other.send(0x123)
    while (first := other.status()["bus_time_s"]) < 1.0:
        pass
    assert other.status()["led"]
    member.sock.close()
    while (status := other.status())["led"]:
        pass
    assert first < status["bus_time_s"] < 1e9
    # the time now follows the wall clock
    before_s = time.monotonic()
    begin_s = other.status()["bus_time_s"]
    begun_s = time.monotonic()
    time.sleep(0.2)
    end_s = time.monotonic()
    passed_s = other.status()["bus_time_s"] - begin_s
    assert end_s - begun_s <= passed_s <= time.monotonic() - before_s


def test_the_time_is_reported_as_soon_as_the_master_reads_again(
    start_bus: StartBus, stub_node: type
) -> None:
    """The socket is full of frames of another client when the packet is due."""
    bus = start_bus(stub_node(1))
    member, other = bus.join(), bus.join()
    member.lead()
    started = time.monotonic()
    while not other.status()["dropped"]:
        for _ in range(1000):
            other.send(0x123)
        assert time.monotonic() - started < 300.0
    member.sock.send(GO.pack(b"bus-go\0\0", 1.0, 0.0))
    while not bus.hub.lead.time_pending:
        assert time.monotonic() - started < 300.0
        time.sleep(1e-3)
    frames, now_s, _ = member.until_time()
    assert len(frames) > 1000
    assert now_s == 0.0
    assert member.go(1.0) == ([], 1.0, math.inf)


def test_many_frames_for_the_master_are_split_into_packets_in_order(
    start_bus: StartBus, stub_node: type
) -> None:
    bus = start_bus(stub_node(1))
    member, other = bus.join(), bus.join()
    member.lead()
    sent = [pack_frame(0x123, k.to_bytes(2, "little")) for k in range(300)]
    for frame in sent:
        other.sock.send(frame)
    other.status()
    member.sock.send(GO.pack(b"bus-go\0\0", 1.0, 0.0))
    packets = [member.recv() for _ in range(3)]
    assert [len(packet) for packet in packets] == [24 + 16 * n for n in (128, 128, 44)]
    assert [packet[:8] for packet in packets] == [b"bus-data", b"bus-data", b"bus-time"]
    assert b"".join(packet[24:] for packet in packets) == b"".join(sent)
    # frames kept when the lead is released are still delivered, later ones in single packets
    other.sock.send(sent[0])
    other.status()
    member.sock.send(b'{"lead":false}')
    assert member.recv() == b"bus-data".ljust(24, b"\0") + sent[0]
    member.status()
    other.sock.send(sent[1])
    assert member.recv() == sent[1]


def test_the_buses_of_a_robot_process_the_syncs_of_a_cycle_in_order(stub_node: type) -> None:
    """This includes SYNCs sent between the turns of the two buses."""
    taken: list[int] = []
    masters: list[socket.socket] = []

    class Node(stub_node):  # type: ignore[misc]
        def receive(self, frame: bytes, now: float) -> None:
            if frame == SYNC:
                taken.append(self.node_id)
            elif self.node_id == 2:
                for master in masters:
                    master.send(SYNC)

    hubs = [Hub([Node(1, sync_period_s=0.01)]), Hub([Node(2, sync_period_s=0.01)])]
    fleet = Fleet(hubs)
    for hub in hubs:
        master, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        hub.attach(its)
        master.send(b'{"lead":true}')
        hub.turn(0.0)
        masters.append(master)
    masters[1].send(pack_frame(0x201))
    while len(taken) < 2:
        fleet._turn()
    assert taken == [1, 2]
    fleet.close()
    for hub, master in zip(hubs, masters, strict=True):
        hub.close()
        master.close()
