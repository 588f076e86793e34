"""What a gamepad's events do to a hand: one stick, a button to be held, one to confirm."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tools.teleop.hand import LimitedHand


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

    x: int
    y: int
    """Positive is upward; sticks count downward, so it is usually turned round."""
    turned: tuple[bool, bool]
    dead_man: int
    confirm: int
    dead_zone: float
    """Part of the way, in any direction, in which the stick does nothing."""
    speed_m_s: float
    """Of the hand, with the stick at its end."""


class Stick:
    """A hand that moves as fast as a stick is pushed, while the dead man's button is held.

    The speed grows with the square of the way from the dead zone's edge, so that it can be slow.
    Only a press that is seen counts: a button that was held before leads nobody.
    """

    def __init__(self, stick_map: StickMap, scale: float) -> None:
        self._map = stick_map
        self._hand = LimitedHand(scale)
        self._ranges = {stick_map.x: AxisRange(-1, 1), stick_map.y: AxisRange(-1, 1)}
        self._parts = {stick_map.x: 0.0, stick_map.y: 0.0}
        self._before_s = math.nan
        self.held = False
        """Whether the dead man's button is held."""
        self.confirmed = 0

    @property
    def position_m(self) -> tuple[float, float]:
        """Return where the hand is."""
        return self._hand.position_m

    def begin(self, ranges: dict[int, AxisRange], values: dict[int, int]) -> None:
        """Go on with a device that has these ranges, its axes at these values; nothing is held."""
        self._ranges = ranges
        self.held = False
        for axis, value in values.items():
            self.move_axis(axis, value)

    def disregard(self) -> None:
        """Take back what was confirmed so far."""
        self.confirmed = 0

    def let_go(self) -> None:
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
        x, y = self._velocity_m_s()
        self._hand.move(x * passed_s, y * passed_s)

    def _velocity_m_s(self) -> tuple[float, float]:
        x, y = self._parts[self._map.x], self._parts[self._map.y]
        x, y = (-x if self._map.turned[0] else x), (-y if self._map.turned[1] else y)
        way, dead = math.hypot(x, y), self._map.dead_zone
        if way <= dead:
            return 0.0, 0.0
        speed = self._map.speed_m_s * min((way - dead) / (1.0 - dead), 1.0) ** 2
        return speed * x / way, speed * y / way
