"""A path as nodes along its length: positions with two derivatives, smooth between nodes.

Corners are cut by curves of fifth order (Hermite interpolation), whose ends have position,
direction and curvature of the adjacent pieces. So the acceleration has no step at the start of a
corner.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.motion.path_description import Coordinates, PathDescription, PathError

# Lines and arcs of a path as arrays, and the cut corners between them. Length along the path is
# weighted: ds² = |dp|² + (scale dφ)². A metre of an anchor point counts like a metre of the origin,
# so pure rotations also have a length.

_NOTHING_m: Final = 1e-7
_STRAIGHT_rad: Final = 1e-4
"""A corner with a smaller turn is ignored."""
_REVERSAL_rad: Final = 3.0
"""A corner with a larger turn is not cut: the path comes to rest there."""
_CURVATURE_1_m: Final = 1e-6
EXACT_m: Final = 5e-6
"""Largest distance from the programmed path in exact mode if only the curvature steps."""
_BULGE: Final = 0.0108
"""Deviation = this * step in curvature * square of the length that is replaced on each side."""
_PROJECTIONS: Final = 3


@dataclass(frozen=True)
class Pieces:
    """m lines and arcs, one after the other.

    Piece i runs from `start[i]` along `way[i]`. If `angle_rad[i]` is not 0, its position also turns
    by that angle around an axis. Its way is then along the axis, and to the end in the file if that
    is not quite on the circle.
    """

    start: FloatArray
    """Position at which each piece begins, (m, d)."""
    way: FloatArray
    arm: FloatArray
    """From the axis of the arc to its start, (m, 3)."""
    normal: FloatArray
    """Direction of the axis, (m, 3)."""
    angle_rad: FloatArray
    """Angle of an arc, 0 for a line, (m,)."""
    length: FloatArray
    speed: FloatArray
    """Largest wanted speed, m/s, or rad/s for pieces that only turn."""
    line: IntArray
    blend_m: FloatArray
    """Tolerance of the corner at the end of each piece, 0 if the path is exact there."""
    dwell_s: FloatArray
    """Time at rest at the end of each piece."""
    waits: BoolArray
    stops: BoolArray
    """Whether the path rests at the end of each piece."""
    cut: FloatArray
    """Length cut off the end of each piece, and off the beginning of the next one, for the
    corner."""
    k: int
    """Number of coordinates that are positions."""
    start_dwell_s: float
    """Time at rest before the first piece."""
    start_waits: bool

    def at(self, i: IntArray, share: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return positions, and first and second derivatives by length (n, d), at shares of pieces.

        Shares (n,) of the pieces `i` (n,) are from 0 to 1.
        """
        length = self.length[i][:, None]
        q = self.start[i] + share[:, None] * self.way[i]
        first, second = self.way[i] / length, np.zeros_like(q)
        round_ = np.flatnonzero(self.angle_rad[i])
        if round_.size:
            j, k = i[round_], self.k
            arm, normal = self.arm[j], self.normal[j]
            side = np.cross(normal, arm)
            turned = (share[round_] * self.angle_rad[j])[:, None]
            rate = (self.angle_rad[j] / self.length[j])[:, None]
            c, s = np.cos(turned), np.sin(turned)
            q[round_, :k] += _moved_around(arm, normal, turned)[:, :k]
            first[round_, :k] += (rate * (c * side - s * arm))[:, :k]
            second[round_, :k] = (-(rate**2) * (c * arm + s * side))[:, :k]
        return q, first, second

    def distance(
        self, i: IntArray, share: FloatArray, q: FloatArray, scale: FloatArray
    ) -> FloatArray:
        """Return the distance (n,) of positions (n, d) from the pieces `i` (n,).

        `share` (n,) is near the nearest point of the piece. Newton steps find that point, one step
        for a line.
        """
        share = self._nearer(i, share, q, scale)
        bent = np.flatnonzero(self.angle_rad[i])
        for _ in range(_PROJECTIONS if bent.size else 0):
            share[bent] = self._nearer(i[bent], share[bent], q[bent], scale)
        return np.asarray(np.linalg.norm(scale * (self.at(i, share)[0] - q), axis=1))

    def _nearer(
        self, i: IntArray, share: FloatArray, q: FloatArray, scale: FloatArray
    ) -> FloatArray:
        """Return shares of the pieces that are nearer to positions, by one Newton step."""
        place, first, second = self.at(i, share)
        gap = scale * (place - q)
        slope = np.einsum("ij,ij->i", gap, scale * first)
        bend = 1.0 + np.einsum("ij,ij->i", gap, scale * second)
        share = share - slope / np.maximum(bend, 0.5) / self.length[i]
        return np.asarray(np.clip(share, 0.0, 1.0))


