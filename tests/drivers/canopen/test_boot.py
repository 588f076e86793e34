"""Booting simulated drives: each failure, and the configuration that is written or kept."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any

import can
import pytest

from cdpr_drivers.bus import query_status
from cdpr_drivers.canopen.boot import boot, boot_all
from cdpr_drivers.cia402 import State
from cdpr_drivers.errors import BootError
from cdpr_profiles import DriveProfile
from tests.drivers.axis_rig import DRIVE, MASTER, SETTINGS, Rig, open_network, start_simulator
from tests.drivers.bus_log import logged


def _boot_fails(
    bus: str, profile: DriveProfile = DRIVE, node: int = 1, lead: bool = True, **want: Any
) -> BootError:
    with open_network(bus, [node], lead=lead) as network, pytest.raises(BootError) as caught:
        boot(network, node, profile, replace(SETTINGS, **want))
    return caught.value


@pytest.mark.parametrize(
    ("letter", "field", "found"),
    [
        ("D", "vendor_id", "00CD9A01h"),
        ("M", "product_code", "00000402h"),
        ("N", "revision", "00010000h"),
    ],
)
def test_error_for_a_wrong_identity_shows_both_values(
    bus: str, letter: str, field: str, found: str
) -> None:
    error = _boot_fails(bus, DRIVE.model_copy(update={field: 0x1234}))
    assert error.letter == letter
    assert found in str(error)
    assert "00001234h" in str(error)


def test_a_profile_with_serial_number_rejects_another_device(bus: str) -> None:
    assert _boot_fails(bus, DRIVE.model_copy(update={"serial": 0x1234})).letter == "O"


def test_a_drive_enabled_by_another_master_fails_step_l_undisturbed(rig: Rig) -> None:
    rig.enable()
    error = _boot_fails(rig.bus)
    assert error.letter == "L"
    rig.run(0.01)
    assert rig.group.reached(State.OPERATION_ENABLED)


def test_the_sync_of_another_master_fails_step_l_before_anything_is_sent(bus: str) -> None:
    """The other master has no heartbeat or a different node id."""
    stop = threading.Event()
    with can.Bus(interface="simbus", channel=bus[7:]) as other, logged(bus) as log:

        def produce() -> None:
            while not stop.wait(0.005):
                other.send(can.Message(arbitration_id=0x080, is_extended_id=False))

        producer = threading.Thread(target=produce)
        producer.start()
        try:
            error = _boot_fails(bus, lead=False)
        finally:
            stop.set()
            producer.join()
        sent = {frame.identifier for frame in log.frames if frame.identifier in (0x000, 0x601)}
    assert (error.letter, sent) == ("L", set())
    assert "another master's SYNC is on the bus" in str(error)


def test_a_different_rated_torque_fails_step_j_with_both_values(bus: str) -> None:
    error = _boot_fails(bus, rated_torque_Nm=2.4)
    assert error.letter == "J"
    assert "3 Nm" in str(error)
    assert "2.4 Nm" in str(error)


def test_only_differing_objects_are_written(bus: str) -> None:
    with open_network(bus, [1]) as network:
        first = boot(network, 1, DRIVE, SETTINGS)
        again = boot(network, 1, DRIVE, SETTINGS)
        # 6072h is not a communication object: the reset keeps it
        assert "6072h:0" not in " ".join(again.changed)
        assert {c.split(":")[0] for c in again.changed} == {
            "1006h",
            "1016h",
            "1017h",
            "1400h and 1600h",
            "1801h and 1A01h",
        }
        assert network.read_int(1, 0x1006) == 1000
        assert network.read_int(1, 0x1016, 1) == MASTER << 16 | 500
        assert network.read_int(1, 0x1017) == 100
        assert network.read_int(1, 0x6072) == 1000
    assert first.rated_torque_Nm == 3.0
    assert first.counts_per_turn == 8192
    assert first.device_name


def test_a_pdo_is_remapped_and_an_unused_one_is_disabled(bus: str) -> None:
    entries = tuple(reversed(DRIVE.tpdos[0].entries))
    tpdo = DRIVE.tpdos[0].model_copy(update={"entries": entries})
    profile = DRIVE.model_copy(update={"tpdos": (tpdo,)})
    with open_network(bus, [1]) as network:
        report = boot(network, 1, profile, SETTINGS)
        assert "1800h and 1A00h" in report.changed
        assert "1801h switched off" in report.changed
        mapped = [network.read_int(1, 0x1A00, sub) for sub in (1, 2, 3)]
        assert mapped == [0x60770010, 0x60640020, 0x60410010]
        assert network.read_int(1, 0x1801, 1) >> 31 == 1
        assert not network.read_int(1, 0x1800, 1) >> 31


def test_eight_drives_boot_at_the_same_time() -> None:
    simulator = start_simulator(nodes=8)
    nodes = list(range(1, 9))
    try:
        with open_network(simulator.bus, nodes) as network:
            assert network.clock.now_s == query_status(simulator.bus[7:])["bus_time_s"] == 0.0
            reports = boot_all(network, dict.fromkeys(nodes, (DRIVE, SETTINGS)))
            assert network.clock.now_s == query_status(simulator.bus[7:])["bus_time_s"] < 0.5
            assert [reports[node].node_id for node in nodes] == nodes
            for node in nodes:
                assert network.wait_for_heartbeat(node, 1.0) == 5
    finally:
        simulator.stop()


def test_all_boot_failures_are_reported_together(bus: str) -> None:
    with open_network(bus, [1, 8, 9]) as network, pytest.raises(BootError) as caught:
        boot_all(network, dict.fromkeys([1, 8, 9], (DRIVE, SETTINGS)))
    assert caught.value.node_id == 8
    assert any("node 9" in note for note in caught.value.__notes__)
