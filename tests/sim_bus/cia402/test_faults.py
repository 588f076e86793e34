"""Faults of a simulated drive: causes, codes, reactions and resets."""

from __future__ import annotations

from typing import Any

import pytest

from cdpr_sim_bus.robot.plant import Plant
from tests.sim_bus.cia402.drive_rig import Rig, SdoRefusedError

FAULT, FRA, OE, SOD = 0x08, 0x0F, 0x27, 0x40


def rig_with(**sections: Any) -> Rig:
    return Rig(Plant.model_validate(sections))


def reset(rig: Rig) -> int:
    rig.word = 0x00
    rig.cycles(2)
    rig.word = 0x80
    rig.cycles(2)
    return rig.status & 0x4F


def test_a_following_error_faults_the_drive_with_8611h() -> None:
    rig = rig_with(load={"inertia_kg_m2": 0.01})
    rig.write(0x6065, 500)
    rig.write(0x6066, 20)
    rig.enable(8)
    rig.write(0x607A, 200_000)
    rig.until(lambda: rig.status & 0x4F == FAULT, 3.0)
    assert rig.read(0x603F) == 0x8611
    assert rig.emergencies[-1] == (0x8611, 0x21)
    assert rig.read(0x1001) == 0x21
    assert any(status & 0x202F == 0x2027 or status & 0x4F == FRA for status in rig.seen)
    rig.run(0.5)
    assert reset(rig) == SOD
    assert rig.emergencies[-1] == (0, 0)
    assert rig.read(0x603F) == 0


def test_overcurrent_cuts_power_immediately() -> None:
    rig = rig_with(drive={"overcurrent_Arms": 4.0})
    rig.enable(10)
    rig.torque = 900  # 4.8 A
    rig.until(lambda: rig.status & 0x4F == FAULT, 0.1)
    assert not any(status & 0x4F == FRA for status in rig.seen)
    assert rig.read(0x603F) == 0x2310
    assert rig.emergencies[-1] == (0x2310, 0x03)
    rig.cycles(20)
    assert reset(rig) == SOD


def test_exceeding_a_lowered_speed_limit_faults_the_drive_with_8400h() -> None:
    rig = rig_with(friction={"coulomb_Nm": 0.0, "breakaway_Nm": 0.0, "viscous_Nms_rad": 0.0})
    rig.write(0x6080, 600)
    rig.enable(10)
    rig.torque = 300
    rig.cycles(400)
    # The speed limit reduces the torque ...
    assert rig.truth[1] == pytest.approx(600 * 0.10472, rel=0.05)
    assert rig.status & 0x0800
    # ... until it is lowered below the present speed.
    rig.write(0x6080, 300)
    rig.until(lambda: rig.status & 0x4F == FAULT, 0.1)
    assert rig.read(0x603F) == 0x8400
    assert any(status & 0x4F == FRA for status in rig.seen)
    assert abs(rig.truth[1]) < 0.1


@pytest.mark.parametrize("counts", [4000, -4000])
def test_a_reaction_to_the_speed_of_an_encoder_jump_does_not_accelerate_the_motor(
    counts: int,
) -> None:
    rig = rig_with(load={"inertia_kg_m2": 1e-3})
    rig.enable(10)
    start = rig.truth[0]
    rig.write(0x2F00, counts, 11)
    rig.until(lambda: rig.status & 0x4F == FRA, 0.1)
    rig.until(lambda: rig.status & 0x4F == FAULT, 3.0)
    assert rig.read(0x603F) == 0x8400
    assert abs(rig.truth[0] - start) < 0.5


def test_i2t_warns_then_trips_and_must_cool_before_a_reset() -> None:
    rig = rig_with(
        drive={"i2t_time_constant_s": 0.5},
        friction={"coulomb_Nm": 5.0},
        motor={"torque_constant_error": 0.0},
    )
    rig.enable(10)
    rig.torque = 1400  # 4.2 Nm: 1.34 times the rated current, 1.79 times the rated heat
    rig.until(lambda: bool(rig.status & 0x80), 2.0)
    assert rig.status & 0x6F == OE
    rig.until(lambda: rig.status & 0x4F == FAULT, 2.0)
    assert rig.read(0x603F) == 0x2350
    rig.cycles(20)
    assert reset(rig) == FAULT
    rig.cycles(300)
    assert reset(rig) == SOD


