"""A first map: how markers lie to each other by consent of the images, then along a tree of them.

Each image shows each marker in one of two poses, so that two markers lie to each other in one of
four ways. Only one of the four is the same in all images that show both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.markers.geometry.rotations import angles
from cdpr_rt.calibration.markers.geometry.square_pose import SquarePoses
from cdpr_rt.calibration.markers.marker_map import MarkerMap
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers

_MOST_IMAGES = 24
"""Of a pair of markers, so many are compared."""
_SAME_rad = 0.12
_SAME_SHARE = 0.08
"""Two measurements agree within this angle and this share of the distance of the two markers."""
_EDGE_COST = 0.05
"""Of one more step in the tree, against that of few images."""


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
        """Cost of a step along it: small where many images agree, and few do not."""
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
    """Return the way that most images agree on, of the four ways of each."""
    Ra, Rb = poses.rotation[rows[:, 0]], poses.rotation[rows[:, 1]]
    ta, tb = poses.position_m[rows[:, 0]], poses.position_m[rows[:, 1]]
    back = Ra.transpose(0, 1, 3, 2)
    R = (back[:, :, None] @ Rb[:, None]).reshape(-1, 3, 3)
    t = (back[:, :, None] @ (tb[:, None] - ta[:, :, None])[..., None]).reshape(-1, 3)
    error = (poses.error[rows[:, 0]][:, :, None] + poses.error[rows[:, 1]][:, None]).ravel()
    image = np.repeat(np.arange(len(rows)), 4)
    turned = angles(R[:, None] @ R.transpose(0, 2, 1)[None])
    reach = _SAME_SHARE * max(float(np.median(np.linalg.norm(t, axis=1))), 1e-6)
    shifted = np.linalg.norm(t[:, None] - t[None], axis=2)
    agrees = (turned < _SAME_rad) & (shifted < reach)
    votes = np.array([len(set(image[line])) for line in agrees])
    # of ways with as many votes the one that fits best
    worth = votes - error / (error.max() + 1e-300) / 2.0
    best = int(np.argmax(worth))
    with_it = np.flatnonzero(agrees[best])
    left, _, right = np.linalg.svd(R[with_it].sum(axis=0))
    return Pair(a, b, left @ right, t[with_it].mean(axis=0), int(votes[best]), len(rows))


def placed_along_tree(pairs: list[Pair], count: int, start: int) -> tuple[FloatArray, FloatArray]:
    """Return positions (m, 3) and rotations (m, 3, 3) in the frame of marker number `start`.

    Along the cheapest ways from there, where a pair costs the less the more images agree on it.
    Markers that no way leads to have nan.
    """
    position, rotation = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    position[start], rotation[start] = 0.0, np.eye(3)
    if not pairs:
        return position, rotation
    graph: Any = csr_array(
        (
            [one.cost for one in pairs],
            ([one.a for one in pairs], [one.b for one in pairs]),
        ),
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

    Each placed marker of an image proposes two; that is taken which fits all of them best, by the
    median of how far they are off. Images without a placed marker have nan.
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
        # what the markers themselves look like from here, by their own better pose
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
    """Return the id of the marker that most images place alike against the others."""
    votes = np.zeros(len(seen.ids))
    for pair in pairs:
        votes[[pair.a, pair.b]] += 2.0 * pair.images - pair.of
    return seen.ids[int(votes.argmax())]


def first_map(seen: SeenMarkers, poses: SquarePoses, reference: int | None = None) -> MarkerMap:
    """Return a map of all that hangs together with the marker `reference`, an id.

    Where left out it is the one that the images agree on most.
    """
    pairs = marker_pairs(seen, poses)
    reference = most_agreed(pairs, seen) if reference is None else reference
    start = seen.ids.index(reference)
    position, rotation = placed_along_tree(pairs, len(seen.ids), start)
    places, turns = located_cameras(seen, poses, position, rotation)
    return MarkerMap(
        seen.ids, reference, seen.size_m, position, rotation, seen.names, places, turns
    )
