"""The simulated lens: where a direction is seen, and in which direction a pixel looks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdpr_sim_bus.camera.camera_plant import LensPlant

FloatArray = NDArray[np.float64]
_ITERATIONS = 25


def distorted(x: FloatArray, y: FloatArray, lens: LensPlant) -> tuple[FloatArray, FloatArray]:
    """Return the distorted direction of X/Z, Y/Z after Brown and Conrady."""
    k1, k2, p1, p2, k3 = lens.distortion
    s = x * x + y * y
    radial = 1.0 + s * (k1 + s * (k2 + s * k3))
    return (
        x * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
        y * radial + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y,
    )


def seen_at(points: FloatArray, lens: LensPlant) -> FloatArray:
    """Return the pixels (n, 2) at which points (n, 3) of the camera's frame are seen.

    nan where a point is behind the camera, or further out than a lens like this can show.
    """
    z = np.where(points[:, 2] > 1e-3, points[:, 2], np.nan)
    x, y = points[:, 0] / z, points[:, 1] / z
    reach = 1.5 * np.hypot(lens.width_px / lens.focal_px[0], lens.height_px / lens.focal_px[1])
    x = np.where(np.hypot(x, y) < reach, x, np.nan)
    u, v = distorted(x, y, lens)
    return np.column_stack(
        [lens.focal_px[0] * u + lens.centre_px[0], lens.focal_px[1] * v + lens.centre_px[1]]
    )


def ray_table(lens: LensPlant) -> FloatArray:
    """Return X/Z and Y/Z of every pixel's middle, (height, width, 2), by fixed-point iteration."""
    u, v = np.meshgrid(
        np.arange(lens.width_px, dtype=float), np.arange(lens.height_px, dtype=float)
    )
    wanted_x = (u - lens.centre_px[0]) / lens.focal_px[0]
    wanted_y = (v - lens.centre_px[1]) / lens.focal_px[1]
    x, y = wanted_x.copy(), wanted_y.copy()
    for _ in range(_ITERATIONS):
        at_x, at_y = distorted(x, y, lens)
        off_x, off_y = wanted_x - at_x, wanted_y - at_y
        x, y = x + off_x, y + off_y
        if max(np.abs(off_x).max(), np.abs(off_y).max()) < 1e-10:
            break
    return np.stack([x, y], axis=2)
