"""Comparison of poses by lengths alone with independent measurements, on poses held out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.stats import t as student

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera.camera_model import CameraModel
from cdpr_rt.calibration.estimation.fit import fit, locate
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.estimation.residuals import length_std_m
from cdpr_rt.calibration.markers.geometry.rotations import logarithms
from cdpr_rt.calibration.readings.observations import Observations

_LEAST_MARKERS = 2
"""Least markers in an image for a pose: the tilt of one alone is not known well."""
_LEAST_POSES = 3
_SURE = 0.975
"""Quantile of the test whether poses are told worse: some two standard errors."""
_GROSS = 2.0
"""Ratio of root mean squares from which on errors are worse, whatever the test says."""


@dataclass(frozen=True)
class Scale:
    """Ratio of measured distances between poses to those by lengths."""

    factor: float
    std: float
    """By leaving out one pose after the other (jackknife); both nan for less than three poses."""

    @classmethod
    def of(cls, told_m: FloatArray, measured_m: FloatArray) -> Scale:
        """Return the ratio of measured (M, k) to computed (M, k) distances, all pairs together.

        s^2 = sum |q_i - q_j|^2 / sum |p_i - p_j|^2; section 3.8 of the thesis looks at the scale.
        """
        count = len(told_m)
        if count < _LEAST_POSES or not np.ptp(told_m, axis=0).any():
            return cls(float("nan"), float("nan"))
        factor = _ratio(told_m, measured_m)
        less = np.array(
            [_ratio(*(np.delete(p, j, axis=0) for p in (told_m, measured_m))) for j in range(count)]
        )
        return cls(factor, float(np.sqrt((count - 1) * less.var())))

    @property
    def text(self) -> str:
        """Factor and standard deviation for people."""
        return f"{self.factor:.5f} ± {self.std:.5f}"


def _ratio(told_m: FloatArray, measured_m: FloatArray) -> float:
    # sums over pairs are those about the mean
    squares = [float(((p - p.mean(axis=0)) ** 2).sum()) for p in (measured_m, told_m)]
    return float(np.sqrt(squares[0] / max(squares[1], 1e-12)))


@dataclass(frozen=True)
class Verification:
    """Errors of poses by lengths alone, at poses that the fit has not used."""

    poses: int
    errors_m: FloatArray
    """Positions by lengths less those measured, (M, k)."""
    told_m: FloatArray
    """Positions by lengths, (M, k)."""
    turn_errors_rad: FloatArray
    """Errors of the rotations, where those were measured, (M, 3)."""
    residual_m: float
    """Root mean square of the lengths' residuals."""
    squares_m2: FloatArray
    """Sum of squares of the lengths' residuals at each pose, (N,)."""
    by_camera: bool = False
    """Whether the camera measured the poses, on a map of the images of other poses alone."""

    @property
    def kind(self) -> Literal["camera", "points", "none"]:
        """Kind of the reference with which poses by lengths are compared."""
        if not self.errors_m.size:
            return "none"
        return "camera" if self.by_camera else "points"

    @property
    def reference(self) -> str:
        """Reference in words."""
        if self.kind != "camera":
            return "measured points" if self.errors_m.size else "nothing but the lengths"
        return (
            "the camera, on a map by the images of the poses used alone, sheet sizes and lens as "
            "calibrated"
        )

    @property
    def mean_mm(self) -> float:
        """Mean distance."""
        return 1e3 * float(np.nanmean(self._distance())) if self.errors_m.size else float("nan")

    @property
    def worst_mm(self) -> float:
        """Largest distance."""
        return 1e3 * float(np.nanmax(self._distance())) if self.errors_m.size else float("nan")

    @property
    def mean_deg(self) -> float:
        """Mean angle between rotations."""
        turned = np.linalg.norm(self.turn_errors_rad, axis=1)
        return float(np.degrees(turned.mean())) if turned.size else float("nan")

    @property
    def scale(self) -> Scale:
        """Ratio of measured distances between the poses to those by lengths."""
        return Scale.of(self.told_m, self.told_m - self.errors_m)

    def worse_than(self, before: Verification) -> bool:
        """Return whether errors are larger than those of `before`, by more than noise explains.

        Of distances d_j less those before the mean is beyond t_0.975 of its standard error
        (Student's paired test): what the measurement errs by is in both. Or, since a few poses
        that are far off make that error large, the root mean square is above twice that before.
        Without measured poses of what lengths contradict each other by.
        """
        if self.errors_m.size:
            now, then = self._distance() ** 2, before._distance() ** 2
            more = self._distance() - before._distance()
        else:
            now, then = self.squares_m2, before.squares_m2
            more = now - then
        count = len(more)
        if not count:
            return False
        if not float(now.mean()) <= _GROSS**2 * float(then.mean()):
            return True
        if count < 2:
            return False
        error = float(more.std(ddof=1)) / math.sqrt(count)
        return float(more.mean()) > float(student.ppf(_SURE, count - 1)) * error

    def _distance(self) -> FloatArray:
        return np.asarray(np.linalg.norm(self.errors_m, axis=1))


