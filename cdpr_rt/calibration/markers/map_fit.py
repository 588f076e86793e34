"""From what images show to a map with its verdict: the whole way, with what spoils it taken out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_profiles.devices.camera import CameraIntrinsics, MarkerSheets, rotation_vector_rad
from cdpr_rt.arrays import FloatArray, rms
from cdpr_rt.calibration.markers.bundle import Bundle, adjust
from cdpr_rt.calibration.markers.coverage import Coverage, coverage, listed
from cdpr_rt.calibration.markers.diagnosis import LensSuspicion, Suspect, lens_suspicion, suspects
from cdpr_rt.calibration.markers.geometry.rotations import exponentials
from cdpr_rt.calibration.markers.geometry.square_pose import square_poses
from cdpr_rt.calibration.markers.graph import first_map
from cdpr_rt.calibration.markers.marker_map import MarkerMap, best_fit
from cdpr_rt.calibration.markers.reprojection import Estimate
from cdpr_rt.calibration.markers.seen_markers import SeenMarkers
from cdpr_rt.calibration.markers.sighting import Sighting, laid_out
from cdpr_rt.errors import InvalidRequestError

_MOST_ROUNDS = 4
_GOOD_px, _POOR_px = 0.35, 1.5
_SCALE_OFF = 0.004
_FRAME_RATIO = 2.0
_MIRRORED_IMAGES = 2
"""Of a marker that is read rightly as well: one image may show by chance what reads as another."""
_MISFIT_WEIGHT, _MISFIT_SHARE = 0.05, 0.05
"""A corner has so little weight from 13 standard deviations on."""


@dataclass(frozen=True)
class KnownFit:
    """Agreement of a map with the known places of markers that it was made without."""

    scale: float
    """Distances in the layout over those of the map."""
    rms_m: float
    """Of what is left, after position, rotation and scale."""
    used: int


@dataclass(frozen=True)
class MapFit:
    """A map, how good it is, and what was wrong on the way."""

    bundle: Bundle
    seen: SeenMarkers
    """Markers that the map was made from."""
    fixed: tuple[int, ...]
    coverage: Coverage
    dropped: tuple[Suspect, ...]
    """Markers that were taken out."""
    lens: LensSuspicion
    known: KnownFit | None
    faults: tuple[str, ...]
    """Faults in words; the map is not to be trusted where there is one."""
    warnings: tuple[str, ...]
    """Faults of markers that were left out of the map."""
    notes: tuple[str, ...]
    """Warnings in words."""

    @property
    def map(self) -> MarkerMap:
        """The map itself."""
        return self.bundle.estimate.map


def fit_map(
    sightings: Sequence[Sighting],
    intrinsics: CameraIntrinsics,
    sheets: MarkerSheets,
    reference: int | None = None,
) -> MapFit:
    """Return the map that the sightings, in the order in which they were taken, determine.

    Without known places it is in the frame of the marker `reference`, the one that images agree
    on most where left out; with them in that of the layout, whose known markers are held. Raises
    InvalidRequestError where no image shows two markers, BundleError where they determine nothing.
    """
    cover = coverage(sightings, sheets.placed)
    sightings = laid_out(sightings, sheets.placed)
    island = set(cover.islands[0]) if cover.islands else set()
    if len(island) < 2:
        raise InvalidRequestError("; ".join(["no image shows two markers together", *cover.advice]))
    seen = _observations(sightings, sheets, island)
    lens = np.array(intrinsics.parameters)
    bundle, seen, dropped = _without_suspects(seen, lens, reference)
    start = bundle.estimate.map.reference
    suspicion = lens_suspicion(bundle, seen, (start,))
    known = _compare(bundle.estimate.map, sheets)
    fixed: tuple[int, ...] = (start,)
    if numbers := known_places(bundle.estimate.map, sheets)[0]:
        fixed = tuple(seen.ids[k] for k in numbers)
        bundle = _held(bundle, seen, sheets)
    faults = _faults(cover, suspicion, known) + misfits(bundle)
    notes = _notes(bundle, cover, known, sheets, fixed)
    return MapFit(
        *(bundle, seen, fixed, cover, tuple(dropped), suspicion, known),
        *(tuple(faults), tuple(warnings(sightings, dropped)), tuple(notes)),
    )


def _observations(
    sightings: Sequence[Sighting], sheets: MarkerSheets, island: set[int]
) -> SeenMarkers:
    rows = [
        (image, marker, corners)
        for image, one in enumerate(sightings)
        if one.problem is None
        for marker, corners in one.corners_px.items()
        if marker in island
    ]
    sizes = {marker: sheets.size_of(marker) for marker in island}
    return SeenMarkers.of([one.name for one in sightings], rows, sizes)


def _without_suspects(
    seen: SeenMarkers, lens: FloatArray, reference: int | None
) -> tuple[Bundle, SeenMarkers, list[Suspect]]:
    """Return the fit without the markers that do not fit."""
    if reference is not None and reference not in seen.ids:
        raise InvalidRequestError(
            f"reference marker {reference} is not in the map; in it: {listed(seen.ids)}"
        )
    dropped: list[Suspect] = []
    for _ in range(_MOST_ROUNDS):
        first = first_map(seen, square_poses(seen, lens), reference)
        bundle = adjust(Estimate(first, lens), seen, (first.reference,))
        found = suspects(bundle, seen)
        if not found or 2 * len(found) > len(seen.ids):  # not the markers are wrong, then
            break
        dropped += found
        for one in found:
            seen = one.without(seen)
        bad = [one.marker for one in found if one.images is None]
        reference = None if reference in bad else reference
    return bundle, seen, dropped


def known_places(map_: MarkerMap, sheets: MarkerSheets) -> tuple[list[int], FloatArray, FloatArray]:
    """Return numbers in the map, positions and rotations of known markers that have a place."""
    known = [
        one for one in sheets.known if one.id in map_.ids and map_.placed[map_.ids.index(one.id)]
    ]
    numbers = [map_.ids.index(one.id) for one in known]
    places = np.array([one.position_m for one in known]).reshape(-1, 3)
    turns = np.array([rotation_vector_rad(one.rotation_deg) for one in known]).reshape(-1, 3)
    return numbers, places, exponentials(turns)


def aligned(
    map_: MarkerMap, sheets: MarkerSheets
) -> tuple[MarkerMap, list[int], FloatArray, FloatArray]:
    """Return the map moved to where the known markers are, and what `known_places` returns.

    Their corners are made to meet as well as they can; the map keeps its size.
    """
    numbers, places, turns = known_places(map_, sheets)
    corners = map_.corners_m()[numbers]
    flat = (corners - map_.position_m[numbers][:, None]) @ map_.rotation[numbers]
    own = flat @ turns.transpose(0, 2, 1) + places[:, None]
    turn, shift = best_fit(corners.reshape(-1, 3), own.reshape(-1, 3))
    return map_.moved(turn, shift, map_.ids[numbers[0]]), numbers, places, turns


def _compare(map_: MarkerMap, sheets: MarkerSheets) -> KnownFit | None:
    """Return how the map agrees with known places, None with fewer than two of them."""
    if len(known_places(map_, sheets)[0]) < 2:
        return None
    moved, numbers, places, _ = aligned(map_, sheets)
    middles = moved.position_m[numbers]
    middles, places = middles - middles.mean(axis=0), places - places.mean(axis=0)
    scale = float(np.linalg.norm(places) / np.linalg.norm(middles))
    left = scale * middles - places
    return KnownFit(scale, float(np.sqrt((left**2).sum(axis=1).mean())), len(numbers))


def _held(bundle: Bundle, seen: SeenMarkers, sheets: MarkerSheets) -> Bundle:
    """Return the fit with the known markers held at their places."""
    moved, numbers, places, turns = aligned(bundle.estimate.map, sheets)
    moved.position_m[numbers] = places
    moved.rotation[numbers] = turns
    fixed = tuple(moved.ids[k] for k in numbers)
    return adjust(Estimate(moved, bundle.estimate.lens), seen, fixed)


def warnings(sightings: Sequence[Sighting], dropped: Sequence[Suspect]) -> list[str]:
    """Return what was wrong with single markers, in words."""
    said = []
    twice = Counter(marker for one in sightings for marker in one.repeated)
    for marker, images in sorted(twice.items()):
        said.append(f"marker {marker} is twice in {images} images: its id was printed twice")
    mirrored = Counter(marker for one in sightings for marker in one.mirrored)
    for marker, images in sorted(mirrored.items()):
        read = any(marker in one.corners_px for one in sightings)
        if images >= _MIRRORED_IMAGES or not read:
            where = "an image" if images == 1 else f"{images} images"
            said.append(f"marker {marker} is printed as its mirror image, by {where}; left out")
    texts: dict[int, list[str]] = {}
    for one in dropped:
        texts.setdefault(one.marker, []).append(one.text)
    return said + ["; without these: ".join(each) for each in texts.values()]


def island_faults(cover: Coverage) -> list[str]:
    """Return what is to be said where images show markers that hang together with no others."""
    if cover.connected:
        return []
    return [
        f"{len(cover.islands)} islands: the map holds the largest, {len(cover.islands[0])} of "
        f"{len(cover.ids)} markers"
    ]


def _faults(cover: Coverage, lens: LensSuspicion, known: KnownFit | None) -> list[str]:
    faults = island_faults(cover)
    if lens.wrong:
        faults.append(
            f"the intrinsics are not this camera's as it is now: the images ask for a focal "
            f"length {100.0 * lens.focal_change:+.2f} % different and fit to {lens.rms_px:.2f} px "
            "then; was the lens turned or the resolution changed? `cdpr camera calibrate`"
        )
    if known is not None and abs(known.scale - 1.0) > _SCALE_OFF:
        faults.append(
            f"known markers are {100.0 * (known.scale - 1.0):+.2f} % further apart than the size "
            f"told makes them: measure the black square; it may be {known.scale:.4f} times as large"
        )
    return faults


def misfits(bundle: Bundle) -> list[str]:
    """Return what is to be said of corners that do not fit, whosever they are."""
    seen = np.isfinite(bundle.off_px)
    share = 1.0 - float((bundle.weight[seen] > _MISFIT_WEIGHT).mean())
    if share <= _MISFIT_SHARE:
        return []
    return [
        f"{100.0 * share:.0f} % of all corners do not fit, and no one marker is to blame: was the "
        "camera moving, or are several sheets loose?"
    ]


def _notes(
    bundle: Bundle,
    cover: Coverage,
    known: KnownFit | None,
    sheets: MarkerSheets,
    fixed: Sequence[int],
) -> list[str]:
    notes = list(cover.advice)
    if known is None:
        notes.append(
            f"the map's scale is that of the size told ({1e3 * sheets.size_m:g} mm): images alone "
            "cannot see it wrong; two markers at known places, or the robot's cables, can"
        )
    if bundle.sheets.sigma_m > 0.0:
        notes.append(
            f"corners are {1e3 * bundle.sheets.sigma_m:.2f} mm off on their sheets, the same in "
            "all images: paper that is not flat, or the printer's scale; more images do not help"
        )
    in_frame, shape = (_typical_mm(one) for one in (bundle.marker_sigma_m, bundle.shape_sigma_m))
    if len(fixed) == 1 and in_frame > _FRAME_RATIO * shape:
        notes.append(
            f"places are known to {shape:.2f} mm against each other, to {in_frame:.2f} mm in the "
            f"frame of marker {fixed[0]}: one sheet tells little of its own tilt; a larger one, or "
            "known places, give a better frame"
        )
    return notes


def _typical_mm(sigma_m: FloatArray) -> float:
    """Return the root of the mean square of the lengths of deviations (m, 3)."""
    return 1e3 * rms(sigma_m[np.isfinite(sigma_m).all(axis=1)])


def verdict(fit: MapFit) -> str:
    """Return one sentence on how good a map is."""
    sigma = 1e3 * np.linalg.norm(fit.bundle.shape_sigma_m[fit.map.placed], axis=1)
    worst = int(np.argmax(sigma))
    ids = np.array(fit.map.ids)[fit.map.placed]
    rms = fit.bundle.rms_px
    how = "good" if rms < _GOOD_px else "usable" if rms < _POOR_px else "poor"
    if fit.faults:
        how = "not to be trusted"
    dropped = [one.marker for one in fit.dropped if one.images is None]
    without = f", without {listed(dropped)}" if dropped else ""
    return (
        f"{how}{without}: {int(fit.map.placed.sum())} markers from "
        f"{int(fit.map.located.sum())} images, corners fit to "
        f"{rms:.3f} px; places are known to {_typical_mm(fit.bundle.shape_sigma_m):.2f} mm against "
        f"each other (1 sigma), worst marker "
        f"{ids[worst]} to {sigma[worst]:.2f} mm"
    )