def test_rated_torque_never_trips_i2t() -> None:
    rig = rig_with(drive={"i2t_time_constant_s": 0.05}, friction={"coulomb_Nm": 5.0})
    rig.enable(10)
    rig.torque = 1000
    rig.cycles(1000)
    assert rig.status & 0x6F == OE


@pytest.mark.parametrize("option", [0, 1, 2, 3])
def test_fault_reaction_options_stop_the_motor_as_specified(option: int) -> None:
    rig = Rig()
    rig.write(0x605E, option)
    rig.enable(3)
    rig.write(0x60FF, 40_000)
    rig.cycles(300)
    start = rig.truth[0]
    rig.write(0x2F00, 0xFF10, 1)
    rig.cycle()
    assert rig.status & 0x4F == (FAULT if option == 0 else FRA)
    rig.cycles(500)
    assert rig.status & 0x4F == FAULT
    assert rig.read(0x603F) == 0xFF10
    way = rig.truth[0] - start
    assert (way > 0.3) if option == 0 else abs(rig.truth[1]) < 0.05
    if option == 1:
        assert way == pytest.approx(30.7**2 / 2 / 628.3, rel=0.15)


def test_a_quick_stop_ends_even_if_encoder_noise_hides_the_standstill() -> None:
    rig = rig_with(encoder={"noise_counts": 100.0})
    rig.enable(10)
    rig.word = 0x0002
    rig.cycles(5)
    rig.run(1.0)
    rig.cycle()
    assert rig.status & 0x6F == 0x07
    rig.run(1.5)
    rig.cycle()
    assert rig.status & 0x4F == SOD


def test_reset_needs_a_rising_edge_of_bit_7() -> None:
    rig = Rig()
    rig.map_pdos()
    rig.word = 0x80
    rig.cycles(5)
    rig.write(0x2F00, 0xFF01, 1)
    rig.cycles(20)
    assert rig.status & 0x4F == FAULT
    rig.word = 0x84
    rig.cycles(5)
    assert rig.status & 0x4F == FAULT
    rig.word = 0x00
    rig.cycles(5)
    assert rig.status & 0x4F == FAULT
    rig.word = 0x80
    rig.cycle()
    assert rig.status & 0x4F == SOD


def test_reset_does_not_enable() -> None:
    rig = Rig()
    rig.enable(10)
    rig.write(0x2F00, 0xFF01, 1)
    rig.until(lambda: rig.status & 0x4F == FAULT, 1.0)
    rig.word = 0x8F
    rig.cycles(20)
    assert rig.status & 0x4F == SOD


def test_a_second_fault_does_not_hide_the_first() -> None:
    rig = Rig()
    rig.write(0x2F00, 0xFF01, 1)
    rig.write(0x2F00, 0xFF02, 1)
    assert rig.read(0x603F) == 0xFF01


def test_only_a_drive_with_a_cable_accepts_cut_and_slip() -> None:
    bare = Rig()
    for sub in (12, 13):
        with pytest.raises(SdoRefusedError, match="06060000h"):
            bare.write(0x2F00, 1, sub)
    for sub, value in ((12, 1), (13, 100)):
        pulled = rig_with(
            load={"kind": "fixed_anchor", "pretension_N": 30.0, "winch_friction_Nm": 2.0}
        )
        motor = pulled.drive.axis.motor
        assert motor["tension"][0] > 15.0
        pulled.write(0x2F00, value, sub)
        pulled.run(0.02)
        assert motor["tension"][0] == 0.0
        pulled.write(0x2F00, 0, sub)
        pulled.run(0.02)
        assert (
            motor["tension"][0] < 1.0
        )  # just slack after a cut, fastened at its mark after a slip
        motor["angle"] -= 0.5
        pulled.run(0.02)
        assert motor["tension"][0] > 15.0
