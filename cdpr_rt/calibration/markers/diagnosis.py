"""Diagnosis of a map that fits badly: which marker, how, or whether it is the lens.

Each image that locates its camera by the other markers measures a marker anew. If these places
differ by more than they can, the marker was moved (all images before some instant agree, and all
after it), is there twice (they do not follow time), or is not as large as told. Where what images
show there is no square of its size, at one place or at several, it is partly covered.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.markers.bundle import Bundle, adjust
from cdpr_rt.calibration.markers.reprojection import Estimate, residuals_and_jacobian
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers
from cdpr_rt.errors import ControlError

_BAD_SHARE = 0.25
"""Share of a marker's images that do not fit, from which on it is examined."""
_BAD_SIGMAS = 6.0
_LEAST_IMAGES = 3
"""Of a marker that is partly covered in others, to stay in the map."""
_LEAST_BAD_px = 0.5
_MISFITS = 0.15
"""Share of images on the wrong side of an instant that are allowed."""
_SIZE_OFF = 0.004
_SIZE_SIGMAS = 5.0
_LENS_OFF, _LENS_SIGMAS = 0.003, 6.0
_LENS_GAIN = 0.9
_CHANCE = 1e-4


@dataclass(frozen=True)
class Suspect:
    """A marker that spoils the map."""

    marker: int
    kind: str
    """moved, twice, size, covered or bad."""
    text: str
    images: tuple[int, ...] | None = None
    """Numbers of those that spoil it; None for all."""

    def without(self, seen: SeenMarkers) -> SeenMarkers:
        """Return what was seen without what spoils the map."""
        own = seen.marker == seen.ids.index(self.marker)
        if self.images is not None:
            own &= np.isin(seen.image, self.images)
        return seen.keep(~own)


@dataclass(frozen=True)
class LensSuspicion:
    """Diagnosis of the intrinsics by the images."""

    wrong: bool
    focal_change: float
    """Relative, that the images ask for."""
    rms_px: float
    """With the lens that fits best."""
    lens: FloatArray


def suspects(bundle: Bundle, seen: SeenMarkers) -> list[Suspect]:
    """Return the markers of which many images do not agree with the map."""
    limit = max(_BAD_SIGMAS * bundle.sigma_px, _LEAST_BAD_px)
    off = _off(bundle.off_px)
    found = []
    for number, marker in enumerate(bundle.estimate.map.ids):
        rows = np.flatnonzero((seen.marker == number) & np.isfinite(bundle.off_px[:, 0]))
        if len(rows) and (off[rows] > limit).mean() > _BAD_SHARE:
            found.append(_judged(marker, rows, bundle, seen, limit))
    return found


def _off(corners_px: FloatArray) -> FloatArray:
    """Return by how much three of a marker's corners are off at least: one may be hidden."""
    return np.asarray(np.sort(corners_px, axis=-1)[..., 1])


def _judged(
    marker: int, rows: IntArray, bundle: Bundle, seen: SeenMarkers, limit: float
) -> Suspect:
    names = seen.names
    images = seen.image[rows]
    place, scale = _each_place(rows, bundle, seen)
    size, sigma = _size(rows, bundle, seen)
    if abs(size - 1.0) > max(_SIZE_OFF, _SIZE_SIGMAS * sigma) and _fits_with(
        size, rows, bundle, seen, limit
    ):
        return Suspect(
            marker,
            "size",
            f"marker {marker} is {100.0 * (size - 1.0):+.1f} % of its size larger than told: was "
            "it printed at another scale?",
        )
    far = _off(bundle.off_px[rows]) > limit
    whole = _stand(rows[far], bundle, seen, limit)
    if (~far).sum() >= _LEAST_IMAGES and whole <= (1.0 - _BAD_SHARE) * far.sum():
        return Suspect(
            marker,
            "covered",
            f"marker {marker} is partly covered in {far.sum()} of {len(rows)} images, by another "
            "sheet or what else there is; these are left out",
            tuple(images[far].tolist()),
        )
    split, apart = _two_places(place)
    if apart < 4.0 * max(scale, _looseness(place, split)):
        return Suspect(
            marker,
            "bad",
            f"marker {marker} does not fit in {far.sum()} of {len(rows)} images: is "
            "its sheet flat, whole and of the right size?",
        )
    order = np.argsort(images)
    split = split[order]
    cut, wrong = _best_cut(split)
    if wrong <= _MISFITS * len(split):
        before, after = names[images[order][cut - 1]], names[images[order][cut]]
        return Suspect(
            marker,
            "moved",
            f"marker {marker} was moved by {1e3 * apart:.0f} mm between {before} and {after}",
        )
    return Suspect(
        marker,
        "twice",
        f"marker {marker} is there twice, {1e3 * apart:.0f} mm apart: one of them must go",
    )


