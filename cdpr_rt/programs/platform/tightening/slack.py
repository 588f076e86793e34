"""Slack of cables that is taken up without pulling the platform off its place."""

from __future__ import annotations

import math

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.winch_speed_loop import WinchSpeedLoop
from cdpr_rt.programs.platform.platform_program import PlatformParts

TAKE_UP_m_s = 0.05
"""Speed at which slack is taken up."""
TAKE_UP_SHARE = 0.4
"""Tension while some cables are slack, as a share of the pretension."""
_SLOW_SHARE, _MEAN_S = 1.0 / 3.0, 0.04
"""Below that share of the speed a cable may be tight, by its mean over this time."""
_ENOUGH = 1.25
"""Tension over what winches usually take up, at which none sticks."""
_LEFT_m, _LEAVE_S = 0.005, 0.5
"""Slack that a tight cable is left with until all have been tight, and how long that may take."""
_LOOSE_m = 0.02
"""How far one may be reeled in after that; of one that goes further, friction had been taken for
tension, or the platform has moved."""
_PULLED = 0.95
_STILL_m, _STILL_S = 0.0003, 0.3
_USUAL_SHARE = 0.45
"""What usually turns a winch whose cable is slack, over the most that it may take up."""
_STAND_FRICTION = 0.3
_REMEDY = "take up slack by hand, or hold the platform"


