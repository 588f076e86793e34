"""Reading a node's objects among answers that belong to others."""

from __future__ import annotations

import struct

import pytest

from cdpr_tools.busview.node_reader import NodeInfo, NodeReader

TYPE, NAME, VENDOR = (0x1000, 0), (0x1008, 0), (0x1018, 1)
MISSING = 0x06020000


def expedited(what: tuple[int, int], value: int) -> bytes:
    return struct.pack("<BHBI", 0x43, *what, value)


def abort(what: tuple[int, int], code: int = MISSING) -> bytes:
    return struct.pack("<BHBI", 0x80, *what, code)


def asked_for(request: bytes | None) -> tuple[int, int]:
    assert request is not None and request[0] == 0x40
    index, sub = struct.unpack_from("<HB", request, 1)
    return index, sub


@pytest.fixture
def reader() -> NodeReader:
    """One that has asked for the device type."""
    made = NodeReader(NodeInfo(3))
    assert asked_for(made.due(0.0)) == TYPE
    return made


def up_to(reader: NodeReader, what: tuple[int, int]) -> None:
    """Answer what comes before an object."""
    request = reader.take(expedited(TYPE, 0), 0.0)
    while asked_for(request) != what:
        request = reader.take(abort(asked_for(request)), 0.0)


@pytest.mark.parametrize(
    "stranger",
    [
        expedited(VENDOR, 7),  # another index
        expedited((0x1000, 1), 7),  # another subindex
        abort(VENDOR),
        expedited(TYPE, 7)[:7],  # short
        abort(TYPE)[:5],
        b"\x80",
        b"",
        b"\x60" + expedited(TYPE, 7)[1:],  # confirms a download
        b"\x81" + abort(TYPE)[1:],  # no command there is
    ],
)
def test_what_does_not_answer_is_left_aside(reader: NodeReader, stranger: bytes) -> None:
    assert reader.take(stranger, 0.0) is None
    assert not reader.found.answers and not reader.found.refused and not reader.found.repeated
    assert asked_for(reader.take(expedited(TYPE, 402), 0.0)) == VENDOR
    assert reader.found.number(*TYPE) == 402


@pytest.mark.parametrize("named", [TYPE, (0, 0)])
def test_an_abort_is_of_the_object_it_names_or_the_one_asked_for(
    reader: NodeReader, named: tuple[int, int]
) -> None:
    reader.take(abort(named), 0.0)
    assert reader.found.refused == {TYPE: MISSING}


def test_an_abort_of_another_object_does_not_end_a_value_in_segments(reader: NodeReader) -> None:
    up_to(reader, NAME)
    assert reader.take(struct.pack("<BHBI", 0x41, *NAME, 9), 0.0) == bytes([0x60]) + bytes(7)
    assert reader.take(abort((0x6041, 0)), 0.0) is None
    assert reader.take(bytes([0x10]) + b"another", 0.0) is None  # of the other toggle bit
    assert reader.take(bytes([0x00]) + b"short", 0.0) is None
    assert reader.take(bytes([0x00]) + b"a drive", 0.0) == bytes([0x70]) + bytes(7)
    reader.take(bytes([0x1B]) + b"!!".ljust(7, b"\0"), 0.0)
    assert reader.found.text(NAME[0]) == "a drive!!"
    assert reader.found.repeated == {"segments"}


@pytest.mark.parametrize("named", [NAME, (0, 0)])
def test_its_abort_ends_a_value_in_segments(reader: NodeReader, named: tuple[int, int]) -> None:
    up_to(reader, NAME)
    reader.take(struct.pack("<BHBI", 0x41, *NAME, 9), 0.0)
    request = reader.take(abort(named), 0.0)
    assert request is not None and request[0] == 0x80
    assert NAME not in reader.found.objects
    assert asked_for(reader.due(0.0)) == (0x1017, 0)


def test_a_second_answer_tells_of_a_second_node(reader: NodeReader) -> None:
    reader.take(expedited(TYPE, 402), 0.0)
    assert reader.take(expedited(TYPE, 401), 0.0) is None
    assert reader.found.repeated == reader.found.differing == {"1000h"}
    assert reader.found.number(*TYPE) == 402