def _each_place(rows: IntArray, bundle: Bundle, seen: SeenMarkers) -> tuple[FloatArray, float]:
    """Return where each image of a marker has its middle, (r, 3), and how well it can, m.

    Along the marker's own plane, in which an image tells places well.
    """
    map_ = bundle.estimate.map
    number = seen.marker[rows[0]]
    normal = map_.rotation[number][:, 2]
    lens = bundle.estimate.lens
    middle = seen.corners_px[rows].mean(axis=1)
    rays = np.column_stack([(middle - lens[2:4]) / lens[:2], np.ones(len(rows))])
    rays = (map_.camera_rotation[seen.image[rows]] @ rays[..., None])[..., 0]
    origin = map_.camera_position_m[seen.image[rows]]
    height = (map_.position_m[number] - origin) @ normal
    places = origin + rays * (height / (rays @ normal))[:, None]
    away = float(np.median(np.linalg.norm(places - origin, axis=1)))
    return places, 5.0 * bundle.sigma_px * away / lens[0] + 0.02 * seen.size_m[number]


def _two_places(place: FloatArray) -> tuple[np.ndarray[tuple[int], np.dtype[np.bool_]], float]:
    """Return which places belong to the second of two groups, and how far these are apart."""
    far = np.linalg.norm(place[:, None] - place[None], axis=2)
    i, j = np.unravel_index(np.argmax(far), far.shape)
    group = far[:, j] < far[:, i]
    for _ in range(5):
        if not group.any() or group.all():
            return group, 0.0
        first, second = np.median(place[~group], axis=0), np.median(place[group], axis=0)
        group = np.linalg.norm(place - second, axis=1) < np.linalg.norm(place - first, axis=1)
    return group, float(np.linalg.norm(first - second))


