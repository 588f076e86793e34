"""Frames are decoded to text: frames of the `canopen` library, handmade ones, and garbage."""

from __future__ import annotations

import datetime
import math
import struct
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import can
import canopen
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drivers.decode import Decoder, Frame, KnownNode, Record, format_line, parse_line
from cdpr_profiles import DriveProfile, Pdo, PdoEntry, load_winch

WINCH = load_winch("winch-mpp0923d")
KNOWN = KnownNode.of_winch(WINCH)


def decoded(identifier: int, data: bytes | str, known: KnownNode = KNOWN) -> Record:
    raw = bytes.fromhex(data) if isinstance(data, str) else data
    return Decoder({1: known}).decode(Frame(0.0, identifier, raw))


def values(record: Record) -> dict[int, Any]:
    return {field.index: (field.value, field.unit) for field in record.fields}


# -- process data


def pdo(dictionary: canopen.ObjectDictionary, entries: dict[int, int]) -> bytes:
    """Encode a PDO with the canopen library."""
    map_ = canopen.RemoteNode(1, dictionary).rpdo[1]
    map_.clear()
    variables = [map_.add_variable(index) for index in entries]
    for variable, value in zip(variables, entries.values(), strict=True):
        variable.raw = value
    return bytes(map_.data)


DICTIONARY = canopen.import_od(str(WINCH.drive.eds), 1)


@given(st.integers(0, 0xFFFF), st.integers(-(2**31), 2**31 - 1), st.integers(-32768, 32767))
def test_feedback_is_decoded_to_si_units(status: int, position: int, torque: int) -> None:
    data = pdo(DICTIONARY, {0x6041: status, 0x6064: position, 0x6077: torque})
    record = decoded(0x181, data)
    assert (record.kind, record.node_id, record.problem) == ("TPDO1", 1, False)
    told = values(record)
    assert f"({status:04X}h)" in told[0x6041][0]
    assert told[0x6064] == (pytest.approx(position * 360 / 8192), "deg")
    assert told[0x6077] == (pytest.approx(torque * 3.0 / 1000), "Nm")
    assert record.fields[2].text == f"{torque * 3.0 / 1000:.4f} Nm"


@given(st.integers(0, 0xFFFF), st.integers(-32768, 32767))
def test_commands_are_decoded(control: int, torque: int) -> None:
    record = decoded(0x201, pdo(DICTIONARY, {0x6040: control, 0x6071: torque}))
    assert record.kind == "RPDO1"
    assert f"({control:04X}h)" in record.text
    assert values(record)[0x6071] == (pytest.approx(torque * 3.0 / 1000), "Nm")


def drive(**changes: Any) -> DriveProfile:
    return WINCH.drive.model_copy(update=changes)


@pytest.mark.parametrize(
    ("known", "position", "torque"),
    [
        (KNOWN, (90.0, "deg"), (0.3, "Nm")),
        (replace(KNOWN, drive=drive(torque_sign=-1)), (90.0, "deg"), (-0.3, "Nm")),
        (replace(KNOWN, drive=drive(position_sign=-1)), (-90.0, "deg"), (0.3, "Nm")),
        (replace(KNOWN, drive=drive(torque_unit="mNm")), (90.0, "deg"), (0.1, "Nm")),
        (replace(KNOWN, drive=drive(torque_unit="percent_of_rated")), (90.0, "deg"), (3.0, "Nm")),
        (KnownNode(WINCH.drive), (2048.0, "counts"), (100.0, "per mille of rated")),
        (KnownNode(drive(torque_unit="mNm")), (2048.0, "counts"), (0.1, "Nm")),
    ],
)
def test_units_follow_the_profile(
    known: KnownNode, position: tuple[float, str], torque: tuple[float, str]
) -> None:
    told = values(decoded(0x181, struct.pack("<Hih", 0x237, 2048, 100), known))
    assert told[0x6064] == (pytest.approx(position[0]), position[1])
    assert told[0x6077] == (pytest.approx(torque[0]), torque[1])


@pytest.mark.parametrize(
    ("index", "sub", "text"),
    [
        (0x6099, 0, "2"),
        (0x6099, 1, "90.000 deg/s"),
        (0x6081, 0, "90.000 deg/s"),
        (0x60FF, 0, "-90.000 deg/s"),
    ],
)
def test_speeds_ignore_the_position_sign_and_counts_have_no_unit(
    index: int, sub: int, text: str
) -> None:
    number = 2048 if sub or index != 0x6099 else 2
    answer = struct.pack("<BHBI", 0x43, index, sub, number)
    known = replace(KNOWN, drive=drive(position_sign=-1))
    assert decoded(0x581, answer, known).text.endswith(f" = {text}")


