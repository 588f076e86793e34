"""Joint identification of cogging, friction, inertia and latency from runs in both directions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdpr_rt.arrays import FloatArray, rms
from cdpr_rt.control.compensation import FrictionFeedforward
from cdpr_rt.identification import windows as design
from cdpr_rt.identification.result import (
    ConfidenceInterval,
    Harmonic,
    HarmonicResult,
    likely_cause,
    remaining_curve,
)
from cdpr_rt.identification.windows import (
    STARTS,
    TWO_PI,
    ColumnLayout,
    FrictionRun,
    FrictionShape,
    IdentificationError,
    IntArray,
    Normal,
    SweepData,
    Windows,
    check_runs,
    contiguous,
    cut,
    encoder_noise_rad,
    fit_shape,
    huber_weights,
    period_s,
    stretches,
)

# The final fit over windows with chosen orders: coefficients, lags, and their confidence.

CLUSTERS_PER_TURN = 24
_CLUSTERS_PER_COLUMN = 4
_ROUNDS = 5
_LEAST_SPREAD_Nm = 1e-5
_EMPTY = 1e-20
_DEPENDENT = 1e-6
"""Smallest determinant of an order's normalised 2 x 2 block."""
_EXTRA = 3
"""Columns after the harmonics: static lag, trend of the cogging, trend of the friction."""
_TREND_SD_1_s = 3e-4
_DRY = (design.COULOMB, design.COULOMB + 1, design.CREEP, design.CREEP + 1)
_FEWEST_ROWS = 20


@dataclass(frozen=True)
class Prior:
    """Gaussian prior of one column's coefficient."""

    column: int
    mean: float
    deviation: float


@dataclass
class Rows:
    """All rows of the fit: columns `x` (r, p), torque `y` (r,); all others (r,)."""

    x: FloatArray
    y: FloatArray
    acceleration: FloatArray
    """Acceleration, rad/s², if the inertia is not estimated from the row, else 0."""
    kind: IntArray
    direction: FloatArray
    time: FloatArray
    cluster: IntArray


@dataclass(frozen=True)
class HarmonicFit:
    """Coefficients of the used columns, then of the extra ones, with their covariance."""

    layout: ColumnLayout
    used: list[int]
    beta: FloatArray
    covariance: FloatArray
    lag_rad: float
    residual_Nm: FloatArray

    @property
    def lag_deviation_rad(self) -> float:
        """Standard error of the static lag."""
        return float(np.sqrt(max(self.covariance[-_EXTRA, -_EXTRA], 0.0)))

    @property
    def cogging_trend_1_s(self) -> float:
        """Relative change of the cogging per second."""
        return float(self.beta[-_EXTRA + 1])

    def value(self, column: int) -> float:
        """Return a column's coefficient, 0 if it was not used."""
        return float(self.beta[self.used.index(column)]) if column in self.used else 0.0

    def deviation(self, column: int) -> float:
        """Return the standard error of a column's coefficient, 0 if it was not used."""
        if column not in self.used:
            return 0.0
        i = self.used.index(column)
        return float(np.sqrt(max(self.covariance[i, i], 0.0)))


def gather(windows: Sequence[Windows], layout: ColumnLayout) -> Rows:
    """Collect the rows in which the rotor follows the ramp."""
    xs, ys, accelerations, ks, ds, ts, cs = [], [], [], [], [], [], []
    clusters = 0
    for w, kind in zip(windows, design.kinds(windows), strict=True):
        keep = np.flatnonzero(kind >= 0)
        place = np.floor(w.centre_rad * (CLUSTERS_PER_TURN / TWO_PI)).astype(int)
        place += clusters - int(place.min())
        clusters = int(place.max()) + 1
        xs.append(design.matrix(w, layout, 0, w.torque_Nm.size)[keep])
        ys.append(w.torque_Nm[keep])
        accelerations.append(w.acceleration_rad_s2[keep] * (not w.weighs))
        ks.append(kind[keep])
        ds.append(w.direction[keep])
        ts.append(w.centre_s[keep])
        cs.append(place[keep])
    parts = (np.concatenate(a) for a in (xs, ys, accelerations, ks, ds, ts, cs))
    return Rows(*parts)


