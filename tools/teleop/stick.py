"""What a gamepad's events do to a hand: sticks, a button to be held, one to confirm."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cdpr_tools.teleop.input_device import Hand, Quaternion, TURN_RAD_PER_m, Vector

SignedAxis = tuple[int, int]
"""An axis, and -1 where it is turned round: sticks count downward."""


@dataclass(frozen=True)
class AxisRange:
    """The values that an axis of a stick has, as the kernel tells them."""

    least: int
    most: int

    def part(self, value: int) -> float:
        """Return a value as a part of the way from the middle, -1 to 1."""
        half = 0.5 * (self.most - self.least)
        return min(max((value - self.least) / half - 1.0, -1.0), 1.0) if half > 0.0 else 0.0


@dataclass(frozen=True)
class StickMap:
    """Which axes and buttons mean what, by the numbers of evdev, and how they act."""

    moves: tuple[SignedAxis, ...]
    """Axes that move the hand along x, y, z; z may be left out."""
    turns: tuple[SignedAxis, ...]
    """Axes that turn it, about those of the room's axes that `about` says."""
    about: tuple[int, ...]
    dead_man: int
    confirm: int
    dead_zone: float
    """Part of the way, in any direction, in which a stick does nothing."""
    speed_m_s: float
    """Of the hand, with a stick at its end; it turns `TURN_RAD_PER_m` times as fast."""

    @property
    def axes(self) -> tuple[int, ...]:
        """Return all axes that are used."""
        return tuple(axis for axis, _ in (*self.moves, *self.turns))


class Stick:
    """A hand that moves as fast as sticks are pushed, while the dead man's button is held.

    The speed grows with the square of the way from the dead zone's edge, so that it can be slow.
    Only a press that is seen counts: a button that was held before leads nobody.
    """

    def __init__(self, stick_map: StickMap, scale: float) -> None:
        self._map = stick_map
        self._hand = Hand(scale)
        self._ranges = dict.fromkeys(stick_map.axes, AxisRange(-1, 1))
        self._parts = dict.fromkeys(stick_map.axes, 0.0)
        self._before_s = math.nan
        self.held = False
        """Whether the dead man's button is held."""
        self.confirmed = 0

    @property
    def position_m(self) -> Vector:
        """Return where the hand is."""
        return self._hand.position_m

    @property
    def quaternion(self) -> Quaternion:
        """Return how the hand is turned."""
        return self._hand.quaternion

    def begin(self, ranges: dict[int, AxisRange], values: dict[int, int]) -> None:
        """Go on with a device that has these ranges, its axes at these values; nothing is held."""
        self._ranges = ranges
        self.held = False
        for axis, value in values.items():
            self.move_axis(axis, value)

    def reset(self) -> None:
        """Take back what was confirmed so far."""
        self.confirmed = 0

    def release(self) -> None:
        """Take the hand off: the device is gone, or what it did is not known."""
        self.held = False
        self._parts = dict.fromkeys(self._parts, 0.0)

    def move_axis(self, axis: int, value: int) -> None:
        """Note where an axis stands."""
        if axis in self._parts:
            self._parts[axis] = self._ranges[axis].part(value)

    def press(self, key: int, down: bool) -> None:
        """Note a button that goes down or up."""
        if key == self._map.dead_man:
            self.held = down
        elif key == self._map.confirm and down:
            self.confirmed += 1

    def advance(self, now_s: float, longest_s: float) -> None:
        """Move the hand on to `now_s`, in one go by no more than `longest_s` takes it."""
        passed_s = min(now_s - self._before_s, longest_s)
        self._before_s = now_s
        if not self.held or not passed_s > 0.0:
            return
        used, way_m = self._map, self._map.speed_m_s * passed_s
        x, y, *z = self._pushed(used.moves)
        self._hand.move((way_m * x, way_m * y, way_m * sum(z)))
        vector = [0.0, 0.0, 0.0]
        for axis, pushed in zip(used.about, self._pushed(used.turns), strict=True):
            vector[axis] = TURN_RAD_PER_m * way_m * pushed
        self._hand.turn((vector[0], vector[1], vector[2]))

    def _pushed(self, axes: tuple[SignedAxis, ...]) -> list[float]:
        """Return how fast each of the axes is to go, -1 to 1; the first two are one stick."""
        values = [sign * self._parts[axis] for axis, sign in axes]
        dead, speeds = self._map.dead_zone, []
        for stick in (values[:2], values[2:]):
            way = math.hypot(*stick)
            share = min(max(way - dead, 0.0) / (1.0 - dead), 1.0) ** 2
            speeds += [share * value / way if way > 0.0 else 0.0 for value in stick]
        return speeds
