"""Slack of cables that is taken up without pulling the platform off its place."""

from __future__ import annotations

import math

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.winch_speed_loop import WinchSpeedLoop
from cdpr_rt.jit import bound
from cdpr_rt.programs.platform.platform_program import PlatformParts
from cdpr_rt.programs.platform.tightening import slack_kernel as kernel

_ENOUGH = 1.25
"""Tension over what winches usually take up, at which none sticks."""
_STILL_m, _STILL_S, _STILL_COUNTS = 0.0003, 0.3, 2.5
_TURNED_m = 0.005
"""How far a winch has turned that has not just stuck."""
_WEAK_S = 0.04
"""For how long a motor whose encoder has shown a count or two may pull with less."""
_USUAL_SHARE = 0.45
"""What usually turns a winch whose cable is slack, over the most that it may take up."""
_STAND_FRICTION, _ASIDE_SHARE = 0.3, 0.5
"""Of the stand, over the platform's weight, and what one cable may pull at it with over that."""
_HANGING_SHARES = np.linspace(0.05, 1.0, 96)[:, None]
"""Of the pretension, at which it is looked how far cables still come in."""
_MOVED_m, _ALONE_m = 0.005, 0.0025
"""By how much a cable may be tight elsewhere than it was by itself; within which all others are
where only its winch had stuck."""
_LEAST_SHARE = 0.2
"""Of its pull, the least tension of a cable whose winch's friction is as much."""
_ALONG_m = 1.5 * kernel.LOOSE_m
"""How far a light platform may have been pulled along that is told."""
_DIRECTIONS, _POINTS, _ABOUT_UP = 16, 0.2, 5
"""Horizontal directions that are looked at, how much a cable has to point there to pull, and which
component of a twist turns about the vertical."""
_REMEDY = "take up slack by hand, or hold the platform"


