"""Capacity margins by plain NumPy, for as many cables as directions and two: what kernels are held
against. Kinematics and margins are computed here once more.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BruteMargin:
    """Exit and anchor points (n, 3), bounds of tensions (n,), and wrenches about a point."""

    exits: Floats
    anchors: Floats
    home_rotation: Floats
    centre: Floats
    low_N: Floats
    high_N: Floats
    weight: Floats
    """Wrench (6,) that always acts."""
    added: Floats
    """Wrenches (k, 6), each of which may be added with any factor from -1 to 1."""

    def margins(self, p: Floats, phi: Floats) -> Floats:
        """Return the margins (m,), N, at positions and rotation vectors (m, 3)."""
        Q = Rotation.from_rotvec(phi).as_matrix() @ self.home_rotation
        arms = np.einsum("mij,nj->mni", Q, self.anchors - self.centre)
        to_exit = self.exits - (p[:, None] + np.einsum("mij,nj->mni", Q, self.anchors))
        u = to_exit / np.linalg.norm(to_exit, axis=2)[..., None]
        W = np.concatenate([u, np.cross(arms, u)], axis=2).swapaxes(1, 2)
        wrenches = np.vstack([self.weight, self.added]).T
        t = -W.swapaxes(1, 2) @ np.linalg.solve(W @ W.swapaxes(1, 2), wrenches)
        N = np.linalg.qr(W.swapaxes(1, 2), mode="complete")[0][:, :, 6:]
        half, middle = 0.5 * (self.high_N - self.low_N), 0.5 * (self.high_N + self.low_N)
        least = np.full(len(p), half.min())
        for cables in combinations(range(8), 3):
            chosen = list(cables)
            # what of these three tensions no null direction changes
            y = np.cross(N[:, chosen, 0], N[:, chosen, 1])
            size = np.abs(y).sum(axis=1)
            along = np.einsum("mi,mik->mk", y, t[:, chosen])
            off = np.abs(along[:, 0] - y @ middle[chosen]) + np.abs(along[:, 1:]).sum(axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                here = (np.abs(y) @ half[chosen] - off) / size
            least = np.minimum(least, np.where(size > 1e-9, here, np.inf))
        return least