def fit(
    windows: Sequence[Windows],
    layout: ColumnLayout,
    used: list[int],
    priors: list[Prior],
    lag_prior: tuple[float, float],
    inertia_kg_m2: float,
    correlation: FloatArray,
) -> HarmonicFit:
    """Fit the used columns, all harmonics and the static lag by Gauss-Newton steps.

    `lag_prior` is mean and standard deviation in rad. In slow runs the noise of the acceleration
    would bias the inertia low. There the inertia from the other runs is used, or `inertia_kg_m2` if
    there are no others. The covariance is the sandwich estimator over clusters of neighbouring
    windows, whose errors may be correlated. A single turn has too few clusters. There the estimator
    is over rows, multiplied by `correlation`, the number of rows per independent row of each kind.
    """
    rows = gather(windows, layout)
    columns = [*used, *range(design.FIXED, layout.columns)]
    precision, mean = _prior_arrays(columns, priors)
    precision[-_EXTRA:] = lag_prior[1] ** -2, _TREND_SD_1_s**-2, _TREND_SD_1_s**-2
    weight, inertia, lag = np.ones(rows.y.size), inertia_kg_m2, lag_prior[0]
    beta = np.zeros(len(columns) + _EXTRA)
    for step in range(_ROUNDS):
        x = _linearised(rows, layout, columns, beta, lag)
        mean[-_EXTRA] = lag_prior[0] - lag
        inverse = _inverse((x * weight[:, None]).T @ x + np.diag(precision))
        y = rows.y - inertia * rows.acceleration
        beta = inverse @ (x.T @ (weight * y) + precision * mean)
        residual = y - x @ beta
        if step < _ROUNDS - 1:
            lag += float(beta[-_EXTRA])
            weight = _weights(rows, residual)
            inertia = float(beta[0]) if used[0] == design.INERTIA else inertia
    score = x * (weight * residual)[:, None]
    if np.unique(rows.cluster).size < _CLUSTERS_PER_COLUMN * len(columns):
        score *= np.sqrt(correlation)[rows.kind, None]
        independent = float((1.0 / correlation[rows.kind]).sum())
        score_covariance = score.T @ score / max(1.0 - len(columns) / independent, 0.1)
    else:
        score_covariance = _score_covariance(score, rows.cluster)
    covariance = inverse @ (score_covariance + np.diag(precision)) @ inverse
    return HarmonicFit(layout, columns, beta, covariance, lag + float(beta[-_EXTRA]), residual)


def _prior_arrays(columns: list[int], priors: list[Prior]) -> tuple[FloatArray, FloatArray]:
    """Return precision and mean of the priors, for used and extra columns."""
    precision, mean = np.zeros(len(columns) + _EXTRA), np.zeros(len(columns) + _EXTRA)
    for p in priors:
        if p.column in columns:
            i = columns.index(p.column)
            precision[i], mean[i] = p.deviation**-2, p.mean
    return precision, mean