class SlackTakeUp:
    """Reels in n cables until all are tight, while the platform stands on something.

    One may have much more slack than another, and what a platform weighs holds it against some
    newtons only. So each is paid out a little, reeled in until it is tight, and paid out a little
    again; once all have been, they become tight together, and each is pulled with no more than what
    that took. A winch may pull with more than has turned it only while it stands still. Its cable
    is tight where it does although it is pulled with the most that has turned it, and with what the
    stand surely holds, or with more than winches take up. Where a platform so light slides or tips
    over on its stand by what turns a winch, the cables are reeled in together at once.
    """

    def __init__(
        self,
        winches: WinchSpeedLoop,
        parts: PlatformParts,
        cable_m: FloatArray,
        pretension_N: FloatArray,
    ) -> None:
        """Take the pretension at home, (n,)."""
        n, taken_up_N = cable_m.size, parts.control.pull_fit.taken_up_N
        weight_N = float(np.linalg.norm(parts.model.weight()[: parts.model.positions]))
        self._names, self._cable, self._winches = parts.names, cable_m, winches
        usual_N = _USUAL_SHARE * taken_up_N
        stands_N = min(_STAND_FRICTION, parts.model.tips_at) * weight_N
        self._lengths_at_home = parts.control.lengths_at_home
        hanging_N = _hanging_N(parts, pretension_N)
        self._at_once = bool(usual_N.max() > stands_N)
        self._usual_N, self._enough_N = usual_N, _ENOUGH * taken_up_N
        self._aside = _towards_exits(parts)
        self._about_up, self._arm_m = _turned(parts)
        self._phase, self._state = np.zeros(n, np.int64), np.zeros((n, kernel.STATE))
        self.tight_N = self._state[:, kernel.TIGHT_N]
        """What each tight cable is pulled with, 0 for those that are not tight."""
        self.off_home = ""
        """How far the platform may stand from home, as a notice."""
        self._loose, self._busy = np.zeros((2, n), np.bool_)
        self._dragged, self._furthest = -1, 0
        driven = kernel.Winches(
            parts.period_s, self._at_once, cable_m, self._enough_N,
            np.maximum(usual_N, _ASIDE_SHARE * stands_N), np.full(n, stands_N),
            np.where(hanging_N > 0.0, hanging_N + usual_N, 0.0),
            winches.speed_rad_s,
            winches.tension_N, winches.low_N, winches.high_N, winches.paying_out_m_s,
        )  # fmt: skip
        self._take_up = bound(
            kernel.take_up, driven, self._phase, self._state,
            then=(np.zeros(n), np.zeros(n), 0.0),
        )  # fmt: skip

    @property
    def not_tight(self) -> BoolArray:
        """Which cables are neither tight nor wait for others with a little slack, (n,); reused."""
        np.not_equal(self._phase, kernel.TIGHT, out=self._loose)
        np.not_equal(self._phase, kernel.WAITING, out=self._busy)
        return np.logical_and(self._loose, self._busy, out=self._loose)

    def pulls(self, which: BoolArray) -> str:
        """Return with what those of `which` (n,) whose turn it is are pulled, and may be."""
        pull_N, may_N = self._winches.tension_N, self._winches.high_N
        return "; ".join(
            f"{self._names[i]} pulls with {pull_N[i]:.1f} N, up to {may_N[i]:.1f} N asked for"
            for i in np.flatnonzero(which & (self._phase != kernel.NEXT))
        )

    def dragged(self, position_rad: FloatArray) -> str:
        """Return which tight cable was reeled in too far on, "" for none."""
        i = self._dragged
        if i < 0:
            return ""
        reeled_m = (self._state[i, kernel.FROM_rad] - position_rad[i]) * self._cable[i]
        return (
            f"{self._names[i]}: {1e3 * reeled_m:.1f} mm reeled in since it was tight, "
            f"{1e3 * kernel.LOOSE_m:.1f} mm allowed: the platform has moved on its stand; {_REMEDY}"
        )

    def why_moved(self, position_rad: FloatArray, pulled: bool) -> str:
        """Return why the platform is not at home any more, "" where it may be.

        Where it may be a little off, as a light one that slack lets be pulled along, that is told
        as `off_home`.

        Either all cables have just become tight, or they are `pulled` with their pretension since.
        """
        if self._at_once:
            self.off_home = self._along(position_rad) if pulled else ""
            return self._uneven(position_rad, pulled)
        if pulled:
            return ""
        why, self.off_home = self._moved()
        return why

    def _uneven(self, position_rad: FloatArray, pulled: bool) -> str:
        """Return whose slack was so much more that the platform may have moved, "" for none.

        Slack is how far a cable has come in until now, but for its stretch. What did not turn its
        winch as the others became tight may turn it only once all are `pulled` harder.
        """
        slack_m = self._slack_m(position_rad)
        told = pulled | (np.abs(slack_m) > _TURNED_m)
        i = int(np.where(told, slack_m, -np.inf).argmax())
        j = int(np.where(told, slack_m, np.inf).argmin())
        more_m, allowed_m = slack_m[i] - slack_m[j], kernel.LOOSE_m
        if more_m <= allowed_m:
            return ""
        if slack_m[j] < _TURNED_m and self._winches.high_N[j] < self._enough_N[j]:
            return (
                f"{self._names[j]}: {self._winches.high_N[j]:.0f} N have not reeled it in, as "
                f"{self._names[i]} was by {1e3 * slack_m[i]:.1f} mm: its winch may rub with up to "
                f"{self._enough_N[j] / _ENOUGH:.0f} N, and its cable be slack; have the cables "
                "pulled with more: see `cdpr robot show`"
            )
        return (
            f"{self._names[i]} had {1e3 * more_m:.1f} mm more slack than {self._names[j]}, "
            f"{1e3 * allowed_m:.1f} mm allowed: what turns its winches pulls so light a platform "
            f"along; {_REMEDY}"
        )

    def _slack_m(self, position_rad: FloatArray) -> FloatArray:
        """Return how far each cable has come in until now, (n,), but for its stretch."""
        on_m = (self._state[:, kernel.FROM_rad] - position_rad) * self._cable
        stretch_m = self._lengths_at_home(self.tight_N) - self._lengths_at_home(
            self._winches.high_N
        )
        return np.asarray(self._state[:, kernel.SLACK_m] + on_m - stretch_m)

    def _moved(self) -> tuple[str, str]:
        """Return why not to pull at it, and what to tell of it, either "" for nothing.

        A cable that is tight elsewhere than it was first by itself, but for its stretch and what
        friction makes of it, tells that the platform has moved meanwhile. Where only one is, and
        further in, its winch may have stuck: a platform that moves concerns several.
        """
        state, length_m = self._state, self._lengths_at_home
        in_m = (state[:, kernel.FIRST_rad] - state[:, kernel.FROM_rad]) * self._cable
        in_m -= length_m(state[:, kernel.FIRST_N]) - length_m(self.tight_N)
        # of what it is pulled with, friction may hold as much
        true_N = np.maximum(self.tight_N - self._usual_N, _LEAST_SHARE * self.tight_N)
        rubbed_m = length_m(true_N) - length_m(self.tight_N)
        # one that hangs through where it was tight first had no length there
        off_m = np.nan_to_num(np.abs(in_m) - rubbed_m, nan=-np.inf)
        i = int(off_m.argmax())
        if not off_m[i] > _MOVED_m:
            return "", ""
        told = (
            f"{self._names[i]}: tight {1e3 * abs(in_m[i]):.1f} mm further "
            f"{'in' if in_m[i] > 0.0 else 'out'} than it was by itself, "
            f"{1e3 * (rubbed_m[i] + _MOVED_m):.1f} mm allowed"
        )
        if in_m[i] > 0.0 and np.count_nonzero(off_m > _ALONE_m) == 1:
            return "", f"{told}: its winch had stuck, or the platform may stand about so far off"
        return (
            f"{told}: a winch has pulled the platform along on its stand; put it back to its "
            f"home, and {_REMEDY}"
        ), ""

    def _along(self, position_rad: FloatArray) -> str:
        """Return how far a light platform may stand from its home, "" for not far.

        Cables that are reeled in together pull it along until all of those that point there have
        been tight from the beginning: t = min s_i/(u_i e), s_i being the slack of a cable along
        u_i, in the horizontal direction e in which that is the furthest; and so they turn it.
        """
        slack_m = np.maximum(self._slack_m(position_rad), 0.0)
        aside_m, turned_m = _most_m(self._aside, slack_m), _most_m(self._about_up, slack_m)
        if max(aside_m, turned_m) <= _ALONG_m:
            return ""
        turned_deg = math.degrees(turned_m / self._arm_m)
        turned = f", and be turned by up to about {turned_deg:.0f} degrees" if turned_m else ""
        return (
            "what turns its winches pulls so light a platform along on its stand: by its cables' "
            f"slack it may stand up to about {1e3 * aside_m:.0f} mm from where its lengths say"
            f"{turned}; {_REMEDY}"
        )

    def begin(self, position_rad: FloatArray) -> None:
        """Begin anew at these angles (n,), no cable being known as tight.

        All are paid out a little first: what a winch takes that never turns is not known.
        """
        self._state[:, (kernel.MAY_N, kernel.TURNED_N, kernel.FREE_N, kernel.SLACK_m)] = 0.0
        self._state[:, kernel.FIRST_rad] = np.nan
        self._dragged, self._furthest, self.off_home = -1, 0, ""
        first = kernel.CLOSING if self._at_once else kernel.LOOSENED
        kernel.enter(first, self._phase, self._state, position_rad)

    def update(self, position_rad: FloatArray, pretension_N: FloatArray, share: float) -> bool:
        """Raise the winches' bounds of tension and set speeds, (n,); return whether it goes on.

        Cables that are reeled in pull with a share, which grows to 1, of what they may; with more
        only by the bounds that there are.
        """
        self._dragged = self._take_up(position_rad, pretension_N, share)
        phases, furthest = int(self._phase.sum()), self._furthest
        self._furthest = max(phases, furthest)
        return phases > furthest