def test_statuswords_and_controlwords_are_decoded_to_text() -> None:
    for word, state in (
        (0x0000, "not ready to switch on"),
        (0x0237, "operation enabled"),
        (0x0217, "quick stop active"),
        (0x0218, "fault"),
    ):
        text = decoded(0x181, struct.pack("<Hih", word, 0, 0)).fields[0].text
        assert text.startswith(state)
        assert ("not remote" in text) == (word == 0)
    for word, command in (
        (0x00, "disable voltage"), (0x0F, "enable operation"), (0x80, "fault reset"),
        (0x10F, "enable operation, halt"),
    ):  # fmt: skip
        field = decoded(0x201, struct.pack("<Hh", word, 0)).fields[0]
        assert field.text == f"{command} ({word:04X}h)"


def test_mode_specific_bits_are_decoded_only_if_the_mode_is_known() -> None:
    decoder = Decoder({1: KNOWN})
    feedback = Frame(0.0, 0x181, struct.pack("<Hih", 0x1637, 0, 0))
    assert "homed" not in decoder.decode(feedback).text
    decoder.decode(Frame(0.0, 0x281, struct.pack("<bHi", 6, 0, 0)))
    assert "homed" in decoder.decode(feedback).text
    decoder.decode(Frame(0.0, 0x281, struct.pack("<bHi", 10, 0, 0)))
    assert "follows commands" in decoder.decode(feedback).text
    decoder.decode(Frame(0.0, 0x701, b"\0"))  # the mode is unknown after a boot-up
    assert "follows commands" not in decoder.decode(feedback).text


def test_a_pdo_that_does_not_fit_its_map_is_reported() -> None:
    short = decoded(0x181, "3702 00080000")
    assert short.problem
    assert "6 bytes, too few for the map" in short.text
    assert "90.000 deg" in short.text  # the bytes that exist are decoded
    long = decoded(0x201, "0F00 6400 FF")
    assert long.problem
    assert "1 bytes more than mapped: FF" in long.text


def test_pdos_without_a_profile_are_shown_as_bytes() -> None:
    record = Decoder().decode(Frame(0.0, 0x395, b"\x12\x34"))
    assert (record.kind, record.node_id, record.text) == ("TPDO3", 0x15, "map unknown: 12 34")
    assert not record.problem


def test_pdos_with_custom_identifiers_and_gaps_are_decoded() -> None:
    entries = tuple(PdoEntry(index=i, bits=b) for i, b in ((0x0005, 8), (0x6041, 16), (0x606C, 32)))
    moved = Pdo(number=3, cob_id_offset=0x18A, transmission_type=1, entries=entries)
    known = replace(KNOWN, drive=drive(tpdos=(moved,), velocity_unit="rpm"))
    record = decoded(0x18B, struct.pack("<BHi", 0xEE, 0x237, 10), known)
    assert (record.kind, record.node_id) == ("TPDO3", 1)
    assert [field.index for field in record.fields] == [0x6041, 0x606C]
    assert values(record)[0x606C] == (pytest.approx(10 * 6.0), "deg/s")


# -- other services, sent by the canopen library


@pytest.fixture
def third_party() -> Iterator[tuple[canopen.Network, can.BusABC]]:
    """Yield a network of the canopen library and a listener."""
    with can.Bus("decode", "virtual") as bus, can.Bus("decode", "virtual") as ear:
        network = canopen.Network(bus)
        yield network, ear


def heard(ear: can.BusABC) -> list[Record]:
    decoder = Decoder({1: KNOWN})
    records = []
    while (message := ear.recv(0)) is not None:
        records.append(decoder.decode(Frame(0.0, message.arbitration_id, bytes(message.data))))
    return records


def test_network_management_is_decoded(third_party: tuple[canopen.Network, can.BusABC]) -> None:
    network, ear = third_party
    node = network.add_node(5, DICTIONARY)
    node.nmt.state = "OPERATIONAL"
    network.nmt.state = "RESET COMMUNICATION"
    network.sync.transmit()
    network.sync.transmit(7)
    network.time.transmit(datetime.datetime(2026, 5, 4, 3, 2, 1, 500000).timestamp())
    start, reset, sync, counted, time = heard(ear)
    assert (start.kind, start.text) == ("NMT", "start: node 5")
    assert reset.text == "reset communication: all nodes"
    assert (sync.kind, sync.text) == ("SYNC", "")
    assert counted.text == "counter 7"
    assert time.kind == "TIME"
    assert time.text.startswith("2026-05-0")
    assert time.text.endswith(":02:01.500")


def test_heartbeats_and_emergencies_are_decoded(
    third_party: tuple[canopen.Network, can.BusABC],
) -> None:
    network, ear = third_party
    node = canopen.LocalNode(3, DICTIONARY)
    network.add_node(node)
    node.nmt.send_command(0)
    heard(ear)
    node.emcy.send(0x8611, 0x21, b"\1\2")
    node.emcy.reset()
    fault, gone = heard(ear)
    assert (fault.kind, fault.node_id, fault.problem) == ("EMCY", 3, True)
    assert fault.text == (
        "8611h following error; error register 21h (generic, device profile); "
        "manufacturer 01 02 00 00 00"
    )
    assert not gone.problem
    for state, text in ((0, "boot-up"), (4, "stopped"), (5, "operational"), (127, "pre-oper")):
        record = decoded(0x703, bytes([state]))
        assert (record.kind, record.node_id, record.problem) == ("heartbeat", 3, False)
        assert record.text.startswith(text)
    assert decoded(0x703, "11").problem


