"""Quality of a calibration and its undetermined directions, in numbers and as text."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np
from scipy.stats import chi2

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera_model import SIZE
from cdpr_rt.calibration.fit import Fit
from cdpr_rt.calibration.parameters import (
    CABLE_ROWS,
    DRUM,
    EXIT,
    OFFSET,
    CableGeometry,
)
from cdpr_rt.calibration.readings import Observations
from cdpr_rt.calibration.residuals import Linearised, encoder_lengths, linearise
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
    """Accuracy of poses from lengths with an identified geometry: 3 sigma of the worst
    coordinate."""

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
        """Return the accuracy with the scale error of all measured points, at positions (M, k)."""
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
