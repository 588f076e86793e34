"""Volume, area and surface of where values on a grid are not negative, against `trimesh`."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.workspace_analysis.surface import area, isosurface, volume


def ball(radius: float, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    side = np.linspace(-1.0, 1.0, count)
    x, y, z = np.meshgrid(side, side, side, indexing="ij")
    return radius - np.sqrt(x * x + y * y + z * z), np.full(3, -1.0), np.full(3, side[1] - side[0])


@settings(max_examples=40)
@given(st.tuples(*[st.integers(2, 7)] * 3), st.integers(0, 2**32 - 1), st.floats(-2.0, 2.0))
def test_whatever_the_values_the_surface_is_closed_and_has_its_volume(
    shape: tuple[int, int, int], seed: int, level: float
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=shape) + level
    values[rng.random(shape) < 0.05] = -np.inf
    spacing = rng.uniform(0.1, 2.0, 3)
    vertices, triangles = isosurface(values, rng.normal(size=3), spacing)
    if not (values >= 0.0).any():
        assert not len(triangles)
        return
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert volume(vertices, triangles) == pytest.approx(mesh.volume, rel=1e-9)
    assert volume(vertices, triangles) > 0.0


def test_a_ball_has_its_volume_and_what_is_cut_off_at_the_side_not() -> None:
    values, low, spacing = ball(0.8, 41)
    whole = volume(*isosurface(values, low, spacing))
    assert whole == pytest.approx(4.0 / 3.0 * math.pi * 0.8**3, rel=5e-3)
    half = volume(*isosurface(values[:21], low, spacing))
    assert half == pytest.approx(0.5 * whole, rel=5e-3)
    assert volume(*isosurface(np.ones((5, 4, 3)), np.zeros(3), np.ones(3))) == pytest.approx(
        4.0 * 3.0 * 2.0, rel=5e-3
    )


def test_a_disc_has_its_area() -> None:
    values, _, spacing = ball(0.8, 61)
    across = values[:, :, 30]
    assert area(across, spacing[0] ** 2) == pytest.approx(math.pi * 0.64, rel=5e-3)
    across[across < 0.0] = -np.inf
    assert area(across, spacing[0] ** 2) == pytest.approx(math.pi * 0.64, rel=0.08)
    assert area(-np.ones((4, 4)), 1.0) == 0.0
    assert area(np.ones((4, 3)), 1.0) == pytest.approx(6.0)
