"""Booting several nodes: optional nodes, the order of starting, and duplicate node ids."""

from __future__ import annotations

import itertools
import re
import threading
import time
from dataclasses import replace

import can
import pytest

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.canopen.boot import boot, boot_all, flood_text
from cdpr_drivers.errors import BootError
from cdpr_profiles import Pdo
from cdpr_profiles.drive import Quirks
from cdpr_rt.core.clock import PacedClock
from tests.drivers.axis_rig import DRIVE, MASTER, SETTINGS, open_network
from tests.drivers.canopen.scripted_node import ScriptedNode, expedited, scripted

OPTIONAL = replace(SETTINGS, mandatory=False)
WRONG = DRIVE.model_copy(update={"product_code": 0x1234})


def test_a_missing_optional_node_is_reported_and_the_others_start(bus: str) -> None:
    drives = {1: (DRIVE, SETTINGS), 2: (DRIVE, OPTIONAL), 9: (DRIVE, OPTIONAL)}
    with open_network(bus, [1, 2, 9]) as network:
        reports = boot_all(network, drives)
        assert sorted(reports) == [1, 2]
        assert reports[2].counts_per_turn == 8192
        assert list(reports.missing) == [9]
        assert reports.missing[9].letter == "B"
        assert [network.wait_for_heartbeat(node, 2.0) for node in (1, 2)] == [5, 5]
        assert network.alarm_text == ""


def test_an_optional_node_with_a_wrong_identity_is_not_started(bus: str) -> None:
    with open_network(bus, [1, 2]) as network:
        reports = boot_all(network, {1: (DRIVE, SETTINGS), 2: (WRONG, OPTIONAL)})
        assert reports.missing[2].letter == "M"
        network.write(2, 0x1017, 0, 100)
        assert network.wait_for_heartbeat(2, 2.0) == 127
        assert network.wait_for_heartbeat(1, 2.0) == 5


def test_no_node_is_started_when_a_mandatory_node_fails(bus: str) -> None:
    with open_network(bus, [1, 2]) as network:
        with pytest.raises(BootError) as caught:
            boot_all(network, {1: (DRIVE, SETTINGS), 2: (WRONG, SETTINGS)})
        assert (caught.value.letter, caught.value.node_id) == ("M", 2)
        assert network.wait_for_heartbeat(1, 2.0) == 127


def test_a_single_booted_node_is_mandatory(bus: str) -> None:
    with open_network(bus, [2]) as network, pytest.raises(BootError) as caught:
        boot(network, 2, WRONG, OPTIONAL)
    assert caught.value.letter == "M"


def test_another_master_fails_the_boot_of_all_optional_nodes(bus: str) -> None:
    with (
        open_network(bus, [1, 2], lead=False) as network,
        scripted(bus, 9, lambda _request: []) as other,
    ):
        other.send(0x700 + MASTER, b"\x05")
        with pytest.raises(BootError) as caught:
            boot_all(network, {1: (DRIVE, OPTIONAL), 2: (DRIVE, OPTIONAL)})
    assert caught.value.letter == "L"


# -- two devices with one node id


@pytest.mark.parametrize("serial", [None, 0x1234], ids=["any serial number", "another one"])
def test_two_answers_to_each_request_indicate_a_duplicate_node_id(
    bus: str, serial: int | None
) -> None:
    """A duplicate node id is reported before a wrong identity, which it explains."""
    profile = DRIVE.model_copy(update={"serial": serial})

    def answer(request: bytes) -> list[bytes]:
        time.sleep(0.0005)
        return [expedited(request, 0x00020192)] if request[0] == 0x40 else []

    with (
        scripted(bus, 1, answer),
        open_network(bus, [1], lead=False) as network,
        pytest.raises(BootError) as caught,
    ):
        boot(network, 1, profile, SETTINGS)
    assert caught.value.letter == "B"
    assert "two devices have this node id" in str(caught.value)