def _looseness(place: FloatArray, split: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> float:
    """Return how far the places of two groups typically are from their middles, m."""
    groups = [one for one in (place[split], place[~split]) if len(one)]
    off = [np.linalg.norm(one - np.median(one, axis=0), axis=1) for one in groups]
    return float(np.median(np.concatenate(off)))


def _best_cut(split: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> tuple[int, int]:
    """Return where to cut a row of two kinds, and how many stand on the wrong side then."""
    cuts = range(1, len(split))
    wrong = [int(split[:c].sum() + (~split[c:]).sum()) for c in cuts]
    wrong = [min(w, len(split) - w) for w in wrong]
    best = int(np.argmin(wrong))
    return cuts[best], wrong[best]


def _size(rows: IntArray, bundle: Bundle, seen: SeenMarkers) -> tuple[float, float]:
    """Return a marker's size over the nominal one, and its standard deviation, cameras fixed."""
    own = seen.keep(np.isin(np.arange(len(seen)), rows))
    map_ = bundle.estimate.map
    number = int(seen.marker[rows[0]])
    off, jacobian = residuals_and_jacobian(bundle.estimate, own)
    start = 6 * (len(map_.names) + number)
    by_pose = jacobian.toarray()[:, start : start + 6]
    # a corner moves with the size as the marker's position does, along its own vector
    vectors = own.corners_m @ map_.rotation[number].T
    by_size = np.einsum("ncuk,nck->ncu", by_pose[:, :3].reshape(-1, 4, 2, 3), vectors)
    J = np.column_stack([by_pose, by_size.ravel()])
    weight = np.repeat(bundle.weight[rows].ravel() > 0.0, 2)
    step, *_ = np.linalg.lstsq(J[weight], -off[weight], rcond=None)
    sigma = bundle.sigma_px * np.sqrt(np.linalg.pinv(J[weight].T @ J[weight])[6, 6])
    return 1.0 + float(step[6]), float(sigma)


def _stand(rows: IntArray, bundle: Bundle, seen: SeenMarkers, limit: float) -> int:
    """Return in how many images a marker fits somewhere: at one place, or at several."""
    if _fits_with(1.0, rows, bundle, seen, limit):
        return len(rows)
    second, apart = _two_places(_each_place(rows, bundle, seen)[0])
    if apart == 0.0:
        return 0
    # nearly any four corners of a single image are those of a square that is turned
    groups = [one for one in (rows[~second], rows[second]) if len(one) > 1]
    return sum(_stand(one, bundle, seen, limit) for one in groups)


def _fits_with(
    size: float, rows: IntArray, bundle: Bundle, seen: SeenMarkers, limit: float
) -> bool:
    """Return whether a marker fits somewhere once it is so large, cameras as they are."""
    own = seen.keep(np.isin(np.arange(len(seen)), rows))
    sizes = own.size_m.copy()
    sizes[seen.marker[rows[0]]] *= size
    own = SeenMarkers(own.names, own.ids, own.image, own.marker, own.corners_px, sizes)
    estimate = bundle.estimate
    start = 6 * (len(estimate.map.names) + int(seen.marker[rows[0]]))
    for _ in range(5):
        off, jacobian = residuals_and_jacobian(estimate, own)
        step = np.zeros(estimate.parameters)
        by_pose = jacobian.toarray()[:, start : start + 6]
        step[start : start + 6] = np.linalg.lstsq(by_pose, -off, rcond=None)[0]
        estimate = estimate.changed(step)
    off, _ = residuals_and_jacobian(estimate, own)
    distance = _off(np.linalg.norm(off.reshape(-1, 4, 2), axis=2))
    return bool((distance > limit).mean() < _BAD_SHARE)


def lens_suspicion(bundle: Bundle, seen: SeenMarkers, fixed: tuple[int, ...]) -> LensSuspicion:
    """Return whether the images fit significantly better with another lens.

    The change of fx, fy, cx, cy, k1, k2, p1, p2, k3 is weighed with its covariance. The fit must
    become visibly better as well, or the focal length change by much more than images can be wrong
    about it: sheets that are not flat ask for a little of another lens, too.
    """
    given = bundle.estimate.lens
    try:
        free = adjust(Estimate(bundle.estimate.map, given), seen, fixed, free_lens=True)
    except ControlError:
        return LensSuspicion(False, 0.0, bundle.rms_px, given)
    change = free.estimate.lens - given
    covariance = free.covariance[-9:, -9:]
    weighed = float(change @ np.linalg.pinv(covariance, hermitian=True) @ change)
    focal = float(change[:2].mean() / given[:2].mean())
    sigma = float(np.sqrt(covariance[:2, :2].mean()) / given[:2].mean())
    better = free.sigma_px < _LENS_GAIN * bundle.sigma_px
    telling = abs(focal) > max(_LENS_OFF, _LENS_SIGMAS * sigma)
    wrong = weighed > chi2.isf(_CHANCE, 9) and (better or telling)
    return LensSuspicion(wrong, focal, free.rms_px, free.estimate.lens)
