"""One test for each row of the supervision table in docs/reference/supervision.md.

The tests of some rows are in other files: master lost in hil/test_daemon_kills, bus gone and drive
in fault in hil/test_command_faults, mode and state changes also in test_axis_group, and a duplicate
node id at boot in test_boot_network.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from cdpr_drivers.bus.health import BusState
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import STATE_TABLE, State
from cdpr_drivers.errors import SdoError
from cdpr_rt.core.clock import Clock, PacedClock
from cdpr_rt.errors import TripError
from tests.drivers.axis_rig import (
    HEARTBEAT_S,
    MASTER,
    PERIOD_S,
    Rig,
    dictionary,
    open_network,
    open_rig,
)
from tests.drivers.axis_rig import start_simulator as _start_simulator
from tests.drivers.bus.port_frames import GREETING, Server
from tests.drivers.bus_log import BusLog, logged
from tests.drivers.canopen.scripted_node import scripted
from tests.fault_texts import alarm

RAISE_FAULT, DROP, MUTE, SILENT, DOUBLE, BABBLE = 1, 2, 5, 6, 7, 9
NODES = [1, 2, 3]


@pytest.fixture(scope="module")
def three_drives() -> Iterator[str]:
    simulator = _start_simulator(nodes=3)
    try:
        yield simulator.bus
    finally:
        simulator.stop()


@pytest.fixture
def trio(three_drives: str) -> Iterator[Rig]:
    """Yield a rig of three enabled drives."""
    with open_network(three_drives, NODES) as network:
        for node in NODES:
            _eventually(network.clock, lambda node=node: _answers(network, node))
            network.reset(node)
            assert network.read_int(node, 0x1001) == 0
    with open_rig(three_drives, NODES) as rig:
        rig.enable()
        rig.run(0.3)
        yield rig


def _answers(network: CanNetwork, node: int) -> bool:
    try:
        return network.read_int(node, 0x1000, attempts=1) > 0
    except SdoError:
        return False


def _eventually(clock: Clock, condition: Callable[[], object]) -> None:
    assert clock.wait(condition, clock.now_s + 5.0)


def _drive_into(rig: Rig, trouble: Callable[[], None]) -> str:
    """Cycle until an alarm, then switch off, as every loop does. Return the alarm."""
    group = rig.group
    with pytest.raises(TripError) as caught, group:
        for cycle in range(5000):
            group.sync()
            group.receive()
            text = alarm(group)
            group.command.torque_Nm[:] = 0.0 if text else 0.03
            if cycle == 150:
                trouble()
            group.transmit()
            if text:
                raise TripError(text)
    return str(caught.value)


def _stopped(log: BusLog, node: int) -> tuple[int, int]:
    """Return the cycle in which a node was commanded to stop, and that in which it was off."""
    pushed = [f.cycle for f in log.of(0x200 + node) if any(f.data[2:])]
    assert pushed
    # controlword "disable voltage" and zero torque
    told = [f.cycle for f in log.of(0x200 + node) if f.cycle >= pushed[-1] and not any(f.data)]
    off = [f.cycle for f in log.of(0x180 + node) if f.cycle > pushed[-1] and _is_off(f.data)]
    return told[0], off[0]


def _is_off(tpdo: bytes) -> bool:
    return bool(STATE_TABLE[tpdo[0] & 0x7F] == State.SWITCH_ON_DISABLED)


# -- a node is lost


@pytest.mark.parametrize(
    ("sub", "value", "told"),
    [(MUTE, 1, "(node 2) sends no heartbeat"), (SILENT, 1500, "(node 2) has not answered SYNC")],
    ids=["heartbeat stops", "falls silent"],
)
def test_other_drives_stop_within_two_heartbeats_of_a_lost_node(
    trio: Rig, sub: int, value: int, told: str
) -> None:
    with logged(trio.bus) as log:
        text = _drive_into(trio, lambda: trio.misbehave(sub, value, node=2))
    assert told in text
    for node in (1, 3):
        commanded, off = _stopped(log, node)
        last_heard = [f.cycle for f in log.of(0x702) if f.cycle <= commanded][-1]
        assert (commanded - last_heard) * PERIOD_S <= 2 * HEARTBEAT_S
        assert (off - last_heard) * PERIOD_S <= 2 * HEARTBEAT_S
        if sub == SILENT:  # the missing answer is detected long before the next heartbeat
            last_answer = [f.cycle for f in log.of(0x182) if f.cycle <= commanded][-1]
            assert commanded - last_answer <= 3


def test_a_node_lost_between_cycles_raises_an_alarm(trio: Rig) -> None:
    trio.reach(State.SWITCH_ON_DISABLED)
    trio.group.stop_cycling()
    trio.misbehave(MUTE, 1, node=3)
    _eventually(trio.network.clock, lambda: trio.network.alarm_text)
    assert "(node 3) sends no heartbeat" in trio.network.alarm_text
    assert "(node 3) sends no heartbeat" in alarm(trio.group)


def test_heartbeats_are_received_between_cycles(trio: Rig) -> None:
    trio.reach(State.SWITCH_ON_DISABLED)
    trio.group.stop_cycling()
    trio.network.clock.sleep(1.6)  # longer than the heartbeat timeout
    assert trio.network.alarm_text == ""


def test_a_restart_between_cycles_raises_an_alarm_and_invalidates_the_index(trio: Rig) -> None:
    trio.group.set_index(1, 0.0)
    trio.reach(State.SWITCH_ON_DISABLED)
    trio.group.stop_cycling()
    trio.network.send(0, bytes([129, 2]))
    _eventually(trio.network.clock, lambda: trio.network.alarm_text)
    text, _ = trio.until_alarm(0.01)
    assert "(node 2) has restarted" in text
    assert not trio.group.feedback.index_known[1]
    assert not trio.group.feedback.alive[1]


def test_a_node_that_leaves_operational_between_cycles_raises_an_alarm(trio: Rig) -> None:
    trio.reach(State.SWITCH_ON_DISABLED)
    trio.group.stop_cycling()
    _eventually(trio.network.clock, lambda: trio.network.wait_for_heartbeat(1, 1.0) == 5)
    trio.network.send(0, bytes([128, 1]))
    _eventually(trio.network.clock, lambda: trio.network.alarm_text)
    assert "(node 1) left the NMT state operational" in trio.network.alarm_text


@pytest.mark.parametrize("command", [128, 2], ids=["pre-operational", "stopped"])
def test_a_lost_drive_is_switched_off_while_the_others_stay_enabled(
    trio: Rig, command: int
) -> None:
    """A stopped node does not accept SDO either, so it is reset."""
    trio.network.write(2, 0x6007, 0, 0)  # the drive does not react to a lost connection
    group, clock = trio.group, trio.network.clock
    trio.network.send(0, bytes([command, 2]))
    for _ in range(500):
        group.sync()
        group.receive()
        group.switch_off_lost()
        group.command.torque_Nm[:] = 0.03
        group.transmit()
        clock.run_tasks()
        if not group.lockstep:
            clock.sleep(PERIOD_S)
    states = group.states()
    assert states[0] == states[2] == State.OPERATION_ENABLED
    assert STATE_TABLE[trio.network.read_int(2, 0x6041) & 0x7F] == State.SWITCH_ON_DISABLED


# -- emergency messages


def test_an_emergency_is_reported_as_text_and_active_until_the_drive_clears_it(trio: Rig) -> None:
    text = _drive_into(trio, lambda: trio.misbehave(RAISE_FAULT, 0x4310, node=3))
    assert "(node 3) reports error" in text
    assert "4310h (drive temperature too high)" in text
    network = trio.network
    (standing,) = network.log.standing(3)
    assert str(standing).startswith("node 3: 4310h drive temperature too high; error register 09h")
    assert "temperature" in str(standing)
    assert network.log.standing(1) == []
    assert [record.code for record in network.error_history(3)] == [0x4310]
    assert str(network.error_history(3)[0]) == "4310h drive temperature too high"
    network.write(3, 0x6040, 0, 0x80)
    _eventually(network.clock, lambda: not network.log.standing(3))
    assert [e.code for e in network.log.of(3)] == [0x4310, 0]  # the history is kept
    assert "error reset" in str(network.log.of(3)[-1])


# -- answers that are missing, double, or too many


def test_a_duplicate_answer_is_not_taken_for_that_of_the_next_cycle(trio: Rig) -> None:
    # a simulator that is preempted between the two copies sends the second one after the next SYNC,
    # where it cannot be recognised. That is not tested here.
    assert any(_follows_through_double_answers(trio) for _ in range(4))
    assert alarm(trio.group) == ""


def _follows_through_double_answers(trio: Rig) -> bool:
    group = trio.group
    trio.run(0.3)
    before = group.repeated
    trio.misbehave(DOUBLE, 20, node=3)  # the last drive to answer
    with logged(trio.bus) as log:
        for _ in range(60):
            group.command.torque_Nm[:] = 0.2
            trio.cycle()
        positions = group.feedback.position_rad.copy()
        flagged = group.feedback.rate_ok.copy()
    assert list(flagged) == [True, True, False]
    # the feedback is that of this SYNC
    last = max(f.cycle for f in log.frames)
    told = []
    for node in NODES:
        (answer,) = [f for f in log.of(0x180 + node) if f.cycle == last]
        counts = int.from_bytes(answer.data[2:6], "little", signed=True)
        told.append(counts * 2 * np.pi / 8192)
    return bool(np.allclose(positions, told, rtol=1e-6)) and group.repeated - before == 20


def test_the_rate_is_valid_again_after_duplicate_answers_end(trio: Rig) -> None:
    trio.misbehave(DOUBLE, 3, node=2)
    trio.run(0.02)
    assert not trio.group.feedback.rate_ok.all() or trio.group.repeated == 3
    trio.run(0.3)
    assert trio.group.feedback.rate_ok.all()
    assert trio.group.feedback.alive.all()


def test_endless_duplicate_answers_indicate_a_duplicate_node_id(trio: Rig) -> None:
    text = _drive_into(trio, lambda: trio.misbehave(DOUBLE, 255, node=2))
    assert "answers of the drive (node 2) to SYNC came twice" in text
    assert "second device with its node id" in text
    assert "node 1" not in text


def test_a_node_that_answers_sdo_but_not_sync_is_reported_with_advice(trio: Rig) -> None:
    def switch_tpdo_off() -> None:
        trio.network.write(2, 0x1800, 1, 0x8000_0182)

    text = _drive_into(trio, switch_tpdo_off)
    assert "(node 2) has not answered SYNC" in text
    assert "its TPDOs were changed" in text
    assert trio.network.read_int(2, 0x1018, 1) == 0x00CD9A01


def test_a_babbling_node_is_reported_and_the_others_are_served(trio: Rig) -> None:
    trio.misbehave(BABBLE, 60, node=2)
    for _ in range(40):
        trio.cycle()
    assert list(trio.group.feedback.valid) == [True, True, True]
    assert "(node 2) floods the bus with frames (last error FF00h" in alarm(trio.group)
    assert "node 1" not in alarm(trio.group)
    assert trio.network.read_int(1, 0x1018, 1) == 0x00CD9A01
    trio.misbehave(BABBLE, 0, node=2)
    assert trio.group.close() == ""
    assert trio.group.reached(State.SWITCH_ON_DISABLED)


def test_a_flood_of_emergencies_between_cycles_is_reported(three_drives: str) -> None:
    with (
        open_network(three_drives, NODES) as network,
        scripted(three_drives, 2, lambda _request: []) as node,
    ):
        for _ in range(150):
            node.send(0x082, b"\x00\xff\x81\0\0\0\0\0")
        _eventually(network.clock, lambda: len(network.log.of(2)) == 150)
        assert "(node 2) reports error FF00h (device specific" in network.alarm_text
        network.clear_alarm()
        node.send(0x082, b"\x00\xff\x81\0\0\0\0\0")
        _eventually(network.clock, lambda: network.alarm_text)
        assert (
            "(node 2) floods the bus with frames (151 emergency messages within 1 s"
            in network.alarm_text
        )
        assert network.read_int(1, 0x1018, 1) == 0x00CD9A01


# -- the wire


def test_bus_off_raises_an_alarm_until_the_controller_is_active_again() -> None:
    server = Server(*GREETING)
    network = CanNetwork(server.url, PacedClock(), [1], MASTER, HEARTBEAT_S)
    try:
        network.add_node(1, dictionary(1))
        server.client.sendall(b"< error 20000080 1.0 >")
        _eventually(network.clock, lambda: network.health.errors == 1)
        assert network.alarm_text == ""  # the controller repeats a disturbed frame
        server.client.sendall(b"< error 20000040 1.0 >")
        _eventually(network.clock, lambda: network.alarm_text)
        assert "the CAN controller is bus-off" in network.alarm_text
        assert "restart the interface" in network.alarm_text
        network.clear_alarm()
        assert "bus-off" in network.alarm_text  # the cause remains
        server.client.sendall(b"< error 20000100 1.0 >")
        _eventually(network.clock, lambda: network.health.state is BusState.ACTIVE)
        assert "bus-off" in network.alarm_text  # latched
        network.clear_alarm()
        assert network.alarm_text == ""
        assert network.health.bus_offs == 1
    finally:
        network.close()
        server.close()
