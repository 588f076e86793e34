"""What follows once a calibration is measured: identify, tell, report, take over what is good."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from cdpr_profiles import Robot
from cdpr_profiles.calibration.geometry import GeometryCalibration
from cdpr_profiles.calibration.in_force import in_force, next_version, take_over
from cdpr_profiles.errors import ProfileError
from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.outcome import CalibrationMethod, Outcome, calibration_of
from cdpr_rt.calibration.readings.camera_data import HandEye, Images
from cdpr_rt.calibration.readings.data import CalibrationData, with_points
from cdpr_rt.errors import ControlError, InvalidRequestError
from cdpr_rt.robots.feasibility.checks import refuse_impossible
from cdpr_rt.robots.persistence.calibration_state import (
    mark_calibrated,
    mark_not_calibrated,
    not_calibrated_reason,
)
from cdpr_tools.calibrate.measuring.begin import points_of
from cdpr_tools.calibrate.measuring.run import COUNTED
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output

if TYPE_CHECKING:
    from cdpr_tools.calibrate.report.truth_comparison import TruthComparison

_PICTURE, _REPORT, _IMAGES = "calibration.png", "calibration.html", "images"
_LEAST_JUDGED = 20
_LITTLE = 0.1
"""What ten more poses have to bring at least, relative, for it to be worth it."""

CompareWithTruth = Callable[[Outcome], "TruthComparison"]
"""Compares an outcome with what a simulator knows, once it is there."""


def identified(
    robot: Robot,
    data: CalibrationData,
    points: Path | None,
    geometry: CableGeometry,
    so_far: bool = False,
) -> Outcome:
    """Return what data and measured points tell; `so_far` leaves points of later poses aside.

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
    """Return data with where the camera sits on the platform, where that is told.

    Raises BadInputError where there was no camera.
    """
    if known is None:
        return data
    if data.camera is None:
        raise BadInputError(
            "--hand-eye: no camera has looked at these poses; allowed: leave it out"
        )
    camera = data.camera.model_copy(update={"hand_eye": known})
    return data.model_copy(update={"camera": camera})


def stop_criterion(
    out: Output, robot: Robot, points: Path | None, geometry: CableGeometry
) -> Callable[[CalibrationData], str | None]:
    """Return what a run asks after each batch of poses: what is wrong, and whether it is enough."""
    named: set[str] = set()

    def check(data: CalibrationData) -> str | None:
        if len(data.poses) < _LEAST_JUDGED:
            return None
        try:
            outcome = identified(robot, data, points, geometry, so_far=True)
        except ControlError:  # what is missing so far is said at the end if it still is
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


def finish(
    out: Output,
    robot: Robot,
    data: CalibrationData,
    points: Path | None,
    geometry: CableGeometry,
    source: Path,
    folder: Path,
    dry_run: bool,
    adopt: bool,
    compare: CompareWithTruth | None = None,
) -> None:
    """Identify, tell, report, and take over what is good; `source` is the file of the data.

    What changes nothing significantly is taken over only to `adopt`, and not where it tells poses
    not used worse than the robot's file does, by more than noise.

    Raises typer.Exit with status 1 where nothing was taken over because it is not good.
    """
    with out.stage(f"fitting {len(data.poses)} poses"):
        outcome = replace(identified(robot, data, points, geometry), adopt=adopt)
        known = None if compare is None else compare(outcome)
    result: dict[str, Any] = {**outcome.as_json(), "data": str(source)}
    out.say(*_lines(outcome, data))
    if known is not None:
        result["verification"] = {**result["verification"], **known.verification()}
        result["truth"] = known.true_errors()
        out.say(*known.lines())
    why_not = _why_not(outcome, dry_run)
    taken: dict[str, Any] | None = None
    more = [f"nothing was taken over: {why_not}"]
    if why_not is None:
        taken, more = _taken(outcome, source, data.simulated)
    measured = "" if points is None else f" --points {points}"
    more.append(
        f"fit it again: cdpr calibrate fit {robot.reference} --data {source.parent}{measured}"
    )
    with out.stage("drawing the report"):
        result |= _reported(outcome, data, known, more, folder, source.parent / _IMAGES)
    out.say(*more, f"report: {result['report']}")
    out.result({"ok": outcome.good, **result, "in_force": taken, "not_taken_over": why_not})
    if not outcome.good:
        raise typer.Exit(WorkFailedError.exit_status)


