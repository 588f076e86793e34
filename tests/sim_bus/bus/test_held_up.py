"""A delayed simulator on a paced bus processes frames with the times when they were sent."""

from __future__ import annotations

import socket
import time
from itertools import pairwise

import pytest

from cdpr_profiles import load_winch
from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.frame import pack_frame
from cdpr_sim_bus.robot.plant import Plant

pytestmark = pytest.mark.alone

MASTER = 127
CONSUMER_S = 0.4
CLOCKS_S = 2e-3
"""Accuracy of converting the kernel's timestamps, which use another clock, to bus time."""
SYNC, HEARTBEAT = pack_frame(0x080), pack_frame(0x700 + MASTER, b"\x05")


class Held:
    """A paced hub that runs only when the test lets it, with clients that send meanwhile."""

    def __init__(self, *nodes: object) -> None:
        self.hub = Hub(nodes, mode=ClockMode.PACED)  # type: ignore[arg-type]
        self.clients = []
        for _ in range(2):
            mine, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            mine.setblocking(False)
            self.hub.attach(theirs)
            self.clients.append(mine)

    def catch_up(self, seconds: float = 0.0) -> None:
        """Let the hub run for at least `seconds`, until no frames wait."""
        end = time.monotonic() + seconds
        self.hub.turn(0.0)
        while (wait_s := self.hub.wait_s()) == 0.0 or time.monotonic() < end or self._has_frames():
            self.hub.turn(min(wait_s or 0.0, 1e-3))

    def _has_frames(self) -> bool:
        return bool(self.hub._watcher.readable(0.0, exactly=False))

    def received(self, client: int = 0) -> list[bytes]:
        frames = []
        while True:
            try:
                frames.append(self.clients[client].recv(64))
            except BlockingIOError:
                return frames

    def close(self) -> None:
        self.hub.close()
        for client in self.clients:
            client.close()


def test_frames_are_processed_with_the_times_they_were_sent(stub_node: type) -> None:
    held = Held(node := stub_node(sync_period_s=0.01))
    earliest, latest = [], []
    for k in range(100):
        earliest.append(time.monotonic())
        held.clients[k % 2].send(SYNC if k % 2 else pack_frame(0x100 + k))
        latest.append(time.monotonic())
        time.sleep(0.002)
    time.sleep(0.1)
    held.catch_up()
    offset = held.hub.clock.now(now_s := time.monotonic()) - now_s
    held.close()
    names = [int.from_bytes(frame[:4], "little") for frame, _ in node.seen]
    assert names == [0x080 if k % 2 else 0x100 + k for k in range(100)]
    taken = [now - offset for _, now in node.seen]
    for before, at, after in zip(earliest, taken, latest, strict=True):
        assert before - CLOCKS_S <= at <= after + CLOCKS_S
    assert all(a <= b for a, b in pairwise(node.advanced))


def test_a_timer_expires_between_the_frames_before_and_after_it(stub_node: type) -> None:
    held = Held(node := stub_node(sync_period_s=0.01))
    held.catch_up()
    held.clients[0].send(SYNC)
    start = held.hub.clock.now(time.monotonic())
    node.timers.append(start + 0.03)
    while held.hub.clock.peek(time.monotonic()) < start + 0.05:
        held.clients[0].send(SYNC)
        time.sleep(0.01)
    held.clients[0].send(SYNC)
    held.catch_up()
    times = [now for _, now in node.seen]
    fired = next(now for now in node.advanced if now >= start + 0.03)
    held.close()
    assert times[0] < start + 0.03 < times[-1]
    assert fired <= next(now for now in times if now >= start + 0.03)


@pytest.fixture
def held_drive() -> Held:
    held = Held(SimDrive.for_winch(load_winch("winch-mpp0923d"), Plant()))
    held.catch_up(0.05)
    request = bytes([0x23, 0x16, 0x10, 0x01]) + (MASTER << 16 | round(1e3 * CONSUMER_S)).to_bytes(
        4, "little"
    )
    held.clients[0].send(pack_frame(0x601, request))
    held.clients[0].send(HEARTBEAT)
    held.catch_up(0.02)
    assert any(frame[:2] == b"\x81\x05" for frame in held.received())
    return held


def _emergencies(held: Held) -> list[int]:
    return [
        int.from_bytes(frame[8:10], "little")
        for frame in held.received()
        if frame[:2] == b"\x81\x00"
    ]


def test_delaying_the_simulator_loses_no_heartbeat(held_drive: Held) -> None:
    """The delay is over a second, several times what the drive tolerates."""
    cycles, heartbeats = held_drive.clients
    for k in range(250):
        cycles.send(SYNC)
        if k % 2 == 0:
            heartbeats.send(HEARTBEAT)
        time.sleep(0.005)
    held_drive.catch_up()
    assert _emergencies(held_drive) == []
    assert held_drive.hub.sync_count == 250
    held_drive.catch_up(2 * CONSUMER_S)
    assert _emergencies(held_drive) == [0x8130]
    held_drive.close()


def test_silence_during_a_delay_of_the_simulator_is_detected(held_drive: Held) -> None:
    cycles, heartbeats = held_drive.clients
    heartbeats.send(HEARTBEAT)
    for _ in range(100):
        cycles.send(SYNC)
        time.sleep(0.005)
    heartbeats.send(HEARTBEAT)
    held_drive.catch_up()
    # the error is set in the middle and cleared by the heartbeat at the end
    assert _emergencies(held_drive) == [0x8130, 0x0000]
    held_drive.close()
