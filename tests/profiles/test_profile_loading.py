"""Shipped profiles load; errors in a file are reported with file, key and value."""

import math
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import cdpr_profiles
from cdpr_profiles import ProfileError
from cdpr_profiles.cable import Cable, CableSeries
from cdpr_profiles.drive import DriveProfile
from cdpr_profiles.motor import Motor, MotorRatings, MotorSeries
from cdpr_profiles.places import KINDS, SERIES, SHIPPED
from cdpr_profiles.rail import RailProfile
from cdpr_profiles.reader import Profile, read_toml_model
from cdpr_profiles.robot import RobotFile
from cdpr_profiles.safety_io import SafetyIoProfile
from cdpr_profiles.tension_sensor import TensionSensors
from cdpr_profiles.winch import WinchFile

MODELS: dict[str, tuple[type[Profile], type[Profile]]] = {
    "motors": (Motor, MotorSeries),
    "drives": (DriveProfile, DriveProfile),
    "cables": (Cable, CableSeries),
    "winches": (WinchFile, WinchFile),
    "robots": (RobotFile, RobotFile),
    "tension_sensors": (TensionSensors, TensionSensors),
    "safety_io": (SafetyIoProfile, SafetyIoProfile),
    "rails": (RailProfile, RailProfile),
}
"""For each kind, the model of a single profile and that of a series."""
FILES = {
    path: MODELS[kind][path.name.endswith(SERIES)]
    for kind in KINDS
    for path in sorted((SHIPPED / kind).glob("*.toml"))
}
repeatable = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
files = st.sampled_from(list(FILES))
JUNK = [-1e6, math.nan, math.inf, "three", True, {}, [[]]]


