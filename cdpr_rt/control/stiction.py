"""Integral action that brings an axis which friction holds to its set-point, and no further."""

from __future__ import annotations

import math

import numpy as np

from cdpr_rt.control.compensation import AxisCompensation
from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.jit import jit

COLUMNS = 6
"""Entries of one axis' state."""
_REFERENCE, _MEAN, _STANDS_S, _PUSHED_Nm, _SIDE, _SHARE = range(COLUMNS)

_TOLERANCE_RAD = math.radians(0.4)
"""An error below this is left: an integral that went on would break the rotor loose for nothing."""
_MOVES_RAD, _MEAN_S = math.radians(0.1), 0.01
"""The rotor moves where its angle is this far from its mean over so long, 10 deg/s."""
_WAIT_S = 0.05
"""It stands where it has not moved for so long: one that swings slowly is not held by friction."""
_PUSH_S = 0.02
"""While it stands the integral grows in so long by what the proportional part is."""
_GIVEN_BACK = 0.2
"""Share of what was added that is taken away once it creeps: friction is less then."""
_RUNS_RAD = math.radians(0.5)
"""From there on, 50 deg/s, it was let go rather than broke loose: all that was added is taken."""
_CALMER = 0.7
"""Each time it has gone too far the integral grows more slowly, so that it comes to rest."""
_MOST_OF_LIMIT = 0.5
_USUAL_SHARE_OF_RATED = 0.08
_MARGIN = 1.25


def most_push_Nm(rated_Nm: float, known: AxisCompensation | None = None) -> float:
    """Return the most that is added against friction, Nm: more would only wind up a held axis.

    Where friction is known, what takes a rotor from rest after one direction loose in the other,
    Coulomb friction and breakaway, and the cogging in its way, with a margin of a quarter; else
    8 % of the motor's rated torque, with which an axis of greater friction rests short of its
    set-point.
    """
    if known is None:
        return _USUAL_SHARE_OF_RATED * rated_Nm
    f = known.friction
    forward = 2.0 * abs(f.coulomb_forward_Nm) + abs(f.stribeck_forward_Nm)
    backward = 2.0 * abs(f.coulomb_backward_Nm) + abs(f.stribeck_backward_Nm)
    return _MARGIN * (max(forward, backward) + float(np.abs(known.table_Nm).max(initial=0.0)))


@jit
def start(state: FloatArray, position: float, reference: float) -> None:
    """Begin anew with one axis."""
    state[_REFERENCE], state[_MEAN] = reference, position
    state[_STANDS_S] = state[_PUSHED_Nm] = state[_SIDE] = 0.0
    state[_SHARE] = 1.0


@jit
def step_integral(
    state: FloatArray,
    period: float,
    kp: float,
    ki: float,
    integral: float,
    position: float,
    reference: float,
    limit: float,
    most: float,
) -> float:
    """Return the integral of a position loop after one cycle, Nm; `state` is (COLUMNS,).

    While the set-point moves it is the usual one. Where it stands and friction holds the rotor off
    it, a usual integral takes seconds, goes on until the rotor breaks loose, and then has it jump
    to the other side, over and over (Armstrong-Hélouvry et al., A survey of models, analysis tools
    and compensation methods for the control of machines with friction, 1994). Here it grows quickly
    while the rotor stands, by `most` Nm in all, gives a share back once it creeps and all once it
    runs, and rests within the tolerance. One that is held, by hand or by a stop, is not wound up.
    """
    error = reference - position
    usual = integral + ki * period * error
    state[_MEAN] += (position - state[_MEAN]) * period / _MEAN_S
    speed = abs(position - state[_MEAN])
    stands = reference == state[_REFERENCE]
    state[_REFERENCE] = reference
    if not stands:
        state[_STANDS_S] = state[_SIDE] = 0.0
        state[_SHARE] = 1.0
        if speed > _MOVES_RAD:
            state[_PUSHED_Nm] = 0.0
        return usual
    if speed > _MOVES_RAD:
        share = 0.0
        if speed > _RUNS_RAD:
            share = 1.0
        elif state[_STANDS_S] > 0.0:
            share = _GIVEN_BACK
        state[_STANDS_S] = 0.0
        back = share * state[_PUSHED_Nm]
        state[_PUSHED_Nm] -= back
        return float(usual - back)
    if abs(error) < _TOLERANCE_RAD:
        state[_STANDS_S] = 0.0
        return integral
    state[_STANDS_S] += period
    if state[_STANDS_S] < _WAIT_S:
        return usual
    side = math.copysign(1.0, error)
    if state[_SIDE] == -side:
        state[_SHARE] *= _CALMER
    state[_SIDE] = side
    rate = ki
    if abs(kp * error + integral) <= _MOST_OF_LIMIT * limit:
        rate = max(ki, state[_SHARE] * kp / _PUSH_S)
    pushed = min(max(state[_PUSHED_Nm] + rate * period * error, -most), most)
    more = pushed - state[_PUSHED_Nm]
    state[_PUSHED_Nm] = pushed
    return float(integral + more)
