"""Devices that follow the standard in a different way, or violate it in one point each."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Iterator
from functools import partial

import canopen
import pytest

from cdpr_drivers.canopen.boot import boot
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.canopen.sdo import SdoClient
from cdpr_drivers.errors import BootError, SdoAbortError, SdoTimeoutError
from tests.drivers.axis_rig import DRIVE, SETTINGS, dictionary, open_network
from tests.drivers.canopen.scripted_node import Answer, abort, expedited, scripted

FOREIGN_NODE = 9


@pytest.fixture
def network(simulated_bus: str) -> Iterator[CanNetwork]:
    with open_network(simulated_bus, [FOREIGN_NODE], lead=False) as opened:
        yield opened


# -- a third-party slave with the objects that the standard requires


@pytest.fixture
def stock(simulated_bus: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[canopen.LocalNode]:
    # wall-clock time: a slave in this process may have to wait for a core
    monkeypatch.setattr("cdpr_drivers.canopen.boot._BOOT_UP_TIMEOUT_S", 60.0)
    monkeypatch.setattr("cdpr_drivers.canopen.network.TIMEOUT_S", 60.0)
    third_party = canopen.Network()
    third_party.NOTIFIER_CYCLE = 0.02
    third_party.connect(interface="simbus", channel=simulated_bus[7:])
    lean = dictionary(FOREIGN_NODE)
    identity = lean[0x1018]
    assert isinstance(identity, canopen.objectdictionary.ODRecord)
    for sub in (2, 3, 4):
        del identity[sub]
    del lean[0x1008]
    node = third_party.create_node(FOREIGN_NODE, lean)

    def restart(can_id: int, data: bytearray, time_s: float) -> None:
        if data[0] not in (129, 130):
            node.nmt.on_command(can_id, data, time_s)
            return
        # otherwise one of its heartbeats could look like a second boot-up message
        node.nmt.stop_heartbeat()
        node.nmt.send_command(130)
        node.nmt.state = "PRE-OPERATIONAL"  # otherwise it takes its heartbeats for boot-ups

    third_party.unsubscribe(0, node.nmt.on_command)
    third_party.subscribe(0, restart)
    node.nmt.state = "PRE-OPERATIONAL"
    try:
        yield node
    finally:
        third_party.disconnect()


def _no_more_than_mapped(node: canopen.LocalNode) -> Callable[..., None]:
    def on_read(index: int, subindex: int, **_more: object) -> None:
        if 0x1A00 <= index < 0x1C00 and subindex and subindex > node.get_data(index, 0)[0]:
            raise canopen.SdoAbortedError(0x06090011)

    return on_read


LEAN = DRIVE.model_copy(update=dict.fromkeys(("product_code", "revision", "serial")))


def test_optional_objects_may_be_missing(stock: canopen.LocalNode, network: CanNetwork) -> None:
    stock.set_data(0x1A00, 0, b"\0")
    stock.add_read_callback(_no_more_than_mapped(stock))  # type: ignore[no-untyped-call]
    report = boot(network, FOREIGN_NODE, LEAN, SETTINGS)
    assert (report.vendor_id, report.product_code, report.serial) == (0x00CD9A01, 0, 0)
    assert report.device_name == ""
    assert "1800h and 1A00h" in report.changed
    assert stock.get_data(0x1A00, 2) == bytes.fromhex("20006460")


def test_objects_required_by_the_profile_must_exist(
    stock: canopen.LocalNode, network: CanNetwork
) -> None:
    with pytest.raises(BootError, match=r"step M.*product code is not there") as caught:
        boot(network, FOREIGN_NODE, DRIVE, SETTINGS)
    assert caught.value.letter == "M"
    assert stock.nmt.state == "PRE-OPERATIONAL"


def test_an_sdo_abort_at_boot_is_not_reported_as_silence(
    simulated_bus: str, network: CanNetwork
) -> None:
    with (
        scripted(simulated_bus, FOREIGN_NODE, lambda request: [abort(request, 0x08000022)]),
        pytest.raises(BootError, match=r"step B.*present device state") as caught,
    ):
        boot(network, FOREIGN_NODE, DRIVE, SETTINGS)
    assert "wiring" not in str(caught.value)


# -- SDO servers that break the protocol


def _long(request: bytes, size: int) -> bytes:
    return b"\x41" + request[1:4] + struct.pack("<I", size)


def _wrong_object(request: bytes) -> list[bytes]:
    return [expedited(b"\0" + b"\x01\x10\0", 5)] if request[0] == 0x40 else []


def _wrong_toggle(request: bytes) -> list[bytes]:
    if request[0] == 0x40:
        return [_long(request, 14)]
    return [bytes([~request[0] & 0x10]) + bytes(7)] if request[0] >> 5 == 3 else []


def _too_long(request: bytes) -> list[bytes]:
    if request[0] == 0x40:
        return [_long(request, 10)]
    return [bytes([request[0] & 0x10]) + bytes(7)] if request[0] >> 5 == 3 else []


def _empty_segments(request: bytes) -> list[bytes]:
    if request[0] == 0x40:
        return [b"\x40" + request[1:4]]
    return [bytes([request[0] & 0x10 | 0x0E])] if request[0] >> 5 == 3 else []


def _abort_later(request: bytes) -> list[bytes]:
    if request[0] == 0x40:
        return [_long(request, 14)]
    return [b"\x80\x08\x10\0" + struct.pack("<I", 0x06060000)]


@pytest.mark.parametrize(
    ("answer", "kind", "told"),
    [
        (_wrong_object, SdoTimeoutError, "frames that do not answer the request: 1"),
        (_wrong_toggle, SdoTimeoutError, "frames that do not answer the request: 1"),
        (_too_long, SdoAbortError, "06070010h"),
        (_empty_segments, SdoAbortError, "out of memory"),
        (_abort_later, SdoAbortError, "hardware error"),
    ],
)
def test_a_faulty_transfer_fails_with_its_reason_and_the_next_one_works(
    simulated_bus: str,
    network: CanNetwork,
    monkeypatch: pytest.MonkeyPatch,
    answer: Answer,
    kind: type[Exception],
    told: str,
) -> None:
    send = partial(network.send, 0x600 + FOREIGN_NODE)
    network.clients[FOREIGN_NODE] = SdoClient(send, network.clock, most_bytes=700)
    waits = kind is SdoTimeoutError
    monkeypatch.setattr("cdpr_drivers.canopen.network.TIMEOUT_S", 1.0 if waits else 60.0)
    with scripted(simulated_bus, FOREIGN_NODE, answer) as node:
        with pytest.raises(kind) as caught:
            network.read_bytes(FOREIGN_NODE, 0x1008)
        assert told in str(caught.value)
        monkeypatch.setattr("cdpr_drivers.canopen.network.TIMEOUT_S", 60.0)
        node.answer = lambda request: [expedited(request, 4711)]
        assert network.read_int(FOREIGN_NODE, 0x1000) == 4711


def test_a_flood_of_answers_does_not_fill_the_memory(
    simulated_bus: str, network: CanNetwork
) -> None:
    with scripted(simulated_bus, FOREIGN_NODE, lambda request: [expedited(request, 4711)]) as node:
        for k in range(3000):
            node.send(0x580 + FOREIGN_NODE, bytes(8))
            if k % 100 == 0:
                time.sleep(0.002)
        network.clock.sleep(0.1)
        assert network.read_int(FOREIGN_NODE, 0x1000) == 4711
        waiting = network.clients[FOREIGN_NODE].unexpected
    assert 100 < waiting < 2000
