"""Surface, volume and area of where values on a grid are not negative, by linear interpolation."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray

Triangles = NDArray[np.int64]
"""Triples of vertices, anticlockwise as seen from outside, (f, 3)."""
_OUTSIDE = 1e3
_APART = 1e-3
"""Share of an edge that a crossing stays from its ends, so that no two of them coincide."""
_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)])


def isosurface(
    values: FloatArray, low_m: FloatArray, spacing_m: FloatArray
) -> tuple[FloatArray, Triangles]:
    """Return vertices (v, 3) and triangles of the closed surface around values (a, b, c) >= 0.

    Of each cell six tetrahedra along its diagonal are cut (marching tetrahedra): neighbours agree
    on every face, whatever the values, so there are no gaps. What reaches the grid's sides is
    closed there.
    """
    outside = _outside(values)
    padded = np.pad(np.nan_to_num(values, neginf=outside), 1, constant_values=outside)
    nodes = np.arange(padded.size).reshape(padded.shape)
    flat = padded.ravel()
    edges: list[NDArray[np.int64]] = []
    for axes in itertools.permutations(range(3)):
        corners = _CORNERS[:, np.argsort(axes)]
        tetrahedra = np.stack([_at(nodes, corner).ravel() for corner in corners], axis=1)
        edges += _cut(tetrahedra, flat >= 0.0, _is_even(axes))
    if not edges:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    ends = np.sort(np.concatenate(edges).reshape(-1, 2), axis=1)
    crossed, places = np.unique(ends, axis=0, return_inverse=True)
    a, b = flat[crossed[:, 0]], flat[crossed[:, 1]]
    share = np.clip(a / (a - b), _APART, 1.0 - _APART)[:, None]
    first, last = (
        np.stack(np.unravel_index(crossed[:, k], padded.shape), axis=1) - 1.0 for k in range(2)
    )
    vertices = low_m + spacing_m * (first + share * (last - first))
    return vertices, places.reshape(-1, 3)


def volume(vertices: FloatArray, triangles: Triangles) -> float:
    """Return the volume that a closed surface of triangles encloses, by Gauss' theorem."""
    if not len(triangles):
        return 0.0
    a, b, c = (vertices[triangles[:, k]] - vertices[0] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def area(values: FloatArray, cell_m2: float) -> float:
    """Return the area where values on a grid (a, b) are not negative; a cell is two triangles."""
    v = np.nan_to_num(values, neginf=_outside(values))
    low, high = v[:-1, :-1].ravel(), v[1:, 1:].ravel()
    both = [np.sort(np.stack([low, one.ravel(), high]), axis=0) for one in (v[1:, :-1], v[:-1, 1:])]
    return 0.5 * cell_m2 * sum(float(_share(corners).sum()) for corners in both)


def _outside(values: FloatArray) -> float:
    """Return the value of a place that is outside whatever is next to it."""
    finite = np.abs(values[np.isfinite(values)])
    return -_OUTSIDE * max(float(finite.max(initial=0.0)), 1e-9)


def _share(corners: FloatArray) -> FloatArray:
    """Return the share of each triangle that is not negative; its values ascend, (3, m)."""
    a, b, c = corners
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = c * c / ((c - a) * (c - b)), 1.0 - a * a / ((a - b) * (a - c))
    some = np.where(b < 0.0, one, two)
    return np.where(a >= 0.0, 1.0, np.where(c < 0.0, 0.0, some))


def _at(nodes: NDArray[np.int64], corner: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the nodes at one corner of every cell."""
    return nodes[tuple(slice(k, size - 1 + k) for k, size in zip(corner, nodes.shape, strict=True))]


def _is_even(axes: tuple[int, ...]) -> bool:
    return float(np.linalg.det(np.eye(3)[list(axes)])) > 0.0


def _cut(
    tetrahedra: NDArray[np.int64], inside: NDArray[np.bool_], even: bool
) -> list[NDArray[np.int64]]:
    """Return the triangles of all tetrahedra (t, 4) that are cut: (f, 3, 2) ends of edges."""
    code = inside[tetrahedra] @ np.array([1, 2, 4, 8])
    found = []
    for case, triangles in _CASES.items():
        cut = tetrahedra[code == case]
        for triangle in triangles if len(cut) else ():
            ordered = triangle if even else triangle[::-1]
            found.append(np.stack([cut[:, list(edge)] for edge in ordered], axis=1))
    return found


def _cases() -> dict[int, list[list[tuple[int, int]]]]:
    """Return the triangles by which corners of a tetrahedron are inside, seen from outside."""
    cases: dict[int, list[list[tuple[int, int]]]] = {}
    for case in range(1, 15):
        ins = [k for k in range(4) if case >> k & 1]
        outs = [k for k in range(4) if not case >> k & 1]
        edges = [(i, o) for i in ins for o in outs]
        if len(ins) == 2:
            a, b, c, d = edges
            triangles = [[a, b, d], [a, d, c]]
        else:
            triangles = [edges]
        outward = _CORNERS[outs].mean(axis=0) - _CORNERS[ins].mean(axis=0)
        cases[case] = [edge if _normal(edge) @ outward > 0.0 else edge[::-1] for edge in triangles]
    return cases


def _normal(edges: list[tuple[int, int]]) -> FloatArray:
    a, b, c = (_CORNERS[list(edge)].mean(axis=0) for edge in edges)
    return np.cross(b - a, c - a)


_CASES = _cases()
