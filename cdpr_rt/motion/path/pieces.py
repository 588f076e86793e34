"""Lines and arcs of a path as arrays, and the corners between them that are cut.

A length along the path is weighted: ds² = |dp|² + (scale dφ)², a metre of an anchor point for each
metre of the origin, so that what only turns has a length too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.motion.path.description import PathDescription

_NOTHING_m: Final = 1e-7
_STRAIGHT_rad: Final = 1e-4
"""A corner that turns by less is none."""
_REVERSAL_rad: Final = 3.0
"""One that turns by more is not cut: it comes to rest."""
_CURVATURE_1_m: Final = 1e-6


@dataclass(frozen=True)
class Pieces:
    """m lines and arcs, one after the other.

    Piece i runs from `start[i]` along `way[i]`; where `angle_rad[i]` is not 0 its first two
    coordinates run around `centre[i]` instead.
    """

    start: FloatArray
    """(m, d)"""
    way: FloatArray
    centre: FloatArray
    """(m, 2)"""
    angle_rad: FloatArray
    """(m,)"""
    length: FloatArray
    speed: FloatArray
    """Wanted at most, m/s, or rad/s of those that only turn."""
    line: IntArray
    dwell_s: FloatArray
    """Time at rest at the end of each."""
    waits: BoolArray
    stops: BoolArray
    """Whether the path rests at the end of each."""
    cut: FloatArray
    """Length cut off the end of each, and off the beginning of the next, for the corner."""

    def at(self, i: IntArray, share: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return positions with first and second derivative by length (k, d), at shares of pieces.

        Shares (k,) of the pieces `i` (k,) are from 0 to 1.
        """
        length = self.length[i][:, None]
        q = self.start[i] + share[:, None] * self.way[i]
        first, second = self.way[i] / length, np.zeros_like(q)
        round_ = np.flatnonzero(self.angle_rad[i])
        if round_.size:
            j = i[round_]
            arm = self.start[j, :2] - self.centre[j]
            turned, rate = share[round_] * self.angle_rad[j], self.angle_rad[j] / self.length[j]
            c, s = np.cos(turned)[:, None], np.sin(turned)[:, None]
            out = c * arm + s * np.stack([-arm[:, 1], arm[:, 0]], axis=1)
            q[round_, :2] = self.centre[j] + out
            first[round_, :2] = rate[:, None] * np.stack([-out[:, 1], out[:, 0]], axis=1)
            second[round_, :2] = -(rate[:, None] ** 2) * out
        return q, first, second


def pieces_of(path: PathDescription, scale: FloatArray) -> Pieces:
    """Return the pieces of a path; `scale` (d,) is how many metres each coordinate counts for.

    Moves that lead nowhere leave their stops to the piece before. There may be no pieces.
    """
    here, kept = path.start, []
    dwell_s = [0.0]
    waits = [False]
    for move in path.moves:
        arc = move.arc
        way = move.end - here
        square = (scale * way) ** 2
        angle, centre = 0.0, np.zeros(2)
        if arc is not None:
            angle, centre = arc.angle_rad, arc.centre_m
            square[:2] = [(angle * np.hypot(*(here[:2] - centre))) ** 2, 0.0]
        length = float(np.sqrt(square.sum()))
        if length > _NOTHING_m:
            kept.append((here, way, centre, angle, length, move.speed, move.line, move.blend_m))
            dwell_s.append(0.0)
            waits.append(False)
            here = move.end
        dwell_s[-1] += move.dwell_s
        waits[-1] = waits[-1] or move.waits
    columns = list(zip(*kept, strict=True)) if kept else [()] * 8
    d = len(scale)
    dwell, wait = np.array(dwell_s[1:]), np.array(waits[1:], bool)
    pieces = Pieces(
        np.reshape(columns[0], (-1, d)), np.reshape(columns[1], (-1, d)),
        np.reshape(columns[2], (-1, 2)), np.array(columns[3], float), np.array(columns[4], float),
        np.array(columns[5], float), np.array(columns[6], np.int64),
        dwell, wait, np.ones(len(kept), bool), np.zeros(len(kept)),
    )  # fmt: skip
    if kept:
        _cut_corners(pieces, np.array(columns[7], float), scale)
    return pieces


def _cut_corners(pieces: Pieces, blend_m: FloatArray, scale: FloatArray) -> None:
    """Write where the path stops, and by how much corners are cut.

    By the blending radius at most, and by half of what is on either side, so that a cut corner
    stays within that radius of its point.
    """
    m = len(pieces.length)
    every = np.arange(m)
    _, out, bent_out = pieces.at(every, np.ones(m))
    _, into, bent_into = pieces.at(every, np.zeros(m))
    out, into = scale * out[:-1], scale * into[1:]
    across = np.linalg.norm(out - into, axis=1)
    turn = 2.0 * np.arcsin(np.clip(0.5 * across, 0.0, 1.0))
    bends = np.linalg.norm(scale * (bent_out[:-1] - bent_into[1:]), axis=1) > _CURVATURE_1_m
    straight = turn < _STRAIGHT_rad
    rests = (pieces.dwell_s[:-1] > 0.0) | pieces.waits[:-1]
    blended = (blend_m[:-1] > 0.0) & ~rests & (turn < _REVERSAL_rad) & (~straight | bends)
    pieces.stops[:-1] = rests | (~straight & ~blended)
    half = 0.5 * np.minimum(pieces.length[:-1], pieces.length[1:])
    pieces.cut[:-1] = np.where(blended, np.minimum(blend_m[:-1], half), 0.0)
