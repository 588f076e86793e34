"""Make a marker map from images: leave out faulty markers and images, and assess the map."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.stats import chi2

from cdpr_profiles.camera import CameraIntrinsics, MarkerSheets
from cdpr_rt.arrays import FloatArray, IntArray, rms
from cdpr_rt.calibration.camera_geometry import (
    angles,
    camera_matrix,
    exponentials,
    nearest_rotation,
)
from cdpr_rt.calibration.marker_bundle import LENS_PARAMETERS, Bundle, Estimate, adjust
from cdpr_rt.calibration.marker_map import (
    Coverage,
    MarkerMap,
    SeenMarkers,
    Sighting,
    aligned,
    consistent_places,
    coverage,
    known_places,
    laid_out,
    listed,
)
from cdpr_rt.errors import ControlError, InvalidRequestError

# Diagnosis of a map that fits badly: which marker is wrong and how, or whether the lens is wrong.
# If an image locates its camera by the other markers, it measures a marker independently. If these
# measured positions differ too much, there are three explanations. The marker has another size than
# given; it was moved (all images before some instant agree, and all after it); or it exists twice
# (the order of images does not matter). If the corners do not form a square of the marker's size at
# one position or several, the marker is partly covered.

_BAD_SHARE = 0.25
"""A marker is examined if it misfits in more than this share of its images."""
_BAD_SIGMAS = 6.0
_LEAST_IMAGES = 3
"""Smallest number of good images of a partly covered marker for it to stay in the map."""
_LEAST_BAD_px = 0.5
_MISFITS = 0.15
"""Allowed share of images on the wrong side of an instant."""
_SIZE_OFF = 0.004
_SIZE_SIGMAS = 5.0
_LENS_OFF, _LENS_SIGMAS = 0.003, 6.0
_LENS_GAIN = 0.9
_CHANCE = 1e-4


@dataclass(frozen=True)
class Suspect:
    """A marker with wrong corners."""

    marker: int
    kind: str
    """moved, twice, size, covered or bad."""
    text: str
    images: tuple[int, ...] | None = None
    """Numbers of the images with wrong corners; None for all."""

    def without(self, seen: SeenMarkers) -> SeenMarkers:
        """Return the seen markers without the wrong corners."""
        own = seen.marker == seen.ids.index(self.marker)
        if self.images is not None:
            own &= np.isin(seen.image, self.images)
        return seen.keep(~own)


@dataclass(frozen=True)
class LensSuspicion:
    """Suspicion that the intrinsics are wrong, found from the images."""

    wrong: bool
    focal_change: float
    """Relative change of the focal length with the lens that fits best."""
    rms_px: float
    """Root mean square error with the lens that fits best."""


def suspects(bundle: Bundle, seen: SeenMarkers) -> list[Suspect]:
    """Return the markers that many images contradict."""
    limit = max(_BAD_SIGMAS * bundle.sigma_px, _LEAST_BAD_px)
    off = _off(bundle.off_px)
    found = []
    for number, marker in enumerate(bundle.estimate.map.ids):
        rows = np.flatnonzero((seen.marker == number) & np.isfinite(bundle.off_px[:, 0]))
        if len(rows) and (off[rows] > limit).mean() > _BAD_SHARE:
            found.append(_judged(marker, rows, bundle, seen, limit))
    return found


def _off(corners_px: FloatArray) -> FloatArray:
    """Return the second smallest error of a marker's corners, because one corner may be hidden."""
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
            f"marker {marker} is {100.0 * (size - 1.0):+.1f} % larger than stated: was it "
            "printed at another scale?",
        )
    far = _off(bundle.off_px[rows]) > limit
    whole = _stand(rows[far], bundle, seen, limit)
    if (~far).sum() >= _LEAST_IMAGES and whole <= (1.0 - _BAD_SHARE) * far.sum():
        return Suspect(
            marker,
            "covered",
            f"marker {marker} is partly covered in {far.sum()} of {len(rows)} images, by "
            "another sheet or an object; these images are left out",
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
        f"marker {marker} appears twice, {1e3 * apart:.0f} mm apart: remove one of them",
    )


