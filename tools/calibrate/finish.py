"""Finish a measured calibration: identify, print, report, and adopt a good result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from cdpr_profiles import Robot
from cdpr_profiles.calibration_in_force import in_force, next_version, take_over
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.geometry_calibration import GeometryCalibration
from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.marker_map import coverage
from cdpr_rt.calibration.outcome import CalibrationFiles, CalibrationMethod, Outcome, calibration_of
from cdpr_rt.calibration.parameters import CableGeometry
from cdpr_rt.calibration.readings import CalibrationData, HandEye, Images, with_points
from cdpr_rt.diagnosis.checks import refuse_impossible
from cdpr_rt.errors import ControlError, InvalidRequestError
from cdpr_rt.model.calibration_state import (
    mark_calibrated,
    mark_not_calibrated,
    not_calibrated_reason,
)
from cdpr_tools.calibrate.measure_poses import COUNTED
from cdpr_tools.calibrate.run import compared_with_truth, points_of
from cdpr_tools.calibrate.truth_comparison import TruthComparison
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output
from cdpr_tools.saving import require_own

_PICTURE, _REPORT, _IMAGES = "calibration.png", "calibration.html", "images"
_LEAST_JUDGED = 20
_LITTLE = 0.1
"""Smallest relative gain for which ten more poses are worth the time."""


def identified(
    robot: Robot,
    data: CalibrationData,
    points: Path | None,
    geometry: CableGeometry,
    so_far: bool = False,
) -> Outcome:
    """Return the calibration of data and points; `so_far` ignores points of poses not yet read.

    Raises InvalidRequestError, ProfileError.
    """
    seen = data.observations(robot, geometry.model)
    if points is not None:
        try:
            there = [one for one in points_of(points, robot) if not so_far or one.pose < seen.poses]
            seen = with_points(seen, there, geometry.coordinates)
        except InvalidRequestError as error:
            raise BadInputError(f"--points {points}: {error}") from None
    images = None if data.camera is None else Images(data.camera, data.sightings())
    method: CalibrationMethod = "points" if seen.measured.any() else "redundancy"
    return calibrate(robot, geometry, seen, "camera" if images else method, images)


def with_hand_eye(data: CalibrationData, known: HandEye | None) -> CalibrationData:
    """Return the data with a known hand-eye transform, or unchanged if it is None.

    Raises BadInputError if no camera was used.
    """
    if known is None:
        return data
    if data.camera is None:
        raise BadInputError("--hand-eye: these poses have no images; omit the option")
    camera = data.camera.model_copy(update={"hand_eye": known})
    return data.model_copy(update={"camera": camera})


def stop_criterion(
    out: Output, robot: Robot, points: Path | None, geometry: CableGeometry
) -> Callable[[CalibrationData], str | None]:
    """Return the check to run after each batch; it reports faults and whether the poses suffice."""
    named: set[str] = set()

    def check(data: CalibrationData) -> str | None:
        if data.camera is not None:
            cover = coverage(data.sightings(), data.camera.sheets.placed)
            for text in cover.lines():
                out.note(f"after {len(data.poses)} poses: {text}")
            if not any(len(island) > 1 for island in cover.islands):
                raise WorkFailedError("no image shows two markers together; move them closer")
        if len(data.poses) < _LEAST_JUDGED:
            return None
        try:
            outcome = identified(robot, data, points, geometry, so_far=True)
        except ControlError:  # more poses may help; if not, the fit at the end reports it
            return None
        for fault in outcome.faults:
            who = " ".join([fault.kind, *fault.text.split()[:2]])  # sizes change with each fit
            if who not in named:
                named.add(who)
                out.note(f"after {len(data.poses)} poses: {fault.text}")
        if outcome.good and outcome.gain_of_more < _LITTLE:
            return f"{len(data.poses)} poses are enough: {outcome.advice()}"
        return None

    return check


def refuse_foreign_report(folder: Path) -> None:
    """Raise BadInputError if a report would replace files in `folder` that no calibration wrote."""
    for path in (folder / _REPORT, folder / _PICTURE):
        with os_error_as(BadInputError, str(path)):
            require_own(path)


def finish(out: Output, result: dict[str, Any]) -> None:
    """Output the result of `concluded`; raises typer.Exit with status 1 if it is not good."""
    out.result(result)
    if not result["ok"]:
        raise typer.Exit(WorkFailedError.exit_status)


def concluded(
    out: Output,
    robot: Robot,
    data: CalibrationData,
    points: Path | None,
    geometry: CableGeometry,
    source: Path,
    folder: Path,
    dry_run: bool,
    adopt: bool,
    hand_eye: Path | None = None,
    wanted_mm: float | None = None,
) -> dict[str, Any]:
    """Identify, report, and adopt a good calibration; return the result for JSON.

    `source` is the data file. `hand_eye` is the file of the hand-eye transform, if it does not
    come from the data. `wanted_mm` is the largest allowed 3 sigma of positions; without it,
    held-out poses must improve. A calibration without significant changes is adopted only with
    `adopt`, and not if it predicts held-out poses significantly worse than the robot's file.
    """
    refuse_foreign_report(folder)
    with out.stage(f"fitting {len(data.poses)} poses"):
        outcome = replace(
            identified(robot, data, points, geometry), adopt=adopt, wanted_mm=wanted_mm
        )
        known = compared_with_truth(outcome, source.parent)
    result: dict[str, Any] = {**outcome.as_json(), "data": str(source)}
    out.say(*_lines(outcome, data))
    if known is not None:
        result["verification"] = {**result["verification"], **known.verification()}
        result["truth"] = known.true_errors()
        out.say(*known.lines())
    why_not = _why_not(outcome, dry_run)
    taken: dict[str, Any] | None = None
    more = [f"the calibration was not adopted: {why_not}"]
    if why_not is None:
        files = CalibrationFiles(*(_path_text(path) for path in (source, points, hand_eye)))
        taken, more = _taken(outcome, source, files, data.simulated)
    measured = "" if points is None else f" --points {points}"
    more.append(
        f"fit it again: cdpr calibrate fit {robot.reference} --data {source.parent}{measured}"
    )
    with out.stage("drawing the report"):
        result |= _reported(outcome, data, known, more, folder, source.parent / _IMAGES)
    out.say(*more, f"report: {result['report']}")
    return {"ok": outcome.good, **result, "in_force": taken, "not_taken_over": why_not}


def _why_not(outcome: Outcome, dry_run: bool) -> str | None:
    """Return why a calibration is not adopted, None if it is."""
    if dry_run:
        return "--dry-run"
    if not outcome.good:
        return "the calibration is not good"
    if outcome.adopt or outcome.differs_from_file:
        return None
    if outcome.worse:
        return (
            "its changes are not significant, and it predicts unused poses worse than the "
            "robot's file"
        )
    return "its changes are not significant (--adopt adopts it anyway)"


def _path_text(path: Path | None) -> str:
    return "" if path is None else str(path.resolve())


def _taken(
    outcome: Outcome, source: Path, files: CalibrationFiles, simulated: bool
) -> tuple[dict[str, Any], list[str]]:
    """Adopt a good calibration; return it for JSON, and the lines to print."""
    robot = outcome.robot
    found, path = _take_over(outcome, files, simulated)
    if not simulated or source.with_name(COUNTED).exists():
        how = "--running, after you have restarted the robot and tightened it at home"
    else:
        how = "--plant FILE, if the run had one"
    check = f"cdpr calibrate check {robot.reference} {how}"
    lines = [
        f"calibration {found.version} ({found.identity}) takes effect at the next start: {path}",
        f"to undo it: cdpr calibrate undo {robot.reference}",
        f"to check it later, in two minutes: {check}",
    ]
    if simulated:
        lines.append(
            "it was measured on a simulated robot: with it the robot starts only on simbus"
        )
    return {**found.summary(), "file": str(path)}, lines


def _reported(
    outcome: Outcome,
    data: CalibrationData,
    comparison: TruthComparison | None,
    more: list[str],
    folder: Path,
    images: Path,
) -> dict[str, str]:
    """Write picture and report; return their paths for JSON. Raises WorkFailedError."""
    from cdpr_tools.calibrate.page import found_figure, write_report  # noqa: PLC0415  # slow to load
    from cdpr_tools.style import save_figure  # noqa: PLC0415

    report, path = folder / _REPORT, folder / _PICTURE
    advice = dict.fromkeys(one.advice for one in outcome.open_directions)
    next_steps = [*advice, outcome.advice(), *more]
    write_report(report, outcome, data, comparison, next_steps, images)
    save_figure(found_figure(outcome), path)
    return {"picture": str(path), "report": str(report)}


def _take_over(
    outcome: Outcome, files: CalibrationFiles, simulated: bool
) -> tuple[GeometryCalibration, Path]:
    """Adopt a good calibration, if the robot can work with it; raises ProfileError."""
    robot = outcome.robot
    before = "" if simulated else not_calibrated_reason(robot.profile)
    found = calibration_of(
        outcome, next_version(robot), files, simulated=simulated, distrusted_before=before
    )
    try:
        refuse_impossible(found.applied(robot))
    except ProfileError as error:
        problem = f"with the calibrated geometry: {error.problem}; change it and fit again"
        raise ProfileError(error.file, error.key, problem) from None
    path = take_over(robot, found)
    if not simulated:
        mark_calibrated(robot.profile, f"calibration {found.version} ({found.identity})")
    return found, path


def distrust_again(robot: Robot) -> None:
    """Mark the robot as not calibrated if it was not before the calibration in force."""
    try:
        known = in_force(robot)
    except ProfileError:
        mark_not_calibrated(robot.profile, "an unreadable calibration was undone")
        return
    if known is not None and known.distrusted_before:
        why = f"calibration {known.version} was undone; before it: {known.distrusted_before}"
        mark_not_calibrated(robot.profile, why)


def _lines(outcome: Outcome, data: CalibrationData) -> list[str]:
    """Return the outcome as lines of text."""
    result = outcome.as_json()
    lines = [f"{outcome.robot.name}: {result['poses']} poses, in the frame of {result['frame']}"]
    if data.left_out:
        lines.append(f"{len(data.left_out)} poses were left out, the last: {data.left_out[-1]}")
    lines.append("changes to the robot's file, ± 3 sigma (predicted):")
    lines += [
        f"  {row['name']:26}{row['change']:+9.2f} ± {3.0 * row['std']:.2f} {row['unit']}"
        for row in result["parameters"]
    ]
    return lines + outcome.verdict()
