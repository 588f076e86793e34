"""Bus logs and MCAP files become tables."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from cdpr_profiles import load_winch
from cdpr_profiles.errors import ProfileError
from cdpr_tools.imports.logs import read_any

WINCH = load_winch("winch-mpp0923d")


def test_a_candump_log_gives_position_and_torque_at_each_sync(tmp_path: Path) -> None:
    lines = []
    for k in range(4):
        status = struct.pack("<Hih", 0x0237, 1024 * k, 100 * k)
        other = struct.pack("<Hih", 0x0237, 5, 5)
        lines += [
            f"(1700000000.{1000 * k:06d}) can0 080#",
            f"(1700000000.{1000 * k + 200:06d}) can0 {0x180 + WINCH.node_id:03X}#{status.hex()}",
            f"(1700000000.{1000 * k + 300:06d}) can0 {0x180 + 77:03X}#{other.hex()}",
        ]
    path = tmp_path / "bus.log"
    path.write_text("\n".join(lines) + "\n")
    table = read_any(path, {"": WINCH})
    turn = 360.0 * 1024 / WINCH.encoder_counts_per_turn
    assert table.column("6064") == pytest.approx([0.0, turn, 2 * turn, 3 * turn])
    assert table.column("6077") == pytest.approx([0.0, 0.3, 0.6, 0.9])
    assert (table.units["6064"], table.units["6077"]) == ("deg", "Nm")
    assert table.column("time_s")[1] == pytest.approx(1700000000.001, abs=1e-6)


def test_a_log_without_the_winch_names_its_node(tmp_path: Path) -> None:
    path = tmp_path / "bus.log"
    path.write_text("(1700000000.000000) can0 701#05\n")
    with pytest.raises(ProfileError, match=rf"no positions \(6064h\) of node {WINCH.node_id}"):
        read_any(path, {"": WINCH})


def test_json_messages_of_an_mcap_file_become_columns(tmp_path: Path) -> None:
    writer_module = pytest.importorskip("mcap.writer")
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = writer_module.Writer(file)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        fast = writer.register_channel("/motor", "json", schema)
        slow = writer.register_channel("/temperature", "json", schema)
        for k in range(3):
            stamp = 1_000_000_000 + 10_000_000 * k
            if k != 1:
                writer.add_message(slow, stamp, json.dumps({"C": 20 + k}).encode(), stamp)
            message = json.dumps({"angle": 0.1 * k, "iq": [k, -k], "name": "a"}).encode()
            writer.add_message(fast, stamp + 1, message, stamp + 1)
        writer.finish()
    table = read_any(path)
    assert table.column("motor.angle") == pytest.approx([0.0, 0.1, 0.2])
    assert list(table.column("motor.iq[1]")) == [0.0, -1.0, -2.0]
    assert list(table.column("temperature.C")) == [20.0, 20.0, 22.0]
    assert table.column("time_s") == pytest.approx([1.0, 1.01, 1.02], abs=1e-6)
