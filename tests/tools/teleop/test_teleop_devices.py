"""Input devices of teleoperation: scripts, keys, and a keyboard on a real pseudo-terminal."""

from __future__ import annotations

import fcntl
import math
import os
import pty
import sys
import termios
import time
from pathlib import Path

import pytest
from scipy.spatial.transform import Rotation
from waiting import until

from cdpr_rt.service.stream_packet import REACH_M
from cdpr_tools.errors import BadInputError
from cdpr_tools.teleop.input_device import InputDevice, InputSample, parse_scale
from cdpr_tools.teleop.keyboard import Keyboard, Keys, STEPS_mm
from cdpr_tools.teleop.script import ScriptDevice, read_script
from tests.cdpr_here import cdpr_here

UP, DOWN, RIGHT, LEFT = "\x1b[A", "\x1b[B", "\x1b[C", "\x1bOD"
TICK_S = 1.0 / 60.0


@pytest.mark.parametrize(
    ("text", "scale"), [("8:1", 8.0), ("1:4", 0.25), ("2", 2.0), ("0.5", 0.5), ("3:2", 1.5)]
)
def test_a_scale_is_metres_of_the_robot_per_metre_of_the_hand(text: str, scale: float) -> None:
    assert parse_scale(text) == scale


@pytest.mark.parametrize("text", ["", "8:0", "0", "-2", "nan", "1e9", "8:1:1", "big", "inf:1"])
def test_an_invalid_scale_is_rejected(text: str) -> None:
    with pytest.raises(BadInputError, match=r"--scale .*allowed: 0\.001 to 100"):
        parse_scale(text)


def script(folder: Path, text: str) -> Path:
    path = folder / "a.script"
    path.write_text(text)
    return path


def test_a_script_is_interpolated_linearly_between_its_lines(tmp_path: Path) -> None:
    hand = ScriptDevice(
        read_script(
            script(
                tmp_path,
                "# a way\n0 5 5\n1.0 15 5  # ten on\n1.5 15 5 confirm\n2 15 25 clutch\n\n"
                "3 5 5 confirm",
            )
        )
    )
    begin = 77.0
    seen = {t: hand.read(begin + t) for t in (0.0, 0.5, 1.0, 1.4, 1.5, 1.99, 2.5, 3.0, 9.0)}
    # positions are relative to the first line
    for t, (x_mm, y_mm) in {
        0.0: (0, 0), 0.5: (5, 0), 1.4: (10, 0), 2.5: (5, 10), 3.0: (0, 0), 9.0: (0, 0)
    }.items():  # fmt: skip
        assert seen[t].position_m == pytest.approx((1e-3 * x_mm, 1e-3 * y_mm, 0.0), abs=1e-12)
    assert [seen[t].confirmed for t in (1.4, 1.5, 2.5, 3.0)] == [0, 1, 1, 2]
    assert [seen[t].clutch for t in (1.5, 1.99, 2.5, 3.0)] == [False, False, True, False]
    assert seen[2.5].end is None
    end = seen[3.0].end
    assert end is not None and end.arrive and not end.failed


def test_a_script_lifts_and_turns_the_hand_steadily(tmp_path: Path) -> None:
    hand = ScriptDevice(read_script(script(tmp_path, "0 5 5\n2 5 5 z=40 turn=0,-90,0\n3 5 5")))
    hand.read(0.0)
    seen = hand.read(1.0)
    assert seen.position_m == pytest.approx((0.0, 0.0, 0.02))
    half = math.radians(22.5)
    assert seen.quaternion == pytest.approx((math.cos(half), 0.0, -math.sin(half), 0.0))


def test_keys_lift_and_turn_about_the_axes_of_the_room() -> None:
    keys = Keys(scale=1.0)
    for key in "+" * 4 + "rrf" + "uuukkl":
        keys.press(key, TICK_S)
    assert keys.position_m == pytest.approx((0.0, 0.0, keys.step_m))
    step = math.radians(0.1) * 1e3 * keys.step_m
    turned = Rotation.identity()
    for vector in (
        [0, 0, step],
        [0, 0, step],
        [0, 0, step],
        [step, 0, 0],
        [step, 0, 0],
        [0, step, 0],
    ):
        turned = Rotation.from_rotvec(vector) * turned
    x, y, z, w = turned.as_quat(canonical=True)
    assert keys.quaternion == pytest.approx((w, x, y, z))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no lines; allowed: seconds x_mm y_mm"),
        ("0 0", r"line 1: '0 0'; allowed: seconds x_mm y_mm \[z=MM\]"),
        ("0 0 0\n\n1 0 zero", "line 3: '1 0 zero'"),
        ("0 0 0 clutsh", "line 1: 'clutsh'; allowed: clutch, confirm, z=, turn="),
        ("0 0 0 z=up", "line 1: 'z=up'; allowed: numbers, 1 of up to 20000"),
        ("0 0 0 z=1,2", "line 1: 'z=1,2'; allowed: numbers, 1"),
        ("0 0 0 turn=5", "line 1: 'turn=5'; allowed: numbers, 3 of up to 180"),
        ("0 0 0 turn=0,0,nan", "line 1: 'turn=0,0,nan'; allowed: numbers, 3"),
        ("1 0 0\n1 0 0", "line 2: 1 s; allowed: more than 1 s"),
        ("-1 0 0", "line 1: -1 s; allowed: 0 or more"),
        ("nan 0 0", "line 1: nan s"),
        ("0 nan 0", "line 1: nan 0 mm; allowed: up to 20 m"),
        ("0 0 30000", "line 1: 0 30000 mm"),
    ],
)
def test_a_script_that_cannot_be_played_is_rejected(tmp_path: Path, text: str, told: str) -> None:
    path = script(tmp_path, text)
    with pytest.raises(BadInputError, match=told) as refused:
        read_script(path)
    assert str(path) in str(refused.value)


