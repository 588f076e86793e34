"""A gamepad through evdev: found, read without waiting, and found again after unplugging.

Its events act on a hand: sticks move it, one button must be held, another one confirms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cdpr_tools.errors import BadInputError
from cdpr_tools.teleop.input_device import (
    Directions,
    Hand,
    InputSample,
    TURN_RAD_PER_m,
)

if TYPE_CHECKING:
    from evdev import InputDevice

    EvdevDevice = InputDevice[str]

SignedAxis = tuple[int, int]
"""An axis, and -1 if it is reversed: sticks count downward."""


@dataclass(frozen=True)
class AxisRange:
    """The range of values of a stick's axis, as the kernel reports it."""

    least: int
    most: int

    def part(self, value: int) -> float:
        """Return a value as a share of the travel from the middle, -1 to 1."""
        half = 0.5 * (self.most - self.least)
        return min(max((value - self.least) / half - 1.0, -1.0), 1.0) if half > 0.0 else 0.0


@dataclass(frozen=True)
class StickMap:
    """Functions of axes and buttons, by their evdev numbers, and their settings."""

    moves: tuple[SignedAxis, ...]
    """Axes that move the hand along x, y, z; z may be missing."""
    turns: tuple[SignedAxis, ...]
    """Axes that turn the hand, each about one axis of the room."""
    about: tuple[int, ...]
    """Room axis of each entry of `turns`: 0, 1, 2 for x, y, z."""
    dead_man: int
    confirm: int
    dead_zone: float
    """Share of a stick's travel around the middle in which it has no effect."""
    speed_m_s: float
    """Speed of the hand with a fully pushed stick. The hand turns at `TURN_RAD_PER_m` times this
    speed.
    """

    @property
    def axes(self) -> tuple[int, ...]:
        """Return all axes in use."""
        return tuple(axis for axis, _ in (*self.moves, *self.turns))


class Stick(Hand):
    """A hand that moves as fast as sticks are pushed, while the dead man's button is held.

    The speed grows with the square of the travel beyond the dead zone, to allow slow motion. A
    press counts only if this process has seen it: a button that was already held does not move the
    robot.
    """

    def __init__(self, stick_map: StickMap, scale: float) -> None:
        super().__init__(scale)
        self._map = stick_map
        self._ranges = dict.fromkeys(stick_map.axes, AxisRange(-1, 1))
        self._parts = dict.fromkeys(stick_map.axes, 0.0)
        self._before_s = math.nan
        self.held = False
        """Whether the dead man's button is held."""
        self.confirmed = 0

    def begin(self, ranges: dict[int, AxisRange], values: dict[int, int]) -> None:
        """Start with a device that has these ranges and axis values; no button counts as held."""
        self._ranges = ranges
        self.held = False
        for axis, value in values.items():
            self.move_axis(axis, value)

    def reset(self) -> None:
        """Discard confirmations so far."""
        self.confirmed = 0

    def release(self) -> None:
        """Release the hand: the device is gone, or its state is unknown."""
        self.held = False
        self._parts = dict.fromkeys(self._parts, 0.0)

    def move_axis(self, axis: int, value: int) -> None:
        """Store the position of an axis."""
        if axis in self._parts:
            self._parts[axis] = self._ranges[axis].part(value)

    def press(self, key: int, down: bool) -> None:
        """Process a button that goes down or up."""
        if key == self._map.dead_man:
            self.held = down
        elif key == self._map.confirm and down:
            self.confirmed += 1

    def advance(self, now_s: float, longest_s: float) -> None:
        """Advance the hand to `now_s`; one call moves it for `longest_s` at most."""
        passed_s = min(now_s - self._before_s, longest_s)
        self._before_s = now_s
        if not self.held or not passed_s > 0.0:
            return
        used, way_m = self._map, self._map.speed_m_s * passed_s
        x, y, *z = self._pushed(used.moves)
        self.move((way_m * x, way_m * y, way_m * sum(z)))
        vector = [0.0, 0.0, 0.0]
        for axis, pushed in zip(used.about, self._pushed(used.turns), strict=True):
            vector[axis] = TURN_RAD_PER_m * way_m * pushed
        self.turn((vector[0], vector[1], vector[2]))

    def _pushed(self, axes: tuple[SignedAxis, ...]) -> list[float]:
        """Return the speed of each axis, -1 to 1; the first two belong to one stick."""
        values = [sign * self._parts[axis] for axis, sign in axes]
        dead, speeds = self._map.dead_zone, []
        for stick in (values[:2], values[2:]):
            way = math.hypot(*stick)
            share = min(max(way - dead, 0.0) / (1.0 - dead), 1.0) ** 2
            speeds += [share * value / way if way > 0.0 else 0.0 for value in stick]
        return speeds


