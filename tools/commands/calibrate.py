"""`cdpr calibrate`: a robot's geometry from its own cables and from measured points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.calibration.geometry import GeometryCalibration, geometry_sha256
from cdpr_profiles.calibration.in_force import in_force, next_version, take_over
from cdpr_profiles.calibration.in_force import undo as take_back
from cdpr_profiles.errors import ProfileError
from cdpr_rt.calibration.data import CalibrationData, load_data, load_points, with_points
from cdpr_rt.calibration.outcome import Method, Outcome, calibrate, calibration_of
from cdpr_rt.calibration.parameters import USUAL, CableGeometry, Knowledge
from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.procedures.calibration.measure_poses import (
    Measured,
    PoseRefusedError,
    measure_poses,
    read_pose,
)
from cdpr_rt.robots.calibration_state import distrust, mark_calibrated, mark_not_calibrated
from cdpr_rt.robots.checks import refuse_impossible
from cdpr_tools.commands.options import JsonOption, OverwriteOption
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.signals import interrupted_by_sigterm

app = typer.Typer(
    name="calibrate",
    help="Calibrate a robot's geometry, drums and elongation.",
    no_args_is_help=True,
)

_Robot = Annotated[
    str, typer.Argument(help="Robot profile: a name or the path of a file.", metavar="ROBOT")
]
_Points = Annotated[
    Path | None,
    typer.Option(help="Measured positions, CSV: pose,x_mm,y_mm,z_mm,sigma_mm.", metavar="FILE"),
]
_Identify = Annotated[
    str | None,
    typer.Option(
        help="What is identified: exit,offset,drum,elongation where left out; anchor, pulley too.",
        metavar="LIST",
    ),
]
_KnownMm = Annotated[
    float,
    typer.Option(
        "--known-mm", min=0.1, max=500.0,
        help="How well the exit points of the robot's file are known, one standard deviation.",
    ),
]  # fmt: skip
_DryRun = Annotated[bool, typer.Option("--dry-run", help="Tell what is found; take nothing over.")]
_TAPE_mm = 1e3 * Knowledge().exit_m
_DATA, _PICTURE = "data.json", "calibration.png"


@app.callback()
def _group() -> None:
    """Calibrate a robot's geometry, drums and elongation."""


@app.command(name="fit")
def fit_data(
    robot: _Robot,
    data: Annotated[Path, typer.Option(help="Readings, data.json of a run.", metavar="FILE")],
    points: _Points = None,
    identify: _Identify = None,
    known_mm: _KnownMm = _TAPE_mm,
    out_dir: Annotated[Path | None, typer.Option("--out", help="Folder for the result.")] = None,
    dry_run: _DryRun = False,
    as_json: JsonOption = False,
) -> None:
    """Identify from what was measured before; nothing moves.

    Ends with status 1, and takes nothing over, where the result is not good.
    """
    out = Output(as_json)
    profile = load_robot(robot)
    _finish(
        out,
        profile,
        load_data(data),
        points,
        _geometry(profile, identify, known_mm),
        out_dir or data.parent,
        dry_run,
    )


@app.command()
def run(
    robot: _Robot,
    redundancy: Annotated[
        bool, typer.Option("--redundancy", help="From encoder lengths and tensions alone.")
    ] = False,
    scanner: Annotated[
        bool, typer.Option("--scanner", help="With poses that the simulated scanner measures.")
    ] = False,
    points: _Points = None,
    poses: Annotated[int, typer.Option(min=15, max=1000, help="Poses to go to.")] = 50,
    plant: Annotated[
        Path | None, typer.Option(help="Plant file: the truth about robot, cables and motors.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the poses.")] = 1,
    identify: _Identify = None,
    known_mm: _KnownMm = _TAPE_mm,
    out_dir: Annotated[
        Path | None, typer.Option("--out", help="Folder for data, result and picture.")
    ] = None,
    overwrite: OverwriteOption = False,
    dry_run: _DryRun = False,
    as_json: JsonOption = False,
) -> None:
    """Move a simulated robot through poses, read its cables, identify, verify and take over.

    It runs on a simulator of its own, over the bus, from home and with the geometry of its file.
    Ends with status 1, and takes nothing over, where the result is not good.
    """
    out = Output(as_json)
    profile = load_robot(robot)
    if sum((redundancy, scanner, points is not None)) != 1:
        raise BadInputError("give one of --redundancy, --scanner and --points")
    refuse_impossible(profile)
    geometry = _geometry(profile, identify, known_mm)
    if points is not None:
        load_points(points)
    folder = out_dir or Path("out") / f"calibrate-{profile.profile}"
    if (folder / _DATA).exists() and not overwrite:
        raise BadInputError(f"{folder / _DATA}: is there already; allowed: --overwrite")
    with interrupted_by_sigterm():
        measured = _measure(out, profile, plant, scanner, poses, seed, folder / _DATA)
    _finish(out, profile, measured, points, geometry, folder, dry_run)


@app.command()
def undo(robot: _Robot, as_json: JsonOption = False) -> None:
    """Take back the calibration in force: the one before it, or the robot's file, counts again.

    A robot that runs goes on as it is; its next start takes it.
    """
    out = Output(as_json)
    profile = load_robot(robot)
    _distrust_again(profile)
    before = take_back(profile)
    if before is None:
        out.say(f"{profile.profile}: the geometry of {profile.path} counts from the next start on")
    else:
        out.say(
            f"{profile.profile}: calibration {before.version} of {before.date:%Y-%m-%d %H:%M} "
            f"({before.identity}) counts from the next start on"
        )
    out.result({"ok": True, "in_force": None if before is None else before.summary()})


