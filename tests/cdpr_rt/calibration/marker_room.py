"""A room with markers and a camera that observes their corners, without images."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_profiles.camera import CameraIntrinsics
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera_geometry import logarithms, project
from cdpr_rt.calibration.marker_map import CORNERS, MarkerMap, SeenMarkers, Sighting

LENS = np.array([604.0, 606.0, 322.3, 255.8, -0.112, 0.083, 4e-4, -3e-4, -0.012])
WIDTH, HEIGHT = 640, 512


def intrinsics(lens: np.ndarray = LENS) -> CameraIntrinsics:
    return CameraIntrinsics(
        width_px=WIDTH,
        height_px=HEIGHT,
        focal_px=tuple(lens[:2].tolist()),
        centre_px=tuple(lens[2:4].tolist()),
        distortion=tuple(lens[4:].tolist()),
    )


@dataclasses.dataclass
class Room:
    """The true map and the observations."""

    truth: MarkerMap
    seen: SeenMarkers

    def sightings(self) -> list[Sighting]:
        seen = self.seen
        return [
            Sighting(
                name,
                {
                    seen.ids[m]: corners
                    for m, corners in zip(
                        seen.marker[seen.image == i], seen.corners_px[seen.image == i], strict=True
                    )
                },
            )
            for i, name in enumerate(seen.names)
        ]

    def with_marker_off(
        self, marker: int, off_m: tuple[float, float, float], when: Callable[[int], bool]
    ) -> Room:
        """Return the room with a marker displaced in the images numbered `when`."""
        return self.with_corners_off(marker, np.tile(off_m, (4, 1)), when)

    def with_corners_off(self, marker: int, off_m: np.ndarray, when: Callable[[int], bool]) -> Room:
        """Return the room with the corners (4, 3) of a marker displaced in the images `when`."""
        k, corners = self.seen.ids.index(marker), self.seen.corners_px.copy()
        map_ = self.truth
        for row in np.flatnonzero(self.seen.marker == k):
            i = int(self.seen.image[row])
            if when(i):
                at = map_.corners_m()[k] + off_m - map_.camera_position_m[i]
                corners[row] = project(at @ map_.camera_rotation[i], LENS)
        return Room(self.truth, dataclasses.replace(self.seen, corners_px=corners))


def room(
    seed: int = 1,
    *,
    rows: int = 4,
    columns: int = 5,
    images: int = 25,
    size_m: float = 0.15,
    noise_px: float = 0.05,
    heights_m: float = 0.001,
    tilt_deg: float = 15.0,
) -> Room:
    """Return markers in rows on a floor, observed from 1.1 to 1.6 m above it."""
    print(f"room of seed {seed}")
    chance = np.random.default_rng(seed)
    count = rows * columns
    row, column = np.divmod(np.arange(count), columns)
    middle = np.column_stack(
        [(column - (columns - 1) / 2) * 0.32, ((rows - 1) / 2 - row) * 0.32, np.zeros(count)]
    )
    middle += chance.normal(0.0, (0.02, 0.02, heights_m), (count, 3))
    turn = Rotation.from_rotvec(chance.normal(0.0, (0.005, 0.005, 0.3), (count, 3))).as_matrix()
    reach = ((columns - 1) * 0.16, (rows - 1) * 0.16)
    where = np.column_stack(
        [*(chance.uniform(-one, one, images) for one in reach), chance.uniform(1.1, 1.6, images)]
    )
    axis = chance.standard_normal((images, 3))
    axis *= np.radians(chance.uniform(0.0, tilt_deg, images) / np.linalg.norm(axis, axis=1))[
        :, None
    ]
    down = Rotation.from_rotvec(axis).as_matrix() @ np.diag([1.0, -1.0, -1.0])
    rows_seen = []
    for i in range(images):
        for k in range(count):
            at = (CORNERS * size_m @ turn[k].T + middle[k] - where[i]) @ down[i]
            corners = project(at, LENS)
            if (corners > 2).all() and (corners < (WIDTH - 3, HEIGHT - 3)).all():
                rows_seen.append((i, k, corners + chance.normal(0.0, noise_px, (4, 2))))
    names = [f"image {i}" for i in range(images)]
    seen = SeenMarkers.of(names, rows_seen, dict.fromkeys(range(count), size_m))
    k = list(seen.ids)
    truth = MarkerMap(
        *(seen.ids, seen.ids[0], seen.size_m, middle[k], turn[k]), *(seen.names, where, down)
    )
    return Room(truth, seen)


def seen_from(map_: MarkerMap, marker: int) -> MarkerMap:
    """Return the map in the frame of `marker`."""
    k = map_.ids.index(marker)
    back = map_.rotation[k].T
    return map_.moved(back, -back @ map_.position_m[k], marker)


@dataclasses.dataclass(frozen=True)
class MapDifference:
    """Differences between two maps in the frame of one marker (thesis, figures 3.20 and 3.21)."""

    ids: tuple[int, ...]
    distance_m: FloatArray
    """Distance of each marker's centre from that of the reference marker, (m,)."""
    position_error_m: FloatArray
    """Position difference of the centres, (m,)."""
    rotation_error_rad: FloatArray
    """Angle difference, (m,)."""


def difference(map_: MarkerMap, other: MarkerMap, reference: int | None = None) -> MapDifference:
    """Return the difference between two maps whose markers `reference` coincide."""
    reference = map_.reference if reference is None else reference
    a, b = seen_from(map_, reference), seen_from(other, reference)
    common = [
        marker
        for marker in a.ids
        if marker in b.ids and a.placed[a.ids.index(marker)] and b.placed[b.ids.index(marker)]
    ]
    i, j = ([one.ids.index(marker) for marker in common] for one in (a, b))
    off = a.position_m[i] - b.position_m[j]
    turn = logarithms(a.rotation[i] @ b.rotation[j].transpose(0, 2, 1))
    return MapDifference(
        tuple(common),
        np.linalg.norm(b.position_m[j], axis=1),
        np.linalg.norm(off, axis=1),
        np.linalg.norm(turn, axis=1),
    )
