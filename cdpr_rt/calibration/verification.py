"""Quality of a calibration: undetermined directions, predicted accuracy, and verification."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal, Self

import numpy as np
from scipy.stats import chi2
from scipy.stats import t as student

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration.camera_geometry import logarithms
from cdpr_rt.calibration.camera_model import SIZE, CameraModel
from cdpr_rt.calibration.camera_start import (
    locate_by_camera,
    map_of_images,
    markers_of_map,
    start_on_map,
)
from cdpr_rt.calibration.faults import fit_without_faults, free_wrong_values, without_slack
from cdpr_rt.calibration.fit import Fit, locate, weighed_fit
from cdpr_rt.calibration.marker_map_fit import MapFit
from cdpr_rt.calibration.parameters import CABLE_ROWS, DRUM, EXIT, OFFSET, CableGeometry
from cdpr_rt.calibration.readings import CameraSetup, Images, Observations
from cdpr_rt.calibration.residuals import Linearised, encoder_lengths, length_std_m, linearise
from cdpr_rt.errors import InvalidRequestError

_OPEN = 0.5
"""A direction is undetermined if more than this share of its prior variance remains."""
_EXPLAINED = 0.6
_LEAST_SPARE = 4
_AXES = "xyz"
_CHANCE = 0.001
"""Probability below which a change is not explained by noise."""


@dataclass(frozen=True)
class OpenDirection:
    """A combination of parameters that the observations do not determine."""

    what: str
    advice: str
    share: float
    """Remaining share of its prior variance, 0.5 to 1."""


def require_enough(geometry: CableGeometry, seen: Observations) -> None:
    """Raise InvalidRequestError for fewer readings than unknowns; the message gives the difference.

    For known poses, the condition is (3.21).
    """
    d, n = len(geometry.free), geometry.n
    coordinates = np.isfinite(seen.position_std_m[:, : geometry.coordinates]).sum()
    angles = np.isfinite(seen.rotation_std_rad).sum() if d > geometry.coordinates else 0
    readings = int(seen.used.sum() + coordinates + angles) + geometry.balance_readings * seen.poses
    unknown = d * seen.poses + n * (geometry.coordinates + int("offset" in geometry.identified))
    if (
        seen.markers is not None
    ):  # an image gives the camera's pose in the map, which has a separate frame
        readings += d * len(np.unique(seen.markers.image))
        unknown += 12
    each = readings / max(seen.poses, 1) - d
    if readings >= unknown + _LEAST_SPARE:
        return
    if each <= 0.0:
        raise InvalidRequestError(
            f"{n} cables and {d} directions leave no redundancy for a calibration; give measured "
            "points (--points)"
        )
    missing = int(np.ceil((unknown + _LEAST_SPARE - readings) / each))
    raise InvalidRequestError(
        f"{seen.poses} poses with {readings} readings are too few for {unknown} unknowns; "
        f"take at least {missing} more poses of this kind, or measured points"
    )


def open_directions(found: Fit) -> list[OpenDirection]:
    """Return the directions that stay as uncertain as before, the most uncertain first."""
    geometry = found.geometry
    size, known = geometry.size, geometry.known_std()
    if size == 0:
        return []
    covariance = found.covariance[:size, :size] / max(found.variance_factor, 1.0)
    share, vectors = np.linalg.eigh(covariance / np.outer(known, known))
    left = vectors[:, share > _OPEN]
    open_ones = []
    for what, advice, motion in _motions(found):
        whitened = motion / known
        whitened /= np.linalg.norm(whitened)
        part = left.T @ whitened
        if float(part @ part) > _EXPLAINED:
            open_ones.append(OpenDirection(what, advice, float(part @ part)))
            # remove the named direction from the remaining ones
            basis = part / np.linalg.norm(part)
            rest = np.linalg.svd(np.eye(len(basis)) - np.outer(basis, basis))[0][:, :-1]
            left = left @ rest
    return open_ones + _of_single_cables(geometry, left, vectors, share)


def _motions(found: Fit) -> Iterator[tuple[str, str, FloatArray]]:
    """Yield common motions of the robot: name, advice, and the change of its parameters."""
    geometry, k = found.geometry, found.geometry.coordinates
    if "exit" not in geometry.identified:
        return
    exits = geometry.kernel_geometry()[:3].T
    middle = exits.mean(axis=0)
    measure = "measure the platform at three poses or more, far apart (tape, laser or scanner)"
    if found.camera is not None:
        measure += ", or the places of three markers"
    for axis in range(k):
        cable = np.zeros((geometry.n, CABLE_ROWS))
        cable[:, axis] = 1.0
        yield (
            f"the position of all exit points together along {_AXES[axis]}",
            measure,
            _vector(geometry, cable),
        )
    for axis in range(3) if k == 3 else (2,):
        cable = np.zeros((geometry.n, CABLE_ROWS))
        cable[:, EXIT] = np.cross(np.eye(3)[axis], exits - middle)
        what = f"the rotation of all exit points together about {_AXES[axis]}"
        yield what, measure, _vector(geometry, cable)
    cable = np.zeros((geometry.n, CABLE_ROWS))
    cable[:, EXIT] = exits - middle
    cable[:, OFFSET] = found.seen.reference_m
    cable[:, DRUM] = 1.0
    advice = "measure one distance: the platform's position at two poses far apart"
    yield "the scale of the whole geometry", advice, _vector(geometry, cable)


def _vector(geometry: CableGeometry, cable: FloatArray) -> FloatArray:
    return np.append(cable[:, geometry.rows].ravel(), [0.0] * geometry.shared)


def _of_single_cables(
    geometry: CableGeometry, left: FloatArray, vectors: FloatArray, share: FloatArray
) -> list[OpenDirection]:
    """Return the remaining directions, each named by its largest parameters."""
    found = []
    variance = (vectors * share) @ vectors.T
    shown = left @ np.linalg.svd(left.T @ variance @ left)[0] if left.size else left
    names = geometry.names()
    for column in shown.T:
        most = np.argsort(-np.abs(column))[:2]
        chosen = [int(i) for i in most if column[i] ** 2 > 0.15] or [int(most[0])]
        large = [names[i] for i in chosen]
        of_cables = geometry.n * len(geometry.rows)
        numbers = {i // len(geometry.rows) for i in chosen if i < of_cables}
        cables = [geometry.cable_name(number) for number in sorted(numbers)]
        if large == ["elongation"]:
            advice = "add poses at which tensions differ more, or use the cable's data sheet"
        else:
            advice = "add poses further apart, where its length and direction change more"
            if len(geometry.free) > geometry.coordinates:
                advice += ", and poses with other rotations"
            advice += f" ({', '.join(cables)})" if cables else ""
        rest = float(column @ variance @ column)
        found.append(OpenDirection(" with ".join(large), advice, rest))
    return found


def predicted_std(found: Fit, poses: FloatArray, relative: bool = False) -> FloatArray:
    """Return the standard deviations (M, d) of poses (M, 4, 3) from lengths with this geometry.

    They are due to the uncertainty of the parameters alone. With `relative`, the best-fitting rigid
    motion of the whole robot is removed first, because without measured points its position in the
    room is unknown.
    """
    return _std(found, _by_parameters(found, poses, relative))


def _std(found: Fit, A: FloatArray) -> FloatArray:
    """Return the standard deviations (M, d) of values with derivatives A (M, d, P)."""
    size = found.geometry.size
    variance = np.einsum("jdp,pq,jdq->jd", A, found.uncertainty[:size, :size], A)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


SHARED_SCALE_STD: Final = 0.003
"""Assumed relative standard deviation of the scale of all measured points: that of a tape
measure."""


@dataclass(frozen=True)
class Predicted3Sigma:
    """Accuracy of poses from lengths: 3 sigma of the worst coordinate."""

    position_mm: float
    orientation_deg: float | None
    """None if the platform's orientation is not estimated."""

    @classmethod
    def of(cls, found: Fit, A: FloatArray, larger: float) -> Self:
        """Return the accuracy for derivatives A (M, d, P) of poses: rms values times `larger`."""
        k = found.geometry.coordinates
        std = 3.0 * larger * np.sqrt((_std(found, A) ** 2).mean(axis=0))
        turns = np.degrees(std[k:])
        return cls(1e3 * float(std[:k].max()), float(turns.max()) if turns.size else None)

    def with_shared_scale(self, places_m: FloatArray) -> Self:
        """Return the accuracy at positions (M, k), including the points' common scale error."""
        shared_mm = 3e3 * SHARED_SCALE_STD * float(np.sqrt((places_m**2).mean(axis=0)).max())
        return replace(self, position_mm=math.hypot(self.position_mm, shared_mm))