def _moved_around(arm: FloatArray, normal: FloatArray, angle: FloatArray | float) -> FloatArray:
    """Return the movement (..., 3) of the end of an arm that turns around an axis."""
    # 1 - cos without rounding errors of large arms
    return np.asarray(np.sin(angle) * np.cross(normal, arm) - 2.0 * np.sin(0.5 * angle) ** 2 * arm)


def pieces_of(path: PathDescription, scale: FloatArray) -> Pieces:
    """Return the pieces of a path; `scale` (d,) is the length in m for a unit of each coordinate.

    Stops of moves without length belong to the previous piece. The result may have no pieces.
    """
    here, kept = path.start, []
    d, k = len(scale), path.coordinates.positions
    dwell_s = [0.0]
    waits = [False]
    for move in path.moves:
        arc = move.arc
        way = move.end - here
        angle, arm, normal = 0.0, np.zeros(3), np.zeros(3)
        if arc is not None:
            angle, normal, arm = arc.angle_rad, arc.normal, arc.arm_m(here[:k])
            way[:k] -= _moved_around(arm, normal, angle)[:k]
        length = float(np.hypot(np.linalg.norm(scale * way), angle * np.linalg.norm(arm)))
        if length > _NOTHING_m:
            kept.append(
                (here, way, arm, normal, angle, length, move.speed, move.line, move.blend_m)
            )
            dwell_s.append(0.0)
            waits.append(False)
            here = move.end
        dwell_s[-1] += move.dwell_s
        waits[-1] = waits[-1] or move.waits
    columns = list(zip(*kept, strict=True)) if kept else [()] * 9
    dwell, wait = np.array(dwell_s[1:]), np.array(waits[1:], bool)
    pieces = Pieces(
        np.reshape(columns[0], (-1, d)), np.reshape(columns[1], (-1, d)),
        np.reshape(columns[2], (-1, 3)), np.reshape(columns[3], (-1, 3)),
        np.array(columns[4], float), np.array(columns[5], float), np.array(columns[6], float),
        np.array(columns[7], np.int64), np.array(columns[8], float),
        dwell, wait, np.ones(len(kept), bool), np.zeros(len(kept)), k,
        dwell_s[0], waits[0],
    )  # fmt: skip
    if kept:
        _cut_corners(pieces, scale)
    return pieces


def _cut_corners(pieces: Pieces, scale: FloatArray) -> None:
    """Write where the path stops, and the lengths by which corners are cut.

    The cut is at most the blending radius, and half of the pieces on both sides. A step of
    curvature without a turn is also a corner, because the acceleration would otherwise have a step.
    In exact mode it is cut by a length that moves the path by `EXACT_m`.
    """
    m = len(pieces.length)
    every = np.arange(m)
    _, out, bent_out = pieces.at(every, np.ones(m))
    _, into, bent_into = pieces.at(every, np.zeros(m))
    out, into = scale * out[:-1], scale * into[1:]
    across = np.linalg.norm(out - into, axis=1)
    turn = 2.0 * np.arcsin(np.clip(0.5 * across, 0.0, 1.0))
    bend = np.linalg.norm(scale * (bent_out[:-1] - bent_into[1:]), axis=1)
    bends, straight = bend > _CURVATURE_1_m, turn < _STRAIGHT_rad
    rests = (pieces.dwell_s[:-1] > 0.0) | pieces.waits[:-1]
    exact = pieces.blend_m[:-1] == 0.0
    blended = ~rests & (turn < _REVERSAL_rad) & np.where(straight, bends, ~exact)
    pieces.stops[:-1] = rests | (~straight & ~blended)
    half = 0.5 * np.minimum(pieces.length[:-1], pieces.length[1:])
    unnoticed = np.sqrt(EXACT_m / (_BULGE * np.maximum(bend, _CURVATURE_1_m)))
    most = np.where(exact, unnoticed, pieces.blend_m[:-1])
    pieces.cut[:-1] = np.where(blended, np.minimum(most, half), 0.0)