def _each_place(rows: IntArray, bundle: Bundle, seen: SeenMarkers) -> tuple[FloatArray, float]:
    """Return the centre of a marker from each image, (r, 3), and its uncertainty, m.

    Positions are in the marker's plane, in which an image measures accurately.
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
    """Return which positions belong to the second of two groups, and their distance, m."""
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
    """Return the typical distance of positions from the middles of their groups, m."""
    groups = [one for one in (place[split], place[~split]) if len(one)]
    off = [np.linalg.norm(one - np.median(one, axis=0), axis=1) for one in groups]
    return float(np.median(np.concatenate(off)))


def _best_cut(split: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> tuple[int, int]:
    """Return where to cut a sequence of two kinds, and how many are on the wrong side."""
    cuts = range(1, len(split))
    wrong = [int(split[:c].sum() + (~split[c:]).sum()) for c in cuts]
    wrong = [min(w, len(split) - w) for w in wrong]
    best = int(np.argmin(wrong))
    return cuts[best], wrong[best]


def _size(rows: IntArray, bundle: Bundle, seen: SeenMarkers) -> tuple[float, float]:
    """Return a marker's relative size and its standard deviation, with fixed cameras."""
    own = seen.keep(np.isin(np.arange(len(seen)), rows))
    terms = bundle.estimate.views(own).terms(bundle.estimate.lens)
    by_size = terms.by_shared[..., LENS_PARAMETERS:]
    J = np.concatenate([terms.by_marker, by_size], axis=2).reshape(-1, 7)
    weight = np.repeat(bundle.weight[rows].ravel() > 0.0, 2)
    step, *_ = np.linalg.lstsq(J[weight], -terms.residual.ravel()[weight], rcond=None)
    sigma = bundle.sigma_px * np.sqrt(np.linalg.pinv(J[weight].T @ J[weight])[6, 6])
    return 1.0 + float(step[6]), float(sigma)


def _stand(rows: IntArray, bundle: Bundle, seen: SeenMarkers, limit: float) -> int:
    """Return the number of images in which a marker fits, at one position or several."""
    if _fits_with(1.0, rows, bundle, seen, limit):
        return len(rows)
    second, apart = _two_places(_each_place(rows, bundle, seen)[0])
    if apart == 0.0:
        return 0
    # a turned square fits nearly any four corners of a single image
    groups = [one for one in (rows[~second], rows[second]) if len(one) > 1]
    return sum(_stand(one, bundle, seen, limit) for one in groups)


def _fits_with(
    size: float, rows: IntArray, bundle: Bundle, seen: SeenMarkers, limit: float
) -> bool:
    """Return whether a marker of this relative size fits at any pose, with fixed cameras."""
    own = seen.keep(np.isin(np.arange(len(seen)), rows))
    sizes = own.size_m.copy()
    sizes[seen.marker[rows[0]]] *= size
    own = SeenMarkers(own.names, own.ids, own.image, own.marker, own.corners_px, sizes)
    estimate = bundle.estimate
    start = LENS_PARAMETERS + 6 * int(seen.marker[rows[0]])
    for _ in range(5):
        terms = estimate.views(own).terms(estimate.lens)
        by_pose, off = terms.by_marker.reshape(-1, 6), terms.residual.ravel()
        step = np.zeros(estimate.parameters)
        step[start : start + 6] = np.linalg.lstsq(by_pose, -off, rcond=None)[0]
        estimate = estimate.changed(step)
    off = estimate.off_px(own)
    distance = _off(np.linalg.norm(off, axis=2))
    return bool((distance > limit).mean() < _BAD_SHARE)


