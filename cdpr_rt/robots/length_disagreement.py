"""How far the cable lengths of a platform may contradict each other before something has failed."""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np

from cdpr_profiles.calibration.geometry import GeometryCalibration
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.rigid_body import directions_of, home_rotation, in_space

TAPE_SHARE: Final = 0.01
TAPE_m: Final = 0.022
"""What exit points by tape measure may do to the lengths' normalised residual: over the diagonal of
the box around them, and at most."""
DRUM_SHARE: Final = 0.003
"""Standard deviation of a drum's radius, as a share of it."""
SIGMAS: Final = 3.0
"""Standard deviations of what drums do that are allowed."""
CALIBRATED_SHARE: Final = 1.0 / 3.0
CALIBRATED_m: Final = 0.005
"""Share of all that once the geometry has been calibrated, and its least value then."""
_LEAST_LENGTH_m = 1e-6
LEAST_REDUNDANCY = 1e-4
"""A cable whose redundancy number is less contradicts no other."""


def exit_point_diagonal_m(platform: Platform) -> float:
    """Return the diagonal of the box around a platform's exit points."""
    return float(np.linalg.norm(np.ptp(np.array(platform.exit_points_m), axis=0)))


def allowed_disagreement_m(platform: Platform, calibration: GeometryCalibration | None) -> float:
    """Return how large the largest normalised residual of the lengths may be.

    min(1 % of the diagonal of the box around the exit points, 22 mm) + 3 s, where s is the standard
    deviation of that residual with drums 0.3 % off, at the worst place of the box of targets. With
    a calibration a third of it, but at least 5 mm and the error that was predicted.
    """
    tape_m = min(TAPE_m, TAPE_SHARE * exit_point_diagonal_m(platform))
    most_m = tape_m + SIGMAS * _of_drums_m(platform)
    if calibration is None:
        return most_m
    expected_m = 1e-3 * calibration.predicted_3_sigma_mm
    return min(most_m, max(CALIBRATED_SHARE * most_m, CALIBRATED_m, expected_m))


def _of_drums_m(platform: Platform) -> float:
    """Return the largest standard deviation that drums give a normalised residual.

    Lengths are known at home: what is paid out since is wrong by its drum's share, e. With the
    projection P = I - J J^+ the residuals are P e and the normalised ones P e / sqrt(p_ii).
    Looked at in the corners of the box of targets, at home's orientation, pulleys left out.
    """
    home_m, _ = _cables(platform, platform.home_m)
    box = zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
    worst = 0.0
    for corner in itertools.product(*box):
        lengths_m, J = _cables(platform, corner)
        P = np.eye(len(J)) - J @ np.linalg.pinv(J)
        redundancy = np.diag(P)
        seen = redundancy > LEAST_REDUNDANCY
        variance = P[seen] ** 2 @ (DRUM_SHARE * (lengths_m - home_m)) ** 2 / redundancy[seen]
        worst = max(worst, float(variance.max(initial=0.0)))
    return float(np.sqrt(worst))


def _cables(platform: Platform, place_m: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Return the lengths (n,) at a place, from exit to anchor point, and their Jacobian (n, d)."""
    exits_m = np.array([in_space(point) for point in platform.exit_points_m])
    arms_m = np.array([in_space(point) for point in platform.anchor_points_m])
    arms_m = arms_m @ home_rotation(platform).T
    along_m = in_space(place_m) + arms_m - exits_m
    lengths_m = np.maximum(np.linalg.norm(along_m, axis=1), _LEAST_LENGTH_m)
    units = along_m / lengths_m[:, None]
    J = np.hstack([units, np.cross(arms_m, units)])
    return lengths_m, J[:, list(directions_of(platform))]