_EV_SYN, _EV_KEY, _EV_ABS = 0, 1, 3
_SYN_DROPPED = 3
_REPEATED = 2
"""A key's value while the kernel repeats it; it is not a press."""
_SEEK_S: Final = 1.0
_LONGEST_S: Final = 0.1
_EVERY_DEVICE: Final = Path("/dev/input")
AXES: Final = {2: "ABS_X,-ABS_Y", 3: "ABS_X,-ABS_Y,-ABS_HAT0Y"}
"""Left stick, and the directional pad upward: they move the hand along x, y, z."""
TURN_AXES: Final = {0: "", 1: "-ABS_RX", 2: "ABS_RY,ABS_RX", 3: "ABS_RY,ABS_RX,-ABS_HAT0X"}
"""Right stick, and the directional pad to the left: they turn the hand. Keys: number of angles."""


class Gamepad:
    """Sticks and two buttons of a gamepad; if unplugged, it holds the robot until it is back."""

    hint = "hold the dead man's button and push a stick; release it to stop; Ctrl-C ends"

    def __init__(self, finder: EvdevFinder, stick_map: StickMap, scale: float) -> None:
        device = finder.find()
        if device is None:
            raise BadInputError(finder.missing_text())
        self._finder, self._map = finder, stick_map
        self._stick = Stick(stick_map, scale)
        self._device: EvdevDevice | None = None
        self._sought_s = 0.0
        self._first = True
        self._attach(device)

    def read(self, now_s: float) -> InputSample:
        """Return the present sample of the hand."""
        stick = self._stick
        if self._device is None:
            self._seek(now_s)
        if self._device is not None:
            self._drain(self._device)
        if self._first:
            self._first = False
            stick.reset()  # presses before the first read do not count
        stick.advance(now_s, _LONGEST_S)
        trouble = "" if self._device is not None else "the gamepad is unplugged: plug it in again"
        return InputSample(
            stick.position_m, stick.quaternion, not stick.held, stick.confirmed, trouble
        )

    def close(self) -> None:
        """Close the device."""
        if self._device is not None:
            self._device.close()

    def _attach(self, device: EvdevDevice) -> None:
        ranges, values = {}, {}
        for axis in self._map.axes:
            info = device.absinfo(axis)
            ranges[axis], values[axis] = AxisRange(info.min, info.max), info.value
        self._stick.begin(ranges, values)
        self._device = device

    def _seek(self, now_s: float) -> None:
        if now_s - self._sought_s < _SEEK_S:
            return
        self._sought_s = now_s
        try:
            device = self._finder.find()
            if device is not None:
                self._attach(device)
        except (BadInputError, OSError):
            return  # gone again, or not yet ready

    def _drain(self, device: EvdevDevice) -> None:
        try:
            while True:
                for event in device.read():
                    self._take(device, event.type, event.code, event.value)
        except BlockingIOError:
            return
        except OSError:
            self._stick.release()
            self._device = None
            device.close()

    def _take(self, device: EvdevDevice, kind: int, code: int, value: int) -> None:
        if kind == _EV_ABS:
            self._stick.move_axis(code, value)
        elif kind == _EV_KEY:
            if value != _REPEATED:
                self._stick.press(code, value != 0)
        elif kind == _EV_SYN and code == _SYN_DROPPED:
            # events were lost, perhaps the release of the button
            self._stick.release()
            for axis in self._map.axes:
                self._stick.move_axis(axis, device.absinfo(axis).value)


