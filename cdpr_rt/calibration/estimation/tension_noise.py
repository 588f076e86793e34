"""Effect of noisy tensions on a fit: lengths of a pose err together, and the elongation too.

A length that yields by l c (1 + κ) t errs with the tension by (1 + κ) A e, A = l c / σ. So does its
derivative A t by κ, which is told as A (t + e). Of the information I about κ it feigns

    n = Σ_j tr((1 - H_j) S_j),    S_j = A_j Cov(e_j) A_j

with the hat H of all unknowns. Where true tensions err about told ones, as about those that a
controller sets, 1 + κ comes out right (Berkson); where told ones err about true ones, as (1 + κ)
(I - n) / I (Fuller, Measurement Error Models, 1.1). Which it is nobody knows: both are weighed by
how well the elongation goes with the file's then, and the mean is taken, by -q (1 + κ)² in the
cost, which takes q out of I. The standard deviation of the two is predicted besides noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.estimation.residuals import length_std_m
from cdpr_rt.calibration.readings.observations import Observations

_MOST_SHARE = 0.9
"""Share of the information about the elongation that is taken for noise."""


def slope_covariance(geometry: CableGeometry, seen: Observations) -> FloatArray:
    """Return S, of what tensions make of lengths over their standard deviations, (N, n, n)."""
    soft = geometry.knowledge.tension_N * seen.length_m * geometry.compliance_1_N
    A = seen.used * soft / length_std_m(geometry, seen)
    free = np.eye(geometry.n) if seen.tension_free is None else seen.tension_free
    return np.asarray(A[:, :, None] * free * A[:, None])


def correlated(left: FloatArray, noise: FloatArray, yielding: float) -> FloatArray:
    """Return what rows that err together add to the variance of the gradient, (P, P).

    `left` (N, n, P) are derivatives by the parameters less what poses take of them, `noise` is S.
    """
    across = noise * (1.0 - np.eye(noise.shape[1]))
    return np.asarray(yielding**2 * np.einsum("jap,jab,jbq->pq", left, across, left, optimize=True))


def feigned(hats: FloatArray, noise: FloatArray, information: float) -> float:
    """Return n for hats (N, n, n) of lengths, `noise` S and the information I about κ."""
    spare = np.eye(noise.shape[1]) - hats
    told = float((spare * noise).sum())
    return most_taken_out(max(told, 0.0), information)


def most_taken_out(wanted: float, information: float) -> float:
    """Return what is taken out of the information I about κ: not so much that none is left."""
    return min(wanted, _MOST_SHARE * information)


@dataclass(frozen=True)
class Elongations:
    """What the elongation is where true tensions err about told ones, and where it is otherwise."""

    by_set: float
    """1 + κ of the first, of which the second is `by_true`."""
    by_true: float
    share: float
    """How likely the second is, by what is known of κ before."""
    taken_out: float
    """q with which the fit has the mean of both."""

    def off(self, elongation: float) -> float:
        """Return the root mean square error of κ."""
        one, other = 1.0 + elongation - self.by_set, 1.0 + elongation - self.by_true
        return math.sqrt((1.0 - self.share) * one**2 + self.share * other**2)


def elongations(
    elongation: float, known_std: float, told: float, information: float, taken_out: float
) -> Elongations:
    """Return both for κ as found with q `taken_out`, and for n and I."""
    by_set = (1.0 + elongation) * (information - taken_out) / information
    by_true = by_set * information / (information - told)
    less_likely = ((by_true - 1.0) ** 2 - (by_set - 1.0) ** 2) / (2.0 * known_std**2)
    share = float(expit(-less_likely))
    mean = information - told + share * told
    return Elongations(by_set, by_true, share, information * share * told / mean)


def without(covariance: FloatArray, k: int, taken_out: float) -> FloatArray:
    """Return the covariance (P, P) once so much information about parameter k is taken out."""
    own = covariance[:, k]
    return np.asarray(
        covariance + np.outer(own, own) * (taken_out / (1.0 - taken_out * covariance[k, k]))
    )
