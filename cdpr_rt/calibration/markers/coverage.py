"""Whether the images taken so far can become one map, and what to do where not: before going on.

Only which markers each image shows is looked at, as section 3.7.3 of the thesis does for the share
of the markers seen; no lens has to be known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from cdpr_rt.calibration.markers.sighting import Sighting, laid_out

_FEW_IMAGES = 3
_LISTED = 12


@dataclass(frozen=True)
class Coverage:
    """Connection of the images by the markers that they share."""

    images: int
    ids: tuple[int, ...]
    """All that were seen, of those laid out where these are known."""
    islands: tuple[tuple[int, ...], ...]
    """Markers that are connected by images that show several, the largest island first."""
    share_seen: float | None
    """Of the markers laid out, where their ids are known."""
    unseen: tuple[int, ...]
    seldom: tuple[int, ...]
    """Seen in fewer than three images."""
    useless: tuple[str, ...]
    """Images with fewer than two markers, by name."""
    advice: tuple[str, ...]

    @property
    def connected(self) -> bool:
        """Whether there is one island."""
        return len(self.islands) == 1

    @property
    def apart(self) -> list[tuple[int, ...]]:
        """Islands besides the largest, without those that may be none.

        Such as were seen in one image or two.
        """
        return [one for one in self.islands[1:] if set(one) - set(self.seldom)]

    def lines(self) -> list[str]:
        """Return in words what share was seen, and what to do."""
        share = self.share_seen
        many = len(self.ids) if share is None else f"{share:.0%} of the"
        return [f"{many} markers seen", *self.advice]

    def as_json(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "share_seen": self.share_seen,
            "islands": [list(island) for island in self.islands],
            "unseen": list(self.unseen),
            "seldom": list(self.seldom),
            "advice": list(self.advice),
        }


def coverage(sightings: Sequence[Sighting], placed: Sequence[int] = ()) -> Coverage:
    """Return how sightings hang together; `placed` are all ids that were laid out, if known."""
    read = {marker for one in sightings for marker in one.corners_px}
    sightings = laid_out(sightings, placed)
    shown = [tuple(one.corners_px) for one in sightings]
    ids = tuple(sorted({marker for markers in shown for marker in markers}))
    islands = _islands(shown, ids)
    counts = {marker: sum(marker in markers for markers in shown) for marker in ids}
    unseen = tuple(sorted(set(placed) - set(ids)))
    seldom = tuple(marker for marker in ids if counts[marker] < _FEW_IMAGES)
    useless = tuple(
        one.name for one, markers in zip(sightings, shown, strict=True) if len(markers) < 2
    )
    share = 1.0 - len(unseen) / len(placed) if placed else None
    return Coverage(
        *(len(sightings), ids, islands, share, unseen, seldom, useless),
        tuple(
            _mirrored(sightings, ids)
            + _advice(islands, unseen, seldom, useless, len(sightings))
            + _strange(read - set(ids))
        ),
    )


def _islands(shown: Sequence[tuple[int, ...]], ids: Sequence[int]) -> tuple[tuple[int, ...], ...]:
    number = {marker: k for k, marker in enumerate(ids)}
    links = [(number[markers[0]], number[other]) for markers in shown for other in markers[1:]]
    rows, columns = np.array(links, np.int64).reshape(-1, 2).T
    graph = csr_array((np.ones(len(links)), (rows, columns)), shape=(len(ids), len(ids)))
    count, label = connected_components(graph, directed=False)
    found = [tuple(i for i, of in zip(ids, label, strict=True) if of == k) for k in range(count)]
    return tuple(sorted(found, key=lambda one: (-len(one), one)))


def _advice(
    islands: Sequence[tuple[int, ...]],
    unseen: Sequence[int],
    seldom: Sequence[int],
    useless: Sequence[str],
    images: int,
) -> list[str]:
    said = []
    if not islands:
        return ["no image shows a marker: is the dictionary the one that was printed?"]
    for island in islands[1:]:
        said.append(
            f"no image shows {listed(island)} together with the others: take one that shows one "
            f"of them and one of {listed(islands[0])}, or put a marker between"
        )
    if unseen:
        said.append(f"{listed(unseen)} never seen: add poses there, tilt more, or move the sheets")
    if seldom:
        said.append(f"{listed(seldom)} seen in fewer than {_FEW_IMAGES} images: add poses there")
    if len(useless) > images // 4:
        said.append(
            f"{len(useless)} of {images} images show fewer than two markers and tell nothing of "
            "how markers lie: put sheets closer together, or go higher"
        )
    return said


def _mirrored(sightings: Sequence[Sighting], ids: Sequence[int]) -> list[str]:
    """Return what is to be said where more markers are seen mirrored than as they should be."""
    mirrored = sorted({marker for one in sightings for marker in one.mirrored})
    if len(mirrored) <= len(ids):
        return []
    return [f"{listed(mirrored)} read as mirror images: are all sheets, or the images, so?"]


def _strange(ids: set[int]) -> list[str]:
    """Return what is to be said of ids that were read but not laid out."""
    if not ids:
        return []
    return [
        f"{listed(sorted(ids))} read, but not among those laid out (placed): left out; something "
        "else that the images show reads so"
    ]


def listed(ids: Sequence[int]) -> str:
    """Return "marker 3" or "markers 3, 5, 8" of ids, of many the first."""
    shown = ", ".join(map(str, ids[:_LISTED]))
    more = f" and {len(ids) - _LISTED} more" if len(ids) > _LISTED else ""
    return f"marker{'s' if len(ids) != 1 else ''} {shown}{more}"