def stick_map(
    directions: Directions,
    axes: str | None,
    turn_axes: str | None,
    dead_man: str,
    confirm: str,
    dead_zone: float,
    speed_m_s: float,
) -> StickMap:
    """Return the map for names such as "ABS_X,-ABS_Y" and "BTN_TR"; raises BadInputError.

    By default the axes are those of `AXES` and `TURN_AXES`.
    """
    k, about = directions
    moves = _axes("--axes", axes or AXES[k], "xyz"[:k])
    turned = "".join("xyz"[axis] for axis in about)
    turns = _axes("--turn-axes", turn_axes or TURN_AXES[len(about)], turned, "about ")
    named = [axis for axis, _ in (*moves, *turns)]
    if len(set(named)) < len(named):
        given = ",".join(filter(None, (axes or AXES[k], turn_axes or TURN_AXES[len(about)])))
        raise BadInputError(f"--axes, --turn-axes {given}: each axis may be used only once")
    held, pressed = _code("--dead-man", dead_man, "BTN_"), _code("--confirm", confirm, "BTN_")
    if held == pressed:
        raise BadInputError(f"--confirm {confirm}: must differ from the button of --dead-man")
    return StickMap(moves, turns, about, held, pressed, dead_zone, speed_m_s)


def _axes(option: str, text: str, directions: str, how: str = "") -> tuple[SignedAxis, ...]:
    names = [name for name in text.split(",") if name]
    if len(names) != len(directions):
        allowed = f"{len(directions)} for this robot"
        if directions:
            allowed += f", {how}{', '.join(directions)}"
        raise BadInputError(f"{option} {text}: {len(names)} axes; allowed: {allowed}")
    return tuple(
        (_code(option, name.removeprefix("-"), "ABS_"), -1 if name.startswith("-") else 1)
        for name in names
    )


class EvdevFinder:
    """Finds the device at `path`, or the first that has the axes and buttons of `used`.

    Raises BadInputError if the library for gamepads is missing.
    """

    def __init__(self, path: Path | None, used: StickMap) -> None:
        self._evdev = _evdev()
        self._path, self._used = path, used

    def find(self) -> EvdevDevice | None:
        """Open the device; raises BadInputError if it is unreadable or lacks an axis or button."""
        path, refused = self._path, ""
        for node in [path] if path is not None else sorted(_EVERY_DEVICE.glob("event*")):
            try:
                device: EvdevDevice = self._evdev.InputDevice(str(node))
            except PermissionError:
                refused = refused or str(node)
                continue
            except OSError:
                continue
            missing = self._missing(device)
            if not missing:
                return device
            device.close()
            if path is not None:
                raise BadInputError(f"--input {path}: {device.name}: has no {missing}")
        if refused:
            raise BadInputError(
                f"{refused}: no permission; join the group of the device, usually `input`"
            )
        return None

    def missing_text(self) -> str:
        """Return the text that says why no device was found."""
        if self._path is not None:
            return (
                f"--input {self._path}: is not an input device; allowed: /dev/input/event0 and "
                "so on"
            )
        return (
            "--device gamepad: no gamepad has all axes and buttons of --axes, --turn-axes, "
            "--dead-man and --confirm"
        )

    def _missing(self, device: EvdevDevice) -> str:
        """Return the names of the parts that a device lacks; "" if it has all."""
        names, used = self._evdev.ecodes, self._used
        has = device.capabilities(absinfo=False)
        lacks = [names.ABS[axis] for axis in used.axes if axis not in has.get(_EV_ABS, ())]
        keys = (used.dead_man, used.confirm)
        lacks += [names.bytype[_EV_KEY][key] for key in keys if key not in has.get(_EV_KEY, ())]
        return ", ".join(name if isinstance(name, str) else name[0] for name in lacks)


def _code(option: str, name: str, prefix: str) -> int:
    codes: dict[str, int] = _evdev().ecodes.ecodes
    if not name.startswith(prefix) or name not in codes:
        raise BadInputError(
            f"{option}: {name!r}; allowed: a name of the Linux kernel, such as "
            f"{'ABS_X' if prefix == 'ABS_' else 'BTN_SOUTH'} (`evtest` shows a device's)"
        )
    return codes[name]


def _evdev() -> Any:
    try:
        import evdev  # noqa: PLC0415  # an extra; not on every machine
    except ImportError:
        raise BadInputError(
            "--device gamepad: needs the package evdev; pip install 'cdpr-rt[gamepad]'"
        ) from None
    return evdev
