"""The monitor on a real vcan0."""

import socket
import time

import pytest

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.decode import Frame
from cdpr_tools.busview.monitor import FrameSource

pytestmark = pytest.mark.vcan

URL = BusUrl.parse("socketcan:vcan0")


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