def _inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse, with zeros for a column that is zero in all rows."""
    size = np.diag(matrix)
    scale = np.sqrt(np.where(size > _EMPTY * size.max(), size, np.inf))
    scaled = matrix / np.outer(scale, scale) + 1e-12 * np.eye(scale.size)
    return np.asarray(np.linalg.inv(scaled) / np.outer(scale, scale))


def _linearised(
    rows: Rows, layout: ColumnLayout, columns: list[int], beta: FloatArray, lag: float
) -> FloatArray:
    """Return the used columns, harmonics shifted by the present lag, and the extra columns.

    Extra columns are the derivatives by a further lag, and by the relative change of cogging and of
    friction per second. This change occurs because the motor warms up; the coefficients apply to
    the end of the runs.
    """
    x = rows.x[:, columns]
    orders = np.repeat(np.array(layout.orders, float), 2)
    first = len(columns) - orders.size
    harmonics = _turned(x[:, first:], orders, rows.direction * lag)
    x[:, first:] = harmonics
    value = beta[first:-_EXTRA]
    since = rows.time - rows.time.max()
    dry = [i for i, c in enumerate(columns) if c in _DRY]
    extra = (
        -rows.direction * _slope(harmonics, orders, value),
        since * (harmonics @ value),
        since * (x[:, dry] @ beta[dry]),
    )
    return np.column_stack([x, *extra])


def _turned(harmonics: FloatArray, orders: FloatArray, by: FloatArray) -> FloatArray:
    """Return the cosine and sine columns for angles reduced by `by` (r,)."""
    turn = by[:, None] * orders[None, ::2]
    c, s = harmonics[:, ::2], harmonics[:, 1::2]
    out = np.empty_like(harmonics)
    out[:, ::2] = c * np.cos(turn) + s * np.sin(turn)
    out[:, 1::2] = s * np.cos(turn) - c * np.sin(turn)
    return out


def _slope(harmonics: FloatArray, orders: FloatArray, beta: FloatArray) -> FloatArray:
    """Return the derivative of the cogging by the angle, (r,)."""
    n = orders[::2]
    return np.asarray(harmonics[:, ::2] @ (n * beta[1::2]) - harmonics[:, 1::2] @ (n * beta[::2]))


def _weights(rows: Rows, residual: FloatArray) -> FloatArray:
    """Return each row's weight by Huber's rule, with one spread per kind; 0 for rare kinds."""
    weight = np.zeros(rows.kind.size)
    for kind in np.unique(rows.kind):
        mine = rows.kind == kind
        if np.count_nonzero(mine) >= _FEWEST_ROWS:
            weight[mine] = huber_weights(residual[mine], _LEAST_SPREAD_Nm)
    return weight


def _score_covariance(score: FloatArray, cluster: IntArray) -> FloatArray:
    """Return the sum over clusters of the outer products of their scores."""
    order = np.argsort(cluster, kind="stable")
    edges = np.flatnonzero(np.diff(cluster[order])) + 1
    sums = np.add.reduceat(score[order], np.concatenate([[0], edges]), axis=0)
    count = sums.shape[0]
    return np.asarray(sums.T @ sums * (count / max(1, count - score.shape[1] // 8)))


# Choice of the cogging's orders by an information criterion.

_MOST = 40
_ROWS_PER_ORDER = 8
_RIDGE = 1e-9
_OVERLAP = 2.1
"""Rows per independent row if only the overlap of windows correlates them."""
_MOST_CORRELATED = 50
_UNCORRELATED = 0.05


@dataclass(frozen=True)
class OrderSelection:
    """The chosen orders in ascending order, and the error of fits with 0, 1, ... of them.

    `error_Nm` (k + 1,) is the rms residual with the 0, 1, ... k most significant orders.
    """

    orders: tuple[int, ...]
    error_Nm: FloatArray
    correlation: FloatArray
    """Rows per independent row of each kind, see RowWeights."""


@dataclass(frozen=True)
class RowWeights:
    """Inverse variance of the noise, and rows per independent row, for each kind of row.

    The weight is 0 for kinds with too few rows.
    """

    weight: FloatArray
    correlation: FloatArray


def solve(normal: Normal, columns: list[int]) -> FloatArray:
    """Return the coefficients of the chosen columns; 0 for columns that are zero in all rows."""
    xx = normal.xx[np.ix_(columns, columns)]
    scale = _scale(np.diag(xx))
    xx = xx / np.outer(scale, scale)
    xx[np.diag_indices_from(xx)] += _RIDGE
    return np.asarray(np.linalg.solve(xx, normal.xy[columns] / scale) / scale)


def _scale(diagonal: FloatArray) -> FloatArray:
    """Return the columns' norms, infinite for a column that is zero in all rows."""
    return np.asarray(np.sqrt(np.where(diagonal > _EMPTY * diagonal.max(), diagonal, np.inf)))


