"""Predicted covariance with further poses of the same kind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdpr_rt.calibration.estimation.fit import Fit

MORE = 10
"""Number of further poses in predictions."""


def with_more_poses(found: Fit, more: int = MORE) -> Fit:
    """Return a fit with the covariance that `more` further poses would leave.

    Each is taken to tell as much as those so far do on the average: with N poses, covariance C and
    that known before K, it becomes (K^-1 + (C^-1 - K^-1) (N + more) / N)^-1. Where nothing but
    what was known before tells a direction, more poses bring nothing.
    """
    size, poses = found.geometry.size, found.seen.poses
    known = found.geometry.known_std()
    factor = max(found.variance_factor, 1.0)
    C = found.covariance[:size, :size] / np.outer(known, known) / factor
    shares, vectors = np.linalg.eigh(0.5 * (C + C.T))
    told = np.maximum(1.0 / np.maximum(shares, 1e-12) - 1.0, 0.0) * (poses + more) / poses
    C = (vectors / (1.0 + told)) @ vectors.T * np.outer(known, known) * factor
    return replace(found, covariance=C, attenuation=found.attenuation[:size])