def _why_not(outcome: Outcome, dry_run: bool) -> str | None:
    """Return why a calibration is not taken over, None where it is."""
    if dry_run:
        return "--dry-run"
    if not outcome.good:
        return "it is not good"
    if outcome.adopt or outcome.change.significant:
        return None
    if outcome.worse:
        return "its changes are not significant, and poses not used are told worse with them"
    return "its changes are not significant (--adopt takes it over all the same)"


def _taken(outcome: Outcome, source: Path, simulated: bool) -> tuple[dict[str, Any], list[str]]:
    """Take a good calibration over; return it for JSON, and what there is to say and do."""
    robot = outcome.robot
    found, path = _take_over(outcome, str(source.resolve()), simulated)
    if not simulated or source.with_name(COUNTED).exists():
        how = "--running, once it runs anew, tight and at home"
    else:
        how = "--plant FILE, where the run had one"
    check = f"cdpr calibrate check {robot.reference} {how}"
    lines = [
        f"calibration {found.version} ({found.identity}) takes effect at the next start: {path}",
        f"take it back: cdpr calibrate undo {robot.reference}",
        f"see whether it still holds, in two minutes: {check}",
    ]
    if simulated:
        lines.append(
            "it was measured on a simulated robot: the robot does not start with it on any bus "
            "other than simbus"
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
    from cdpr_tools.calibrate.report.page import write_report  # noqa: PLC0415
    from cdpr_tools.calibrate.report.picture import found_figure  # noqa: PLC0415  # slow to load
    from cdpr_tools.report.style import save_figure  # noqa: PLC0415

    report, path = folder / _REPORT, folder / _PICTURE
    advice = dict.fromkeys(one.advice for one in outcome.open_directions)
    next_steps = [*advice, outcome.advice(), *more]
    write_report(report, outcome, data, comparison, next_steps, images)
    try:
        save_figure(found_figure(outcome), path)
    except OSError as error:
        raise WorkFailedError(f"{path}: cannot be written: {error.strerror}") from error
    return {"picture": str(path), "report": str(report)}


def _take_over(
    outcome: Outcome, raw_data: str, simulated: bool
) -> tuple[GeometryCalibration, Path]:
    """Put a good calibration in force, if the robot can work with it; raises ProfileError."""
    robot = outcome.robot
    before = "" if simulated else not_calibrated_reason(robot.profile)
    found = calibration_of(
        outcome, next_version(robot), raw_data, simulated=simulated, distrusted_before=before
    )
    refuse_impossible(found.applied(robot))
    path = take_over(robot, found)
    if not simulated:
        mark_calibrated(robot.profile, f"calibration {found.version} ({found.identity})")
    return found, path


def distrust_again(robot: Robot) -> None:
    """Have the geometry not believed where it was not before the calibration in force."""
    try:
        known = in_force(robot)
    except ProfileError:
        mark_not_calibrated(robot.profile, "a calibration that cannot be read was taken back")
        return
    if known is not None and known.distrusted_before:
        why = f"calibration {known.version} was taken back; before it: {known.distrusted_before}"
        mark_not_calibrated(robot.profile, why)


def _lines(outcome: Outcome, data: CalibrationData) -> list[str]:
    """Return the outcome for people."""
    result = outcome.as_json()
    lines = [f"{outcome.robot.name}: {result['poses']} poses, in the frame of {result['frame']}"]
    if data.left_out:
        lines.append(f"{len(data.left_out)} poses were refused, the last: {data.left_out[-1]}")
    lines.append("changes to the robot's file, ± 1 sigma (predicted):")
    lines += [
        f"  {row['name']:26}{row['change']:+9.2f} ± {row['std']:.2f} {row['unit']}"
        for row in result["parameters"]
    ]
    return lines + outcome.verdict()
