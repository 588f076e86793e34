"""A drive with several PDOs each way, beside a drive with one PDO each way."""

from __future__ import annotations

import dataclasses
import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drivers.axes import axis_codec as codec
from cdpr_drivers.axes.axis_group import StateArrays
from cdpr_drivers.axes.axis_layout import AxisConfig, GroupLayout
from cdpr_drivers.cia402 import CONTROLWORD_TABLE, STATE_TABLE, State
from cdpr_drivers.errors import DriverError
from cdpr_profiles import DriveProfile, Pdo, load_drive
from cdpr_profiles.drive import PdoEntry
from tests.drivers.axis_rig import DRIVE, PERIOD_S

CAN_FRAME = struct.Struct("=IB3x8s")
SPLIT = load_drive("mnm-profile-torque")
ENABLED = 0x27
I16 = st.integers(-(1 << 15), (1 << 15) - 1)
I32 = st.integers(-(1 << 31), (1 << 31) - 1)


class Pair:
    """Axis 0 (node 1) with split PDOs and axis 1 (node 2) with one PDO each way, without a bus."""

    def __init__(self) -> None:
        axes = [
            AxisConfig(1, SPLIT, 3.0, 8192, 0x2D, 2.0),
            AxisConfig(2, DRIVE, 3.0, 8192, 0x3AD, 2.0),
        ]
        self.layout = GroupLayout(axes)
        self.state = StateArrays(len(axes))
        self.state.begin(axes, PERIOD_S, lockstep=True)

    def take(self, *frames: tuple[int, bytes]) -> int:
        raw = b"".join(CAN_FRAME.pack(i, len(data), data) for i, data in frames)
        array = np.frombuffer(bytearray(raw), np.uint8).reshape(-1, 16)
        s = self.state
        return codec.decode(
            array, self.layout.slots, self.layout.fields, STATE_TABLE,
            s.ints, s.floats, s.words, s.flags, np.zeros(len(array) + 1, np.int64), len(array),
        )  # fmt: skip

    def give(self) -> dict[int, bytes]:
        s, rpdos = self.state, self.layout.rpdos
        codec.end_answers(s.ints, s.floats, s.flags)
        codec.encode(
            rpdos.bytes, self.layout.command_offsets, CONTROLWORD_TABLE,
            s.ints, s.floats,
        )  # fmt: skip
        frames = [CAN_FRAME.unpack(row) for row in rpdos.rows]
        return {identifier: data[:length] for identifier, length, data in frames}

    def next_cycle(self) -> None:
        self.state.feedback.valid.fill(False)
        self.state.ints[codec.TPDOS_RECEIVED].fill(0)


@settings(max_examples=60)
@given(st.integers(0, 0xFFFF), I32, I16, st.permutations(["word", "torque", "whole"]))
def test_an_axis_has_answered_when_all_its_pdos_have_arrived(
    word: int, counts: int, torque: int, order: list[str]
) -> None:
    frames = {
        "word": (0x181, struct.pack("<Hi", word, counts)),
        "torque": (0x381, struct.pack("<hi", torque, 77)),
        "whole": (0x182, struct.pack("<Hih", word, counts, torque)),
    }
    pair = Pair()
    answered = [pair.take(frames[which]) for which in order]
    last_of_split = max(order.index("word"), order.index("torque"))
    assert [k for k, n in enumerate(answered) if n] == sorted([last_of_split, order.index("whole")])
    feedback = pair.state.feedback
    assert feedback.valid.all()
    assert feedback.statusword.tolist() == [word, word]
    assert feedback.position_rad[0] == feedback.position_rad[1]
    assert feedback.torque_Nm == pytest.approx([torque * 1e-3, torque * 3e-3])


def test_an_incomplete_answer_does_not_count_in_this_or_the_next_cycle() -> None:
    pair = Pair()
    assert pair.take((0x381, struct.pack("<hi", 1, 0))) == 0
    pair.next_cycle()
    assert pair.take((0x181, struct.pack("<Hi", ENABLED, 0))) == 0
    assert not pair.state.feedback.valid[0]
    assert pair.take((0x381, struct.pack("<hi", 1, 0))) == 1


def test_a_frame_shorter_than_its_map_does_not_count_as_answer() -> None:
    pair = Pair()
    assert pair.take((0x381, struct.pack("<h", 1)), (0x181, struct.pack("<Hh", ENABLED, 0))) == 0
    assert pair.take((0x182, struct.pack("<Hi", ENABLED, 0))) == 0


def test_each_axis_is_commanded_in_its_own_frames_and_units() -> None:
    pair = Pair()
    ints = pair.state.ints
    ints[codec.MODE_REQUESTED] = ints[codec.MODE_DISPLAYED] = [4, 10]
    ints[codec.TARGET] = State.OPERATION_ENABLED
    halves = (0x181, struct.pack("<Hi", ENABLED, 0)), (0x381, struct.pack("<hi", 0, 0))
    pair.take(*halves, (0x182, struct.pack("<Hih", ENABLED, 0, 0)))
    pair.state.command.torque_Nm[:] = [0.123, -0.123]
    assert pair.give() == {
        0x201: struct.pack("<H", 0x0F),
        0x301: struct.pack("<h", 123),
        0x202: struct.pack("<Hh", 0x0F, -41),
    }
    # torque limits are also in the unit of each axis
    pair.state.command.torque_Nm[:] = 50.0
    frames = pair.give()
    assert frames[0x301] == struct.pack("<h", 2000)
    assert frames[0x202][2:] == struct.pack("<h", 666)


