"""Bundle adjustment: the map, the camera's poses and, where asked, the lens that fit all corners.

Levenberg's and Marquardt's method on the normal equations, which the sparse Jacobian makes cheap:
100 images with 40 markers are 840 unknowns. Corners that do not fit lose weight w = 1/(1 + (r/c)²),
Cauchy's, of which the width c follows the spread of the residuals as they shrink.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import diags_array

from cdpr_rt.arrays import FloatArray, IntArray, rms
from cdpr_rt.calibration.markers.geometry.rotations import cross_matrices
from cdpr_rt.calibration.markers.reprojection import (
    LENS_PARAMETERS,
    Estimate,
    residuals,
    residuals_and_jacobian,
)
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers
from cdpr_rt.calibration.markers.sheet_errors import SheetErrors, sheet_errors
from cdpr_rt.errors import ControlError

_STEPS = 60
_END = 1e-7
"""Relative fall of the cost that is none any more."""
_LEAST_SIGMA_px = 0.02
_WIDTH = 3.0
"""Width of the loss, in standard deviations."""
_LOSS_BIAS = 0.926
"""Weighted standard deviation over the true one, of normal residuals: (9 (1 - w) / 2 w)^½ with the
mean weight w = 4.5 e^4.5 E1(4.5) = 0.840. That of the estimates, with weights in the normal matrix,
is within 2 % without it."""
_MOST_DAMPING = 1e10
_NORMAL_MEDIAN = 1.1774
"""Median of the length of a vector of two normal numbers of deviation 1."""


class BundleError(ControlError):
    """The images do not determine a map; the message says what is missing."""


@dataclass(frozen=True)
class Bundle:
    """Result of the bundle adjustment."""

    estimate: Estimate
    off_px: FloatArray
    """Distance of each corner from its prediction, (n, 4)."""
    weight: FloatArray
    """Weight of each corner in the fit, (n, 4), 1 for one that fits."""
    sigma_px: float
    """Standard deviation of a coordinate of a corner, from the weighted residuals."""
    covariance: FloatArray
    """Covariance of all parameters (p, p) in the order of `reprojection`, 0 for fixed ones."""
    sheets: SheetErrors
    """Errors of the sheets themselves, which the covariance contains."""
    steps: int

    @property
    def rms_px(self) -> float:
        """Root of the mean square distance of corners that fit."""
        return rms(self.off_px[self.weight > 0.5])

    @property
    def marker_sigma_m(self) -> FloatArray:
        """Standard deviations of the markers' positions along the map's axes, (m, 3)."""
        start = 6 * len(self.estimate.map.names)
        variance = np.diag(self.covariance)[start : start + 6 * len(self.estimate.map.ids)]
        return np.sqrt(variance.reshape(-1, 6)[:, :3])

    @property
    def shape_sigma_m(self) -> FloatArray:
        """Standard deviations of the markers' positions, (m, 3), in the frame that fits all best.

        What is left of their covariance C once the map may move and turn as a whole: P C P with
        P = 1 - G (G^T G)^-1 G^T, G the positions' derivatives by the six rigid motions. That of
        one marker's frame has in it how badly one sheet tells its own tilt, times the distance.
        """
        placed = np.flatnonzero(self.estimate.map.placed)
        at = self.estimate.map.position_m[placed]
        start = 6 * len(self.estimate.map.names)
        rows = (start + 6 * placed[:, None] + np.arange(3)).ravel()
        unit = np.broadcast_to(np.eye(3), (len(at), 3, 3))
        G = np.concatenate([unit, -cross_matrices(at - at.mean(axis=0))], axis=2).reshape(-1, 6)
        Q, _ = np.linalg.qr(G)
        P = np.eye(len(rows)) - Q @ Q.T
        sigma = np.full((len(self.estimate.map.ids), 3), np.nan)
        left = P @ self.covariance[np.ix_(rows, rows)] @ P
        sigma[placed] = np.sqrt(np.maximum(np.diag(left), 0.0)).reshape(-1, 3)
        return sigma


def adjust(
    start: Estimate, seen: SeenMarkers, fixed: tuple[int, ...], *, free_lens: bool = False
) -> Bundle:
    """Return the best fit from `start` with the markers `fixed`, ids, held: they are the gauge.

    Raises BundleError where nothing is fixed, or what was seen does not determine the rest.
    """
    usable = start.map.placed[seen.marker] & start.map.located[seen.image]
    # a marker that the first map has behind the camera cannot find its way to the front
    before_camera = np.isfinite(residuals(start, seen.keep(usable))).all(axis=(1, 2))
    usable[usable] = before_camera
    used = seen.keep(usable)
    free = _free_parameters(start, used, fixed, free_lens)
    cameras = len(np.unique(used.image))
    now, damping = start, 1e-4
    sigma = _spread(residuals(now, used))
    cost = _cost(residuals(now, used), sigma)
    steps = 0
    for steps in range(1, _STEPS + 1):  # noqa: B007 - is told
        normal, gradient, scale = _normal_equations(now, used, free, sigma)
        before = cost
        while damping < _MOST_DAMPING:
            step = np.zeros(now.parameters)
            damped = normal + damping * np.diag(scale)
            step[free] = _solve(damped, -gradient[:, None], cameras)[:, 0]
            trial = now.changed(step)
            trial_cost = _cost(residuals(trial, used), sigma)
            if trial_cost < cost:
                now, cost, damping = trial, trial_cost, max(damping / 10.0, 1e-12)
                break
            damping *= 10.0
        small = _spread(residuals(now, used))
        shrinking = small < 0.98 * sigma
        if not shrinking and before - cost < _END * before:
            break
        if shrinking:
            sigma, cost = small, _cost(residuals(now, used), small)
        damping = min(damping, 1e3)
    return _finish(now, seen, used, usable, free, steps)


def _free_parameters(
    start: Estimate, used: SeenMarkers, fixed: tuple[int, ...], free_lens: bool
) -> IntArray:
    k = len(start.map.names)
    held = [start.map.ids.index(marker) for marker in fixed]
    markers = [i for i in np.unique(used.marker) if i not in held]
    blocks = [*np.unique(used.image), *(k + i for i in markers)]
    if not held or not len(used):
        raise BundleError("no image shows a marker whose place is known")
    free = [6 * block + i for block in blocks for i in range(6)]
    if free_lens:
        free += range(start.parameters - LENS_PARAMETERS, start.parameters)
    return np.array(free)


def _spread(off: FloatArray) -> float:
    """Return the standard deviation of a coordinate, by the median of the distances."""
    distance = np.linalg.norm(off, axis=-1)
    return max(float(np.median(distance)) / _NORMAL_MEDIAN, _LEAST_SIGMA_px)


def _weights(off: FloatArray, sigma: float) -> FloatArray:
    """Return the weight of each corner, (n, 4), of residuals (n, 4, 2)."""
    return np.asarray(1.0 / (1.0 + (off**2).sum(axis=-1) / (_WIDTH * sigma) ** 2))


def _cost(off: FloatArray, sigma: float) -> float:
    squares = (off**2).sum(axis=-1) / (_WIDTH * sigma) ** 2
    return float(np.log1p(squares).sum()) if np.isfinite(squares).all() else float("inf")


def _normal_equations(
    now: Estimate, used: SeenMarkers, free: IntArray, sigma: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    off, jacobian = residuals_and_jacobian(now, used)
    weight = np.repeat(_weights(off.reshape(-1, 4, 2), sigma).ravel(), 2)
    weighted = jacobian.T @ diags_array(weight)
    normal = (weighted @ jacobian).toarray()[np.ix_(free, free)]
    return normal, (weighted @ off)[free], np.maximum(np.diag(normal), 1e-12)


def _solve(normal: FloatArray, right: FloatArray, cameras: int) -> FloatArray:
    """Return normal^-1 right, by the Schur complement of the first 6 `cameras` unknowns.

    These come in blocks of 6 that know nothing of each other. 0 where there is no inverse.
    """
    end = 6 * cameras
    each = np.arange(cameras)
    blocks = normal[:end, :end].reshape(cameras, 6, cameras, 6)[each, :, each]
    across, columns = normal[:end, end:], right.shape[1]
    try:
        both = np.concatenate([across, right[:end]], axis=1).reshape(cameras, 6, -1)
        solved = np.linalg.solve(blocks, both).reshape(end, -1)
        by_across, by_right = solved[:, : across.shape[1]], solved[:, across.shape[1] :]
        rest = cho_factor(normal[end:, end:] - across.T @ by_across)
    except (LinAlgError, ValueError):
        return np.zeros_like(right)
    others = cho_solve(rest, right[end:] - across.T @ by_right)
    first = by_right - by_across @ others
    return np.concatenate([first, others]).reshape(-1, columns)


def _finish(
    now: Estimate,
    seen: SeenMarkers,
    used: SeenMarkers,
    usable: np.ndarray[tuple[int], np.dtype[np.bool_]],
    free: IntArray,
    steps: int,
) -> Bundle:
    off = residuals(now, used)
    sigma = _spread(off)
    weights = _weights(off, sigma)
    normal, _, scale = _normal_equations(now, used, free, sigma)
    freedom = max(2.0 * float(weights.sum()) - len(free), 1.0)
    variance = float((weights[..., None] * off**2).sum()) / freedom
    root = np.sqrt(scale)
    covariance = np.zeros((now.parameters, now.parameters))
    inverse = _solve(normal / np.outer(root, root), np.eye(len(free)), len(np.unique(used.image)))
    if not inverse.any():
        raise BundleError("what the images show leaves open where a marker or the camera is")
    sheets = sheet_errors(now, used, weights)
    covariance[np.ix_(free, free)] = sheets.inflation * variance * inverse / np.outer(root, root)
    distance, weight = np.full((len(seen), 4), np.nan), np.zeros((len(seen), 4))
    distance[usable], weight[usable] = np.linalg.norm(off, axis=-1), weights
    return Bundle(
        now, distance, weight, float(np.sqrt(variance)) / _LOSS_BIAS, covariance, sheets, steps
    )
