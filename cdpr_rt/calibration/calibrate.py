"""From observations to a calibration that has verified itself."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera.camera_faults import map_faults, moved_or_slipped, told_right
from cdpr_rt.calibration.camera.camera_start import camera_start
from cdpr_rt.calibration.estimation.faults import Fault, fit_without_faults, parameter_faults
from cdpr_rt.calibration.estimation.fit import Fit
from cdpr_rt.calibration.estimation.noise import fit_with_noise_seen
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.markers.coverage import coverage
from cdpr_rt.calibration.markers.map_fit import MapFit
from cdpr_rt.calibration.markers.sighting import laid_out
from cdpr_rt.calibration.outcome import LEAST_POINTS, CalibrationMethod, Outcome
from cdpr_rt.calibration.readings.camera_data import Images
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_rt.calibration.verification.held_out import LEAST_POSES, held_out, hold_out
from cdpr_rt.calibration.verification.more_poses import with_more_poses
from cdpr_rt.calibration.verification.verdict import (
    change_of,
    open_directions,
    predicted_std,
    require_enough,
)
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.robots.robot_arrays import limits_of

_GRID = 4
_SLACK_SHARE = 0.5


def calibrate(
    robot: Robot,
    geometry: CableGeometry,
    seen: Observations,
    method: CalibrationMethod,
    images: Images | None = None,
) -> Outcome:
    """Return the calibration that observations support; raises InvalidRequestError for too few.

    With images it is fitted together with camera and markers. It is fitted to all poses, with what
    is at fault left out, and anew without one pose in five, which verify it: these count for
    nothing there, not even to find what is at fault.
    """
    if seen.poses < LEAST_POSES:
        raise InvalidRequestError(
            f"{seen.poses} poses; allowed: {LEAST_POSES} and more, some of which verify what the "
            "others tell"
        )
    slack = _SLACK_SHARE * np.asarray(limits_of(robot).slack_N, float)
    if images is None:
        all_of_it = _of_cables(geometry, seen, slack)
    else:
        all_of_it = _with_camera(geometry, seen, slack, images)
    found, first_map = all_of_it.fit, all_of_it.map
    known_room = all_of_it.known_room or bool(seen.measured.sum() >= LEAST_POINTS)
    unused = hold_out(geometry, all_of_it.weighed, all_of_it.seen, slack, found, first_map, images)
    birge = unused.birge_ratio()
    larger = max(birge, 1.0) if known_room and math.isfinite(birge) else 1.0
    sigma_mm, with_more_mm = (
        larger * _three_sigma_mm(one, known_room) for one in (found, with_more_poses(found))
    )
    change = change_of(found, _grid(found.geometry), not known_room, larger)
    cover = None
    if images is not None:
        cover = coverage(images.sightings, images.setup.sheets.placed)
    return Outcome(
        robot, found, method, all_of_it.faults, open_directions(found),
        unused.verified(), unused.before(geometry), int((~unused.seen.used).sum()),
        sigma_mm, with_more_mm, known_room, unused, change, birge, cover=cover,
    )  # fmt: skip


@dataclass(frozen=True)
class _Whole:
    """The fit to all poses, and what was wrong with them."""

    fit: Fit
    weighed: CableGeometry
    """The robot's file with readings as good as they have shown to be."""
    faults: list[Fault]
    seen: Observations
    """Observations of the fit, before any was left out."""
    map: MapFit | None = None
    known_room: bool = False
    """Whether places of markers are known in the room."""


def _of_cables(geometry: CableGeometry, seen: Observations, slack_N: FloatArray) -> _Whole:
    require_enough(geometry, seen.some(~held_out(seen.poses)))
    found, faults = fit_without_faults(geometry, seen, slack_N)
    found, weighed = fit_with_noise_seen(found, geometry)
    return _Whole(found, weighed, faults, seen)


def _with_camera(
    geometry: CableGeometry, seen: Observations, slack_N: FloatArray, images: Images
) -> _Whole:
    start = camera_start(geometry, seen, images.setup, images.sightings)
    require_enough(geometry, start.seen.some(~held_out(seen.poses)))
    found, faults = fit_without_faults(geometry, start.seen, slack_N, start.camera)
    found, wrong = told_right(geometry, found, start.map)
    # drums that were told wrong are not held where the file has them
    believed = replace(geometry, knowledge=found.geometry.knowledge)
    found, weighed = fit_with_noise_seen(found, believed)
    readings = [one for one in faults if one.kind not in ("drum", "elongation")]
    of_map = map_faults(start.map, laid_out(images.sightings, images.setup.sheets.placed))
    told = {(one.kind, one.cable) for one in wrong}
    others = [one for one in parameter_faults(found) if (one.kind, one.cable) not in told]
    faults = [*of_map, *readings, *moved_or_slipped(readings), *wrong, *others]
    return _Whole(found, weighed, faults, start.seen, start.map, start.known_room)


def _three_sigma_mm(found: Fit, known_room: bool) -> float:
    """Return what positions in the workspace are known to, the worst coordinate's rms."""
    geometry = found.geometry
    predicted = predicted_std(found, _grid(geometry), relative=not known_room)
    return 3e3 * float(np.sqrt((predicted[:, : geometry.coordinates] ** 2).mean(axis=0).max()))


def _grid(geometry: CableGeometry) -> FloatArray:
    """Return poses spread over the workspace, at home's orientation."""
    platform = geometry.model.platform
    axes = [
        np.linspace(low, high, _GRID)
        for low, high in zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    return geometry.model.poses(places)
