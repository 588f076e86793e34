"""A path as nodes along its length: positions with two derivatives, between which it is smooth.

Corners are cut by curves of fifth order that take over position, direction and curvature on both
sides (Hermite interpolation), so that acceleration has no step where a corner begins.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.motion.path.description import Coordinates, PathDescription
from cdpr_rt.motion.path.pieces import Pieces, pieces_of

_SPACING_m: Final = 0.01
_TURN_rad: Final = 0.08
"""Between nodes at most, along a piece and around an arc."""
_LEAST_m: Final = 5e-4
"""Least cut of a corner by which nodes are spaced, which bounds their number."""
_IN_CORNER: Final = 8
"""Intervals of a corner that is cut."""
_FULLNESS: Final = 2.0
"""Length of the derivative at both ends of a corner over what is cut off there. With 2 a corner
that does not turn is a line at even speed; the inner two control points are 0.8 of the cut away
from its ends, so that all of the curve is within the cut of the corner's point."""
_GAUSS: Final = (
    (0.5 - np.sqrt(0.15), 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + np.sqrt(0.15), 5.0 / 18.0),
)  # fmt: skip


@dataclass(frozen=True)
class PathNodes:
    """N nodes; those of one run between two stops follow each other, each run has its own."""

    coordinates: Coordinates
    scale: FloatArray
    """(d,): how many metres each coordinate counts for."""
    s: FloatArray
    """Length along the path, (N,); the last of a run and the first of the next have the same."""
    q: FloatArray
    """(N, d)"""
    first: FloatArray
    """First derivative by length."""
    second: FloatArray
    speed: FloatArray
    """Wanted at most, (N,): m/s, or rad/s where it only turns."""
    line: IntArray
    """Line of the file, (N,)."""
    runs: IntArray
    """First and last node of each, (r, 2)."""
    dwell_s: FloatArray
    """Time at rest after each run, (r,)."""
    waits: BoolArray

    @property
    def length_m(self) -> float:
        """Length of the origin's path."""
        k = self.coordinates.positions
        return float(np.linalg.norm(np.diff(self.q[:, :k], axis=0), axis=1).sum())


def nodes_of(path: PathDescription, scale: FloatArray) -> PathNodes:
    """Return the nodes of a path with cut corners; of one that leads nowhere a single one."""
    pieces = pieces_of(path, scale)
    m, d = len(pieces.length), len(scale)
    if not m:
        dwell = sum(move.dwell_s for move in path.moves)
        one, none = np.zeros((1, d)), np.zeros((1, d))
        return PathNodes(
            path.coordinates, scale, np.zeros(1), one + path.start, none, none.copy(),
            np.full(1, np.inf), np.array([path.start_line]), np.zeros((1, 2), np.int64),
            np.array([dwell]), np.array([any(move.waits for move in path.moves)]),
        )  # fmt: skip
    along = _along_pieces(pieces)
    corners = _corners(pieces, scale, path.coordinates.positions)
    parts = [np.concatenate(pair) for pair in zip(along, corners, strict=True)]
    order = np.lexsort((parts[1], parts[0]))
    piece, _, q, first, second, step, speed, line = (part[order] for part in parts)
    fresh = np.flatnonzero(np.isnan(step))  # the first of each run
    step[fresh] = 0.0
    runs = np.stack([fresh, np.append(fresh[1:], len(step)) - 1], axis=1)
    last = piece[runs[:, 1]].astype(np.int64)
    return PathNodes(
        path.coordinates, scale, np.cumsum(step), q, first, second, speed, line.astype(np.int64),
        runs.astype(np.int64), pieces.dwell_s[last], pieces.waits[last],
    )  # fmt: skip


def _along_pieces(pieces: Pieces) -> tuple[FloatArray, ...]:
    """Return the nodes of what is left of the pieces, with places by which they are sorted."""
    m = len(pieces.length)
    cut_before = np.concatenate([[0.0], pieces.cut[:-1]])
    begins = np.concatenate([[True], pieces.stops[:-1]])
    left = pieces.length - cut_before - pieces.cut
    straight = pieces.angle_rad == 0.0
    apart_m = np.where(straight, 2.0 / np.pi, 1.0) * _SPACING_m
    count = np.ceil(np.maximum(left / apart_m, np.abs(pieces.angle_rad) / _TURN_rad))
    # the first interval beside a corner is a quarter of what is cut off there
    cuts = np.stack([cut_before, pieces.cut])
    narrow = np.maximum(np.where(cuts > 0.0, cuts, np.inf).min(axis=0), _LEAST_m)
    beside = np.ceil(np.pi * np.sqrt(np.maximum(left, 0.0) / narrow))
    count = np.maximum(count, np.where(straight, beside, 0.0))
    ends = begins | pieces.stops | (pieces.angle_rad != 0.0)
    count = np.maximum(count, np.where(ends, 4, 1)).astype(np.int64)
    count = np.where(left > 1e-9 * pieces.length, count, 0)
    # a piece gives all of its nodes but its first one, unless a run begins there
    given = count + begins
    i = np.repeat(np.arange(m), given)
    number = np.arange(given.sum()) - np.repeat(np.cumsum(given) - given, given)
    number = number + np.where(begins[i], 0, 1)
    share, before = (
        _dense_at_ends(np.maximum(place, 0) / np.maximum(count[i], 1), straight[i])
        for place in (number, number - 1)
    )
    at = (cut_before[i] + share * left[i]) / pieces.length[i]
    q, first, second = pieces.at(i, at)
    step = np.where(number == 0, np.nan, left[i] * (share - before))
    return (
        i.astype(float),
        number.astype(float),
        q,
        first,
        second,
        step,
        pieces.speed[i],
        (pieces.line[i].astype(float)),
    )