def test_a_script_beyond_the_range_of_packets_is_rejected(tmp_path: Path) -> None:
    path = script(tmp_path, "0 -1000 0\n1 1400 0\n2 1600 0")
    assert len(read_script(path, 1.0)) == 3
    with pytest.raises(BadInputError, match=r"line 3: 2\.6 m .*allowed: 2\.5 m at this scale"):
        read_script(path, 8.0)


def test_invalid_scripts_are_rejected(tmp_path: Path) -> None:
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00")
    for name, told in (
        ("binary", "binary: is not UTF-8 text"),
        ("missing", "missing: cannot be read: No such file"),
        (".", "is not a regular file"),
    ):
        with pytest.raises(BadInputError, match=f"--script .*{told}"):
            read_script(tmp_path / name)


def test_each_key_press_moves_the_hand_by_one_step() -> None:
    keys = Keys(scale=8.0)
    step = keys.step_m
    for key in (RIGHT, RIGHT, UP, "d", LEFT, DOWN, "w"):
        keys.press(key, TICK_S)
    assert keys.position_m == pytest.approx((2 * step, step, 0.0))
    keys.press("+", TICK_S)
    assert keys.step_m > step
    for _ in range(20):
        keys.press("-", TICK_S)
    assert keys.step_m == 1e-3 * STEPS_mm[0]


def test_key_sequences_may_arrive_in_pieces() -> None:
    keys = Keys(scale=1.0)
    step = keys.step_m
    for piece in ("\x1b", "[", "C", "\x1b[", "C", "\x1b", "\x1b[C", "\x1b[1;5C\x1b[3~", "x\x1bOC"):
        keys.press(piece, TICK_S)
    assert keys.position_m == pytest.approx((4 * step, 0.0, 0.0))  # not for Ctrl-right and Delete


def test_space_holds_enter_confirms_and_q_ends() -> None:
    keys = Keys(scale=1.0)
    keys.press(" ", TICK_S)
    assert keys.clutch
    keys.press(RIGHT, TICK_S)
    assert keys.position_m == (0.0, 0.0, 0.0)
    keys.press(" \r" + "\n", TICK_S)
    assert not keys.clutch
    assert keys.confirmed == 2
    assert not keys.quit
    keys.press("q", TICK_S)
    assert keys.quit


def test_queued_or_pasted_keys_move_the_hand_only_a_few_steps() -> None:
    keys = Keys(scale=1.0)
    keys.press(RIGHT * 500, 30.0)  # typed while the program was paused
    assert 0.0 < keys.position_m[0] <= 7 * keys.step_m
    pasted = Keys(scale=1.0)
    pasted.press("dddddddddddddddddddd", TICK_S)
    assert pasted.position_m[0] <= 2 * pasted.step_m


def test_the_hand_stays_within_the_range_of_packets() -> None:
    keys = Keys(scale=100.0)
    for _ in range(10):
        keys.press("+", TICK_S)
    for _ in range(200):
        keys.press(LEFT, TICK_S)
    assert keys.position_m[0] < -0.1
    assert 100.0 * math.hypot(*keys.position_m) < REACH_M


def read_soon(device: InputDevice, what: str) -> InputSample:
    """Read until a condition holds for the hand, because terminals forward bytes with delay."""
    end = time.monotonic() + 60.0
    while not getattr(hand := device.read(time.monotonic()), what):
        assert time.monotonic() < end, hand
        time.sleep(0.005)
    return hand


def wait_for_bytes(terminal: int, count: int) -> None:
    """Wait until `count` typed bytes can be read."""

    def waiting() -> int:
        return int.from_bytes(fcntl.ioctl(terminal, termios.FIONREAD, bytes(4)), sys.byteorder)

    until(lambda: waiting() >= count)


def test_a_terminal_moves_the_hand_and_its_settings_are_restored() -> None:
    ours, its = pty.openpty()
    before = termios.tcgetattr(its)
    device = Keyboard(1.0, its)
    during = termios.tcgetattr(its)
    assert not during[3] & (termios.ECHO | termios.ICANON)
    assert during[3] & termios.ISIG  # Ctrl-C keeps its meaning
    typed = RIGHT.encode() + b" \n"
    os.write(ours, typed)  # before the device reads
    wait_for_bytes(its, len(typed))
    assert device.read(time.monotonic()) == InputSample(clutch=False)
    os.write(ours, RIGHT.encode() + b"\n")
    hand = read_soon(device, "confirmed")
    assert hand.position_m[0] > 0.0
    assert not hand.clutch and hand.end is None
    still = device.read(time.monotonic())
    assert still.position_m == hand.position_m
    device.close()
    assert termios.tcgetattr(its) == before
    os.close(ours)
    os.close(its)


def test_a_closed_terminal_ends_teleoperation() -> None:
    ours, its = pty.openpty()
    device = Keyboard(1.0, its)
    os.close(ours)
    end = read_soon(device, "end").end
    assert end is not None and end.failed and "terminal was closed" in end.text
    device.close()
    os.close(its)


def test_keyboard_without_a_terminal_is_rejected() -> None:
    reading, writing = os.pipe()
    with pytest.raises(BadInputError, match="standard input is not a terminal"):
        Keyboard(1.0, reading)
    os.close(reading)
    os.close(writing)


def test_the_help_of_teleoperation_shows_its_options() -> None:
    shown = cdpr_here("teleop", "--help").stdout
    assert "--scale" in shown and "--device" in shown
    assert "cdpr teleop experiment --help" in " ".join(shown.split())
