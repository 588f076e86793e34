"""Bundle adjustment: fit the map, the camera's poses and, on request, the lens to all corners.

The method is that of Levenberg and Marquardt, on normal equations from which the poses are
eliminated. Corners have Cauchy's weight w = 1/(1 + (r/c)²). Its width c follows the spread of the
residuals as they shrink.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, orth
from scipy.sparse import csr_array

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray, rms
from cdpr_rt.calibration.camera_geometry import (
    cross_matrices,
    exponentials,
    project,
    project_with_derivatives,
)
from cdpr_rt.calibration.marker_map import MarkerMap, SeenMarkers
from cdpr_rt.errors import ControlError

# Expected corners in images. Cameras and markers change like poses of the platform:
# (position + x_p, exp(x_φ) rotation), both along the axes of the map.

LENS_PARAMETERS = 9
_NEAR_m = 1e-3


@dataclass(frozen=True)
class CornerTerms:
    """n markers in images: residuals of their corners, and blocks of derivatives."""

    residual: FloatArray
    """Expected minus seen corners, to the right and down, (n, 8)."""
    by_pose: FloatArray
    """Derivatives by the pose of the camera, or of the platform that carries it, (n, 8, 6)."""
    by_shared: FloatArray
    """Derivatives by parameters that all images share, such as the lens, (n, 8, C)."""
    by_marker: FloatArray
    """Derivatives by the pose of the marker, (n, 8, 6)."""


@dataclass(frozen=True)
class Views:
    """n markers of a map and the cameras that see them; a row is one marker in one image."""

    corners_m: FloatArray
    """Corners in the marker's frame, (n, 4, 3)."""
    corners_px: FloatArray
    """(n, 4, 2)."""
    marker_position_m: FloatArray
    marker_rotation: FloatArray
    camera_position_m: FloatArray
    camera_rotation: FloatArray

    def _points(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return corners (n, 4, 3) from marker centres, from cameras, and in camera frames."""
        turned = self.corners_m @ self.marker_rotation.transpose(0, 2, 1)
        away = turned + (self.marker_position_m - self.camera_position_m)[:, None]
        return turned, away, away @ self.camera_rotation

    def off_px(self, lens: FloatArray) -> FloatArray:
        """Return expected minus seen corners, (n, 4, 2); inf behind the camera."""
        flat = self._points()[2].reshape(-1, 3)
        behind = flat[:, 2] < _NEAR_m
        safe = np.where(behind[:, None], (0.0, 0.0, 1.0), flat)
        expected = np.where(behind[:, None], np.inf, project(safe, lens))
        return expected.reshape(-1, 4, 2) - self.corners_px

    def terms(self, lens: FloatArray) -> CornerTerms:
        """Return the terms in px; shared parameters are the lens (9) and the sheets' size (1)."""
        n = len(self.corners_px)
        turned, away, points = self._points()
        expected, by_point, by_lens = project_with_derivatives(points.reshape(-1, 3), lens)
        to_camera = self.camera_rotation.transpose(0, 2, 1)
        by_room = by_point.reshape(n, 4, 2, 3) @ to_camera[:, None]
        by_size = by_room @ turned[..., None]
        by_camera = np.concatenate([-by_room, by_room @ cross_matrices(away)], axis=3)
        by_marker = np.concatenate([by_room, -by_room @ cross_matrices(turned)], axis=3)
        shared = [by_lens.reshape(n, 8, LENS_PARAMETERS), by_size.reshape(n, 8, 1)]
        return CornerTerms(
            (expected.reshape(n, 4, 2) - self.corners_px).reshape(n, 8),
            by_camera.reshape(n, 8, 6),
            np.concatenate(shared, axis=2),
            by_marker.reshape(n, 8, 6),
        )


# Normal equations in blocks of parameters and poses. Each pose is coupled only to itself, so poses
# are eliminated: S = H - Σ E_j C_j^-1 E_j^T (Schur).

_WEAK, _SINGULAR = 1e-6, 1e-10


@dataclass(frozen=True)
class PoseBlocks:
    """Normal equations of P parameters and N poses of d directions."""

    H: FloatArray
    """Block of the parameters, (P, P)."""
    E: FloatArray
    """Blocks that couple the parameters and each pose, (N, P, d)."""
    C: FloatArray
    """Block of each pose, (N, d, d)."""
    by_parameter: FloatArray
    """Gradients, (P,) and (N, d)."""
    by_pose: FloatArray

    def only(self, parameters: IntArray) -> PoseBlocks:
        """Return the equations of some of the parameters, with all others fixed."""
        H = self.H[np.ix_(parameters, parameters)]
        return replace(
            self, H=H, E=self.E[:, parameters], by_parameter=self.by_parameter[parameters]
        )

    def pose_covariance(self, damping: float = 0.0) -> FloatArray:
        """Return C^-1 of each pose, (N, d, d); 0 in directions that no row determines."""
        C, d = self.C.copy(), self.C.shape[1]
        if damping > 0.0:
            diagonal = C[:, range(d), range(d)]
            level = np.maximum(diagonal, _WEAK * (1.0 + diagonal.max()))
            C[:, range(d), range(d)] += damping * level
            return np.asarray(np.linalg.inv(C))
        return np.asarray(np.linalg.pinv(C, rcond=_SINGULAR, hermitian=True))

    def reduced(self, damping: float = 0.0) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return S (P, P), E C^-1 and C^-1."""
        inverse = self.pose_covariance(damping)
        EC = self.E @ inverse
        S = self.H - np.tensordot(EC, self.E, axes=([0, 2], [0, 2]))
        P = len(S)
        S[range(P), range(P)] += damping * np.diag(self.H)
        return S, EC, inverse

    def step(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """Return the changes of parameters (P,), 0 if undetermined, and of poses (N, d)."""
        S, EC, inverse = self.reduced(damping)
        right = -self.by_parameter + np.einsum("jpd,jd->p", EC, self.by_pose)
        try:
            change = cho_solve(cho_factor(S), right) if len(S) else right
        except LinAlgError:
            change = np.zeros(len(S))
        moves = -(self.by_pose + np.einsum("jpd,p->jd", self.E, change))
        return change, np.einsum("jde,je->jd", inverse, moves)


def corner_blocks(
    seen: SeenMarkers, terms: CornerTerms, weights: FloatArray, poses: int
) -> PoseBlocks:
    """Return Σ J^T w J and Σ J^T w r; each marker in an image contributes to few blocks only.

    The parameters are the shared ones, then 6 of each marker.
    """
    root = np.repeat(np.sqrt(weights), 2, axis=1)[..., None]
    J = np.concatenate([terms.by_pose, terms.by_shared, terms.by_marker], axis=2) * root
    JT = np.swapaxes(J, 1, 2)
    G, g = JT @ J, (JT @ (terms.residual[..., None] * root))[..., 0]
    markers, shared = len(seen.ids), terms.by_shared.shape[2]
    size, last = shared + 6 * markers, 6 + shared
    H, E, gradient = np.zeros((size, size)), np.zeros((poses, size, 6)), np.zeros(size)
    E[:, :shared] = _sum(seen.image, poses, G[:, 6:last, :6])
    of_markers = E[:, shared:].reshape(poses, markers, 6, 6)
    of_markers[seen.image, seen.marker] = G[:, last:, :6]
    across = _sum(seen.marker, markers, G[:, last:, 6:])
    H[:shared, :shared] = G[:, 6:last, 6:last].sum(axis=0)
    H[shared:, :shared] = across[..., :shared].reshape(-1, shared)
    H[:shared, shared:] = H[shared:, :shared].T
    own, each = H[shared:, shared:].reshape(markers, 6, markers, 6), np.arange(markers)
    own[each, :, each] = across[..., shared:]
    gradient[:shared] = g[:, 6:last].sum(axis=0)
    gradient[shared:] = _sum(seen.marker, markers, g[:, last:]).ravel()
    C, by_pose = _sum(seen.image, poses, G[:, :6, :6]), _sum(seen.image, poses, g[:, :6])
    return PoseBlocks(H, E, C, gradient, by_pose)


def _sum(number: IntArray, count: int, blocks: FloatArray) -> FloatArray:
    """Return the sums (count, ...) of blocks (n, ...) that have the same `number`."""
    n = len(number)
    picks: Any = csr_array((np.ones(n), (number, np.arange(n))), shape=(count, n))
    return np.asarray(picks @ blocks.reshape(n, -1)).reshape(count, *blocks.shape[1:])


@dataclass(frozen=True)
class Estimate:
    """A map and the lens of the camera that sees it."""

    map: MarkerMap
    lens: FloatArray

    @property
    def parameters(self) -> int:
        """Number of parameters without the camera's poses: 9 for the lens, 6 for each marker."""
        return LENS_PARAMETERS + 6 * len(self.map.ids)

    def changed(self, step: FloatArray, moves: FloatArray | None = None) -> Estimate:
        """Return the estimate with changes `step` (parameters,) and moves of poses (k, 6)."""
        marker = step[LENS_PARAMETERS:].reshape(-1, 6)
        moved = replace(
            self.map,
            position_m=self.map.position_m + marker[:, :3],
            rotation=exponentials(marker[:, 3:]) @ self.map.rotation,
        )
        if moves is not None:
            moved = replace(
                moved,
                camera_position_m=self.map.camera_position_m + moves[:, :3],
                camera_rotation=exponentials(moves[:, 3:]) @ self.map.camera_rotation,
            )
        return Estimate(moved, self.lens + step[:LENS_PARAMETERS])

    def views(self, seen: SeenMarkers) -> Views:
        """Return the expected views of `seen`."""
        map_ = self.map
        return Views(
            seen.corners_m,
            seen.corners_px,
            map_.position_m[seen.marker],
            map_.rotation[seen.marker],
            map_.camera_position_m[seen.image],
            map_.camera_rotation[seen.image],
        )

    def off_px(self, seen: SeenMarkers) -> FloatArray:
        """Return `Views.off_px`."""
        return self.views(seen).off_px(self.lens)


# Errors of printed sheets, relative to squares of their nominal size, and a map's covariance with
# these errors. Noise differs in each image, but the errors of a sheet (scale of the printer, paper
# that is not flat) are the same in all images. They do not average out, so a covariance that treats
# them as noise is too small.

_SEEN_SHARE, _NOISE_SHARE = 8.0 / 2.0, 5.0 / 2.0
"""The errors of a sheet have 8 coordinates at 4 corners. If all images are from about one
direction, its pose absorbs 6 of them. From many directions it absorbs only 3: position and rotation
in the plane. The first number is used to estimate the size of the errors, the second to estimate
the share of noise alone, so that both estimates are on the high side."""
_SIGMAS = 3.0


@dataclass(frozen=True)
class SheetErrors:
    """Common part of the corners' residuals over images, on their sheets."""

    sigma_m: float
    """Standard deviation of a coordinate of a corner on its sheet; 0 if not significant."""
    inflation: float
    """Ratio of the covariance to the one due to noise alone: 1 + (n - 1) r for markers that are
    seen in n images, with the correlation r of a corner's residuals (design effect)."""


def sheet_errors(estimate: Estimate, seen: SeenMarkers, weight: FloatArray) -> SheetErrors:
    """Return the sheets' errors by an analysis of variance; `weight` (n, 4) is that of the fit.

    With n images of a marker, the mean squares between corners and within them are at most (n s² +
    2.5 v) / 4 and v. Here s² is the variance of the sheets and v that of the noise.
    """
    terms, n = estimate.views(seen).terms(estimate.lens), len(seen)
    by_place = terms.by_marker[..., :3].reshape(n, 4, 2, 3)
    on_sheet = by_place @ estimate.map.rotation[seen.marker][:, None, :, :2]
    shift = np.linalg.solve(on_sheet, terms.residual.reshape(n, 4, 2, 1))[..., 0]
    shift = np.where((weight > 0.5)[..., None], shift, 0.0)
    between, within, freedom, markers, images = 0.0, 0.0, 0, 0, []
    for marker in np.unique(seen.marker):
        own = shift[seen.marker == marker]
        if len(own) < 2:
            continue
        mean = own.mean(axis=0)
        between += len(own) * float((mean**2).sum())
        within += float(((own - mean) ** 2).sum())
        freedom += 8 * (len(own) - 1)
        markers += 1
        images.append(len(own))
    if not freedom or within == 0.0:
        return SheetErrors(0.0, 1.0)
    noise, common = within / freedom, _SEEN_SHARE * between / (8 * markers)
    chance = _SIGMAS * np.sqrt(2.0 / (5.0 * markers))
    if common / noise < _NOISE_SHARE * (1.0 + chance):
        return SheetErrors(0.0, 1.0)
    count = float(np.mean(images))
    variance = (common - _NOISE_SHARE * noise) / count
    share = variance / (variance + noise)
    return SheetErrors(float(np.sqrt(variance)), 1.0 + (count - 1.0) * share)


_STEPS = 60
_END = 1e-7
"""Relative decrease of the cost that ends the search."""
_LEAST_SIGMA_px = 0.02
_WIDTH = 3.0
"""Width of the loss, in standard deviations."""
_LOSS_BIAS = 0.926
"""Ratio of the weighted standard deviation to the true one, for normal residuals: (9 (1 - w) / 2
w)^½ with the mean weight w = 4.5 e^4.5 E1(4.5) = 0.840. The standard deviations of the estimates
need no such factor: with the weights in the normal matrix they are right within 2 %."""
_MOST_DAMPING = 1e10
NORMAL_MEDIAN = 1.1774
"""Median length of a vector of two normal variables with standard deviation 1."""


class BundleError(ControlError):
    """The images do not determine a map; the message says what is missing."""


@dataclass(frozen=True)
class Bundle:
    """Result of the bundle adjustment."""

    estimate: Estimate
    off_px: FloatArray
    """Distance of each corner from its prediction, (n, 4)."""
    weight: FloatArray
    """Weight of each corner in the fit, (n, 4); 1 for a corner that fits."""
    sigma_px: float
    """Standard deviation of a coordinate of a corner, from the weighted residuals."""
    covariance: FloatArray
    """Covariance of the parameters of the estimate, (p, p), 0 for fixed ones."""
    sheets: SheetErrors
    """Errors of the sheets; the covariance includes them."""

    @property
    def rms_px(self) -> float:
        """Root of the mean square distance of corners that fit."""
        return rms(self.off_px[self.weight > 0.5])

    @property
    def marker_covariance_m2(self) -> FloatArray:
        """Covariances of each marker's position along the map's axes, (m, 3, 3)."""
        m = len(self.estimate.map.ids)
        blocks = self.covariance[LENS_PARAMETERS:, LENS_PARAMETERS:].reshape(m, 6, m, 6)
        return np.asarray(blocks[np.arange(m), :3, np.arange(m), :3])

    @property
    def marker_sigma_m(self) -> FloatArray:
        """Standard deviations of the markers' positions along the map's axes, (m, 3)."""
        return np.sqrt(np.diagonal(self.marker_covariance_m2, axis1=1, axis2=2))

    @property
    def shape_sigma_m(self) -> FloatArray:
        """`relative_std` of the markers' positions, (m, 3); nan for markers without a place."""
        map_ = self.estimate.map
        placed = np.flatnonzero(map_.placed)
        rows = (LENS_PARAMETERS + 6 * placed[:, None] + np.arange(3)).ravel()
        sigma = np.full((len(map_.ids), 3), np.nan)
        sigma[placed] = relative_std(map_.position_m[placed], self.covariance[np.ix_(rows, rows)])
        return sigma


def relative_std(places_m: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the standard deviations of positions, (m, 3), in the frame that fits all best.

    They belong to the part of the covariance C that no rigid motion explains: P C P with P = 1 - G
    (G^T G)^-1 G^T, where G are the derivatives of the positions by the six rigid motions. In the
    frame of a single marker, the uncertain tilt of its sheet would add errors in proportion to the
    distance.
    """
    unit = np.broadcast_to(np.eye(3), (len(places_m), 3, 3))
    turns = -cross_matrices(places_m - places_m.mean(axis=0))
    Q = orth(np.concatenate([unit, turns], axis=2).reshape(-1, 6))
    P = np.eye(len(Q)) - Q @ Q.T
    return np.sqrt(np.maximum(np.diag(P @ covariance @ P), 0.0)).reshape(-1, 3)


def adjust(
    start: Estimate, seen: SeenMarkers, fixed: tuple[int, ...], *, free_lens: bool = False
) -> Bundle:
    """Return the best fit from `start`; the markers with ids `fixed` do not move and fix the gauge.

    Raises BundleError if no marker is fixed, or if the images do not determine the rest.
    """
    usable = start.map.placed[seen.marker] & start.map.located[seen.image]
    # the fit cannot move a marker from behind the camera to its front
    before_camera = np.isfinite(start.off_px(seen.keep(usable))).all(axis=(1, 2))
    usable[usable] = before_camera
    used = seen.keep(usable)
    free = _free_parameters(start, used, fixed, free_lens)
    now, damping = start, 1e-4
    off = now.off_px(used)
    sigma = _spread(off)
    cost = cauchy_cost(off, sigma)
    for _ in range(_STEPS):
        blocks, before = _blocks(now, used, free, sigma), cost
        while damping < _MOST_DAMPING:
            step = np.zeros(now.parameters)
            step[free], moves = blocks.step(damping)
            trial = now.changed(step, moves)
            trial_off = trial.off_px(used)
            if (trial_cost := cauchy_cost(trial_off, sigma)) < cost:
                now, off, cost, damping = trial, trial_off, trial_cost, max(damping / 10.0, 1e-12)
                break
            damping *= 10.0
        small = _spread(off)
        shrinking = small < 0.98 * sigma
        if not shrinking and before - cost < _END * before:
            break
        if shrinking:
            sigma, cost = small, cauchy_cost(off, small)
        damping = min(damping, 1e3)
    return _finish(now, off, seen, used, usable, free)


def _free_parameters(
    start: Estimate, used: SeenMarkers, fixed: tuple[int, ...], free_lens: bool
) -> IntArray:
    """Return which parameters are free; raises BundleError if no fixed marker is in use."""
    held = [start.map.ids.index(marker) for marker in fixed]
    if not held or not len(used):
        raise BundleError("no image shows a marker whose place is known")
    free = np.zeros(start.parameters, bool)
    free[:LENS_PARAMETERS] = free_lens
    of_markers = free[LENS_PARAMETERS:].reshape(-1, 6)
    of_markers[used.marker], of_markers[held] = True, False
    return np.flatnonzero(free)


def _spread(off: FloatArray) -> float:
    """Return the standard deviation of a coordinate from the median of the distances."""
    distance = np.linalg.norm(off, axis=-1)
    return max(float(np.median(distance)) / NORMAL_MEDIAN, _LEAST_SIGMA_px)


def cauchy_weights(off: FloatArray, sigma: float) -> FloatArray:
    """Return the weight (n, 4) of each corner for residuals (n, 4, 2) with deviation `sigma`."""
    return np.asarray(1.0 / (1.0 + (off**2).sum(axis=-1) / (_WIDTH * sigma) ** 2))


def cauchy_cost(off: FloatArray, sigma: float) -> float:
    """Return the robust sum of squares, Σ c² log(1 + (r/c)²) with c = 3 `sigma`."""
    squares = (off**2).sum(axis=-1) / (_WIDTH * sigma) ** 2
    if not np.isfinite(squares).all():
        return float("inf")
    return float(np.log1p(squares).sum()) * (_WIDTH * sigma) ** 2


def _blocks(now: Estimate, used: SeenMarkers, free: IntArray, sigma: float) -> PoseBlocks:
    terms = now.views(used).terms(now.lens)
    terms = replace(terms, by_shared=terms.by_shared[..., :LENS_PARAMETERS])
    weights = cauchy_weights(terms.residual.reshape(-1, 4, 2), sigma)
    return corner_blocks(used, terms, weights, len(used.names)).only(free)


def _finish(
    now: Estimate,
    off: FloatArray,
    seen: SeenMarkers,
    used: SeenMarkers,
    usable: BoolArray,
    free: IntArray,
) -> Bundle:
    sigma = _spread(off)
    weights = cauchy_weights(off, sigma)
    unknowns = len(free) + 6 * len(np.unique(used.image))
    variance = float((weights[..., None] * off**2).sum())
    variance /= max(2.0 * float(weights.sum()) - unknowns, 1.0)
    S = _blocks(now, used, free, sigma).reduced()[0]
    root = np.sqrt(np.maximum(np.diag(S), 1e-12))
    try:
        inverse = cho_solve(cho_factor(S / np.outer(root, root)), np.diag(1.0 / root)).T / root
    except LinAlgError:
        raise BundleError(
            "the images do not determine the place of every marker and of the camera"
        ) from None
    sheets = sheet_errors(now, used, weights)
    covariance = np.zeros((now.parameters, now.parameters))
    covariance[np.ix_(free, free)] = sheets.inflation * variance * inverse
    distance, weight = np.full((len(seen), 4), np.nan), np.zeros((len(seen), 4))
    distance[usable], weight[usable] = np.linalg.norm(off, axis=-1), weights
    return Bundle(now, distance, weight, float(np.sqrt(variance)) / _LOSS_BIAS, covariance, sheets)
