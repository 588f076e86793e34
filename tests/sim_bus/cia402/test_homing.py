"""Homing methods find the index pulse or switch that geometry predicts."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_sim_bus.robot.plant import Plant
from tests.sim_bus.cia402.drive_rig import Rig

COUNTS = 1000
INDEX_DEG = 40.0
LIMITS = {"negative_deg": -2000.0, "positive_deg": 2600.0}
HOME = {"home_from_deg": 130.0, "home_to_deg": 1000.0}


def rig_at(angle_deg: float, **limits: float) -> Rig:
    rig = Rig(
        Plant.model_validate(
            {
                "motor": {"initial_angle_deg": angle_deg},
                "encoder": {"counts_per_turn": COUNTS, "index_deg": INDEX_DEG},
                "limits": limits,
            }
        )
    )
    rig.write(0x6099, 4000, 1)
    rig.write(0x6099, 1000, 2)
    rig.write(0x609A, 40_000)
    return rig


def home(rig: Rig, method: int, limit_s: float = 30.0) -> None:
    rig.write(0x6098, method)
    rig.enable(6)
    assert rig.status & 0x3400 == 0x0400  # homing has not started
    rig.word = 0x1F
    rig.cycle()
    if method not in (35, 37):
        assert rig.status & 0x3400 == 0x0000  # running
    rig.until(lambda: bool(rig.status & 0x3000), limit_s)


def homed_deg(rig: Rig) -> float:
    """Return the mechanical angle that is now the drive's zero."""
    rig.until(lambda: rig.status & 0x3400 in (0x1400, 0x2400), 2.0)
    rig.cycles(100)
    assert rig.status & 0x3400 == 0x1400
    true_deg = math.degrees(rig.truth[0])
    return true_deg - rig.position * 360 / COUNTS


def next_index(angle_deg: float, direction: int) -> float:
    turns = (angle_deg - INDEX_DEG) / 360
    return INDEX_DEG + 360 * (math.ceil(turns) if direction > 0 else math.floor(turns))


# Relevant edge and final direction, from the figures of the standard.
EXPECTED = {
    1: ("negative", +1),
    2: ("positive", -1),
    7: ("left", -1),
    8: ("left", +1),
    9: ("right", -1),
    10: ("right", +1),
    11: ("right", +1),
    12: ("right", -1),
    13: ("left", +1),
    14: ("left", -1),
}


@pytest.mark.parametrize("method", EXPECTED)
@pytest.mark.parametrize("start_deg", [-900.0, 400.0, 1500.0])
def test_methods_with_switches_find_the_predicted_index(method: int, start_deg: float) -> None:
    edge_name, direction = EXPECTED[method]
    edge = {
        "negative": LIMITS["negative_deg"],
        "positive": LIMITS["positive_deg"],
        "left": HOME["home_from_deg"],
        "right": HOME["home_to_deg"],
    }[edge_name]
    rig = rig_at(start_deg, **LIMITS, **HOME)
    home(rig, method)
    assert homed_deg(rig) == pytest.approx(next_index(edge, direction), abs=1.5)


@pytest.mark.parametrize("start_deg", [-300.0, 900.0])
@pytest.mark.parametrize(
    ("method", "home_switch", "direction"),
    [
        (3, {"home_from_deg": 130.0}, -1),
        (4, {"home_from_deg": 130.0}, +1),
        (5, {"home_to_deg": 130.0}, +1),
        (6, {"home_to_deg": 130.0}, -1),
    ],
)
def test_methods_with_a_one_sided_home_switch_find_the_predicted_index(
    method: int, home_switch: dict[str, float], direction: int, start_deg: float
) -> None:
    rig = rig_at(start_deg, **home_switch)
    home(rig, method)
    assert homed_deg(rig) == pytest.approx(next_index(130.0, direction), abs=1.5)


@pytest.mark.parametrize("method", [1, 2])
def test_homing_may_start_on_the_limit_switch(method: int) -> None:
    rig = rig_at(-2100.0 if method == 1 else 2700.0, **LIMITS)
    home(rig, method)
    edge, direction = (-2000.0, 1) if method == 1 else (2600.0, -1)
    assert homed_deg(rig) == pytest.approx(next_index(edge, direction), abs=1.5)