def verify(
    geometry: CableGeometry,
    jumps_m: FloatArray,
    seen: Observations,
    camera: CameraModel | None = None,
) -> Verification:
    """Return how poses by `geometry` and lengths alone compare with what was measured of them.

    Where nothing was measured but by the camera, with the poses that it alone tells.
    """
    told = seen.without_jumps(jumps_m)
    there = locate(geometry, told)
    off = there.length_residual_m * length_std_m(geometry, told)
    squares = np.asarray((off**2).sum(axis=1))
    rms = float(np.sqrt(squares.sum() / max(int(seen.used.sum()), 1)))
    k = geometry.coordinates
    if camera is not None and not verifies(seen):
        seen = replace(seen, start=there.poses)
        errors, told_m, turns = _beside_camera(geometry, camera, seen)
        return Verification(
            seen.poses, errors[:, :k], told_m[:, :k], turns, rms, squares, by_camera=True
        )
    p = there.poses[:, 0] + there.poses[:, 1:] @ seen.target_m
    errors = np.where(np.isfinite(seen.position_std_m), p - seen.position_m, np.nan)[:, :k]
    measured = np.isfinite(errors).all(axis=1)
    turned = np.isfinite(seen.rotation_std_rad).all(axis=1)
    turns = logarithms(there.poses[turned, 1:] @ np.swapaxes(seen.rotation[turned], 1, 2))
    return Verification(seen.poses, errors[measured], p[measured, :k], turns, rms, squares)


def verifies(seen: Observations) -> bool:
    """Return whether enough poses were measured, in space, for a reference of their own."""
    k = seen.position_m.shape[1]
    return int((np.isfinite(seen.position_std_m).sum(axis=1) == k).sum()) >= _LEAST_POSES


def _beside_camera(
    geometry: CableGeometry, camera: CameraModel, seen: Observations
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return errors of positions, positions, and errors of rotations of `seen.start`, (M, 3).

    At the poses at which the camera saw enough.
    """
    markers = seen.markers
    shown = np.zeros(seen.poses, int)
    if markers is not None:
        shown = np.bincount(markers.image, minlength=seen.poses)
    index = np.flatnonzero(shown >= _LEAST_MARKERS)
    if len(index) < _LEAST_POSES:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3))
    there = locate_by_camera(geometry, camera, seen.some(index))
    p, Q = seen.start[index, 0], seen.start[index, 1:]
    return p - there[:, 0], p, logarithms(Q @ np.swapaxes(there[:, 1:], 1, 2))


def locate_by_camera(
    geometry: CableGeometry, camera: CameraModel, seen: Observations
) -> FloatArray:
    """Return the poses (N, 4, 3) that images alone tell, by a map that is taken as it is."""
    blind = replace(seen.unmeasured(), markers=seen.markers, used=np.zeros_like(seen.used))
    still = replace(camera, held=True)
    return fit(replace(geometry, identified=()), replace(blind, jumps=()), camera=still).poses


def relative_errors(poses: FloatArray, true: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return errors of positions and rotations (N - 1, 3) of poses (N, 4, 3) seen from the first.

    T_1^-1 T_j is compared, which no frame of the room changes.
    """
    (p, Q), (p_true, Q_true) = _seen_from_first(poses), _seen_from_first(true)
    return p - p_true, logarithms(Q @ np.swapaxes(Q_true, 1, 2))


def _seen_from_first(poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    back = poses[0, 1:].T
    return (poses[1:, 0] - poses[0, 0]) @ back.T, back @ poses[1:, 1:]