class SlackTakeUp:
    """Reels in n cables until all are tight, while the platform stands on something.

    One may have much more slack than another, and what a platform weighs holds it against some
    newtons only. So each is paid out a little, reeled in until it is tight, and paid out a little
    again; once all have been, they become tight together, and each is pulled with no more than what
    that took. A cable is tight where its winch does not turn although it is pulled with what has
    turned it before, or with more than winches take up. Where a stand does not hold a platform so
    light against what turns a winch, the cables are reeled in together at once.
    """

    def __init__(
        self,
        winches: WinchSpeedLoop,
        parts: PlatformParts,
        cable_m: FloatArray,
    ) -> None:
        n, taken_up_N, period_s = cable_m.size, parts.control.pull_fit.taken_up_N, parts.period_s
        weight_N = float(np.linalg.norm(parts.model.weight()[: parts.model.positions]))
        self._names = parts.names
        self._winches, self._cable, self._enough_N = winches, cable_m, _ENOUGH * taken_up_N
        self._at_once = bool(_USUAL_SHARE * taken_up_N.max() > _STAND_FRICTION * weight_N)
        self._weight, self._leave_cycles = period_s / _MEAN_S, math.ceil(_LEAVE_S / period_s)
        self.tight_N = np.zeros(n)
        """What each tight cable is pulled with, 0 for those that are not tight."""
        self._dragged_m = np.zeros(n)
        """How far each tight cable has been reeled in since, where that is too far; else 0."""
        self._slack_m = np.zeros(n)
        """How far each was reeled in until it was tight, where all are at once; else 0."""
        self._from_rad, self._speed_m_s = np.zeros((2, n))
        self._turned_N = np.zeros(n)
        """Most that has turned each winch, what its cable weighs included."""
        self._leaving = np.zeros(n, np.int64)
        """Cycles for which a cable has been paid out again, 0 for others."""
        self._been_tight, self._left = np.zeros((2, n), np.bool_)
        """Which have been tight, and which of them have a little slack now."""

    @property
    def tight(self) -> bool:
        """Whether all cables are tight at once."""
        return bool(self.tight_N.all())

    def dragged(self) -> str:
        """Return which tight cable was reeled in too far on, "" for none."""
        i = int(self._dragged_m.argmax())
        if self._dragged_m[i] == 0.0:
            return ""
        return (
            f"{self._names[i]}: {1e3 * self._dragged_m[i]:.0f} mm reeled in since it was tight, "
            f"{1e3 * _LOOSE_m:.0f} mm allowed: the platform has moved on its stand; {_REMEDY}"
        )

    def uneven(self, allowed_m: float) -> str:
        """Return whose slack was so much more that the platform may have moved, "" for none."""
        i, j = int(self._slack_m.argmax()), int(self._slack_m.argmin())
        more_m = self._slack_m[i] - self._slack_m[j]
        if more_m <= allowed_m:
            return ""
        return (
            f"{self._names[i]} had {1e3 * more_m:.0f} mm more slack than {self._names[j]}, "
            f"{1e3 * allowed_m:.0f} mm allowed: what turns its winches pulls so light a platform "
            f"along; {_REMEDY}"
        )

    def begin(self, position_rad: FloatArray) -> None:
        """Begin anew at these angles (n,), no cable being known as tight.

        All are paid out a little first: what a winch takes that never turns is not known.
        """
        self._turned_N[:] = self._slack_m[:] = 0.0
        self._begin(position_rad)
        self._leaving[:] = not self._at_once

    def _begin(self, position_rad: FloatArray) -> None:
        self._left[:] = self._been_tight[:] = self._at_once
        self._leaving[:], self._dragged_m[:] = 0, 0.0
        self._reel_in(position_rad)

    def update(self, position_rad: FloatArray, pretension_N: FloatArray, share: float) -> None:
        """Raise the winches' bounds of tension and set their speeds, (n,) each.

        Cables that are reeled in pull with a share, which grows to 1, of what they may; with more
        only by the bounds that there are.
        """
        winches, most_N = self._winches, TAKE_UP_SHARE * pretension_N
        if not self._at_once:
            most_N = np.minimum(np.maximum(most_N, self._enough_N), pretension_N)
        reeled_m = (self._from_rad - position_rad) * self._cable
        now = self._tight_now(np.minimum(self._enough_N, _PULLED * most_N))
        np.maximum(winches.high_N, min(share, 1.0) * most_N, out=winches.high_N)
        if self._left.all():
            self._pull_together(now, reeled_m)
            if not self._at_once and ((self.tight_N == 0.0) & (reeled_m > _LOOSE_m)).any():
                self._begin(position_rad)
        else:
            self._leave(now, reeled_m)
            if self._left.all():
                self._reel_in(position_rad)
        self._from_rad[now] = position_rad[now]

    def _pull_together(self, now: BoolArray, reeled_m: FloatArray) -> None:
        tight, high_N = self.tight_N > 0.0, self._winches.high_N
        self._dragged_m[:] = np.where(tight & (reeled_m > _LOOSE_m), reeled_m, 0.0)
        self.tight_N[now] = self._winches.tension_N[now]
        if self._at_once:
            self._slack_m[now] = reeled_m[now]
        np.copyto(high_N, self.tight_N, where=self.tight_N > 0.0)

    def _leave(self, now: BoolArray, reeled_m: FloatArray) -> None:
        """Pay out cables that are tight `now` (n,), and hold those that have a little slack."""
        winches, leaving = self._winches, self._leaving > 0
        over = leaving & ((reeled_m < -_LEFT_m) | (self._leaving > self._leave_cycles))
        self._been_tight |= now
        self._left |= over & self._been_tight
        self._speed_m_s[over] = TAKE_UP_m_s  # what begins to turn only is not tight by that
        leaving = (leaving & ~over) | now
        self._leaving[:] = np.where(leaving, self._leaving + 1, 0)
        # those that wait are held: cogging would turn them
        winches.low_N[leaving | self._left] = -self._enough_N[leaving | self._left]
        np.minimum(winches.high_N, self._enough_N, out=winches.high_N, where=self._left)
        winches.paying_out_m_s[leaving], winches.paying_out_m_s[self._left] = TAKE_UP_m_s, 0.0

    def _reel_in(self, position_rad: FloatArray) -> None:
        # one that only begins to turn, or is still pulled as it was before, is not tight by that
        self._from_rad[:], self._speed_m_s[:] = position_rad, TAKE_UP_m_s
        self.tight_N[:] = 0.0

    def _tight_now(self, enough_N: FloatArray) -> BoolArray:
        """Return which of the cables that are reeled in, and not yet tight, are tight now, (n,)."""
        winches = self._winches
        reeling_m_s = -self._cable * winches.speed_rad_s
        self._speed_m_s += self._weight * (reeling_m_s - self._speed_m_s)
        # one that breaks loose has turned before its mean tells
        np.maximum(self._speed_m_s, reeling_m_s, out=self._speed_m_s)
        reeled_in = (~self._left | self._left.all()) & (self._leaving == 0)
        if not self._at_once:
            turns = reeled_in & (reeling_m_s > 0.5 * TAKE_UP_m_s)
            np.maximum(self._turned_N, winches.tension_N, out=self._turned_N, where=turns)
            enough_N = np.where(
                self._turned_N > 0.0, np.minimum(self._turned_N, enough_N), enough_N
            )
        slow = self._speed_m_s < _SLOW_SHARE * TAKE_UP_m_s
        pulled = reeled_in & (winches.tension_N >= enough_N)
        return np.asarray(slow & pulled & (self.tight_N == 0.0))


class Stillness:
    """Whether n cables have stood still for a while."""

    def __init__(self, cable_m: FloatArray, period_s: float) -> None:
        self._cable, self._cycles = cable_m, math.ceil(_STILL_S / period_s)
        self._at_rad, self._still = np.zeros(cable_m.size), 0

    def begin(self, position_rad: FloatArray) -> None:
        """Begin anew at these angles (n,)."""
        self._at_rad[:], self._still = position_rad, 0

    def lasts(self, position_rad: FloatArray, pulled: bool) -> bool:
        """Take in a cycle; return whether they have stood still, and were pulled, for so long."""
        if not pulled or np.abs((position_rad - self._at_rad) * self._cable).max() > _STILL_m:
            self.begin(position_rad)
        self._still += 1
        return self._still > self._cycles
