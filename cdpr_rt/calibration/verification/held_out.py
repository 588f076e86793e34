"""The poses that verify a calibration: what is read there has no part in it, nor in what is wrong.

Only the map of the markers with which the fit begins is made with all images.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray, IntArray
from cdpr_rt.calibration.camera.camera_faults import told_right
from cdpr_rt.calibration.camera.camera_start import map_of_images, start_on_map
from cdpr_rt.calibration.camera.seen_poses import markers_of_map
from cdpr_rt.calibration.estimation.faults import fit_without_faults, without_slack
from cdpr_rt.calibration.estimation.fit import Fit, locate
from cdpr_rt.calibration.estimation.noise import weighed_fit
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.markers.map_fit import MapFit
from cdpr_rt.calibration.readings.camera_data import CameraSetup, Images
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.calibration.verification.verdict import predicted_std
from cdpr_rt.calibration.verification.verification import Verification, verifies, verify

_EACH = 5
"""One pose in so many is kept from the fit and verifies it."""
_LEAST = 3
LEAST_POSES = _EACH * _LEAST
"""With fewer, too few are kept to verify anything."""


def held_out(poses: int) -> BoolArray:
    """Return which of so many poses are kept from the fit, (N,)."""
    return np.asarray(np.arange(poses) % _EACH == _EACH - 1)


@dataclass(frozen=True)
class Reference:
    """A map of markers by the images of the poses used alone: no cable has a part in it.

    Only sizes of sheets and the lens are those that the calibration has found.
    """

    setup: CameraSetup
    map: MapFit
    images: Images
    """Images of the poses held out."""


@dataclass(frozen=True)
class Unused:
    """The poses held out, and the fit to all others."""

    index: IntArray
    """Indices of the poses held out."""
    seen: Observations
    """Observations there, without slack cables, with jumps as the other poses tell them."""
    part: Fit
    reference: Reference | None
    """With which they are compared where a camera saw them; None without one."""

    @property
    def jumps_m(self) -> FloatArray:
        """Sizes of the jumps of `seen`, (j,)."""
        return self.part.jumps_m

    def verified(self) -> Verification:
        """Return how the fit to the others does."""
        return self._compared(self.part.geometry, self.jumps_m)

    def before(self, file: CableGeometry) -> Verification:
        """Return how the robot's file does.

        What jumped is the readings' fault, not the file's: without it lengths alone would not tell
        how all of them count anew from a later start.
        """
        return self._compared(file, self.jumps_m)

    def birge_ratio(self) -> float:
        """Return how many times as large errors are as predicted, against measured points.

        The root mean square of errors by lengths over their standard deviations: by the fit's
        uncertainty, by lengths of one pose, and by the measurement (Birge, Phys. Rev. 40, 1932).
        nan where no positions were measured.
        """
        part, seen = self.part, self.seen
        there = locate(part.geometry, seen.without_jumps(self.jumps_m))
        k = part.geometry.coordinates
        known = np.isfinite(seen.position_std_m[:, :k])
        if not known.any():
            return float("nan")
        p = there.poses[:, 0] + there.poses[:, 1:] @ seen.target_m
        own = np.diagonal(there.pose_covariance, axis1=1, axis2=2) * max(part.variance_factor, 1.0)
        variance = predicted_std(part, there.poses)[:, :k] ** 2 + own[:, :k]
        variance += np.where(known, seen.position_std_m[:, :k], 0.0) ** 2
        squares = (p - seen.position_m)[:, :k] ** 2 / variance
        return float(np.sqrt(squares[known].mean()))

    def _compared(self, geometry: CableGeometry, jumps_m: FloatArray) -> Verification:
        """Return how lengths alone do by a geometry.

        Where the camera is the reference, its place on the platform and that of its map in the
        room are those that go best with this geometry at the poses used.
        """
        reference = self.reference
        if reference is None or verifies(self.seen):
            return verify(geometry, jumps_m, self.seen)
        used = self.part.seen.unmeasured().without_jumps(jumps_m)
        still = replace(geometry, identified=())
        camera = start_on_map(still, used, reference.setup, reference.map).camera
        markers = markers_of_map(
            *(camera.ids, reference.map.map.placed),
            *(reference.setup.sheets, reference.images.sightings),
        )
        return verify(geometry, jumps_m, replace(self.seen, markers=markers), camera)


def hold_out(
    geometry: CableGeometry,
    weighed: CableGeometry,
    seen: Observations,
    slack_N: FloatArray,
    whole: Fit,
    first_map: MapFit | None,
    images: Images | None,
) -> Unused:
    """Return the poses held out and the fit to all others, which begins where `whole` ended.

    `weighed` is the geometry with readings as good as they have shown to be, for the last fit.
    """
    held = held_out(seen.poses)
    part, _ = fit_without_faults(geometry, seen.some(~held), slack_N, whole.camera)
    if first_map is not None:
        part, _ = told_right(geometry, part, first_map)
    part = weighed_fit(part, weighed, part.seen)
    kept, index = np.flatnonzero(~held), np.flatnonzero(held)
    slipped = part.seen.jumps[len(seen.jumps) :]  # what the other poses have found
    some, _ = without_slack(geometry, seen.some(index), slack_N)
    jumps = tuple((cable, int((index < kept[pose]).sum())) for cable, pose in slipped)
    used = some.used.copy()
    for cable, pose in slipped:  # whether before or after these, the other poses do not tell
        used[(index > kept[pose - 1]) & (index < kept[pose]), cable] = False
    some = replace(some, jumps=(*some.jumps, *jumps), used=used)
    return Unused(index, some, part, _reference(part, images, held))


def _reference(part: Fit, images: Images | None, held: BoolArray) -> Reference | None:
    if images is None or part.camera is None:
        return None
    setup = images.setup.as_found(part.camera.lens, part.camera.size_change)
    used = [one for one, out in zip(images.sightings, held, strict=True) if not out]
    unused = [one for one, out in zip(images.sightings, held, strict=True) if out]
    return Reference(setup, map_of_images(setup, used), Images(setup, unused))