def predicted_3_sigma(
    found: Fit, poses: FloatArray, relative: bool, larger: float
) -> Predicted3Sigma:
    """Return the accuracy at poses (M, 4, 3), with relative orientations, see `predicted_std`."""
    A = _by_parameters(found, poses, relative)
    return Predicted3Sigma.of(
        found, _against_mean_orientation(A, found.geometry.coordinates), larger
    )


def absolute_3_sigma(found: Fit, poses: FloatArray, larger: float) -> Predicted3Sigma:
    """Return the accuracy at poses (M, 4, 3) in the frame of the fit, also for orientations."""
    return Predicted3Sigma.of(found, _by_parameters(found, poses, relative=False), larger)


def _against_mean_orientation(A: FloatArray, k: int) -> FloatArray:
    """Return derivatives (M, d, P) of k coordinates, and of orientations minus their mean.

    Measured positions do not determine a common rotation of all orientations: it looks like exit
    points that differ by as much as the anchor points move.
    """
    return np.concatenate([A[:, :k], A[:, k:] - A[:, k:].mean(axis=0)], axis=1)


@dataclass(frozen=True)
class CalibrationChange:
    """Change of a robot's file by a calibration, all parameters together."""

    moved_m: float
    """Root mean square of the displacements of positions in the workspace."""
    turned_rad: float
    """Root mean square of the rotations; 0 if orientations are not estimated."""
    chi_squared: float
    degrees_of_freedom: float
    """Number of parameters that observations determine: the mean of chi squared if the file is
    right."""

    @property
    def chance(self) -> float:
        """Probability that noise alone causes so large a change."""
        degrees = self.degrees_of_freedom
        return float(chi2.sf(self.chi_squared, degrees)) if degrees > 0.0 else 1.0

    @property
    def by_noise(self) -> bool:
        """Whether noise may explain the change."""
        return self.chance >= _CHANCE

    def exceeds(self, known: Predicted3Sigma) -> bool:
        """Return whether positions or orientations move by more than their uncertainty."""
        turned_deg = float(np.degrees(self.turned_rad))
        most_deg = known.orientation_deg
        return 1e3 * self.moved_m > known.position_mm or (
            most_deg is not None and turned_deg > most_deg
        )


