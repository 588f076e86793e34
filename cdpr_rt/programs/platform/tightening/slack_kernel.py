"""Kernel of a cycle in which slack is taken up: each cable's phase, and how its winch is driven."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import jit

TAKE_UP_m_s = 0.05
"""Speed at which slack is taken up."""
TAKE_UP_SHARE = 0.4
"""Tension while some cables are slack, as a share of the pretension."""
LOOSE_m = 0.02
"""How far cables may be reeled in together; of one that goes further, friction had been taken for
tension, or the platform has moved."""
PULLED = 0.95
"""Share of its bound with which a winch pulls that is said to pull with all of it."""
_SLOW_SHARE, _MEAN_S = 1.0 / 3.0, 0.04
"""Below that share of the speed a cable may be tight, by its mean over this time."""
_HELD = 0.9
"""Share of what a cable hangs through with that holds it, with which it does not count as tight."""
_RAISED_1_s = 2.0
"""How much more a winch that stands still pulls with after a second, over what none sticks at."""
_LEFT_m, _LEAVE_S = 0.005, 0.5
"""Slack that a cable is left with until all have been tight, and how long that may take."""

LOOSENED, NEXT, REELED_IN, PAID_OUT, WAITING, CLOSING, TIGHT = range(7)
"""Phases of a cable: paid out a little at first; held until it is its turn; reeled in by itself;
paid out again, having been tight; held with that slack for the others; reeled in with all others;
tight, in the order that they have but for those that begin anew. All are in one of the last two, or
none is."""
(
    FROM_rad, MEAN_m_s, MAY_N, TURNED_N, FREE_N, TIGHT_N, SLACK_m, CYCLES, FIRST_rad, FIRST_N,
    STATE,
) = range(11)  # fmt: skip
"""State of a cable: the angle that it is reeled in or paid out from; its mean speed inwards; what
it may be reeled in with; the most that has turned its winch, what the cable weighs included, and
that while it surely was slack; what it is pulled with once tight, else 0; how far it was reeled in
for that; cycles for which it has been paid out; the angle at which it first was tight by itself,
nan until then, and what it was pulled with."""


class Winches(NamedTuple):
    """Speeds, tensions and bounds of n winches, (n,) each, as `WinchSpeedLoop` has them."""

    period_s: float
    at_once: bool
    """Whether cables are reeled in together from the beginning."""
    cable_m: FloatArray
    enough_N: FloatArray
    """Tensions at which none sticks."""
    harmless_N: FloatArray
    """Tensions with which one cable by itself does not move the platform on its stand."""
    stands_N: FloatArray
    """With how much the platform stands: more than that, over what turns a winch whose cable surely
    is slack, only drags it along."""
    hangs_N: FloatArray
    """Tensions with which a cable hangs through by its own weight, up to which it is not tight."""
    speed_rad_s: FloatArray
    tension_N: FloatArray
    low_N: FloatArray
    high_N: FloatArray
    paying_out_m_s: FloatArray


@jit
def enter(first: int, phase: IntArray, state: FloatArray, position: FloatArray) -> None:
    """Have all cables begin the phase `first` at these angles (n,), none of them being tight."""
    for i in range(phase.size):
        phase[i] = first
        # one that only begins to turn, or is still pulled as it was before, is not tight by that
        state[i, FROM_rad], state[i, MEAN_m_s] = position[i], TAKE_UP_m_s
        state[i, TIGHT_N] = state[i, CYCLES] = 0.0


@jit
def take_up(
    w: Winches, phase: IntArray, state: FloatArray, position: FloatArray, pretension: FloatArray,
    share: float,
) -> int:  # fmt: skip
    """Raise bounds and set speeds; return which tight cable was reeled in furthest on, if too far.

    `state` is (n, STATE), -1 stands for none. See `SlackTakeUp.update`.
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
            # else the winch that drags the platform along would be thought to need what that takes
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
    """Return which cable is reeled in by itself from now on, -1 for none.

    Two that become tight at the same time would turn the platform, which one does not move.
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
    """Return the phase of cable i from now on; `state` (STATE,) is its own."""
    reeled_m = (state[FROM_rad] - position) * w.cable_m[i]
    if phase in (LOOSENED, PAID_OUT):
        state[CYCLES] += 1.0
        if reeled_m >= -_LEFT_m and state[CYCLES] * w.period_s <= _LEAVE_S:
            return phase
        return NEXT if phase == LOOSENED else WAITING
    if phase in (NEXT, WAITING):
        return phase
    # what was paid out by 5 mm has to be reeled in again, or one has stuck that is slack
    returned = reeled_m >= (0.5 if phase == CLOSING else -0.5) * _LEFT_m
    # while it surely is slack
    if phase == REELED_IN and not returned and not w.at_once and _turns(w, i):
        state[FREE_N] = max(state[FREE_N], w.tension_N[i])
    tight = _seems_tight(w, i, state, most, returned)  # of tight cables it tells what turns winches
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
    """Return whether cable i, which is reeled in, is tight by its speed and tension."""
    inwards_m_s, tension = -w.cable_m[i] * w.speed_rad_s[i], w.tension_N[i]
    mean_m_s = state[MEAN_m_s] + w.period_s / _MEAN_S * (inwards_m_s - state[MEAN_m_s])
    # one that breaks loose has turned before its mean tells
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
    """Return whether winch i reels in by half of the speed and more."""
    return bool(-w.cable_m[i] * w.speed_rad_s[i] > 0.5 * TAKE_UP_m_s)


@jit
def _drive(w: Winches, i: int, phase: int, state: FloatArray, most: float) -> None:
    """Set bounds and speed of winch i, which reels in unless told otherwise."""
    if phase == TIGHT:
        w.high_N[i] = state[TIGHT_N]
    elif phase in (REELED_IN, CLOSING) and not w.at_once:
        # a cable that becomes tight in motion is not to pull the platform along before it is seen
        if not _turns(w, i) and w.tension_N[i] >= PULLED * state[MAY_N]:
            raised = state[MAY_N] + _RAISED_1_s * w.period_s * w.enough_N[i]
            state[MAY_N] = min(raised, most)
        # one that hangs would run out, held with less than it weighs
        w.high_N[i] = max(state[MAY_N], _HELD * min(w.hangs_N[i], most))
    elif phase in (LOOSENED, PAID_OUT):
        w.low_N[i], w.paying_out_m_s[i] = -w.enough_N[i], TAKE_UP_m_s
        if phase == PAID_OUT:
            # two that are tight at once may move the platform; a heavy cable would run out
            w.high_N[i] = w.hangs_N[i]
    elif phase in (NEXT, WAITING):  # held: cogging would turn it
        w.low_N[i], w.paying_out_m_s[i] = -w.enough_N[i], 0.0
        w.high_N[i] = min(w.high_N[i], max(w.enough_N[i], w.hangs_N[i]))