_SPACING_m: Final = 0.01
NODE_m: Final = 2.0 / np.pi * _SPACING_m
"""Distance between the nodes of a line."""
_TURN_rad: Final = 0.08
"""Largest rotation between nodes, along a piece and around an arc."""
_LEAST_m: Final = 5e-4
"""Smallest cut of a corner that affects the spacing of nodes, to limit their number."""
MOST_NODES: Final = 1_000_000
"""Largest number of nodes of one path; a node takes about 1 kB, including the arrays for
planning."""
_PLACES: Final = (0.25, 0.5, 0.75, 1.0)
"""Shares of an interval at which the path is compared with the file."""
_MOST_CUTS: Final = 12
"""Largest number of times that the cut of a corner outside its tolerance is halved."""
_AT_ONCE: Final = 50_000
_AFTER_ALL: Final = 1e9
"""Sort index of a corner's nodes, which come after all nodes of the piece."""
_ROUNDING_m: Final = 1e-8
_IN_CORNER: Final = 8
"""Intervals of a cut corner."""
_FULLNESS: Final = 2.0
"""Ratio of the derivative at both ends of a corner to the length cut there. With 2, a corner
without a turn is a line with constant derivative. The inner two control points are 0.8 of the cut
away from its ends. So no point of the curve is farther from the corner's point than the length of
the cut.
"""
_GAUSS: Final = (
    (0.5 - np.sqrt(0.15), 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + np.sqrt(0.15), 5.0 / 18.0),
)  # fmt: skip


@dataclass(frozen=True)
class PathNodes:
    """N nodes; those of a run between two stops are contiguous, and runs share no nodes."""

    coordinates: Coordinates
    scale: FloatArray
    """Length in m for a unit of each coordinate, (d,)."""
    s: FloatArray
    """Length along the path, (N,); the end of a run and the start of the next have the same."""
    q: FloatArray
    """Positions, (N, d)."""
    first: FloatArray
    """First derivative by length."""
    second: FloatArray
    speed: FloatArray
    """Largest wanted speed, (N,): m/s, or rad/s if the path only turns there."""
    line: IntArray
    """Line of the file, (N,)."""
    runs: IntArray
    """First and last node of each run, (r, 2)."""
    dwell_s: FloatArray
    """Time at rest after each run, (r,)."""
    waits: BoolArray

    deviation_m: float
    """Largest distance from the programmed path, also between the nodes."""

    @property
    def length_m(self) -> float:
        """Length of the origin's path."""
        k = self.coordinates.positions
        return float(np.linalg.norm(np.diff(self.q[:, :k], axis=0), axis=1).sum())

    def between(self, share: float, begin: int = 0, end: int | None = None) -> FloatArray:
        """Return positions at a share of the intervals that follow nodes `begin` to `end` - 1.

        Nodes that end a run return their own position.
        """
        here = slice(begin, len(self.s) - 1 if end is None else end)
        there = slice(here.start + 1, here.stop + 1)
        step = (self.s[there] - self.s[here])[:, None]
        ends = tuple(
            (self.q[part], step * self.first[part], step**2 * self.second[part])
            for part in (here, there)
        )
        return _hermite(ends, np.array([share]), 0)[:, 0]


@dataclass(frozen=True)
class _Places:
    """Where nodes (N,) are on the pieces."""

    piece: IntArray
    """Index of the piece; for a corner's node that of the piece before the corner."""
    corner: BoolArray
    share: FloatArray
    """Share of the piece, or of the corner."""


