"""A master that leads simulated buses waits in bus time, independent of wall-clock time."""

from __future__ import annotations

import random
import signal
import threading
import time
from contextlib import ExitStack, closing

import pytest

from cdpr_drivers.bus import BusUrl, query_status
from cdpr_drivers.bus.simbus import SimulatedBusClock, open_clock
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import BusError, SdoTimeoutError
from cdpr_rt.core.clock import LockstepClock, PacedClock
from cdpr_tools.composition.simulator import OwnSimulator
from tests.drivers.axis_rig import (
    DRIVE,
    HEARTBEAT_S,
    MASTER,
    PERIOD_S,
    Rig,
    dictionary,
    open_network,
    start_simulator,
)
from tests.fault_texts import alarm


def test_timeout_of_a_silent_node_is_in_bus_time(bus: str) -> None:
    with open_network(bus, [9]) as network:
        begin_s, began = network.clock.now_s, time.monotonic()
        for _ in range(20):
            with pytest.raises(SdoTimeoutError):
                network.read_int(9, 0x1000)
        assert network.clock.now_s - begin_s == pytest.approx(20.0)  # two attempts each
        assert time.monotonic() - began < 10.0


def test_a_bus_has_one_leader_at_a_time(bus: str) -> None:
    url = BusUrl.parse(bus)
    with closing(open_clock([url])) as clock:
        assert isinstance(clock, SimulatedBusClock)
        assert isinstance(open_clock([url]), PacedClock)
        before_s = clock.now_s
    time.sleep(0.05)
    with closing(open_clock([url])) as clock:
        assert isinstance(clock, SimulatedBusClock)
        assert clock.now_s == before_s + 0.01  # the first leader released it properly
    assert isinstance(open_clock([BusUrl.parse("simbus:nobody-here")]), PacedClock)
    assert isinstance(open_clock([]), PacedClock)


def test_all_buses_of_a_robot_have_the_same_time() -> None:
    rng = random.Random(7)
    with ExitStack() as stack:
        simulators = [start_simulator() for _ in range(3)]
        for simulator in simulators:
            stack.callback(simulator.stop)
        urls = [BusUrl.parse(simulator.bus) for simulator in simulators]
        # one of them has been used before
        with open_network(simulators[1].bus, [1]) as network:
            network.clock.sleep(0.123)
        clock = stack.enter_context(closing(open_clock(urls)))
        assert {query_status(url.channel)["bus_time_s"] for url in urls} == {clock.now_s}
        assert clock.now_s >= 0.123
        networks = [CanNetwork(url, clock, [1], MASTER, HEARTBEAT_S) for url in urls]
        for network in networks:
            network.add_node(1, dictionary(1))
            network.write(1, 0x1017, 0, rng.randrange(20, 60))
            network.start_heartbeat()
        for _ in range(50):
            clock.sleep(rng.random() * 0.2)
            told = {query_status(url.channel)["bus_time_s"] for url in urls}
            assert told == {clock.now_s}
        assert [network.wait_for_heartbeat(1, 1.0) for network in networks] == [127] * 3


@pytest.mark.parametrize("while_waiting", [False, True])
def test_a_killed_simulator_ends_waits_and_time_continues(while_waiting: bool) -> None:
    simulator = start_simulator()
    try:
        with open_network(simulator.bus, [1]) as network:
            clock = network.clock
            assert network.read_int(1, 0x1000) == 0x00020192
            began = time.monotonic()
            if while_waiting:
                simulator.process.send_signal(signal.SIGSTOP)
                threading.Timer(0.2, simulator.process.kill).start()
            else:
                simulator.process.kill()
                simulator.process.wait()
            with pytest.raises(BusError, match="is lost"):
                network.read_int(1, 0x1000)
            assert "is lost" in network.alarm_text
            at_s = clock.now_s
            clock.sleep(300.0)
            assert clock.now_s == pytest.approx(at_s + 300.0)
            assert time.monotonic() - began < 50.0
    finally:
        simulator.stop()


def test_time_does_not_go_backwards_when_the_bus_dies_between_two_cycles() -> None:
    simulator = start_simulator()
    try:
        with open_network(simulator.bus, [1]) as network:
            rig = Rig(simulator.bus, network, DRIVE, [1])
            rig.enable()
            for _ in range(100):
                rig.cycle()
            before_s = network.clock.now_s
            simulator.process.kill()
            simulator.process.wait()
            with pytest.raises(BusError, match="is lost"):
                rig.cycle()
            assert network.clock.now_s >= before_s
            network.clock.sleep(1.0)
            assert network.clock.now_s >= before_s + 1.0
    finally:
        simulator.stop()


def test_a_restarted_bus_is_led_again_and_time_continues() -> None:
    simulator = start_simulator()
    url = BusUrl.parse(simulator.bus)
    with closing(open_clock([url])) as clock:
        for _ in range(2):
            network = CanNetwork(url, clock, [1], MASTER, HEARTBEAT_S)
            network.add_node(1, dictionary(1))
            begin_s = clock.now_s
            network.write(1, 0x1017, 0, 50)
            assert network.wait_for_heartbeat(1, 1.0) == 127
            clock.sleep(1.0)
            assert clock.now_s == pytest.approx(begin_s + 1.05, abs=0.05)
            simulator.stop()
            with pytest.raises(BusError, match="is lost"):
                network.read_int(1, 0x1000)
            network.close()
            with pytest.raises(BusError, match="no simulated bus"):
                CanNetwork(url, clock, [1], MASTER, HEARTBEAT_S)
            simulator = OwnSimulator("winch-mpp0923d", simulator.bus)
    simulator.stop()


def test_a_cycle_lasts_one_period_after_the_drives_restarted(bus: str) -> None:
    with open_network(bus, [1]) as network:
        rig = Rig(bus, network, DRIVE, [1])
        rig.enable()
        begin_s = network.clock.now_s
        network.reset(1)
        network.send(0, bytes([129, 2]))
        for _ in range(100):
            rig.cycle()
        assert network.clock.now_s - begin_s == pytest.approx(100 * PERIOD_S)
        assert "restarted" in alarm(rig.group)
        rig.group.close()


def test_several_users_of_one_bus_share_its_clock(bus: str) -> None:
    """The second network has a separate port and waits with the same clock."""
    with open_network(bus, [1]) as network:
        url, clock = BusUrl.parse(bus), network.clock
        assert isinstance(clock, LockstepClock)
        second = CanNetwork(url, clock, [2], MASTER - 1, HEARTBEAT_S)
        second.add_node(2, dictionary(2))
        works = [lambda: second.read_int(2, 0x1000), lambda: network.read_int(1, 0x1000)]
        read = clock.gather(works)
        assert [task.result() for task in read] == [0x00020192] * 2
        second.close()
        assert network.read_int(1, 0x1000) == 0x00020192


def test_frames_in_flight_are_not_received_by_the_next_user_of_a_port(bus: str) -> None:
    url = BusUrl.parse(bus)
    with closing(open_clock([url])) as clock:
        for _ in range(3):
            network = CanNetwork(url, clock, [1], MASTER, HEARTBEAT_S)
            network.add_node(1, dictionary(1))
            network.send(0, bytes([129, 1]))  # the boot-up message is in flight
            network.close()
            other = CanNetwork(url, clock, [1], MASTER, HEARTBEAT_S)
            other.add_node(1, dictionary(1))
            clock.sleep(0.05)
            assert not other.alarm_text
            other.close()