def test_an_axis_that_waits_for_its_mode_does_not_stop_the_other() -> None:
    pair = Pair()
    ints = pair.state.ints
    ints[codec.MODE_REQUESTED] = [4, 10]
    ints[codec.MODE_DISPLAYED] = [4, 4]
    ints[codec.TARGET] = State.OPERATION_ENABLED
    halves = (0x181, struct.pack("<Hi", 0x23, 0)), (0x381, struct.pack("<hi", 0, 0))
    pair.take(*halves, (0x182, struct.pack("<Hih", 0x23, 0, 0)))
    frames = pair.give()
    assert frames[0x201] == struct.pack("<H", 0x0F)
    assert frames[0x202][:2] == struct.pack("<H", 0x07)


def test_feedback_that_is_not_sent_at_every_sync_is_rejected() -> None:
    late = tuple(
        p.model_copy(update={"transmission_type": 0 if p.number == 3 else 1}) for p in SPLIT.tpdos
    )
    drive = SPLIT.model_copy(update={"tpdos": late})
    with pytest.raises(DriverError, match="no TPDO of transmission_type 1 contains 6077h"):
        GroupLayout([AxisConfig(1, drive, 3.0, 8192, 0x2D, 2.0)])


def layout_of(drive: DriveProfile, limit_Nm: float = 2.0) -> GroupLayout:
    return GroupLayout([AxisConfig(1, drive, 3.0, 8192, 0x2D, limit_Nm)])


def test_an_event_driven_copy_of_the_feedback_is_not_awaited() -> None:
    """By factory setting, drives also send the statusword on change in a separate PDO."""
    (statusword, *_), *_ = (pdo.entries for pdo in SPLIT.tpdos)
    event = Pdo(number=2, cob_id_offset=0x280, transmission_type=255, entries=(statusword,))
    plain = AxisConfig(1, SPLIT, 3.0, 8192, 0x2D, 2.0)
    for tpdos, bits in (((event, *SPLIT.tpdos), 0b110), ((*SPLIT.tpdos, event), 0b011)):
        axis = dataclasses.replace(plain, drive=SPLIT.model_copy(update={"tpdos": tpdos}))
        assert axis.expected_tpdos == bits
        fields = GroupLayout([axis]).fields[0]
        assert np.count_nonzero(fields[:, 3]) == 3
        assert tpdos.index(event) not in fields[fields[:, 3] > 0, 0]


def test_a_mapped_object_that_would_be_zeroed_is_rejected() -> None:
    command, torque = SPLIT.rpdos
    for index, refused in ((0x6060, True), (0x6072, True), (0x0005, False)):
        more = (*command.entries, PdoEntry(index=index, bits=8))
        rpdos = command.model_copy(update={"entries": more}), torque
        drive = SPLIT.model_copy(update={"rpdos": rpdos})
        if refused:
            with pytest.raises(DriverError, match=f"{index:04X}h .* would be set to 0"):
                layout_of(drive)
        else:
            assert layout_of(drive).rpdos.array["length"].tolist() == [3, 2]


def test_an_object_mapped_with_the_wrong_length_is_rejected() -> None:
    status, torque = SPLIT.tpdos
    entries = (status.entries[0], PdoEntry(index=0x6064, bits=16))
    tpdos = status.model_copy(update={"entries": entries}), torque
    with pytest.raises(DriverError, match="6064h has 16 bits; allowed: 32"):
        layout_of(SPLIT.model_copy(update={"tpdos": tpdos}))


@pytest.mark.parametrize("torque_Nm", [40.0, -40.0, 1e300])
def test_torque_beyond_16_bits_is_clamped_instead_of_wrapped(torque_Nm: float) -> None:
    axes = [AxisConfig(1, SPLIT, 3.0, 8192, 0x2D, 50.0)]
    layout, state = GroupLayout(axes), StateArrays(len(axes))
    state.begin(axes, PERIOD_S, lockstep=True)
    state.ints[codec.TARGET] = state.ints[codec.STATE] = State.OPERATION_ENABLED
    state.command.torque_Nm[0] = torque_Nm
    for _ in range(3):
        codec.encode(
            layout.rpdos.bytes, layout.command_offsets, CONTROLWORD_TABLE,
            state.ints, state.floats,
        )  # fmt: skip
        (units,) = struct.unpack("<h", CAN_FRAME.unpack(layout.rpdos.rows[1])[2][:2])
        assert units == math.copysign(32767, torque_Nm)
        assert state.command.sent_torque_Nm[0] == pytest.approx(math.copysign(32.767, torque_Nm))
