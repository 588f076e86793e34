"""EDS and DCF files of manufacturers are read; flaws are remarked on; other files are rejected."""

from __future__ import annotations

from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODVariable
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_profiles import ProfileError, load_drive
from cdpr_profiles.eds import DataSheet, integer, load_dictionary, read_eds

GENERIC = load_drive("generic-cia402").eds
FIELDS = (
    *("name", "data_type", "access_type", "pdo_mappable", "min", "max", "default"),
    *("relative", "value"),
)

HEAD = """[DeviceInfo]
VendorNumber=0x1F
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[OptionalObjects]
SupportedObjects=0
[ManufacturerObjects]
SupportedObjects=0
"""
MANDATORY = """[1000]
ParameterName=Device type
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
[1001]
ParameterName=Error register
DataType=0x0005
AccessType=ro
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Count
DataType=0x0005
AccessType=ro
DefaultValue=1
[1018sub1]
ParameterName=Vendor
DataType=0x0007
AccessType=ro
DefaultValue=0x1F
"""


def write(tmp_path: Path, text: str | bytes) -> Path:
    path = tmp_path / "drive.eds"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def variable(index: str, **keys: str) -> str:
    usual = {"ParameterName": "Odd", "DataType": "0x0003", "AccessType": "rw"} | keys
    lines = [f"{key}={value}" for key, value in usual.items() if value]
    return "\n".join([f"[{index}]", *lines, ""])


def read(tmp_path: Path, more: str = "") -> tuple[DataSheet, str]:
    eds = read_eds(write(tmp_path, HEAD + MANDATORY + more))
    return eds, "\n".join(eds.remarks.texts)


def contents(od: canopen.ObjectDictionary) -> dict[tuple[int, int], tuple[object, ...]]:
    variables = (
        one for o in od.values() for one in ([o] if isinstance(o, ODVariable) else o.values())
    )
    return {(v.index, v.subindex): tuple(getattr(v, key) for key in FIELDS) for v in variables}


@pytest.mark.parametrize("name", ["generic-cia402", "mnm-profile-torque", "parker-compax3-canopen"])
def test_a_flawless_file_is_read_as_by_the_canopen_package(name: str) -> None:
    path = load_drive(name).eds
    ours, theirs = load_dictionary(path, 5), canopen.import_od(str(path), 5)
    assert read_eds(path).remarks.texts == []
    assert contents(ours) == contents(theirs)
    assert {i: type(ours[i]) for i in ours} == {i: type(theirs[i]) for i in theirs}
    assert ours.device_information.allowed_baudrates == theirs.device_information.allowed_baudrates
    assert ours[0x1800][1].default & 0x7FF == 0x185


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("10", 10),
        ("0x0A", 10),
        ("0XfF", 255),
        ("010", 8),
        ("09", 9),
        ("-3", -3),
        ("-0x10", -16),
        (" 7 ", 7),
        ("", None),
        ("1_0", None),
        ("0x", None),
        ("1.5", None),
        ("60FFh", None),
        ("٣", None),
        ("9" * 50, None),
    ],
)
def test_integers_are_decimal_hexadecimal_or_octal(text: str, value: int | None) -> None:
    assert integer(text) == value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("$NODEID+0x180", 0x185),
        ("$NodeId + 384", 0x185),
        ("0x600+$NODEID", 0x605),
        ("$NODEID", 5),
        ("0x180", 0x180),
        ("$NODEID*2", None),
        ("$NODEID+", None),
        ("$NODE+1", None),
    ],
)
def test_expressions_with_the_node_id_are_evaluated(
    tmp_path: Path, text: str, value: int | None
) -> None:
    more = variable("2000", DataType="0x0007", DefaultValue=text)
    found = load_dictionary(write(tmp_path, HEAD + MANDATORY + more), 5)[0x2000]
    assert found.default == value
    assert found.relative == ("$N" in text and value is not None)


@pytest.mark.parametrize(
    ("more", "remark"),
    [
        (variable("2000", DataType="0x00ZZ"), "[2000] DataType: value '0x00ZZ'; allowed"),
        (variable("2000", DataType=""), "[2000] DataType: is missing"),
        (variable("2000", DataType="0x0040"), "[2000] DataType: value '0x0040' is not a type"),
        (variable("2000", AccessType="r/w"), "[2000] AccessType: value 'r/w'; allowed: ro, wo"),
        (variable("2000", PDOMapping="yes"), "[2000] PDOMapping: value 'yes'; allowed: 0, 1"),
        (variable("2000", DefaultValue="lots"), "[2000] DefaultValue: value 'lots'; allowed"),
        (variable("2000", DefaultValue="70000"), "'70000'; allowed: -32768 to 32767; left out"),
        (variable("2000", LowLimit="5", HighLimit="-5"), "[2000] LowLimit: value 5 is above"),
        (variable("2000", ObjectType="0x77"), "[2000] ObjectType: value '0x77'; allowed"),
        (variable("2000", ParameterName=""), "[2000] ParameterName: is missing"),
        (variable("2000sub1"), "[2000sub1]: no section [2000] describes it; left out"),
        (variable("2000") + variable("2000sub1"), "2000h is a variable, without sub-indices"),
        (variable("2000") + variable("2000", DataType="5"), "[2000]: appears twice"),
        ("[2000\nParameterName=x\n", "'[2000' is not a section; left out with its keys"),
        ("some words\n", "'some words' is not KEY=VALUE; left out"),
        ("[DeviceComissioning]\nNodeID=200\n", "NodeID: value '200'; allowed: 1 to 127"),
        ("[DeviceComissioning]\nBaudrate=501\n", "Baudrate: value '501'; allowed: 10, 20"),
        (variable("2000", DataType="0x0008", DefaultValue="nan"), "allowed: a number; left out"),
    ],
)
def test_remark_on_a_flaw_names_section_key_value_and_allowed_values(
    tmp_path: Path, more: str, remark: str
) -> None:
    eds, remarks = read(tmp_path, more)
    assert remark in remarks
    assert eds.od[0x1018][1].default == 0x1F


