"""The compiled codec is checked against `struct` and against its invariants."""

from __future__ import annotations

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
from tests.drivers.axis_rig import DRIVE, PERIOD_S

CAN_FRAME = struct.Struct("=IB3x8s")
TPDO1 = struct.Struct("<Hih")
TPDO2 = struct.Struct("<bHi")
ENABLED = 0x27
I32 = st.integers(-(1 << 31), (1 << 31) - 1)
SETTINGS = settings(max_examples=150)


class Group:
    """The arrays of n axes, without a bus."""

    def __init__(self, n: int = 2, torque_sign: int = 1, position_sign: int = 1) -> None:
        signs = {"torque_sign": torque_sign, "position_sign": position_sign}
        drive = DRIVE.model_copy(update=signs)
        self.axes = [AxisConfig(i + 1, drive, 3.0, 8192, 0x3AD, 2.0) for i in range(n)]
        self.layout = GroupLayout(self.axes)
        self.state = StateArrays(len(self.axes))
        self.state.begin(self.axes, PERIOD_S, lockstep=True)
        self.state.ints[codec.MODE_REQUESTED] = self.state.ints[codec.MODE_DISPLAYED] = 10

    def take(self, *frames: tuple[int, bytes]) -> int:
        raw = b"".join(CAN_FRAME.pack(i, len(data), data) for i, data in frames)
        array = np.frombuffer(bytearray(raw), np.uint8).reshape(-1, 16)
        s = self.state
        return codec.decode(
            array, self.layout.slots, self.layout.fields, STATE_TABLE,
            s.ints, s.floats, s.words, s.flags, np.zeros(len(array) + 1, np.int64), len(array),
        )  # fmt: skip

    def give(self) -> list[tuple[int, bytes]]:
        rpdos, s = self.layout.rpdos, self.state
        raw = rpdos.bytes
        codec.end_answers(s.ints, s.floats, s.flags)
        self.alarms = codec.encode(
            raw, self.layout.command_offsets, CONTROLWORD_TABLE, s.ints, s.floats
        )
        frames = [CAN_FRAME.unpack(row) for row in rpdos.rows]
        return [(i, data[:length]) for i, length, data in frames]

    def enable(self) -> None:
        self.state.ints[codec.TARGET] = State.OPERATION_ENABLED
        for axis in self.axes:
            self.take((0x180 + axis.node_id, TPDO1.pack(ENABLED, 0, 0)))


@SETTINGS
@given(
    st.integers(0, 0xFFFF), I32, st.integers(-(1 << 15), (1 << 15) - 1), st.sampled_from([-1, 1])
)
def test_feedback_is_decoded_as_by_struct(word: int, counts: int, torque: int, sign: int) -> None:
    group = Group(torque_sign=sign, position_sign=-sign)
    assert group.take((0x182, TPDO1.pack(word, counts, torque))) == 1
    feedback = group.state.feedback
    assert feedback.statusword.tolist() == [0, word]
    assert feedback.valid.tolist() == [False, True]
    assert feedback.position_rad[1] == pytest.approx(-sign * counts * math.tau / 8192, abs=1e-9)
    assert feedback.torque_Nm[1] == pytest.approx(sign * torque * 3e-3)


@SETTINGS
@given(I32, st.lists(st.integers(-(1 << 30), 1 << 30), max_size=12), I32)
def test_positions_and_index_stay_continuous_when_32_bits_wrap(
    first: int, steps: list[int], index_ahead: int
) -> None:
    group = Group(1)
    true = first
    group.take((0x181, TPDO1.pack(ENABLED, true, 0)))
    for step in steps:
        true += step
        group.take((0x181, TPDO1.pack(ENABLED, _wrapped(true), 0)))
    assert group.state.ints[codec.POSITION, 0] == true
    group.state.ints[codec.PROBE_ARMED, 0] = 1
    group.take((0x281, TPDO2.pack(10, 0x0003, _wrapped(true + index_ahead))))
    assert group.state.feedback.index_known[0]
    assert group.state.feedback.index_rad[0] == pytest.approx(
        (true + index_ahead) * math.tau / 8192, rel=1e-12
    )


def _wrapped(value: int) -> int:
    return (value + (1 << 31)) % (1 << 32) - (1 << 31)


def test_a_probe_latched_before_arming_is_ignored() -> None:
    group = Group(1)
    group.take((0x281, TPDO2.pack(10, 0x0003, 77)))
    assert not group.state.feedback.index_known[0]
    group.state.ints[codec.PROBE_ARMED, 0] = 1
    group.take((0x281, TPDO2.pack(10, 0x0001, 88)))
    assert not group.state.feedback.index_known[0]


@SETTINGS
@given(
    st.lists(
        st.tuples(
            st.integers(0, 0xFFFFFFFF) | st.sampled_from([0x181, 0x281, 0x081, 0x701]),
            st.binary(max_size=8),
            st.integers(0, 255),
        ),
        max_size=20,
    )
)
def test_arbitrary_frames_do_not_break_the_decoder(frames: list[tuple[int, bytes, int]]) -> None:
    group = Group(1)
    raw = b"".join(CAN_FRAME.pack(i, length, data) for i, data, length in frames)
    whole = [
        (i, data) for i, data, length in frames if i == 0x181 and length >= 8
    ]  # at least as long as the PDO map
    array = np.frombuffer(bytearray(raw), np.uint8).reshape(-1, 16)
    s = group.state
    others = np.full(len(array) + 1, -1, np.int64)
    answered = codec.decode(
        array, group.layout.slots, group.layout.fields, STATE_TABLE,
        s.ints, s.floats, s.words, s.flags, others, len(array),
    )  # fmt: skip
    assert answered == min(1, len(whole))
    # all frames but this axis's TPDOs go to the acyclic side in their order
    assert others[1 : others[0] + 1].tolist() == [
        k for k, (identifier, _, _) in enumerate(frames) if identifier not in (0x181, 0x281)
    ]