def change_of(found: Fit, poses: FloatArray, relative: bool, larger: float) -> CalibrationChange:
    """Return the change of the robot's file by a fit, at poses (M, 4, 3).

    If the file is right, v^T C^-1 v has nearly a chi squared distribution with P - tr(C K^-1)
    degrees of freedom (Wald), for parameters v with covariance C and prior covariance K. `larger`
    is a factor on the predicted deviations.
    """
    geometry = found.geometry
    v, known, size = geometry.values(), geometry.known_std(), geometry.size
    covariance = larger**2 * found.uncertainty[:size, :size]
    degrees = size - float((np.diag(found.covariance)[:size] / found.inflation / known**2).sum())
    scaled = covariance / np.outer(known, known)
    squares = float(v / known @ np.linalg.solve(scaled, v / known)) if size else 0.0
    k = geometry.coordinates
    A = _against_mean_orientation(_by_parameters(found, poses, relative), k)
    moved = (A @ v) ** 2
    moved_m, turned_rad = (
        float(np.sqrt(part.sum() / len(poses))) for part in (moved[:, :k], moved[:, k:])
    )
    return CalibrationChange(moved_m, turned_rad, squares, max(degrees, 0.0))


def _by_parameters(found: Fit, poses: FloatArray, relative: bool) -> FloatArray:
    """Return the derivatives (M, d, P) of poses from lengths, as for `predicted_std`."""
    geometry = found.geometry
    at = _at(found, poses)
    x, p = at.by_pose, at.by_parameter[..., : geometry.size]
    across = np.swapaxes(x, 1, 2)
    A = np.asarray(-np.linalg.solve(across @ x, across @ p))
    return _less_rigid_motion(A, poses, geometry.free) if relative else A