def test_signed_numbers_may_be_given_as_unsigned_hexadecimal(tmp_path: Path) -> None:
    eds, _ = read(tmp_path, variable("2000", DefaultValue="0xFFFF", LowLimit="0x8000"))
    assert (eds.od[0x2000].default, eds.od[0x2000].min) == (-1, -32768)


def test_a_subrange_type_is_read_as_its_base_type(tmp_path: Path) -> None:
    eds, remarks = read(
        tmp_path, variable("A0sub1", DefaultValue="0x3") + variable("2000", DataType="0xA0")
    )
    assert eds.od[0x2000].data_type == 3
    assert remarks == ""


def test_compact_pdos_and_compact_arrays_are_expanded(tmp_path: Path) -> None:
    head = HEAD.replace(
        "VendorNumber=0x1F", "VendorNumber=0x1F\nCompactPDO=0x3\nNrOfRXPDO=1\nNrOfTXPDO=5"
    )
    array = variable("2100", ObjectType="0x8", CompactSubObj="3", DefaultValue="7")
    array += "[2100Name]\nNrOfEntries=1\n2=Second\n[2100Value]\nNrOfEntries=1\n3=9\n"
    od = load_dictionary(write(tmp_path, head + MANDATORY + array), 3)
    subs = [(entry.name, entry.default) for entry in list(od[0x2100].values())[1:]]
    assert subs == [("Odd1", 7), ("Second", 7), ("Odd3", 9)]
    assert od[0x1800][1].default == 0x183
    assert 3 not in od[0x1800]
    assert od[0x1804][1].default == 0x80000000
    assert od[0x1400][1].default == 0x203
    assert [entry.writable for entry in od[0x1A00].values()] == [True] * 9


def test_a_dcf_sets_node_id_bit_rate_and_values(tmp_path: Path) -> None:
    more = "[DeviceComissioning]\nNodeID=0x10\nBaudrate=500\n"
    more += "[1800]\nParameterName=PDO\nObjectType=9\nSubNumber=1\n"
    more += variable("1800sub1", DataType="7", DefaultValue="$NODEID+0x180", ParameterValue="0x290")
    od = read(tmp_path, more + variable("2000", DefaultValue="1", ParameterValue="2"))[0].od
    assert (od.node_id, od.bitrate) == (16, 500_000)
    assert (od[0x2000].value, od[0x1800][1].value, od[0x1800][1].default) == (2, 0x290, 0x180)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252", "latin-1"])
def test_files_not_in_ascii_are_read_and_remarked_on(tmp_path: Path, encoding: str) -> None:
    text = HEAD + MANDATORY.replace("Device type", "Gerätetyp")
    eds = read_eds(write(tmp_path, text.replace("\n", "\r\n").encode(encoding)))
    assert len(eds.remarks.texts) == 1
    assert eds.od[0x1000].name == "Gerätetyp"


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "is not an EDS or DCF: it has no section"),
        (b"\x7fELF\x00\x01\x02" * 50, "is not an EDS or DCF"),
        (b"<xml/>", "is not an EDS or DCF"),
        (HEAD.encode(), r"\[1000\]: is missing; every CANopen device"),
        (
            (
                HEAD + MANDATORY.replace("DataType=0x0007\nAccessType=ro\nDefaultValue=0x0002", "x")
            ).encode(),
            r"\[1000\]: is missing.*\[1000\] DataType: is missing",
        ),
    ],
)
def test_a_file_that_is_no_eds_is_rejected(tmp_path: Path, content: bytes, problem: str) -> None:
    with pytest.raises(ProfileError, match=problem) as told:
        load_dictionary(write(tmp_path, content))
    assert "\n" not in str(told.value)


def test_a_missing_file_or_a_folder_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="cannot be read: No such file"):
        read_eds(tmp_path / "nothing.eds")
    with pytest.raises(ProfileError, match="is not a regular file"):
        load_dictionary(tmp_path)


LINES = (HEAD + MANDATORY + variable("2000", ObjectType="0x8", CompactSubObj="2")).splitlines()
JUNK = st.text(max_size=12) | st.sampled_from(
    ["0x", "$NODEID", "$NODEID+0x180", "-1", "9" * 40, "0xFFFFFFFF", "[", "[1018]", "=", "1=", "%("]
)


@settings(max_examples=100)
@given(data=st.data())
def test_a_damaged_eds_raises_only_profile_errors(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    lines = list(LINES)
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(lines) - 1))
        change = data.draw(st.sampled_from(["drop", "value", "line", "twice", "move"]))
        if change == "drop":
            del lines[at : at + data.draw(st.integers(1, 3))]
        elif change == "value":
            lines[at] = lines[at].partition("=")[0] + "=" + data.draw(JUNK)
        elif change == "line":
            lines.insert(at, data.draw(JUNK))
        elif change == "twice":
            lines[at:at] = lines[at : at + 5]
        else:
            lines.append(lines.pop(at))
        lines = lines or [""]
    encoding = data.draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]))
    path = tmp_path_factory.getbasetemp() / "mutated.eds"
    path.write_bytes("\n".join(lines).encode(encoding, errors="replace"))
    try:
        eds = read_eds(path)
    except ProfileError as error:
        assert str(path) in str(error)
        return
    for found in contents(eds.od).values():
        data_type, default = found[1], found[6]
        assert default is None or isinstance(default, (int, float, str, bytes))
        assert isinstance(data_type, int)