@SETTINGS
@given(st.lists(st.floats(-2.5, 2.5), min_size=1, max_size=60), st.sampled_from([-1, 1]))
def test_rounding_errors_of_torque_do_not_accumulate(wanted: list[float], sign: int) -> None:
    group = Group(1, torque_sign=sign)
    group.enable()
    asked = sent = 0.0
    for torque in wanted:
        group.state.command.torque_Nm[0] = torque
        ((identifier, data),) = group.give()
        assert identifier == 0x201
        word, units = struct.unpack("<Hh", data)
        assert word == 0x0F
        assert group.state.command.sent_torque_Nm[0] == pytest.approx(sign * units * 3e-3)
        assert abs(units) <= 666  # 2 Nm of 3 Nm
        if abs(torque) < 1.99:
            asked += torque
            sent += sign * units * 3e-3
        else:
            asked = sent = 0.0  # torque cut by a limit is not carried over
            group.state.floats[codec.RESIDUAL_UNITS] = 0.0
    assert abs(asked - sent) <= 0.5 * 3e-3 + 1e-9


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_nan_torque_is_sent_as_zero_and_reported(value: float) -> None:
    group = Group(2)
    group.enable()
    group.state.command.torque_Nm[:] = [value, 0.3]
    sent = [struct.unpack("<Hh", data)[1] for _, data in group.give()]
    assert sent == [0, 100]
    assert group.alarms == codec.NOT_FINITE
    group.state.command.torque_Nm[0] = 0.3
    assert struct.unpack("<Hh", group.give()[0][1])[1] == 100


def test_no_torque_and_no_rounding_residual_unless_enabled_on_request() -> None:
    group = Group(1)
    group.enable()
    group.state.command.torque_Nm[0] = 0.1015
    group.give()
    assert group.state.floats[codec.RESIDUAL_UNITS, 0] != 0.0
    group.state.ints[codec.TARGET] = State.READY
    word, units = struct.unpack("<Hh", group.give()[0][1])
    assert (word, units) == (0x06, 0)
    assert group.state.command.sent_torque_Nm[0] == 0.0
    assert group.state.floats[codec.RESIDUAL_UNITS, 0] == 0.0


def test_an_unconfirmed_mode_is_not_enabled() -> None:
    group = Group(1)
    group.state.ints[codec.MODE_DISPLAYED] = 1
    group.state.ints[codec.TARGET] = State.OPERATION_ENABLED
    group.take((0x181, TPDO1.pack(0x23, 0, 0)))
    assert struct.unpack("<Hh", group.give()[0][1])[0] == 0x07
    group.take((0x281, TPDO2.pack(10, 0, 0)))
    assert struct.unpack("<Hh", group.give()[0][1])[0] == 0x0F


def test_a_fault_that_outlasts_its_reset_is_reported_again() -> None:
    group = Group(1)
    group.enable()
    ints = group.state.ints
    words, alarms = [], []
    for cycle in range(8):
        if cycle == 2:
            ints[codec.ACKNOWLEDGE, 0], ints[codec.ALARM, 0] = 3, 0
        group.take((0x181, TPDO1.pack(0x08, 0, 0)))
        words.append(struct.unpack("<Hh", group.give()[0][1])[0])
        alarms.append(bool(group.alarms & codec.FAULT))
    assert words == [0, 0, 0x80, 0x80, 0x80, 0, 0, 0]
    assert alarms == [True, True, False, False, False, True, True, True]


def test_a_successful_fault_reset_leaves_the_drive_disabled() -> None:
    group = Group(1)
    group.enable()
    group.take((0x181, TPDO1.pack(0x08, 0, 0)))
    group.state.ints[codec.ACKNOWLEDGE, 0], group.state.ints[codec.ALARM, 0] = 100, 0
    group.give()
    group.take((0x181, TPDO1.pack(0x40, 0, 0)))
    assert struct.unpack("<Hh", group.give()[0][1])[0] == 0
    assert group.alarms == 0
    assert group.state.ints[codec.FAULTED, 0] == 0


def test_two_axes_with_the_same_node_id_are_rejected() -> None:
    axis = AxisConfig(1, DRIVE, 3.0, 8192, 0x3AD, 2.0)
    with pytest.raises(DriverError, match="081h"):
        GroupLayout([axis, axis])


@pytest.mark.parametrize(("which", "index"), [("tpdos", 0x6064), ("rpdos", 0x6071)])
def test_a_pdo_map_without_torque_control_is_rejected(which: str, index: int) -> None:
    pdos = tuple(
        p.model_copy(update={"entries": tuple(e for e in p.entries if e.index != index)})
        for p in getattr(DRIVE, which)
    )
    drive = DRIVE.model_copy(update={which: pdos})
    with pytest.raises(DriverError, match=f"{which}: no .*{index:04X}h"):
        GroupLayout([AxisConfig(1, drive, 3.0, 8192, 0x3AD, 2.0)])
