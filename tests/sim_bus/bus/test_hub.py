"""Several clients and nodes on one bus."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Callable
from typing import Any

import pytest
from waiting import until

from cdpr_sim_bus.bus.client import PACKET_BYTES
from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.errors import BusSetupError, SimulatorError
from cdpr_sim_bus.frame import ERR_FLAG, pack_frame

StartBus = Callable[..., Any]


def test_a_frame_reaches_all_but_its_sender(start_bus: StartBus, stub_node: type) -> None:
    node = stub_node()
    bus = start_bus(node)
    sender, *others = [bus.join() for _ in range(4)]
    sender.send(0x123, b"hello")
    for other in others:
        assert other.recv() == pack_frame(0x123, b"hello")
    assert sender.quiet()
    assert [frame for frame, _ in node.seen] == [pack_frame(0x123, b"hello")]


def test_the_last_frames_of_a_client_that_left_frames_unread_are_delivered(
    start_bus: StartBus,
) -> None:
    bus = start_bus()
    other, hasty = bus.join(), bus.join()
    other.send(0x181)
    other.status()  # the frame now waits for the hasty client, which does not read it
    hasty.send(0x123)
    hasty.send(0x124)
    hasty.sock.close()
    assert [other.recv_id(), other.recv_id()] == [0x123, 0x124]
    until(lambda: len(bus.hub._clients) == 1)


def test_identical_lss_answers_become_one_frame(start_bus: StartBus, stub_node: type) -> None:
    both = (pack_frame(0x7E4, b"\x4f" + bytes(7)), pack_frame(0x584, bytes(8)))
    bus = start_bus(stub_node(1, answers=both), stub_node(2, answers=both))
    master = bus.join()
    master.send(0x080)
    assert [master.recv_id() for _ in range(3)] == [0x584, 0x584, 0x7E4]
    assert master.quiet()


def test_answers_to_one_sync_arrive_in_arbitration_order(
    start_bus: StartBus, stub_node: type
) -> None:
    nodes = [
        stub_node(3, answers=(pack_frame(0x283), pack_frame(0x183))),
        stub_node(1, answers=(pack_frame(0x181), pack_frame(0x081))),
        stub_node(2, answers=(pack_frame(0x582, b"1"), pack_frame(0x582, b"2"))),
    ]
    bus = start_bus(*nodes)
    master, watcher = bus.join(), bus.join()
    master.send(0x80)
    expected = [0x081, 0x181, 0x183, 0x283, 0x582, 0x582]
    assert [watcher.recv_id() for _ in range(7)] == [0x80, *expected]
    frames = [master.recv() for _ in range(6)]
    assert [int.from_bytes(frame[:4], "little") for frame in frames] == expected
    # frames of one identifier keep their order
    assert [frame[8:9] for frame in frames[-2:]] == [b"1", b"2"]


def test_waiting_clients_contend_for_the_bus(stub_node: type) -> None:
    """Frames sent while the hub is busy are ordered by identifier. Each client keeps its order."""
    hub = Hub([node := stub_node()], mode=ClockMode.PACED)
    pairs = [socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(3)]
    for mine, theirs in pairs:
        hub.attach(theirs)
        mine.settimeout(60.0)
    for (mine, _), can_ids in zip(pairs, ((0x300, 0x100), (0x200, 0x400), (0x080,)), strict=True):
        for can_id in can_ids:
            mine.send(pack_frame(can_id))
    stop = stub_node.receive

    def receive_then_stop(frame: bytes, now: float) -> None:
        stop(node, frame, now)
        if len(node.seen) == 5:
            hub.stop()

    node.receive = receive_then_stop
    hub.run()
    hub.close()
    order = [int.from_bytes(frame[:4], "little") for frame, _ in node.seen]
    # 0x100 is behind 0x300 in the queue of its client and cannot overtake it
    assert order == [0x080, 0x200, 0x300, 0x100, 0x400]
    for mine, _ in pairs:
        mine.close()


def test_all_frames_of_a_packet_are_delivered(start_bus: StartBus, stub_node: type) -> None:
    answer = pack_frame(0x181, b"answer")
    bus = start_bus(node := stub_node(7, answers=(answer,)))
    member, other = bus.join(), bus.join()
    frames = [pack_frame(can_id) for can_id in (0x300, 0x080, 0x200)]
    member.sock.send(b"bus-data".ljust(24, b"\0") + b"".join(frames))
    assert [other.recv() for _ in range(4)] == [frames[0], frames[1], answer, frames[2]]
    assert member.recv() == answer
    member.status()
    assert [frame for frame, _ in node.seen] == frames
    for wrong in (b"bus-data".ljust(24, b"\0"), b"bus-data".ljust(24 + 15, b"\0")):
        member.sock.send(wrong)
        assert b"error" in member.recv()


def test_frames_of_one_packet_contend_separately(stub_node: type) -> None:
    hub = Hub([node := stub_node()], mode=ClockMode.LOCKSTEP)
    pairs = [socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(2)]
    for _, theirs in pairs:
        hub.attach(theirs)
    together = b"".join(pack_frame(can_id) for can_id in (0x300, 0x100, 0x080, 0x500))
    pairs[0][0].send(b"bus-data".ljust(24, b"\0") + together)
    for can_id in (0x200, 0x400):
        pairs[1][0].send(pack_frame(can_id))
    while len(node.seen) < 6:
        hub.turn(1.0)
    hub.close()
    order = [int.from_bytes(frame[:4], "little") for frame, _ in node.seen]
    assert order == [0x200, 0x300, 0x100, 0x080, 0x400, 0x500]
    for mine, _ in pairs:
        mine.close()


def test_nodes_receive_only_frames_that_they_accept(start_bus: StartBus, stub_node: type) -> None:
    # with a cycle period, bus time is held after SYNC, so that no timers interfere
    talker = stub_node(1, sync_period_s=0.001, answers=(pack_frame(0x181, b"x"),))
    listener = stub_node(2, accepts=frozenset((0x181,)))
    bus = start_bus(talker, listener)
    member = bus.join()
    member.send(0x80)
    assert member.recv_id() == 0x181
    member.send(0x300)
    member.status()
    assert [frame for frame, _ in listener.seen] == [pack_frame(0x181, b"x")]
    assert pack_frame(0x181, b"x") not in [frame for frame, _ in talker.seen]
    listener.accepts = frozenset((0x300,))
    member.send(0x601)
    member.send(0x300)
    member.status()
    assert [frame[:2] for frame, _ in listener.seen] == [b"\x81\x01", b"\x00\x03"]


def test_a_client_that_does_not_read_loses_frames_without_blocking_others(
    start_bus: StartBus, stub_node: type
) -> None:
    bus = start_bus(stub_node(1, sync_period_s=0.001, answers=(pack_frame(0x181, bytes(8)),)))
    master, sleeper = bus.join(), bus.join()
    count = 0
    started = time.monotonic()
    while not (dropped := master.status()["dropped"]):
        for _ in range(1000):
            master.send(0x80)
            assert master.recv_id() == 0x181
        count += 1000
        assert time.monotonic() - started < 300.0
    # the frames in the sleeper's queue are complete and in order
    kept = 0
    sleeper.sock.setblocking(False)
    with pytest.raises(BlockingIOError):
        while True:
            expected = 0x80 if kept % 2 == 0 else 0x181
            assert sleeper.recv_id() == expected
            kept += 1
    assert kept + dropped == 2 * count


def test_a_client_that_leaves_does_not_disturb_others(start_bus: StartBus) -> None:
    bus = start_bus()
    one, two, leaver = bus.join(), bus.join(), bus.join()
    for can_id in range(50):
        one.send(can_id)
    leaver.sock.close()
    for can_id in range(50, 100):
        one.send(can_id)
    assert [two.recv_id() for _ in range(100)] == list(range(100))
    back = bus.join()
    one.send(0x99)
    assert back.recv_id() == 0x99


def test_invalid_frames_are_counted_and_dropped(start_bus: StartBus) -> None:
    bus = start_bus()
    sender, other = bus.join(), bus.join()
    sender.sock.send((0x123).to_bytes(4, "little") + b"\x09" + bytes(11))
    sender.sock.send(pack_frame(0x20 | ERR_FLAG, bytes(8)))
    assert other.quiet()
    status = sender.status()
    assert (status["malformed"], status["frames"]) == (2, 0)


@pytest.mark.parametrize(
    "packet",
    [
        b"not a frame nor JSON",
        b"[1, 2, 3, 4, 5, 6, 7]",
        b'{"filters": [[1]]}',
        b'{"filters": [[1, -1]]}',
        b'{"filters": 7, "status": true}',
        b'{"stat": true}',
        b'{"status":true}'.ljust(PACKET_BYTES),
    ],
)
def test_invalid_control_messages_are_answered(start_bus: StartBus, packet: bytes) -> None:
    member = start_bus().join()
    member.sock.send(packet)
    assert list(json.loads(member.recv())) == ["error"]
    member.status()


def test_a_bus_name_in_use_is_rejected(start_bus: StartBus) -> None:
    bus = start_bus()
    second = Hub(name=bus.name)
    with pytest.raises(BusSetupError, match=f"simbus:{bus.name} is in use"):
        second.listen()
    second.close()


@pytest.mark.parametrize("name", ["", "a b", "/tmp/x", "x" * 65, "-x", "é"])
def test_a_malformed_bus_name_is_rejected(name: str) -> None:
    hub = Hub(name=name)
    with pytest.raises(BusSetupError, match="allowed: 1 to 64 letters"):
        hub.listen()
    hub.close()


def test_the_hub_serves_nodes_on_a_real_interface_and_ends_with_it(stub_node: type) -> None:
    """A connected socket replaces the raw CAN socket. Both have one frame per packet."""
    node = stub_node(4, answers=(pack_frame(0x184, b"truth"),))
    hub = Hub([node], name="socketcan:can0")
    mine, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    mine.settimeout(60.0)
    hub.attach(theirs, essential=True)
    mine.send(pack_frame(0x80))
    mine.send(pack_frame(0x123))
    mine.shutdown(socket.SHUT_WR)
    with pytest.raises(SimulatorError, match="connection closed"):
        hub.run()
    assert mine.recv(64) == pack_frame(0x184, b"truth")
    hub.close()
    assert node.closed
    mine.close()