def _most_m(towards: FloatArray, slack_m: FloatArray) -> float:
    """Return how far slack (n,) lets it go in the direction, of m, in which that is the furthest.

    `towards` (m, n) is how much shorter each cable is for each m; 0 where no cable points.
    """
    points = towards > _POINTS
    ways_m = np.where(points, slack_m / np.maximum(towards, _POINTS), np.inf).min(axis=1)
    return float(ways_m[np.isfinite(ways_m)].max(initial=0.0))


def _towards_exits(parts: PlatformParts) -> FloatArray:
    """Return how much shorter each cable is for each m along horizontal directions, (m, n)."""
    model, aside = parts.model, parts.model.positions - 1
    angles = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
    if aside == 1:
        angles = np.array([0.0, np.pi])
    e = np.column_stack([np.cos(angles), np.sin(angles)])[:, :aside]
    return np.asarray(e @ model.kinematics.wrench_matrix(model.home_pose)[:aside])


def _turned(parts: PlatformParts) -> tuple[FloatArray, float]:
    """Return the same as it is turned about the vertical, for each m at an arm, (m, n); the arm.

    No directions where it is not: in a vertical plane its weight keeps it on its stand.
    """
    model = parts.model
    if model.positions < 3 or _ABOUT_UP not in model.kinematics.directions:
        return np.zeros((0, len(parts.names))), 1.0
    i = model.kinematics.directions.index(_ABOUT_UP)
    per_m = model.kinematics.wrench_matrix(model.home_pose)[i] / parts.scale_m[i]
    return np.array([per_m, -per_m]), float(parts.scale_m[i])


