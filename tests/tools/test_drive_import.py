"""`cdpr drive import` writes profiles from valid and flawed data sheets."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import canopen
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cdpr_profiles
from cdpr_profiles import ProfileError, load_drive
from cdpr_profiles.eds import load_dictionary, read_eds
from cdpr_tools.command_group import load
from cdpr_tools.commands.drive_import import propose
from cdpr_tools.errors import BAD_INPUT, CommandError
from tests.hil.profile_rig import DRIVES

GENERIC = load_drive("generic-cia402")
TEXT = GENERIC.eds.read_text()


COMMAND = load("groups", "drive")


def cdpr(*arguments: str | Path) -> tuple[int, str, str]:
    """Run the command. Return exit status, text and error like `cdpr`."""
    out = io.StringIO()
    try:
        with redirect_stdout(out):
            COMMAND.main([str(word) for word in arguments], standalone_mode=False)
    except (CommandError, ProfileError) as error:
        status = error.exit_status if isinstance(error, CommandError) else BAD_INPUT
        return status, out.getvalue(), str(error)
    return 0, out.getvalue(), ""


def imported(file: Path, out: Path, *more: str) -> dict[str, Any]:
    status, text, errors = cdpr("import", file, "--out", out, "--json", *more)
    assert status == 0, errors
    return dict(json.loads(text.splitlines()[-1]))


def refused(text: str, tmp_path: Path) -> str:
    path = tmp_path / "odd.eds"
    path.write_text(text)
    status, _, errors = cdpr("import", path, "--out", tmp_path / "out")
    assert status == 2, errors
    assert not (tmp_path / "out").exists()
    return errors


def without(index: str, text: str = TEXT) -> str:
    """Return the data sheet without the sections of an object."""
    kept, skipping = [], False
    for line in text.splitlines():
        if line.startswith("["):
            skipping = line.lower().startswith(f"[{index.lower()}")
        if not skipping:
            kept.append(line)
    return "\n".join(kept)


def with_key(section: str, key: str, value: str, text: str = TEXT) -> str:
    head, found, tail = text.partition(f"[{section}]\n")
    assert found
    body, gap, rest = tail.partition("\n\n")
    lines = [line for line in body.splitlines() if not line.startswith(f"{key}=")]
    return head + found + "\n".join([*lines, f"{key}={value}"]) + gap + rest


def test_importing_the_generic_drive_gives_the_shipped_profile(tmp_path: Path) -> None:
    told = imported(GENERIC.eds, tmp_path, "--name", "mine")
    drive = load_drive(tmp_path / "mine.toml")
    assert drive.eds == (tmp_path / "mine.eds").resolve()
    assert drive.eds.read_bytes() == GENERIC.eds.read_bytes()
    same = ("vendor_id", "product_code", "revision", "supported_modes", "mode_torque")
    for key in (*same, "homing_methods", "rpdos", "tpdos", "torque_unit", "heartbeat_consumer_s"):
        assert getattr(drive, key) == getattr(GENERIC, key), key
    assert told["remarks"] == []
    assert set(told["facts"]) == set(drive.verified)
    assert {fact["status"] for fact in told["facts"].values()} == {"manual", "assumed"}
    unknown = " ".join(one["what"] for one in told["unknown"])
    for what in ("position_sign", "torque_sign", "homing_sign", "feedback_delay_s", "torque_unit"):
        assert what in unknown
        assert told["facts"][what]["status"] == "assumed"
    assert all(one["why"] and one["how"] for one in told["unknown"])


@pytest.mark.parametrize("name", ["mnm-profile-torque", "parker-compax3-canopen"])
def test_the_other_shipped_drives_can_be_imported(name: str, tmp_path: Path) -> None:
    shipped = load_drive(name)
    imported(shipped.eds, tmp_path)
    drive = load_drive(tmp_path / f"{name}.toml")
    for key in ("vendor_id", "product_code", "revision", "supported_modes", "mode_torque"):
        assert getattr(drive, key) == getattr(shipped, key)
    mapped = {entry.index for pdo in drive.tpdos for entry in pdo.entries}
    assert {0x6041, 0x6064, 0x6077} <= mapped


def test_the_text_lists_facts_and_gaps(tmp_path: Path) -> None:
    status, text, _ = cdpr("import", GENERIC.eds, "--out", tmp_path)
    assert status == 0
    assert "vendor_id               00CD9A01h" in text
    assert "Not in the file:" in text
    assert "to find out: `cdpr drive jog WINCH" in text
    status, _, errors = cdpr("import", GENERIC.eds, "--out", tmp_path)
    assert status == 2
    assert "generic-cia402.toml: already exists; choose another --name or --out" in errors


def test_a_dcf_gives_the_values_of_the_winch(tmp_path: Path) -> None:
    dcf = tmp_path / "Drive 5.DCF"
    text = TEXT + "\n[DeviceComissioning]\nNodeID=5\nBaudrate=500\n"
    text = with_key("1800sub1", "ParameterValue", "0x405", text)
    dcf.write_text(
        with_key("6502", "ParameterValue", "0x28", text)
    )  # profile torque and homing only
    told = imported(dcf, tmp_path / "out")
    assert (told["node_id"], told["bitrate_bit_s"]) == (5, 500_000)
    drive = load_drive(tmp_path / "out" / "drive-5.toml")
    assert drive.tpdos[0].cob_id_offset == 0x400
    assert (drive.supported_modes, drive.mode_torque) == ((4, 6), 4)
    assert drive.torque_slope_Nm_s == 3000.0
    assert "torque_slope_Nm_s (6087h)" in [one["what"] for one in told["unknown"]]


def test_the_torque_slope_is_the_steepest_within_limits(tmp_path: Path) -> None:
    text = with_key("6087", "HighLimit", "2000000", with_key("6502", "DefaultValue", "0x28"))
    path = tmp_path / "slope.eds"
    path.write_text(with_key("6076", "DefaultValue", "5000", text))
    told = imported(path, tmp_path / "out")
    fact = told["facts"]["torque_slope_Nm_s"]
    assert (fact["value"], fact["status"]) == (10_000.0, "manual")


def test_flaws_are_reported_and_the_copy_is_unchanged(tmp_path: Path) -> None:
    path = tmp_path / "odd.eds"
    text = with_key("6077", "AccessType", "readonly", TEXT) + "\n[6041]\nParameterName=Again\n"
    text = text.replace("ProductName=Generic", "ProductName=Gerät")
    path.write_bytes(text.replace("BaudRate_10=1", "BaudRate_10=yes").encode("cp1252"))
    told = imported(path, tmp_path / "out")
    remarks = "\n".join(told["remarks"])
    assert "read as Windows-1252" in remarks
    assert "[6041]: appears twice" in remarks
    assert "[6077] AccessType: value 'readonly'; allowed: ro, wo, rw" in remarks
    assert "[DeviceInfo] BaudRate_10: value 'yes'; allowed: a number" in remarks
    drive = load_drive(tmp_path / "out" / "odd.toml")
    assert "Gerät" in drive.name
    assert drive.eds.read_bytes() == path.read_bytes()
    assert len(load_dictionary(drive.eds, 3)) == len(load_dictionary(GENERIC.eds, 3))


def test_a_profile_beside_its_eds_makes_no_copy(tmp_path: Path) -> None:
    path = tmp_path / "odd.eds"
    path.write_text(TEXT + "\n[6041]\nParameterName=Again\n")
    told = imported(path, tmp_path)
    assert Path(told["eds"]) == load_drive(tmp_path / "odd.toml").eds == path
    assert sorted(tmp_path.iterdir()) == [path, tmp_path / "odd.toml"]


@pytest.mark.parametrize("suffix", [".eds", ".dcf"])
def test_a_data_sheet_written_by_the_canopen_library_is_imported(
    suffix: str, tmp_path: Path
) -> None:
    path = tmp_path / f"theirs{suffix}"
    od = canopen.import_od(str(GENERIC.eds), 5)
    od.node_id, od.bitrate = 5, 250_000
    canopen.export_od(od, str(path))
    told = imported(path, tmp_path / "out")
    assert told["remarks"] == []
    drive = load_drive(tmp_path / "out" / "theirs.toml")
    assert (drive.rpdos, drive.tpdos) == (GENERIC.rpdos, GENERIC.tpdos)
    wanted = (5, 250_000) if suffix == ".dcf" else (None, None)
    assert (told["node_id"], told["bitrate_bit_s"]) == wanted


def flaws_tolerated(text: str) -> str:
    """Return a data sheet with an object that no reader understands."""
    return text + "\n[6041]\nParameterName=Zustand für alle\n"


def without_counts(text: str) -> str:
    """Return one without a serial number or mapping counts; 1016h has a limit for its time only."""
    text = without("1018sub4", text)
    for number in range(4):
        for base in ("160", "1A0"):
            text = with_key(f"{base}{number}sub0", "DefaultValue", "", text)
    return with_key("1016sub1", "HighLimit", "65535", text)


def identity_in_device_info(text: str) -> str:
    """Return one with its identity in [DeviceInfo] only, that announces no mode of operation."""
    for sub in (1, 2, 3):
        text = with_key(f"1018sub{sub}", "DefaultValue", "", text)
    return with_key("6502", "DefaultValue", "0", text)


def fixed_identifiers(text: str) -> str:
    """Return one whose COB-IDs cannot be written; its maps are empty."""
    for number in range(4):
        for base in ("140", "180"):
            text = with_key(f"{base}{number}sub1", "AccessType", "ro", text)
        for base in ("160", "1A0"):
            text = with_key(f"{base}{number}sub0", "DefaultValue", "0", text)
    return text


def unsigned(text: str) -> str:
    """Return one with signed objects declared unsigned, and a wrong device type."""
    for index, data_type in (("6064", "0x0007"), ("6071", "0x0006"), ("6077", "0x0006")):
        text = with_key(index, "DataType", data_type, text)
        text = with_key(index, "LowLimit", "", with_key(index, "HighLimit", "", text))
    return with_key("1000", "DefaultValue", "0x00220811", text)


def jogged(winch: Path) -> tuple[int, str]:
    """Turn the motor of a simulated drive; return the command's exit status and error."""
    words = ("drive", "jog", str(winch), "--bus", "simbus:", "--speed-deg-s", "-60")
    ended = subprocess.run(
        [sys.executable, "-m", "cdpr_tools.cli", *words, "--seconds", "0.3", "--json"],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    if ended.returncode == 0:
        assert json.loads(ended.stdout.splitlines()[-1])["moved_deg"] < -15.0
    return ended.returncode, ended.stderr


def winch_with(drive: str, folder: Path) -> Path:
    shipped = (Path(cdpr_profiles.__file__).parent / "winches" / "winch-mpp0923d.toml").read_text()
    assert 'drive = "generic-cia402"' in shipped
    path = folder / "winch.toml"
    path.write_text(shipped.replace('drive = "generic-cia402"', f'drive = "{drive}"'))
    return path


SHIPPED = {path.stem for path in (Path(cdpr_profiles.__file__).parent / "drives").glob("*.toml")}


@pytest.mark.parametrize("name", sorted(SHIPPED.difference(DRIVES)))
def test_every_shipped_drive_turns_its_simulated_motor(name: str, tmp_path: Path) -> None:
    status, problem = jogged(winch_with(name, tmp_path))
    assert status == 0, problem


@pytest.mark.parametrize(
    "spoil",
    [flaws_tolerated, without_counts, identity_in_device_info, fixed_identifiers, unsigned],
)
def test_a_drive_with_an_odd_data_sheet_is_imported_and_turns_its_motor(
    spoil: Callable[[str], str], tmp_path: Path
) -> None:
    path = tmp_path / "odd.eds"
    path.write_bytes(spoil(TEXT).encode("cp1252"))
    imported(path, tmp_path / "mine")
    status, problem = jogged(winch_with("odd", tmp_path / "mine"))
    assert status == 0, problem


def test_a_drive_that_counts_in_other_units_runs_and_the_boot_names_a_wrong_unit(
    tmp_path: Path,
) -> None:
    """The simulated drive of this vendor id has 6076h in uNm and velocities in rpm."""
    text = with_key("1018sub1", "DefaultValue", "0xFB")
    text += "\n[60A9]\nParameterName=SI unit velocity\nObjectType=0x7\nDataType=0x0007\n"
    path = tmp_path / "micro.eds"
    path.write_text(text + "AccessType=rw\nDefaultValue=0x00B44700\nPDOMapping=0\n")
    facts = imported(path, tmp_path)["facts"]
    assert facts["rated_torque_unit"]["value"] == "uNm"
    assert facts["velocity_unit"]["value"] == "rpm"
    winch, profile = winch_with("micro", tmp_path), tmp_path / "micro.toml"
    status, problem = jogged(winch)
    assert status == 0, problem
    right = profile.read_text()
    profile.write_text(right.replace('rated_torque_unit = "uNm"', 'rated_torque_unit = "mNm"'))
    status, problem = jogged(winch)
    assert status == 1
    assert 'the drive seems to count in uNm: write rated_torque_unit = "uNm"' in problem
    profile.write_text(right.replace('velocity_unit = "rpm"', 'velocity_unit = "counts_per_s"'))
    status, problem = jogged(winch)
    assert status == 1
    assert "its velocity unit (60A9h) is rpm" in problem
    assert 'write velocity_unit = "rpm" into the profile' in problem


def test_a_drive_with_torques_of_32_bits_in_mA_is_imported_and_turns_its_motor(
    tmp_path: Path,
) -> None:
    """The simulated drive of this vendor id has 6071h and 6077h in mA of the motor's current."""
    text = with_key("1018sub1", "DefaultValue", "0x286")
    for index in ("6071", "6077"):
        text = with_key(index, "DataType", "0x0004", text)
        text = with_key(index, "LowLimit", "", with_key(index, "HighLimit", "", text))
    path = tmp_path / "ampere.eds"
    path.write_text(text)
    facts = imported(path, tmp_path)["facts"]
    assert facts["torque_unit"]["value"] == "mA_rms"
    torques = [
        entry["bits"]
        for pdos in ("rpdos", "tpdos")
        for pdo in facts[pdos]["value"]
        for entry in pdo["entries"]
        if entry["index"] in (0x6071, 0x6077)
    ]
    assert torques == [32, 32]
    winch = winch_with("ampere", tmp_path)
    status, problem = jogged(winch)
    assert status == 0, problem


def test_pdo_maps_are_proposed_if_the_defaults_do_not_suffice(tmp_path: Path) -> None:
    text = TEXT
    for number in range(4):
        for base in ("160", "1A0"):
            text = with_key(f"{base}{number}sub0", "DefaultValue", "0", text)
    path = tmp_path / "empty-maps.eds"
    path.write_text(text)
    told = imported(path, tmp_path / "out")
    drive = load_drive(tmp_path / "out" / "empty-maps.toml")
    assert drive.rpdos == GENERIC.rpdos
    assert drive.tpdos == GENERIC.tpdos
    assert told["facts"]["rpdos"]["status"] == "assumed"
    assert any("step J" in one["how"] for one in told["unknown"])


def test_empty_places_after_a_pdo_map_do_not_matter(tmp_path: Path) -> None:
    path = tmp_path / "compact.eds"
    path.write_text(with_key("1A00sub0", "DefaultValue", "8", TEXT))
    told = imported(path, tmp_path / "out")
    assert load_drive(tmp_path / "out" / "compact.toml").tpdos == GENERIC.tpdos
    assert told["facts"]["tpdos"]["status"] == "manual"


def test_small_fixed_pdo_maps_are_combined(tmp_path: Path) -> None:
    text = TEXT
    for number, entries in enumerate((["0x60410010"], ["0x60640020"], ["0x60770010"], [])):
        text = with_key(f"1A0{number}sub0", "AccessType", "ro", text)
        text = with_key(f"1A0{number}sub0", "DefaultValue", str(len(entries)), text)
        for sub, entry in enumerate(entries, 1):
            text = with_key(f"1A0{number}sub{sub}", "DefaultValue", entry, text)
    path = tmp_path / "small.eds"
    path.write_text(text)
    imported(path, tmp_path / "out")
    tpdos = load_drive(tmp_path / "out" / "small.toml").tpdos
    assert [[entry.index for entry in pdo.entries] for pdo in tpdos] == [
        *([0x6041], [0x6064], [0x6077])
    ]


def test_a_drive_without_objects_for_torque_control_is_rejected(tmp_path: Path) -> None:
    assert "[6071]: is missing; torque control needs it" in refused(without("6071"), tmp_path)
    assert "[1018]: is missing; every CANopen device" in refused(without("1018"), tmp_path)
    assert "[6060]: is missing; without it no mode" in refused(without("6060"), tmp_path)
    spoilt = with_key("6040", "DataType", "0x0Z")
    told = refused(spoilt, tmp_path)
    assert "[6040]: is missing; torque control needs it" in told
    assert "[6040] DataType: value '0x0Z'; allowed: a type of CiA 301" in told
    told = refused(with_key("6064", "DataType", "0x0003"), tmp_path)
    assert "[6064] DataType: value 0x0003 has 16 bits; allowed: one of 32 bits" in told
    told = refused(with_key("6502", "DefaultValue", "0x21"), tmp_path)
    assert (
        "[6502] DefaultValue: value 0x21 has only the modes 1, 6; allowed: a drive with mode 4"
        in told
    )


def test_a_drive_whose_pdo_maps_cannot_contain_torque_is_rejected(tmp_path: Path) -> None:
    text = TEXT
    for number in range(4):
        text = with_key(f"160{number}sub0", "DefaultValue", "0", text)
    told = refused(with_key("6071", "PDOMapping", "0", text), tmp_path)
    assert "RPDO: no RPDO can carry 6040h, 6071h" in told
    assert "[6071] PDOMapping is not 1" in told
    fixed = with_key("6071", "PDOMapping", "0", text)
    for number in range(4):
        fixed = with_key(f"140{number}sub2", "AccessType", "ro", fixed)
    told = refused(fixed, tmp_path)
    assert "[1403sub2] AccessType does not allow writing transmission type 1 (every SYNC)" in told
    assert "; [6071] PDOMapping is not 1" in told
    for number in range(4):
        text = with_key(f"160{number}sub0", "AccessType", "ro", text)
    assert "the maps are fixed" in refused(text, tmp_path)
    for number in range(4):
        text = without(f"140{number}", text)
    assert "the file describes no RPDO" in refused(text, tmp_path)


def test_missing_objects_are_listed_with_their_consequence(tmp_path: Path) -> None:
    text = TEXT
    for index in ("1016", "1017", "60E3", "6502", "6076", "60B8", "60B9", "60BA"):
        text = without(index, text)
    path = tmp_path / "poor.eds"
    path.write_text(text)
    told = imported(path, tmp_path / "out")
    unknown = {one["what"]: one["why"] for one in told["unknown"]}
    assert "detect the loss of the master" in unknown["1016h is not in the EDS"]
    assert "step K" in unknown["1017h is not in the EDS"]
    assert {"homing methods", "modes of operation"} <= set(unknown)
    assert any("touch probe" in what for what in unknown)
    assert any("maps 60B9h:0 with 16 bits, but the file" in text for text in told["remarks"])
    assert told["facts"]["homing_methods"] == {
        **{
            "value": [33, 34],
            "status": "assumed",
            "how": "those of the standard that end at the index",
        }
    }
    assert told["facts"]["supported_modes"]["status"] == "assumed"


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("nothing.eds",), "nothing.eds: cannot be read: No such file"),
        (("drive.xdd",), "drive.xdd: allowed: a file *.eds or *.dcf"),
        ((str(GENERIC.eds), "--name", "a/b"), "--name a/b: allowed"),
    ],
)
def test_wrong_arguments_are_reported(arguments: tuple[str, ...], problem: str) -> None:
    status, _, errors = cdpr("import", *arguments)
    assert status == 2
    assert problem in errors


