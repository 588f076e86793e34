"""The buses of a robot: URLs in its file, --bus, and the simulator."""

from __future__ import annotations

from pathlib import Path

import pytest
from cdpr_here import cdpr_here

from cdpr_drivers.bus import query_status
from cdpr_drivers.errors import ConfigurationError
from cdpr_drivers.robot.robot_buses import robot_urls, starts_own_simulator
from cdpr_profiles import Robot, load_robot
from tests.tools.robot_rig import Simulator, robot_file, unique

SPATIAL = load_robot("spatial-8")


@pytest.fixture
def without_urls(tmp_path: Path) -> Robot:
    return load_robot(robot_file(tmp_path, [("left", 1), ("right", 1)]))


def urls(robot: Robot, *texts: str) -> dict[str, str]:
    return {name: str(url) for name, url in robot_urls(robot, texts).items()}


def test_option_bus_overrides_the_urls_of_the_file():
    assert urls(SPATIAL) == {"can0": "socketcan:can0", "can1": "socketcan:can1"}
    assert urls(SPATIAL, "can1=slcan:/dev/ttyACM0?bitrate=1000000") == {
        "can0": "socketcan:can0",
        "can1": "slcan:/dev/ttyACM0?bitrate=1000000",
    }


def test_one_simulated_name_gives_urls_of_all_buses(without_urls: Robot):
    assert urls(SPATIAL, "simbus:x") == {"can0": "simbus:x-can0", "can1": "simbus:x-can1"}
    assert urls(without_urls, "simbus:x") == {"left": "simbus:x-left", "right": "simbus:x-right"}
    assert starts_own_simulator(["simbus:"])
    assert not starts_own_simulator(["simbus:x"])


def test_a_robot_with_one_bus_takes_one_url(tmp_path: Path):
    robot = load_robot(robot_file(tmp_path, [("only", 1), ("only", 2)]))
    assert urls(robot, "socketcan:vcan0") == {"only": "socketcan:vcan0"}


@pytest.mark.parametrize(
    ("texts", "reason"),
    [
        (("left=socketcan:can0",), "bus 'right' has no url; add it there or give --bus right=URL"),
        (("socketcan:can0",), "has 2 buses; write --bus left=URL --bus right=URL"),
        (("middle=socketcan:can0",), "no bus 'middle'; allowed: left, right"),
        (("left=socketcan:a", "left=socketcan:b"), "'left' is already given as socketcan:a"),
        (("left=socketcan:a", "right=socketcan:a"), "'left' and 'right': both are socketcan:a"),
        (("left=socketcan:a", "simbus:x"), "write several buses as BUS=URL"),
        (("left=simbus:", "right=simbus:x"), "a single bus needs a name"),
        (("left=smoke:signals",), "unknown interface 'smoke'"),
    ],
)
def test_invalid_bus_options_are_rejected(without_urls: Robot, texts: tuple[str, ...], reason: str):
    with pytest.raises(ConfigurationError) as caught:
        robot_urls(without_urls, texts)
    assert reason in str(caught.value)


def test_one_simulator_opens_all_buses_of_a_robot():
    name = unique()
    simulator = Simulator("spatial-8", "--bus", f"simbus:{name}")
    try:
        assert simulator.ready["robot"] == "spatial-8"
        nodes = {of: told["nodes"] for of, told in simulator.ready["buses"].items()}
        assert nodes == {"can0": [1, 2, 3, 4], "can1": [5, 6, 7, 8]}
        for of, of_bus in nodes.items():
            status = query_status(f"{name}-{of}")
            assert (status["mode"], status["nodes"]) == ("lockstep", of_bus)
    finally:
        simulator.close()
    assert simulator.process.returncode == 0


def refused(*arguments: str) -> str:
    done = cdpr_here("sim", "up", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert "Traceback" not in done.stderr
    return done.stderr


def test_the_simulator_rejects_impossible_robots_and_options(tmp_path: Path):
    tight = robot_file(tmp_path, [("b", node) for node in range(1, 9)])
    assert "8 drives need 1895 us" in refused(str(tight), "--bus", "simbus:x")
    assert "highest rate at 1000000 bit/s: 524 Hz" in refused(str(tight), "--bus", "simbus:x")
    assert "for a winch only" in refused("spatial-8", "--bus", "simbus:x", "--nodes", "2")
    assert "simbus:NAME or socketcan:IFACE" in refused(
        "spatial-8", "--bus", "can0=simbus:x", "--bus", "can1=slcan:/dev/ttyACM0"
    )
    two = ("--bus", "simbus:x", "--bus", "simbus:y")
    assert "a winch has one bus" in refused("winch-mpp0923d", *two)
