"""Standard deviations of lengths and tensions from residuals: neither is known before.

Tensions t hold the platform: W t + w = 0, with the wrench matrix W and the weight's wrench w, which
is linear in the mass m and in m c. With W = U S V^T the d numbers S^-1 U^T (W t + w) of a pose have
the standard deviation of a tension.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.estimation.fit import Fit, fit
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.robots.kinematics.cable_kernel import CABLE_ROWS, run_poses
from cdpr_rt.robots.rigid_body import G_m_s2

_LEAST_ROWS = 20
_LEAST_N = 0.3
_WEAK, _INERT = 1e-3, 1e-9
_ROUNDS = 3
_BELIEVED = 1.5
_HELD = 3.0
"""From so many times the median on, what is left over of a pose's balance is something else."""
_LEAST_SHARE = 0.2
"""Of the standard deviation of a length that is taken before, to which the fit may take it."""


@dataclass(frozen=True)
class Balance:
    """Tensions as the balance of the platform's forces corrects them."""

    tension_N: FloatArray
    """(N, n)"""
    free: FloatArray
    """Projections on what it leaves of their noise, (N, n, n)."""
    std_N: float | None
    """Standard deviation of a tension before; None where hardly anything is left over."""

    def of(self, seen: Observations) -> Observations:
        """Return observations with these tensions."""
        return replace(seen, tension_N=self.tension_N, tension_free=self.free)


def balance(found: Fit, seen: Observations) -> Balance:
    """Return tensions that hold the platform at the poses of a fit, the nearest to those of `seen`.

    Mass and centre of mass are found with it. What pulls alike in all cables it does not see. Poses
    at which a length is left out stay as they are, and those at which the platform does not hang
    free, as on its stand.
    """
    there = np.flatnonzero(found.seen.used.all(axis=1))
    balanced, off_N = _balance_of(found, seen, there)
    if balanced.std_N is None:
        return balanced
    held = off_N > _HELD * np.median(off_N)
    if not held.any():
        return balanced
    free, _ = _balance_of(found, seen, there[~held])
    # too few hang free to correct tensions by, but all together have told how far off these are
    return replace(free, std_N=balanced.std_N) if free.std_N is None else free


def _balance_of(found: Fit, seen: Observations, there: IntArray) -> tuple[Balance, FloatArray]:
    """Return the balance at some poses (k,), and the root mean square of what is left at each."""
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
    told, d = s > _WEAK * s.max(initial=0.0), s.shape[1]
    across = np.swapaxes(U, 1, 2)[:, :d] / np.maximum(s, _INERT)[..., None]
    untold = V.copy()
    untold[:, :d][told] = 0.0
    V = np.where(told[..., None], V[:, :d], 0.0)
    pulled = (V @ tension[there][..., None])[..., 0]
    by_mass = np.where(told[..., None], across @ weight[:, chosen], 0.0)
    mass, _, rank, _ = np.linalg.lstsq(by_mass[told], -pulled[told], rcond=_INERT)
    left = pulled + by_mass @ mass
    spare = int(told.sum()) - int(rank)
    if spare < _LEAST_ROWS:
        return Balance(tension, free, None), np.zeros(len(there))
    tension[there] -= np.einsum("jdi,jd->ji", V, left)
    # not 1 - V^T V, whose diagonal rounding makes negative where as many are told as cables are
    free[there] = np.swapaxes(untold, 1, 2) @ untold
    std_N = math.sqrt(float((left**2).sum()) / spare)
    off_N = np.sqrt((left**2).mean(axis=1))
    return Balance(tension, free, std_N), off_N


def with_noise_seen(found: Fit, file: CableGeometry, told_N: float | None) -> CableGeometry:
    """Return the robot's file with readings as good as a fit has found them to be.

    What encoders and torques are taken to be uncertain by is a guess for all robots. Tensions tell
    theirs, `told_N`, by the balance of forces; they are not worse than lengths bear out. Where a
    camera tells poses, so much is left over of lengths that theirs is known as well, and lengths
    and corners are weighed rightly; it is made smaller only.
    """
    geometry, guess = found.geometry, file.knowledge
    known, yielding = geometry.knowledge, max(1.0 + geometry.elongation, 0.0)
    soft = geometry.compliance_1_N * found.seen.length_m
    squares = float((soft**2).mean())
    if found.seen.tension_free is not None:
        free = np.diagonal(found.seen.tension_free, axis1=1, axis2=2)
        squares = float((soft**2 * free).mean())
    before = known.length_m**2 + squares * (known.yielding * known.tension_N) ** 2
    variance = found.variance_factor * before
    tension_N = max(told_N or guess.tension_N, _LEAST_N)
    if squares > 0.0 and yielding > 0.0:
        tension_N = max(min(tension_N, math.sqrt(variance / squares) / yielding), _LEAST_N)
    length_m = guess.length_m
    if found.camera is not None:
        rest = variance - squares * (yielding * tension_N) ** 2
        length_m *= math.sqrt(min(max(rest / length_m**2, _LEAST_SHARE**2), 1.0))
    seen = replace(guess, length_m=length_m, tension_N=tension_N, yielding=yielding)
    return replace(file, knowledge=seen)


def fit_with_noise_seen(found: Fit, file: CableGeometry) -> tuple[Fit, CableGeometry]:
    """Return a fit with readings as good as they have shown to be, and the file with these.

    From the second time on the elongation is the mean of what it is by tensions that err about
    those told, and of what it is where these err.
    """
    told, slope_noise = found.seen, 0.0
    weighed = file
    for _ in range(_ROUNDS):
        balanced = balance(found, told)
        weighed = with_noise_seen(found, file, balanced.std_N)
        weighed = replace(weighed, knowledge=replace(weighed.knowledge, slope_noise=slope_noise))
        found = _weighed_fit(found, weighed, told, balanced)
        slope_noise = found.slope_noise
    return found, weighed


def weighed_fit(found: Fit, weighed: CableGeometry, told: Observations) -> Fit:
    """Return the fit anew with tensions of `told` as they balance, and readings so weighed.

    Where lengths do not bear out that tensions are as far off as the balance has them, something
    else holds the platform, and they stay as they are.
    """
    return _weighed_fit(found, weighed, told, balance(found, told))


def _weighed_fit(found: Fit, weighed: CableGeometry, told: Observations, balanced: Balance) -> Fit:
    if (balanced.std_N or math.inf) <= _BELIEVED * weighed.knowledge.tension_N:
        told = balanced.of(told)
    seen = replace(told, start=found.poses)
    return fit(weighed, seen, start=found.geometry, camera=found.camera)