@settings(max_examples=12)
@given(start=st.floats(-700, 700), method=st.sampled_from([33, 34]), offset=st.integers(-500, 500))
def test_index_methods_find_the_next_index_from_any_start(
    start: float, method: int, offset: int
) -> None:
    rig = rig_at(start)
    rig.write(0x607C, offset)
    home(rig, method)
    index = next_index(start, -1 if method == 33 else 1)
    # The zero is one home offset beyond the index.
    assert homed_deg(rig) == pytest.approx(index + offset * 360 / COUNTS, abs=1.5)


@pytest.mark.parametrize("method", [35, 37])
def test_methods_35_and_37_home_at_the_present_position(method: int) -> None:
    rig = rig_at(77.0)
    home(rig, method, 0.1)
    assert homed_deg(rig) == pytest.approx(77.0, abs=1.5)
    assert abs(rig.truth[0] - math.radians(77.0)) < 0.02


def test_homing_without_index_ends_with_an_error() -> None:
    rig = Rig(Plant.model_validate({"encoder": {"index_present": False}}))
    rig.write(0x6099, 16_000, 2)
    home(rig, 34)
    rig.cycles(300)
    assert rig.status & 0x3400 == 0x2400
    assert 2 * 2 * math.pi < rig.truth[0] < 3 * 2 * math.pi
    assert abs(rig.truth[1]) < 0.05
    assert rig.status & 0x6F == 0x27


def test_reaching_both_limits_ends_with_an_error() -> None:
    rig = rig_at(0.0, negative_deg=-200.0, positive_deg=300.0)
    home(rig, 7)
    rig.until(lambda: rig.status & 0x3400 == 0x2400, 2.0)


def test_failed_homing_can_be_tried_again() -> None:
    rig = rig_at(0.0, positive_deg=100.0)
    home(rig, 3)
    assert rig.status & 0x2000
    rig.word = 0x0F
    rig.write(0x6098, 34)
    rig.cycles(20)
    rig.word = 0x1F
    rig.cycles(2)
    rig.until(lambda: bool(rig.status & 0x1000), 5.0)


@pytest.mark.parametrize("word", [0x0F, 0x11F])
def test_ending_the_command_or_halt_interrupts_homing(word: int) -> None:
    rig = rig_at(50.0)
    rig.write(0x6098, 34)
    rig.enable(6)
    rig.word = 0x1F
    rig.cycles(50)
    assert rig.status & 0x3400 == 0
    rig.word = word
    rig.cycles(300)
    assert rig.status & 0x3400 == 0x0400
    stopped_at = rig.truth[0]
    rig.cycles(200)
    assert abs(rig.truth[0] - stopped_at) < 0.01


def test_a_drive_stays_homed_in_other_modes_but_not_after_a_reset() -> None:
    rig = rig_at(0.0)
    home(rig, 34)
    homed_deg(rig)
    rig.word = 0x0F
    rig.set_mode(10)
    rig.set_mode(6)
    rig.cycle()
    assert rig.status & 0x3400 == 0x1400
    rig.word = 0
    rig.nmt(129)
    rig.run(0.05)
    rig.write(0x6060, 6)
    rig.run(0.05)
    assert rig.read(0x6041) & 0x3400 == 0x0400


def test_position_mode_uses_the_new_zero() -> None:
    rig = rig_at(0.0)
    home(rig, 34)
    homed_deg(rig)
    rig.word = 0x0F
    rig.set_mode(1)
    rig.write(0x607A, 250)
    rig.word = 0x1F
    rig.cycles(5)
    rig.until(lambda: bool(rig.status & 0x0400), 5.0)
    rig.cycles(100)
    assert math.degrees(rig.truth[0]) == pytest.approx(INDEX_DEG + 90, abs=8)


def test_digital_inputs_show_the_switches() -> None:
    seen = [rig_at(angle, **LIMITS, **HOME).read(0x60FD) for angle in (-2100.0, 0.0, 400.0, 2700.0)]
    assert seen == [1, 0, 4, 2]


def test_homing_is_the_same_with_one_long_step_of_bus_time() -> None:
    rig = rig_at(0.0)
    rig.write(0x6098, 34)
    rig.enable(6)
    rig.write(0x6040, 0x1F)
    rig.now += 3.0
    rig.drive.advance(rig.now)
    assert rig.read(0x6041) & 0x3400 == 0x1400
    assert math.degrees(rig.truth[0]) == pytest.approx(INDEX_DEG, abs=10)