def choose(
    kinds: Normal, layout: ColumnLayout, fixed: list[int], rows: RowWeights
) -> OrderSelection:
    """Choose the orders by the extended Bayesian information criterion (Chen and Chen, 2008).

    Orders are added one by one; each is the one that lowers the sum of squares S most. The result
    minimises N ln(S) + 2 k (ln N + ln K) for k orders of K candidates and N independent rows.
    Neighbouring rows contain the same noise, so `rows.correlation` of them count as one.
    """
    used = rows.weight > 0.0
    independent = float((kinds.rows[used] / rows.correlation[used]).sum())
    total = kinds.weighted(np.where(used, rows.weight / rows.correlation, 0.0))
    count = len(layout.orders)
    most = min(_MOST, int(independent / _ROWS_PER_ORDER))
    added, left = _forward(total, fixed, layout, most)
    size = np.arange(left.size)
    criterion = independent * np.log(left) + 2.0 * size * math.log(max(independent, 2.0) * count)
    best = int(np.argmin(criterion))
    weights = float(kinds.rows @ (rows.weight / rows.correlation))
    return OrderSelection(
        tuple(sorted(layout.orders[i] for i in added[:best])),
        np.sqrt(left / max(weights, 1e-300)),
        rows.correlation,
    )


def _forward(
    total: Normal, fixed: list[int], layout: ColumnLayout, most: int
) -> tuple[list[int], FloatArray]:
    """Return the indices of the orders in the order of their addition, and the sums of squares.

    The fixed columns are always included. After each addition, the normal equations contain only
    the parts of columns and torque that the included columns do not explain.
    """
    columns = [*fixed, *range(design.FIXED, layout.columns)]
    first = len(fixed)
    scale = _scale(np.diag(total.xx)[columns])
    xx = total.xx[np.ix_(columns, columns)] / np.outer(scale, scale)
    xy, left = total.xy[columns] / scale, float(total.yy)

    def include(some: list[int]) -> None:
        nonlocal xx, xy, left
        block = xx[np.ix_(some, some)] + _RIDGE * np.eye(len(some))
        gain = np.linalg.solve(block, np.column_stack([xy[some], xx[some]]))
        left -= float(xy[some] @ gain[:, 0])
        xy, xx = xy - xx[:, some] @ gain[:, 0], xx - xx[:, some] @ gain[:, 1:]

    include(list(range(first)))
    added: list[int] = []
    squares = [left]
    cosine = np.arange(first, len(columns), 2)
    while len(added) < most:
        a, b, c = xx[cosine, cosine], xx[cosine + 1, cosine + 1], xx[cosine, cosine + 1]
        x, y, sound = xy[cosine], xy[cosine + 1], a * b - c * c > _DEPENDENT
        gain = np.zeros(cosine.size)
        np.divide(b * x**2 - 2.0 * c * x * y + a * y**2, a * b - c * c, out=gain, where=sound)
        gain[added] = 0.0
        best = int(np.argmax(gain))
        if gain[best] <= 0.0:
            break
        include([first + 2 * best, first + 2 * best + 1])
        added.append(best)
        squares.append(max(left, 1e-12 * squares[0], 1e-300))
    return added, np.array(squares)


def rows_counted(kinds: Normal) -> RowWeights:
    """Return equal weights for all kinds of row that are frequent enough."""
    weight = np.where(kinds.rows >= _FEWEST_ROWS, 1.0, 0.0)
    return RowWeights(weight, np.full(weight.size, _OVERLAP))


def rows_by_noise(
    rows: FloatArray,
    layout: ColumnLayout,
    windows: Sequence[Windows],
    columns: list[int],
    beta: FloatArray,
) -> RowWeights:
    """Return the weights from the residual noise of a fit, and the correlation of that noise.

    N neighbouring rows with correlations r1, r2, ... count as N / (1 + 2 (r1 + r2 + ...)).
    """
    squares, correlation = np.zeros(rows.size), np.zeros(rows.size)
    for w, kind in zip(windows, design.kinds(windows), strict=True):
        left = _left(w, layout, columns, beta)
        for k in range(rows.size):
            part = np.where(kind == k, left, 0.0)
            squares[k] += float(part @ part)
            correlation[k] += _correlated_sum(part)
    counted = rows >= _FEWEST_ROWS
    mean = np.maximum(squares / np.maximum(rows, 1.0), 1e-10)
    share = 1.0 + 2.0 * correlation / np.maximum(squares, 1e-300)
    return RowWeights(np.where(counted, 1.0 / mean, 0.0), np.maximum(share, _OVERLAP))