def nodes_of(path: PathDescription, scale: FloatArray) -> PathNodes:
    """Return the nodes of a path with cut corners; a single node if the path has no length.

    The curve through the nodes is compared with the file's lines and arcs. Corners that exceed
    their tolerance are cut by less. Raises PathError if the path still exceeds a tolerance, or is
    too long.
    """
    pieces = pieces_of(path, scale)
    if not len(pieces.length):
        d = len(scale)
        one, none = np.zeros((1, d)), np.zeros((1, d))
        return PathNodes(
            path.coordinates, scale, np.zeros(1), one + path.start, none, none.copy(),
            np.full(1, np.inf), np.array([path.start_line]), np.zeros((1, 2), np.int64),
            np.array([pieces.start_dwell_s]), np.array([pieces.start_waits]), 0.0,
        )  # fmt: skip
    for _ in range(_MOST_CUTS):
        nodes, places = _nodes_of_pieces(path, pieces, scale)
        off = _deviations(nodes, places, pieces)
        wrong = off > _tolerances(places, pieces)
        if not wrong.any():
            break
        corners = np.unique(places.piece[wrong & places.corner])
        pieces.cut[corners] *= 0.5
        if not corners.size:
            break
    if wrong.any():
        i = int(wrong.argmax())
        raise PathError(
            path.source, int(nodes.line[i]),
            f"the computed path deviates by {1e3 * off[i]:.4g} mm from the file; allowed: "
            f"{1e3 * _tolerances(places, pieces)[i]:.4g} mm; divide this move",
        )  # fmt: skip
    nodes = replace(nodes, deviation_m=float(off.max()))
    if pieces.start_waits or pieces.start_dwell_s:
        nodes = _resting_first(nodes, pieces)
    return nodes


def _nodes_of_pieces(
    path: PathDescription, pieces: Pieces, scale: FloatArray
) -> tuple[PathNodes, _Places]:
    """Return the nodes along pieces and their corners, and their places."""
    along = _along_pieces(pieces, path)
    corners = _corners(pieces, scale)
    parts = [np.concatenate(pair) for pair in zip(along, corners, strict=True)]
    order = np.lexsort((parts[1], parts[0]))
    piece, number, q, first, second, step, speed, line, share = (part[order] for part in parts)
    fresh = np.flatnonzero(np.isnan(step))  # the first of each run
    step[fresh] = 0.0
    runs = np.stack([fresh, np.append(fresh[1:], len(step)) - 1], axis=1)
    last = piece[runs[:, 1]].astype(np.int64)
    nodes = PathNodes(
        path.coordinates, scale, np.cumsum(step), q, first, second, speed, line.astype(np.int64),
        runs.astype(np.int64), pieces.dwell_s[last], pieces.waits[last], 0.0,
    )  # fmt: skip
    return nodes, _Places(piece.astype(np.int64), number >= _AFTER_ALL, share)


def _resting_first(nodes: PathNodes, pieces: Pieces) -> PathNodes:
    """Return the nodes with an additional first run, which is a rest at the start of the path."""
    dwell_s = np.array([pieces.start_dwell_s])
    arrays = (nodes.s, nodes.q, nodes.first, nodes.second, nodes.speed, nodes.line)
    s, q, first, second, speed, line = (np.concatenate([one[:1], one]) for one in arrays)
    return replace(
        nodes, s=s, q=q, first=first, second=second, speed=speed, line=line,
        runs=np.concatenate([[[0, 0]], nodes.runs + 1]),
        dwell_s=np.concatenate([dwell_s, nodes.dwell_s]),
        waits=np.concatenate([[pieces.start_waits], nodes.waits]),
    )  # fmt: skip


def _tolerances(places: _Places, pieces: Pieces) -> FloatArray:
    """Return the allowed distance from the pieces in the interval before each node, (N,)."""
    blend_m = np.where(places.corner, pieces.blend_m[places.piece], 0.0)
    return np.maximum(blend_m, EXACT_m) + _ROUNDING_m


