"""`cdpr bus scan` with simulated drives, a busy master, and third-party slaves."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
import canopen
import pytest
from cdpr_here import cdpr_here

from cdpr_profiles import load_winch
from cdpr_tools.busview import scan as node_reader
from cdpr_tools.commands import bus as bus_commands
from tests.tools.busview.bus_lab import WINCH, Lab, last_json

EDS = str(load_winch(WINCH).drive.eds)


@pytest.fixture(scope="module")
def labs() -> Iterator[tuple[Lab, Lab]]:
    two = Lab("busscan", "--nodes", "2"), Lab("busscan2")
    for lab in two:
        lab.ready()
    yield two
    for lab in two:
        lab.close()


@pytest.fixture(scope="module")
def lab(labs: tuple[Lab, Lab]) -> Lab:
    return labs[0]


@contextmanager
def third_party_node(lab: Lab, node_id: int, **objects: int) -> Iterator[canopen.LocalNode]:
    """Run a slave of the canopen library on the bus. `x1018_1=7` sets an object."""
    dictionary = canopen.import_od(EDS, node_id)
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.02
    network.connect(interface="simbus", channel=lab.name)
    node = canopen.LocalNode(node_id, dictionary)
    network.add_node(node)
    for name, value in objects.items():
        index, _, sub = name[1:].partition("_")
        entry = dictionary[int(index, 16)]
        variable = entry[int(sub)] if sub else entry
        node.set_data(int(index, 16), int(sub or 0), variable.encode_raw(value))
    try:
        yield node
    finally:
        network.disconnect()


def scan(lab: Lab, *arguments: str) -> dict[int, dict[str, Any]]:
    result = cdpr_here("bus", "scan", "--bus", lab.bus, *arguments, "--json")
    assert result.returncode == 0, result.stderr
    (bus,) = last_json(result.stdout)["buses"]
    return {node["node_id"]: node for node in bus["nodes"]} | {0: bus}


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make scans listen only briefly, but wait long for answers of existing nodes."""
    monkeypatch.setattr(bus_commands, "LISTEN_S", 0.25)
    monkeypatch.setattr(node_reader, "_TIMEOUT_S", 2.5)


hastily = pytest.mark.usefixtures("hasty")


# -- scan


def test_scan_lists_the_nodes_on_the_bus(lab: Lab) -> None:
    # the first frame switches the drives on: wait until they have started
    assert cdpr_here("drive", "info", WINCH, "--bus", lab.bus).returncode == 0
    found = scan(lab)
    assert found.keys() == {0, 1, 2}
    assert found[0]["seconds"] < 90.0  # sequentially, the 125 silent ids would take 100 s
    for node_id in (1, 2):
        node = found[node_id]
        assert node["device_name"] == "Generic CiA 402 torque servo"
        assert (node["vendor_id"], node["product_code"]) == (0xCD9A01, 0x402)
        assert node["serial"] == node_id
        assert node["supported_modes"] == [1, 3, 4, 6, 8, 9, 10]
        assert node["state"] == "switch on disabled"
        assert node["profiles"] == ["generic-cia402"]
        assert node["problems"] == []
    assert found[0]["warning"] == ""


@hastily
def test_control_characters_in_a_device_name_are_replaced(lab: Lab) -> None:
    with third_party_node(
        lab, 20, x1000=0x20192, x6502=0xFFFFFFFF, x6041=0xFFFF, x1001=0xFF
    ) as node:
        node.set_data(0x1008, 0, b"\x1b[2JEvil\nnode\xff")
        result = cdpr_here("bus", "scan", "--bus", lab.bus, "--nodes", "20")
    assert result.returncode == 0, result.stderr
    assert "\x1b" not in result.stdout
    assert "?[2JEvil?node" in result.stdout.splitlines()[2]


@hastily
def test_scan_only_sends_read_requests(lab: Lab) -> None:
    with lab.join() as ear:
        scan(lab, "--nodes", "1-5")
        passed = lab.passed(ear)
        sent = [m for m in passed if m.arbitration_id & 0x780 == 0x600]
        others = [
            m for m in passed if m not in sent and m.arbitration_id & 0x780 not in (0x580, 0x700)
        ]
    assert {m.arbitration_id for m in sent} == {0x601, 0x602, 0x603, 0x604, 0x605}
    assert {m.data[0] for m in sent} <= {0x40, 0x60, 0x70}
    assert not others