def _left(
    windows: Windows, layout: ColumnLayout, columns: list[int], beta: FloatArray
) -> FloatArray:
    """Return the residual torque of the windows after a fit of some columns of the layout."""
    orders = tuple(layout.orders[(c - design.FIXED) // 2] for c in columns if c >= design.FIXED)
    part = ColumnLayout(orders[::2], layout.shape)
    fixed = [c for c in columns if c < design.FIXED]
    x = design.matrix(windows, part, 0, windows.torque_Nm.size)
    x = x[:, [*fixed, *range(design.FIXED, part.columns)]]
    return np.asarray(windows.torque_Nm - x @ beta)


def _correlated_sum(left: FloatArray) -> float:
    """Return the sum of products of residuals at distances 1, 2, ... while they correlate."""
    total, square = 0.0, float(left @ left)
    for distance in range(1, min(_MOST_CORRELATED, left.size // 4)):
        product = float(left[distance:] @ left[:-distance])
        if product < _UNCORRELATED * square:
            break
        total += product
    return total


MAX_ORDER = 200
_BINS = 360
"""Bins over a turn for the coverage."""
_LEAST_TURN = 0.95
_MOST_DROPPED = 0.5
_CHOICE_ROUNDS = 2
_LAG_ORDERS, _LAG_MOST = 100, 15
_LATENCY_SD_s = 1e-3
_LATENCY_SD_AGAIN_s = 2e-4
_LAG_SD_rad = np.deg2rad(1.0)
_CONFIDENCE = 1.96
_NOISE_GAIN = 2.45
"""Noise gain of a second difference: sqrt(6)."""
_TOLERATED_NOISE_Nm = 3e-3
_FINE_s = (0.005, 0.02)
_LONGEST_s = 30.0
_HARMONIC_MODEL_ROUNDS = 2
_LEAST_SHARE = 2.5e-3
_INERTIA_CHANGE = 0.05
_INERTIA_SHARE = 0.01
"""Relative error of the inertia due to unmodelled effects, such as the lag of the current loop."""


def identify_harmonic_model(
    legs: Sequence[SweepData],
    inertia_kg_m2: float,
    latency_s: float,
    pole_pairs: int,
    slots: int | None = None,
) -> HarmonicResult:
    """Identify the motor from slow sweeps and short fast legs, best in both directions.

    `inertia_kg_m2` is kept if no leg is fast enough to measure it; `latency_s` is the nominal one
    (see compensation.AxisCompensation). Legs in a single direction give only the sum of cogging and
    friction, and not the lag between directions. Raises IdentificationError for less than a turn.
    """
    check_runs(legs)
    start = _Start(latency_s, pole_pairs, slots, inertia_kg_m2, None)
    return _identify(legs, start)


def refine(before: HarmonicResult, run_legs: Sequence[SweepData]) -> HarmonicResult:
    """Identify again from runs under PID and compensation; keep values that these do not determine.

    Friction, inertia and latency of `before` are priors with generous standard deviations; the
    cogging is fitted without a prior.
    """
    check_runs(run_legs)
    inertia = before.inertia_kg_m2.value
    latency = before.latency_s.value
    start = _Start(latency, before.pole_pairs, before.slots, inertia, before)
    return _identify(run_legs, start)


@dataclass(frozen=True)
class _Start:
    """Prior knowledge of a fit; `before` is the result that is being refined."""

    latency_s: float
    pole_pairs: int
    slots: int | None
    inertia_kg_m2: float
    before: HarmonicResult | None


def _identify(legs: Sequence[SweepData], start: _Start) -> HarmonicResult:
    """Choose orders, find the friction's shape, then fit all parameters jointly."""
    runs = contiguous(legs)
    dropped = _dropped(legs, runs)
    windows = [w for run in runs if (w := cut(run, start.latency_s)) is not None]
    directions = _directions(runs, windows)
    windows = windows if start.before else weighing(windows)
    # one direction at low speed cannot separate the friction's curve from the cogging
    curved = len(directions) == 2 or any(w.fast for w in windows)
    shape = start.before.shape if start.before else FrictionShape(0.25 if curved else 0.0)
    every = ColumnLayout(tuple(range(1, MAX_ORDER + 1)), shape)
    choice, beta, inertia = _choose(windows, every)
    inertia = inertia or start.inertia_kg_m2
    used = _used(windows, directions, start)
    quick = any(w.quick for w in windows)
    lag = (start.before.lag_rad.value if start.before else 0.0, _LAG_SD_rad)
    priors = _priors(start.before, quick)
    starts = [start.before.shape, *STARTS] if start.before else list(STARTS)
    for _ in range(_HARMONIC_MODEL_ROUNDS):
        if curved:
            shape = _shape(runs, start, choice.orders, beta, inertia, starts) or shape
        starts = [shape]
        layout = ColumnLayout(choice.orders, shape)
        fitted = fit(windows, layout, used, priors, lag, inertia, choice.correlation)
        beta = fitted.beta[len(used) : len(fitted.used)]
        quick = quick and _plausible(fitted.value(design.INERTIA), start)
        used = [c for c in used if c != design.INERTIA or quick or not start.before]
        inertia = fitted.value(design.INERTIA) if used[0] == design.INERTIA else inertia
    return _result(fitted, windows, choice, start, quick, directions, dropped)


def _dropped(legs: Sequence[SweepData], runs: Sequence[SweepData]) -> float:
    """Return the share of samples in pieces that are too short for a fit."""
    recorded = sum(leg.time_s.size for leg in legs)
    share = 1.0 - sum(run.time_s.size for run in runs) / recorded
    if share > _MOST_DROPPED:
        raise IdentificationError(
            f"{share:.0%} of {recorded} samples lie in pieces of less than 100 samples between "
            "jumps of the time: record at a constant rate, or resample with `cdpr import`"
        )
    return share


def _directions(runs: Sequence[SweepData], windows: Sequence[Windows]) -> tuple[int, ...]:
    """Return the directions of motion, +1 and -1 or one of them.

    Raises IdentificationError if no direction was recorded, or if the angles do not span a turn.
    """
    found = tuple(d for d in (1, -1) if any(np.any(w.moving & (w.direction == d)) for w in windows))
    if not found:
        raise IdentificationError("the rotor does not move in the recordings")
    step = 0.5 * TWO_PI / _BINS
    spans = [np.arange(r.angle_rad.min(), r.angle_rad.max(), step) for r in runs]
    seen = _seen(spans)
    if seen < _LEAST_TURN:
        raise IdentificationError(
            f"the recordings contain {seen:.0%} of a turn: record at least one whole turn"
        )
    return found


def weighing(windows: list[Windows]) -> list[Windows]:
    """Return the windows, with the inertia fitted on slow runs if no run is quick.

    On slow runs, hunting reveals the inertia, but with errors due to friction. This value only
    keeps the cogging unbiased.
    """
    if any(w.quick for w in windows):
        return windows
    return [replace(w, weighs=w.swings) for w in windows]


def _used(windows: list[Windows], directions: tuple[int, ...], start: _Start) -> list[int]:
    """Return the columns, apart from the harmonics, that the runs can determine."""
    fast = any(w.fast for w in windows)
    side = [0 if d > 0 else 1 for d in directions]
    used = [design.INERTIA] if any(w.weighs for w in windows) else []
    if any(not w.quasi_static for w in windows):
        used += [design.COULOMB + i for i in side]
    if any(w.quasi_static for w in windows):
        used += [design.CREEP + i for i in side]
    both = len(directions) == 2
    used += [design.VISCOUS] if (fast and both) or start.before else []
    return used + ([design.LATENCY] if fast else [])


def _plausible(inertia: float, start: _Start) -> bool:
    """Return whether a second pass may use this inertia: hunting can bias it."""
    before = start.inertia_kg_m2
    return start.before is None or abs(inertia - before) < _INERTIA_CHANGE * before


def _choose(
    windows: Sequence[Windows], every: ColumnLayout
) -> tuple[OrderSelection, FloatArray, float]:
    """Choose the orders and weight the kinds of rows, in some rounds.

    Also returns the harmonics' coefficients and the inertia, 0 if no run determines it.
    """
    equations = design.accumulate(windows, every)
    fixed = [design.INERTIA, design.COULOMB, design.COULOMB + 1, design.VISCOUS]
    fixed += [design.CREEP, design.CREEP + 1]
    rows = rows_counted(equations)
    for _ in range(_CHOICE_ROUNDS):
        choice = choose(equations, every, fixed, rows)
        everything = equations.weighted(rows.weight / rows.correlation)
        for step in range(2):
            columns = fixed + [c for n in choice.orders for c in every.order(n - 1)]
            beta = solve(everything, columns)
            if step == 0:
                choice = replace(choice, orders=_significant(choice.orders, beta, len(fixed)))
        rows = rows_by_noise(equations.rows, every, windows, columns, beta)
    choice = replace(choice, correlation=rows.correlation)
    return choice, beta[len(fixed) :], float(beta[0])


def explained(windows: Sequence[Windows]) -> tuple[float, float]:
    """Return the share of squared torque left by a fit of all orders, and the independent rows."""
    every = ColumnLayout(tuple(range(1, _LAG_ORDERS + 1)), FrictionShape(0.0))
    equations = design.accumulate(windows, every)
    rows = rows_counted(equations)
    fixed = [c for c in range(design.FIXED) if c not in (design.LATENCY, design.VISCOUS)]
    _, left = _forward(equations.weighted(rows.weight), fixed, every, _LAG_MOST)
    return float(left[-1] / left[0]), float((equations.rows / rows.correlation).sum())


def _significant(orders: tuple[int, ...], beta: FloatArray, first: int) -> tuple[int, ...]:
    """Return the orders that are not small relative to the largest and to Coulomb friction.

    Hunting is periodic with the cogging and thus not seen as noise.
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
    """Find the friction's shape from short windows after subtracting the cogging found so far."""
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

    The fit cannot separate these if the rotor hunts. The friction's level has a prior only if no
    leg shows it, because it changes as the motor warms up.
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
    fitted: HarmonicFit,
    windows: list[Windows],
    choice: OrderSelection,
    start: _Start,
    quick: bool,
    directions: tuple[int, ...],
    dropped: float,
) -> HarmonicResult:
    """Assemble the result."""
    layout, before = fitted.layout, start.before
    delay = _estimate(fitted, design.LATENCY)
    lag_half = _CONFIDENCE * fitted.lag_deviation_rad
    rows = sum(w.moving.size for w in windows)
    lost = sum(int(np.sum(~w.moving)) for w in windows)
    coulomb, rise = _coulomb(fitted, directions)
    viscous = _estimate(fitted, design.VISCOUS)
    return HarmonicResult(
        harmonics=tuple(_harmonic(fitted, i, start) for i in range(len(layout.orders))),
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
        inertia_kg_m2=_inertia(fitted, start, quick),
        inertia_measured=before.inertia_measured if before is not None and not quick else quick,
        latency_s=ConfidenceInterval(start.latency_s + delay.value, delay.half_width),
        lag_rad=ConfidenceInterval(fitted.lag_rad, lag_half),
        pole_pairs=start.pole_pairs,
        slots=start.slots,
        directions=directions,
        coverage=_seen([w.centre_rad[w.moving] for w in windows]),
        cogging_trend_1_s=fitted.cogging_trend_1_s,
        dropped_fraction=dropped,
        excluded_fraction=lost / rows,
        residual_rms_Nm=rms(fitted.residual_Nm),
        error_by_orders_Nm=choice.error_Nm,
        remainder_Nm=remaining_curve(
            windows,
            [np.asarray(np.flatnonzero(kind >= 0), np.intp) for kind in design.kinds(windows)],
            fitted.residual_Nm,
            fitted.lag_rad,
        ),
    )


def _inertia(fitted: HarmonicFit, start: _Start, quick: bool) -> ConfidenceInterval:
    """Return the inertia from quick runs, or the previously known one."""
    if quick:
        rotor = _estimate(fitted, design.INERTIA)
    elif start.before is not None:
        rotor = start.before.inertia_kg_m2
    else:
        rotor = ConfidenceInterval(start.inertia_kg_m2, 0.0)
    return replace(rotor, half_width=math.hypot(rotor.half_width, _INERTIA_SHARE * rotor.value))


def _coulomb(
    fitted: HarmonicFit, directions: tuple[int, ...]
) -> tuple[list[ConfidenceInterval], float]:
    """Return Coulomb friction forward and backward, and its relative rise at standstill.

    An unmeasured direction gets the friction of the other one, with a confidence interval from
    zero. Raises IdentificationError for negative friction.
    """
    sliding = design.COULOMB in fitted.used or design.COULOMB + 1 in fitted.used
    level = design.COULOMB if sliding else design.CREEP
    found = {d: _estimate(fitted, level + (d < 0)) for d in directions}
    for d, one in found.items():
        if one.value + one.half_width < 0.0:
            word = "increasing" if d > 0 else "decreasing"
            raise IdentificationError(
                f"the friction at {word} angle is negative, {1e3 * one.value:.1f} mNm: the sign of "
                "the torque or of the angle is wrong, or a load turns the motor"
            )
    both = [found.get(d) or ConfidenceInterval(found[-d].value, found[-d].value) for d in (1, -1)]
    return both, fitted.layout.shape.rise if sliding else 0.0


def _harmonic(fitted: HarmonicFit, which: int, start: _Start) -> Harmonic:
    """Return one order; amplitude and phase get their confidence from both coefficients."""
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
        per_pole_pair=order / start.pole_pairs,
        hint=likely_cause(order, start.pole_pairs, start.slots),
    )


def _seen(angles_rad: Sequence[FloatArray]) -> float:
    """Return the share of the turn that contains angles."""
    seen = np.zeros(_BINS, np.bool_)
    for angle in angles_rad:
        turn = angle / TWO_PI
        seen[np.floor((turn - np.floor(turn)) * _BINS).astype(int) % _BINS] = True
    return float(np.mean(seen))


# The second pass: refinement by ramps under compensation.

MOST_ROUNDS = 4
_SAME = 0.2


def rms_deviation_rad(legs: Sequence[SweepData]) -> float:
    """Return the rms deviation from the set-point about its mean, the largest over the legs.

    Only the last whole turns at constant speed are used, to exclude the start. Raises
    IdentificationError if no leg has a whole turn.
    """
    deviations = []
    for stretch in stretches(legs):
        part = stretch.last_whole_turns()
        if part is None:
            continue
        cut = slice(part.start, part.stop)
        deviations.append(float(np.std(part.run.angle_rad[cut] - part.run.setpoint_rad[cut])))
    if not deviations:
        raise IdentificationError(
            "no leg of the second pass contains a whole turn at constant speed"
        )
    return max(deviations)


class SecondPass:
    """Refines a first result round by round; the best is the one with the smallest deviation.

    Each round: run ramps in both directions under `current`, then `add` the recorded legs. A
    refinement from runs with hunting may be wrong, so the deviation of the next run under it
    decides. The pass is `done` when a round is no better than the best one before, or after
    `MOST_ROUNDS`. `fast_legs` are the legs of the first result without the sweeps.
    """

    def __init__(self, first: HarmonicResult, fast_legs: Sequence[SweepData]) -> None:
        self.current = first
        """The result under which the next ramps are run."""
        self._known = list(fast_legs)
        self._tried: list[tuple[float, HarmonicResult]] = []
        self.done = False

    @property
    def best(self) -> HarmonicResult:
        """The result with the smallest deviation; the first if none was run."""
        if not self._tried:
            return self.current
        return min(self._tried, key=lambda tried: tried[0])[1]

    @property
    def rms_deviation_rad(self) -> tuple[float, ...]:
        """The deviation of each round."""
        return tuple(deviation_rad for deviation_rad, _ in self._tried)

    def add(self, legs: Sequence[SweepData]) -> None:
        """Evaluate ramps that were run under `current`; raises IdentificationError."""
        deviation_rad = rms_deviation_rad(legs)
        before = min(self.rms_deviation_rad, default=np.inf)
        self._tried.append((deviation_rad, self.current))
        converged = (1.0 - _SAME) * before <= deviation_rad <= (1.0 + _SAME) * before
        self.done = converged or len(self._tried) >= MOST_ROUNDS
        self._known += legs
        if not self.done:
            self.current = refine(self.best, self._known)