def _deviations(nodes: PathNodes, places: _Places, pieces: Pieces) -> FloatArray:
    """Return the largest distance from the pieces in the interval before each node, (N,)."""
    off = np.zeros(len(nodes.s))
    for begin in range(1, len(off), _AT_ONCE):
        end = min(begin + _AT_ONCE, len(off))
        part = slice(begin, end)
        i, corner, share = places.piece[part], places.corner[part], places.share[part]
        step = nodes.s[begin:end] - nodes.s[begin - 1 : end - 1]
        after = np.minimum(i + 1, len(pieces.length) - 1)
        for u in _PLACES:
            q = nodes.between(u, begin - 1, end - 1)
            there = share - (1.0 - u) * step / pieces.length[i]
            # from -1 to 1 within a corner
            across = 2.0 * (share - (1.0 - u) / _IN_CORNER) - 1.0
            cut = pieces.cut[i]
            there = np.where(corner, 1.0 + np.minimum(across, 0.0) * cut / pieces.length[i], there)
            away = pieces.distance(i, np.clip(there, 0.0, 1.0), q, nodes.scale)
            j = np.flatnonzero(corner)
            beyond = np.clip(across[j], 0.0, 1.0) * cut[j] / pieces.length[after[j]]
            other = pieces.distance(after[j], beyond, q[j], nodes.scale)
            away[j] = np.minimum(away[j], other)
            off[part] = np.maximum(off[part], away)
    off[nodes.runs[:, 0]] = 0.0
    return off


def _along_pieces(pieces: Pieces, path: PathDescription) -> tuple[FloatArray, ...]:
    """Return the nodes of pieces without their corners, with places by which they are sorted.

    Raises PathError for too many.
    """
    m = len(pieces.length)
    cut_before = np.concatenate([[0.0], pieces.cut[:-1]])
    begins = np.concatenate([[True], pieces.stops[:-1]])
    left = pieces.length - cut_before - pieces.cut
    straight = pieces.angle_rad == 0.0
    apart_m = np.where(straight, NODE_m, _SPACING_m)
    count = np.ceil(np.maximum(left / apart_m, np.abs(pieces.angle_rad) / _TURN_rad))
    # the first interval next to a corner is a quarter of the length cut there
    cuts = np.stack([cut_before, pieces.cut])
    narrow = np.maximum(np.where(cuts > 0.0, cuts, np.inf).min(axis=0), _LEAST_m)
    beside = np.ceil(np.pi * np.sqrt(np.maximum(left, 0.0) / narrow))
    count = np.maximum(count, np.where(straight, beside, 0.0))
    ends = begins | pieces.stops | (pieces.angle_rad != 0.0)
    count = np.maximum(count, np.where(ends, 4, 1)).astype(np.int64)
    count = np.where(left > 1e-9 * pieces.length, count, 0)
    # a piece adds all of its nodes except the first, which it adds only if a run begins there
    given = count + begins
    total = np.cumsum(given + _IN_CORNER * (pieces.cut > 0.0))
    if total[-1] > MOST_NODES:
        line = int(pieces.line[int((total > MOST_NODES).argmax())])
        raise PathError(
            path.source, line,
            f"the path is too long from here on: {total[-1]} nodes; allowed: {MOST_NODES}; divide "
            "the file",
        )  # fmt: skip
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
        pieces.line[i].astype(float),
        at,
    )


def _dense_at_ends(share: FloatArray, straight: BoolArray) -> FloatArray:
    """Return shares of pieces that are denser at the ends of straight ones.

    A corner's speed also applies up to the next node, which must not be far from a narrow corner.
    """
    return np.where(straight, 0.5 - 0.5 * np.cos(np.pi * share), share)


def _corners(pieces: Pieces, scale: FloatArray) -> tuple[FloatArray, ...]:
    """Return the nodes of cut corners, except the first of each."""
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
    first[:, -1], second[:, -1] = end[1], end[2]  # exactly those of the piece, without rounding
    halves = np.where(u <= 0.5, 0, 1)
    line = pieces.line[i[:, None] + halves]
    speed = np.minimum(pieces.speed[i], pieces.speed[i + 1])[:, None] + 0.0 * step
    turns_only = ~np.any(pieces.way[:, : pieces.k], axis=1) & (pieces.angle_rad == 0.0)
    mixed = turns_only[i] != turns_only[i + 1]
    # m/s of one and rad/s of the other cannot be compared
    speed[mixed] = np.where(halves == 0, pieces.speed[i, None], pieces.speed[i + 1, None])[mixed]
    c, d = len(i), q.shape[2]
    place = np.repeat(i.astype(float), _IN_CORNER)
    share = np.tile(u, c)
    number = _AFTER_ALL + share
    flat = [part.reshape(-1, d) for part in (q, first, second)]
    return place, number, *flat, step.ravel(), speed.ravel(), line.ravel().astype(float), share


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
