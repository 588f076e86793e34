"""SDO transfers of the `canopen` library's client are recorded on the bus and decoded."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress

import can
import canopen
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdpr_drivers.decode import Decoder, Frame, KnownNode, Record
from cdpr_drivers.decode.sdo import SdoDecoder, SdoEvent, Step
from cdpr_profiles import load_winch

WINCH = load_winch("winch-mpp0923d")
USER_DATA = 0x2F10
Overhear = Callable[[], list[can.Message]]


@pytest.fixture(scope="module")
def client(simulated_bus: str) -> Iterator[canopen.RemoteNode]:
    """Yield a third-party client of drive 1."""
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.02
    network.connect(interface="simbus", channel=simulated_bus.partition(":")[2])
    node = network.add_node(1, str(WINCH.drive.eds))
    node.sdo.RESPONSE_TIMEOUT = 5.0
    yield node
    network.disconnect()


@pytest.fixture(scope="module")
def overhear(simulated_bus: str) -> Iterator[Overhear]:
    """Yield a function that returns the SDO frames since its last call."""
    name = simulated_bus.partition(":")[2]
    sdo: list[can.typechecking.CanFilter] = [
        {"can_id": 0x581, "can_mask": 0x7FF},
        {"can_id": 0x601, "can_mask": 0x7FF},
    ]
    with can.Bus(name, "simbus", can_filters=sdo) as bus:

        def passed() -> list[can.Message]:
            messages = []
            while (message := bus.recv(0.05)) is not None:
                messages.append(message)
            return messages

        yield passed


def events(messages: list[can.Message]) -> list[SdoEvent]:
    watch = SdoDecoder()
    return [
        (watch.request if m.arbitration_id == 0x601 else watch.response)(bytes(m.data))
        for m in messages
    ]


def texts(messages: list[can.Message]) -> list[Record]:
    decoder = Decoder({1: KnownNode.of_winch(WINCH)})
    return [decoder.decode(Frame(0.0, m.arbitration_id, bytes(m.data))) for m in messages]


def one(found: list[SdoEvent], step: Step) -> SdoEvent:
    (event,) = [event for event in found if event.step is step]
    return event


VALUES = st.binary(min_size=1, max_size=40) | st.binary(min_size=880, max_size=900)
overheard = settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])


@overheard
@given(value=VALUES)
def test_segmented_and_expedited_values_are_reassembled(
    client: canopen.RemoteNode, overhear: Overhear, value: bytes
) -> None:
    overhear()
    client.sdo.download(USER_DATA, 0, value, force_segment=len(value) % 2 == 0)
    assert client.sdo.upload(USER_DATA, 0) == value
    found = events(overhear())
    assert one(found, Step.WRITTEN).data == value
    read = one(found, Step.VALUE)
    assert (read.index, read.sub, read.data) == (USER_DATA, 0, value)
    assert not [event for event in found if event.step is Step.UNEXPECTED]


@overheard
@given(value=VALUES)
def test_block_transfers_are_reassembled(
    client: canopen.RemoteNode, overhear: Overhear, value: bytes
) -> None:
    overhear()
    with client.sdo[USER_DATA].open("wb", block_transfer=True, size=len(value)) as stream:
        stream.write(value)
    with client.sdo[USER_DATA].open("rb", block_transfer=True) as stream:
        assert stream.read() == value
    found = events(overhear())
    assert one(found, Step.WRITTEN).data == value
    assert one(found, Step.VALUE).data == value
    assert not [event for event in found if event.step is Step.UNEXPECTED]


def test_transfers_are_described_as_text(client: canopen.RemoteNode, overhear: Overhear) -> None:
    overhear()
    client.sdo[0x6072].raw = 500
    client.sdo.upload(0x1018, 2)
    client.sdo.upload(0x1008, 0)
    with suppress(canopen.SdoAbortedError):
        client.sdo.upload(0x5FFF, 3)
    told = [record.text for record in texts(overhear())]
    assert "-> write 6072h Max torque = 1.5000 Nm" in told
    assert "<- 1018h:2 Identity object: Product code = 00000402h" in told
    assert "<- 1008h Manufacturer device name = 'Generic CiA 402 torque servo'" in told
    assert told[-1] == "<- abort 5FFFh:3: object does not exist (06020000h)"


def test_an_abort_is_marked_as_problem(client: canopen.RemoteNode, overhear: Overhear) -> None:
    overhear()
    with pytest.raises(canopen.SdoAbortedError):
        client.sdo.download(0x1018, 1, bytes(4))
    asked, refused = texts(overhear())
    assert not asked.problem
    assert refused.problem
    assert "attempt to write a read only object (06010002h)" in refused.text


def test_no_value_is_reported_if_a_segment_is_missing(
    client: canopen.RemoteNode, overhear: Overhear
) -> None:
    client.sdo.download(USER_DATA, 0, bytes(range(60)))
    overhear()
    client.sdo.upload(USER_DATA, 0)
    passed = overhear()
    with client.sdo[USER_DATA].open("rb", block_transfer=True) as stream:
        stream.read()
    in_blocks = overhear()
    # frame 3 is the first segment of the value, frame 5 of the block
    for messages, missing in ((passed, 3), (in_blocks, 5)):
        assert one(events(messages), Step.VALUE).data == bytes(range(60))
        gap = messages[:missing] + messages[missing + 1 :]
        assert one(events(gap), Step.VALUE).data is None


def test_no_value_is_reported_if_the_start_of_a_transfer_is_missing(
    client: canopen.RemoteNode, overhear: Overhear
) -> None:
    client.sdo.download(USER_DATA, 0, bytes(range(60)))
    overhear()
    client.sdo.upload(USER_DATA, 0)
    found = events(overhear()[4:])
    assert not [event for event in found if event.data is not None]


def test_ratings_and_pdo_maps_read_by_sdo_are_used_for_decoding(
    client: canopen.RemoteNode, overhear: Overhear
) -> None:
    overhear()
    for index, sub in ((0x6076, 0), (0x608F, 1), *((0x1A00, entry) for entry in range(4))):
        client.sdo.upload(index, sub)
    drive = KnownNode(WINCH.drive.model_copy(update={"tpdos": (), "rpdos": ()}))
    decoder = Decoder(others=drive)
    feedback = Frame(0.0, 0x181, bytes.fromhex("3706 00080000 E803"))
    assert "map unknown" in decoder.decode(feedback).text
    for message in overhear():
        decoder.decode(Frame(0.0, message.arbitration_id, bytes(message.data)))
    assert decoder.decode(feedback).text == (
        "Statusword operation enabled, target reached (0637h); "
        "Position actual value 90.000 deg; Torque actual value 3.0000 Nm"
    )
