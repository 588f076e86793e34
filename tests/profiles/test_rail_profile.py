"""What a rail's file may not say, and how it is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_profiles import ProfileError
from cdpr_profiles.catalogue import load_rail_drive
from cdpr_profiles.devices.rail import load_rail
from cdpr_profiles.reading.places import SHIPPED

CIA402 = (SHIPPED / "rails" / "rail-cia402.toml").read_text()
MODBUS = (SHIPPED / "rails" / "rail-modbus.toml").read_text()


def test_the_shipped_ones_load() -> None:
    for name in ("rail-cia402", "rail-modbus"):
        rail = load_rail(name)
        assert (rail.cia402 is not None, rail.modbus is not None) == (
            rail.kind == "cia402",
            rail.kind == "modbus",
        )
    cia402 = load_rail("rail-cia402").cia402
    assert cia402 is not None
    assert 1 in load_rail_drive("rail-cia402", cia402).supported_modes


@pytest.mark.parametrize(
    ("text", "old", "new", "said"),
    [
        (CIA402, 'kind = "cia402"', 'kind = "modbus"', "kind: value 'modbus'"),
        (MODBUS, 'kind = "modbus"', 'kind = "cia402"', "(given: modbus)"),
        (CIA402, "travel_max_m = 1.2", "travel_max_m = -1.0", "below travel_max_m (-1.0)"),
        (CIA402, "direction = 1", "direction = 0", "value 0; allowed: -1 or 1"),
        (CIA402, "speed_m_s", "sped_m_s", "did you mean 'speed_m_s'?"),
        (MODBUS, "halt = 2", "halt = 1", "command: bits [0, 1, 1, 3]; allowed: each once"),
        (MODBUS, "fault = 3", "fault = 30", "modbus.status.fault: value 30"),
        (MODBUS, "metre_per_unit = 1e-5", "metre_per_unit = 0.0", "metre_per_unit: value 0.0"),
    ],
)
def test_what_cannot_be_is_refused_with_file_and_key(
    tmp_path: Path, text: str, old: str, new: str, said: str
) -> None:
    assert old in text
    path = tmp_path / "rail.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ProfileError) as error:
        load_rail(path)
    assert str(path) in str(error.value) and said in str(error.value)


def test_a_drive_that_is_not_there_is_told_with_its_name(tmp_path: Path) -> None:
    path = tmp_path / "rail.toml"
    path.write_text(CIA402.replace("generic-cia402", "generic-cia403"))
    cia402 = load_rail(path).cia402
    assert cia402 is not None
    with pytest.raises(ProfileError, match="'generic-cia403'; did you mean 'generic-cia402'"):
        load_rail_drive(path, cia402)
