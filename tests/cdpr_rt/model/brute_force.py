"""Distances of cables, platform and obstacles by plain NumPy at sampled places.

It shares no code with the kernels: distances, kinematics and ways are computed separately.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
_HALVINGS = 60


@dataclass(frozen=True)
class BruteRobot:
    """Exit and anchor points (n, 3), pulleys, and boxes (2, 3), first that of the platform."""

    exits: Floats
    anchors: Floats
    clearance_m: float
    home_rotation: Floats = field(default_factory=lambda: np.eye(3))
    radius: Floats | None = None
    axes: Floats | None = None
    body: Floats | None = None
    obstacles: tuple[Floats, ...] = ()

    def clearances(self, p: Floats, phi: Floats) -> dict[tuple[str, str], Floats]:
        """Return the distance of each pair of things, at positions and rotation vectors (m, 3)."""
        Q = Rotation.from_rotvec(phi).as_matrix() @ self.home_rotation
        ends = p[:, None] + np.einsum("mij,nj->mni", Q, self.anchors)
        starts = np.stack([self._start(i, ends[:, i]) for i in range(len(self.exits))], axis=1)
        n, c, found = len(self.exits), self.clearance_m, {}
        for i, j in combinations(range(n), 2):
            shared = [
                bool(np.linalg.norm(points[i] - points[j]) < c)
                for points in (self.exits, self.anchors)
            ]
            one = self._counted(starts[:, i], ends[:, i], *shared)
            other = self._counted(starts[:, j], ends[:, j], *shared)
            found[f"cable {i + 1}", f"cable {j + 1}"] = between_segments(*one, *other)
        if self.body is not None:
            for i in range(n):
                inside = _outside(self.anchors[i], self.body) < c
                one = self._counted(starts[:, i], ends[:, i], False, bool(inside))
                start, end = (np.einsum("mji,mj->mi", Q, x - p) for x in one)
                found[f"cable {i + 1}", "platform"] = to_box(start, end, self.body)
        for k, box in enumerate(self.obstacles):
            for i in range(n):
                reach = c + (0.0 if self.radius is None else 2.0 * self.radius[i])
                inside = _outside(self.exits[i], box) < reach
                one = self._counted(starts[:, i], ends[:, i], bool(inside), False)
                found[f"cable {i + 1}", f"obstacle {k + 1}"] = to_box(*one, box)
        return found

    def _start(self, i: int, ends: Floats) -> Floats:
        """Return where a cable leaves its eye, or its pulley turned towards the anchor."""
        a = np.broadcast_to(self.exits[i], ends.shape)
        if self.radius is None or self.axes is None or self.radius[i] == 0.0:
            return a
        r, k = float(self.radius[i]), self.axes[i]
        sideways = (ends - a) - ((ends - a) @ k)[:, None] * k
        e = sideways / np.linalg.norm(sideways, axis=1)[:, None]
        centre = a + r * e
        x, y = np.einsum("mi,mi->m", ends - centre, e), (ends - centre) @ k
        angle = np.arctan2(y, x) + np.arccos(r / np.hypot(x, y))
        return np.asarray(centre + r * (np.cos(angle)[:, None] * e + np.sin(angle)[:, None] * k))

    def _counted(
        self, start: Floats, end: Floats, at_exit: bool, at_anchor: bool
    ) -> tuple[Floats, Floats]:
        length = np.linalg.norm(end - start, axis=1)[:, None]
        left = np.minimum(10.0 * self.clearance_m, 0.5 * length) * (end - start) / length
        return start + at_exit * left, end - at_anchor * left


def between_segments(p: Floats, q: Floats, r: Floats, s: Floats) -> Floats:
    """Return the distances (m,) of segments p q and r s, ends (m, 3)."""
    u, v, w = q - p, s - r, p - r

    def dot(x: Floats, y: Floats) -> Floats:
        return np.asarray(np.einsum("mi,mi->m", x, y))

    def apart(a: Floats, b: Floats) -> Floats:
        return np.asarray(np.linalg.norm(w + a[:, None] * u - b[:, None] * v, axis=1))

    uu, vv, uv, zero = dot(u, u), dot(v, v), dot(u, v), np.zeros(len(p))
    with np.errstate(divide="ignore", invalid="ignore"):
        left = uu * vv - uv**2
        a, b = (uv * dot(v, w) - vv * dot(u, w)) / left, (uu * dot(v, w) - uv * dot(u, w)) / left
        within = (a >= 0.0) & (a <= 1.0) & (b >= 0.0) & (b <= 1.0)
        tried: list[Any] = [np.where(within, apart(a, b), np.inf)]
        for end in (zero, zero + 1.0):
            tried.append(
                apart(end, np.clip(np.nan_to_num(dot(v, w + end[:, None] * u) / vv), 0, 1))
            )
            tried.append(
                apart(np.clip(np.nan_to_num(dot(u, end[:, None] * v - w) / uu), 0, 1), end)
            )
    return np.asarray(np.minimum.reduce(tried))


def to_box(p: Floats, q: Floats, box: Floats) -> Floats:
    """Return the distances (m,) of segments from a box, by halving between slopes."""
    low, high, step = np.zeros(len(p)), np.ones(len(p)), q - p
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        x = p + middle[:, None] * step
        rising = np.einsum("mi,mi->m", step, x - np.clip(x, *box)) > 0.0
        low, high = np.where(rising, low, middle), np.where(rising, middle, high)
    return np.asarray(_outside(p + low[:, None] * step, box))


def _outside(x: Floats, box: Floats) -> Any:
    return np.linalg.norm(x - np.clip(x, *box), axis=-1)