def _at(found: Fit, poses: FloatArray) -> Linearised:
    geometry, seen = found.geometry, found.seen
    tension = np.tile(np.median(seen.tension_N, axis=0), (len(poses), 1))
    lengths = encoder_lengths(geometry, poses, tension)
    there = Observations.of_lengths(lengths, tension, poses)
    there = replace(there, reference_m=seen.reference_m)
    geometry = replace(geometry, knowledge=replace(geometry.knowledge, alike=1.0))
    return linearise(geometry, there, poses, np.zeros(0))


def _less_rigid_motion(A: FloatArray, poses: FloatArray, free: tuple[int, ...]) -> FloatArray:
    """Return derivatives (M, d, P) minus the rigid motion of the room that fits them best."""
    count, d, size = A.shape
    place = poses[:, 0] - poses[:, 0].mean(axis=0)
    motions = np.zeros((count, 6, 6))
    motions[:, :, :] = np.eye(6)
    for axis in range(3):
        motions[:, :3, 3 + axis] = np.cross(np.eye(3)[axis], place)
    chosen = list(free)
    used = [i for i in range(6) if i < 3 or (i in (3, 4, 5) and (len(free) > 3 or i in free))]
    R = motions[:, chosen][:, :, used].reshape(count * d, len(used))
    flat = A.reshape(count * d, size)
    return np.asarray((flat - R @ np.linalg.lstsq(R, flat, rcond=None)[0]).reshape(A.shape))


def parameter_table(found: Fit) -> list[dict[str, object]]:
    """Return each identified parameter with unit, value and predicted standard deviation."""
    geometry = found.geometry
    values, stds = geometry.values(), found.std
    kinds = [row for _ in range(geometry.n) for row in geometry.rows] + [-1] * geometry.shared
    out: list[dict[str, object]] = []
    for name, row, value, std in zip(geometry.names(), kinds, values, stds, strict=True):
        relative = row in (DRUM, -1)
        unit, scale = ("%", 100.0) if relative else ("mm", 1e3)
        known = {"name": name, "unit": unit, "change": scale * float(value)}
        out.append({**known, "std": scale * float(std)})
    return out


def camera_table(found: Fit) -> dict[str, object] | None:
    """Return the fitted camera, lens and markers for JSON; None without a camera."""
    camera = found.camera
    if camera is None:
        return None
    std, first = found.camera_std, camera.first_marker
    of_markers = std[first:].reshape(-1, 6)
    return {
        "position_m": camera.position_m.tolist(),
        "rotation": camera.rotation.tolist(),
        "position_std_mm": (1e3 * std[:3]).tolist(),
        "rotation_std_deg": np.degrees(std[3:SIZE]).tolist(),
        "size_change_percent": 100.0 * camera.size_change,
        "size_std_percent": 100.0 * float(std[SIZE]),
        "lens": camera.lens.tolist(),
        "markers": [
            {
                "id": marker,
                "position_m": camera.marker_position_m[k].tolist(),
                "rotation": camera.marker_rotation[k].tolist(),
                "std_mm": (1e3 * of_markers[k, :3]).tolist(),
            }
            for k, marker in enumerate(camera.ids)
        ],
    }


# Verification: compare held-out measurements with poses from lengths alone.

_LEAST_MARKERS = 2
"""Smallest number of markers in an image for a pose, because the tilt of a single marker is
uncertain."""
_LEAST_POSES = 3
_SURE = 0.975
"""Quantile for the test of larger errors: about two standard errors."""
_GROSS = 2.0
"""Ratio of root mean squares above which errors are larger, regardless of the test."""


