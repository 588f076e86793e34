"""The surface of a workspace as a file for other programs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.robots.workspace_analysis.surface import Triangles


def mesh(vertices: FloatArray, triangles: Triangles) -> trimesh.Trimesh:
    """Return a surface as what `trimesh` computes with, as it is."""
    return trimesh.Trimesh(vertices, triangles, process=False)


def save_mesh(path: Path, vertices: FloatArray, triangles: Triangles) -> None:
    """Write a closed surface, in m, in the format that the path's suffix names; raises OSError."""
    mesh(vertices, triangles).export(path)


def section(
    vertices: FloatArray, triangles: Triangles, centre_m: FloatArray, axis: int
) -> FloatArray:
    """Return the lines (s, 2, 3) in which a plane across a coordinate axis cuts a surface."""
    normal = [float(k == axis) for k in range(3)]
    cut: Callable[..., Any] = trimesh.intersections.mesh_plane
    return np.asarray(cut(mesh(vertices, triangles), normal, centre_m))
