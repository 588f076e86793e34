"""Draws one sheet as a camera sees it, with several rays through each pixel (compiled)."""

from __future__ import annotations

import math
from typing import Any

from cdpr_profiles.jit import jit

_BEND_STEPS = 3
_FLAT = 1e-6


@jit
def texel(texture: Any, x: float, y: float) -> float:
    """Return the texture interpolated at x, y in texels; whole numbers are texel centres."""
    rows, columns = texture.shape
    x = min(max(x, 0.0), columns - 1.000001)
    y = min(max(y, 0.0), rows - 1.000001)
    i, j = int(y), int(x)
    b, a = y - i, x - j
    upper = (1.0 - a) * texture[i, j] + a * texture[i, j + 1]
    lower = (1.0 - a) * texture[i + 1, j] + a * texture[i + 1, j + 1]
    return float((1.0 - b) * upper + b * lower)


@jit
def look(
    sheet: Any, texture: Any, origins: Any, turns: Any, x: float, y: float, time: float
) -> float:
    """Return the level, 0 to 1, that a ray sees, or -1 if it misses the sheet.

    `sheet` is (half width, half height, curvature). In the sheet's frame, the ray starts at the
    camera, origins[0] + time origins[1]. Its direction is (turns[0] + time turns[1] + time²
    turns[2]) (x, y, 1).
    """
    half_x, half_y, bend = sheet
    d = (
        turns[0, 0, 0] * x + turns[0, 0, 1] * y + turns[0, 0, 2],
        turns[0, 1, 0] * x + turns[0, 1, 1] * y + turns[0, 1, 2],
        turns[0, 2, 0] * x + turns[0, 2, 1] * y + turns[0, 2, 2],
    )
    dx, dy, dz = d
    if time != 0.0:
        square = time * time
        one, two = turns[1], turns[2]
        dx += time * (one[0, 0] * x + one[0, 1] * y + one[0, 2])
        dy += time * (one[1, 0] * x + one[1, 1] * y + one[1, 2])
        dz += time * (one[2, 0] * x + one[2, 1] * y + one[2, 2])
        dx += square * (two[0, 0] * x + two[0, 1] * y + two[0, 2])
        dy += square * (two[1, 0] * x + two[1, 1] * y + two[1, 2])
        dz += square * (two[2, 0] * x + two[2, 1] * y + two[2, 2])
    ox = origins[0, 0] + time * origins[1, 0]
    oy = origins[0, 1] + time * origins[1, 1]
    oz = origins[0, 2] + time * origins[1, 2]
    if dz >= 0.0:
        return -1.0
    way = -oz / dz
    for _ in range(_BEND_STEPS):
        if bend == 0.0:
            break
        at = ox + way * dx
        way = (0.5 * bend * at * at - oz) / dz
    u, v = (ox + way * dx) / half_x, (oy + way * dy) / half_y
    if way <= 0.0 or abs(u) > 1.0 or abs(v) > 1.0:
        return -1.0
    rows, columns = texture.shape
    return texel(texture, 0.5 * (u + 1.0) * columns - 0.5, 0.5 * (1.0 - v) * rows - 0.5)


@jit
def _corners(
    sheet: Any, texture: Any, origins: Any, turns: Any, ray: Any, right: Any, down: Any
) -> tuple[float, float]:
    """Return the minimum and the maximum level that the corners of a pixel see."""
    lowest, highest = math.inf, -math.inf
    for k in range(4):
        a, b = (k % 2) - 0.5, (k // 2) - 0.5
        x, y = ray[0] + a * right[0] + b * down[0], ray[1] + a * right[1] + b * down[1]
        seen = look(sheet, texture, origins, turns, x, y, 0.0)
        lowest, highest = min(lowest, seen), max(highest, seen)
    return lowest, highest


@jit
def draw_sheet(
    image: Any,
    region: Any,
    rays: Any,
    sheet: Any,
    texture: Any,
    origins: Any,
    turns: Any,
    offsets: Any,
    row_time: float,
    moving: bool,
) -> None:
    """Draw a sheet over `image` (rows, columns) within `region` (left, top, right, bottom).

    `rays` (rows, columns, 2) has the pixels' directions. `offsets` (n, 3) are the rays through each
    pixel: right and down of its centre, in pixels, and time in the exposure, s. If nothing
    moves, a pixel whose corners see the same level needs only the rays of the corners.
    """
    left, top, right, bottom = region
    rows, columns, _ = rays.shape
    n = len(offsets)
    for i in range(top, bottom):
        up, down = max(i - 1, 0), min(i + 1, rows - 1)
        for j in range(left, right):
            back, on = max(j - 1, 0), min(j + 1, columns - 1)
            x, y = rays[i, j, 0], rays[i, j, 1]
            xu = (rays[i, on, 0] - rays[i, back, 0]) / (on - back)
            yu = (rays[i, on, 1] - rays[i, back, 1]) / (on - back)
            xv = (rays[down, j, 0] - rays[up, j, 0]) / (down - up)
            yv = (rays[down, j, 1] - rays[up, j, 1]) / (down - up)
            if not moving:
                lowest, highest = _corners(
                    sheet, texture, origins, turns, (x, y), (xu, yu), (xv, yv)
                )
                if highest < 0.0:
                    continue
                if highest - lowest < _FLAT:
                    image[i, j] = lowest
                    continue
            total, met = 0.0, 0
            for k in range(n):
                a, b = offsets[k, 0], offsets[k, 1]
                time = offsets[k, 2] + i * row_time if moving else 0.0
                seen = look(
                    sheet, texture, origins, turns, x + a * xu + b * xv, y + a * yu + b * yv, time
                )
                if seen >= 0.0:
                    total += seen
                    met += 1
            image[i, j] = image[i, j] * (1.0 - met / n) + total / n
