"""The cost of a frame on a real SocketCAN interface, beside python-can's own."""

from __future__ import annotations

import pytest

from cdpr_drivers.bus import BusUrl
from cdpr_tools.bench.cyclic.bus import OwnAccess, _on_vcan
from cdpr_tools.output import Output

pytestmark = pytest.mark.vcan


def test_frames_on_vcan_are_measured_both_ways() -> None:
    told = _on_vcan(200, Output(as_json=True))
    assert told["url"] == "socketcan:vcan0"
    for way in ("ours", "python-can"):
        assert told[way]["frames_per_s"] > 100
        assert told[way]["cpu_us_per_frame"]["mean"] > 0.0
    assert 0.0 < told["delivery_us"]["p50"] < 1e5


def test_nobody_answering_is_told() -> None:
    way = OwnAccess(BusUrl.parse("socketcan:vcan1"))
    way.open()
    way.port.settimeout(0.1)
    with pytest.raises(Exception, match="time-out"):
        way.exchange()
    way.close()