def _toml(value: Any) -> str:
    """Write a value in TOML's inline form."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml(k)} = {_toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return repr(value)


def _document(table: dict[str, Any]) -> str:
    return "".join(f"{_toml(k)} = {_toml(v)}\n" for k, v in table.items())


def _read(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


def _write(tmp_path: Path, source: Path, table: dict[str, Any]) -> Path:
    path = tmp_path / source.name
    path.write_text(_document(table), encoding="utf-8")
    return path


def test_load_all_holds_every_listed_profile():
    everything = cdpr_profiles.load_all()
    for kind, names in cdpr_profiles.list_profiles().items():
        assert set(names) <= set(everything[kind])
        assert names
    complete = [m for m in everything["motors"].values() if isinstance(m, Motor)]
    assert len(complete) == 14  # 8 MPP and 6 MPJ of size 92
    assert all(isinstance(m, Motor | MotorRatings) for m in everything["motors"].values())


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_a_profile_is_the_same_after_writing_and_reading(path: Path, tmp_path: Path):
    again = _write(tmp_path, path, _read(path))
    assert read_toml_model(again, FILES[path]) == read_toml_model(path, FILES[path])


@given(path=files, data=st.data())
@repeatable
def test_error_for_a_misspelt_key_suggests_the_right_one(path: Path, data, tmp_path: Path):
    table = _read(path)
    key = data.draw(st.sampled_from([k for k in table if len(k) > 4]))
    at = data.draw(st.integers(1, len(key) - 2))
    wrong = key[:at] + key[at + 1 :]
    assume(wrong not in FILES[path].model_fields)
    table[wrong] = table.pop(key)
    bad = _write(tmp_path, path, table)
    with pytest.raises(ProfileError) as caught:
        read_toml_model(bad, FILES[path])
    message = str(caught.value)
    assert message.startswith(f"{bad}: {wrong}: ")
    assert f"did you mean {key!r}?" in message
    assert "this required key is missing" not in message
    assert caught.value.key == wrong


@given(path=files, data=st.data())
@repeatable
def test_error_for_a_senseless_value_names_its_key(path: Path, data, tmp_path: Path):
    table = _read(path)
    key = data.draw(st.sampled_from(sorted(table)))
    junk = [j for j in JUNK if type(j) is not type(table[key])]
    if isinstance(table[key], (int, float)):
        junk += [-1e6, math.nan, math.inf]
    table[key] = data.draw(st.sampled_from(junk))
    bad = _write(tmp_path, path, table)
    with pytest.raises(ProfileError) as caught:
        read_toml_model(bad, FILES[path])
    assert str(caught.value).startswith(f"{bad}: ")
    assert key.split(".", maxsplit=1)[0] in str(caught.value)


@given(path=files, data=st.data())
@repeatable
def test_a_missing_key_without_default_is_reported(path: Path, data, tmp_path: Path):
    table = _read(path)
    key = data.draw(st.sampled_from(sorted(table)))
    del table[key]
    cut = _write(tmp_path, path, table)
    if FILES[path].model_fields[key].is_required():
        with pytest.raises(ProfileError, match=f"{key}: this required key is missing"):
            read_toml_model(cut, FILES[path])
    else:
        try:
            read_toml_model(cut, FILES[path])
        except ProfileError as error:  # another key requires it
            assert key in error.key + error.problem


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (b"poles = \n", "line 1, column 9"),
        (b"poles = 8\npoles = 8\n", "line 2"),
        (b"\xff\xfe", "is not UTF-8 text"),
    ],
)
def test_error_for_invalid_toml_names_the_line(content: bytes, part: str, tmp_path: Path):
    path = tmp_path / "m.toml"
    path.write_bytes(content)
    with pytest.raises(ProfileError, match=part):
        read_toml_model(path, Motor)


def test_a_missing_file_and_a_folder_are_rejected(tmp_path: Path):
    with pytest.raises(ProfileError, match="cannot be read: No such file"):
        cdpr_profiles.load_motor(tmp_path / "none.toml")
    with pytest.raises(ProfileError, match="is not a regular file"):
        cdpr_profiles.load_motor(tmp_path)


def test_all_errors_of_a_file_are_reported_together(tmp_path: Path):
    source = SHIPPED / "winches" / "winch-mpp0923d.toml"
    table = _read(source) | {"gear_ratio": -4.0, "node_id": 128}
    with pytest.raises(ProfileError) as caught:
        read_toml_model(_write(tmp_path, source, table), WinchFile)
    lines = str(caught.value).splitlines()
    assert len(lines) == 2
    assert "gear_ratio: value -4.0; allowed: greater than or equal to 0.01" in lines[0]
    assert "node_id: value 128; allowed: less than or equal to 127" in lines[1]


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"mode_torque": 7}, "mode_torque: value 7; allowed: one of supported_modes"),
        ({"verified": {"colour": {"status": "assumed", "how": "x"}}}, r"verified\.colour"),
        ({"torque_sign": True}, "torque_sign: value True; allowed: a valid integer"),
        ({"torque_sign": 2}, "torque_sign: value 2; allowed: -1 or 1"),
        ({"torque_unit": "Nm"}, "torque_unit: value 'Nm'; allowed: .*'cNm'"),
        ({"velocity_unit": "deg/s"}, "velocity_unit: value 'deg/s'; allowed: .*'rpm'"),
        ({"mode_torque": 4}, "torque_slope_Nm_s: is missing, but mode_torque = 4"),
        ({"torque_slope_Nm_s": 0.0}, "torque_slope_Nm_s: value 0.0; allowed: greater than 0"),
        ({"quirks": {"halt_befor_mode_change": True}}, "did you mean 'halt_before_mode_change'"),
    ],
)
def test_invalid_drive_profiles_are_rejected(change: dict[str, Any], part: str, tmp_path: Path):
    source = SHIPPED / "drives" / "generic-cia402.toml"
    with pytest.raises(ProfileError, match=part):
        read_toml_model(_write(tmp_path, source, _read(source) | change), DriveProfile)


@pytest.mark.parametrize(
    ("file", "edit", "part"),
    [
        (
            "drives/generic-cia402.toml",
            lambda table: table["rpdos"][0].update(cob_id_offset=0x280),
            "rpdos: cob_id_offset 280h is also that of a TPDO",
        ),
        (
            "drives/generic-cia402.toml",
            lambda table: table["tpdos"][0]["entries"].append({"index": 0x606C, "bits": 32}),
            "96 bits; allowed: at most 64",
        ),
        (
            "drives/generic-cia402.toml",
            lambda table: table["tpdos"][0]["entries"][1].update(bit=32),
            r"tpdos\[0\]\.entries\[1\]\.bit: unknown key; did you mean 'bits'\?",
        ),
        (
            "motors/parker-mpp-mpj.series.toml",
            lambda table: table["ratings"]["models_460_VAC"][2].pop(),
            r"ratings: row 2 is .*0923R.*allowed: 14 values",
        ),
    ],
)
def test_error_within_a_table_is_reported_with_its_place(
    file: str, edit: Callable[[Any], object], part: str, tmp_path: Path
):
    source = SHIPPED / file
    table = _read(source)
    edit(table)
    with pytest.raises(ProfileError, match=part):
        read_toml_model(_write(tmp_path, source, table), FILES[source])


def test_peak_torque_below_rated_torque_is_rejected(tmp_path: Path):
    shipped = cdpr_profiles.load_motor("MPP0923D")
    motor = shipped.model_dump(mode="json", exclude_none=True) | {"peak_torque_Nm": 2.0}
    path = tmp_path / "weak.toml"
    path.write_text(_document(motor), encoding="utf-8")
    with pytest.raises(
        ProfileError, match=r"peak_torque_Nm: value 2\.0; allowed: at least the rated"
    ):
        cdpr_profiles.load_motor(path)


def test_error_for_an_unknown_name_suggests_the_likely_one():
    with pytest.raises(ProfileError, match="no profile named 'mpp923d'; did you mean 'MPP0923D'"):
        cdpr_profiles.load_motor("mpp923d")
    with pytest.raises(ProfileError, match="did you mean 'winch-mpp0923d'"):
        cdpr_profiles.load_winch("winch-mpp923d")
    with pytest.raises(ProfileError, match="allowed: elmo-gold, eyou-servo, generic-cia402"):
        cdpr_profiles.load_drive("zzz")


def test_only_neighbouring_files_of_the_right_kind_are_suggested(tmp_path: Path):
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "mine"\n')
    (tmp_path / "broken.toml").write_text("= 1")
    mine = (SHIPPED / "winches" / "winch-300n.toml").read_text()
    (tmp_path / "my-winch.toml").write_text(mine)
    with pytest.raises(ProfileError, match="allowed: my-winch, winch-1kn") as caught:
        cdpr_profiles.load_winch("zzz", tmp_path)
    assert "pyproject" not in str(caught.value) and "broken" not in str(caught.value)
    with pytest.raises(ProfileError, match=r"no such file: 'my-winch\.tml'; did you mean"):
        cdpr_profiles.load_winch("my-winch.tml", tmp_path)
    (tmp_path / "notes.md").write_text("# Notes")
    with pytest.raises(ProfileError, match=r"'notes\.md' is not a winch file"):
        cdpr_profiles.load_winch("notes.md", tmp_path)


def test_error_for_a_motor_with_ratings_only_says_so():
    assert cdpr_profiles.load_motor_ratings("MPP1152C").peak_torque_Nm == 15.69
    with pytest.raises(ProfileError, match="only the ratings of MPP1152C"):
        cdpr_profiles.load_motor("MPP1152C")
    with pytest.raises(ProfileError, match="no profile named 'MPJ0923D'"):
        cdpr_profiles.load_motor_ratings("MPJ0923D")


def test_shipped_winch_has_its_motor_and_drive_and_moves_10_mm_per_22_degrees():
    winch = cdpr_profiles.load_winch("winch-mpp0923d")
    assert winch.motor == cdpr_profiles.load_motor("MPP0923D")
    assert winch.drive == cdpr_profiles.load_drive("generic-cia402")
    assert winch.drive.eds.is_absolute()
    assert winch.profile == "winch-mpp0923d"
    # 22 deg/s at the motor move the cable at 10 mm/s. A turn moves it by 163 mm.
    assert winch.cable_m_per_motor_rad * math.radians(22) == pytest.approx(0.010, rel=0.003)
    assert winch.cable_m_per_motor_rad * 2 * math.pi == pytest.approx(0.163, abs=5e-4)


def test_a_winch_finds_profiles_in_its_folder_before_shipped_ones(tmp_path: Path):
    shipped = cdpr_profiles.load_motor("MPP0922D")
    own = shipped.model_dump(mode="json", exclude_none=True) | {"model": "mine"}
    (tmp_path / "my-motor.toml").write_text(_document(own), encoding="utf-8")
    shutil.copy(SHIPPED / "cables" / "dyneema-4.8mm.toml", tmp_path / "rope.toml")
    source = SHIPPED / "winches" / "winch-mpp0923d.toml"
    table = _read(source) | {"motor": "my-motor", "cable": "rope.toml"}
    path = _write(tmp_path, source, table)
    winch = cdpr_profiles.load_winch(path)
    assert winch.motor.model == "mine"
    assert winch.cable == cdpr_profiles.load_cable("dyneema-4.8mm")
    assert winch.drive.name == "Generic CiA 402 torque servo"
    path.write_text(_document(table | {"motor": "my-moter"}), encoding="utf-8")
    with pytest.raises(ProfileError) as caught:
        cdpr_profiles.load_winch(str(path))
    assert str(caught.value).startswith(f"{path}: motor: no profile named 'my-moter'")
    assert "did you mean 'my-motor'?" in str(caught.value)


def test_the_node_id_of_the_master_is_rejected(tmp_path: Path):
    source = SHIPPED / "winches" / "winch-mpp0923d.toml"
    path = _write(tmp_path, source, _read(source) | {"node_id": 127})
    with pytest.raises(ProfileError, match="node_id: value 127; allowed: any but master"):
        cdpr_profiles.load_winch(path)


def test_a_drive_without_its_eds_is_rejected(tmp_path: Path):
    shutil.copy(SHIPPED / "drives" / "generic-cia402.toml", tmp_path)
    with pytest.raises(ProfileError, match=r"eds: no file 'generic-cia402\.eds' beside this one"):
        cdpr_profiles.load_drive(tmp_path / "generic-cia402.toml")


def test_the_examples_in_describing_your_winch_load(tmp_path: Path):
    page = Path(__file__).parents[2] / "docs" / "how-to" / "describing-your-winch.md"
    examples = page.read_text(encoding="utf-8").split("```toml\n")[1:]
    for name, example in zip(("winch", "my-motor", "my-cable"), examples, strict=True):
        (tmp_path / f"{name}.toml").write_text(example.split("```")[0], encoding="utf-8")
    assert cdpr_profiles.load_winch(tmp_path / "winch.toml").motor.model == "My motor"
    assert cdpr_profiles.load_cable(tmp_path / "my-cable.toml").min_tension_N == 20


def test_a_users_profile_is_found_by_name_before_a_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    winches = tmp_path / "cdpr-rt" / "profiles" / "winches"
    winches.mkdir(parents=True)
    text = (SHIPPED / "winches" / "winch-mpp0923d.toml").read_text()
    (winches / "mine.toml").write_text(text)
    assert "mine" in cdpr_profiles.list_profiles()["winches"]
    mine = cdpr_profiles.load_winch("mine")
    assert mine.reference == str(winches / "mine.toml")  # for a service with another home
    assert cdpr_profiles.load_winch("winch-mpp0923d").reference == "winch-mpp0923d"
    (winches / "winch-mpp0923d.toml").write_text(text)
    assert cdpr_profiles.load_winch("winch-mpp0923d").path.parent == winches
    hidden = cdpr_profiles.load_winch(SHIPPED / "winches" / "winch-mpp0923d.toml")
    assert hidden.reference == str(hidden.path)
    assert cdpr_profiles.load_winch_or_robot("mine") == mine


def test_a_broken_link_to_a_profile_is_not_replaced_by_the_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    own = tmp_path / "cdpr-rt" / "profiles" / "robots" / "planar-4.toml"
    own.parent.mkdir(parents=True)
    own.symlink_to(tmp_path / "share" / "planar-4.toml")
    with pytest.raises(ProfileError, match=r"is a link to .*share.*, which does not exist"):
        cdpr_profiles.load_robot("planar-4")
