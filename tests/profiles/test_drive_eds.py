"""The EDS files of the shipped drives are well formed and agree with the drive profiles."""

from collections.abc import Iterator
from configparser import RawConfigParser

import canopen
import pytest
from canopen.objectdictionary import ODVariable

from cdpr_profiles import DriveProfile, load_drive, load_motor

NAMES = ("generic-cia402", "mnm-profile-torque", "parker-compax3-canopen")
"""Drives with an EDS of our own; those made from data sheets keep the gaps of these."""
NODE_ID = 5
GENERIC = load_drive("generic-cia402")


@pytest.fixture(scope="module", params=NAMES)
def drive(request: pytest.FixtureRequest) -> DriveProfile:
    return load_drive(request.param)


@pytest.fixture(scope="module")
def od(drive: DriveProfile) -> canopen.ObjectDictionary:
    return canopen.import_od(str(drive.eds), NODE_ID)


@pytest.fixture(scope="module")
def generic() -> canopen.ObjectDictionary:
    return canopen.import_od(str(GENERIC.eds), NODE_ID)


@pytest.fixture(scope="module")
def variables(od: canopen.ObjectDictionary) -> list[ODVariable]:
    return [v for o in od.values() for v in ([o] if isinstance(o, ODVariable) else o.values())]


def _mappings(od: canopen.ObjectDictionary) -> Iterator[int]:
    return (i for i in od if 0x1600 <= i < 0x1800 or 0x1A00 <= i < 0x1C00)


def test_the_profiles_pdos_can_be_mapped(drive, od):
    for base, pdos in ((0x1400, drive.rpdos), (0x1800, drive.tpdos)):
        for pdo in pdos:
            mapping = od[base + 0x1FF + pdo.number]
            assert od[base + pdo.number - 1][1].access_type == "rw"
            assert len(pdo.entries) <= len(mapping) - 1
            for entry in pdo.entries:
                mapped = od.get_variable(entry.index, entry.subindex)
                assert mapped is not None, f"{entry.index:04X}h"
                assert mapped.pdo_mappable, f"{entry.index:04X}h"
                assert len(mapped) == entry.bits
                assert mapped.writable if base == 0x1400 else mapped.readable


def test_each_default_mapping_names_a_mappable_object_of_the_right_length(od):
    for index in _mappings(od):
        total = 0
        for sub in range(1, od[index][0].default + 1):
            entry = od[index][sub].default
            mapped = od.get_variable(entry >> 16, entry >> 8 & 0xFF)
            assert mapped is not None
            assert mapped.pdo_mappable
            assert len(mapped) == entry & 0xFF
            if index < 0x1A00:
                assert mapped.writable
            total += entry & 0xFF
        assert 0 < total <= 64


def test_default_pdos_have_the_predefined_identifiers(od):
    for base, first in ((0x1400, 0x200), (0x1800, 0x180)):
        for number in range(4):
            cob_id = od[base + number][1].default
            assert cob_id & 0x7FF == first + 0x100 * number + NODE_ID


def test_defaults_lie_within_their_limits(variables):
    for v in variables:
        if v.min is not None or v.max is not None:
            assert v.min <= v.default <= v.max, f"{v.index:04X}h:{v.subindex}"


def test_all_objects_but_domains_have_a_default(variables):
    for v in variables:
        if v.data_type != canopen.objectdictionary.DOMAIN:
            assert v.default is not None, f"{v.index:04X}h:{v.subindex}"


def test_each_eds_has_the_objects_the_master_needs(od):
    needed = (0x1017, 0x603F, 0x6040, 0x6041, 0x605A, 0x6007, 0x6060, 0x6061, 0x6064, 0x6071)
    assert not [
        f"{i:04X}h" for i in (*needed, 0x6072, 0x6077, 0x6098, 0x6099, 0x609A) if i not in od
    ]


def test_a_torque_slope_fits_its_object(drive, od):
    if drive.torque_slope_Nm_s is not None:
        unit = {"mNm": 1e-3, "cNm": 1e-2, "per_mille_of_rated": 3e-3, "percent_of_rated": 3e-2}
        slope = drive.torque_slope_Nm_s / unit[drive.torque_unit]
        assert od[0x6087].min <= slope <= od[0x6087].max


def test_defaults_of_the_generic_drive_fit_the_motor(generic):
    od = generic
    motor = load_motor("MPP0923D")
    assert od[0x6076].default == round(motor.rated_torque_Nm * 1000)
    assert od[0x6075].default == round(motor.rated_current_Arms * 1000)
    assert od[0x6072].default == round(1000 * motor.peak_torque_Nm / motor.rated_torque_Nm)
    assert od[0x6073].default == pytest.approx(
        1000 * motor.peak_current_Arms / motor.rated_current_Arms, abs=1
    )
    assert od[0x6080].default == round(motor.rated_speed_rpm)
    per_turn = od[0x608F][1].default / od[0x608F][2].default
    assert od[0x607F].default == pytest.approx(motor.rated_speed_rpm / 60 * per_turn, rel=1e-4)
    assert od[0x6092][1].default == per_turn


def test_object_lists_and_counts_agree_with_the_sections(drive):
    eds = RawConfigParser(inline_comment_prefixes=(";",))
    eds.optionxform = str
    eds.read(drive.eds)
    listed: list[str] = []
    for section in ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"):
        count = eds.getint(section, "SupportedObjects")
        listed += [eds.get(section, str(i + 1))[2:] for i in range(count)]
        assert len(eds.options(section)) == count + 1
    objects = [s for s in eds.sections() if len(s) == 4]
    assert sorted(listed) == sorted(objects)
    for name in objects:
        subs = [s for s in eds.sections() if s.startswith(name + "sub")]
        assert eds.getint(name, "SubNumber", fallback=0) == len(subs)
        if subs:
            highest = int(eds.get(name + "sub0", "DefaultValue"))
            last = max(int(s[7:], 16) for s in subs)
            assert highest <= last
    assert eds.getint("Comments", "Lines") == len(eds.options("Comments")) - 1
    assert eds.get("FileInfo", "FileName") == drive.eds.name
