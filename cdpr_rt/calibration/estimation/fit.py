"""The fit: all observations at once by nonlinear least squares, the poses eliminated."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

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
from cdpr_rt.calibration.estimation.residuals import Linearised, linearise, noise_in_slope
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.core.exchange import FloatArray
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
_MOST_SHARE = 0.9
"""Of a slope's square that is taken for noise."""


@dataclass(frozen=True)
class Fit:
    """An identified geometry with the poses that go with it, and how certain both are."""

    geometry: CableGeometry
    jumps_m: FloatArray
    """Of the lengths that jumped, as of the observations."""
    poses: FloatArray
    """(N, 4, 3)"""
    seen: Observations
    covariance: FloatArray
    """Of the geometry's parameters, jumps and the camera's, (P, P), with what was known before: by
    noise alone."""
    attenuation: FloatArray
    """By how much parameters may be off since the tensions err, (P,), a standard deviation: all of
    them together, and no further poses take it away."""
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
    """The same of corners of markers, by the median of their distances; 1 without."""
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
        """What the lengths are off, in units of their standard deviation, (N, n)."""
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
    steps = 0
    while steps < _MOST_STEPS and not search.done:
        search.step()
        steps += 1
    return search.result(steps)


@dataclass(frozen=True)
class _State:
    """All unknowns at one place of the search, and what it costs."""

    geometry: CableGeometry
    jumps: FloatArray
    camera: CameraModel | None
    poses: FloatArray
    at: Linearised
    off_px: FloatArray
    """Of corners, (n, 4, 2)."""
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
        self._damping = _DAMPING
        self.done = False
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
            cost = corner_cost(camera, off_px, self._robust)
        prior = np.concatenate(known) / self._known
        cost += self._cost_of(at, geometry.n) + float((prior**2).sum())
        return _State(geometry, jumps, camera, poses, at, off_px, prior, cost)

    def _cost_of(self, at: Linearised, n: int) -> float:
        squares = at.residual**2
        if self._robust:
            size = np.sqrt(squares[:, :n])
            far = size > _HUBER
            squares[:, :n] = np.where(far, 2.0 * _HUBER * size - _HUBER**2, squares[:, :n])
        return float(squares.sum())

    def _weights(self) -> FloatArray:
        """Return the weights of lengths, (N, n)."""
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

    def _normal(self, at: Linearised) -> NormalEquations:
        here, seen, corners = self._here, self._markers, None
        if here.camera is not None and seen is not None:
            terms = corner_terms(here.camera, seen, here.poses)
            corners = corner_normals(
                here.camera, seen, terms, self._corner_weights(), self._seen.poses
            )
        return NormalEquations(at, self._known, here.prior, corners, here.geometry.free)

    def _corner_weights(self) -> FloatArray:
        here = self._here
        if here.camera is None or not self._robust:
            return np.ones(here.off_px.shape[:2])
        return corner_weights(here.camera, here.off_px)

    def step(self) -> None:
        """Go one step, trying shorter ones until the cost is not larger."""
        normal, here = self._normal(self._weighted()), self._here
        size_g, size_j = here.geometry.size, here.jumps.size
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
            if np.isfinite(trial.cost) and trial.cost <= here.cost * (1.0 + 1e-12):
                self._here = trial
                self._damping = max(0.1 * self._damping, _LEAST_DAMPING)
                self.done = size < _DONE
                return
            self._damping *= 10.0
        self.done = True

    def result(self, steps: int) -> Fit:
        """Return what was found."""
        here, weighted = self._here, self._weighted()
        normal = self._normal(weighted)
        covariance, told = normal.covariance()
        rows = int((weighted.by_pose != 0.0).any(axis=2).sum())
        corner_factor = 1.0
        if here.camera is not None and self._markers is not None:
            taken = normal.explained(weighted, covariance)
            distance = float(np.median(np.linalg.norm(here.off_px, axis=2)))
            corner_factor = (distance / _NORMAL_MEDIAN / here.camera.knowledge.noise_px) ** 2
        else:
            taken = here.poses.shape[0] * len(here.geometry.free) + told
        factor = float((weighted.residual**2).sum()) / max(rows - taken, 1.0)
        return Fit(
            here.geometry, here.jumps, here.poses, self._seen,
            covariance * max(factor, corner_factor, 1.0),
            self._attenuation(covariance, max(rows - taken, 0.0) / max(rows, 1)),
            here.at, self._weights(), normal.across,
            normal.pose_covariance(), factor, corner_factor, here.cost, steps,
            self.done and self._damping < _MOST_DAMPING,
            here.camera if self._markers is not None else None,
        )  # fmt: skip

    def _attenuation(self, covariance: FloatArray, spare: float) -> FloatArray:
        """Return what noise of tensions may have put parameters off, (P,).

        Where told tensions err about true ones, 1 + κ comes out as (1 + κ) (1 - γ), with γ the
        share of its slope's square that is noise (Fuller, Measurement Error Models, 1.1); where
        true ones err about told ones, as a controller sets these, it comes out right (Berkson).
        Which it is, nobody knows: it is 0 or the whole, of which the root mean square is taken.
        `spare` is the share of rows that no unknown takes.
        """
        geometry, off = self._here.geometry, np.zeros(len(covariance))
        if not geometry.shared:
            return off
        k = geometry.size - 1
        variance = float(covariance[k, k])
        share = min(spare * noise_in_slope(geometry, self._seen) * variance, _MOST_SHARE)
        largest = (1.0 + geometry.elongation) * share / (1.0 - share)
        size = min(abs(largest) / np.sqrt(2.0), float(self._known[k]))
        return np.asarray(covariance[:, k] * (size / variance))


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
