"""Joint identification of cogging, friction, inertia and latency from runs in both directions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdpr_rt.arrays import FloatArray, rms
from cdpr_rt.control.compensation import FrictionFeedforward
from cdpr_rt.identification.cogging import design
from cdpr_rt.identification.cogging.design import ColumnLayout, Equations
from cdpr_rt.identification.cogging.estimate import HarmonicFit, Prior, fit
from cdpr_rt.identification.cogging.friction import STARTS, FrictionRun, FrictionShape, fit_shape
from cdpr_rt.identification.cogging.result import Harmonic, HarmonicResult, likely_cause
from cdpr_rt.identification.cogging.selection import (
    OrderSelection,
    choose,
    noise_weights,
    rows_counted,
    solve,
    total,
)
from cdpr_rt.identification.cogging.sweep import (
    TWO_PI,
    IdentificationError,
    SweepData,
    check_runs,
    period_s,
)
from cdpr_rt.identification.cogging.windows import Windows, contiguous, cut, encoder_noise_rad
from cdpr_rt.identification.confidence import ConfidenceInterval

MAX_ORDER = 200
_BINS = 360
"""Bins over a turn, by which coverage is counted."""
_LATENCY_SD_s = 1e-3
_LATENCY_SD_AGAIN_s = 2e-4
_LAG_SD_rad = np.deg2rad(1.0)
_CONFIDENCE = 1.96
_NOISE_GAIN = 2.45
"""Noise gain of a second difference: sqrt(6)."""
_TOLERATED_NOISE_Nm = 3e-3
_FINE_s = (0.005, 0.02)
_LONGEST_s = 30.0
_ROUNDS = 2
_LEAST_SHARE = 2.5e-3
_INERTIA_CHANGE = 0.05
_INERTIA_SHARE = 0.01
"""Relative error of the inertia by what the model leaves out, such as the current loop's lag."""


def identify_harmonic_model(
    legs: Sequence[SweepData], inertia_kg_m2: float, latency_s: float, pole_pairs: int
) -> HarmonicResult:
    """Identify the motor from slow sweeps and short fast legs, in both directions.

    `inertia_kg_m2` is kept where no leg is fast enough to measure it; `latency_s` is the nominal
    one (see compensation.AxisCompensation). Raises IdentificationError where the rotor was not
    seen moving in both directions.
    """
    check_runs(legs)
    start = _Start(latency_s, pole_pairs, inertia_kg_m2, None)
    return _identify(legs, start)


def refine(before: HarmonicResult, run_legs: Sequence[SweepData]) -> HarmonicResult:
    """Identify again from runs under PID and compensation; what they do not show is kept.

    Friction, inertia and latency of `before` are priors with generous standard deviations; the
    cogging is fitted without one.
    """
    check_runs(run_legs)
    inertia = before.inertia_kg_m2.value
    start = _Start(before.latency_s.value, before.pole_pairs, inertia, before)
    return _identify(run_legs, start)


@dataclass(frozen=True)
class _Start:
    """Prior knowledge of a fit; `before` is the result that is being refined."""

    latency_s: float
    pole_pairs: int
    inertia_kg_m2: float
    before: HarmonicResult | None


def _identify(legs: Sequence[SweepData], start: _Start) -> HarmonicResult:
    """Choose orders, find the friction's shape, then fit all parameters jointly."""
    runs = contiguous(legs)
    windows = [w for run in runs if (w := cut(run, start.latency_s)) is not None]
    for sign, word in ((1.0, "increasing"), (-1.0, "decreasing")):
        if not any(np.any(w.moving & (w.direction == sign)) for w in windows):
            raise IdentificationError(f"the rotor was never seen moving with {word} angle")
    shape = start.before.shape if start.before else FrictionShape()
    every = ColumnLayout(tuple(range(1, MAX_ORDER + 1)), shape)
    equations = design.accumulate(windows, every)
    choice, beta, inertia = _choose(equations)
    inertia = inertia or start.inertia_kg_m2
    fast = any(w.fast for w in windows)
    quick = any(w.quick for w in windows)
    used = [design.INERTIA] if quick else []
    if any(not w.quasi_static for w in windows):
        used += [design.COULOMB, design.COULOMB + 1]
    if any(w.quasi_static for w in windows):
        used += [design.CREEP, design.CREEP + 1]
    used += [design.VISCOUS] if fast or start.before else []
    used += [design.LATENCY] if fast else []
    lag = (start.before.lag_rad.value if start.before else 0.0, _LAG_SD_rad)
    priors = _priors(start.before, quick)
    starts = [start.before.shape, *STARTS] if start.before else list(STARTS)
    for _ in range(_ROUNDS):
        shape = _shape(runs, start, choice.orders, beta, inertia, starts) or shape
        starts = [shape]
        fitted = fit(windows, ColumnLayout(choice.orders, shape), used, priors, lag, inertia)
        beta = fitted.beta[len(used) : len(fitted.used)]
        quick = quick and _plausible(fitted.value(design.INERTIA), start)
        used = [c for c in used if c != design.INERTIA or quick]
        inertia = fitted.value(design.INERTIA) if quick else start.inertia_kg_m2
    return _result(fitted, windows, choice, start, quick)


