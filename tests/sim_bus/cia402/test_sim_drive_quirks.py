"""Quirks of the simulated drives other than the generic one."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.sim_bus.cia402.drive_rig import EDS, NODE, SMOOTH, Rig, SdoRefusedError

MNM, COMPAX3 = (EDS.with_name(f"{n}.eds") for n in ("mnm-profile-torque", "parker-compax3-canopen"))
NO_OBJECT, DEVICE_STATE, INVALID, NOT_MAPPABLE, TOO_HIGH = (
    0x06020000, 0x08000022, 0x06090030, 0x06040041, 0x06090031,
)  # fmt: skip
PT, HM, CST = 4, 6, 10
HALT = 0x100


@pytest.fixture
def mnm() -> Rig:
    rig = Rig(SMOOTH, eds=MNM)
    rig.write(0x6087, 4_000_000)
    return rig


def refusal(rig: Rig, index: int, value: int, sub: int = 0) -> int:
    with pytest.raises(SdoRefusedError) as caught:
        rig.write(index, value, sub)
    return caught.value.code


def enable(rig: Rig, mode: int) -> None:
    """Enable the drive by SDO, with halt set during the mode change."""
    rig.write(0x6040, HALT)
    rig.write(0x6060, mode)
    rig.write(0x6040, 0)
    rig.run(0.05)
    for word in (6, 7, 15):
        rig.write(0x6040, word)
        rig.run(0.1)
    assert rig.read(0x6041) & 0x6F == 0x27


def turn(rig: Rig, units: int, seconds: float = 0.012) -> tuple[float, float]:
    """Write `units` to 6071h and return true torque and speed."""
    rig.write(0x6071, units)
    rig.run(seconds)
    sample = rig.drive.axis.sample
    return sample[6], sample[5]


def test_max_torque_and_slope_are_in_the_same_unit(mnm: Rig) -> None:
    assert mnm.read(0x6072) == 11_550
    mnm.write(0x6072, 400)
    enable(mnm, PT)
    assert turn(mnm, 900)[0] == pytest.approx(0.4 * 1.04, rel=0.005)
    mnm.write(0x6087, 20_000)
    turn(mnm, 0, 0.2)
    assert turn(mnm, 300, 0.008)[0] == pytest.approx(0.16 * 1.04, rel=0.1)


def test_a_mode_change_without_halt_is_ignored(mnm: Rig) -> None:
    mnm.write(0x6060, PT)
    mnm.run(0.2)
    assert mnm.read(0x6061) == 0
    mnm.write(0x6040, HALT)
    mnm.write(0x6060, PT)
    mnm.run(0.02)
    assert mnm.read(0x6061) == 0, "the change takes some time"
    mnm.run(0.01)
    assert mnm.read(0x6061) == PT


@pytest.mark.parametrize("eds", [MNM, COMPAX3])
def test_the_mode_cannot_be_changed_while_enabled(eds: Path) -> None:
    rig = Rig(SMOOTH, eds=eds)
    enable(rig, PT)
    assert refusal(rig, 0x6060, HM) == DEVICE_STATE
    rig.write(0x6040, 0x10F)
    assert refusal(rig, 0x6060, HM) == DEVICE_STATE


@pytest.mark.parametrize("method", [17, 37, 3])
def test_unsupported_homing_methods_are_rejected(mnm: Rig, method: int) -> None:
    assert refusal(mnm, 0x6098, method) == INVALID


@pytest.mark.parametrize(
    ("eds", "lacking"),
    [
        (MNM, (0x6076, 0x608F, 0x60B2, 0x60B8, 0x60BA, 0x60C1, 0x2F00, 0x60E0, 0x605B)),
        (COMPAX3, (0x6502, 0x60B2, 0x60B8, 0x60B9, 0x60C1, 0x2F00, 0x60E0)),
    ],
)
def test_objects_that_a_drive_lacks_cannot_be_read(eds: Path, lacking: tuple[int, ...]) -> None:
    rig = Rig(SMOOTH, eds=eds)
    for index in lacking:
        with pytest.raises(SdoRefusedError) as caught:
            rig.read(index)
        assert caught.value.code == NO_OBJECT, f"{index:04X}h"


def test_pdos_have_two_entries_and_the_mode_cannot_be_mapped(mnm: Rig) -> None:
    mnm.write(0x1800, 0x80000180 | NODE, 1)
    mnm.write(0x1A00, 0)
    assert refusal(mnm, 0x1A00, 0x60610008, 1) == NOT_MAPPABLE
    for sub, entry in enumerate((0x60410010, 0x60640020), 1):
        mnm.write(0x1A00, entry, sub)
    with pytest.raises(SdoRefusedError):
        mnm.read(0x1A00, 3)
    assert refusal(mnm, 0x1A00, 3) == TOO_HIGH
    mnm.write(0x1A00, 2)
    assert mnm.read(0x1A00) == 2


def test_statusword_has_manufacturer_bits_and_no_voltage_enabled(mnm: Rig) -> None:
    word = mnm.read(0x6041)
    assert word & 0x4100 == 0x4100
    enable(mnm, PT)
    assert mnm.read(0x6041) & 0x4110 == 0x4100, "voltage enabled is not reported"


def test_a_drive_without_profile_is_simulated_as_a_standard_drive(tmp_path: Path) -> None:
    """It has the objects of its EDS, torque in per mille, all modes and no quirks."""
    eds = tmp_path / "my-own.eds"
    eds.write_text(COMPAX3.read_text().replace("0x0000C321", "0x00000001"))
    rig = Rig(SMOOTH, eds=eds)
    enable(rig, CST)
    assert turn(rig, 200)[0] == pytest.approx(0.6 * 1.04, rel=0.005)
    rig.write(0x6060, PT)
    rig.run(0.02)
    assert rig.read(0x6061) == PT
    assert rig.read(0x6041) & 0x10
    with pytest.raises(SdoRefusedError):
        rig.read(0x6502)


def test_a_lost_master_stops_a_drive_whose_eds_lacks_the_options(mnm: Rig) -> None:
    """The firmware has internal objects that its EDS lacks."""
    mnm.write(0x1016, 127 << 16 | 200, 1)
    mnm.write(0x6007, 3)
    mnm.send(0x700 + 127, bytes([5]))
    mnm.write(0x6040, HALT)
    mnm.write(0x6060, PT)
    mnm.run(0.03)
    for word in (6, 7, 15):
        mnm.send(0x700 + 127, bytes([5]))
        mnm.write(0x6040, word)
        mnm.run(0.1)
    assert mnm.read(0x6041) & 0x6F == 0x27
    mnm.run(0.5)
    assert mnm.read(0x6041) & 0x4F == 0x40
    assert 0x8130 in [code for code, _ in mnm.emergencies]
