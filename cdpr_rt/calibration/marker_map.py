"""Marker maps: seen markers, poses of markers and camera, coverage, and known marker poses."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Any, Self

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from cdpr_profiles.camera import MarkerSheets, rotation_vector_rad
from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration.camera_geometry import angles, exponentials, nearest_rotation
from cdpr_rt.errors import InvalidRequestError

# Markers seen in a set of images.

CORNERS = np.array([(-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (-0.5, -0.5, 0.0)])
"""Corners of a marker of size 1 in its own frame, in the order of detectors: clockwise from the
upper left. Its frame has x to the right, y upward and z out of the sheet."""


@dataclass(frozen=True)
class SeenMarkers:
    """n markers seen in images: `image` (n,), `marker` (n,) and `corners_px` (n, 4, 2).

    `image` indexes `names`, in the order in which the images were taken; `marker` indexes `ids`.
    """

    names: tuple[str, ...]
    ids: tuple[int, ...]
    image: IntArray
    marker: IntArray
    corners_px: FloatArray
    size_m: FloatArray
    """Size of each marker in `ids`, (m,)."""

    @classmethod
    def of(
        cls,
        names: Iterable[str],
        seen: Iterable[tuple[int, int, FloatArray]],
        size_m: Mapping[int, float],
    ) -> Self:
        """Return seen markers from tuples (index of the image, id, corners (4, 2)).

        Raises InvalidRequestError if a marker is twice in an image, or has no size.
        """
        rows = sorted(seen, key=lambda row: row[:2])
        places = [row[:2] for row in rows]
        if len(set(places)) < len(places):
            image, marker = next(a for a, b in pairwise(places) if a == b)
            raise InvalidRequestError(f"marker {marker} appears twice in image number {image}")
        ids = tuple(sorted({marker for _, marker in places}))
        if missing := [marker for marker in ids if marker not in size_m]:
            raise InvalidRequestError(f"marker {missing[0]} was seen, but its size is not stated")
        number = {marker: k for k, marker in enumerate(ids)}
        return cls(
            names=tuple(names),
            ids=ids,
            image=np.array([image for image, _ in places], np.int64),
            marker=np.array([number[marker] for _, marker in places], np.int64),
            corners_px=np.array([row[2] for row in rows], float).reshape(-1, 4, 2),
            size_m=np.array([size_m[marker] for marker in ids]),
        )

    def __len__(self) -> int:
        return len(self.image)

    @property
    def corners_m(self) -> FloatArray:
        """Corners of each seen marker in its own frame, (n, 4, 3)."""
        return np.asarray(CORNERS * self.size_m[self.marker][:, None, None])

    def keep(self, kept: BoolArray) -> SeenMarkers:
        """Return only the seen markers with `kept` (n,) true; names and ids do not change."""
        return replace(
            self, image=self.image[kept], marker=self.marker[kept], corners_px=self.corners_px[kept]
        )

    def of_images(self, chosen: IntArray) -> SeenMarkers:
        """Return the markers in the chosen images (k,), with images numbered in this order."""
        place = np.full(len(self.names), -1)
        place[chosen] = np.arange(len(chosen))
        kept = self.keep(place[self.image] >= 0)
        names = tuple(self.names[i] for i in chosen)
        return replace(kept, names=names, image=place[kept.image])


@dataclass(frozen=True)
class MarkerMap:
    """Poses of m markers and of the camera in k images, all in the frame of the map.

    The frame is that of the marker `reference`, or of the layout if known marker poses were given.
    Markers and images without a pose have nan.
    """

    ids: tuple[int, ...]
    reference: int
    size_m: FloatArray
    """Sizes of the markers' black squares, (m,)."""
    position_m: FloatArray
    """Positions of the markers' centres, (m, 3)."""
    rotation: FloatArray
    """Rotations from a marker's frame to the map's, (m, 3, 3)."""
    names: tuple[str, ...]
    """Names of the images."""
    camera_position_m: FloatArray
    """Positions of the camera, (k, 3)."""
    camera_rotation: FloatArray
    """Rotations from the camera's frame to the map's, (k, 3, 3)."""

    @property
    def placed(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Whether each marker has a pose in the map, (m,)."""
        return np.isfinite(self.position_m[:, 0])

    @property
    def located(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Whether the camera has a pose in each image, (k,)."""
        return np.isfinite(self.camera_position_m[:, 0])

    def corners_m(self) -> FloatArray:
        """Return the markers' corners in the frame of the map, (m, 4, 3)."""
        flat = CORNERS * self.size_m[:, None, None]
        return np.asarray(flat @ self.rotation.transpose(0, 2, 1) + self.position_m[:, None])

    def moved(self, turn: FloatArray, shift: FloatArray, reference: int) -> MarkerMap:
        """Return the map transformed by x -> `turn` x + `shift`."""
        return MarkerMap(
            self.ids,
            reference,
            self.size_m,
            self.position_m @ turn.T + shift,
            turn @ self.rotation,
            self.names,
            self.camera_position_m @ turn.T + shift,
            turn @ self.camera_rotation,
        )


def best_fit(points: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return R, t with `others` ≈ R `points` + t, both (n, k): Umeyama 1991, least squares."""
    middle, other = points.mean(axis=0), others.mean(axis=0)
    turn = nearest_rotation((others - other).T @ (points - middle))
    return turn, other - turn @ middle


# Markers detected in one image, in the form of detectors and data files.


@dataclass(frozen=True)
class Sighting:
    """Markers detected in one image."""

    name: str
    corners_px: Mapping[int, FloatArray]
    """Corners of each marker that is sharp and appears once, (4, 2)."""
    repeated: tuple[int, ...] = ()
    """Ids that appear more than once."""
    unsharp: tuple[int, ...] = ()
    """Ids whose edges are hidden or blurred."""
    mirrored: tuple[int, ...] = ()
    """Ids that appear only in the mirror image."""
    problem: str | None = None
    """Fault of the image as a whole, as text, or None."""


def laid_out(sightings: Sequence[Sighting], placed: Collection[int]) -> list[Sighting]:
    """Return sightings without ids that were not laid out; unchanged if `placed` is empty.

    A chessboard or a poster may look like a marker, with sharp edges and no wrong bit.
    """
    if not placed:
        return list(sightings)

    def ours(ids: Collection[int]) -> tuple[int, ...]:
        return tuple(marker for marker in ids if marker in placed)

    return [
        replace(
            one,
            corners_px={marker: one.corners_px[marker] for marker in ours(one.corners_px)},
            repeated=ours(one.repeated),
            unsharp=ours(one.unsharp),
            mirrored=ours(one.mirrored),
        )
        for one in sightings
    ]


# Whether the images taken so far can become one map, and what to do otherwise. This depends only on
# the ids in each image, as does the share of seen markers in section 3.7.3 of the thesis.

_FEW_IMAGES = 3
_LISTED = 12


@dataclass(frozen=True)
class Coverage:
    """Connection of the images by the markers that they share."""

    images: int
    ids: tuple[int, ...]
    """All seen markers, or only those that were laid out if their ids are known."""
    islands: tuple[tuple[int, ...], ...]
    """Markers connected by images that show several of them, the largest island first."""
    share_seen: float | None
    """Share of the laid-out markers that were seen, if their ids are known."""
    unseen: tuple[int, ...]
    seldom: tuple[int, ...]
    """Markers seen in fewer than three images."""
    advice: tuple[str, ...]

    @property
    def apart(self) -> list[tuple[int, ...]]:
        """Islands other than the largest, without uncertain markers.

        A marker is uncertain if only one or two images show it.
        """
        return [one for one in self.islands[1:] if set(one) - set(self.seldom)]

    def lines(self) -> list[str]:
        """Return lines of text: the share of seen markers, and advice."""
        share = self.share_seen
        many = len(self.ids) if share is None else f"{share:.0%} of the"
        return [f"{many} markers seen", *self.advice]

    def as_json(self) -> dict[str, Any]:
        """Return the coverage as values for JSON."""
        return {
            "share_seen": self.share_seen,
            "islands": [list(island) for island in self.islands],
            "unseen": list(self.unseen),
            "seldom": list(self.seldom),
            "advice": list(self.advice),
        }


def coverage(sightings: Sequence[Sighting], placed: Sequence[int] = ()) -> Coverage:
    """Return how sightings are connected; `placed` are all ids that were laid out, if known."""
    read = {marker for one in sightings for marker in one.corners_px}
    sightings = laid_out(sightings, placed)
    shown = [tuple(one.corners_px) for one in sightings]
    ids = tuple(sorted({marker for markers in shown for marker in markers}))
    islands = _islands(shown, ids)
    counts = {marker: sum(marker in markers for markers in shown) for marker in ids}
    unseen = tuple(sorted(set(placed) - set(ids)))
    seldom = tuple(marker for marker in ids if counts[marker] < _FEW_IMAGES)
    useless = sum(len(markers) < 2 for markers in shown)
    share = 1.0 - len(unseen) / len(placed) if placed else None
    return Coverage(
        *(len(sightings), ids, islands, share, unseen, seldom),
        tuple(
            _mirrored(sightings, ids)
            + _advice(islands, unseen, seldom, useless, len(sightings))
            + _strange(read - set(ids))
        ),
    )


def _islands(shown: Sequence[tuple[int, ...]], ids: Sequence[int]) -> tuple[tuple[int, ...], ...]:
    number = {marker: k for k, marker in enumerate(ids)}
    links = [(number[markers[0]], number[other]) for markers in shown for other in markers[1:]]
    rows, columns = np.array(links, np.int64).reshape(-1, 2).T
    graph = csr_array((np.ones(len(links)), (rows, columns)), shape=(len(ids), len(ids)))
    count, label = connected_components(graph, directed=False)
    found = [tuple(i for i, of in zip(ids, label, strict=True) if of == k) for k in range(count)]
    return tuple(sorted(found, key=lambda one: (-len(one), one)))


def _advice(
    islands: Sequence[tuple[int, ...]],
    unseen: Sequence[int],
    seldom: Sequence[int],
    useless: int,
    images: int,
) -> list[str]:
    said = []
    if not islands:
        return ["no image shows a marker: were markers of another dictionary printed?"]
    for island in islands[1:]:
        said.append(
            f"no image shows {listed(island)} together with the others: take one that shows one "
            f"of them and one of {listed(islands[0])}, or put a marker between"
        )
    if unseen:
        said.append(f"{listed(unseen)} never seen: add poses there, tilt more, or move the sheets")
    if seldom:
        said.append(f"{listed(seldom)} seen in fewer than {_FEW_IMAGES} images: add poses there")
    if useless > images // 4:
        said.append(
            f"{useless} of {images} images show fewer than two markers and cannot be used "
            "for the map: put sheets closer together, or move the camera up"
        )
    return said


def _mirrored(sightings: Sequence[Sighting], ids: Sequence[int]) -> list[str]:
    """Return advice if more markers are seen mirrored than the right way round."""
    mirrored = sorted({marker for one in sightings for marker in one.mirrored})
    if len(mirrored) <= len(ids):
        return []
    return [f"{listed(mirrored)} are mirror images: are all sheets, or the images, mirrored?"]


def _strange(ids: set[int]) -> list[str]:
    """Return a warning about ids that were read but not laid out."""
    if not ids:
        return []
    return [
        f"{listed(sorted(ids))} detected, but not among the markers laid out (placed): "
        "left out; another object looks like these markers"
    ]


def listed(ids: Sequence[int]) -> str:
    """Return "marker 3" or "markers 3, 5, 8" for ids, shortened if there are many."""
    shown = ", ".join(map(str, ids[:_LISTED]))
    more = f" and {len(ids) - _LISTED} more" if len(ids) > _LISTED else ""
    return f"marker{'s' if len(ids) != 1 else ''} {shown}{more}"


# Markers with known poses: the frame that they give to a map, and poses that contradict it. A map
# from images alone is the test. Two known markers determine its frame and scale; the pair with
# which most others agree is used. If two markers agree after their poses are exchanged, they were
# exchanged in the file.

_SIGMAS, _SIZES = 6.0, 0.3
"""Distance above which a known position contradicts others: in standard deviations, and in sizes of
a sheet."""
_TURN_rad = 0.35
_SCALES = (0.9, 1.1)
_ALL_PAIRS = 10
"""Number of known markers up to which all pairs are tried."""


@dataclass(frozen=True)
class KnownPlaces:
    """Consistent marker poses, and the faults of the others."""

    sheets: MarkerSheets
    """The sheets, with consistent poses only."""
    faults: tuple[str, ...]
    contradictory: bool = False
    """Whether no majority of the poses is consistent; then no pose is kept."""


def known_places(map_: MarkerMap, sheets: MarkerSheets) -> tuple[list[int], FloatArray, FloatArray]:
    """Return indices in the map, positions and rotations of known markers that the map contains."""
    known = [
        one for one in sheets.known if one.id in map_.ids and map_.placed[map_.ids.index(one.id)]
    ]
    numbers = [map_.ids.index(one.id) for one in known]
    places = np.array([one.position_m for one in known]).reshape(-1, 3)
    turns = np.array([rotation_vector_rad(one.rotation_deg) for one in known]).reshape(-1, 3)
    return numbers, places, exponentials(turns)


def aligned(
    map_: MarkerMap, sheets: MarkerSheets
) -> tuple[MarkerMap, list[int], FloatArray, FloatArray]:
    """Return the map moved to the known markers, and the results of `known_places`.

    The corners of these markers are matched by least squares; the map keeps its scale.
    """
    numbers, places, turns = known_places(map_, sheets)
    corners = map_.corners_m()[numbers]
    flat = (corners - map_.position_m[numbers][:, None]) @ map_.rotation[numbers]
    own = flat @ turns.transpose(0, 2, 1) + places[:, None]
    turn, shift = best_fit(corners.reshape(-1, 3), own.reshape(-1, 3))
    return map_.moved(turn, shift, map_.ids[numbers[0]]), numbers, places, turns


def consistent_places(map_: MarkerMap, sheets: MarkerSheets, std_m: float) -> KnownPlaces:
    """Return the known marker poses that agree with a map, in any frame and scale.

    `std_m` is the standard deviation of each coordinate of a known position.
    """
    layout = _Layout.of(map_, sheets, std_m)
    count = len(layout.places)
    order, exchanged = np.arange(count), []
    while not (good := layout.agreeing(order)).all():
        found = _exchange(layout, order, good)
        if found is None:
            break
        order[list(found)] = order[list(found[::-1])]
        exchanged.append(found)
    ids = layout.ids
    if (good.sum() < 2 and count > 1) or 2 * good.sum() < count:
        text = (
            f"the known places of {listed(ids)} contradict the map from the images, and it "
            "is not known which are wrong: measure them again"
        )
        return KnownPlaces(_without(sheets, ids), (text,), contradictory=True)
    faults = [
        f"{listed(sorted((ids[i], ids[j])))} are exchanged: each lies at the known "
        "place of the other; their places are not used: exchange their ids in the file "
        "of the markers"
        for i, j in exchanged
    ]
    faults += [
        f"marker {ids[k]} does not lie at its known place, according to the images and "
        "the other known markers; its place is not used: measure it again"
        for k in np.flatnonzero(~good)
    ]
    wrong = {k for pair in exchanged for k in pair} | set(np.flatnonzero(~good).tolist())
    return KnownPlaces(_without(sheets, [ids[k] for k in wrong]), tuple(faults))


def _without(sheets: MarkerSheets, ids: Sequence[int]) -> MarkerSheets:
    known = tuple(one for one in sheets.known if one.id not in ids)
    return sheets.model_copy(update={"known": known})


@dataclass(frozen=True)
class _Layout:
    """Known markers in the map, and their poses in the file."""

    ids: tuple[int, ...]
    map_m: FloatArray
    """Corners in the map, (m, 4, 3)."""
    map_turn: FloatArray
    flat_m: FloatArray
    """Corners in the markers' frames, (m, 4, 3)."""
    places: FloatArray
    turns: FloatArray
    limit_m: FloatArray
    """Distance above which a marker contradicts others, (m,)."""

    @classmethod
    def of(cls, map_: MarkerMap, sheets: MarkerSheets, std_m: float) -> _Layout:
        numbers, places, turns = known_places(map_, sheets)
        corners = map_.corners_m()[numbers]
        flat = (corners - map_.position_m[numbers][:, None]) @ map_.rotation[numbers]
        limit = np.maximum(_SIGMAS * std_m, _SIZES * map_.size_m[numbers])
        ids = tuple(map_.ids[k] for k in numbers)
        return cls(ids, corners, map_.rotation[numbers], flat, places, turns, limit)

    def agreeing(self, order: IntArray) -> BoolArray:
        """Return the largest set of markers that agree, (m,), with the given poses in this order.

        A single marker always agrees.
        """
        best = np.zeros(len(order), bool)
        if len(order) < 2:
            return ~best
        for i, j in self._pairs():
            found = self._with_frame_of([i, j], order)
            if found.sum() > best.sum():
                best = found
            if best.all():
                break
        return best

    def _pairs(self) -> Iterator[tuple[int, int]]:
        if len(self.ids) <= _ALL_PAIRS:
            yield from combinations(range(len(self.ids)), 2)
            return
        for i, place in enumerate(self.places):
            yield i, int(np.linalg.norm(self.places - place, axis=1).argmax())

    def _with_frame_of(self, pair: list[int], order: IntArray) -> BoolArray:
        """Return which markers agree if two of them determine frame and scale, (m,)."""
        places, turns = self.places[order], self.turns[order]
        middles = self.map_m.mean(axis=1)
        given_m, seen_m = (
            float(np.linalg.norm(p[pair[0]] - p[pair[1]])) for p in (places, middles)
        )
        scale = given_m / max(seen_m, 1e-9)
        if not _SCALES[0] < scale < _SCALES[1]:
            return np.zeros(len(order), bool)
        own = scale * self.flat_m[pair] @ turns[pair].transpose(0, 2, 1) + places[pair][:, None]
        turn, shift = best_fit(scale * self.map_m[pair].reshape(-1, 3), own.reshape(-1, 3))
        off_m = np.linalg.norm(scale * middles @ turn.T + shift - places, axis=1)
        off_rad = angles((turn @ self.map_turn) @ turns.transpose(0, 2, 1))
        return np.asarray((off_m < self.limit_m) & (off_rad < _TURN_rad))


def _exchange(layout: _Layout, order: IntArray, good: BoolArray) -> tuple[int, int] | None:
    """Return the exchange of two poses after which these two and most others agree."""
    doubted = np.flatnonzero(~good) if good.sum() > 2 else np.arange(len(order))
    if len(doubted) > _ALL_PAIRS:
        return None
    counts: dict[tuple[int, int], int] = {}
    for pair in combinations(doubted.tolist(), 2):
        tried = order.copy()
        tried[list(pair)] = order[list(pair[::-1])]
        agrees = layout.agreeing(tried)
        if agrees[list(pair)].all():
            counts[pair] = int(agrees.sum())
    most = max(counts.values(), default=0)
    best = [pair for pair, count in counts.items() if count == most]
    return best[0] if len(best) == 1 and most >= good.sum() + 2 else None
