"""Joint identification of cogging, friction, inertia and latency from runs in both directions."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdpr_rt.compensation import FrictionFeedforward
from cdpr_rt.exchange import FloatArray
from cdpr_rt.identification import design
from cdpr_rt.identification.design import Equations, Layout
from cdpr_rt.identification.estimate import Fit, Prior, best_stribeck_speed, fit
from cdpr_rt.identification.result import BetterResult, Estimate, Harmonic, hint
from cdpr_rt.identification.selection import Choice, choose, noise_weights, solve, total
from cdpr_rt.identification.sweep import TWO_PI, IdentificationError, SweepData, check_runs
from cdpr_rt.identification.windows import Windows, contiguous, cut

MAX_ORDER = 200
_LATENCY_SD_s = 1e-3
_LAG_SD_rad = np.deg2rad(1.0)
_CONFIDENCE = 1.96


def identify_better(
    legs: Sequence[SweepData], inertia_kg_m2: float, latency_s: float, pole_pairs: int
) -> BetterResult:
    """Identify the motor from slow sweeps and short fast legs, in both directions.

    `inertia_kg_m2` is kept where no leg is fast enough to measure it; `latency_s` is the nominal
    one (see compensation.AxisCompensation). Raises IdentificationError where the rotor was not
    seen sliding in both directions.
    """
    check_runs(legs)
    windows = _windows(legs, latency_s)
    coarse = design.accumulate(windows, Layout(tuple(range(1, MAX_ORDER + 1))))
    choice, weight, which = _choose(coarse)
    speed = coarse.layout.stribeck_rad_s[which] if which is not None else None
    return _finish(windows, choice, weight, speed, None, inertia_kg_m2, latency_s, pole_pairs)


def refine(better: BetterResult, run_legs: Sequence[SweepData]) -> BetterResult:
    """Identify anew from runs under PID and compensation; what they do not show is kept.

    Friction, inertia and latency of `better` count as prior knowledge with generous errors; the
    cogging is fitted afresh.
    """
    check_runs(run_legs)
    latency = better.latency_s.value
    windows = _windows(run_legs, latency)
    coarse = design.accumulate(windows, Layout(tuple(range(1, MAX_ORDER + 1))))
    choice, weight, _ = _choose(coarse)
    return _finish(
        windows,
        choice,
        weight,
        better.friction.stribeck_speed_rad_s,
        better,
        better.inertia_kg_m2.value,
        latency,
        better.pole_pairs,
    )


def _windows(legs: Sequence[SweepData], latency_s: float) -> list[Windows]:
    windows = [w for run in contiguous(legs) if (w := cut(run, latency_s)) is not None]
    for sign, word in ((1.0, "increasing"), (-1.0, "decreasing")):
        if not any(np.any((w.sliding | w.creeping) & (w.direction == sign)) for w in windows):
            raise IdentificationError(f"the rotor was never seen moving with {word} angle")
    return windows


def _fixed(equations: Equations, which: int | None) -> list[int]:
    """Return the columns besides harmonics that the rows can tell."""
    parts = [p for p in equations.parts.values() if p.rows]
    size = np.sum([np.diag(p.xx) for p in parts], axis=0)
    wanted = [design.INERTIA, design.INERTIA_SLOW, design.COULOMB, design.COULOMB + 1]
    wanted += [design.VISCOUS] if size[design.INERTIA] > 0.0 else []
    wanted += [design.CREEP, design.CREEP + 1]
    wanted += equations.layout.stribeck(which) if which is not None else []
    return [c for c in wanted if size[c] > 0.0]


def _choose(equations: Equations) -> tuple[Choice, FloatArray, int | None]:
    """Choose orders and Stribeck speed, and weigh the kinds of rows, in two rounds."""
    which = None
    weight = np.ones(equations.kinds)
    for kind in range(equations.kinds):
        rows = sum(p.rows for key, p in equations.parts.items() if key[1] == kind)
        weight[kind] = 1.0 if rows >= 20 else 0.0
    for _ in range(3):
        fixed = _fixed(equations, which)
        choice = choose(equations, fixed, weight)
        harmonics = [c for n in choice.orders for c in equations.layout.order(n - 1)]
        everything = total(equations.parts, weight)
        errors = {}
        for candidate in (None, *range(len(equations.layout.stribeck_rad_s))):
            columns = _fixed(equations, candidate) + harmonics
            beta, _ = solve(everything, columns)
            errors[candidate] = float(everything.yy - beta @ everything.xy[columns])
        which = min(errors, key=lambda key: errors[key])
        columns = _fixed(equations, which) + harmonics
        beta, _ = solve(everything, columns)
        weight = noise_weights(equations, columns, beta)
    return choice, weight, which


def _priors(better: BetterResult | None, layout: Layout) -> list[Prior]:
    """Return what is known beforehand: the nominal latency, and in a second pass the friction."""
    priors = [Prior(design.LATENCY, 0.0, _LATENCY_SD_s)]
    if better is None:
        return priors
    f = better.friction
    forward, backward = layout.stribeck(0)
    known = (
        (design.INERTIA, better.inertia_kg_m2.value, 0.02),
        (design.COULOMB, f.coulomb_forward_Nm, 0.05),
        (design.COULOMB + 1, f.coulomb_backward_Nm, 0.05),
        (design.VISCOUS, f.viscous_Nms_rad, 0.2),
        (forward, f.stribeck_forward_Nm, 0.3),
        (backward, f.stribeck_backward_Nm, 0.3),
    )
    floor = 1e-9
    return priors + [Prior(c, m, max(floor, abs(m) * share)) for c, m, share in known]


def _finish(
    windows: list[Windows],
    choice: Choice,
    weight: FloatArray,
    speed: float | None,
    before: BetterResult | None,
    inertia: float,
    latency: float,
    pole_pairs: int,
) -> BetterResult:
    """Fit the chosen orders and put the result together."""
    fast = any(w.fast for w in windows)
    used = [design.INERTIA] if fast else []
    used += [design.INERTIA_SLOW] if any(not w.fast for w in windows) else []
    used += [design.COULOMB, design.COULOMB + 1]
    used += [design.VISCOUS] if fast or before is not None else []
    used += [design.CREEP, design.CREEP + 1] if _creeps(windows, weight) else []
    if speed is not None and before is None:
        speed = best_stribeck_speed(windows, choice.orders, weight, speed, used)
    layout = Layout(choice.orders, (speed or 1.0,))
    if speed is not None:
        used += layout.stribeck(0)
    used += [design.LATENCY]
    lag = (before.lag_rad.value if before else 0.0, _LAG_SD_rad)
    fitted = fit(windows, layout, weight, used, _priors(before, layout), lag)
    return _result(fitted, windows, choice, before, inertia, latency, pole_pairs, fast)


def _creeps(windows: list[Windows], weight: FloatArray) -> bool:
    return any(
        np.any((kind >= 0) & (kind % 2 == 1) & (weight[np.maximum(kind, 0)] > 0.0))
        for kind in design.kinds(windows)
    )


def _estimate(fitted: Fit, column: int) -> Estimate:
    return Estimate(fitted.value(column), _CONFIDENCE * fitted.deviation(column))


def _result(
    fitted: Fit,
    windows: list[Windows],
    choice: Choice,
    before: BetterResult | None,
    inertia: float,
    latency: float,
    pole_pairs: int,
    fast: bool,
) -> BetterResult:
    layout = fitted.layout
    forward, backward = layout.stribeck(0)
    measured = fast
    rotor = _estimate(fitted, design.INERTIA) if fast else Estimate(inertia, 0.0)
    if not fast and before is not None:
        rotor, measured = before.inertia_kg_m2, before.inertia_measured
    delay = _estimate(fitted, design.LATENCY)
    lag_half = _CONFIDENCE * float(np.sqrt(max(fitted.covariance[-1, -1], 0.0)))
    rows = sum(w.sliding.size for w in windows)
    lost = sum(int(np.sum(~(w.sliding | w.creeping))) for w in windows)
    coulomb = [_estimate(fitted, design.COULOMB + i) for i in (0, 1)]
    viscous = _estimate(fitted, design.VISCOUS)
    return BetterResult(
        harmonics=tuple(_harmonic(fitted, i, pole_pairs) for i in range(len(layout.orders))),
        friction=FrictionFeedforward(
            coulomb[0].value,
            coulomb[1].value,
            fitted.value(forward),
            fitted.value(backward),
            layout.stribeck_rad_s[0],
            viscous.value,
        ),
        coulomb_forward_Nm=coulomb[0],
        coulomb_backward_Nm=coulomb[1],
        viscous_Nms_rad=viscous,
        inertia_kg_m2=rotor,
        inertia_measured=measured,
        latency_s=Estimate(latency + delay.value, delay.half_width),
        lag_rad=Estimate(fitted.lag_rad, lag_half),
        pole_pairs=pole_pairs,
        coverage=_coverage(windows),
        excluded_fraction=lost / rows,
        residual_rms_Nm=float(np.sqrt(np.mean(fitted.residual_Nm**2))),
        held_back_error_Nm=choice.error_Nm,
    )


def _harmonic(fitted: Fit, which: int, pole_pairs: int) -> Harmonic:
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
        amplitude_Nm=Estimate(amplitude, _CONFIDENCE * spread[0]),
        phase_deg=Estimate(
            math.degrees(math.atan2(a, b)),
            min(180.0, math.degrees(_CONFIDENCE * spread[1] / amplitude)),
        ),
        per_pole_pair=order / pole_pairs,
        hint=hint(order, pole_pairs),
    )


def _coverage(windows: list[Windows], bins: int = 360) -> float:
    """Return the share of the turn on which the rotor was seen moving with the ramp."""
    seen = np.zeros(bins, np.bool_)
    for w in windows:
        turn = w.centre_rad[w.sliding | w.creeping] / TWO_PI
        seen[np.floor((turn - np.floor(turn)) * bins).astype(int) % bins] = True
    return float(np.mean(seen))
