"""Input that is too deep, too long or has too large numbers is rejected before it is parsed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_profiles import ProfileError, load_motor
from cdpr_profiles.bounded_input import parse_json, read_toml
from cdpr_profiles.motor import Motor
from cdpr_profiles.reader import validated


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"rated_torque_Nm": 1e-3}, "rated_torque_Nm: value 0.001; allowed: 1.568 to 6.272"),
        ({"rated_torque_Nm": 7.0}, "rated_torque_Nm: value 7; allowed: 1.568 to 6.272"),
        ({"rotor_inertia_kg_m2": 1e-12}, "rotor_inertia_kg_m2: value 1e-12; allowed: greater"),
        ({"rated_speed_rpm": 1e9}, "rated_speed_rpm: value 1000000000.0; allowed: less than"),
        ({"poles": 2000}, "poles: value 2000; allowed: less than"),
        ({"rated_torque_Nm": float("inf")}, "rated_torque_Nm: value inf; allowed: a finite number"),
    ],
)
def test_motor_figures_out_of_range_are_rejected(change: dict[str, object], told: str) -> None:
    whole = load_motor("MPP0923D").model_dump()
    with pytest.raises(ProfileError) as refused:
        validated(Path("m.toml"), whole | change, Motor)
    assert told in str(refused.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a = " + "[" * 17 + "]" * 17, "line 1: is nested too deeply; allowed: 16 levels"),
        ("\n" + "a." * 17 + "a = 1", "line 2: is nested too deeply; allowed: 16 levels"),
        (
            "x = " + "{a.b.c.d.e.f.g = " * 5 + "1" + "}" * 5,
            "x: is nested too deeply; allowed: 16 levels",
        ),
        ("[" + ".".join("a" * 18) + "]", "line 1: is nested too deeply; allowed: 16 levels"),
        ("x = 1" + "0" * 99, "line 1: a number of 100 digits; allowed: 99"),
        ("x = 1_" + "0_" * 60 + "0", "line 1: a number of 123 digits; allowed: 99"),
        ("x = 0x" + "f" * 20_000, "line 1: a number of 20002 digits; allowed: 99"),
        ("x = +0X" + "f" * 20_000, "is not valid TOML: "),
        ("x = 0b" + "1" * 20_000, "line 1: a number of 20002 digits; allowed: 99"),
        ("x = 0o" + "7" * 20_000, "line 1: a number of 20000 digits; allowed: 99"),
        ("x = 0x" + "f" * 17, "x: a whole number of 68 bits; allowed: -2^63 to 2^64 - 1"),
        ("x = -9223372036854775809", "x: a whole number of 64 bits; allowed: -2^63 to 2^64 - 1"),
        ("x = 1\nx = 2", "is not valid TOML: Cannot overwrite a value"),
        ("x = " + "1 " * (1 << 18), "is too long; allowed: up to 262144 bytes"),
    ],
)
def test_costly_input_is_rejected_before_parsing(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "x.toml"
    path.write_text(text)
    with pytest.raises(ProfileError) as refused:
        read_toml(path)
    assert str(refused.value).startswith(f"{path}: {told}")


def test_brackets_and_digits_in_strings_and_comments_do_not_count(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    many = "[" * 100 + "1" * 200
    path.write_text(f'# {many}\na = \'{many}\'\nb = "\\"{many}"\nc = """\n"{many}""""\nd = 1.5\n')
    assert read_toml(path) == {"a": many, "b": f'"{many}', "c": f'"{many}"', "d": 1.5}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[" * 17 + "]" * 17, "x: line 1: is nested too deeply; allowed: 16 levels"),
        ("1" * 100, "x: line 1: a number of 100 digits; allowed: 99"),
        ("1" * 21, "x: value 111111111111111111111; allowed: 64 bits"),
        ('{"a": NaN}', "x: value NaN; allowed: a finite number"),
        ("[-Infinity]", "x: value -Infinity; allowed: a finite number"),
        ("1e400", "x: value 1e400; allowed: a finite number"),
        ('{"a": {"b": 1, "b": 2}}', "x: b: is given twice; allowed: each key once"),
        (b"\xff", "x: is not UTF-8 text (byte 0)"),
        ("{", "x: is not valid JSON: "),
    ],
)
def test_invalid_json_is_rejected(text: str | bytes, told: str) -> None:
    with pytest.raises(ProfileError) as refused:
        parse_json(text, "x")
    assert str(refused.value).startswith(told)


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63)
    | st.text()
    | st.floats(allow_nan=False, allow_infinity=False),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)


@given(JSON)
def test_valid_json_is_parsed_as_by_the_standard_library(value: object) -> None:
    assert parse_json(json.dumps(value), "x") == value
    assert parse_json(json.dumps(value, ensure_ascii=False, indent=1), "x") == value
