"""Faults of images and markers, and which is right where camera and cables disagree."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Final

import numpy as np

from cdpr_rt.calibration.camera.camera_model import CameraModel
from cdpr_rt.calibration.estimation.faults import Fault, FaultKind, parameter_faults
from cdpr_rt.calibration.estimation.fit import Fit, fit
from cdpr_rt.calibration.estimation.parameters import DRUM, CableGeometry
from cdpr_rt.calibration.markers.map_fit import MapFit, misfits, warnings
from cdpr_rt.calibration.markers.sighting import Sighting

UNDECIDED = "undecided: "
"""Begins what is said of a contradiction that nothing settles."""
_OFF = 3.0
"""Standard deviations by which sizes, drums or lens are off before it is asked what is wrong."""
_LOOSE_SIZE, _LOOSE_DRUM, _LOOSE_FOCAL = 0.1, 0.05, 0.05
_LOOSE_LENS = (20.0, 20.0, 0.1, 0.1, 0.005, 0.005, 0.1)
"""Standard deviations, of the lens in px and of k1, k2, p1, p2, k3, of what is set free."""
_COUNTS: Final[dict[FaultKind, int]] = {"size": 1, "drum": 0, "lens": 9}
"""Causes, and how many numbers each sets free; 0 for one of each cable."""
_AT_ONCE = 3
"""Cables that slip from one pose to the next, of which it is asked whether they did."""
_SURE = 9.0
"""Ratio of sums of squares by which one explanation has to fit better than others."""


def map_faults(found: MapFit, sightings: Sequence[Sighting]) -> list[Fault]:
    """Return what is wrong with images and single markers, by the images alone."""
    faults = [
        Fault("image", -1, j, 0.0, f"image of {one.name}: {one.problem}; it is not used")
        for j, one in enumerate(sightings)
        if one.problem is not None
    ]
    texts = [*misfits(found.bundle), *warnings(sightings, found.dropped)]
    return faults + [Fault("marker", -1, -1, 0.0, text) for text in texts]


def moved_or_slipped(faults: Sequence[Fault]) -> list[Fault]:
    """Return what is to be said where several cables are off from one pose on.

    They seldom slip at once. A camera that was moved on its platform looks alike: what its images
    say of all later poses contradicts the lengths, and offsets of some cables explain most of it.
    """
    at = Counter(fault.pose for fault in faults if fault.kind == "jump")
    return [
        Fault(
            "camera", -1, pose, 0.0,
            f"{UNDECIDED}{cables} cables are off from pose {pose + 1} on: either they slipped "
            "together, or the camera was moved on its platform; look at both, and measure anew",
        )
        for pose, cables in at.items()
        if cables >= _AT_ONCE
    ]  # fmt: skip


def told_right(geometry: CableGeometry, found: Fit, first: MapFit) -> tuple[Fit, list[Fault]]:
    """Return the fit with wrong figures set free, and which those are: sheets, drums or the lens.

    Where one of them is far off what was known of it, cables and camera contradict each other.
    Each is set free in turn, with the others as they were told, and then each two together.
    The one that fits best explains it; exit points by tape, places of markers that are known, and
    measured points count. Where two explain it alike it is not known which, and the fit stays as
    it was.
    """
    camera = found.camera
    assert camera is not None
    if not _contradiction(geometry, found, first):
        return found, []
    tried = [_tried(geometry, found, (kind,)) for kind in _COUNTS]
    alone = {one.kinds[0]: one.score for one in tried}
    for pair in combinations(_COUNTS, 2):
        both = _tried(geometry, found, pair)
        # else one of them explains it as well
        if both.score <= min(alone[kind] for kind in pair) - _SURE:
            tried.append(both)
    tried.sort(key=lambda one: one.score)
    best = tried[0]
    if found.total_cost < best.score + _SURE:
        return found, []
    alike = [one for one in tried if one.score < best.score + _SURE]
    if len(alike) == 1:
        return _believed(geometry, best)
    causes = [" and ".join(_cause(kind, one.fit)[1] for kind in one.kinds) for one in alike]
    text = "cables and camera contradict each other: " + ", or ".join(causes)
    advice = "; nothing tells which: measure a black square, and one distance between two poses"
    kind = best.kinds[0]
    return found, [Fault(kind, -1, -1, _cause(kind, best.fit)[0], UNDECIDED + text + advice)]


@dataclass(frozen=True)
class _Cause:
    """Explanation by a wrong figure of the file, and the fit with it free, by so many numbers."""

    kinds: tuple[FaultKind, ...]
    count: int
    fit: Fit

    @property
    def score(self) -> float:
        """The sum of squares, and two for each number that is free (Akaike)."""
        return self.fit.total_cost + 2 * self.count


def _tried(geometry: CableGeometry, found: Fit, kinds: tuple[FaultKind, ...]) -> _Cause:
    """Return an explanation: the fit with its figure set free."""
    camera = found.camera
    assert camera is not None
    seen = replace(found.seen, start=found.poses)
    known: dict[str, Any] = {}
    if "size" in kinds:
        known["size_std"] = _LOOSE_SIZE
    if "lens" in kinds:
        known["lens_std"] = np.array([*_LOOSE_FOCAL * camera.lens[:2], *_LOOSE_LENS])
    if "drum" in kinds:
        geometry = replace(geometry, knowledge=replace(geometry.knowledge, drum=_LOOSE_DRUM))
    count = sum(_COUNTS[kind] or geometry.n for kind in kinds)
    return _Cause(
        kinds, count, fit(geometry, seen, start=found.geometry, camera=_with(camera, **known))
    )


def _believed(geometry: CableGeometry, best: _Cause) -> tuple[Fit, list[Fault]]:
    """Return the fit by the one explanation that there is, and the wrong figure in words."""
    why = "; exit points, and what was measured, agree best with that, and it is believed"
    found, faults = best.fit, []
    for kind in best.kinds:
        if kind == "drum" and not _all_drums(geometry, found):
            known = replace(found.geometry, knowledge=geometry.knowledge)
            faults += parameter_faults(replace(found, geometry=known))
        else:
            size, text = _cause(kind, found)
            faults.append(Fault(kind, -1, -1, size, text + why))
    return found, faults


def _contradiction(geometry: CableGeometry, found: Fit, first: MapFit) -> bool:
    """Return whether a given figure of sheets, drums or lens is far off."""
    camera = found.camera
    assert camera is not None
    free, known = camera.free_lens, camera.knowledge
    off = [abs(camera.size_change) / known.size_std, float(not len(free) and first.lens.wrong) * 9]
    off += (np.abs(camera.lens - known.lens)[free] / known.lens_std[free]).tolist()
    if "drum" in geometry.identified:
        mean = abs(float(found.geometry.cable[:, DRUM].mean()))
        off.append(mean / geometry.knowledge.drum * float(np.sqrt(geometry.n)))
    return max(off) > _OFF


def _all_drums(geometry: CableGeometry, found: Fit) -> bool:
    """Return whether drums are off alike, and not a few of them."""
    drums = found.geometry.cable[:, DRUM]
    return bool(abs(np.median(drums)) > 0.5 * np.abs(drums).max() > geometry.knowledge.drum)


def _cause(kind: FaultKind, found: Fit) -> tuple[float, str]:
    """Return how large an explanation is, relative, and what it says."""
    camera = found.camera
    assert camera is not None
    if kind == "size":
        size = camera.size_change
        how = "larger" if size > 0.0 else "smaller"
        return size, f"all sheets are {100.0 * abs(size):.2f} % {how} than told"
    if kind == "drum":
        alike = float(np.median(found.geometry.cable[:, DRUM]))
        return alike, f"all drums pay out {100.0 * alike:+.2f} % of what the robot's file says"
    focal = float((camera.lens[:2] / camera.knowledge.lens[:2]).mean()) - 1.0
    return focal, (
        f"the intrinsics are not this camera's as it is now (focal length {100.0 * focal:+.2f} %): "
        "was the lens turned or the resolution changed? `cdpr camera calibrate`"
    )


def _with(camera: CameraModel, **known: Any) -> CameraModel:
    return replace(camera, knowledge=replace(camera.knowledge, **known))
