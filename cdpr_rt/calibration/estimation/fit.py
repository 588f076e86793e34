"""The fit: all observations at once by nonlinear least squares, the poses eliminated."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera.camera_model import CameraModel
from cdpr_rt.calibration.camera.corner_terms import (
    corner_cost,
    corner_normals,
    corner_residuals,
    corner_terms,
    corner_weights,
)
from cdpr_rt.calibration.estimation.normal import NormalEquations
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.estimation.residuals import Linearised, linearise
from cdpr_rt.calibration.estimation.tension_noise import (
    correlated,
    elongations,
    feigned,
    most_taken_out,
    slope_covariance,
    without,
)
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.errors import InvalidRequestError

_MOST_STEPS = 60
_DONE = 1e-4
"""Largest step over a parameter's standard deviation at which the search ends."""
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e-13, 1e8
_HUBER = 2.5
"""Standard deviations beyond which a length counts less (Huber's loss)."""
_NORMAL_MEDIAN = 1.1774
"""Median of the length of a vector of two normal numbers of deviation 1."""
_JUMP_STD_m = 1.0
_NO_MORE = 1e-12
"""Relative, by which a cost may be larger and counts as the same."""


@dataclass(frozen=True)
class Fit:
    """An identified geometry with the poses that go with it, and how certain both are."""

    geometry: CableGeometry
    jumps_m: FloatArray
    """Sizes of the jumps of lengths, in the order of the observations' jumps."""
    poses: FloatArray
    """(N, 4, 3)"""
    seen: Observations
    covariance: FloatArray
    """Of the geometry's parameters, jumps and the camera's, (P, P), with what was known before: by
    noise alone."""
    attenuation: FloatArray
    """By how much parameters may be off since the tensions err, (P,), a standard deviation: all of
    them together, and no further poses take it away."""
    slope_noise: float
    """What a further fit is to take out, as `Knowledge.slope_noise`, for the elongation to lie
    where `tension_noise` has it."""
    at: Linearised
    """Residuals and derivatives of geometry and jumps at the result, without the robust loss."""
    weights: FloatArray
    """By which the robust loss has lengths count, (N, n): 1 and below."""
    across: FloatArray
    """(N, P, d): E of the normal equations."""
    pose_covariance: FloatArray
    """(N, d, d): C^-1 of them, of poses where the parameters are known."""
    variance_factor: float
    """Sum of squared residuals of lengths and measured poses over their degrees of freedom: 1 where
    the standard deviations hold."""
    corner_factor: float
    """Variance factor of corners of markers, by the median of their distances; 1 without."""
    total_cost: float
    """Of all that was observed and known before, as far as the losses count it."""
    steps: int
    converged: bool
    camera: CameraModel | None = None

    @property
    def inflation(self) -> float:
        """By which the covariance is larger than standard deviations alone make it."""
        return max(self.variance_factor, self.corner_factor, 1.0)

    @property
    def uncertainty(self) -> FloatArray:
        """Covariance by noise and by attenuation, (P, P)."""
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

    Levenberg and Marquardt; what is known of parameters before counts as observed, so that there
    always is one minimum and what no observation tells stays as the file has it. That fixes the
    gauge: without measured poses or known markers the frame is that in which the exit points,
    taken together, are moved least. `robust` has Huber's loss on lengths and Cauchy's on corners;
    `start` is where to begin, `geometry` itself where left out. With `camera`, where it begins,
    markers that were seen count, and its parameters are fitted as well. Raises
    InvalidRequestError for no poses.
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
        known = [geometry.known_std(), np.full(len(seen.jumps), _JUMP_STD_m)]
        if self._markers is not None and camera is not None:
            known.append(camera.known_std())
        self._known = np.concatenate(known)
        self._taken_out = 0.0
        self._fixed: tuple[FloatArray, FloatArray] | None = None
        """Weights of lengths and corners, once they do not follow residuals any more."""
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
        cost += self._cost_of(at, geometry.n) + float((prior**2).sum())
        cost -= self._taken_out * (1.0 + geometry.elongation) ** 2
        return _State(geometry, jumps, camera, poses, at, off_px, prior, cost)

    def _cost_of(self, at: Linearised, n: int) -> float:
        squares = at.residual**2
        if self._fixed is not None:
            squares[:, :n] *= self._fixed[0]
        elif self._robust:
            size = np.sqrt(squares[:, :n])
            far = size > _HUBER
            squares[:, :n] = np.where(far, 2.0 * _HUBER * size - _HUBER**2, squares[:, :n])
        return float(squares.sum())

    def _corner_cost(self, camera: CameraModel, off_px: FloatArray) -> float:
        if self._fixed is None:
            return corner_cost(camera, off_px, self._robust)
        return corner_cost(camera, off_px * np.sqrt(self._fixed[1])[..., None], robust=False)

    def _weights(self) -> FloatArray:
        """Return the weights of lengths, (N, n)."""
        if self._fixed is not None:
            return self._fixed[0]
        size = np.abs(self._here.at.residual[:, : self._here.geometry.n])
        return np.asarray(_HUBER / np.maximum(size, _HUBER)) if self._robust else np.ones_like(size)

    def _weighted(self) -> Linearised:
        at, n = self._here.at, self._here.geometry.n
        if not self._robust:
            return at
        root = np.ones_like(at.residual)
        root[:, :n] = np.sqrt(self._weights())
        return Linearised(
            at.residual * root, at.by_parameter * root[..., None], at.by_pose * root[..., None]
        )

    def _normal(self, at: Linearised, slope_noise: float) -> NormalEquations:
        """Return the normal equations; so much information about the elongation is none."""
        here, seen, corners = self._here, self._markers, None
        prior, taken_out = here.prior.copy(), np.zeros_like(self._known)
        if slope_noise:
            k = here.geometry.size - 1
            taken_out[k] = slope_noise
            prior[k] -= slope_noise * (1.0 + here.geometry.elongation) * self._known[k]
        if here.camera is not None and seen is not None:
            terms = corner_terms(here.camera, seen, here.poses)
            corners = corner_normals(
                here.camera, seen, terms, self._corner_weights(), self._seen.poses
            )
        return NormalEquations(at, self._known, prior, corners, here.geometry.free, taken_out)

    def _corner_weights(self) -> FloatArray:
        here = self._here
        if self._fixed is not None:
            return self._fixed[1]
        if here.camera is None or not self._robust:
            return np.ones(here.off_px.shape[:2])
        return corner_weights(here.camera, here.off_px)

    def settle(self) -> int:
        """Go to where no step is large any more; return how many steps it took."""
        steps, self._done, self._damping = 0, False, _DAMPING
        while steps < _MOST_STEPS and not self._done:
            self.step()
            steps += 1
        self._converged &= self._done and self._damping < _MOST_DAMPING
        return steps

    def take_out(self) -> None:
        """Have noise of tensions taken out of the information about the elongation.

        How much it is another fit has told, and there may be less information here. Weights stay
        as they are from here on: smaller ones would leave less and less of it.
        """
        here, k = self._here, self._here.geometry.size - 1
        information = 1.0 / float(self._normal(self._weighted(), 0.0).covariance()[0][k, k])
        wanted = here.geometry.knowledge.slope_noise * self._seen.poses
        self._fixed = self._weights(), self._corner_weights()
        self._taken_out = most_taken_out(wanted, information)
        self._here = self._state(here.geometry, here.jumps, here.camera, here.poses)

    def step(self) -> None:
        """Go one step, trying shorter ones until the cost is not larger."""
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
        """Return what was found."""
        here, weighted = self._here, self._weighted()
        geometry, n = here.geometry, here.geometry.n
        normal = self._normal(weighted, 0.0)
        covariance, told = normal.covariance()
        left, taken = normal.left_of(weighted)
        hats = left @ covariance @ np.swapaxes(left, 1, 2)
        hats += taken @ np.swapaxes(weighted.by_pose, 1, 2)
        rows = int((weighted.by_pose != 0.0).any(axis=2).sum())
        corner_factor = 1.0
        if here.camera is not None and self._markers is not None:
            unknowns = float(np.trace(hats, axis1=1, axis2=2).sum())
            distance = float(np.median(np.linalg.norm(here.off_px, axis=2)))
            corner_factor = (distance / _NORMAL_MEDIAN / here.camera.knowledge.noise_px) ** 2
        else:
            unknowns = here.poses.shape[0] * len(geometry.free) + told
        factor = float((weighted.residual**2).sum()) / max(rows - unknowns, 1.0)
        covariance, off, slope_noise = self._with_noise_of_tensions(
            covariance, left[:, :n], hats[:, :n, :n]
        )
        return Fit(
            geometry, here.jumps, here.poses, self._seen,
            covariance * max(factor, corner_factor, 1.0), off, slope_noise,
            here.at, self._weights(), normal.across,
            normal.pose_covariance(), factor, corner_factor, here.cost, steps,
            self._converged,
            here.camera if self._markers is not None else None,
        )  # fmt: skip

    def _with_noise_of_tensions(
        self, covariance: FloatArray, left: FloatArray, hats: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        """Return the covariance with it, attenuation and slope noise as of `Fit`.

        `left` (N, n, P) and `hats` (N, n, n) are of the rows of lengths.
        """
        geometry = self._here.geometry
        noise = slope_covariance(geometry, self._seen)
        spread = correlated(left, noise, geometry.knowledge.yielding)
        off, slope_noise, out = np.zeros(len(covariance)), 0.0, 0.0
        if geometry.shared:
            k = geometry.size - 1
            information = 1.0 / float(covariance[k, k])
            told = feigned(hats, noise, information)
            out = most_taken_out(self._taken_out, information)
            either = elongations(geometry.elongation, float(self._known[k]), told, information, out)
            slope_noise = either.taken_out / self._seen.poses
            covariance = without(covariance, k, out)
            off = covariance[:, k] * (either.off(geometry.elongation) / float(covariance[k, k]))
            spread[k, k] += out
        covariance = covariance + covariance @ spread @ covariance
        return covariance, off, slope_noise


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
    """Return the poses of lengths alone by a geometry that is taken as it is."""
    return fit(replace(geometry, identified=()), seen.unmeasured(), robust=False)
