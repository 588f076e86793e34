"""Whom a monitor takes the nodes for, by the profile that is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.decode import Frame
from cdpr_profiles import list_profiles, load_robot
from cdpr_tools.busview.monitor import filters, known_bus, parse_identifiers, parse_node_ids
from cdpr_tools.errors import BadInputError

ROBOT = list_profiles()["robots"][0]


def url(text: str) -> BusUrl:
    return BusUrl.parse(text)


def test_one_bus_of_a_robot_by_name_by_url_or_by_its_simulation() -> None:
    robot = load_robot(ROBOT)
    of_bus = {
        bus.name: {axis.node_id for axis in robot.axes if axis.bus == bus.name}
        for bus in robot.buses
    }
    for bus in robot.buses:
        mine = of_bus[bus.name]
        assert known_bus(None, None, None, f"{ROBOT}:{bus.name}").nodes.keys() == mine
        assert known_bus(url(str(bus.url)), None, None, ROBOT).nodes.keys() == mine
        assert known_bus(url(f"simbus:lab-{bus.name}"), None, None, ROBOT).nodes.keys() == mine
    everybody = known_bus(url("simbus:elsewhere"), None, None, ROBOT)
    assert everybody.nodes.keys() == set().union(*of_bus.values())
    with pytest.raises(BadInputError, match=f"allowed: --robot {ROBOT}:"):
        known_bus(None, None, None, f"{ROBOT}:no-such")


def test_buses_with_the_same_node_ids_have_to_be_told_apart(tmp_path: Path) -> None:
    axis = '[[axes]]\nwinch = "winch-mpp0923d"\nbus = "{}"\nnode_id = 1\n'
    bus = '[[buses]]\nname = "{}"\nbitrate_bit_s = {}\n'
    file = tmp_path / "pair.toml"
    buses = bus.format("left", 500_000) + bus.format("right", 1_000_000)
    file.write_text('name = "Pair"\n' + buses + axis.format("left") + axis.format("right"))
    with pytest.raises(BadInputError, match="node ids in common"):
        known_bus(url("simbus:elsewhere"), None, None, str(file))
    assert known_bus(None, None, None, f"{file}:left").bitrate_bit_s == 500_000


def test_bit_rate_of_the_load() -> None:
    assert known_bus(url("slcan:/dev/ttyACM0?bitrate=250000"), None, None, None).bitrate_bit_s == (
        250_000
    )
    assert known_bus(url("socketcan:can0"), None, "winch-mpp0923d", None).bitrate_bit_s == 1_000_000


def test_every_node_may_be_one_drive() -> None:
    decoder = known_bus(None, "generic-cia402", None, None).decoder()
    record = decoder.decode(Frame(0.0, 0x1FF, bytes.fromhex("3702 00080000 0A00")))
    assert record.node_id == 127
    assert [field.text for field in record.fields] == [
        "operation enabled (0237h)",
        "2048 counts",
        "10 per mille of rated",
    ]


@pytest.mark.parametrize("text", ["181", "0-7FF", "181,700-77F", "1,2,3,4,5,6", "7E4-7E5,80"])
def test_filters_let_just_the_identifiers_through(text: str) -> None:
    wanted = parse_identifiers(text)
    pairs = filters(wanted)
    passed = {i for i in range(0x800) if any(i & mask == want & mask for want, mask in pairs)}
    assert passed == wanted
    assert not any(0x80000181 & mask == want & mask for want, mask in pairs)


def test_node_ids() -> None:
    assert parse_node_ids("3,1-2, 127") == [1, 2, 3, 127]
    for text in ("0", "128", "5-2", "x", "", "1--2", "1_0", "+5", "5 - 7"):
        with pytest.raises(BadInputError, match="1 to 127"):
            parse_node_ids(text)
