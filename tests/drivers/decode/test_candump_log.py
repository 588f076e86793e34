"""Log files of candump are compatible with python-can and can-utils."""

from __future__ import annotations

import io

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drivers.decode import Frame, LogError, format_line, parse_line, read_log

TIMES = st.integers(0, 4_000_000_000_000_000).map(lambda us: round(us * 1e-6, 6))
DATA = st.binary(max_size=8)
STANDARD = st.tuples(TIMES, st.integers(0, 0x7FF), DATA).map(lambda t: Frame(*t))
EXTENDED = st.tuples(TIMES, st.integers(0, 0x1FFFFFFF), DATA).map(
    lambda t: Frame(*t, extended=True)
)
REMOTE = st.tuples(STANDARD | EXTENDED, st.integers(0, 8)).map(
    lambda t: t[0]._replace(data=b"", remote=True, length=t[1])
)
ERRORS = st.tuples(TIMES, st.integers(0, 0x1FFFFFFF), st.binary(min_size=8, max_size=8)).map(
    lambda t: Frame(*t, error=True)
)
CHANNELS = st.sampled_from(["can0", "vcan17", "slcan-a", "lab.2"])


@given(CHANNELS, STANDARD | EXTENDED | REMOTE | ERRORS)
def test_a_formatted_line_is_parsed_to_the_same_frame(channel: str, frame: Frame) -> None:
    assert parse_line(format_line(channel, frame)) == (channel, frame)


@given(STANDARD | EXTENDED | REMOTE | ERRORS)
def test_packing_and_unpacking_keeps_all_fields(frame: Frame) -> None:
    assert Frame.unpack(frame.time_s, frame.pack()) == frame


def _message(frame: Frame) -> can.Message:
    return can.Message(
        timestamp=frame.time_s,
        arbitration_id=frame.can_id,
        data=None if frame.remote else frame.data,
        dlc=frame.length if frame.remote else len(frame.data),
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        channel="can0",
    )


@given(STANDARD | EXTENDED | REMOTE)
def test_python_can_reads_our_lines(frame: Frame) -> None:
    (read,) = can.CanutilsLogReader(io.StringIO(format_line("can0", frame) + "\n"))
    assert read.equals(_message(frame), timestamp_delta=1e-6, check_direction=False)


@given(STANDARD | EXTENDED | REMOTE)
def test_lines_of_python_can_are_read(frame: Frame) -> None:
    file = io.StringIO()
    can.CanutilsLogWriter(file)(_message(frame))
    channel, read = parse_line(file.getvalue())
    assert channel == "can0"
    # python-can does not write the length of remote frames
    assert read == (frame._replace(length=0) if frame.remote else frame)


def test_an_error_frame_of_python_can_is_read_as_error_frame() -> None:
    file = io.StringIO()
    can.CanutilsLogWriter(file)(can.Message(timestamp=1.5, is_error_frame=True, channel="can0"))
    frame = parse_line(file.getvalue()).frame
    assert frame.error
    assert frame.can_id == 0x80  # a bus error, the only class that python-can writes
    (read,) = can.CanutilsLogReader(io.StringIO(format_line("can0", frame) + "\n"))
    assert read.is_error_frame


def test_lines_of_can_utils_are_read() -> None:
    # as `candump -L` prints them, with the direction of -x and cansend's length code
    assert parse_line("(1436509052.249713) vcan0 044#2A366C2BBA").frame == Frame(
        1436509052.249713, 0x044, bytes.fromhex("2A366C2BBA")
    )
    assert parse_line("(1436509053.850870) can1 12345678#R8 R").frame == Frame(
        1436509053.85087, 0x12345678, b"", extended=True, remote=True, length=8
    )
    assert parse_line("(0.000000) can0 7DF#1122334455667788_E T").frame.data[-1] == 0x88
    error = parse_line("(1436509052.249713) can0 20000088#0000190000000000").frame
    assert (error.error, error.can_id, error.data[2]) == (True, 0x88, 0x19)
    assert format_line("can0", error) == "(1436509052.249713) can0 20000088#0000190000000000"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("(1.0) can0 123##1AABB", "CAN FD"),
        ("(1.0) can0 123#AAB", "123#AAB"),
        ("(1.0) can0 123#112233445566778899", "not of the form"),
        ("(1.0) can0 12#11", "not of the form"),
        ("(1.0) can0 FFF#11", "more than 11 bits"),
        ("(x) can0 123#11", "not of the form"),
        ("hello", "'hello'"),
        ("\x00\xff\xfe", "not of the form"),
    ],
)
def test_error_for_an_invalid_line_has_its_number(line: str, words: str) -> None:
    good = "(1.000000) can0 123#11\n"
    with pytest.raises(LogError, match=r"trip\.log: line 3: ") as told:
        list(read_log("trip.log", [good, "\n", line + "\n", good]))
    assert words in str(told.value)


def test_a_truncated_log_is_read_up_to_its_last_complete_line() -> None:
    lines = ["(1.000000) can0 123#11\n", "(1.000000) can0 124#\n", "(1.00000"]
    assert [frame.can_id for _, frame in read_log("trip.log", lines)] == [0x123, 0x124]
    with pytest.raises(LogError, match="line 1"):  # no line is complete
        list(read_log("trip.log", ["no log at all"]))