def _hanging_N(parts: PlatformParts, pretension_N: FloatArray) -> FloatArray:
    """Return the tensions (n,) up to which cables come in by their sag rather, 0 for none.

    From there to the pretension a straight one comes in as it stretches at the pretension.
    """
    tensions_N = _HANGING_SHARES * pretension_N
    lengths_m = np.array([parts.control.lengths_at_home(tension_N) for tension_N in tensions_N])
    steps = np.arange(_HANGING_SHARES.size)[::-1, None]
    straight_m = lengths_m[-1] + steps * (lengths_m[-2] - lengths_m[-1])
    # a heavy cable that is hardly pulled has no length that reaches
    hangs = ~(lengths_m - straight_m <= 0.5 * kernel.LOOSE_m)
    return np.asarray(np.max(np.where(hangs, tensions_N, 0.0), axis=0))


class Stillness:
    """Whether n cables have stood still for a while, within what encoders show to and fro."""

    def __init__(self, cable_m: FloatArray, count_rad: FloatArray, period_s: float) -> None:
        self._cable, self._cycles = cable_m, math.ceil(_STILL_S / period_s)
        self._weak_cycles = math.ceil(_WEAK_S / period_s)
        self._still_m = np.maximum(_STILL_m, _STILL_COUNTS * count_rad * np.abs(cable_m))
        self._at_rad, self._still, self._weak = np.zeros(cable_m.size), 0, 0
        self.moved_m = np.zeros(cable_m.size)
        """How far each has moved since it last stood still."""

    def begin(self, position_rad: FloatArray) -> None:
        """Begin anew at these angles (n,)."""
        self._at_rad[:], self._still = position_rad, 0

    def lasts(self, position_rad: FloatArray, pulled: bool) -> bool:
        """Take in a cycle; return whether they have stood still, and were pulled, for so long.

        A count in a cycle is a speed at which a winch pulls with less for a moment.
        """
        np.abs((position_rad - self._at_rad) * self._cable, out=self.moved_m)
        self._weak = 0 if pulled else self._weak + 1
        if self._weak > self._weak_cycles or (self.moved_m > self._still_m).any():
            self.begin(position_rad)
        self._still += 1
        return self._still > self._cycles
