"""What a safety I/O's file may not say, and how it is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_profiles import ProfileError
from cdpr_profiles.devices.safety_io import load_safety_io
from cdpr_profiles.reading.places import SHIPPED

TEXT = (SHIPPED / "safety_io" / "modbus-remote-io.toml").read_text()


def test_the_shipped_one_loads_and_can_be_moved_to_another_place() -> None:
    shipped = load_safety_io("modbus-remote-io")
    assert (shipped.host, shipped.port, shipped.chain.input) == ("127.0.0.1", 502, 0)
    moved = load_safety_io("modbus-remote-io@plc-7:1502")
    assert (moved.host, moved.port, moved.axes) == ("plc-7", 1502, shipped.axes)
    assert load_safety_io("modbus-remote-io@10.0.0.5").port == 502


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("{ input = 2 }", "{ input = 3 }", "input 3 is that of axes[0].brake.feedback already"),
        ("coil = 1 }", "coil = 0 }", "coil 0 is that of contactor.output already"),
        ("{ coil = 1 }", "{ coil = 1, inverted = true }", "a brake to hold"),
        ("trip_timeout_s = 0.2", "trip_timeout_s = 0.03", "at least two poll periods (0.04)"),
        ("input = 7,", "input = 4000,", "input 4000; allowed: less than 1968 from the first (0)"),
        ("port = 502", "port = 70000", "port: value 70000; allowed: less than or equal to 65535"),
        ('axis = "rail 1"', 'axis = "winch 1"', "allowed: each once"),
        ("[chain]", "[chian]", "did you mean 'chain'?"),
        ("timeout_s = 0.5", "timeout_s = 0.01", "watchdog.timeout_s: value 0.01"),
    ],
)
def test_what_cannot_be_is_refused_with_file_and_key(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    assert TEXT.count(old) >= 1
    path = tmp_path / "io.toml"
    path.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(ProfileError) as error:
        load_safety_io(path)
    assert str(path) in str(error.value) and said in str(error.value)


def test_an_unknown_name_is_answered_with_the_likely_one() -> None:
    with pytest.raises(ProfileError, match="did you mean 'modbus-remote-io'"):
        load_safety_io("modbus-remot-io")
    with pytest.raises(ProfileError, match=r"port: value 'x'; allowed: a number"):
        load_safety_io("modbus-remote-io@host:x")
