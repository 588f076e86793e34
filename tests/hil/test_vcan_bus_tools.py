"""Scan, monitor and replay on a real vcan0, with a slave of the canopen library."""

import socket
import struct
import time
from collections.abc import Iterator

import canopen
import pytest

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.decode import Frame
from cdpr_profiles import load_winch
from cdpr_tools.busview.monitor import FrameSource
from cdpr_tools.busview.replay import Sender
from cdpr_tools.busview.scan import Scan, entry, responding

pytestmark = pytest.mark.vcan

URL = BusUrl.parse("socketcan:vcan0")
DRIVE = load_winch("winch-mpp0923d").drive


@pytest.fixture
def slave() -> Iterator[canopen.LocalNode]:
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    network.connect(interface="socketcan", channel="vcan0")
    dictionary = canopen.import_od(str(DRIVE.eds), 9)
    node = canopen.LocalNode(9, dictionary)
    network.add_node(node)
    for index, sub, value in (
        (0x1000, 0, 0x20192),
        (0x1018, 1, DRIVE.vendor_id),
        (0x1018, 2, DRIVE.product_code),
        (0x6041, 0, 0x0237),
    ):
        part = dictionary[index][sub] if sub else dictionary[index]
        node.set_data(index, sub, part.encode_raw(value))
    yield node
    network.disconnect()


def test_scan_finds_a_third_party_slave(slave: canopen.LocalNode) -> None:
    with Scan(URL, range(5, 15)) as scan:
        scan.ask()
    (found,) = responding(scan.found)
    told = entry(found, {"generic": DRIVE})
    assert told["node_id"] == 9
    assert told["state"] == "operation enabled"
    assert told["profiles"] == ["generic"]
    assert told["problems"] == []
    assert not scan.traffic.sdo_requests  # our requests are not mistaken for those of a master


def frames_of(source: FrameSource, n: int) -> list[Frame]:
    found: list[Frame] = []
    until = time.monotonic() + 60.0
    while len(found) < n and time.monotonic() < until:
        source.receive(0.1)
        found += source.next_frames(100)
    return found


def test_monitor_shows_each_kind_of_frame_with_its_time() -> None:
    source = FrameSource(URL)
    now = time.time()
    kinds = [
        Frame(0.0, 0x181, bytes(8)),
        Frame(0.0, 0x1ABCDEF0, b"\1", extended=True),
        Frame(0.0, 0x701, b"", remote=True, length=1),
        Frame(0.0, 0x204, bytes.fromhex("0008000000006000"), error=True),
    ]
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.bind(("vcan0",))
        for frame in kinds:
            bus.send(frame.pack())
    found = frames_of(source, len(kinds))
    after = time.time()
    source.close()
    assert [frame._replace(time_s=0.0) for frame in found] == kinds
    times = [frame.time_s for frame in found]
    assert times == sorted(times)
    assert now - 0.1 < times[0] < after + 0.1


def test_replay_sends_frames_and_disables_drives_at_the_end() -> None:
    notes: list[str] = []
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.bind(("vcan0",))
        bus.settimeout(60.0)
        with Sender(URL, notes.append) as sender:
            sender.send(Frame(0.0, 0x205, bytes.fromhex("0F000000")))
            sender.complete = True
        enabled, off = (struct.unpack("=IB3x8s", bus.recv(16)) for _ in range(2))
    assert enabled[:2] == (0x205, 4)
    # a recording may end in motion
    assert off == (0x605, 8, bytes.fromhex("2B40600000000000"))
    assert notes == [
        "commanded to switch their power off: node 5",
        "sent 1 frames to socketcan:vcan0",
    ]
