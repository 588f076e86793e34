"""SDO transfers of the master: long data, cancelling, duplicates, repeats, vanished devices."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import pytest

from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import SdoAbortError, SdoCancelledError, SdoTimeoutError
from tests.drivers.axis_rig import open_network
from tests.drivers.canopen.scripted_node import abort, endless, expedited, scripted

SCRIPTED = 9


@pytest.fixture(scope="module")
def bus(simulated_bus: str) -> str:
    """Return a bus that is not restarted between tests."""
    return simulated_bus


@pytest.fixture(scope="module")
def network(bus: str) -> Iterator[CanNetwork]:
    with open_network(bus, [1, 2, SCRIPTED], lead=False) as opened:
        yield opened


TIMEOUT = "cdpr_drivers.canopen.network.TIMEOUT_S"


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lengthen the wall-clock timeout, because the answering thread may have to wait for a core."""
    monkeypatch.setattr(TIMEOUT, 60.0)


# -- values that are read


def test_data_of_any_length_are_read_as_written(network: CanNetwork) -> None:
    for size in (1, 4, 5, 7, 8, 13, 889, 890, 2500):
        data = bytes((7 * k + size) & 0xFF for k in range(size))
        network.write_bytes(1, 0x2F10, 0, data)
        assert network.read_bytes(1, 0x2F10) == data


# -- abort codes


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (0x05040005, "out of memory"),
        (0x06040042, "PDO length exceeded"),
        (0x08000022, "present device state"),
        (0x06090099, "value error (not a standard code)"),
        (0xDEADBEEF, "not a standard code"),
    ],
)
def test_abort_codes_are_reported_as_text_and_as_a_number(
    network: CanNetwork, bus: str, code: int, words: str
) -> None:
    with (
        scripted(bus, SCRIPTED, lambda request: [abort(request, code)]),
        pytest.raises(SdoAbortError) as caught,
    ):
        network.read_int(SCRIPTED, 0x1000)
    assert caught.value.code == code
    assert f"node {SCRIPTED}: object 1000h:0 cannot be read: " in str(caught.value)
    assert words in str(caught.value)
    assert f"({code:08X}h)" in str(caught.value)


# -- cancelling


def test_a_transfer_of_a_task_is_cancelled(network: CanNetwork, bus: str) -> None:
    clock = network.clock
    assert not network.cancel(SCRIPTED)  # no transfer is running
    with scripted(bus, SCRIPTED, endless) as node:
        task = clock.start(lambda: network.read_bytes(SCRIPTED, 0x1008))
        assert clock.wait(lambda: len(node.requests) > 2 or task.done, clock.now_s + 60.0)
        assert network.cancel(SCRIPTED)
        assert clock.wait(lambda: task.done, clock.now_s + 60.0)
        end_s = clock.now_s + 60.0
        while node.requests[-1] != b"\x80\x08\x10\x00" + struct.pack("<I", 0x08000000):
            assert clock.now_s < end_s
            clock.sleep(0.01)
        told = f"node {SCRIPTED}: object 1008h:0 cannot be read: the transfer was cancelled"
        with pytest.raises(SdoCancelledError, match=told):
            task.result()
        # the next transfer works
        node.answer = lambda request: [expedited(request, 4711)]
        assert network.read_int(SCRIPTED, 0x1000) == 4711


def test_a_drive_serves_requests_after_a_cancelled_transfer(network: CanNetwork) -> None:
    network.write_bytes(1, 0x2F10, 0, bytes(6000))
    task = network.clock.start(lambda: network.read_bytes(1, 0x2F10))
    network.clock.sleep(0.001)
    assert network.cancel(1)
    network.clock.wait(lambda: task.done)
    with pytest.raises(SdoCancelledError):
        task.result()
    assert network.read_int(1, 0x1018, 1) == 0x00CD9A01


# -- errors on the wire


def test_duplicate_answers_are_ignored_and_counted(network: CanNetwork, bus: str) -> None:
    values = {0x1000: 1, 0x1001: 2, 0x1014: 3, 0x1006: 4, 0x1005: 5}

    def answer(request: bytes) -> list[bytes]:
        index = int.from_bytes(request[1:3], "little")
        return [expedited(request, values[index])] * 2

    with scripted(bus, SCRIPTED, answer):
        for _ in range(3):
            for index, value in values.items():
                assert network.read_int(SCRIPTED, index) == value
    assert network.clients[SCRIPTED].unexpected >= 3
    assert "two devices have this node id" in network.duplicate_node(SCRIPTED)


def test_duplicate_segments_do_not_duplicate_data(network: CanNetwork, bus: str) -> None:
    text = b"abcdefghijklmnopqrst"
    parts = [text[:7], text[7:14], text[14:]]
    sent = 0

    def answer(request: bytes) -> list[bytes]:
        nonlocal sent
        if request[0] == 0x40:
            return [b"\x41" + request[1:4] + struct.pack("<I", len(text))] * 2
        part = parts[sent]
        sent += 1
        command = request[0] & 0x10 | (7 - len(part)) << 1 | (sent == 3)
        return [bytes([command]) + part] * 2

    with scripted(bus, SCRIPTED, answer):
        assert network.read_bytes(SCRIPTED, 0x1008) == text


def test_a_lost_request_is_repeated(
    network: CanNetwork, bus: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(TIMEOUT, 0.5)

    def answer(request: bytes) -> list[bytes]:
        asked.append(request)
        first = sum(r[0] == 0x40 for r in asked) == 1
        return [] if first or request[0] != 0x40 else [expedited(request, 7)]

    asked: list[bytes] = []
    with scripted(bus, SCRIPTED, answer):
        assert network.read_int(SCRIPTED, 0x1000) == 7
    assert [request[0] for request in asked] == [0x40, 0x80, 0x40]  # the first request timed out


def test_a_drive_that_vanishes_during_a_transfer_is_reported_and_the_other_works(
    network: CanNetwork, monkeypatch: pytest.MonkeyPatch
) -> None:
    network.write_bytes(1, 0x2F10, 0, bytes(700))
    network.write(1, 0x2F00, 10, 5)  # permanently: no later test may need drive 1
    monkeypatch.setattr(TIMEOUT, 0.5)
    with pytest.raises(SdoTimeoutError) as caught:
        network.read_bytes(1, 0x2F10)
    assert "node 1: object 2F10h:0 cannot be read: no answer within 0.5 s" in str(caught.value)
    assert network.read_int(2, 0x1018, 1) == 0x00CD9A01
