"""Markers seen in a set of images."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.errors import InvalidRequestError

CORNERS = np.array([(-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (-0.5, -0.5, 0.0)])
"""Corners of a marker of size 1 in its own frame, as a detector orders them: from above on the
left, clockwise. Its frame has x to the right, y upward and z out of the sheet."""


@dataclass(frozen=True)
class SeenMarkers:
    """n markers seen in images: `image` (n,), `marker` (n,) and `corners_px` (n, 4, 2).

    `image` counts `names`, in the order in which the images were taken; `marker` counts `ids`.
    """

    names: tuple[str, ...]
    ids: tuple[int, ...]
    image: IntArray
    marker: IntArray
    corners_px: FloatArray
    size_m: FloatArray
    """Of each marker in `ids`, (m,)."""

    @classmethod
    def of(
        cls,
        names: Iterable[str],
        seen: Iterable[tuple[int, int, FloatArray]],
        size_m: Mapping[int, float],
    ) -> Self:
        """Return what was seen: (number of the image, id, corners (4, 2)) each.

        Raises InvalidRequestError where a marker is there twice in an image, or has no size.
        """
        rows = sorted(seen, key=lambda row: row[:2])
        places = [row[:2] for row in rows]
        if len(set(places)) < len(places):
            image, marker = next(a for a, b in pairwise(places) if a == b)
            raise InvalidRequestError(f"marker {marker} is there twice in image number {image}")
        ids = tuple(sorted({marker for _, marker in places}))
        if missing := [marker for marker in ids if marker not in size_m]:
            raise InvalidRequestError(f"marker {missing[0]} was seen, but has no size")
        number = {marker: k for k, marker in enumerate(ids)}
        return cls(
            names=tuple(names),
            ids=ids,
            image=np.array([image for image, _ in places], np.int64),
            marker=np.array([number[marker] for _, marker in places], np.int64),
            corners_px=np.array([row[2] for row in rows], float).reshape(-1, 4, 2),
            size_m=np.array([size_m[marker] for marker in ids]),
        )

    def __len__(self) -> int:
        return len(self.image)

    @property
    def corners_m(self) -> FloatArray:
        """Corners of what was seen, each in its marker's frame, (n, 4, 3)."""
        return np.asarray(CORNERS * self.size_m[self.marker][:, None, None])

    def keep(self, kept: BoolArray) -> SeenMarkers:
        """Return only those of `kept` (n,); names and ids stay as they are."""
        return replace(
            self,
            image=self.image[kept],
            marker=self.marker[kept],
            corners_px=self.corners_px[kept],
        )

    def of_images(self, chosen: IntArray) -> SeenMarkers:
        """Return what the chosen images (k,) show, numbered in this order."""
        place = np.full(len(self.names), -1)
        place[chosen] = np.arange(len(chosen))
        kept = self.keep(place[self.image] >= 0)
        names = tuple(self.names[i] for i in chosen)
        return replace(kept, names=names, image=place[kept.image])
