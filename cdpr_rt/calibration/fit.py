"""Fit all observations together by nonlinear least squares, with the poses eliminated."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import expit

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.camera_model import (
    CameraModel,
    corner_cost,
    corner_residuals,
    corner_terms,
)
from cdpr_rt.calibration.marker_bundle import (
    NORMAL_MEDIAN,
    PoseBlocks,
    cauchy_weights,
    corner_blocks,
)
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.calibration.residuals import Linearised, length_std_m, linearise
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.model.cable_kernel import CABLE_ROWS, run_poses
from cdpr_rt.model.rigid_body import G_m_s2

_UNIT = 0.05
"""Unit of the size of a parameter's change: its prior deviation, but at most this, m and rad."""


class NormalEquations:
    """Normal equations of rows of poses and corners of markers, in units of prior deviations."""

    def __init__(
        self,
        at: Linearised,
        known_std: FloatArray,
        prior: FloatArray,
        corners: PoseBlocks | None,
        free: tuple[int, ...],
        taken_out: FloatArray,
    ) -> None:
        """Take rows of poses, whose parameters come first, and corners, with P parameters in total.

        `taken_out` (P,) is the spurious information about single parameters, to be subtracted.
        """
        size, first = known_std.size, at.by_parameter.shape[2]
        self._scale = known_std
        scaled = at.by_parameter * known_std[:first]
        turned, across = np.swapaxes(scaled, 1, 2), np.swapaxes(at.by_pose, 1, 2)
        # products per pose are so small that BLAS starts no threads; threads would cost more than
        # they gain
        H, E = np.eye(size), np.zeros((len(at.by_pose), size, len(free)))
        gradient, C = prior.copy(), across @ at.by_pose
        by_pose = (across @ at.residual[..., None])[..., 0]
        H[:first, :first] += (turned @ scaled).sum(axis=0)
        E[:, :first] = turned @ at.by_pose
        gradient[:first] += (turned @ at.residual[..., None]).sum(axis=0)[:, 0]
        if corners is not None:
            own, chosen = known_std[first:], list(free)
            C += corners.C[:, chosen][:, :, chosen]
            by_pose += corners.by_pose[:, chosen]
            H[first:, first:] += corners.H * np.outer(own, own)
            E[:, first:] = corners.E[:, :, chosen] * own[:, None]
            gradient[first:] += corners.by_parameter * own
        H[range(size), range(size)] -= taken_out * known_std**2
        self._blocks = PoseBlocks(H, E, C, gradient, by_pose)

    def solve(self, damping: float) -> tuple[FloatArray, FloatArray, float]:
        """Return changes of parameters (P,), of poses (N, d), and their size.

        The size of a parameter's change is relative to its prior deviation, or to 0.05 m and rad if
        that is less.
        """
        y, moves = self._blocks.step(damping)
        spread = np.sqrt(np.einsum("jd,jde,je->j", moves, self._blocks.C, moves))
        change = y * self._scale
        large = np.abs(change) / np.minimum(self._scale, _UNIT)
        size = max(float(large.max(initial=0.0)), float(spread.max(initial=0.0)) * 0.01)
        return change, moves, size

    def covariance(self) -> tuple[FloatArray, float]:
        """Return the covariance of parameters, (P, P), and how many are determined."""
        size = self._scale.size
        if size == 0:
            return np.zeros((0, 0)), 0.0
        inverse = np.linalg.inv(self._blocks.reduced()[0])
        both = 0.5 * (inverse + inverse.T)
        determined = float(size - np.trace(both))
        return np.asarray(both * np.outer(self._scale, self._scale)), determined

    def left_of(self, at: Linearised) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return derivatives of rows by the parameters after elimination of the poses, (N, R, P).

        Also returns J_x C^-1, (N, R, d), and C^-1, (N, d, d).
        """
        inverse = self._blocks.pose_covariance()
        taken = at.by_pose @ inverse
        left = -(taken @ np.swapaxes(self._blocks.E / self._scale[:, None], 1, 2))
        left[..., : at.by_parameter.shape[2]] += at.by_parameter
        return left, taken, inverse


# Effect of noisy tensions on a fit: they correlate the lengths of a pose, and bias the elongation.
# A cable stretches by l c (1 + κ) t, so an error e of the tension causes the error (1 + κ) A e of
# the weighted length, A = l c / σ. The derivative by κ is A t, for which the fit uses A (t + e). So
# the part n = Σ_j tr((1 - H_j) S_j) of the information I about κ is spurious, with S_j = A_j
# Cov(e_j) A_j and the hat matrix H of all unknowns. If true tensions scatter about given ones, such
# as a controller's set-points, 1 + κ is unbiased (Berkson). If given tensions scatter about true
# ones, the fit finds (1 + κ) (I - n) / I (Fuller, Measurement Error Models, 1.1). It is unknown
# which case applies. Both are weighted by how well their elongation agrees with the file. The term
# -q (1 + κ)² in the cost, which subtracts q from I, makes the fit find the weighted mean. The
# standard deviation of the two cases is predicted in addition to noise.

_MOST_SHARE = 0.9
"""Largest share of the information about the elongation that is subtracted as spurious."""


def slope_covariance(geometry: CableGeometry, seen: Observations) -> FloatArray:
    """Return S (N, n, n), the covariance of weighted lengths due to errors of the tensions."""
    soft = geometry.knowledge.tension_N * seen.length_m * geometry.compliance_1_N
    A = seen.used * soft / length_std_m(geometry, seen)
    free = np.eye(geometry.n) if seen.tension_free is None else seen.tension_free
    return np.asarray(A[:, :, None] * free * A[:, None])


def correlated(left: FloatArray, noise: FloatArray, yielding: float) -> FloatArray:
    """Return the variance of the gradient due to correlated errors of rows, (P, P).

    `left` (N, n, P) are derivatives by the parameters after elimination of the poses; `noise` is S.
    """
    across = noise * (1.0 - np.eye(noise.shape[1]))
    return np.asarray(yielding**2 * np.einsum("jap,jab,jbq->pq", left, across, left, optimize=True))


def most_taken_out(wanted: float, information: float) -> float:
    """Return how much may be subtracted from the information I about κ, so that enough is left."""
    return min(wanted, _MOST_SHARE * information)


def mean_of_cases(
    elongation: float, known_std: float, spurious: float, information: float, taken_out: float
) -> tuple[float, float]:
    """Return q for which the fit finds the weighted mean of both cases, and the rms error of κ.

    κ was found with q `taken_out`; `spurious` is n, `information` I.
    """
    by_set = (1.0 + elongation) * (information - taken_out) / information
    by_true = by_set * information / (information - spurious)
    less_likely = ((by_true - 1.0) ** 2 - (by_set - 1.0) ** 2) / (2.0 * known_std**2)
    share = float(expit(-less_likely))
    mean = information - spurious + share * spurious
    one, other = 1.0 + elongation - by_set, 1.0 + elongation - by_true
    off = math.sqrt((1.0 - share) * one**2 + share * other**2)
    return information * share * spurious / mean, off


def without(covariance: FloatArray, k: int, taken_out: float) -> FloatArray:
    """Return the covariance (P, P) after subtracting this information about parameter k."""
    own = covariance[:, k]
    return np.asarray(
        covariance + np.outer(own, own) * (taken_out / (1.0 - taken_out * covariance[k, k]))
    )


_MOST_STEPS = 60
_DONE = 1e-4
"""The search ends if the largest step, over the parameter's standard deviation, is below this."""
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e-13, 1e8
_HUBER = 2.5
"""Residual, in standard deviations, above which a length or measured point gets less weight
(Huber's loss)."""
JUMP_STD_m = 1.0
"""Prior standard deviation of the size of a jump."""
_NO_MORE = 1e-12
"""Relative increase of the cost that counts as no increase."""