@app.command()
def study(
    robot: Annotated[
        str, typer.Argument(help="A robot whose platform has six directions.", metavar="ROBOT")
    ] = "spatial-8",
    draws: Annotated[int, typer.Option(min=10, max=100_000, help="Trials of each case.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Of poses and noise.")] = 1,
    png: Annotated[Path | None, typer.Option("--png", help="Draw it into this file.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Tell how errors of measurement become errors of the geometry: by a model and by trial.

    Table 3.1 and figures 3.7 and 3.8 of the thesis for a robot of ours, on all cores.
    """
    from cdpr_tools.calibrate import study as studies  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    with out.progress("cases", float(len(studies.cases()))) as advance:
        rows = studies.study(robot, draws, seed, advance)
    out.say(*studies.lines(rows))
    if png is not None:
        try:
            studies.draw(png, rows)
        except OSError as error:
            raise BadInputError(f"--png {png}: cannot be written: {error.strerror}") from error
    out.result({"ok": True, "robot": robot, "draws": draws, "seed": seed, "cases": rows})


def _measure(
    out: Output, robot: Robot, plant: Path | None, scanner: bool, poses: int, seed: int, path: Path
) -> CalibrationData:
    """Return the readings of a robot on a simulator of its own; they are kept whatever ends it."""
    from cdpr_tools.calibrate.rig import simulated_rig  # noqa: PLC0415  # slow to load

    out.note(f"{robot.profile}: starting the simulated robot ...")
    measured, geometry = Measured(), geometry_sha256(robot)
    try:
        with (
            out.progress("poses", float(poses)) as advance,
            simulated_rig(
                str(robot.path), plant=plant, scanner=scanner, advance=lambda _: None
            ) as operator,
        ):
            try:
                measured.readings.append(read_pose(operator, operator.tighten()))
            except PoseRefusedError as error:
                raise WorkFailedError(f"{robot.profile}: at home: {error}") from error
            places = _told(operator.random_places(seed), measured, advance)
            measure_poses(operator, places, poses, measured, out)
    finally:
        data = CalibrationData(
            robot=robot.profile,
            geometry_sha256=geometry,
            simulated=True,
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            left_out=tuple(measured.refused),
            poses=tuple(measured.readings),
        )
        if measured.readings:
            data.save(path)
            if len(measured.readings) < poses:
                out.note(f"{len(measured.readings)} of {poses} poses are kept: {path}")
    return data


def _told(
    places: Iterator[FloatArray], measured: Measured, advance: Callable[[float], None]
) -> Iterator[FloatArray]:
    for place in places:
        advance(float(len(measured.readings)))
        yield place


def _geometry(robot: Robot, identify: str | None, known_mm: float) -> CableGeometry:
    kinds = USUAL if identify is None else tuple(part.strip() for part in identify.split(","))
    return CableGeometry.of(robot, kinds, Knowledge(exit_m=1e-3 * known_mm))


def _finish(
    out: Output,
    robot: Robot,
    data: CalibrationData,
    points: Path | None,
    geometry: CableGeometry,
    folder: Path,
    dry_run: bool,
) -> None:
    """Identify, tell, draw, and take over what is good."""
    seen = data.observations(robot, geometry.model)
    if points is not None:
        seen = with_points(seen, load_points(points), geometry.coordinates)
    method: Method = "points" if seen.measured.any() else "redundancy"
    outcome = calibrate(robot, geometry, seen, method)
    picture = _draw(outcome, folder)
    out.say(*_lines(outcome, data))
    told = {**outcome.told(), "data": str(folder / _DATA), "picture": str(picture)}
    if not outcome.good:
        out.say("nothing was taken over")
        out.result({"ok": False, **told, "in_force": None})
        raise typer.Exit(WorkFailedError.exit_status)
    taken = None
    if not dry_run:
        found, path = _take_over(outcome, str(folder / _DATA), data.simulated)
        taken = {**found.summary(), "file": str(path)}
        out.say(
            f"calibration {found.version} ({found.identity}) counts from the next start on: {path}",
            f"take it back: cdpr calibrate undo {robot.reference}",
        )
        if data.simulated:
            out.say("it was measured on a simulated robot: the robot does not start with it on any "
                    "bus other than simbus")  # fmt: skip
    out.result({"ok": True, **told, "in_force": taken})


def _take_over(
    outcome: Outcome, raw_data: str, simulated: bool
) -> tuple[GeometryCalibration, Path]:
    """Put a good calibration in force, if the robot can work with it; raises ProfileError."""
    robot = outcome.robot
    before = "" if simulated else distrust(robot.profile)
    found = calibration_of(
        outcome, next_version(robot), raw_data, simulated=simulated, distrusted_before=before
    )
    refuse_impossible(found.applied(robot))
    path = take_over(robot, found)
    if not simulated:
        mark_calibrated(robot.profile, f"calibration {found.version} ({found.identity})")
    return found, path


def _distrust_again(robot: Robot) -> None:
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
    told = outcome.told()
    lines = [f"{outcome.robot.name}: {told['poses']} poses, in the frame of {told['frame']}"]
    if data.left_out:
        lines.append(f"{len(data.left_out)} poses were refused, the last: {data.left_out[-1]}")
    lines += [
        f"  {row['name']:26}{row['change']:+9.2f} ± {row['std']:.2f} {row['unit']}"
        for row in told["parameters"]
    ]
    return lines + outcome.verdict()


def _draw(outcome: Outcome, folder: Path) -> Path:
    from cdpr_tools.calibrate.picture import draw  # noqa: PLC0415  # slow to load

    path = folder / _PICTURE
    try:
        folder.mkdir(parents=True, exist_ok=True)
        draw(path, outcome)
    except OSError as error:
        raise WorkFailedError(f"{path}: cannot be written: {error.strerror}") from error
    return path