SECTIONS = TEXT.split("\n[")
VALUES = st.sampled_from(
    ["", "0", "1", "-1", "0x7", "0x0005", "0x001B", "0xFFFFFFFF", "$NODEID+0x200", "rw", "ro", "?"]
) | st.text(max_size=6)


@pytest.mark.long
@settings(max_examples=40)
@given(data=st.data())
def test_a_mutated_data_sheet_gives_a_profile_or_a_clear_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    sections = list(SECTIONS)
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(1, len(sections) - 1))
        change = data.draw(st.sampled_from(["drop", "twice", "value", "value", "value"]))
        if change == "drop" and len(sections) > 2:
            del sections[at]
        elif change == "twice":
            sections.append(sections[at])
        else:
            lines = sections[at].splitlines()
            line = data.draw(st.integers(0, len(lines) - 1))
            lines[line] = lines[line].partition("=")[0] + "=" + data.draw(VALUES)
            sections[at] = "\n".join(lines)
    folder = tmp_path_factory.getbasetemp()
    path = folder / "mutated.eds"
    path.write_text("\n[".join(sections), encoding="utf-8", errors="replace")
    try:
        eds = read_eds(path)
        made = propose(eds)
    except ProfileError as error:
        assert str(path) in str(error)
        return
    for pdo in (*made.table["rpdos"], *made.table["tpdos"]):
        assert sum(entry["bits"] for entry in pdo["entries"]) <= 64
        assert all(entry["index"] in eds.od for entry in pdo["entries"])
    assert made.table["mode_torque"] in made.table["supported_modes"]
