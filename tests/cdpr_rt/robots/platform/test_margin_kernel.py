"""Whether a loop keeps its margin, against singular values by NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_rt.robots.platform.design.margin_kernel import keeps_margin


@pytest.mark.parametrize("coupling", [0.0, 0.02, 0.1, 0.5, 2.0])
@pytest.mark.parametrize("d", [1, 2, 3, 6])
def test_it_is_kept_while_the_least_singular_value_is_above_it(d: int, coupling: float) -> None:
    rng = np.random.default_rng(17)
    beside = coupling * (1.0 - np.eye(d)) + np.eye(d)
    told = []
    for _ in range(60):
        plants = beside * (rng.normal(size=(2, 2, 3, d, d)) + 1j * rng.normal(size=(2, 2, 3, d, d)))
        of_speed, of_place = rng.normal(size=(2, 3)) + 1j * rng.normal(size=(2, 3))
        damping, stiffness = rng.uniform(0.1, 2.0, (2, 2, d))
        C = np.multiply.outer(damping, of_speed) + np.multiply.outer(stiffness, of_place)
        S = np.eye(d) + C.transpose(0, 2, 1)[:, None, :, :, None] * plants
        least = float(np.linalg.svd(S, compute_uv=False).min())
        for share, kept in ((1.0 - 1e-6, True), (1.0 + 1e-6, False)):
            law = of_speed, of_place, damping, stiffness, share * least
            told.append(keeps_margin(plants, *law, np.zeros((2, d, d), complex)) is kept)
    assert all(told)