@dataclass(frozen=True)
class Scale:
    """Ratio of measured distances between poses to those by lengths."""

    factor: float
    std: float
    """Standard deviation from leaving out one pose after the other (jackknife). Both values are nan
    for fewer than three poses."""

    @classmethod
    def of(cls, computed_m: FloatArray, measured_m: FloatArray) -> Scale:
        """Return the ratio of measured (M, k) to computed (M, k) distances, for all pairs together.

        s^2 = sum |q_i - q_j|^2 / sum |p_i - p_j|^2; section 3.8 of the thesis discusses the scale.
        """
        count = len(computed_m)
        if count < _LEAST_POSES or not np.ptp(computed_m, axis=0).any():
            return cls(float("nan"), float("nan"))
        factor = _ratio(computed_m, measured_m)
        less = np.array(
            [
                _ratio(*(np.delete(p, j, axis=0) for p in (computed_m, measured_m)))
                for j in range(count)
            ]
        )
        return cls(factor, float(np.sqrt((count - 1) * less.var())))

    @property
    def text(self) -> str:
        """Factor and three standard deviations, as text."""
        return f"{self.factor:.5f} ± {3.0 * self.std:.5f}"


def _ratio(computed_m: FloatArray, measured_m: FloatArray) -> float:
    # sums over pairs are proportional to sums of squares about the mean
    squares = [float(((p - p.mean(axis=0)) ** 2).sum()) for p in (measured_m, computed_m)]
    return float(np.sqrt(squares[0] / max(squares[1], 1e-12)))


@dataclass(frozen=True)
class Verification:
    """Errors of poses from lengths alone, at poses that the fit has not used."""

    poses: int
    errors_m: FloatArray
    """Positions from lengths minus measured ones, (M, k)."""
    computed_m: FloatArray
    """Positions from lengths, (M, k)."""
    turn_errors_rad: FloatArray
    """Errors of measured rotations, (M, 3)."""
    residual_m: float
    """Root mean square of the lengths' residuals."""
    squares_m2: FloatArray
    """Sum of squares of the lengths' residuals at each pose, (N,)."""
    by_camera: bool = False
    """Whether the camera measured the poses, using a map from images at other poses only."""

    @property
    def kind(self) -> Literal["camera", "points", "none"]:
        """Kind of reference with which poses from lengths are compared."""
        if not self.errors_m.size:
            return "none"
        return "camera" if self.by_camera else "points"

    @property
    def reference(self) -> str:
        """Reference as text."""
        if self.kind != "camera":
            return "measured points" if self.errors_m.size else "the lengths alone"
        return (
            "the camera, with a map from the images of the fitted poses alone, and sheet "
            "sizes and lens as calibrated"
        )

    @property
    def mean_mm(self) -> float:
        """Mean distance between positions from lengths and measured ones."""
        return 1e3 * float(np.nanmean(self._distance())) if self.errors_m.size else float("nan")

    @property
    def worst_mm(self) -> float:
        """Largest distance between positions from lengths and measured ones."""
        return 1e3 * float(np.nanmax(self._distance())) if self.errors_m.size else float("nan")

    @property
    def mean_deg(self) -> float:
        """Mean angle between rotations from lengths and measured ones."""
        turned = np.linalg.norm(self.turn_errors_rad, axis=1)
        return float(np.degrees(turned.mean())) if turned.size else float("nan")

    @property
    def scale(self) -> Scale:
        """Ratio of measured distances between the poses to those by lengths."""
        return Scale.of(self.computed_m, self.computed_m - self.errors_m)

    def worse_than(self, before: Verification) -> bool:
        """Return whether errors are larger than those of `before`, by more than noise explains.

        Errors are larger if the mean of the differences of distances d_j exceeds t_0.975 times its
        standard error (Student's paired test, because both have the same measurement errors). They
        are also larger if the root mean square is more than twice that before, because a few gross
        errors make the standard error large. Without measured poses, residuals of the lengths are
        compared instead.
        """
        now, then = self._squares(), before._squares()
        count = len(now)
        if not count:
            return False
        if not float(now.mean()) <= _GROSS**2 * float(then.mean()):
            return True
        more = np.sqrt(now) - np.sqrt(then) if self.errors_m.size else now - then
        if count < 2:
            return False
        error = float(more.std(ddof=1)) / math.sqrt(count)
        return float(more.mean()) > float(student.ppf(_SURE, count - 1)) * error

    def much_better_than(self, before: Verification) -> bool:
        """Return whether the root mean square of errors is less than half that of `before`.

        Errors of the reference, such as a camera's scale, seldom have such an effect. The result is
        False with fewer than three poses.
        """
        now, then = self._squares(), before._squares()
        return len(now) >= _LEAST_POSES and float(then.mean()) > _GROSS**2 * float(now.mean())

    def _squares(self) -> FloatArray:
        """Return squared errors of positions, or of lengths if no positions were measured."""
        return self._distance() ** 2 if self.errors_m.size else self.squares_m2

    def _distance(self) -> FloatArray:
        return np.asarray(np.linalg.norm(self.errors_m, axis=1))