def test_layer_setting_services_are_decoded(
    third_party: tuple[canopen.Network, can.BusABC],
) -> None:
    network, ear = third_party
    lss = network.lss
    lss.RESPONSE_TIMEOUT = 0.01
    lss.send_switch_state_global(lss.CONFIGURATION_STATE)
    for ask in (
        lambda: lss.send_switch_state_selective(0xCD9A01, 0x402, 0x10000, 0x17),
        lambda: lss.configure_node_id(8),
        lambda: lss.configure_bit_timing(2),
        lss.store_configuration,
        lss.inquire_node_id,
        lambda: lss.inquire_lss_address(0x5A),
        lss.fast_scan,
    ):
        with suppress(canopen.lss.LssError):
            ask()  # no device answers
    records = heard(ear)
    assert {record.kind for record in records} == {"LSS"}
    told = [record.text for record in records]
    assert told == [
        "-> all to configuration",
        "-> select by vendor 00CD9A01h",
        "-> select by product 00000402h",
        "-> select by revision 00010000h",
        "-> select by serial 00000017h",
        "-> configure node id 8",
        "-> configure bit rate 500 kbit/s",
        "-> store the configuration",
        "-> report your node id",
        "-> report your vendor",
        "-> fast scan: start again",
    ]
    assert decoded(0x7E4, "5A 019ACD00 000000").text == "<- vendor is 00CD9A01h"
    assert decoded(0x7E4, "11 00 00 0000000000").text == "<- node id: done"
    refused = decoded(0x7E4, "11 01 00 0000000000")
    assert refused.problem
    assert decoded(0x7E4, "4F 00 00 0000000000").text.endswith("of this identity is here")


@pytest.mark.parametrize(
    ("classes", "data", "text"),
    [
        (0x040, "", "bus-off"),
        (0x004, "0030", "controller: receive error-passive, transmit error-passive"),
        (0x204, "0008000000006000", "controller: transmit warning; error counters: transmit 96"),
        (
            0x00C,
            "00010400",
            "controller: receive overflow, frames lost; protocol violation: stuffing",
        ),
        (0x020, "", "no acknowledge"),
    ],
)
def test_error_frames_are_decoded(classes: int, data: str, text: str) -> None:
    frame = Frame(0.0, classes, bytes.fromhex(data).ljust(8, b"\0"), error=True)
    record = Decoder().decode(frame)
    assert record.problem
    assert record.text.startswith(text)


def test_frames_outside_canopen_are_shown_raw() -> None:
    decoder = Decoder()
    extended = decoder.decode(Frame(0.0, 0x181, b"\1", extended=True))
    assert (extended.kind, extended.node_id) == ("frame", None)
    assert decoder.decode(Frame(0.0, 0x701, b"", remote=True)).text == "requested (node guarding)"
    assert decoder.decode(Frame(0.0, 0x7FF, b"\1")).text == "no CANopen identifier: 01"


# -- arbitrary frames

IDENTIFIERS = st.integers(0, 0x7FF) | st.sampled_from(
    [0, 0x80, 0x81, 0x100, 0x181, 0x201, 0x281, 0x581, 0x581, 0x601, 0x601, 0x701, 0x7E4, 0x7E5]
)
COMMAND_BYTES = st.sampled_from(
    bytes.fromhex("00 20 21 22 2F 40 41 43 60 70 80 A0 A1 A2 A3 C0 C1 C2 01 81 85 10 11")
)
SDO_LIKE = st.tuples(
    COMMAND_BYTES,
    st.sampled_from([0x6041, 0x1A00, 0x1800, 0x1400, 0x1600, 0x6076, 0x608F, 0x1008, 0x2F10]),
    st.integers(0, 9),
    st.binary(min_size=4, max_size=4),
).map(lambda t: struct.pack("<BHB4s", *t))
FRAMES = st.tuples(
    IDENTIFIERS,
    st.binary(max_size=8) | SDO_LIKE,
    st.sampled_from([0, 0, 0, 0, 0, 0, 0x20000000, 0x40000000, 0x80000000, 0xE0000000]),
    st.integers(0, 255),
)


@settings(max_examples=100)
@given(st.lists(FRAMES, max_size=60), st.booleans())
def test_arbitrary_frames_are_decoded_to_printable_text(
    frames: list[tuple[int, bytes, int, int]], known: bool
) -> None:
    decoder = Decoder({1: KNOWN}) if known else Decoder(others=KnownNode(WINCH.drive))
    for identifier, data, flags, length in frames:
        packet = struct.pack(
            "=IB3x8s", identifier | flags, length if length > 8 else len(data), data
        )
        frame = Frame.unpack(1.0, packet)
        assert parse_line(format_line("can0", frame)).frame == frame
        record = decoder.decode(frame)
        line = record.line(0.0)
        assert line.isprintable()
        assert all(
            isinstance(field.value, str) or math.isfinite(field.value) for field in record.fields
        )
