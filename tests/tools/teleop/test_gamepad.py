"""Events of a gamepad move a hand, and unplugging it holds the hand.

The kernels that run these tests have no input devices. `StandIn` replaces `evdev.InputDevice` with
the events that the kernel documents. It does not test real gamepads.
"""

from __future__ import annotations

import errno
import math
import os
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from evdev import AbsInfo, InputEvent, ecodes
from scipy.spatial.transform import Rotation

from cdpr_tools.errors import BadInputError
from cdpr_tools.teleop.gamepad import EvdevFinder, Gamepad, StickMap, stick_map

PLANE, ROOM = (2, ()), (3, (0, 1, 2))
MAP = stick_map(PLANE, None, None, "BTN_TR", "BTN_SOUTH", 0.1, 0.05)
SCALE = 8.0


class StandIn:
    """Return queued events like an EvdevDevice until it is unplugged."""

    path = "/dev/input/event7"
    name = "a pad that is not there"

    def __init__(self, least: int = 0, most: int = 255) -> None:
        self.events: deque[InputEvent] = deque()
        self.values = dict.fromkeys(range(ecodes.ABS_MAX), (least + most + 1) // 2)
        self.range = least, most
        self.plugged = True
        self.closed = False

    def put(self, kind: int, code: int, value: int) -> None:
        if kind == ecodes.EV_ABS:
            self.values[code] = value
        self.events.append(InputEvent(0, 0, kind, code, value))

    def read(self) -> Iterator[InputEvent]:
        if not self.plugged:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        if not self.events:
            raise BlockingIOError
        some = [self.events.popleft() for _ in range(min(2, len(self.events)))]
        return iter(some)

    def absinfo(self, axis_num: int) -> AbsInfo:
        return AbsInfo(self.values[axis_num], *self.range, 0, 15, 0)

    def capabilities(self, verbose: bool = False, absinfo: bool = True) -> dict[Any, Any]:
        return {}

    def close(self) -> None:
        self.closed = True


@dataclass
class Pads:
    """A finder of gamepads that are plugged in one after another."""

    there: list[StandIn] = field(default_factory=list)

    def find(self) -> StandIn | None:
        return self.there.pop(0) if self.there else None

    def missing_text(self) -> str:
        return "nothing is plugged in"


class Rig:
    """A gamepad whose time the test controls."""

    def __init__(self, *pads: StandIn, used: StickMap = MAP) -> None:
        self.pad = pads[0]
        self.pads = Pads(list(pads[:1]))
        self.device = Gamepad(self.pads, used, SCALE)
        self.now_s = 10.0
        self.hand = self.device.read(self.now_s)

    def key(self, code: int, down: bool) -> None:
        self.pad.put(ecodes.EV_KEY, code, int(down))

    def push(self, x: int, y: int) -> None:
        self.pad.put(ecodes.EV_ABS, ecodes.ABS_X, x)
        self.pad.put(ecodes.EV_ABS, ecodes.ABS_Y, y)

    def run(self, seconds: float) -> tuple[float, float]:
        """Return the motion of the hand in `seconds`."""
        before = self.hand.position_m
        for _ in range(round(seconds * 60.0)):
            self.now_s += 1.0 / 60.0
            self.hand = self.device.read(self.now_s)
        after = self.hand.position_m
        return after[0] - before[0], after[1] - before[1]


def test_the_stick_moves_the_hand_while_the_dead_man_button_is_held() -> None:
    rig = Rig(StandIn())
    rig.push(255, 127)
    assert rig.run(0.5) == (0.0, 0.0)
    assert rig.hand.clutch
    rig.key(ecodes.BTN_TR, True)
    assert rig.run(1.0) == pytest.approx((0.05, 0.0), abs=1e-3)
    assert not rig.hand.clutch
    rig.push(128, 0)  # the kernel's axis points down
    assert rig.run(1.0) == pytest.approx((0.0, 0.05), abs=2e-3)
    rig.key(ecodes.BTN_TR, False)
    assert rig.run(0.5) == (0.0, 0.0)
    assert rig.hand.clutch


def test_the_dead_zone_is_round_and_speed_increases_slowly_from_its_edge() -> None:
    rig = Rig(StandIn(-1000, 1000))
    rig.key(ecodes.BTN_TR, True)
    rig.push(69, -69)
    assert rig.run(1.0) == (0.0, 0.0)
    rig.push(0, -550)  # half of the remaining way
    x, y = rig.run(1.0)
    assert (x, y) == pytest.approx((0.0, 0.25 * 0.05), rel=0.02)
    rig.push(1000, -1000)  # a stick with a square range is not faster in its corner
    x, y = rig.run(1.0)
    assert math.hypot(x, y) == pytest.approx(0.05, rel=0.02)


def test_a_pause_of_the_loop_does_not_move_the_hand_further() -> None:
    rig = Rig(StandIn())
    rig.key(ecodes.BTN_TR, True)
    rig.push(255, 127)
    rig.run(0.1)
    before = rig.hand.position_m[0]
    rig.hand = rig.device.read(rig.now_s + 5.0)
    assert rig.hand.position_m[0] - before <= 0.05 * 0.1 + 1e-9


def test_each_press_confirms_once() -> None:
    rig = Rig(StandIn())
    for _ in range(3):
        rig.key(ecodes.BTN_SOUTH, True)
        rig.pad.put(ecodes.EV_KEY, ecodes.BTN_SOUTH, 2)  # key repeat of the kernel
        rig.pad.put(ecodes.EV_KEY, ecodes.BTN_EAST, 1)
        rig.run(0.05)
        rig.key(ecodes.BTN_SOUTH, False)
    rig.run(0.05)
    assert rig.hand.confirmed == 3


def test_a_press_from_before_the_session_confirms_nothing() -> None:
    pad = StandIn()
    pad.put(ecodes.EV_KEY, ecodes.BTN_SOUTH, 1)
    assert Rig(pad).hand.confirmed == 0


def test_an_unplugged_gamepad_holds_until_the_button_is_pressed_again() -> None:
    rig = Rig(StandIn())
    rig.key(ecodes.BTN_TR, True)
    rig.push(255, 127)
    rig.run(0.5)
    rig.pad.plugged = False
    gone = rig.run(2.5)
    assert gone == (0.0, 0.0)
    assert rig.hand.clutch and "plug it in again" in rig.hand.trouble
    assert rig.pad.closed
    again = StandIn()
    again.values[ecodes.ABS_X] = 255  # pushed and held while it is plugged in
    rig.pads.there, rig.pad = [again], again
    assert rig.run(1.5) == (0.0, 0.0)
    assert (rig.hand.clutch, rig.hand.trouble) == (True, "")
    rig.key(ecodes.BTN_TR, True)
    assert rig.run(1.0)[0] == pytest.approx(0.05, abs=1e-3)


def test_lost_events_stop_the_hand_until_the_button_is_pressed_again() -> None:
    rig = Rig(StandIn())
    rig.key(ecodes.BTN_TR, True)
    rig.push(255, 127)
    rig.run(0.5)
    rig.pad.values[ecodes.ABS_X] = 0
    rig.pad.put(ecodes.EV_SYN, ecodes.SYN_DROPPED, 0)
    assert rig.run(0.5) == (0.0, 0.0)
    rig.key(ecodes.BTN_TR, True)
    assert rig.run(0.5)[0] == pytest.approx(-0.025, abs=1e-3)  # the present state of the stick


def test_a_missing_gamepad_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="nothing is plugged in"):
        Gamepad(Pads(), MAP, SCALE)
    missing = tmp_path / "event0"
    finder = EvdevFinder(missing, MAP)
    assert finder.find() is None
    assert f"--input {missing}: is not an input device" in finder.missing_text()
    missing.write_text("no device either")
    assert EvdevFinder(missing, MAP).find() is None


