"""The generic drive's EDS is well formed and says what its profile says."""

import logging
from configparser import RawConfigParser

import canopen
import pytest
from canopen.objectdictionary import ODVariable

from profiles import load_drive, load_motor

DRIVE = load_drive("generic-cia402")
NODE_ID = 5


@pytest.fixture(scope="module")
def od() -> canopen.ObjectDictionary:
    return canopen.import_od(str(DRIVE.eds), NODE_ID)


@pytest.fixture(scope="module")
def variables(od: canopen.ObjectDictionary) -> list[ODVariable]:
    return [v for o in od.values() for v in ([o] if isinstance(o, ODVariable) else o.values())]


def test_the_library_reads_it_without_a_warning(caplog, recwarn):
    with caplog.at_level(logging.DEBUG):
        canopen.import_od(str(DRIVE.eds), NODE_ID)
    assert not caplog.records
    assert not recwarn.list


def test_identity_is_the_profiles(od):
    assert od[0x1018][1].default == DRIVE.vendor_id == od.device_information.vendor_number
    assert od[0x1018][2].default == DRIVE.product_code == od.device_information.product_number
    assert od[0x1018][3].default == DRIVE.revision == od.device_information.revision_number
    assert od[0x1000].default == od[0x67FF].default == 0x00020192


def test_modes_and_homing_methods_are_the_profiles(od):
    bits = {1: 0, 2: 1, 3: 2, 4: 3, 6: 5, 7: 6, 8: 7, 9: 8, 10: 9}
    assert od[0x6502].default == sum(1 << bits[mode] for mode in DRIVE.supported_modes)
    methods = od[0x60E3]
    assert tuple(methods[i].default for i in range(1, methods[0].default + 1)) == (
        DRIVE.homing_methods
    )


def test_default_pdos_are_the_profiles(od):
    for base, pdos in ((0x1400, DRIVE.rpdos), (0x1800, DRIVE.tpdos)):
        for pdo in pdos:
            communication, mapping = od[base + pdo.number - 1], od[base + 0x1FF + pdo.number]
            assert communication[1].default == pdo.cob_id(NODE_ID)
            count = mapping[0].default
            assert [mapping[i].default for i in range(1, count + 1)] == [
                e.mapping for e in pdo.entries
            ]


def test_every_default_mapping_names_a_mappable_object_of_its_length(od):
    for index in (*range(0x1600, 0x1604), *range(0x1A00, 0x1A04)):
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


def test_pdos_beyond_the_profiles_are_switched_off(od):
    for base, pdos in ((0x1400, DRIVE.rpdos), (0x1800, DRIVE.tpdos)):
        for number in range(1, 5):
            off = bool(od[base + number - 1][1].default & 1 << 31)
            assert off == (number not in {pdo.number for pdo in pdos})


def test_defaults_lie_within_their_limits(variables):
    for v in variables:
        if v.min is not None or v.max is not None:
            assert v.min <= v.default <= v.max, f"{v.index:04X}h:{v.subindex}"


def test_writable_objects_that_are_numbers_have_a_default(variables):
    for v in variables:
        if v.data_type != canopen.objectdictionary.DOMAIN:
            assert v.default is not None, f"{v.index:04X}h:{v.subindex}"


def test_defaults_fit_the_motor(od):
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


def test_lists_and_counts_of_the_file_agree_with_its_sections():
    eds = RawConfigParser(inline_comment_prefixes=(";",))
    eds.optionxform = str
    eds.read(DRIVE.eds)
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
