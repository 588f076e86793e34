"""Take up slack without moving the platform."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.control.winch_speed_loop import WinchSpeedLoop
from cdpr_rt.jit import bound, jit
from cdpr_rt.programs.platform_program import PlatformParts

# Kernel for one cycle of slack take-up: phase of each cable, and command to its winch.

TAKE_UP_m_s = 0.05
"""Speed at which slack is taken up."""
TAKE_UP_SHARE = 0.4
"""Tension while some cables are slack, as a share of the pretension."""
LOOSE_m = 0.02
"""Largest distance by which cables may be reeled in together. A larger distance means that friction
was mistaken for tension, or that the platform has moved."""
PULLED = 0.95
"""Share of its tension bound above which a winch is taken to pull with the full bound."""
_SLOW_SHARE, _MEAN_S = 1.0 / 3.0, 0.04
"""A cable may be tight if its speed, averaged over this time, is below this share of the take-up
speed."""
_HELD = 0.9
"""Share of the sag tension with which a winch holds a cable that is not tight."""
_RAISED_1_s = 2.0
"""Increase per second of a stationary winch's pull, as a share of the pull at which no winch
sticks."""
_LEFT_m, _LEAVE_S = 0.005, 0.5
"""Slack that a cable keeps until all cables have been tight, and the longest time to pay it out."""

LOOSENED, NEXT, REELED_IN, PAID_OUT, WAITING, CLOSING, TIGHT = range(7)
"""Phases of a cable: paid out a little at first; held until its turn; reeled in alone; paid out
again after it was tight; held with this slack until the others are ready; reeled in with all
others; tight. The phases follow in this order unless a cable begins again. If one cable is in one
of the last two phases, all cables are."""
(
    FROM_rad, MEAN_m_s, MAY_N, TURNED_N, FREE_N, TIGHT_N, SLACK_m, CYCLES, FIRST_rad, FIRST_N,
    STATE,
) = range(11)  # fmt: skip
"""State of a cable: angle at which reeling in or paying out begins; mean speed inwards; tension
with which it may be reeled in; largest tension that has turned its winch, including the cable's
weight, and the largest while it was certainly slack; tension when tight, else 0; distance by which
it was reeled in until it was tight; cycles of paying out; angle at which it was first tight alone,
nan before that, and its tension there."""


class Winches(NamedTuple):
    """Speeds, tensions and bounds of n winches, (n,) each, as in `WinchSpeedLoop`."""

    period_s: float
    at_once: bool
    """Whether cables are reeled in together from the beginning."""
    cable_m: FloatArray
    enough_N: FloatArray
    """Tensions at which no winch sticks."""
    harmless_N: FloatArray
    """Tensions with which one cable alone does not move the platform on its stand."""
    stands_N: FloatArray
    """Pull that the platform withstands. A larger pull, in addition to the friction of the winch,
    would only drag the platform."""
    hangs_N: FloatArray
    """Tensions up to which a cable sags under its own weight, and is not tight."""
    speed_rad_s: FloatArray
    tension_N: FloatArray
    low_N: FloatArray
    high_N: FloatArray
    paying_out_m_s: FloatArray


@jit
def enter(first: int, phase: IntArray, state: FloatArray, position: FloatArray) -> None:
    """Begin the phase `first` for all cables at these angles (n,); no cable is tight yet."""
    for i in range(phase.size):
        phase[i] = first
        # a cable that only begins to turn, or still has its previous tension, is not tight
        state[i, FROM_rad], state[i, MEAN_m_s] = position[i], TAKE_UP_m_s
        state[i, TIGHT_N] = state[i, CYCLES] = 0.0


@jit
def take_up(
    w: Winches, phase: IntArray, state: FloatArray, position: FloatArray, pretension: FloatArray,
    share: float,
) -> int:  # fmt: skip
    """Raise bounds and set speeds; return the tight cable that was reeled in too far, else -1.

    `state` is (n, STATE). See `SlackTakeUp.update`.
    """
    dragged, dragged_m, loose, waiting = -1, LOOSE_m, False, True
    turn = _whose_turn(phase)
    if turn >= 0:
        phase[turn], state[turn, MEAN_m_s] = REELED_IN, TAKE_UP_m_s
    for i in range(phase.size):
        most = TAKE_UP_SHARE * pretension[i]
        if not w.at_once:
            most = max(most, w.enough_N[i])
        most = max(most, w.hangs_N[i])
        if not w.at_once and state[i, FREE_N] > 0.0:
            # otherwise a tension that drags the platform would count as friction of the winch
            free = max(state[i, FREE_N], w.harmless_N[i])
            most = min(most, max(free + w.stands_N[i], w.hangs_N[i]))
        most = min(most, pretension[i])
        phase[i] = _next_phase(w, i, phase[i], state[i], position[i], PULLED * most)
        w.high_N[i] = max(w.high_N[i], min(share, 1.0) * most)
        _drive(w, i, phase[i], state[i], most)
        reeled_m = (state[i, FROM_rad] - position[i]) * w.cable_m[i]
        if phase[i] == TIGHT and reeled_m > dragged_m:
            dragged, dragged_m = i, reeled_m
        if phase[i] == CLOSING and not w.at_once and reeled_m > LOOSE_m:
            loose, state[i, FIRST_rad] = True, np.nan
        waiting &= phase[i] == WAITING
    if waiting or loose:
        enter(CLOSING if waiting else LOOSENED, phase, state, position)
        return -1
    return dragged


@jit
def _whose_turn(phase: IntArray) -> int:
    """Return the cable that is reeled in alone from now on, -1 for none.

    One tight cable does not move the platform, but two that become tight together would turn it.
    """
    turn = -1
    for i in range(phase.size):
        if phase[i] in (LOOSENED, REELED_IN, PAID_OUT):
            return -1
        if turn < 0 and phase[i] == NEXT:
            turn = i
    return turn


@jit
def _next_phase(
    w: Winches, i: int, phase: int, state: FloatArray, position: float, most: float
) -> int:
    """Return the next phase of cable i; `state` (STATE,) is the state of that cable."""
    reeled_m = (state[FROM_rad] - position) * w.cable_m[i]
    if phase in (LOOSENED, PAID_OUT):
        state[CYCLES] += 1.0
        if reeled_m >= -_LEFT_m and state[CYCLES] * w.period_s <= _LEAVE_S:
            return phase
        return NEXT if phase == LOOSENED else WAITING
    if phase in (NEXT, WAITING):
        return phase
    # unless the 5 mm paid out were reeled in again, a slack cable was stuck
    returned = reeled_m >= (0.5 if phase == CLOSING else -0.5) * _LEFT_m
    # while the cable is certainly slack
    if phase == REELED_IN and not returned and not w.at_once and _turns(w, i):
        state[FREE_N] = max(state[FREE_N], w.tension_N[i])
    tight = _seems_tight(w, i, state, most, returned)  # also learns the winch's friction
    if not tight or phase == TIGHT:
        return phase
    state[FROM_rad], state[CYCLES] = position, 0.0
    if phase == REELED_IN:
        if math.isnan(state[FIRST_rad]):
            state[FIRST_rad], state[FIRST_N] = position, w.tension_N[i]
        return PAID_OUT
    state[TIGHT_N], state[SLACK_m] = w.tension_N[i], reeled_m
    return TIGHT


@jit
def _seems_tight(w: Winches, i: int, state: FloatArray, most: float, returned: bool) -> bool:
    """Return whether speed and tension show that cable i, which is being reeled in, is tight."""
    inwards_m_s, tension = -w.cable_m[i] * w.speed_rad_s[i], w.tension_N[i]
    mean_m_s = state[MEAN_m_s] + w.period_s / _MEAN_S * (inwards_m_s - state[MEAN_m_s])
    # a winch that breaks loose turns before its mean speed shows that
    state[MEAN_m_s] = max(mean_m_s, inwards_m_s)
    if not w.at_once and _turns(w, i):
        state[TURNED_N] = max(state[TURNED_N], tension)
    enough = min(w.enough_N[i], most)
    if returned and state[TURNED_N] > 0.0:
        enough = min(enough, max(state[TURNED_N], w.harmless_N[i]))
    enough = max(enough, PULLED * min(w.hangs_N[i], most))
    return bool(state[MEAN_m_s] < _SLOW_SHARE * TAKE_UP_m_s and tension >= enough)


@jit
def _turns(w: Winches, i: int) -> bool:
    """Return whether winch i reels in at half of the commanded speed or more."""
    return bool(-w.cable_m[i] * w.speed_rad_s[i] > 0.5 * TAKE_UP_m_s)


@jit
def _drive(w: Winches, i: int, phase: int, state: FloatArray, most: float) -> None:
    """Set bounds and speed of winch i; by default it reels in."""
    if phase == TIGHT:
        w.high_N[i] = state[TIGHT_N]
    elif phase in (REELED_IN, CLOSING) and not w.at_once:
        # a cable that becomes tight in motion must not drag the platform before this is detected
        if not _turns(w, i) and w.tension_N[i] >= PULLED * state[MAY_N]:
            raised = state[MAY_N] + _RAISED_1_s * w.period_s * w.enough_N[i]
            state[MAY_N] = min(raised, most)
        # a sagging cable would run out if it were held with less than its weight
        w.high_N[i] = max(state[MAY_N], _HELD * min(w.hangs_N[i], most))
    elif phase in (LOOSENED, PAID_OUT):
        w.low_N[i], w.paying_out_m_s[i] = -w.enough_N[i], TAKE_UP_m_s
        if phase == PAID_OUT:
            # two tight cables may move the platform; a heavy cable would run out
            w.high_N[i] = w.hangs_N[i]
    elif phase in (NEXT, WAITING):  # held, because cogging might turn it
        w.low_N[i], w.paying_out_m_s[i] = -w.enough_N[i], 0.0
        w.high_N[i] = min(w.high_N[i], max(w.enough_N[i], w.hangs_N[i]))


_ENOUGH = 1.25
"""Tension at which no winch sticks, as a multiple of the usual friction of winches."""
_STILL_m, _STILL_S, _STILL_COUNTS = 0.0003, 0.3, 2.5
_TURNED_m = 0.005
"""A winch that has turned this far has not merely been stuck."""
_WEAK_S = 0.04
"""Time for which a motor may pull less after its encoder has moved by a count or two."""
_USUAL_SHARE = 0.45
"""Tension that usually turns a winch with a slack cable, as a share of the largest friction."""
_STAND_FRICTION, _ASIDE_SHARE = 0.3, 0.5
"""Friction of the stand, as a share of the platform's weight; share of that friction with which one
cable may pull."""
_HANGING_SHARES = np.linspace(0.05, 1.0, 96)[:, None]
"""Shares of the pretension at which the sag of the cables is computed."""
_MOVED_m, _ALONE_m = 0.005, 0.0025
"""The platform has moved if a cable's lengths when it is tight alone and when all are tight differ
by more than the first distance. If all other cables differ by less than the second one, only the
winch of this cable was stuck."""
_LEAST_SHARE = 0.2
"""Smallest tension of a cable, as a share of the pull of its winch, if friction may be as large as
the pull."""
_ALONG_m = 1.5 * LOOSE_m
"""Smallest distance to report if the cables may have dragged a light platform."""
_DIRECTIONS, _POINTS, _ABOUT_UP = 16, 0.2, 5
"""Number of horizontal directions examined; least component of a cable's direction along one of
them with which it pulls; index of the twist's component about the vertical."""
_REMEDY = "take up slack by hand, or hold the platform"