@pytest.mark.parametrize(
    ("axes", "dead_man", "confirm", "told"),
    [
        ("ABS_X", "BTN_TR", "BTN_SOUTH", "--axes ABS_X: 1 axes; allowed: 2 for this robot"),
        ("ABS_X,ABS_X", "BTN_TR", "BTN_SOUTH", "ABS_X,ABS_X: each axis may be used only once"),
        (
            "ABS_X,ABS_Q",
            "BTN_TR",
            "BTN_SOUTH",
            "--axes: 'ABS_Q'; allowed: a name of the Linux kernel",
        ),
        ("ABS_X,ABS_Y", "KEY_A", "BTN_SOUTH", "--dead-man: 'KEY_A'"),
        ("ABS_X,ABS_Y", "BTN_TR", "BTN_TR", "--confirm BTN_TR: must differ from"),
    ],
)
def test_unknown_names_of_axes_and_buttons_are_rejected(
    axes: str, dead_man: str, confirm: str, told: str
) -> None:
    with pytest.raises(BadInputError, match=told):
        stick_map(PLANE, axes, None, dead_man, confirm, 0.1, 0.05)


def test_the_second_stick_and_the_directional_pad_lift_and_turn() -> None:
    used = stick_map(ROOM, None, None, "BTN_TR", "BTN_SOUTH", 0.1, 0.05)
    most = 0.05 * math.radians(100.0)  # a tenth of a degree per millimetre
    for code, value, way, about in (
        (ecodes.ABS_HAT0Y, -1000, (0.0, 0.0, 0.05), (0.0, 0.0, 0.0)),
        (ecodes.ABS_RX, 1000, (0.0, 0.0, 0.0), (0.0, most, 0.0)),
        (ecodes.ABS_RY, 1000, (0.0, 0.0, 0.0), (most, 0.0, 0.0)),
        (ecodes.ABS_HAT0X, -1000, (0.0, 0.0, 0.0), (0.0, 0.0, most)),
    ):
        rig = Rig(StandIn(-1000, 1000), used=used)
        rig.key(ecodes.BTN_TR, True)
        rig.pad.put(ecodes.EV_ABS, code, value)
        rig.run(1.0)
        assert rig.hand.position_m == pytest.approx(way, abs=1e-3)
        w, *vector = rig.hand.quaternion
        turned = Rotation.from_quat([*vector, w]).as_rotvec()
        assert turned == pytest.approx(about, abs=2e-3)