@dataclass(frozen=True)
class Fit:
    """An identified geometry with the poses that belong to it, and the uncertainty of both."""

    geometry: CableGeometry
    jumps_m: FloatArray
    """Sizes of the jumps of lengths, in the order of the observations' jumps."""
    poses: FloatArray
    """The fitted pose of each reading, (N, 4, 3)."""
    seen: Observations
    covariance: FloatArray
    """Covariance of the parameters of geometry, jumps and camera, (P, P), with priors, due to noise
    alone."""
    attenuation: FloatArray
    """Standard deviation of parameters due to errors of the tensions, (P,): it is common to all
    parameters, and further poses do not reduce it."""
    slope_noise: float
    """Value of `Knowledge.slope_noise` with which a further fit reaches the elongation of
    `mean_of_cases`."""
    at: Linearised
    """Residuals and derivatives of geometry and jumps at the result, without the robust loss."""
    weights: FloatArray
    """Weights (N, R) of the robust loss for lengths and measured points, at most 1."""
    left: FloatArray
    """Weighted derivatives of rows by all parameters after elimination of the poses, (N, R, P)."""
    taken: FloatArray
    """Weighted derivatives of rows by the pose, times `pose_covariance`, (N, R, d)."""
    pose_covariance: FloatArray
    """Covariance C^-1 of poses for known parameters, (N, d, d)."""
    variance_factor: float
    """Sum of squared residuals of lengths and measured poses over their degrees of freedom: 1 if
    the standard deviations are right."""
    corner_factor: float
    """Variance factor of marker corners, from the median of their distances; 1 without markers."""
    total_cost: float
    """Cost of all observations and priors, as weighted by the losses."""
    steps: int
    converged: bool
    camera: CameraModel | None = None

    @property
    def fitted_camera(self) -> CameraModel:
        """The camera of a fit that has one."""
        assert self.camera is not None
        return self.camera

    @property
    def inflation(self) -> float:
        """Ratio of the covariance to the one that the assumed standard deviations give."""
        return max(self.variance_factor, self.corner_factor, 1.0)

    @property
    def uncertainty(self) -> FloatArray:
        """Covariance due to noise and to errors of the tensions, (P, P)."""
        return np.asarray(self.covariance + np.outer(self.attenuation, self.attenuation))

    @property
    def std(self) -> FloatArray:
        """Standard deviations of the geometry's parameters, (P,)."""
        return np.asarray(np.sqrt(np.diag(self.uncertainty)[: self.geometry.size]))

    @property
    def camera_std(self) -> FloatArray:
        """Standard deviations of the camera's parameters, see `CameraModel`."""
        first = self.geometry.size + self.jumps_m.size
        return np.asarray(np.sqrt(np.diag(self.uncertainty)[first:]))

    @property
    def length_residual_m(self) -> FloatArray:
        """Residuals of the lengths in units of their standard deviations, (N, n)."""
        return self.at.residual[:, : self.geometry.n]