@hastily
def test_scan_prints_a_table(lab: Lab) -> None:
    result = cdpr_here("bus", "scan", "--bus", lab.bus, "--nodes", "2,9")
    assert result.returncode == 0
    title, heads, row, identity, doing = result.stdout.splitlines()
    assert title == f"{lab.bus}: 1 node"
    assert re.split(r"\s{2,}", row.strip()) == [
        "2",
        "unknown",
        "Generic CiA 402 torque servo",
        "generic-cia402",
        "switch on disabled",
        "PP PV PT HM CSP CSV CST",
    ]
    assert heads.index("CiA 402 state") == row.index("switch on disabled")
    assert "serial 00000002h" in identity
    assert "no heartbeat" in doing


@hastily
def test_two_nodes_with_one_id_are_reported(lab: Lab) -> None:
    with third_party_node(lab, 1, x1018_4=77, x1000=0x20192):
        found = scan(lab, "--nodes", "1-2")
    assert found[2]["problems"] == []
    (problem,) = found[1]["problems"]
    assert re.fullmatch(
        "several nodes have this id: two answers to one request, differing for .*1018h:4.*", problem
    )


def test_scan_reports_devices_that_are_not_drives_or_do_not_answer(
    lab: Lab, tmp_path: Path
) -> None:
    with (
        third_party_node(lab, 20, x1000=0x00000000, x1018_1=5, x1018_2=6),
        third_party_node(lab, 21, x1000=0x000F0191),
        third_party_node(lab, 22) as silent,
        third_party_node(lab, 23, x1000=0x00020192, x1018_1=5, x1018_2=6, x1018_3=8, x6502=0x200),
    ):
        silent.network.unsubscribe(0x616)  # does not answer
        silent.nmt.start_heartbeat(100)
        found = scan(lab, "--nodes", "20-23")
    assert "such as a bootloader" in found[20]["problems"][0]
    assert found[20]["cia402"] is False
    assert "CiA 401" in found[21]["problems"][0]
    assert found[22]["answers_sdo"] is False
    assert found[22]["heartbeats"] >= 5
    assert "does not answer SDO" in found[22]["problems"][0]
    assert found[23]["cia402"] is True
    assert found[23]["supported_modes"] == [10]
    assert found[23]["profiles"] == []


@hastily
def test_scan_names_matching_profiles_of_the_user(lab: Lab, tmp_path: Path) -> None:
    source = Path(EDS)
    text = source.with_suffix(".toml").read_text(encoding="utf-8")
    (tmp_path / source.name).write_bytes(source.read_bytes())
    (tmp_path / "mine.toml").write_text(text.replace("0x00010000", "0x00010009"))
    (tmp_path / "motor.toml").write_text('model = "X"\n')
    node = scan(lab, "--nodes", "1", "--profiles", str(tmp_path))[1]
    own = f"{tmp_path / 'mine.toml'} (but its revision is 00010009h)"
    assert node["profiles"] == ["generic-cia402", own]


def test_scan_is_rejected_during_sdo_transfers_of_a_master(lab: Lab) -> None:
    with lab.join() as bus:
        reading = can.Message(arbitration_id=0x601, data=bytes.fromhex("4018100100000000"))
        reading.is_extended_id = False
        task = bus.send_periodic(reading, 0.05)
        refused = cdpr_here("bus", "scan", "--bus", lab.bus, "--nodes", "1")
        assert refused.returncode == 1
        assert "SDO requests to node 1" in refused.stderr
        assert "--force" in refused.stderr
        forced = scan(lab, "--nodes", "1", "--force")
        task.stop()
        task.thread.join()
        lab.passed(bus)  # discard its frames, so that the next scan does not see them
    assert forced[1]["serial"] == 1
    assert forced[1]["problems"] == []  # answers to the other master do not count as a second node
    assert "SDO requests" in forced[0]["warning"]


@hastily
def test_two_buses_are_scanned_together(labs: tuple[Lab, Lab]) -> None:
    lab, other = labs
    result = cdpr_here(
        "bus", "scan", "--bus", lab.bus, "--bus", other.bus, "--nodes", "2-9", "--json"
    )
    assert result.returncode == 0
    buses = last_json(result.stdout)["buses"]
    assert [(bus["bus"], len(bus["nodes"])) for bus in buses] == [(lab.bus, 1), (other.bus, 0)]
    empty = result.stderr.splitlines()[-2:]  # as text
    assert empty[0] == f"{other.bus}: no nodes"
    assert "termination" in empty[1]