def verify(
    geometry: CableGeometry,
    jumps_m: FloatArray,
    seen: Observations,
    camera: CameraModel | None = None,
) -> Verification:
    """Return the errors of poses from `geometry` and lengths alone against measurements.

    If only the camera has measured, the reference is the poses determined by the camera alone.
    """
    corrected = seen.without_jumps(jumps_m)
    there = locate(geometry, corrected)
    off = there.length_residual_m * length_std_m(there.geometry, corrected)
    squares = np.asarray((off**2).sum(axis=1))
    rms = float(np.sqrt(squares.sum() / max(int(seen.used.sum()), 1)))
    k = geometry.coordinates
    if camera is not None and not verifies(seen):
        seen = replace(seen, start=there.poses)
        errors, computed_m, turns = _beside_camera(geometry, camera, seen)
        return Verification(
            seen.poses, errors[:, :k], computed_m[:, :k], turns, rms, squares, by_camera=True
        )
    p = there.poses[:, 0] + there.poses[:, 1:] @ seen.target_m
    errors = np.where(np.isfinite(seen.position_std_m), p - seen.position_m, np.nan)[:, :k]
    measured = np.isfinite(errors).all(axis=1)
    turned = np.isfinite(seen.rotation_std_rad).all(axis=1)
    turns = logarithms(there.poses[turned, 1:] @ np.swapaxes(seen.rotation[turned], 1, 2))
    return Verification(seen.poses, errors[measured], p[measured, :k], turns, rms, squares)


def verifies(seen: Observations) -> bool:
    """Return whether enough poses were measured in the room for a separate reference."""
    k = seen.position_m.shape[1]
    return int((np.isfinite(seen.position_std_m).sum(axis=1) == k).sum()) >= _LEAST_POSES