def _plausible(inertia: float, start: _Start) -> bool:
    """Return whether a second pass may change the inertia to this: hunting can bias it."""
    before = start.inertia_kg_m2
    return start.before is None or abs(inertia - before) < _INERTIA_CHANGE * before


def _choose(equations: Equations) -> tuple[OrderSelection, FloatArray, float]:
    """Choose the orders and weight the kinds of rows, in two rounds.

    Returns with them the harmonics' coefficients and the inertia, 0 where no run shows it.
    """
    fixed = [design.INERTIA, design.COULOMB, design.COULOMB + 1, design.VISCOUS]
    fixed += [design.CREEP, design.CREEP + 1]
    weight = rows_counted(equations)
    for _ in range(2):
        choice = choose(equations, fixed, weight)
        everything = total(equations, weight)
        for step in range(2):
            columns = fixed + [c for n in choice.orders for c in equations.layout.order(n - 1)]
            beta = solve(everything, columns)
            if step == 0:
                choice = replace(choice, orders=_significant(choice.orders, beta, len(fixed)))
        weight = noise_weights(equations, columns, beta)
    return choice, beta[len(fixed) :], float(beta[0])


def _significant(orders: tuple[int, ...], beta: FloatArray, first: int) -> tuple[int, ...]:
    """Return the orders that are not small against the largest and against Coulomb friction.

    Hunting is periodic with the cogging and thus passes cross-validation.
    """
    amplitude = np.hypot(beta[first::2], beta[first + 1 :: 2])
    coulomb = np.abs(beta[1:3]).max()
    least = _LEAST_SHARE * max(float(amplitude.max(initial=0.0)), float(coulomb))
    return tuple(n for n, a in zip(orders, amplitude, strict=True) if a >= least)


def _shape(
    runs: list[SweepData],
    start: _Start,
    orders: tuple[int, ...],
    beta: FloatArray,
    inertia: float,
    starts: list[FrictionShape],
) -> FrictionShape | None:
    """Find the friction's shape from short windows, with the cogging found so far taken off."""
    layout = ColumnLayout(orders, FrictionShape())
    motions = []
    for run in runs:
        noise = encoder_noise_rad(run)
        spacing = math.sqrt(_NOISE_GAIN * noise * start.inertia_kg_m2 / _TOLERATED_NOISE_Nm)
        spacing = min(max(spacing, _FINE_s[0]), _FINE_s[1])
        part = SweepData(*(a[-round(_LONGEST_s / period_s(run)) :] for a in vars(run).values()))
        w = cut(part, start.latency_s, spacing)
        if w is None or w.quasi_static:
            continue
        rows = np.flatnonzero(w.moving)
        if rows.size:
            x = design.matrix(w, layout, 0, w.torque_Nm.size)[:, design.FIXED :]
            rest = w.torque_Nm - x @ beta - inertia * w.acceleration_rad_s2
            motions.append(FrictionRun(w, rest[rows], rows))
    return fit_shape(motions, starts) if motions else None


def _priors(before: HarmonicResult | None, quick: bool) -> list[Prior]:
    """Return the priors: the nominal latency, and in a second pass inertia and friction.

    Where the rotor hunts, these are not separable by the fit. The friction's level has a prior only
    where no leg shows it, since it changes as the motor warms up.
    """
    if before is None:
        return [Prior(design.LATENCY, 0.0, _LATENCY_SD_s)]
    priors = [Prior(design.LATENCY, 0.0, _LATENCY_SD_AGAIN_s)]
    known = [
        (design.INERTIA, before.inertia_kg_m2.value, 0.02),
        (design.VISCOUS, before.viscous_Nms_rad.value, 0.2),
    ]
    if not quick:
        known += [
            (design.COULOMB, before.coulomb_forward_Nm.value, 0.05),
            (design.COULOMB + 1, before.coulomb_backward_Nm.value, 0.05),
        ]
    return priors + [Prior(c, m, max(1e-9, abs(m) * share)) for c, m, share in known]