def test_the_second_stick_turns_a_planar_platform() -> None:
    used = stick_map((2, (2,)), None, None, "BTN_TR", "BTN_SOUTH", 0.1, 0.05)
    rig = Rig(StandIn(-1000, 1000), used=used)
    rig.key(ecodes.BTN_TR, True)
    rig.pad.put(ecodes.EV_ABS, ecodes.ABS_RX, -1000)
    rig.run(1.0)
    assert 2.0 * math.atan2(rig.hand.quaternion[3], rig.hand.quaternion[0]) == pytest.approx(
        0.05 * math.radians(100.0), rel=0.03
    )


def test_axes_that_do_not_fit_the_robot_are_rejected() -> None:
    for axes, turns, told in (
        ("ABS_X,ABS_Y", None, "--axes ABS_X,ABS_Y: 2 axes; allowed: 3 for this robot, x, y, z"),
        (None, "ABS_RX", "--turn-axes ABS_RX: 1 axes; allowed: 3 for this robot, about x, y, z"),
        (None, "ABS_X,ABS_RX,ABS_RY", "each axis may be used only once"),
    ):
        with pytest.raises(BadInputError, match=told):
            stick_map(ROOM, axes, turns, "BTN_TR", "BTN_SOUTH", 0.1, 0.05)
    for about, told in (((0, 1), "allowed: 2 for this robot, about x, y$"), ((), "robot$")):
        with pytest.raises(BadInputError, match=told):
            stick_map((3, about), None, "ABS_RX,ABS_RY,ABS_RZ", "BTN_TR", "BTN_SOUTH", 0.1, 0.05)
