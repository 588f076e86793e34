"""Error frames become a bus state and counts."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drivers.bus import BusHealth, BusState
from cdpr_drivers.bus.health import ERR_FLAG


@pytest.mark.parametrize(
    ("can_id", "data", "state", "errors", "words"),
    [
        (0x004, [0, 0x04], BusState.WARNING, 0, "error-warning"),
        (0x004, [0, 0x20], BusState.PASSIVE, 0, "error-passive"),
        (0x040, [], BusState.BUS_OFF, 0, "bus-off"),
        (0x020, [], BusState.ACTIVE, 1, "no acknowledge"),
        (0x008 | 0x080, [], BusState.ACTIVE, 1, "protocol violation; bus error"),
        (0x004, [0, 0x01], BusState.ACTIVE, 1, "frames lost"),
        (0x002, [], BusState.ACTIVE, 0, ""),  # lost arbitration is normal
    ],
)
def test_error_frames_are_classified(
    can_id: int, data: list[int], state: BusState, errors: int, words: str
) -> None:
    health = BusHealth()
    assert health.take_error(ERR_FLAG | can_id, bytes(data)) is (state is not BusState.ACTIVE)
    assert (health.state, health.errors) == (state, errors)
    assert words in health.text
    assert health.usable is (state is not BusState.BUS_OFF)


def test_a_bus_off_and_its_end_are_counted() -> None:
    health = BusHealth()
    health.take_error(0x004, bytes([0, 0x30]))
    health.take_error(0x040, b"")
    assert (health.state, health.bus_offs) == (BusState.BUS_OFF, 1)
    assert health.take_error(0x100, b"")
    assert (health.state, health.bus_offs) == (BusState.ACTIVE, 1)
    assert health.counts() == {"bus_off": 1}


def test_only_the_controller_reports_the_return_to_active() -> None:
    health = BusHealth()
    health.take_error(0x004, bytes([0, 0x10]))
    health.take_error(0x080, b"")
    assert health.state is BusState.PASSIVE  # a bus error alone does not change the state
    assert health.take_error(0x004, bytes([0, 0x40]))
    assert health.state is BusState.ACTIVE


def test_losses_are_counted() -> None:
    health = BusHealth()
    health.note_tx_full()
    health.note_rx_lost("too fast")
    assert (health.counts(), health.state) == (
        {"transmit_queue_full": 1, "frames_lost": 1},
        BusState.ACTIVE,
    )
    assert "too fast" in health.text


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), st.binary(max_size=12)), max_size=20))
@settings(max_examples=100)
def test_any_frame_leaves_a_known_state(frames: list[tuple[int, bytes]]) -> None:
    health = BusHealth()
    for can_id, data in frames:
        before = health.state
        assert health.take_error(can_id, data) is (health.state is not before)
    assert health.bus_offs <= len(frames)
    assert health.errors <= len(frames)