def _estimate(fitted: HarmonicFit, column: int) -> ConfidenceInterval:
    return ConfidenceInterval(fitted.value(column), _CONFIDENCE * fitted.deviation(column))


def _result(
    fitted: HarmonicFit, windows: list[Windows], choice: OrderSelection, start: _Start, quick: bool
) -> HarmonicResult:
    """Assemble the result."""
    layout, before = fitted.layout, start.before
    measured = quick
    rotor = (
        _estimate(fitted, design.INERTIA) if quick else ConfidenceInterval(start.inertia_kg_m2, 0.0)
    )
    if not quick and before is not None:
        rotor, measured = before.inertia_kg_m2, before.inertia_measured
    rotor = ConfidenceInterval(
        rotor.value, math.hypot(rotor.half_width, _INERTIA_SHARE * rotor.value)
    )
    delay = _estimate(fitted, design.LATENCY)
    lag_half = _CONFIDENCE * fitted.lag_deviation_rad
    rows = sum(w.moving.size for w in windows)
    lost = sum(int(np.sum(~w.moving)) for w in windows)
    level = design.COULOMB if design.COULOMB in fitted.used else design.CREEP
    coulomb = [_estimate(fitted, level + i) for i in (0, 1)]
    rise = layout.shape.rise if level == design.COULOMB else 0.0
    viscous = _estimate(fitted, design.VISCOUS)
    return HarmonicResult(
        harmonics=tuple(_harmonic(fitted, i, start.pole_pairs) for i in range(len(layout.orders))),
        friction=FrictionFeedforward(
            coulomb[0].value,
            coulomb[1].value,
            coulomb[0].value * rise,
            coulomb[1].value * rise,
            layout.shape.speed_rad_s,
            viscous.value,
        ),
        shape=layout.shape,
        coulomb_forward_Nm=coulomb[0],
        coulomb_backward_Nm=coulomb[1],
        viscous_Nms_rad=viscous,
        inertia_kg_m2=rotor,
        inertia_measured=measured,
        latency_s=ConfidenceInterval(start.latency_s + delay.value, delay.half_width),
        lag_rad=ConfidenceInterval(fitted.lag_rad, lag_half),
        pole_pairs=start.pole_pairs,
        coverage=_coverage(windows),
        cogging_trend_1_s=fitted.cogging_trend_1_s,
        excluded_fraction=lost / rows,
        residual_rms_Nm=rms(fitted.residual_Nm),
        held_out_error_Nm=choice.error_Nm,
    )


def _harmonic(fitted: HarmonicFit, which: int, pole_pairs: int) -> Harmonic:
    """Return one order with the confidence of amplitude and phase from both coefficients."""
    order = fitted.layout.orders[which]
    column = fitted.layout.order(which)
    a, b = fitted.value(column[0]), fitted.value(column[1])
    at = fitted.used.index(column[0])
    covariance = fitted.covariance[at : at + 2, at : at + 2]
    amplitude = max(math.hypot(a, b), 1e-12)
    along = np.array([a, b]) / amplitude
    across = np.array([b, -a]) / amplitude
    spread = [math.sqrt(max(float(u @ covariance @ u), 0.0)) for u in (along, across)]
    return Harmonic(
        order=order,
        cosine_Nm=a,
        sine_Nm=b,
        amplitude_Nm=ConfidenceInterval(amplitude, _CONFIDENCE * spread[0]),
        phase_deg=ConfidenceInterval(
            math.degrees(math.atan2(a, b)),
            min(180.0, math.degrees(_CONFIDENCE * spread[1] / amplitude)),
        ),
        per_pole_pair=order / pole_pairs,
        hint=likely_cause(order, pole_pairs),
    )


def _coverage(windows: list[Windows]) -> float:
    """Return the share of the turn on which the rotor was seen moving with the ramp."""
    seen = np.zeros(_BINS, np.bool_)
    for w in windows:
        turn = w.centre_rad[w.moving] / TWO_PI
        seen[np.floor((turn - np.floor(turn)) * _BINS).astype(int) % _BINS] = True
    return float(np.mean(seen))