class SlackTakeUp:
    """Reels in n cables until all are tight, while the platform stands.

    One cable may have much more slack than another, and the platform on its stand withstands a pull
    of only some newtons. So each cable is paid out a little, reeled in until it is tight, and paid
    out a little again. Then all cables become tight together, each with no more pull than before.
    Only a winch that stands still may pull harder than the pull that has turned it before. A cable
    is tight if its winch stands in one of two cases: the same pull has turned it before and the
    stand certainly withstands it, or the pull exceeds the friction of winches. If the pull that
    turns a winch can slide or tip a light platform on its stand, all cables are reeled in together
    from the beginning.
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
        self._alone_m = _ALONE_m * _seen_alone(parts)
        self._phase, self._state = np.zeros(n, np.int64), np.zeros((n, STATE))
        self.tight_N = self._state[:, TIGHT_N]
        """Pull of each tight cable, 0 for those that are not tight."""
        self.off_home = ""
        """Notice that says how far the platform may stand from home."""
        self._loose, self._busy = np.zeros((2, n), np.bool_)
        self._dragged, self._furthest = -1, 0
        driven = Winches(
            parts.period_s, self._at_once, cable_m, self._enough_N,
            np.maximum(usual_N, _ASIDE_SHARE * stands_N), np.full(n, stands_N),
            np.where(hanging_N > 0.0, hanging_N + usual_N, 0.0),
            winches.speed_rad_s,
            winches.tension_N, winches.low_N, winches.high_N, winches.paying_out_m_s,
        )  # fmt: skip
        self._take_up = bound(
            take_up, driven, self._phase, self._state,
            then=(np.zeros(n), np.zeros(n), 0.0),
        )  # fmt: skip

    @property
    def not_tight(self) -> BoolArray:
        """Whether each cable is neither tight nor waiting with a little slack, (n,); reused."""
        np.not_equal(self._phase, TIGHT, out=self._loose)
        np.not_equal(self._phase, WAITING, out=self._busy)
        return np.logical_and(self._loose, self._busy, out=self._loose)

    def pulls(self, which: BoolArray) -> str:
        """Return present and highest pull of the cables of `which` (n,) that are reeled in."""
        pull_N, may_N = self._winches.tension_N, self._winches.high_N
        return "; ".join(
            f"{self._names[i]} pulls with {pull_N[i]:.1f} N, but only up to {may_N[i]:.1f} "
            "N were commanded"
            for i in np.flatnonzero(which & (self._phase != NEXT))
        )

    def dragged(self, position_rad: FloatArray) -> str:
        """Return the tight cable that was reeled in too far, as text, or "".

        When cables are reeled in together, friction may have held a slack one. Such a cable was not
        tight if it was reeled in no farther in total than the others.
        """
        i = self._dragged
        if i < 0:
            return ""
        if self._at_once:
            if uneven := self._uneven(position_rad, False):
                return uneven
            state = self._state[i]
            state[SLACK_m] += (state[FROM_rad] - position_rad[i]) * self._cable[i]
            state[FROM_rad] = position_rad[i]
            return ""
        reeled_m = (self._state[i, FROM_rad] - position_rad[i]) * self._cable[i]
        return (
            f"{self._names[i]}: {1e3 * reeled_m:.1f} mm reeled in since it was tight, "
            f"{1e3 * LOOSE_m:.1f} mm allowed: its cable is broken, or the platform has moved on "
            f"its stand; {_REMEDY}"
        )

    def why_moved(self, position_rad: FloatArray, pulled: bool) -> str:
        """Return the reason why the platform is no longer at home, "" if it may be at home.

        If the slack was uneven, the cables may have dragged a light platform a little; `off_home`
        reports this.

        All cables have just become tight, or have been `pulled` with their pretension.
        """
        if self._at_once:
            self.off_home = self._along(position_rad) if pulled else ""
            return self._uneven(position_rad, pulled)
        if pulled:
            return ""
        why, self.off_home = self._moved()
        return why

    def _uneven(self, position_rad: FloatArray, pulled: bool) -> str:
        """Return the cable with so much more slack that the platform may have moved, or "".

        Slack is the length of cable reeled in so far, without its stretch. A winch that did not
        turn while the others became tight may turn only when all are `pulled` harder.
        """
        slack_m = self._slack_m(position_rad)
        clear = pulled | (np.abs(slack_m) > _TURNED_m)
        i = int(np.where(clear, slack_m, -np.inf).argmax())
        j = int(np.where(clear, slack_m, np.inf).argmin())
        more_m, allowed_m = slack_m[i] - slack_m[j], LOOSE_m
        if more_m <= allowed_m:
            return ""
        if slack_m[j] < _TURNED_m and self._winches.high_N[j] < self._enough_N[j]:
            return (
                f"{self._names[j]}: {self._winches.high_N[j]:.0f} N did not reel in its cable, but "
                f"{self._names[i]} reeled in {1e3 * slack_m[i]:.1f} mm: the friction of the first "
                f"winch may be up to {self._enough_N[j] / _ENOUGH:.0f} N, and its cable may be "
                "slack; increase the tensions: see `cdpr robot show`"
            )
        return (
            f"{self._names[i]} had {1e3 * more_m:.1f} mm more slack than {self._names[j]}, "
            f"{1e3 * allowed_m:.1f} mm allowed: its cable is broken, or the torque that overcomes "
            f"the friction of the winches also moves this light platform; {_REMEDY}"
        )

    def _slack_m(self, position_rad: FloatArray) -> FloatArray:
        """Return the length of each cable reeled in so far, (n,), without its stretch."""
        on_m = (self._state[:, FROM_rad] - position_rad) * self._cable
        stretch_m = self._lengths_at_home(self.tight_N) - self._lengths_at_home(
            self._winches.high_N
        )
        return np.asarray(self._state[:, SLACK_m] + on_m - stretch_m)

    def _moved(self) -> tuple[str, str]:
        """Return the reason why the cables must not be tightened, and a notice; each may be "".

        A cable was first tight alone. If it is now tight at another length, apart from stretch and
        friction, the platform has moved in between. If this is true of only one cable, which is now
        shorter, its winch may have been stuck at first. That is certain if several cables would
        have shown a motion of the platform.
        """
        state, length_m = self._state, self._lengths_at_home
        in_m = (state[:, FIRST_rad] - state[:, FROM_rad]) * self._cable
        in_m -= length_m(state[:, FIRST_N]) - length_m(self.tight_N)
        # friction may be as large as this pull
        true_N = np.maximum(self.tight_N - self._usual_N, _LEAST_SHARE * self.tight_N)
        rubbed_m = length_m(true_N) - length_m(self.tight_N)
        # a cable that sagged when it was first tight has no reference length
        off_m = np.nan_to_num(np.abs(in_m) - rubbed_m, nan=-np.inf)
        i = int(off_m.argmax())
        if not off_m[i] > _MOVED_m:
            return "", ""
        moved = (
            f"{self._names[i]}: became tight {1e3 * abs(in_m[i]):.1f} mm further "
            f"{'in' if in_m[i] > 0.0 else 'out'} than when it was tightened alone, "
            f"{1e3 * (rubbed_m[i] + _MOVED_m):.1f} mm allowed"
        )
        if in_m[i] > 0.0 and np.count_nonzero(off_m > _ALONE_m) == 1:
            if off_m[i] > self._alone_m[i]:
                return "", ""  # the other cables would have shown a motion, so the winch was stuck
            return (
                "",
                f"{moved}: its winch was stuck, or the platform may stand about this far from home",
            )
        return (
            f"{moved}: a winch has dragged the platform on its stand; put it back at home, "
            f"and {_REMEDY}"
        ), ""

    def _along(self, position_rad: FloatArray) -> str:
        """Return how far a light platform may stand from home, as text, "" if it is near.

        Cables that are reeled in together drag it until all cables that point in one direction are
        tight. The distance is t = min s_i/(u_i e), with the slack s_i of a cable along u_i, for the
        horizontal direction e with the largest distance. The same holds for a rotation about the
        vertical.
        """
        slack_m = np.maximum(self._slack_m(position_rad), 0.0)
        aside_m, turned_m = _most_m(self._aside, slack_m), _most_m(self._about_up, slack_m)
        if max(aside_m, turned_m) <= _ALONG_m:
            return ""
        turned_deg = math.degrees(turned_m / self._arm_m)
        turned = f", and may be turned by up to about {turned_deg:.0f} degrees" if turned_m else ""
        return (
            "the torque that overcomes the friction of the winches also slides this light platform "
            f"on its stand: with this slack it may stand up to about {1e3 * aside_m:.0f} mm from "
            f"the place that the cable lengths give{turned}; {_REMEDY}"
        )

    def begin(self, position_rad: FloatArray) -> None:
        """Begin again at these angles (n,), with no cable known to be tight.

        All cables are paid out a little first, because the friction of a winch is unknown until it
        turns.
        """
        self._state[:, (MAY_N, TURNED_N, FREE_N, SLACK_m)] = 0.0
        self._state[:, FIRST_rad] = np.nan
        self._dragged, self._furthest, self.off_home = -1, 0, ""
        first = CLOSING if self._at_once else LOOSENED
        enter(first, self._phase, self._state, position_rad)

    def update(self, position_rad: FloatArray, pretension_N: FloatArray, share: float) -> bool:
        """Raise the winches' bounds of tension and set speeds, (n,); return whether it advanced.

        Cables that are reeled in pull with a share of their allowed tension, which grows to 1. They
        pull harder only if the bounds already allow it.
        """
        self._dragged = self._take_up(position_rad, pretension_N, share)
        phases, furthest = int(self._phase.sum()), self._furthest
        self._furthest = max(phases, furthest)
        return phases > furthest


def _most_m(towards: FloatArray, slack_m: FloatArray) -> float:
    """Return how far slack (n,) allows motion, in the one of m directions that allows the most.

    `towards` (m, n) is the shortening of each cable per metre of motion; 0 if the cable does not
    point in that direction.
    """
    points = towards > _POINTS
    ways_m = np.where(points, slack_m / np.maximum(towards, _POINTS), np.inf).min(axis=1)
    return float(ways_m[np.isfinite(ways_m)].max(initial=0.0))


def _towards_exits(parts: PlatformParts) -> FloatArray:
    """Return the shortening of each cable per metre along horizontal directions, (m, n)."""
    model, aside = parts.model, parts.model.positions - 1
    angles = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
    if aside == 1:
        angles = np.array([0.0, np.pi])
    e = np.column_stack([np.cos(angles), np.sin(angles)])[:, :aside]
    return np.asarray(e @ model.kinematics.wrench_matrix(model.home_pose)[:aside])


def _seen_alone(parts: PlatformParts) -> FloatArray:
    """Return the largest change of each cable's length per metre of change of all others, (n,).

    It is |J_i J_o^+| in the sum norm, with the rows J_o of the other cables, for motion of the
    platform at home. It is infinite if the others leave a direction free.
    """
    J = parts.model.kinematics.wrench_matrix(parts.model.home_pose).T
    most = np.full(len(J), np.inf)
    for i in range(len(J)):
        others = np.delete(J, i, axis=0)
        if np.linalg.matrix_rank(others) == J.shape[1]:
            most[i] = np.abs(J[i] @ np.linalg.pinv(others)).sum()
    return most


def _turned(parts: PlatformParts) -> tuple[FloatArray, float]:
    """Return the shortenings (m, n) for a turn about the vertical, per m at an arm, and the arm.

    There are no directions if the platform does not turn: in a vertical plane its weight keeps it
    on its stand.
    """
    model = parts.model
    if model.positions < 3 or _ABOUT_UP not in model.kinematics.directions:
        return np.zeros((0, len(parts.names))), 1.0
    i = model.kinematics.directions.index(_ABOUT_UP)
    per_m = model.kinematics.wrench_matrix(model.home_pose)[i] / parts.scale_m[i]
    return np.array([per_m, -per_m]), float(parts.scale_m[i])


def _hanging_N(parts: PlatformParts, pretension_N: FloatArray) -> FloatArray:
    """Return the tensions (n,) below which reeling in mostly reduces sag, 0 without sag.

    From such a tension to the pretension, a cable is reeled in no further than a straight cable
    stretches at the pretension.
    """
    tensions_N = _HANGING_SHARES * pretension_N
    lengths_m = np.array([parts.control.lengths_at_home(tension_N) for tension_N in tensions_N])
    steps = np.arange(_HANGING_SHARES.size)[::-1, None]
    straight_m = lengths_m[-1] + steps * (lengths_m[-2] - lengths_m[-1])
    # a heavy cable with hardly any tension spans the distance at no length
    hangs = ~(lengths_m - straight_m <= 0.5 * LOOSE_m)
    return np.asarray(np.max(np.where(hangs, tensions_N, 0.0), axis=0))


class Stillness:
    """Detects that n cables have stood still for a while, apart from noise of the encoders."""

    def __init__(self, cable_m: FloatArray, count_rad: FloatArray, period_s: float) -> None:
        self._cable, self._cycles = cable_m, math.ceil(_STILL_S / period_s)
        self._weak_cycles = math.ceil(_WEAK_S / period_s)
        self._still_m = np.maximum(_STILL_m, _STILL_COUNTS * count_rad * np.abs(cable_m))
        self._at_rad, self._still, self._weak = np.zeros(cable_m.size), 0, 0
        self.moved_m = np.zeros(cable_m.size)
        """Distance that each cable has moved since it last stood still."""

    def begin(self, position_rad: FloatArray) -> None:
        """Begin again at these angles (n,)."""
        self._at_rad[:], self._still = position_rad, 0

    def lasts(self, position_rad: FloatArray, pulled: bool) -> bool:
        """Process a cycle; return whether cables stood still, and were pulled, for long enough.

        An encoder count within a cycle looks like a speed, at which the winch pulls less for a
        moment.
        """
        np.abs((position_rad - self._at_rad) * self._cable, out=self.moved_m)
        self._weak = 0 if pulled else self._weak + 1
        if self._weak > self._weak_cycles or (self.moved_m > self._still_m).any():
            self.begin(position_rad)
        self._still += 1
        return self._still > self._cycles