def fit(
    geometry: CableGeometry,
    seen: Observations,
    robust: bool = True,
    start: CableGeometry | None = None,
    camera: CameraModel | None = None,
) -> Fit:
    """Return the geometry and poses that minimise the squared residuals of all observations.

    The method is that of Levenberg and Marquardt. Prior knowledge of parameters counts as an
    observation. So there is always one minimum, and parameters that no observation determines stay
    as in the file. The prior also fixes the gauge: without measured poses or known markers, the
    frame is the one in which the exit points as a whole move least. `robust` applies Huber's loss
    to lengths and to distances from measured points and rotations, and Cauchy's to corners. `start`
    is the first geometry, by default `geometry`. With `camera`, its parameters are fitted too,
    starting from the given ones, and seen markers are used. Raises InvalidRequestError if there are
    no poses.
    """
    if seen.poses == 0:
        raise InvalidRequestError("no poses; allowed: at least one")
    search = _Search(geometry, seen, robust, start or geometry, camera)
    steps = search.settle()
    if geometry.shared and geometry.knowledge.slope_noise:
        search.take_out()
        steps += search.settle()
    return search.result(steps)


@dataclass(frozen=True)
class _State:
    """All unknowns at one step of the search, and their cost."""

    geometry: CableGeometry
    jumps: FloatArray
    camera: CameraModel | None
    poses: FloatArray
    at: Linearised
    off_px: FloatArray
    """Residuals of corners, (n, 4, 2)."""
    prior: FloatArray
    cost: float


