"""A gamepad by evdev: found, read without waiting, and found again when it was unplugged."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final, Protocol

from tools.errors import BadInputError
from tools.teleop.hand import Hand
from tools.teleop.stick import AxisRange, Stick, StickMap

_EV_SYN, _EV_KEY, _EV_ABS = 0, 1, 3
_SYN_DROPPED = 3
_REPEATED = 2
"""A key's value while the kernel repeats it: no press."""
_SEEK_S: Final = 1.0
_LONGEST_S: Final = 0.1
_EVERY_DEVICE: Final = Path("/dev/input")


class InputDevice(Protocol):
    """What is used of `evdev.InputDevice`."""

    path: Any
    name: str

    def read(self) -> Iterable[Any]:
        """Return events (type, code, value); raises BlockingIOError, OSError when it is gone."""

    def absinfo(self, axis_num: int) -> Any:
        """Return value, min and max of an axis."""

    def capabilities(self, verbose: bool = ..., absinfo: bool = ...) -> dict[Any, Any]:
        """Return codes by type of event."""

    def close(self) -> None:
        """Close it."""


class Finder(Protocol):
    """Finds the device, at first and after it was unplugged."""

    def find(self) -> InputDevice | None:
        """Return it, None where it is not there; raises BadInputError where it is of no use."""

    def nowhere(self) -> str:
        """Say in what way it is not there."""


class Gamepad:
    """A stick and two buttons of a gamepad; unplugged, it holds the robot until it is back."""

    hint = "hold the dead man's button and push the stick; let go to stop; Ctrl-C ends"

    def __init__(self, finder: Finder, stick_map: StickMap, scale: float) -> None:
        device = finder.find()
        if device is None:
            raise BadInputError(finder.nowhere())
        self._finder, self._map = finder, stick_map
        self._stick = Stick(stick_map, scale)
        self._device: InputDevice | None = None
        self._sought_s = 0.0
        self._first = True
        self._take_up(device)

    def read(self, now_s: float) -> Hand:
        """Return where the hand is."""
        stick = self._stick
        if self._device is None:
            self._seek(now_s)
        if self._device is not None:
            self._drain(self._device)
        if self._first:
            self._first = False
            stick.disregard()  # what was pressed before anybody listened
        stick.advance(now_s, _LONGEST_S)
        trouble = "" if self._device is not None else "the gamepad is gone: plug it in again"
        return Hand(stick.position_m, not stick.held, stick.confirmed, trouble)

    def close(self) -> None:
        """Close the device."""
        if self._device is not None:
            self._device.close()

    def _take_up(self, device: InputDevice) -> None:
        ranges, values = {}, {}
        for axis in (self._map.x, self._map.y):
            told = device.absinfo(axis)
            ranges[axis], values[axis] = AxisRange(told.min, told.max), told.value
        self._stick.begin(ranges, values)
        self._device = device

    def _seek(self, now_s: float) -> None:
        if now_s - self._sought_s < _SEEK_S:
            return
        self._sought_s = now_s
        try:
            device = self._finder.find()
            if device is not None:
                self._take_up(device)
        except (BadInputError, OSError):
            return  # gone again, or not ready yet

    def _drain(self, device: InputDevice) -> None:
        try:
            while True:
                for event in device.read():
                    self._take(device, event.type, event.code, event.value)
        except BlockingIOError:
            return
        except OSError:
            self._stick.let_go()
            self._device = None
            device.close()

    def _take(self, device: InputDevice, kind: int, code: int, value: int) -> None:
        if kind == _EV_ABS:
            self._stick.move_axis(code, value)
        elif kind == _EV_KEY:
            if value != _REPEATED:
                self._stick.press(code, value != 0)
        elif kind == _EV_SYN and code == _SYN_DROPPED:
            # events were lost, perhaps the one that let go
            self._stick.let_go()
            for axis in (self._map.x, self._map.y):
                self._stick.move_axis(axis, device.absinfo(axis).value)


def stick_map(
    axes: str, dead_man: str, confirm: str, dead_zone: float, speed_m_s: float
) -> StickMap:
    """Return the map that names such as "ABS_X,-ABS_Y" and "BTN_TR" make; raises BadInputError."""
    names = axes.split(",")
    if len(names) != 2:
        raise BadInputError(f"--axes {axes}: allowed: two axes, such as ABS_X,-ABS_Y")
    x, y = (_code("--axes", name.removeprefix("-"), "ABS_") for name in names)
    turned = (names[0].startswith("-"), names[1].startswith("-"))
    if x == y:
        raise BadInputError(f"--axes {axes}: allowed: two different ones")
    held, pressed = _code("--dead-man", dead_man, "BTN_"), _code("--confirm", confirm, "BTN_")
    if held == pressed:
        raise BadInputError(f"--confirm {confirm}: allowed: another button than --dead-man")
    return StickMap(x, y, turned, held, pressed, dead_zone, speed_m_s)


class EvdevFinder:
    """Finds the device at `path`, or the first that has the axes and buttons of `used`.

    Raises BadInputError where the library for gamepads is missing.
    """

    def __init__(self, path: Path | None, used: StickMap) -> None:
        self._evdev = _evdev()
        self._path, self._used = path, used

    def find(self) -> InputDevice | None:
        """Open it; raises BadInputError where it may not be read, or has not what is needed."""
        path, refused = self._path, ""
        for node in [path] if path is not None else sorted(_EVERY_DEVICE.glob("event*")):
            try:
                device: InputDevice = self._evdev.InputDevice(str(node))
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
                f"{refused}: this user may not read it; allowed: members of its group, mostly "
                "`input`"
            )
        return None

    def nowhere(self) -> str:
        """Say in what way it is not there."""
        if self._path is not None:
            return f"--input {self._path}: is no input device; allowed: /dev/input/event0 and so on"
        return (
            "--device gamepad: none is plugged in that has the axes and buttons which --axes, "
            "--dead-man and --confirm name"
        )

    def _missing(self, device: InputDevice) -> str:
        """Return the names of what a device does not have, "" where it has everything."""
        names, used = self._evdev.ecodes, self._used
        has = device.capabilities(absinfo=False)
        lacks = [names.ABS[axis] for axis in (used.x, used.y) if axis not in has.get(_EV_ABS, ())]
        keys = (used.dead_man, used.confirm)
        lacks += [names.bytype[_EV_KEY][key] for key in keys if key not in has.get(_EV_KEY, ())]
        return ", ".join(name if isinstance(name, str) else name[0] for name in lacks)


def _code(option: str, name: str, prefix: str) -> int:
    codes: dict[str, int] = _evdev().ecodes.ecodes
    if not name.startswith(prefix) or name not in codes:
        raise BadInputError(
            f"{option}: {name!r}; allowed: a name of the kernel's, such as "
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
