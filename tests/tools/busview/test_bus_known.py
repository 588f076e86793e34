"""The nodes that a monitor knows from the named profile or robot."""

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


def test_a_bus_of_a_robot_is_found_by_name_url_or_simulation() -> None:
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


def test_a_robot_with_ambiguous_node_ids_requires_the_name_of_a_bus(tmp_path: Path) -> None:
    axis = '[[axes]]\nwinch = "winch-mpp0923d"\nbus = "{}"\nnode_id = 1\n'
    bus = '[[buses]]\nname = "{}"\nbitrate_bit_s = {}\n'
    file = tmp_path / "pair.toml"
    buses = bus.format("left", 500_000) + bus.format("right", 1_000_000)
    file.write_text('name = "Pair"\n' + buses + axis.format("left") + axis.format("right"))
    with pytest.raises(BadInputError, match="use the same node ids"):
        known_bus(url("simbus:elsewhere"), None, None, str(file))
    assert known_bus(None, None, None, f"{file}:left").bitrate_bit_s == 500_000


def test_the_bit_rate_is_that_of_the_url_or_winch() -> None:
    assert known_bus(url("slcan:/dev/ttyACM0?bitrate=250000"), None, None, None).bitrate_bit_s == (
        250_000
    )
    assert known_bus(url("socketcan:can0"), None, "winch-mpp0923d", None).bitrate_bit_s == 1_000_000


def test_one_drive_profile_decodes_all_nodes() -> None:
    decoder = known_bus(None, "generic-cia402", None, None).decoder()
    record = decoder.decode(Frame(0.0, 0x1FF, bytes.fromhex("3702 00080000 0A00")))
    assert record.node_id == 127
    assert [field.text for field in record.fields] == [
        "operation enabled (0237h)",
        "2048 counts",
        "10 per mille of rated",
    ]


@pytest.mark.parametrize("text", ["181", "0-7FF", "181,700-77F", "1,2,3,4,5,6", "7E4-7E5,80"])
def test_filters_pass_exactly_the_given_identifiers(text: str) -> None:
    wanted = parse_identifiers(text)
    pairs = filters(wanted)
    passed = {i for i in range(0x800) if any(i & mask == want & mask for want, mask in pairs)}
    assert passed == wanted
    assert not any(0x80000181 & mask == want & mask for want, mask in pairs)


def test_node_ids_are_parsed_or_rejected() -> None:
    assert parse_node_ids("3,1-2, 127") == [1, 2, 3, 127]
    for text in ("0", "128", "5-2", "x", "", "1--2", "1_0", "+5", "5 - 7"):
        with pytest.raises(BadInputError, match="1 to 127"):
            parse_node_ids(text)
