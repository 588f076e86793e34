"""The fit: all observations at once by nonlinear least squares, the poses eliminated."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.transform import Rotation

from cdpr_rt.calibration.observations import Observations
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.residuals import Linearised, linearise
from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.errors import InvalidRequestError

_MOST_STEPS = 60
_DONE = 1e-4
"""Largest step over a parameter's standard deviation at which the search ends."""
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e-9, 1e8
_HUBER = 2.5
"""Standard deviations beyond which a length counts less (Huber's loss)."""
_WEAK, _SINGULAR = 1e-6, 1e-10
_JUMP_STD_m = 1.0


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
    """Of the parameters and jumps, (P, P), with what was known before."""
    at: Linearised
    """Residuals and derivatives at the result, without the robust loss."""
    weights: FloatArray
    """By which the robust loss has lengths count, (N, n): 1 and below."""
    variance_factor: float
    """Sum of squared residuals over degrees of freedom: 1 where the standard deviations hold."""
    steps: int
    converged: bool

    @property
    def cost(self) -> float:
        """Sum of squared residuals, as far as the robust loss has them count."""
        n, squares = self.geometry.n, self.at.residual**2
        weighted = float(np.sum(squares[:, :n] * self.weights))
        return weighted + float(np.sum(squares[:, n:]))

    @property
    def std(self) -> FloatArray:
        """Standard deviations of the geometry's parameters, (P,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)[: self.geometry.size]))

    @property
    def length_residual_m(self) -> FloatArray:
        """What the lengths are off, in units of their standard deviation, (N, n)."""
        return self.at.residual[:, : self.geometry.n]


def fit(
    geometry: CableGeometry,
    seen: Observations,
    robust: bool = True,
    start: CableGeometry | None = None,
) -> Fit:
    """Return the geometry and poses that minimise the squared residuals of all observations.

    Levenberg and Marquardt; what is known of parameters before counts as observed, so that there
    always is one minimum and what no observation tells stays as the file has it. That fixes the
    gauge: without measured poses the frame is that in which the exit points, taken together, are
    moved least. `robust` has Huber's loss on lengths; `start` is where to begin, `geometry` itself
    where left out. Raises InvalidRequestError for no poses.
    """
    if seen.poses == 0:
        raise InvalidRequestError("no poses; allowed: at least one")
    search = _Search(geometry, seen, robust, start or geometry)
    steps = 0
    while steps < _MOST_STEPS and not search.done:
        search.step()
        steps += 1
    return search.result(steps)


class _Search:
    """The state of the search."""

    def __init__(
        self, geometry: CableGeometry, seen: Observations, robust: bool, start: CableGeometry
    ) -> None:
        self._seen, self._robust = seen, robust
        self.geometry, self.poses = start, seen.start
        self.jumps = np.zeros(len(seen.jumps))
        self._first = geometry.values()
        known = np.append(geometry.known_std(), np.full(self.jumps.size, _JUMP_STD_m))
        self._known = known
        self._damping = _DAMPING
        self.done = False
        self._weights = np.ones_like(seen.length_m)
        self._at = linearise(start, seen, self.poses, self.jumps)
        self._cost = self._cost_of(self._at, start, self.jumps)

    def _prior(self, geometry: CableGeometry, jumps: FloatArray) -> FloatArray:
        return np.asarray(np.append(geometry.values() - self._first, jumps) / self._known)

    def _cost_of(self, at: Linearised, geometry: CableGeometry, jumps: FloatArray) -> float:
        squares = at.residual**2
        n = geometry.n
        if self._robust:
            size = np.sqrt(squares[:, :n])
            far = size > _HUBER
            squares[:, :n] = np.where(far, 2.0 * _HUBER * size - _HUBER**2, squares[:, :n])
        return float(squares.sum() + (self._prior(geometry, jumps) ** 2).sum())

    def _weighted(self) -> Linearised:
        at, n = self._at, self.geometry.n
        if not self._robust:
            return at
        size = np.abs(at.residual[:, :n])
        self._weights = _HUBER / np.maximum(size, _HUBER)
        root = np.ones_like(at.residual)
        root[:, :n] = np.sqrt(self._weights)
        return Linearised(
            at.residual * root, at.by_parameter * root[..., None], at.by_pose * root[..., None]
        )

    def step(self) -> None:
        """Go one step, trying shorter ones until the cost is not larger."""
        normal = _Normal(self._weighted(), self._known, self._prior(self.geometry, self.jumps))
        while self._damping < _MOST_DAMPING:
            change, moves, size = normal.solve(self._damping)
            geometry = self.geometry.with_values(
                self.geometry.values() + change[: self.geometry.size]
            )
            jumps = self.jumps + change[self.geometry.size :]
            poses = moved(self.poses, moves, geometry.free)
            at = linearise(geometry, self._seen, poses, jumps)
            cost = self._cost_of(at, geometry, jumps)
            if np.isfinite(cost) and cost <= self._cost * (1.0 + 1e-12):
                self.geometry, self.jumps, self.poses, self._at = geometry, jumps, poses, at
                self._cost = cost
                self._damping = max(0.1 * self._damping, _LEAST_DAMPING)
                self.done = size < _DONE
                return
            self._damping *= 10.0
        self.done = True

    def result(self, steps: int) -> Fit:
        """Return what was found."""
        weighted = self._weighted()
        normal = _Normal(weighted, self._known, self._prior(self.geometry, self.jumps))
        count = int((weighted.by_pose != 0.0).any(axis=2).sum())
        unknown = self.poses.shape[0] * len(self.geometry.free)
        freedom = max(count - unknown - normal.determined(), 1.0)
        factor = float((weighted.residual**2).sum()) / freedom
        covariance = normal.covariance() * max(factor, 1.0)
        return Fit(
            self.geometry, self.jumps, self.poses, self._seen, covariance, self._at,
            self._weights, factor, steps, self.done and self._damping < _MOST_DAMPING,
        )  # fmt: skip


class _Normal:
    """Normal equations in blocks: parameters, and poses that each know only themselves.

        H = Σ Jp^T Jp + prior    E_j = Jp_j^T Jx_j    C_j = Jx_j^T Jx_j

    Poses are eliminated: S = H - Σ E_j C_j^-1 E_j^T (Schur).
    """

    def __init__(self, at: Linearised, known_std: FloatArray, prior: FloatArray) -> None:
        size = at.by_parameter.shape[2]
        self._scale, self._size = known_std, size
        # parameters in units of what is known of them before; products of each pose alone are too
        # small for BLAS to start threads, which cost more than they bring
        scaled = at.by_parameter * known_std
        turned, across = np.swapaxes(scaled, 1, 2), np.swapaxes(at.by_pose, 1, 2)
        self._H = (turned @ scaled).sum(axis=0) + np.eye(size)
        self._C = across @ at.by_pose
        self._E = turned @ at.by_pose
        self._gp = (turned @ at.residual[..., None]).sum(axis=0)[:, 0] + prior
        self._gx = (across @ at.residual[..., None])[..., 0]
        d = self._C.shape[1]
        diagonal = self._C[:, range(d), range(d)]
        self._level = np.maximum(diagonal, _WEAK * (1.0 + diagonal.max()))

    def _reduced(self, damping: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        d = self._C.shape[1]
        C = self._C.copy()
        if damping > 0.0:
            C[:, range(d), range(d)] += damping * self._level
            inverse = np.asarray(np.linalg.inv(C))
        else:  # a pose of which not all is known takes nothing in that direction
            inverse = np.asarray(np.linalg.pinv(C, rcond=_SINGULAR, hermitian=True))
        EC = self._E @ inverse
        P = self._size
        S = self._H - (EC @ np.swapaxes(self._E, 1, 2)).sum(axis=0)
        S[range(P), range(P)] += damping * np.diag(self._H)
        return S, EC, inverse

    def solve(self, damping: float) -> tuple[FloatArray, FloatArray, float]:
        """Return the change of parameters (P,), that of poses (N, d), and the former's size."""
        S, EC, inverse = self._reduced(damping)
        right = -self._gp + np.einsum("jpd,jd->p", EC, self._gx)
        try:
            y = cho_solve(cho_factor(S), right) if self._size else right
        except np.linalg.LinAlgError:
            y = np.zeros(self._size)
        moves = -(self._gx + np.einsum("jpd,p->jd", self._E, y))
        moves = np.einsum("jde,je->jd", inverse, moves)
        spread = np.sqrt(np.einsum("jd,jde,je->j", moves, self._C, moves))
        size = max(float(np.abs(y).max(initial=0.0)), float(spread.max(initial=0.0)) * 0.01)
        return y * self._scale, moves, size

    def covariance(self) -> FloatArray:
        """Return the covariance of the parameters, (P, P)."""
        if self._size == 0:
            return np.zeros((0, 0))
        inverse = np.linalg.inv(self._reduced(0.0)[0])
        return np.asarray(0.5 * (inverse + inverse.T) * np.outer(self._scale, self._scale))

    def determined(self) -> float:
        """Return how many parameters the observations tell rather than what was known before."""
        if self._size == 0:
            return 0.0
        return float(self._size - np.trace(np.linalg.inv(self._reduced(0.0)[0])))


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