def _beside_camera(
    geometry: CableGeometry, camera: CameraModel, seen: Observations
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return errors of positions, the positions, and errors of rotations of `seen.start`, (M, 3).

    Only poses at which the camera saw enough markers are included.
    """
    markers = seen.markers
    shown = np.zeros(seen.poses, int)
    if markers is not None:
        shown = np.bincount(markers.image, minlength=seen.poses)
    index = np.flatnonzero(shown >= _LEAST_MARKERS)
    if len(index) < _LEAST_POSES:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3))
    there = locate_by_camera(geometry, camera, seen.some(index)).poses
    p, Q = seen.start[index, 0], seen.start[index, 1:]
    return p - there[:, 0], p, logarithms(Q @ np.swapaxes(there[:, 1:], 1, 2))


def relative_errors(poses: FloatArray, true: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return errors of positions and rotations (N - 1, 3) of poses (N, 4, 3) seen from the first.

    T_1^-1 T_j is compared, which does not depend on the frame of the room.
    """
    (p, Q), (p_true, Q_true) = _seen_from_first(poses), _seen_from_first(true)
    return p - p_true, logarithms(Q @ np.swapaxes(Q_true, 1, 2))


def _seen_from_first(poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    back = poses[0, 1:].T
    return (poses[1:, 0] - poses[0, 0]) @ back.T, back @ poses[1:, 1:]


# The held-out poses that verify a calibration. The fit to the other poses uses no reading from
# them. Two results come from all poses: the marker map with which the fit begins, and the list of
# wrong measured points, which are not used for verification.

_EACH = 5
"""One in this many poses is held out from the fit and verifies it."""
_BLOCKS = 25
"""Number of blocks of successive readings of a moving platform."""
LEAST_VERIFYING = 3
"""Smallest number of measured points that verify a calibration."""
LEAST_POSES = _EACH * LEAST_VERIFYING
"""With fewer poses, too few would be held out to verify a calibration."""


def held_out(seen: Observations) -> BoolArray:
    """Return which poses are held out from the fit, (N,).

    One pose in five is held out. If six or more poses have a measured point, at least three of
    these are held out, and three also remain for the fit. While the platform moves, one block of
    time in five is held out.
    """
    if seen.time_s is not None:
        block = (np.arange(seen.poses) * (_BLOCKS / seen.poses)).astype(int)
        return np.asarray(every_fifth(_BLOCKS)[block])
    points, held = np.isfinite(seen.position_std_m).any(axis=1), np.zeros(seen.poses, bool)
    for these in (np.flatnonzero(points), np.flatnonzero(~points)):
        held[these[every_fifth(len(these))]] = True
    measured = np.flatnonzero(points)
    if 2 * LEAST_VERIFYING <= len(measured) < _EACH * LEAST_VERIFYING:
        held[measured] = False
        spread = np.linspace(1, len(measured) - 1, LEAST_VERIFYING).round().astype(int)
        held[measured[spread]] = True
    return held


def every_fifth(poses: int) -> BoolArray:
    """Return which of `poses` poses are held out if all of them are measured, (N,)."""
    return np.asarray(np.arange(poses) % _EACH == _EACH - 1)


@dataclass(frozen=True)
class Reference:
    """Marker map from images at the used poses alone, independent of the cables.

    It uses only the sizes of the sheets and the lens from the calibration.
    """

    setup: CameraSetup
    map: MapFit
    images: Images
    """Images of the held-out poses."""


@dataclass(frozen=True)
class Honesty:
    """Actual and predicted errors of held-out positions; nan if no positions were measured."""

    actual_mm: float
    """Root mean square of a coordinate's error."""
    predicted_mm: float
    """Standard deviation of a coordinate."""
    ratio: float
    """Root mean square of errors divided by their standard deviations (Birge, Phys. Rev. 40,
    1932)."""


@dataclass(frozen=True)
class Unused:
    """The held-out poses, and the fit to all others."""

    index: IntArray
    """Indices of the held-out poses."""
    seen: Observations
    """Observations at the held-out poses, without slack cables, with the jumps that the other poses
    determine."""
    part: Fit
    reference: Reference | None
    """Reference for poses that a camera saw; None without a camera."""

    def verified(self) -> Verification:
        """Return the errors of the fit to the other poses."""
        return self._compared(self.part.geometry)

    def before(self, file: CableGeometry) -> Verification:
        """Return the errors of the geometry in the robot's file.

        Jumps are errors of the readings, not of the file, so they are corrected here too. Otherwise
        lengths would contradict the file after the encoders began to count again.
        """
        return self._compared(file)

    def honesty(self) -> Honesty:
        """Return actual and predicted errors against measured points.

        The prediction includes the uncertainty of the fit, of the lengths at one pose, and of the
        measurement.
        """
        part, seen = self.part, self.seen
        there = locate(part.geometry, seen.without_jumps(part.jumps_m))
        k = part.geometry.coordinates
        known = np.isfinite(seen.position_std_m[:, :k])
        if not known.any():
            return Honesty(math.nan, math.nan, math.nan)
        p = there.poses[:, 0] + there.poses[:, 1:] @ seen.target_m
        own = np.diagonal(there.pose_covariance, axis1=1, axis2=2) * max(part.variance_factor, 1.0)
        variance = predicted_std(part, there.poses)[:, :k] ** 2 + own[:, :k]
        variance += np.where(known, seen.position_std_m[:, :k], 0.0) ** 2
        squares = ((p - seen.position_m)[:, :k] ** 2)[known]
        ratio = float(np.sqrt((squares / variance[known]).mean()))
        actual, predicted = (1e3 * math.sqrt(float(x.mean())) for x in (squares, variance[known]))
        return Honesty(actual, predicted, ratio)

    def _compared(self, geometry: CableGeometry) -> Verification:
        """Return the errors of poses from lengths alone with a geometry.

        If the camera is the reference, its pose on the platform and the pose of its map in the room
        are those that fit this geometry best at the used poses.
        """
        reference, jumps_m = self.reference, self.part.jumps_m
        if reference is None or verifies(self.seen):
            return verify(geometry, jumps_m, self.seen)
        used = self.part.seen.unmeasured().without_jumps(jumps_m)
        still = replace(geometry, identified=())
        camera = start_on_map(still, used, reference.setup, reference.map).camera
        markers = markers_of_map(
            *(camera.ids, reference.map.map.placed),
            *(reference.setup.sheets, reference.images.sightings),
        )
        return verify(geometry, jumps_m, replace(self.seen, markers=markers), camera)


def hold_out(
    geometry: CableGeometry,
    weighed: CableGeometry,
    seen: Observations,
    slack_N: FloatArray,
    whole: Fit,
    first_map: MapFit | None,
    images: Images | None,
) -> Unused:
    """Return the held-out poses and the fit to all others, which begins at the result `whole`.

    `weighed` is the geometry for the last fit, with the accuracy of readings found.
    """
    held = held_out(seen)
    part, _ = fit_without_faults(geometry, seen.some(~held), slack_N, whole.camera)
    if first_map is not None:
        part, _ = free_wrong_values(geometry, part, first_map)
    part = weighed_fit(part, weighed, part.seen)
    kept, index = np.flatnonzero(~held), np.flatnonzero(held)
    slipped = part.seen.jumps[len(seen.jumps) :]  # jumps found at the other poses
    some, _ = without_slack(geometry, seen.some(index), slack_N)
    jumps = tuple((cable, int((index < kept[pose]).sum())) for cable, pose in slipped)
    used = some.used.copy()
    for (
        cable,
        pose,
    ) in slipped:  # the other poses do not show whether these readings are before or after the jump
        used[(index > kept[pose - 1]) & (index < kept[pose]), cable] = False
    some = replace(some, jumps=(*some.jumps, *jumps), used=used)
    return Unused(index, some, part, _reference(part, images, held))


def _reference(part: Fit, images: Images | None, held: BoolArray) -> Reference | None:
    if images is None or part.camera is None:
        return None
    setup = images.setup.as_found(part.camera.lens, part.camera.size_change)
    used = [one for one, out in zip(images.sightings, held, strict=True) if not out]
    unused = [one for one, out in zip(images.sightings, held, strict=True) if out]
    return Reference(setup, map_of_images(setup, used), Images(setup, unused))


# Predicted covariance with further poses of the same kind.

MORE = 10
"""Number of further poses in predictions."""


def with_more_poses(found: Fit, more: int = MORE) -> Fit:
    """Return a fit with the covariance that `more` further poses would leave.

    Each further pose is assumed to be as informative as the average so far. With N poses,
    covariance C and prior covariance K, the new covariance is (K^-1 + (C^-1 - K^-1) (N + more) /
    N)^-1. In directions that only the prior determines, more poses have no effect.
    """
    size, poses = found.geometry.size, found.seen.poses
    known = found.geometry.known_std()
    factor = max(found.variance_factor, 1.0)
    C = found.covariance[:size, :size] / np.outer(known, known) / factor
    shares, vectors = np.linalg.eigh(0.5 * (C + C.T))
    information = np.maximum(1.0 / np.maximum(shares, 1e-12) - 1.0, 0.0) * (poses + more) / poses
    C = (vectors / (1.0 + information)) @ vectors.T * np.outer(known, known) * factor
    return replace(found, covariance=C, attenuation=found.attenuation[:size])