class _Second(ScriptedNode):
    """A device that boots with the first one and sends nothing else."""

    def boot_with(self) -> None:
        self.bus.set_filters([{"can_id": 0, "can_mask": 0x7FF, "extended": False}])

    def _serve(self) -> None:
        self.boot_with()
        for _ in itertools.takewhile(lambda _: not self._stop.is_set(), itertools.count()):
            message = self.bus.recv(0.05)
            if message is not None and message.arbitration_id == 0 and message.data[0] == 130:
                time.sleep(0.02)
                self.send(0x700 + self.node_id, b"\0")


def test_two_boot_ups_after_one_reset_indicate_a_duplicate_node_id(bus: str) -> None:
    second = _Second(bus, 1, lambda _request: [])
    try:
        with open_network(bus, [1], lead=False) as network, pytest.raises(BootError) as caught:
            boot(network, 1, DRIVE, SETTINGS)
    finally:
        second.close()
    assert caught.value.letter == "B"
    assert "2 boot-up messages followed one reset" in str(caught.value)
    assert "a different node id" in str(caught.value)


def test_a_drive_whose_profile_says_that_it_boots_twice_is_one_device(bus: str) -> None:
    twice = DRIVE.model_copy(update={"quirks": Quirks(boot_ups=2)})
    second = _Second(bus, 1, lambda _request: [])
    try:
        with open_network(bus, [1], lead=False) as network:
            assert boot(network, 1, twice, SETTINGS).counts_per_turn == 8192
            assert network.alarm_text == ""
    finally:
        second.close()


def test_the_drives_rejection_of_a_too_long_pdo_is_reported_as_text(bus: str) -> None:
    """The profile would reject the map: this one bypasses its validation."""
    tpdo = DRIVE.tpdos[0]
    wide = tpdo.entries[1].model_copy(update={"index": 0x606C})
    entries = (*tpdo.entries, wide)  # 16 + 32 + 16 + 32 bits
    with pytest.raises(ValueError, match="96 bits; allowed: at most 64 in one frame"):
        Pdo.model_validate(tpdo.model_dump() | {"entries": entries})
    profile = DRIVE.model_copy(update={"tpdos": (tpdo.model_copy(update={"entries": entries}),)})
    with open_network(bus, [1]) as network, pytest.raises(BootError) as caught:
        boot(network, 1, profile, SETTINGS)
    assert caught.value.letter == "J"
    assert "object 1A00h:0 cannot be set to 04h" in str(caught.value)
    assert "PDO length exceeded (06040042h)" in str(caught.value)


def test_the_identifier_that_floods_the_bus_is_reported_with_a_missing_answer(bus: str) -> None:
    stop = threading.Event()

    def babble() -> None:
        with can.Bus(interface="simbus", channel=bus[7:], can_filters=[]) as babbler:
            message = can.Message(arbitration_id=0x12A, data=bytes(8), is_extended_id=False)
            while not stop.is_set():
                for _ in range(100):
                    babbler.send(message)
                time.sleep(0.005)

    thread = threading.Thread(target=babble)
    thread.start()
    try:
        with open_network(bus, [1, 9], lead=False) as network, pytest.raises(BootError) as caught:
            boot_all(network, dict.fromkeys([1, 9], (DRIVE, SETTINGS)))
        told = flood_text(BusUrl.parse(bus), PacedClock(), 125_000)
    finally:
        stop.set()
        thread.join()
    assert caught.value.node_id == 9  # the other drive boots
    (note,) = caught.value.__notes__
    assert "the bus is flooded" in note
    assert "identifier 12Ah (node 42 by the usual numbering)" in note
    load = re.search(r"flooded: (\d+)% load", told)
    assert load and int(load[1]) > 400, "load of a bus eight times slower"


def test_a_quiet_or_missing_bus_is_not_flooded(bus: str) -> None:
    assert flood_text(BusUrl.parse(bus), PacedClock()) == ""
    assert flood_text(BusUrl.parse("simbus:nobody-here"), PacedClock()) == ""