def lens_suspicion(bundle: Bundle, seen: SeenMarkers, fixed: tuple[int, ...]) -> LensSuspicion:
    """Return whether the images fit significantly better with another lens.

    The change of fx, fy, cx, cy, k1, k2, p1, p2, k3 must be significant by its covariance. In
    addition, the fit must become visibly better, or the focal length must change by much more than
    its error: sheets that are not flat also change the lens a little.
    """
    given = bundle.estimate.lens
    try:
        free = adjust(Estimate(bundle.estimate.map, given), seen, fixed, free_lens=True)
    except ControlError:
        return LensSuspicion(False, 0.0, bundle.rms_px)
    change = free.estimate.lens - given
    covariance = free.covariance[:LENS_PARAMETERS, :LENS_PARAMETERS]
    weighed = float(change @ np.linalg.pinv(covariance, hermitian=True) @ change)
    focal = float(change[:2].mean() / given[:2].mean())
    sigma = float(np.sqrt(covariance[:2, :2].mean()) / given[:2].mean())
    better = free.sigma_px < _LENS_GAIN * bundle.sigma_px
    telling = abs(focal) > max(_LENS_OFF, _LENS_SIGMAS * sigma)
    wrong = weighed > chi2.isf(_CHANCE, LENS_PARAMETERS) and (better or telling)
    return LensSuspicion(wrong, focal, free.rms_px)


# The two poses of a square from its four corners. A distant square looks almost the same if it is
# tilted in the opposite direction (flip). Both poses are kept until other images, or other markers
# in the same image, decide between them.


@dataclass(frozen=True)
class SquarePoses:
    """Two poses of each of n squares in the camera's frame, the better one first."""

    rotation: FloatArray
    """Rotations from the squares' frames to the camera's, (n, 2, 3, 3)."""
    position_m: FloatArray
    """Positions of their centres, (n, 2, 3)."""
    error_px: FloatArray
    """Root mean square distance of corners, (n, 2)."""


