"""What one image shows of markers: what a detector hands on, and what data files hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cdpr_rt.arrays import FloatArray


@dataclass(frozen=True)
class Sighting:
    """What one image shows."""

    name: str
    corners_px: Mapping[int, FloatArray]
    """Of each marker that is there once and sharp, (4, 2)."""
    repeated: tuple[int, ...] = ()
    """Ids that are there more than once."""
    unsharp: tuple[int, ...] = ()
    """Ids whose edges are hidden or blurred."""
    mirrored: tuple[int, ...] = ()
    """Ids that only a mirror image of it shows."""
    problem: str | None = None
    """What is wrong with the image as a whole, in words."""
