"""The python-can interface "simbus", used through python-can."""

from __future__ import annotations

import time
from typing import Any

import can
import pytest


def message(can_id: int, data: bytes = b"") -> can.Message:
    return can.Message(arbitration_id=can_id, data=data, is_extended_id=can_id > 0x7FF)


def test_frames_go_both_ways(simulator: Any) -> None:
    with (
        can.Bus(interface="simbus", channel=simulator.name) as one,
        can.Bus(interface="simbus", channel=simulator.name) as two,
    ):
        sent = [
            message(0x123, b"abc"),
            message(0x12345678, b"12345678"),
            can.Message(arbitration_id=0x701, is_remote_frame=True, dlc=1, is_extended_id=False),
        ]
        begin_s = time.time()
        for entry in sent:
            one.send(entry)
        for entry in sent:
            got = two.recv(60.0)
            assert got is not None
            assert got.equals(
                entry, timestamp_delta=None, check_channel=False, check_direction=False
            )
            assert begin_s - 1.0 < got.timestamp < time.time() + 1.0
            assert got.channel == simulator.name
        assert one.recv(0.02) is None
        assert one.state is can.BusState.ACTIVE


def test_filters_are_applied_and_can_change(simulator: Any) -> None:
    filters = [{"can_id": 0x181, "can_mask": 0x7FF, "extended": False}]
    with (
        can.Bus(interface="simbus", channel=simulator.name, can_filters=filters) as bus,
        can.Bus(interface="simbus", channel=simulator.name) as other,
    ):
        time.sleep(0.05)
        for can_id in (0x180, 0x181, 0x10000181):
            other.send(message(can_id))
        got = bus.recv(60.0)
        assert got is not None
        assert (got.arbitration_id, got.is_extended_id) == (0x181, False)
        assert bus.recv(0.02) is None
        bus.set_filters(None)
        time.sleep(0.05)
        other.send(message(0x10000181))
        got = bus.recv(60.0)
        assert got is not None
        assert got.is_extended_id


def test_a_killed_simulator_ends_with_a_can_error(simulator: Any) -> None:
    bus = can.Bus(interface="simbus", channel=simulator.name)
    simulator.kill()
    with pytest.raises(can.CanOperationError, match="is lost"):
        bus.recv(60.0)
    with pytest.raises(can.CanOperationError, match="is lost"):
        bus.send(message(0x80))
    bus.shutdown()


def test_a_bus_that_takes_no_frames_is_reported(simulator: Any) -> None:
    with can.Bus(interface="simbus", channel=simulator.name) as bus:
        simulator.process.send_signal(19)
        with pytest.raises(can.CanOperationError, match="buffer full"):
            for _ in range(100_000):
                bus.send(message(0x123), timeout=0.05)
        simulator.process.send_signal(18)
        bus.send(message(0x123), timeout=60.0)


def test_running_buses_are_found(simulator: Any) -> None:
    found = can.detect_available_configs(interfaces=["simbus"])
    assert {"interface": "simbus", "channel": simulator.name} in list(found)