def square_poses(seen: SeenMarkers, lens: FloatArray) -> SquarePoses:
    """Return the poses of all seen squares.

    The method is infinitesimal plane-based pose estimation (Collins and Bartoli 2014).
    """
    import cv2  # noqa: PLC0415  # needs an extra

    n, matrix = len(seen), camera_matrix(lens)
    vectors, places, errors = np.zeros((n, 2, 3)), np.zeros((n, 2, 3)), np.zeros((n, 2))
    for i, (corners_m, corners_px) in enumerate(zip(seen.corners_m, seen.corners_px, strict=True)):
        _, turns, shifts, error = cv2.solvePnPGeneric(
            corners_m, corners_px, matrix, lens[4:], flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
        vectors[i], places[i] = np.reshape(turns, (2, 3)), np.reshape(shifts, (2, 3))
        errors[i] = np.ravel(error)
    return SquarePoses(exponentials(vectors).reshape(n, 2, 3, 3), places, errors)


# A first map: find relative poses of markers on which images agree, then place markers along a
# tree. Each image shows each marker in one of two poses, so that two markers have four possible
# relative poses. Only one of the four is the same in all images that show both.

_MOST_IMAGES = 24
"""Number of images that are compared for a pair of markers."""
_SAME_rad = 0.12
_SAME_SHARE = 0.08
"""Two measurements of a relative pose agree if they differ by less than this angle and this share
of the distance of the two markers."""
_EDGE_COST = 0.05
"""Cost of one more step in the tree, in the units of the cost of a pair with few images."""


@dataclass(frozen=True)
class Pair:
    """Pose of marker `b` in the frame of marker `a`, and the number of images that agree."""

    a: int
    b: int
    rotation: FloatArray
    position_m: FloatArray
    images: int
    of: int
    """Number of images that show both."""

    @property
    def cost(self) -> float:
        """Cost of a step along this pair: small if many images agree and few do not."""
        return _EDGE_COST + (self.of / self.images) ** 2 / self.images


def marker_pairs(seen: SeenMarkers, poses: SquarePoses) -> list[Pair]:
    """Return all pairs of markers that some image shows together."""
    by_image = [np.flatnonzero(seen.image == i) for i in range(len(seen.names))]
    together: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for rows in by_image:
        for i in range(len(rows)):
            for j in range(i + 1, len(rows)):
                key = (int(seen.marker[rows[i]]), int(seen.marker[rows[j]]))
                together.setdefault(key, []).append((int(rows[i]), int(rows[j])))
    return [
        _consent(a, b, np.array(rows[:: 1 + len(rows) // _MOST_IMAGES]), poses)
        for (a, b), rows in together.items()
    ]


def _consent(a: int, b: int, rows: IntArray, poses: SquarePoses) -> Pair:
    """Return the relative pose on which most images agree; each image proposes four."""
    Ra, Rb = poses.rotation[rows[:, 0]], poses.rotation[rows[:, 1]]
    ta, tb = poses.position_m[rows[:, 0]], poses.position_m[rows[:, 1]]
    back = Ra.transpose(0, 1, 3, 2)
    R = (back[:, :, None] @ Rb[:, None]).reshape(-1, 3, 3)
    t = (back[:, :, None] @ (tb[:, None] - ta[:, :, None])[..., None]).reshape(-1, 3)
    error = (poses.error_px[rows[:, 0]][:, :, None] + poses.error_px[rows[:, 1]][:, None]).ravel()
    image = np.repeat(np.arange(len(rows)), 4)
    turned = angles(R[:, None] @ R.transpose(0, 2, 1)[None])
    reach = _SAME_SHARE * max(float(np.median(np.linalg.norm(t, axis=1))), 1e-6)
    shifted = np.linalg.norm(t[:, None] - t[None], axis=2)
    agrees = (turned < _SAME_rad) & (shifted < reach)
    votes = np.array([len(set(image[line])) for line in agrees])
    # if several poses have the most votes, take the one that fits best
    worth = votes - error / (error.max() + 1e-300) / 2.0
    best = int(np.argmax(worth))
    with_it = np.flatnonzero(agrees[best])
    turn, shift = nearest_rotation(R[with_it].sum(axis=0)), t[with_it].mean(axis=0)
    return Pair(a, b, turn, shift, int(votes[best]), len(rows))


def placed_along_tree(pairs: list[Pair], count: int, start: int) -> tuple[FloatArray, FloatArray]:
    """Return positions (m, 3) and rotations (m, 3, 3) in the frame of marker number `start`.

    The poses follow the cheapest paths from that marker. A pair costs less if more images agree on
    it. Poses are nan for markers without a path.
    """
    position, rotation = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    position[start], rotation[start] = 0.0, np.eye(3)
    if not pairs:
        return position, rotation
    graph: Any = csr_array(
        ([one.cost for one in pairs], ([one.a for one in pairs], [one.b for one in pairs])),
        shape=(count, count),
    )
    cost, before = dijkstra(graph, directed=False, indices=[start], return_predecessors=True)
    cost, before = cost[0], before[0]
    known = {(one.a, one.b): one for one in pairs}
    for k in np.argsort(cost):
        if not np.isfinite(cost[k]) or k == start:
            continue
        last = int(before[k])
        if (last, int(k)) in known:
            pair = known[last, int(k)]
            R, t = pair.rotation, pair.position_m
        else:
            pair = known[int(k), last]
            R, t = pair.rotation.T, -pair.rotation.T @ pair.position_m
        rotation[k] = rotation[last] @ R
        position[k] = position[last] + rotation[last] @ t
    return position, rotation


def located_cameras(
    seen: SeenMarkers, poses: SquarePoses, position: FloatArray, rotation: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return positions (k, 3) and rotations (k, 3, 3) of the camera in the images.

    Each placed marker of an image proposes two poses of the camera. The one with the least median
    error over all markers is used. Poses are nan for images without a placed marker.
    """
    count = len(seen.names)
    places, turns = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    corners = seen.corners_m
    for i in range(count):
        rows = np.flatnonzero((seen.image == i) & np.isfinite(position[seen.marker, 0]))
        if not rows.size:
            continue
        marker = seen.marker[rows]
        proposed = rotation[marker][:, None] @ poses.rotation[rows].transpose(0, 1, 3, 2)
        where = position[marker][:, None] - (proposed @ poses.position_m[rows][..., None])[..., 0]
        proposed, where = proposed.reshape(-1, 3, 3), where.reshape(-1, 3)
        in_room = corners[rows] @ rotation[marker].transpose(0, 2, 1) + position[marker][:, None]
        expected = (in_room.reshape(1, -1, 3) - where[:, None]) @ proposed
        # rotations of the markers as seen from this camera, by the better of their two poses
        own = corners[rows] @ poses.rotation[rows, 0].transpose(0, 2, 1)
        own = (own + poses.position_m[rows, 0][:, None]).reshape(1, -1, 3)
        z = np.where(expected[..., 2:] > 1e-6, expected[..., 2:], np.nan)
        off = np.linalg.norm(expected[..., :2] / z - own[..., :2] / own[..., 2:], axis=2)
        off = np.nan_to_num(off, nan=10.0)
        fit = np.median(off, axis=1) + 0.1 * np.minimum(off, 0.1).mean(axis=1)
        best = int(np.argmin(fit))
        places[i], turns[i] = where[best], proposed[best]
    return places, turns


def most_agreed(pairs: list[Pair], seen: SeenMarkers) -> int:
    """Return the id of the marker whose relative poses most images agree on."""
    votes = np.zeros(len(seen.ids))
    for pair in pairs:
        votes[[pair.a, pair.b]] += 2.0 * pair.images - pair.of
    return seen.ids[int(votes.argmax())]


def first_map(seen: SeenMarkers, poses: SquarePoses, reference: int | None = None) -> MarkerMap:
    """Return a map of all markers connected with the marker `reference`, an id.

    By default it is the marker on which images agree most.
    """
    pairs = marker_pairs(seen, poses)
    reference = most_agreed(pairs, seen) if reference is None else reference
    start = seen.ids.index(reference)
    position, rotation = placed_along_tree(pairs, len(seen.ids), start)
    places, turns = located_cameras(seen, poses, position, rotation)
    return MarkerMap(
        seen.ids, reference, seen.size_m, position, rotation, seen.names, places, turns
    )


_MOST_ROUNDS = 4
_GOOD_px, _POOR_px = 0.35, 1.5
_SCALE_OFF = 0.004
_FRAME_RATIO = 2.0
_MIRRORED_IMAGES = 2
"""Smallest number of mirrored readings of a marker that is also read correctly: one mirrored
reading may be chance."""
_KNOWN_STD_m = 0.001
"""Default standard deviation of each coordinate of a known position."""
_MISFIT_WEIGHT, _MISFIT_SHARE = 0.05, 0.05
"""Weight of a corner with an error of 13 standard deviations."""


@dataclass(frozen=True)
class KnownFit:
    """Agreement of a map with known marker poses that it does not use."""

    scale: float
    """Ratio of the distances in the layout to those in the map."""
    rms_m: float
    """Differences that remain after fitting position, rotation and scale."""


@dataclass(frozen=True)
class MapFit:
    """A map, its quality, and the faults found while it was made."""

    bundle: Bundle
    seen: SeenMarkers
    """Markers that the map was made from."""
    fixed: tuple[int, ...]
    coverage: Coverage
    dropped: tuple[Suspect, ...]
    """Markers that were left out."""
    lens: LensSuspicion
    known: KnownFit | None
    faults: tuple[str, ...]
    """Faults as text; a map with faults is not reliable."""
    warnings: tuple[str, ...]
    """Faults of markers that were left out of the map."""
    notes: tuple[str, ...]
    """Warnings as text."""

    @property
    def map(self) -> MarkerMap:
        """The map itself."""
        return self.bundle.estimate.map


def fit_map(
    sightings: Sequence[Sighting],
    intrinsics: CameraIntrinsics,
    sheets: MarkerSheets,
    reference: int | None = None,
) -> MapFit:
    """Return the marker map from sightings in the order in which they were taken.

    Without known marker poses, the map is in the frame of the marker `reference`, by default the
    one on which images agree most. With known poses, it is in the frame of the layout, and known
    markers do not move. Raises InvalidRequestError if no image shows two markers, BundleError if
    the images determine nothing.
    """
    cover = coverage(sightings, sheets.placed)
    sightings = laid_out(sightings, sheets.placed)
    island = set(cover.islands[0]) if cover.islands else set()
    if len(island) < 2:
        raise InvalidRequestError("; ".join(["no image shows two markers together", *cover.advice]))
    seen = _observations(sightings, sheets, island)
    lens = np.array(intrinsics.parameters)
    bundle, seen, dropped = _without_suspects(seen, lens, reference)
    start = bundle.estimate.map.reference
    suspicion = lens_suspicion(bundle, seen, (start,))
    places = consistent_places(bundle.estimate.map, sheets, sheets.known_std_m or _KNOWN_STD_m)
    sheets = places.sheets
    known = _compare(bundle.estimate.map, sheets)
    fixed: tuple[int, ...] = (start,)
    if numbers := known_places(bundle.estimate.map, sheets)[0]:
        fixed = tuple(seen.ids[k] for k in numbers)
        bundle = _held(bundle, seen, sheets)
    faults = [*places.faults, *_faults(cover, suspicion, known), *misfits(bundle)]
    notes = _notes(bundle, cover, known, sheets, fixed)
    return MapFit(
        *(bundle, seen, fixed, cover, tuple(dropped), suspicion, known),
        *(tuple(faults), tuple(warnings(sightings, dropped)), tuple(notes)),
    )


def _observations(
    sightings: Sequence[Sighting], sheets: MarkerSheets, island: set[int]
) -> SeenMarkers:
    rows = [
        (image, marker, corners)
        for image, one in enumerate(sightings)
        if one.problem is None
        for marker, corners in one.corners_px.items()
        if marker in island
    ]
    sizes = {marker: sheets.size_of(marker) for marker in island}
    return SeenMarkers.of([one.name for one in sightings], rows, sizes)


def _without_suspects(
    seen: SeenMarkers, lens: FloatArray, reference: int | None
) -> tuple[Bundle, SeenMarkers, list[Suspect]]:
    """Return the fit without the markers that do not fit."""
    if reference is not None and reference not in seen.ids:
        raise InvalidRequestError(
            f"reference marker {reference} is not in the map; the map has {listed(seen.ids)}"
        )
    dropped: list[Suspect] = []
    for _ in range(_MOST_ROUNDS):
        first = first_map(seen, square_poses(seen, lens), reference)
        bundle = adjust(Estimate(first, lens), seen, (first.reference,))
        found = suspects(bundle, seen)
        if not found or 2 * len(found) > len(
            seen.ids
        ):  # so many misfits have another cause than single markers
            break
        dropped += found
        for one in found:
            seen = one.without(seen)
        bad = [one.marker for one in found if one.images is None]
        reference = None if reference in bad else reference
    return bundle, seen, dropped


def _compare(map_: MarkerMap, sheets: MarkerSheets) -> KnownFit | None:
    """Return how well the map agrees with known marker poses; None if there are fewer than two."""
    if len(known_places(map_, sheets)[0]) < 2:
        return None
    moved, numbers, places, _ = aligned(map_, sheets)
    middles = moved.position_m[numbers]
    middles, places = middles - middles.mean(axis=0), places - places.mean(axis=0)
    scale = float(np.linalg.norm(places) / np.linalg.norm(middles))
    left = scale * middles - places
    return KnownFit(scale, float(np.sqrt((left**2).sum(axis=1).mean())))


def _held(bundle: Bundle, seen: SeenMarkers, sheets: MarkerSheets) -> Bundle:
    """Return the fit with the known markers fixed at their poses."""
    moved, numbers, places, turns = aligned(bundle.estimate.map, sheets)
    moved.position_m[numbers] = places
    moved.rotation[numbers] = turns
    fixed = tuple(moved.ids[k] for k in numbers)
    return adjust(Estimate(moved, bundle.estimate.lens), seen, fixed)


def warnings(sightings: Sequence[Sighting], dropped: Sequence[Suspect]) -> list[str]:
    """Return faults of single markers, as text."""
    said = []
    twice = Counter(marker for one in sightings for marker in one.repeated)
    for marker, images in sorted(twice.items()):
        said.append(f"marker {marker} is twice in {images} images: its id was printed twice")
    mirrored = Counter(marker for one in sightings for marker in one.mirrored)
    for marker, images in sorted(mirrored.items()):
        read = any(marker in one.corners_px for one in sightings)
        if images >= _MIRRORED_IMAGES or not read:
            where = "an image" if images == 1 else f"{images} images"
            said.append(f"marker {marker} is printed as a mirror image, as {where} show; left out")
    texts: dict[int, list[str]] = {}
    for one in dropped:
        texts.setdefault(one.marker, []).append(one.text)
    return said + ["; without these: ".join(each) for each in texts.values()]


def _faults(cover: Coverage, lens: LensSuspicion, known: KnownFit | None) -> list[str]:
    faults = []
    if len(cover.islands) > 1:
        faults.append(
            f"{len(cover.islands)} islands: the map contains the largest, "
            f"{len(cover.islands[0])} of "
            f"{len(cover.ids)} markers"
        )
    if lens.wrong:
        faults.append(
            "the intrinsics do not fit the camera as it is now: the images show a focal "
            f"length {100.0 * lens.focal_change:+.2f} % different, with which they fit to "
            f"{lens.rms_px:.2f} px; was the lens turned or the resolution changed? `cdpr "
            "camera calibrate`"
        )
    if known is not None and abs(known.scale - 1.0) > _SCALE_OFF:
        faults.append(
            f"known markers are {100.0 * (known.scale - 1.0):+.2f} % farther apart than "
            f"with the stated size: measure the black square; it may be {known.scale:.4f} "
            "times as large"
        )
    return faults


def misfits(bundle: Bundle) -> list[str]:
    """Return a fault if many corners do not fit, regardless of their markers."""
    seen = np.isfinite(bundle.off_px)
    share = 1.0 - float((bundle.weight[seen] > _MISFIT_WEIGHT).mean())
    if share <= _MISFIT_SHARE:
        return []
    return [
        f"{100.0 * share:.0f} % of all corners do not fit, and no single marker "
        "explains it: was the camera moving, or are several sheets loose?"
    ]


def _notes(
    bundle: Bundle,
    cover: Coverage,
    known: KnownFit | None,
    sheets: MarkerSheets,
    fixed: Sequence[int],
) -> list[str]:
    notes = list(cover.advice)
    if known is None:
        notes.append(
            f"the map's scale comes from the stated size ({1e3 * sheets.size_m:g} mm): "
            "images alone cannot verify it; two markers at known places, or the robot's "
            "cables, can"
        )
    if bundle.sheets.sigma_m > 0.0:
        notes.append(
            f"corners are {1e3 * bundle.sheets.sigma_m:.2f} mm off on their sheets, the same in "
            "all images: the paper is not flat, or the printer's scale is wrong; more "
            "images do not help"
        )
    in_frame, shape = (_typical_mm(one) for one in (bundle.marker_sigma_m, bundle.shape_sigma_m))
    if len(fixed) == 1 and in_frame > _FRAME_RATIO * shape:
        notes.append(
            f"places are uncertain by {shape:.2f} mm relative to each other, and by "
            f"{in_frame:.2f} mm in the frame of marker {fixed[0]} (3 sigma), because the "
            "tilt of one sheet is not well known; a larger sheet or known places give a "
            "better frame"
        )
    return notes


def _typical_mm(sigma_m: FloatArray) -> float:
    """Return 3 sigma of positions: root mean square of the lengths of deviations (m, 3)."""
    return 3e3 * rms(sigma_m[np.isfinite(sigma_m).all(axis=1)])


def verdict(fit: MapFit) -> str:
    """Return one sentence on the quality of a map."""
    sigma = 3e3 * np.linalg.norm(fit.bundle.shape_sigma_m[fit.map.placed], axis=1)
    worst = int(np.argmax(sigma))
    ids = np.array(fit.map.ids)[fit.map.placed]
    rms = fit.bundle.rms_px
    how = "good" if rms < _GOOD_px else "usable" if rms < _POOR_px else "poor"
    if fit.faults:
        how = "not to be trusted"
    dropped = [one.marker for one in fit.dropped if one.images is None]
    without = f", without {listed(dropped)}" if dropped else ""
    return (
        f"{how}{without}: {int(fit.map.placed.sum())} markers from "
        f"{int(fit.map.located.sum())} images, corners fit to "
        f"{rms:.3f} px; places are uncertain by "
        f"{_typical_mm(fit.bundle.shape_sigma_m):.2f} mm relative to each other (3 "
        f"sigma), at worst marker {ids[worst]} by {sigma[worst]:.2f} mm"
    )
