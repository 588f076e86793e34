"""Choice of the cogging's orders by cross-validation over turns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from cdpr_rt.arrays import FloatArray
from cdpr_rt.identification.cogging.design import ColumnLayout, Equations, Normal
from cdpr_rt.identification.cogging.windows import IntArray

_MOST = 40
_FEWEST_ROWS = 20
_RIDGE = 1e-10
_EMPTY = 1e-20


@dataclass(frozen=True)
class OrderSelection:
    """The chosen orders, rising, and the cross-validation error with 0, 1, ... of them.

    `error_Nm` (k + 1,) is the rms error of prediction of held-back turns with 0, 1, ... k orders.
    """

    orders: tuple[int, ...]
    error_Nm: FloatArray


def total(equations: Equations, weight: FloatArray) -> Normal:
    """Sum weighted normal equations over kinds and folds."""
    return _sum(_by_fold(equations, weight), equations.layout)


def _by_fold(equations: Equations, weight: FloatArray) -> list[Normal]:
    """Sum weighted normal equations over kinds, for each fold."""
    sums = [_empty(equations.layout) for _ in range(equations.folds)]
    weighted = np.empty_like(sums[0].xx)
    for (fold, kind), part in equations.parts.items():
        if weight[kind] > 0.0:
            out = sums[fold]
            out.xx += np.multiply(weight[kind], part.xx, out=weighted)
            out.xy += weight[kind] * part.xy
            out.yy += weight[kind] * part.yy
            out.rows += part.rows
    return sums


def _empty(layout: ColumnLayout) -> Normal:
    return Normal(np.zeros((layout.columns, layout.columns)), np.zeros(layout.columns))


def _sum(parts: Sequence[Normal], layout: ColumnLayout) -> Normal:
    out = _empty(layout)
    for part in parts:
        out.xx += part.xx
        out.xy += part.xy
        out.yy += part.yy
        out.rows += part.rows
    return out


def solve(normal: Normal, columns: list[int]) -> FloatArray:
    """Return the coefficients of the chosen columns; 0 for one that is zero in all rows."""
    lower, scale = _factor(normal, columns)
    beta = scipy.linalg.cho_solve((lower, True), normal.xy[columns] / scale)
    return np.asarray(beta / scale)


def _factor(normal: Normal, columns: list[int]) -> tuple[FloatArray, FloatArray]:
    """Return the Cholesky factor of the chosen columns' scaled normal matrix, and the scale.

    The factor of the first k columns is the first k rows and columns of it.
    """
    xx = normal.xx[np.ix_(columns, columns)]
    size = np.diag(xx)
    scale = np.sqrt(np.where(size > _EMPTY * size.max(), size, np.inf))
    xx /= np.outer(scale, scale)
    xx[np.diag_indices_from(xx)] += _RIDGE
    return np.asarray(np.linalg.cholesky(xx)), np.asarray(scale)


def squared_error(part: Normal, columns: list[int], beta: FloatArray) -> float:
    """Return the sum of squared errors of a prediction over a part's rows."""
    xy, xx = part.xy[columns], part.xx[np.ix_(columns, columns)]
    return max(0.0, float(part.yy - 2.0 * beta @ xy + beta @ xx @ beta))


def rows_counted(equations: Equations) -> FloatArray:
    """Return the weight 1 for each kind of row that is not rare, 0 for the others."""
    count = np.zeros(equations.kinds)
    for (_, kind), part in equations.parts.items():
        count[kind] += part.rows
    return np.where(count >= _FEWEST_ROWS, 1.0, 0.0)


def noise_weights(equations: Equations, columns: list[int], beta: FloatArray) -> FloatArray:
    """Return a weight for each kind of row: one over its mean squared error, 0 for too few rows."""
    weight = np.zeros(equations.kinds)
    for kind in range(equations.kinds):
        parts = [p for key, p in equations.parts.items() if key[1] == kind]
        rows = sum(p.rows for p in parts)
        if rows >= _FEWEST_ROWS:
            mean = sum(squared_error(p, columns, beta) for p in parts) / rows
            weight[kind] = 1.0 / max(mean, 1e-10)
    return weight


def choose(equations: Equations, fixed: list[int], weight: FloatArray) -> OrderSelection:
    """Choose the orders whose harmonics predict turns that were not fitted.

    Each fold is held back once. The others rank the orders by significance (Wald statistic), and
    ever larger sets predict the fold. The smallest set is taken whose error exceeds the best by no
    more than one standard error of the paired differences between folds. Ranks are averaged over
    folds.
    """
    layout = equations.layout
    folds = _by_fold(equations, weight)
    held = [f for f, part in enumerate(folds) if part.rows >= _FEWEST_ROWS]
    errors, ranks = [], np.zeros(len(layout.orders))
    for fold in held:
        train = _sum([part for f, part in enumerate(folds) if f != fold], layout)
        ranking = _rank(train, fixed, layout)
        ranks[ranking] += np.arange(ranking.size)
        errors.append(_path(train, folds[fold], fixed, layout, ranking))
    everything = _sum(folds, layout)
    overall = _rank(everything, fixed, layout)
    mean = np.mean(errors, axis=0)
    best = int(np.argmin(mean))
    gap = np.array(errors) - np.array(errors)[:, best : best + 1]
    spread = gap.std(axis=0, ddof=1) / math.sqrt(len(held)) if len(held) > 1 else 0.0 * mean
    size = int(np.flatnonzero(gap.mean(axis=0) <= spread)[0])
    per_row = everything.rows / max(
        float(np.sum([weight[k[1]] * p.rows for k, p in equations.parts.items()])), 1e-300
    )
    return OrderSelection(
        tuple(sorted(layout.orders[i] for i in overall[:size])), np.sqrt(mean * per_row)
    )


def _rank(train: Normal, fixed: list[int], layout: ColumnLayout) -> IntArray:
    """Return the places of the orders by falling significance."""
    columns = fixed + [c for i in range(len(layout.orders)) for c in layout.order(i)]
    lower, scale = _factor(train, columns)
    inverse = scipy.linalg.lapack.dtrtri(lower, lower=1)[0]
    first = len(fixed)
    beta = (inverse.T @ (inverse @ (train.xy[columns] / scale)))[first:].reshape(-1, 2, 1)
    # 2 x 2 blocks on the diagonal of the normal matrix' inverse
    pairs = inverse[:, first:].reshape(len(columns), -1, 2)
    covariance = np.einsum("rni,rnj->nij", pairs, pairs)
    statistic = (beta * np.linalg.solve(covariance, beta)).sum(axis=(1, 2))
    return np.argsort(-statistic)


def _path(
    train: Normal, test: Normal, fixed: list[int], layout: ColumnLayout, ranking: IntArray
) -> FloatArray:
    """Return the mean squared (weighted) error on held-back rows with 0, 1, ... orders."""
    most = min(_MOST, ranking.size)
    columns = fixed + [c for i in ranking[:most] for c in layout.order(int(i))]
    lower, scale = _factor(train, columns)
    solved = scipy.linalg.solve_triangular(lower, train.xy[columns] / scale, lower=True)
    errors = np.zeros(most + 1)
    for size in range(most + 1):
        k = len(fixed) + 2 * size
        beta = scipy.linalg.solve_triangular(lower[:k, :k], solved[:k], lower=True, trans=1)
        errors[size] = squared_error(test, columns[:k], beta / scale[:k]) / test.rows
    return errors