def _dense_at_ends(share: FloatArray, straight: BoolArray) -> FloatArray:
    """Return shares of pieces that are closer to each other at the ends of straight ones.

    A corner's speed holds up to the next node: cut narrowly, it would be that of a long stretch.
    """
    return np.where(straight, 0.5 - 0.5 * np.cos(np.pi * share), share)


def _corners(pieces: Pieces, scale: FloatArray, positions: int) -> tuple[FloatArray, ...]:
    """Return the nodes of the corners that are cut, but for the first of each."""
    i = np.flatnonzero(pieces.cut > 0.0)
    cut = pieces.cut[i]
    start = pieces.at(i, 1.0 - cut / pieces.length[i])
    end = pieces.at(i + 1, cut / pieces.length[i + 1])
    stretch = (_FULLNESS * cut)[:, None]
    ends = tuple((q, stretch * first, stretch**2 * second) for q, first, second in (start, end))
    u = np.arange(1, _IN_CORNER + 1) / _IN_CORNER
    q, du, ddu = (_hermite(ends, u, order) for order in range(3))  # (c, 8, d) each
    step = np.zeros(q.shape[:2])
    for share, weight in _GAUSS:
        speed = _hermite(ends, u - (1.0 - share) / _IN_CORNER, 1)
        step += weight / _IN_CORNER * np.linalg.norm(scale * speed, axis=2)
    size = np.linalg.norm(scale * du, axis=2)[..., None]
    first = du / size
    along = (scale * first * scale * ddu).sum(axis=2)[..., None]
    second = (ddu - first * along) / size**2
    first[:, -1], second[:, -1] = end[1], end[2]  # as the piece has them, not rounded
    halves = np.where(u <= 0.5, 0, 1)
    line = pieces.line[i[:, None] + halves]
    speed = np.minimum(pieces.speed[i], pieces.speed[i + 1])[:, None] + 0.0 * step
    turns_only = ~np.any(pieces.way[:, :positions], axis=1) & (pieces.angle_rad == 0.0)
    mixed = turns_only[i] != turns_only[i + 1]
    # m/s of one and rad/s of the other are not to be compared
    speed[mixed] = np.where(halves == 0, pieces.speed[i, None], pieces.speed[i + 1, None])[mixed]
    c, d = len(i), q.shape[2]
    place = np.repeat(i.astype(float), _IN_CORNER)
    number = np.tile(1e9 + u, c)  # after all of the piece
    flat = [part.reshape(-1, d) for part in (q, first, second)]
    return place, number, *flat, step.ravel(), speed.ravel(), line.ravel().astype(float)


def _hermite(ends: tuple[tuple[FloatArray, ...], ...], u: FloatArray, order: int) -> FloatArray:
    """Return the curve of fifth order between two ends, or a derivative, (c, k, d).

    Each end is position, first and second derivative by u, (c, d) each; `u` (k,) is from 0 to 1.
    """
    (p0, v0, a0), (p1, v1, a1) = ends
    gap = p1 - p0 - v0 - 0.5 * a0
    slope, bend = v1 - v0 - a0, a1 - a0
    c3 = 10.0 * gap - 4.0 * slope + 0.5 * bend
    c4 = -15.0 * gap + 7.0 * slope - bend
    c5 = 6.0 * gap - 3.0 * slope + 0.5 * bend
    x = u[None, :, None]
    p0, v0, a0, c3, c4, c5 = (part[:, None] for part in (p0, v0, a0, c3, c4, c5))
    if order == 0:
        return p0 + x * (v0 + x * (0.5 * a0 + x * (c3 + x * (c4 + x * c5))))
    if order == 1:
        return v0 + x * (a0 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
    return a0 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))
