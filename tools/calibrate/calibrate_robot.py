"""`cdpr_rt.calibrate`: calibrate the robot of a handle, simulated or run by a daemon."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdpr_profiles import Robot as Profile
from cdpr_rt.arrays import FloatArray, real_array
from cdpr_rt.calibration.parameters import USUAL, CableGeometry, Knowledge
from cdpr_rt.robot import InvalidArgument, Robot, number_in, path_of, texts_of
from cdpr_tools.calibrate import daemon_run
from cdpr_tools.calibrate.finish import concluded, stop_criterion
from cdpr_tools.calibrate.measure_poses import DATA, PoseOperator, StoredPoses
from cdpr_tools.calibrate.places import MOST_POSES, places_of, poses_wanted
from cdpr_tools.calibrate.run import POINTS, Ask, read_places
from cdpr_tools.client.handle_errors import errors_for_scripts
from cdpr_tools.output import Output

Measure = Callable[[FloatArray], ArrayLike | None]
"""Takes the approximate position of the platform's origin (k,), m; returns the measured one.

nan is an unknown coordinate, None an unknown position.
"""
_ALLOWED_m = (1e-6, 0.5)


def calibrate(
    robot: Robot,
    *,
    measured: Measure | None = None,
    measured_std_m: float = 0.002,
    poses: int | str | Path | None = None,
    folder: str | Path | None = None,
    resume: bool = False,
    identify: Sequence[str] = USUAL,
    known_exit_m: float | None = None,
    seed: int = 1,
    adopt: bool = False,
) -> dict[str, Any]:
    """Calibrate a robot's geometry as `cdpr calibrate measure` does; return its result.

    The robot stands at home on tight cables, as after `tighten`. It moves to poses, reads lengths
    and tensions there, and is held at the last pose. At each pose `measured` is called with the
    position by the cables, (k,), m. It returns the position from your measuring device, (k,), m,
    or None. `measured_std_m` is the standard deviation of a coordinate. Without `measured` the
    data determine neither the position in the room nor the scale.

    `poses` is a number, or a file that `cdpr poses` wrote; by default as many as improve the
    result. `identify` and `known_exit_m` are as `--identify` and `--known-mm`. Data and report go
    into `folder`, by default out/calibrate-ROBOT; `resume` continues after the poses there. With
    `adopt` a good and significant result is adopted from the next start on.

    The result is that of `cdpr calibrate fit --json`: `good`, `verdict`, `parameters` with their
    changes, `predicted_3_sigma_mm`, `report` and more. Progress goes to standard error. Raises
    InvalidRobot, InvalidArgument, Error, and what `measured` raises; poses that were read are kept.
    """
    if not isinstance(robot, Robot):
        raise InvalidArgument(f"robot: {robot!r}; give what simulate, connect or run returns")
    if measured is not None and not callable(measured):
        raise InvalidArgument(f"measured: {measured!r}; give a function of the position")
    out, on_status = Output(as_json=True), robot.on_status
    with errors_for_scripts({"--out": "folder", "--poses": "poses"}):
        profile = daemon_run.profile_of(robot.description)
        measured_std_m = number_in("measured_std_m", measured_std_m, *_ALLOWED_m, " m")
        known = Knowledge()
        if known_exit_m is not None:
            exit_m = number_in("known_exit_m", known_exit_m, *_ALLOWED_m, " m")
            known = Knowledge(exit_m=exit_m)
        geometry = CableGeometry.of(profile, texts_of("identify", identify), known)
        count, listed = poses_wanted(profile, None if poses is None else str(poses))
        kept = _poses_in(profile, robot, folder, resume)
        file = kept.folder / POINTS
        daemon_run.require_points_of(len(kept.data.poses), file)
        operator = PoseOperator(robot, profile)
        try:
            kept.require_home(profile, operator.place())
            points = file if measured is not None or file.exists() else None
            criterion = stop_criterion(out, profile, points, geometry)
            with out.stage("choosing poses"):
                places, most = places_of(profile, count, listed, seed), count or MOST_POSES
            with daemon_run.going_on(kept):
                read_places(
                    *(out, profile, operator, kept, places, most, criterion),
                    _asking(operator, measured, measured_std_m, file),
                    may_end=count is None,
                )
        finally:
            robot.on_status = on_status
        source = kept.folder / DATA
        return concluded(
            *(out, profile, kept.data, points, geometry, source, kept.folder),
            dry_run=not adopt,
            adopt=False,
        )


def _poses_in(
    profile: Profile, robot: Robot, folder: str | Path | None, resume: bool
) -> StoredPoses:
    """Return the poses in a folder; raises InvalidArgument for earlier ones unless `resume`."""
    where = (
        Path("out") / f"calibrate-{profile.profile}"
        if folder is None
        else path_of("folder", folder)
    )
    data = daemon_run.data_of(where, profile, bool(robot.description["simulated"]))
    if data.poses and not resume:
        raise InvalidArgument(
            f"folder: {where} contains {len(data.poses)} poses; choose another one, or continue "
            "after them with resume=True"
        )
    return StoredPoses(where, data)


def _asking(operator: PoseOperator, measured: Measure | None, std_m: float, path: Path) -> Ask:
    """Return a function that stores the measured position at a pose, counted from 1."""
    if measured is None:
        return lambda _pose: None
    k = operator.directions.k
    file = daemon_run.PointsFile(path, k)

    def ask(pose: int) -> None:
        by_cables = operator.place()[:k]
        answer = measured(by_cables)
        if answer is None:
            return
        try:
            position = real_array(answer)
        except (TypeError, ValueError):
            position = np.array(np.inf)
        if position.shape != (k,) or np.isinf(position).any():
            raise InvalidArgument(f"measured: returned {answer!r}; allowed: {k} numbers in m")
        file.add(pose, [*(1e3 * position), 1e3 * std_m])

    return ask
