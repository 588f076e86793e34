"""The simulator's nodes and the master's packed port on a real vcan0."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator

import pytest
from fork_server import FORKED

from cdpr_drivers.bus import BusUrl, FrameBuffer, open_port
from cdpr_drivers.bus.frames import FRAME
from cdpr_drivers.errors import BusError

pytestmark = pytest.mark.vcan

SIMULATOR = """
import math
from cdpr_sim_bus.frame import pack_frame
from cdpr_sim_bus.bus.server import serve

class Node:
    node_id = 1
    sync_period_s = 0.001
    accepts = frozenset((0x80, 0x201))
    def __init__(self): self.outbox, self.data = [], bytes(4)
    def receive(self, frame, now):
        if frame[:2] == b"\\x80\\x00":
            self.outbox += [pack_frame(0x281, b"other"), pack_frame(0x181, self.data)]
        else:
            self.data = frame[8:12]
    def advance(self, now): pass
    def next_event(self): return math.inf
    def close(self): print("closed", flush=True)

serve([Node()], "socketcan:vcan0", until_stdin_ends=True)
"""


@pytest.fixture
def simulator() -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen([*FORKED, SIMULATOR], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert b"ready" in process.stdout.readline()
    yield process
    process.kill()
    process.communicate()


def test_a_port_exchanges_cycles_with_drives_over_vcan(simulator: subprocess.Popen[bytes]) -> None:
    url = BusUrl.parse("socketcan:vcan0")
    port = open_port(url, [(0x180, 0x780)])
    port.settimeout(60.0)
    tx, rx = FrameBuffer(2), FrameBuffer(1)
    tx.array["can_id"] = 0x201, 0x80
    tx.array["length"] = 4, 0
    for k in range(200):
        tx.array["data"][0, :4] = k, 1, 2, 3
        port.send(tx.rows[0])
        port.send(tx.rows[1])
        assert port.recv_into(rx.rows[0]) == 16
        assert bytes(rx.rows[0]) == FRAME.pack(0x181, 4, bytes((k, 1, 2, 3)))
    port.settimeout(0.05)
    with pytest.raises(BlockingIOError):
        port.recv_into(rx.rows[0])
    acyclic = open_port(url, [(0x280, 0x780)])
    acyclic.settimeout(60.0)
    port.send(tx.rows[1])
    acyclic.recv_into(rx.rows[0])
    assert bytes(rx.rows[0]) == FRAME.pack(0x281, 5, b"other")
    acyclic.close()
    assert port.drain() == 1
    port.close()


def test_the_simulator_ends_properly(simulator: subprocess.Popen[bytes]) -> None:
    out, _ = simulator.communicate(timeout=120)
    assert (simulator.returncode, out) == (0, b"closed\n")


def test_error_for_a_missing_interface_names_it() -> None:
    with pytest.raises(BusError, match=r"socketcan:nocan9.*No such device"):
        open_port(BusUrl.parse("socketcan:nocan9"))
