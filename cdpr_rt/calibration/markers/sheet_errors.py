"""Errors of printed sheets against squares of their nominal size, and a map's covariance by them.

Noise is new in each image; a sheet's errors (scale of the printer, paper that is not flat) are the
same in all. They do not average out, and a covariance that takes them for noise is too small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.reprojection import Estimate, residuals_and_jacobian
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers

_SEEN_SHARE, _NOISE_SHARE = 8.0 / 2.0, 5.0 / 2.0
"""A sheet's errors have 8 coordinates at 4 corners. Seen from about one direction its pose takes 6
of them up, from many only 3: position and rotation in its plane. The former is taken for how much
there is of its errors, the latter for what noise alone shows: the larger of both."""
_SIGMAS = 3.0


@dataclass(frozen=True)
class SheetErrors:
    """Common part of the corners' residuals over images, on their sheets."""

    sigma_m: float
    """Standard deviation of a coordinate of a corner on its sheet; 0 where none shows."""
    inflation: float
    """By how much the covariance is larger than noise alone makes it: 1 + (n - 1) r for markers
    that are seen in n images, with the correlation r of a corner's residuals (design effect)."""


def sheet_errors(estimate: Estimate, seen: SeenMarkers, weight: FloatArray) -> SheetErrors:
    """Return the sheets' errors by an analysis of variance; `weight` (n, 4) is the fit's.

    With n images of a marker, the mean squares between corners and within them are at most
    (n s² + 2.5 v) / 4 and v, where s² is the sheets' variance and v the noise's.
    """
    off, jacobian = residuals_and_jacobian(estimate, seen)
    n = len(seen)
    by_place = jacobian.data.reshape(n, 4, 2, -1)[..., 6:9]
    on_sheet = by_place @ estimate.map.rotation[seen.marker][:, None, :, :2]
    shift = np.linalg.solve(on_sheet, off.reshape(n, 4, 2, 1))[..., 0]
    shift = np.where((weight > 0.5)[..., None], shift, 0.0)
    between, within, freedom, markers, images = 0.0, 0.0, 0, 0, []
    for marker in np.unique(seen.marker):
        own = shift[seen.marker == marker]
        if len(own) < 2:
            continue
        mean = own.mean(axis=0)
        between += len(own) * float((mean**2).sum())
        within += float(((own - mean) ** 2).sum())
        freedom += 8 * (len(own) - 1)
        markers += 1
        images.append(len(own))
    if not freedom or within == 0.0:
        return SheetErrors(0.0, 1.0)
    noise, common = within / freedom, _SEEN_SHARE * between / (8 * markers)
    chance = _SIGMAS * np.sqrt(2.0 / (5.0 * markers))
    if common / noise < _NOISE_SHARE * (1.0 + chance):
        return SheetErrors(0.0, 1.0)
    count = float(np.mean(images))
    variance = (common - _NOISE_SHARE * noise) / count
    share = variance / (variance + noise)
    return SheetErrors(float(np.sqrt(variance)), 1.0 + (count - 1.0) * share)
