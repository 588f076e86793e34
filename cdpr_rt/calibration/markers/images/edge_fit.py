"""Corners of markers to a few hundredths of a pixel: curves are fitted to the four edges and met.

A detector's corners are off by tenths of a pixel: it looks at the few pixels around the corner.
An edge has a hundred. Where its grey level is half-way between ink and paper is found along its
length, a parabola is fitted to that, since a lens bends edges, and neighbours are intersected.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import BoolArray, FloatArray

_POINTS = 48
"""Along each edge."""
_STEPS = 25
"""Across it."""
_ENDS = 0.07
"""Share of an edge, at each end, where the neighbour disturbs it."""
_REACH = 0.42, 1.8, 7.0
"""Across an edge: share of a square of the marker, least and most, px."""
_LEAST_CONTRAST = 15.0
"""Grey levels between ink and paper."""
_MOST_OFF_px = 0.8
_LEAST_POINTS = 12
_PASSES, _FITS = 2, 4


@dataclass(frozen=True)
class EdgeFit:
    """Corners of k markers and how well their edges fit."""

    corners_px: FloatArray
    """(k, 4, 2)."""
    good: BoolArray
    """Whether all four edges were there to see, (k,)."""
    width_px: FloatArray
    """Width of the widest edge of each, from ink to paper, (k,): over its steepest slope."""


def fit_corners(pixels: NDArray[np.uint8], corners: FloatArray, squares: int) -> EdgeFit:
    """Return better corners than `corners` (k, 4, 2) of markers `squares` wide, with border."""
    good: BoolArray = np.ones(len(corners), np.bool_)
    width = np.zeros(len(corners))
    for _ in range(_PASSES):
        if not len(corners):
            break
        start, end = corners, np.roll(corners, -1, axis=1)
        along = end - start
        length = np.maximum(np.linalg.norm(along, axis=2), 1e-6)
        along = along / length[..., None]
        across = np.stack([along[..., 1], -along[..., 0]], axis=2)  # outward: they go clockwise
        share, least, most = _REACH
        reach = np.clip(share * length.min(axis=1) / squares, least, most)
        s = np.linspace(_ENDS, 1.0 - _ENDS, _POINTS)
        d = np.linspace(-1.0, 1.0, _STEPS)
        at = start[:, :, None] + (length[..., None] * s)[..., None] * along[:, :, None]
        offset = reach[:, None] * d
        grid = at[:, :, :, None] + offset[:, None, None, :, None] * across[:, :, None, None]
        profile = _sampled(pixels, grid)
        where, valid, slope = _crossings(profile, offset)
        shape, fits = _parabolas(s - 0.5, where, valid)
        good = np.asarray(fits.all(axis=1))
        width = slope.max(axis=1)
        met = _intersections(start, along, across, length, shape)
        corners = np.where(good[:, None, None], met, corners)
    return EdgeFit(corners, good, width)


def _sampled(pixels: NDArray[np.uint8], grid: FloatArray) -> FloatArray:
    """Return grey levels at places (..., 2), between the pixels."""
    flat = grid.astype(np.float32).reshape(-1, _POINTS * _STEPS, 2)
    # in rows of some length: OpenCV takes no more than 32767 columns or rows
    levels = [
        cv2.remap(pixels.astype(np.float32), part[..., 0], part[..., 1], cv2.INTER_LINEAR,
                  borderMode=cv2.BORDER_REPLICATE)
        for part in np.array_split(flat, 1 + len(flat) // 30000)
    ]  # fmt: skip
    return np.concatenate(levels).astype(float).reshape(grid.shape[:-1])


def _crossings(profile: FloatArray, offset: FloatArray) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Return where profiles (k, 4, points, steps) are half-way, whether, and each edge's width."""
    quarter = _STEPS // 4
    ink = profile[..., :quarter].mean(axis=-1)
    paper = profile[..., -quarter:].mean(axis=-1)
    half = 0.5 * (ink + paper)
    above = profile >= half[..., None]
    first = np.argmax(above, axis=-1).clip(1, _STEPS - 1)
    before = np.take_along_axis(profile, first[..., None] - 1, -1)[..., 0]
    after = np.take_along_axis(profile, first[..., None], -1)[..., 0]
    rise = np.where(after > before, after - before, 1.0)
    step = (offset[:, -1] - offset[:, 0]) / (_STEPS - 1)
    low = np.take_along_axis(
        np.broadcast_to(offset[:, None, None], profile.shape), first[..., None] - 1, -1
    )[..., 0]
    where = low + step[:, None, None] * (half - before) / rise
    contrast = paper - ink
    valid = (contrast > _LEAST_CONTRAST) & (after > before) & ~above[..., 0] & above[..., -1]
    steepest = np.abs(np.diff(profile, axis=-1)).max(axis=-1) / step[:, None, None]
    each = np.where(valid, contrast / np.maximum(steepest, 1e-6), np.nan)
    filled = np.where(valid.any(axis=2, keepdims=True), each, np.inf)
    return where, valid, np.nanmedian(filled, axis=2)


def _parabolas(s: FloatArray, where: FloatArray, valid: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Return a + b s + c s² through the crossings of each edge, (k, 4, 3), and whether it fits."""
    basis = np.stack([np.ones_like(s), s, s * s], axis=1)
    weight = valid.astype(float)
    shape = np.zeros((*where.shape[:2], 3))
    for _ in range(_FITS):
        normal = np.einsum("kep,pi,pj->keij", weight, basis, basis) + 1e-9 * np.eye(3)
        right = np.einsum("kep,pi,kep->kei", weight, basis, np.where(valid, where, 0.0))
        shape = np.linalg.solve(normal, right[..., None])[..., 0]
        off = where - shape @ basis.T
        masked = np.where(valid, np.abs(off), np.nan)
        empty = ~valid.any(axis=2)
        masked[empty] = 0.0
        spread = np.maximum(1.5 * np.nanmedian(masked, axis=2), 0.03)
        weight = valid / (1.0 + (np.nan_to_num(off) / (2.0 * spread[..., None])) ** 2)
    enough = (weight > 0.5).sum(axis=2) >= _LEAST_POINTS
    return shape, enough & (spread < _MOST_OFF_px)


def _intersections(
    start: FloatArray, along: FloatArray, across: FloatArray, length: FloatArray, shape: FloatArray
) -> FloatArray:
    """Return where each edge (k, 4) meets the one before it, (k, 4, 2), by Newton's method."""
    last = [np.roll(part, 1, axis=1) for part in (start, along, across, length, shape)]
    edges = [(start, along, across, length, shape), tuple(last)]
    place = start.copy()
    for _ in range(4):
        off, slopes = [], []
        for from_, way, out, size, (curve) in edges:
            away = place - from_
            s = (away * way).sum(axis=2) / size - 0.5
            d = (away * out).sum(axis=2)
            a, b, c = curve[..., 0], curve[..., 1], curve[..., 2]
            off.append(d - (a + b * s + c * s * s))
            slopes.append(out - ((b + 2.0 * c * s) / size)[..., None] * way)
        J = np.stack(slopes, axis=2)
        J = J + 1e-9 * np.eye(2)
        place = place - np.linalg.solve(J, np.stack(off, axis=2)[..., None])[..., 0]
    return place
