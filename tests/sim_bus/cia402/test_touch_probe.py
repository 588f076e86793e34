"""Touch probes on the index pulse, during motion in torque mode."""

from __future__ import annotations

import math

import pytest

from cdpr_sim_bus.robot.plant import Plant
from tests.sim_bus.cia402.drive_rig import Rig, SdoRefusedError

INDEX_DEG = 123.4
ENABLE, CONTINUOUS, ZERO, POSITIVE, NEGATIVE = 0x01, 0x02, 0x04, 0x10, 0x20
FIRST = round(INDEX_DEG / 360 * 8192)


@pytest.fixture
def turning() -> Rig:
    rig = Rig(Plant())
    rig.enable(9)
    return rig


def turn(rig: Rig, counts: int) -> None:
    """Turn by some counts at 16 counts per cycle."""
    rig.write(0x60FF, 16_000 if counts > 0 else -16_000)
    rig.cycles(abs(counts) // 16)
    rig.write(0x60FF, 0)
    rig.cycles(50)


def test_a_single_event_probe_latches_only_the_first_event(turning: Rig) -> None:
    turning.write(0x60B8, ENABLE | ZERO | POSITIVE)
    assert turning.read(0x60B9) == 0x01
    turn(turning, 8192)
    assert turning.read(0x60B9) == 0x03
    assert turning.read(0x60BA, signed=True) == FIRST
    turn(turning, 8192)
    assert turning.read(0x60BA, signed=True) == FIRST
    # Disabling and enabling the edge arms it again.
    turning.write(0x60B8, ENABLE | ZERO)
    assert turning.read(0x60B9) == 0x01
    turning.write(0x60B8, ENABLE | ZERO | POSITIVE)
    turn(turning, 8192)
    assert turning.read(0x60BA, signed=True) == FIRST + 2 * 8192


def test_continuous_events_toggle_their_bit(turning: Rig) -> None:
    turning.write(0x60B8, ENABLE | ZERO | POSITIVE | CONTINUOUS)
    seen = []
    for k in range(3):
        turn(turning, 8192)
        assert turning.read(0x60BA, signed=True) == FIRST + k * 8192
        seen.append(turning.read(0x60B9))
    assert seen == [0x43, 0x03, 0x43]


def test_edges_are_one_count_apart_and_depend_on_the_direction(turning: Rig) -> None:
    turning.write(0x60B8, ENABLE | ZERO | POSITIVE | NEGATIVE | CONTINUOUS)
    turn(turning, 6000)
    assert turning.read(0x60BA, signed=True) == FIRST
    assert turning.read(0x60BB, signed=True) == FIRST + 1
    assert turning.read(0x60B9) == 0xC7
    turn(turning, -6000)
    assert turning.read(0x60BA, signed=True) == FIRST
    assert turning.read(0x60BB, signed=True) == FIRST - 1
    assert turning.read(0x60B9) == 0x07


def test_the_second_probe_latches_the_index_by_source_object(turning: Rig) -> None:
    with pytest.raises(SdoRefusedError):
        turning.write(0x60B8, (ENABLE | 0x08 | POSITIVE) << 8)
    turning.write(0x60D0, 5, 2)
    turning.write(0x60B8, (ENABLE | 0x08 | POSITIVE) << 8)
    turn(turning, 6000)
    assert turning.read(0x60B9) == 0x0300
    assert turning.read(0x60BC, signed=True) == FIRST
    assert turning.read(0x60BA) == 0


def test_the_external_input_is_rejected(turning: Rig) -> None:
    with pytest.raises(SdoRefusedError):
        turning.write(0x60B8, ENABLE | POSITIVE)
    assert turning.read(0x60B9) == 0


def test_disabling_clears_the_status(turning: Rig) -> None:
    turning.write(0x60B8, ENABLE | ZERO | POSITIVE)
    turn(turning, 6000)
    turning.write(0x60B8, 0)
    assert turning.read(0x60B9) == 0
    turn(turning, -6000)
    assert turning.read(0x60B9) == 0


def test_the_latched_position_includes_the_home_offset(turning: Rig) -> None:
    turning.write(0x607C, -500)
    turning.write(0x6098, 37)
    turning.set_mode(6)
    turning.word = 0x1F
    turning.cycles(50)
    turning.word = 0x0F
    offset = turning.position - round(turning.truth[0] / (2 * math.pi) * 8192)
    assert abs(offset - 500) <= 3
    turning.set_mode(9)
    turning.write(0x60B8, ENABLE | ZERO | POSITIVE)
    turn(turning, 6000)
    assert abs(turning.read(0x60BA, signed=True) - (FIRST + offset)) <= 3
