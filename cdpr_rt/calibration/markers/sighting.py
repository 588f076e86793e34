"""Markers detected in one image, as detectors return them and data files hold them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from cdpr_rt.arrays import FloatArray


@dataclass(frozen=True)
class Sighting:
    """Markers detected in one image."""

    name: str
    corners_px: Mapping[int, FloatArray]
    """Corners of each marker that is there once and sharp, (4, 2)."""
    repeated: tuple[int, ...] = ()
    """Ids that are there more than once."""
    unsharp: tuple[int, ...] = ()
    """Ids whose edges are hidden or blurred."""
    mirrored: tuple[int, ...] = ()
    """Ids that only a mirror image of it shows."""
    problem: str | None = None
    """Fault of the image as a whole in words, "" for none."""


def laid_out(sightings: Sequence[Sighting], placed: Collection[int]) -> list[Sighting]:
    """Return sightings without ids that are not among those laid out; as they are of none told.

    A chessboard or a poster may read as a marker, as sharp as one and without a wrong bit.
    """
    if not placed:
        return list(sightings)

    def ours(ids: Collection[int]) -> tuple[int, ...]:
        return tuple(marker for marker in ids if marker in placed)

    return [
        replace(
            one,
            corners_px={marker: one.corners_px[marker] for marker in ours(one.corners_px)},
            repeated=ours(one.repeated),
            unsharp=ours(one.unsharp),
            mirrored=ours(one.mirrored),
        )
        for one in sightings
    ]
