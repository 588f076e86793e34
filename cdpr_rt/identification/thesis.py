"""The thesis' identification of cogging: average, filter, repair (Tremblay, section 1.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.compensation import FrictionFeedforward
from cdpr_rt.identification.windows import (
    TWO_PI,
    IdentificationError,
    Stretch,
    SweepData,
    check_runs,
    period_s,
    stretches,
)

# Stretches of a sweep in which the rotor does not follow the ramp.

_SPAN_rad = np.deg2rad(1.0)
_FAST = 4.0


def runaway(stretch: Stretch) -> BoolArray:
    """Return at which samples the rotor runs away from the ramp, (stop - start,).

    There are two criteria (Tremblay, section 1.4.2). Either the position error, and so the
    proportional controller's torque, has the braking sign. Or the rotor moves by `_SPAN_rad` at
    several times the ramp's speed, or against it.
    """
    run, part = stretch.run, slice(stretch.start, stretch.stop)
    ahead = stretch.direction * (run.angle_rad[part] - run.setpoint_rad[part])
    wrong = ahead > _resolution(run.angle_rad[part])
    return np.asarray(wrong | _fast(stretch), np.bool_)


def _resolution(angle: FloatArray) -> float:
    """Return a few steps of the encoder, estimated from the angles."""
    steps = np.abs(np.diff(angle))
    steps = steps[steps > 1e-9]
    return 2.0 * float(steps.min()) if steps.size else 0.0


def _fast(stretch: Stretch) -> BoolArray:
    """Return where the rotor's speed over a short distance differs much from the ramp's."""
    run = stretch.run
    span = _SPAN_rad / abs(stretch.velocity_rad_s)
    half = max(1, round(0.5 * span / _FAST / period_s(run)))
    angle = run.angle_rad[stretch.start : stretch.stop]
    before = np.concatenate([np.full(half, angle[0]), angle[:-half]])
    after = np.concatenate([angle[half:], np.full(half, angle[-1])])
    travelled = stretch.direction * (after - before)
    fast = (travelled > _SPAN_rad) | (travelled < -0.5 * _SPAN_rad)
    grown = np.convolve(fast, np.ones(2 * half + 1), mode="same") > 0.5
    return np.asarray(grown, np.bool_)


GRID = 3600
"""Samples of the averaged curve over a turn."""
WINDOW_deg = 5.0
DEGREE = 2
_RUNAWAY_SHARE = 0.5


@dataclass(frozen=True)
class ThesisResult:
    """Curves over the turn from the index, row 0 for increasing angles and row 1 for decreasing.

    `raw_Nm` (2, GRID) is the average over turns, `curve_Nm` (2, GRID) the filtered curve with its
    mean, `mean_Nm` (2,) that mean. `repaired` (2, GRID) marks values from the other direction.
    """

    raw_Nm: FloatArray
    curve_Nm: FloatArray
    mean_Nm: FloatArray
    repaired: BoolArray
    turns: tuple[int, int]

    friction = FrictionFeedforward()
    """No friction in addition to the curves' means."""

    @property
    def variation_Nm(self) -> FloatArray:
        """The curves about their means, (2, GRID); Tremblay, eq. (1.1)."""
        return np.asarray(self.curve_Nm - self.mean_Nm[:, None])

    @property
    def repaired_fraction(self) -> float:
        """Share of both curves that was taken from the other direction."""
        return float(np.mean(self.repaired))

    def tables(self, m: int) -> FloatArray:
        """Return the curves on m samples over the turn, (2, m)."""
        place = np.arange(m) * (GRID / m)
        grid = np.arange(GRID + 1)
        return np.vstack([np.interp(place, grid, np.append(c, c[0])) for c in self.curve_Nm])


def identify_thesis(legs: Sequence[SweepData]) -> ThesisResult:
    """Identify one curve per direction from slow sweeps under the proportional controller.

    Only whole turns at constant set-point velocity are used. A direction without whole turns gets
    the variation of the other one and the opposite mean. Raises IdentificationError if neither has
    whole turns.
    """
    check_runs(legs)
    whole = [t for s in stretches(legs) if (t := s.last_whole_turns()) is not None]
    if not whole:
        raise IdentificationError("the sweeps contain no whole turn at constant speed")
    raw, bad, turns = [], [], []
    for direction in (1, -1):
        mine = [s for s in whole if s.direction == direction]
        average, lost = _average(mine or whole)
        raw.append(average if mine else average - 2.0 * average.mean())
        bad.append(lost)
        turns.append(round(sum(s.turns for s in mine)))
    both = np.vstack(bad)
    usable = both[::-1] & ~both  # this direction is good and the other needs it
    repaired = both & usable[::-1]
    curves = np.vstack(
        [_repair(raw[i], raw[1 - i], repaired[i], ~(both[0] | both[1])) for i in (0, 1)]
    )
    size = 2 * round(0.5 * WINDOW_deg / 360.0 * GRID) + 1
    filtered = scipy.signal.savgol_filter(curves, size, DEGREE, axis=1, mode="wrap")
    return ThesisResult(
        raw_Nm=np.vstack(raw),
        curve_Nm=np.asarray(filtered),
        mean_Nm=np.asarray(filtered.mean(axis=1)),
        repaired=repaired,
        turns=(turns[0], turns[1]),
    )


def _average(parts: list[Stretch]) -> tuple[FloatArray, BoolArray]:
    """Return torque over angle, averaged in bins over all turns, and where the rotor runs away."""
    total, lost, runaway_torque, count = (np.zeros(GRID) for _ in range(4))
    for part in parts:
        cut = slice(part.start, part.stop)
        turn = part.run.angle_rad[cut] / TWO_PI
        place = np.floor((turn - np.floor(turn)) * GRID).astype(np.int64) % GRID
        away = runaway(part).astype(float)
        total += np.bincount(place, part.run.torque_Nm[cut], GRID)
        lost += np.bincount(place, away, GRID)
        runaway_torque += np.bincount(place, away * part.run.torque_Nm[cut], GRID)
        count += np.bincount(place, minlength=GRID)
    seen = count > 0
    share = lost / np.maximum(count, 1.0)
    sound = lost < count  # if some samples are valid, average only these
    total, count = (
        np.where(sound, total - runaway_torque, total),
        np.where(sound, count - lost, count),
    )
    if not seen.any():
        raise IdentificationError("the sweep contains no samples")
    where = np.flatnonzero(seen)
    around = np.concatenate([where[-1:] - GRID, where, where[:1] + GRID])

    def spread(values: FloatArray) -> FloatArray:
        known = values[seen]
        known = np.concatenate([known[-1:], known, known[:1]])
        # a bin's mean belongs to the bin's middle
        return np.asarray(np.interp(np.arange(GRID), around + 0.5, known))

    mean = total / np.maximum(count, 1.0)
    return spread(mean), np.asarray(spread(share) > _RUNAWAY_SHARE, np.bool_)


def _repair(own: FloatArray, other: FloatArray, at: BoolArray, shared: BoolArray) -> FloatArray:
    """Return the curve `own` with the variation of `other` at the flags `at`; all (GRID,).

    The offset between the directions is averaged over `shared` samples, so the own mean is kept.
    """
    if not at.any():
        return own
    sound = shared if shared.any() else ~at
    step = float(np.mean(own[sound] - other[sound]))
    return np.where(at, other + step, own)