class _Search:
    """The state of the search."""

    def __init__(
        self,
        geometry: CableGeometry,
        seen: Observations,
        robust: bool,
        start: CableGeometry,
        camera: CameraModel | None,
    ) -> None:
        self._seen, self._robust = seen, robust
        self._markers = seen.markers if camera is not None else None
        self._first = geometry.values()
        known = [geometry.known_std(), np.full(len(seen.jumps), JUMP_STD_m)]
        if self._markers is not None and camera is not None:
            known.append(camera.known_std())
        self._known = np.concatenate(known)
        self._taken_out = 0.0
        self._fixed: tuple[FloatArray, FloatArray] | None = None
        """Frozen weights of rows and corners; None before they are frozen."""
        self._damping = _DAMPING
        self._done, self._converged = False, True
        start = replace(start, knowledge=geometry.knowledge)
        self._here = self._state(start, np.zeros(len(seen.jumps)), camera, seen.start)

    def _state(
        self,
        geometry: CableGeometry,
        jumps: FloatArray,
        camera: CameraModel | None,
        poses: FloatArray,
    ) -> _State:
        at = linearise(geometry, self._seen, poses, jumps)
        known = [geometry.values() - self._first, jumps]
        off_px, cost = np.zeros((0, 4, 2)), 0.0
        if camera is not None and self._markers is not None:
            known.append(camera.off_known())
            off_px = corner_residuals(camera, self._markers, poses)
            cost = self._corner_cost(camera, off_px)
        prior = np.concatenate(known) / self._known
        cost += self._cost_of(at) + float((prior**2).sum())
        cost -= self._taken_out * (1.0 + geometry.elongation) ** 2
        return _State(geometry, jumps, camera, poses, at, off_px, prior, cost)

    def _cost_of(self, at: Linearised) -> float:
        squares = at.residual**2
        if self._fixed is not None:
            return float((squares * self._fixed[0]).sum())
        if not self._robust:
            return float(squares.sum())
        n, points = self._seen.length_m.shape[1], at.points
        point, turn = (
            squares[:, rows].sum(axis=1) for rows in (points, slice(points.stop, points.stop + 3))
        )
        rest = float(squares[:, n : points.start].sum())
        robust = (squares[:, :n], point, turn)
        return rest + sum(float(_huber_cost(one).sum()) for one in robust)

    def _corner_cost(self, camera: CameraModel, off_px: FloatArray) -> float:
        if self._fixed is None:
            return corner_cost(camera, off_px, self._robust)
        return corner_cost(camera, off_px * np.sqrt(self._fixed[1])[..., None], robust=False)

    def _weights(self) -> FloatArray:
        """Return the weights of rows, (N, R)."""
        if self._fixed is not None:
            return self._fixed[0]
        at, n = self._here.at, self._here.geometry.n
        weights = np.ones_like(at.residual)
        if self._robust:
            weights[:, :n] = _huber_weight(np.abs(at.residual[:, :n]))
            for rows in (at.points, slice(at.points.stop, at.points.stop + 3)):
                distance = np.linalg.norm(at.residual[:, rows], axis=1)
                weights[:, rows] = _huber_weight(distance)[:, None]
        return weights

    def _weighted(self) -> Linearised:
        at = self._here.at
        if not self._robust:
            return at
        root = np.sqrt(self._weights())
        return Linearised(
            at.residual * root, at.by_parameter * root[..., None], at.by_pose * root[..., None]
        )

    def _normal(self, at: Linearised, slope_noise: float) -> NormalEquations:
        """Return the normal equations, with the information about κ reduced by `slope_noise`."""
        here, seen, corners = self._here, self._markers, None
        prior, taken_out = here.prior.copy(), np.zeros_like(self._known)
        if slope_noise:
            k = here.geometry.size - 1
            taken_out[k] = slope_noise
            prior[k] -= slope_noise * (1.0 + here.geometry.elongation) * self._known[k]
        if here.camera is not None and seen is not None:
            terms = corner_terms(here.camera, seen, here.poses)
            corners = corner_blocks(seen, terms, self._corner_weights(), self._seen.poses)
            if here.camera.held:
                corners = corners.only(np.zeros(0, int))
        return NormalEquations(at, self._known, prior, corners, here.geometry.free, taken_out)

    def _corner_weights(self) -> FloatArray:
        here = self._here
        if self._fixed is not None:
            return self._fixed[1]
        if here.camera is None or not self._robust:
            return np.ones(here.off_px.shape[:2])
        return cauchy_weights(here.off_px, here.camera.knowledge.noise_px)

    def settle(self) -> int:
        """Make steps until they are small; return the number of steps."""
        steps, self._done, self._damping = 0, False, _DAMPING
        while steps < _MOST_STEPS and not self._done:
            self.step()
            steps += 1
        self._converged &= self._done and self._damping < _MOST_DAMPING
        return steps

    def take_out(self) -> None:
        """Subtract the spurious information about the elongation, due to noise of tensions.

        An earlier fit has estimated it; this fit may have less information. Weights are frozen from
        here on, because decreasing weights would leave less and less information.
        """
        here, k = self._here, self._here.geometry.size - 1
        information = 1.0 / float(self._normal(self._weighted(), 0.0).covariance()[0][k, k])
        wanted = here.geometry.knowledge.slope_noise * self._seen.poses
        self._fixed = self._weights(), self._corner_weights()
        self._taken_out = most_taken_out(wanted, information)
        self._here = self._state(here.geometry, here.jumps, here.camera, here.poses)

    def step(self) -> None:
        """Make one step, and shorten it until the cost does not increase."""
        normal, here = self._normal(self._weighted(), self._taken_out), self._here
        size_g, size_j = here.geometry.size, here.jumps.size
        most = here.cost + _NO_MORE * abs(here.cost)
        while self._damping < _MOST_DAMPING:
            change, moves, size = normal.solve(self._damping)
            camera = here.camera
            if camera is not None and self._markers is not None:
                camera = camera.changed(change[size_g + size_j :])
            trial = self._state(
                here.geometry.with_values(here.geometry.values() + change[:size_g]),
                here.jumps + change[size_g : size_g + size_j],
                camera,
                moved(here.poses, moves, here.geometry.free),
            )
            if np.isfinite(trial.cost) and trial.cost <= most:
                self._here = trial
                self._damping = max(0.1 * self._damping, _LEAST_DAMPING)
                self._done = size < _DONE
                return
            self._damping *= 10.0
        self._done = True

    def result(self, steps: int) -> Fit:
        """Return the result of the search."""
        here, weighted = self._here, self._weighted()
        geometry, n = here.geometry, here.geometry.n
        normal = self._normal(weighted, 0.0)
        covariance, determined = normal.covariance()
        left, taken, pose_covariance = normal.left_of(weighted)
        hats = left @ covariance @ np.swapaxes(left, 1, 2)
        hats += taken @ np.swapaxes(weighted.by_pose, 1, 2)
        counts = (weighted.by_pose != 0.0).any(axis=2)
        counts[:, -3:] &= np.isfinite(self._seen.rotation_std_rad)  # a target is not a reading
        rows = int(counts.sum())
        corner_factor = 1.0
        if here.camera is not None and self._markers is not None:
            unknowns = float(np.trace(hats, axis1=1, axis2=2).sum())
            distance = float(np.median(np.linalg.norm(here.off_px, axis=2)))
            corner_factor = (distance / NORMAL_MEDIAN / here.camera.knowledge.noise_px) ** 2
        else:
            # tensions of a hanging platform are unknown; assumed ones are not readings either
            spare = n * (1 + self._seen.tension_assumed) * geometry.hangs_freely
            unknowns = here.poses.shape[0] * (len(geometry.free) + spare) + determined
        factor = float((weighted.residual**2).sum()) / max(rows - unknowns, 1.0)
        covariance, off, slope_noise = self._with_noise_of_tensions(
            covariance, left[:, :n], hats[:, :n, :n]
        )
        return Fit(
            geometry, here.jumps, here.poses, self._seen,
            covariance * max(factor, corner_factor, 1.0), off, slope_noise,
            here.at, self._weights(), left, taken, pose_covariance,
            factor, corner_factor, here.cost, steps, self._converged,
            here.camera if self._markers is not None else None,
        )  # fmt: skip

    def _with_noise_of_tensions(
        self, covariance: FloatArray, left: FloatArray, hats: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        """Return covariance, attenuation and slope noise as in `Fit`, with the noise of tensions.

        `left` (N, n, P) and `hats` (N, n, n) belong to the rows of lengths.
        """
        geometry = self._here.geometry
        noise = slope_covariance(geometry, self._seen)
        spread = correlated(left, noise, geometry.knowledge.yielding)
        off, slope_noise, out = np.zeros(len(covariance)), 0.0, 0.0
        if geometry.shared:
            k = geometry.size - 1
            information = 1.0 / float(covariance[k, k])
            spurious = float(((np.eye(geometry.n) - hats) * noise).sum())
            spurious = most_taken_out(max(spurious, 0.0), information)
            out = most_taken_out(self._taken_out, information)
            wanted, error = mean_of_cases(
                geometry.elongation, float(self._known[k]), spurious, information, out
            )
            slope_noise = wanted / self._seen.poses
            covariance = without(covariance, k, out)
            off = covariance[:, k] * (error / float(covariance[k, k]))
            spread[k, k] += out
        covariance = covariance + covariance @ spread @ covariance
        return covariance, off, slope_noise


def _huber_cost(squares: FloatArray) -> FloatArray:
    size = np.sqrt(squares)
    return np.where(size > _HUBER, 2.0 * _HUBER * size - _HUBER**2, squares)


def _huber_weight(size: FloatArray) -> FloatArray:
    return np.asarray(_HUBER / np.maximum(size, _HUBER))


def moved(poses: FloatArray, moves: FloatArray, free: tuple[int, ...]) -> FloatArray:
    """Return poses (N, 4, 3) ⊞ moves (N, d) along the entries `free` of a twist."""
    twist = np.zeros((len(poses), 6))
    twist[:, list(free)] = moves
    out = poses.copy()
    out[:, 0] += twist[:, :3]
    if any(i >= 3 for i in free):
        out[:, 1:] = Rotation.from_rotvec(twist[:, 3:]).as_matrix() @ poses[:, 1:]
    return out


def locate(geometry: CableGeometry, seen: Observations) -> Fit:
    """Return the poses that lengths alone determine, with a fixed geometry."""
    known = replace(geometry.knowledge, alike=1.0)  # each pose is determined by its own reading
    still = replace(geometry, identified=(), knowledge=known)
    return fit(still, seen.unmeasured(), robust=False)


# Standard deviations of lengths and tensions, estimated from residuals because they are unknown.
# Tensions t hold the platform: W t + w = 0, with the wrench matrix W and the weight's wrench w,
# which is linear in the mass m and in m c. With W = U S V^T the d numbers S^-1 U^T (W t + w) of a
# pose have the standard deviation of a tension.

_LEAST_ROWS = 20
_LEAST_N = 0.3
_WEAK, _INERT = 1e-3, 1e-9
_ROUNDS = 3
_BELIEVED = 1.5
_HELD = 3.0
"""If a pose's residual is above this multiple of the median, another force must act on the
platform."""
_LEAST_SHARE = 0.2
"""Smallest standard deviation of a length that the fit may find, relative to the prior one."""


@dataclass(frozen=True)
class Balance:
    """Tensions corrected by the equilibrium of the platform."""

    tension_N: FloatArray
    """(N, n)"""
    free: FloatArray
    """Projections (N, n, n) onto the noise that remains after the correction."""
    std_N: float | None
    """Standard deviation of a tension before the correction; None if there are too few rows."""

    def of(self, seen: Observations) -> Observations:
        """Return observations with these tensions."""
        return replace(seen, tension_N=self.tension_N, tension_free=self.free)


def balance(found: Fit, seen: Observations) -> Balance:
    """Return the tensions nearest to those of `seen` that hold the platform at the poses of a fit.

    Mass and centre of mass are found too. Errors that are common to all cables cannot be detected.
    Tensions are not corrected at poses at which a length is left out, or at which the platform does
    not hang freely, for example on its stand.
    """
    there = np.flatnonzero(found.seen.used.all(axis=1))
    balanced, off_N = _balance_of(found, seen, there)
    if balanced.std_N is None:
        return balanced
    held = off_N > _HELD * np.median(off_N)
    if not held.any():
        return balanced
    free, _ = _balance_of(found, seen, there[~held])
    # the platform hangs freely at too few poses to correct tensions, but all poses together give
    # the standard deviation
    return replace(free, std_N=balanced.std_N) if free.std_N is None else free


def _balance_of(found: Fit, seen: Observations, there: IntArray) -> tuple[Balance, FloatArray]:
    """Return the balance at some poses (k,), and the root mean square residual of each."""
    geometry = found.geometry
    tension, free = seen.tension_N.copy(), np.tile(np.eye(geometry.n), (seen.poses, 1, 1))
    poses = found.poses[there]
    cables = np.empty((len(poses), CABLE_ROWS, geometry.n))
    run_poses(geometry.kernel_geometry(), poses, cables)
    chosen, up = list(geometry.model.kinematics.directions), geometry.coordinates - 1
    weight = np.zeros((len(poses), 6, 4))
    weight[:, up, 0] = -G_m_s2
    pull = np.zeros(3)
    pull[up] = -G_m_s2
    weight[:, 3:, 1:] = np.swapaxes(np.cross(np.swapaxes(poses[:, 1:], 1, 2), pull), 1, 2)
    U, s, V = np.linalg.svd(-cables[:, chosen])
    determined, d = s > _WEAK * s.max(initial=0.0), s.shape[1]
    across = np.swapaxes(U, 1, 2)[:, :d] / np.maximum(s, _INERT)[..., None]
    undetermined = V.copy()
    undetermined[:, :d][determined] = 0.0
    V = np.where(determined[..., None], V[:, :d], 0.0)
    pulled = (V @ tension[there][..., None])[..., 0]
    by_mass = np.where(determined[..., None], across @ weight[:, chosen], 0.0)
    mass, _, rank, _ = np.linalg.lstsq(by_mass[determined], -pulled[determined], rcond=_INERT)
    left = pulled + by_mass @ mass
    spare = int(determined.sum()) - int(rank)
    if spare < _LEAST_ROWS:
        return Balance(tension, free, None), np.zeros(len(there))
    tension[there] -= np.einsum("jdi,jd->ji", V, left)
    # not 1 - V^T V: if all directions are determined, rounding makes its diagonal negative
    free[there] = np.swapaxes(undetermined, 1, 2) @ undetermined
    std_N = math.sqrt(float((left**2).sum()) / spare)
    off_N = np.sqrt((left**2).mean(axis=1))
    return Balance(tension, free, std_N), off_N


def with_noise_seen(found: Fit, file: CableGeometry, found_N: float | None) -> CableGeometry:
    """Return the robot's file with the accuracy of readings that a fit has found.

    The assumed uncertainty of encoders and torques is a guess for all robots. The equilibrium gives
    the uncertainty of tensions, `found_N`, with a limit from the residuals of lengths. If a camera
    determines the poses, the residuals of lengths also give the uncertainty of lengths, so that
    lengths and corners are weighted correctly. Uncertainties are only reduced, never increased.
    """
    geometry, guess = found.geometry, file.knowledge
    known, yielding = geometry.knowledge, max(1.0 + geometry.elongation, 0.0)
    soft = geometry.compliance_1_N * found.seen.length_m
    squares = float((soft**2).mean())
    if found.seen.tension_free is not None:
        free = np.diagonal(found.seen.tension_free, axis1=1, axis2=2)
        squares = float((soft**2 * free).mean())
    before = known.length_m**2 + squares * (known.yielding * known.tension_N) ** 2
    variance = found.variance_factor * known.alike * before
    tension_N = max(found_N or guess.tension_N, _LEAST_N)
    if squares > 0.0 and yielding > 0.0:
        tension_N = max(min(tension_N, math.sqrt(variance / squares) / yielding), _LEAST_N)
    length_m = guess.length_m
    if found.camera is not None:
        rest = variance - squares * (yielding * tension_N) ** 2
        length_m *= math.sqrt(min(max(rest / length_m**2, _LEAST_SHARE**2), 1.0))
    seen = replace(guess, length_m=length_m, tension_N=tension_N, yielding=yielding)
    return replace(file, knowledge=seen)


def fit_with_noise_seen(found: Fit, file: CableGeometry) -> tuple[Fit, CableGeometry]:
    """Return a fit with the accuracy of readings that it finds, and the file with that accuracy.

    From the second round on, the elongation is the mean of two cases. In one, true tensions scatter
    about the given ones; in the other, given tensions scatter about the true ones.
    """
    given, slope_noise = found.seen, 0.0
    weighed = file
    for _ in range(_ROUNDS):
        balanced = balance(found, given)
        weighed = with_noise_seen(found, file, balanced.std_N)
        weighed = replace(weighed, knowledge=replace(weighed.knowledge, slope_noise=slope_noise))
        found = _weighed_fit(found, weighed, given, balanced)
        slope_noise = found.slope_noise
    return found, weighed


def weighed_fit(found: Fit, weighed: CableGeometry, given: Observations) -> Fit:
    """Return another fit, with balanced tensions of `given` and the weights of `weighed`.

    The balance may find errors of the tensions that are so large that the lengths contradict them.
    Then another force acts on the platform, and the tensions are not corrected.
    """
    return _weighed_fit(found, weighed, given, balance(found, given))


def _weighed_fit(found: Fit, weighed: CableGeometry, given: Observations, balanced: Balance) -> Fit:
    if (balanced.std_N or math.inf) <= _BELIEVED * weighed.knowledge.tension_N:
        given = balanced.of(given)
    seen = replace(given, start=found.poses)
    return fit(weighed, seen, start=found.geometry, camera=found.camera)
