"""The network's reaction to error-passive and bus-off, as the kernel reports them."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from cdpr_drivers.bus import BusState, BusUrl, open_port
from cdpr_drivers.bus.frames import ERR_FLAG, FRAME
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_rt.core.clock import PacedClock

pytestmark = pytest.mark.vcan

VCAN0 = BusUrl.parse("socketcan:vcan0")


def _eventually(clock: PacedClock, condition: Callable[[], object]) -> None:
    assert clock.wait(condition, clock.now_s + 5.0)


def test_error_passive_is_reported_and_bus_off_raises_an_alarm_until_it_ends() -> None:
    clock = PacedClock()
    network = CanNetwork(VCAN0, clock, [1], 127, 0.1)
    wire = open_port(VCAN0, [])

    def tell(error: int, detail: int = 0) -> None:
        wire.send(FRAME.pack(ERR_FLAG | error, 8, bytes([0, detail]).ljust(8, b"\0")))

    try:
        tell(0x004, 0x20)
        _eventually(clock, lambda: network.health.state is BusState.PASSIVE)
        assert network.alarm_text == ""
        tell(0x040)
        _eventually(clock, lambda: network.alarm_text)
        assert "socketcan:vcan0: the CAN controller is bus-off" in network.alarm_text
        network.clear_alarm()
        assert "bus-off" in network.alarm_text
        tell(0x100)
        _eventually(clock, lambda: network.health.state is BusState.ACTIVE)
        network.clear_alarm()
        assert network.alarm_text == ""
        tell(0x004, 0x40)
        assert network.health.bus_offs == 1
    finally:
        network.close()
        wire.close()
