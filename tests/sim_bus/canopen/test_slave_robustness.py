"""Invalid frames neither crash the slave nor change protected objects."""

from __future__ import annotations

import struct

from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_sim_bus.canopen import ObjectDictionary
from tests.sim_bus.canopen.slave_bench import NODE, Bench

IDENTIFIERS = [
    0x000, 0x080, 0x085, 0x100, 0x180 + NODE, 0x200 + NODE, 0x300 + NODE, 0x580 + NODE,
    0x600 + NODE, 0x700 + NODE, 0x77F, 0x7E4, 0x7E5, 0x200 + NODE | 0x40000000,
    0x180 + NODE | 0x40000000, 0x600 + NODE | 0x80000000, 0x700 + NODE | 0x40000000, 0x20000004,
]  # fmt: skip

sdo_heads = st.builds(
    lambda command, index, sub, rest: struct.pack("<BHB", command, index, sub) + rest,
    st.sampled_from([0x21, 0x22, 0x23, 0x2B, 0x2F, 0x40, 0xA0, 0xA4, 0xC0, 0xC6]),
    st.sampled_from(
        [
            0x1000,
            0x1018,
            0x1008,
            0x1400,
            0x1600,
            0x1801,
            0x1A01,
            0x1016,
            0x1019,
            0x6041,
            0x6064,
            0x2F10,
        ]
    ),
    st.integers(0, 6),
    st.binary(min_size=4, max_size=4),
)
frames = st.one_of(
    st.tuples(st.sampled_from(IDENTIFIERS), st.binary(max_size=8)),
    st.tuples(st.just(0x600 + NODE), sdo_heads),
    st.tuples(st.integers(0, 0xFFFFFFFF), st.binary(max_size=8)),
)


def protected(od: ObjectDictionary) -> dict[tuple[int, int], object]:
    served = (0x1001, 0x1003)
    return {(e.index, e.sub): e.value for e in od if not e.writable and e.index not in served}


@settings(max_examples=120)
@given(garbage=st.lists(frames, max_size=60), state=st.sampled_from([1, 2, 128]))
def test_garbage_does_not_change_protected_objects(
    garbage: list[tuple[int, bytes]], state: int
) -> None:
    bench = Bench().boot()
    before = protected(bench.od)
    bench.nmt(state)
    for number, (identifier, data) in enumerate(garbage):
        bench.send(identifier, data)
        if number % 7 == 0:
            bench.sync()
    assert protected(bench.od) == before
    bench.send(0x7E5, bytes([4, 0]).ljust(8, b"\0"))
    assert bench.nmt(129, 0)[-1:] == [(0x700 + bench.slave.node_id, b"\0")]
    assert bench.sdo(b"\x40\x00\x10")[0] == 0x43


def test_frames_for_other_nodes_are_not_accepted(bench: Bench) -> None:
    bench.start()
    accepted = bench.slave.accepts
    assert {0, 0x80, 0x200 + NODE, 0x600 + NODE, 0x7E5} <= accepted
    assert not accepted & {0x600 + NODE + 1, 0x200 + NODE + 1, 0x180 + NODE + 1}
