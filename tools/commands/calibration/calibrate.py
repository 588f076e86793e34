"""`cdpr calibrate`: a robot's geometry from its own cables and from measured points."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdpr_profiles import load_robot
from cdpr_profiles.calibration.in_force import undo as take_back
from cdpr_tools.client.client import open_daemon
from cdpr_tools.commands.calibration.calibrate_measure import measure
from cdpr_tools.commands.calibration.calibrate_read import read
from cdpr_tools.commands.calibration.options import (
    AdoptOption,
    CalibrationPlantOption,
    CameraUrlOption,
    DryRunOption,
    IdentifyOption,
    KnownMmOption,
    OutDirOption,
    PointsOption,
    PosesOption,
    ScannerOption,
    geometry_of,
    hand_eye_of,
)
from cdpr_tools.commands.options import (
    ClusterOption,
    HandEyeOption,
    JsonOption,
    KeyFileOption,
    OverwriteOption,
    PngOption,
    RobotArgument,
    SeedOption,
    SocketOption,
    UrlOption,
)
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.loading import loading_notice
from cdpr_tools.output import Output

if TYPE_CHECKING:
    from cdpr_rt.calibration.readings.camera_data import CameraSetup, HandEye

app = typer.Typer(
    name="calibrate",
    help="Calibrate a robot's geometry, drums and elongation.",
    no_args_is_help=True,
)

_DRAWS, _FEW = 200, 5


app.command()(read)
app.command()(measure)


@app.command(name="fit")
def fit_data(
    robot: RobotArgument,
    data: Annotated[
        Path,
        typer.Option(help="Folder of a run, or readings as its data.json.", metavar="FOLDER|FILE"),
    ],
    points: PointsOption = None,
    hand_eye: HandEyeOption = None,
    identify: IdentifyOption = None,
    known_mm: KnownMmOption = None,
    out_dir: Annotated[
        Path | None, typer.Option("--out", help="Folder for the result; else that of --data.")
    ] = None,
    dry_run: DryRunOption = False,
    adopt: AdoptOption = False,
    as_json: JsonOption = False,
) -> None:
    """Identify from what was measured before, as in a run that is complete; nothing moves.

    Of a run's folder the poses not used are compared with its simulator's scanner and truth as
    well. What stands behind ± is one standard deviation (1 sigma). Ends with status 1, and takes
    nothing over, where the result is not good; with 0 where it changes nothing significantly, and
    takes nothing over then either.
    """
    from cdpr_rt.calibration.readings.data import load_data  # noqa: PLC0415
    from cdpr_tools.calibrate.finish import finish, with_hand_eye  # noqa: PLC0415  # slow to load
    from cdpr_tools.calibrate.measuring import run as runs  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    profile = load_robot(robot)
    compare = None
    if data.is_dir():
        compare = runs.truth_comparison_of_folder(profile, data)
        data /= runs.DATA
    read_before = with_hand_eye(load_data(data), hand_eye_of(hand_eye))
    finish(
        *(out, profile, read_before, points, geometry_of(profile, identify, known_mm)),
        *(data, out_dir or data.parent, dry_run, adopt, compare),
    )


@app.command()
def run(
    robot: RobotArgument,
    camera: Annotated[
        bool,
        typer.Option(
            "--camera",
            help="With the camera on the platform; so without any of these where it has six "
            "directions.",
        ),
    ] = False,
    redundancy: Annotated[
        bool, typer.Option("--redundancy", help="From encoder lengths and tensions alone.")
    ] = False,
    scanner: ScannerOption = False,
    points: PointsOption = None,
    poses: PosesOption = None,
    plant: CalibrationPlantOption = None,
    intrinsics: Annotated[
        Path | None,
        typer.Option(help="Of the camera; else found by a board first.", metavar="FILE"),
    ] = None,
    markers: Annotated[
        Path | None,
        typer.Option(help="Sizes of the sheets, known places; else as ordered.", metavar="FILE"),
    ] = None,
    hand_eye: HandEyeOption = None,
    seed: SeedOption = 1,
    identify: IdentifyOption = None,
    known_mm: KnownMmOption = None,
    out_dir: OutDirOption = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with what a run has left that ended early.")
    ] = False,
    overwrite: OverwriteOption = False,
    dry_run: DryRunOption = False,
    adopt: AdoptOption = False,
    as_json: JsonOption = False,
) -> None:
    """Move a simulated robot through poses, read its cables, identify, verify and take over.

    It runs on a simulator of its own, over the bus, from home and with the geometry of its file.
    What stands behind ± is one standard deviation (1 sigma). Ends with status 1, and takes nothing
    over, where the result is not good; with 0 where it changes nothing significantly, and takes
    nothing over then either.
    """
    out = Output(as_json)
    with out.stage("looking at the robot's file"):
        from cdpr_rt.robots.feasibility.checks import refuse_impossible  # noqa: PLC0415
        from cdpr_tools.calibrate.finish import finish, stop_criterion, with_hand_eye  # noqa: PLC0415
        from cdpr_tools.calibrate.measuring import run as runs  # noqa: PLC0415  # slow to load
        from cdpr_tools.calibrate.measuring.begin import check_points, source_of  # noqa: PLC0415
        from cdpr_tools.calibrate.measuring.places import poses_wanted  # noqa: PLC0415

        profile = load_robot(robot)
        refuse_impossible(profile)
        geometry, known = geometry_of(profile, identify, known_mm), hand_eye_of(hand_eye)
        count, listed = poses_wanted(profile, poses)
        if points is not None:
            check_points(points, profile, None if resume else count)

    folder = out_dir or Path("out") / f"calibrate-{profile.profile}"
    if resume:
        _require_as_begun({
            "--camera": camera, "--redundancy": redundancy, "--scanner": scanner, "--plant": plant,
            "--intrinsics": intrinsics, "--markers": markers,
        })  # fmt: skip
        settings = runs.CalibrationRunSettings.load(folder).resumed(count, listed, points)
        if points is None and settings.points is not None:
            points = Path(settings.points)
            check_points(points, profile, None)
        kept = runs.StoredRun.resumed(folder, profile)
    else:
        _require_new(folder, runs.DATA, overwrite)
        source = source_of(
            profile, camera=camera, redundancy=redundancy, scanner=scanner, points=bool(points)
        )
        _require_camera(known, source)
        settings = runs.CalibrationRunSettings(
            robot=profile.profile,
            plant=None if plant is None else str(plant.resolve()),
            source=source,
            poses=count,
            seed=seed,
            places=listed,
            points=None if points is None else str(points.resolve()),
        )
        setup = _camera_setup(out, plant, intrinsics, markers) if source == "camera" else None
        kept = runs.StoredRun.new(folder, profile, setup)
    settings.save(folder)
    kept.data = with_hand_eye(kept.data, known)
    data = runs.measure(
        out, profile, settings, kept, stop_criterion(out, profile, points, geometry)
    )
    finish(
        *(out, profile, data, points, geometry, folder / runs.DATA, folder, dry_run, adopt),
        runs.truth_comparison_of(profile, settings, folder),
    )


def _require_as_begun(given: Mapping[str, object]) -> None:
    """Raise BadInputError for options that only the beginning of a run takes."""
    for option, value in given.items():
        if value:
            raise BadInputError(f"{option}: not with --resume, which goes on as the run was begun")


def _require_camera(hand_eye: HandEye | None, source: str) -> None:
    if hand_eye is not None and source != "camera":
        raise BadInputError("--hand-eye: is of a camera; allowed: with --camera")


def _camera_setup(
    out: Output, plant: Path | None, intrinsics: Path | None, markers: Path | None
) -> CameraSetup:
    """Return the camera of a new run; its module needs an extra."""
    from cdpr_tools.calibrate.measuring.camera_setup import camera_setup  # noqa: PLC0415

    return camera_setup(out, plant, intrinsics, markers)


def _require_new(folder: Path, name: str, overwrite: bool) -> None:
    if (folder / name).exists() and not overwrite:
        raise BadInputError(
            f"{folder / name}: is there already; allowed: --resume to go on with it, --overwrite"
        )


@app.command()
def check(
    robot: RobotArgument,
    scanner: ScannerOption = False,
    plant: CalibrationPlantOption = None,
    running: Annotated[
        bool,
        typer.Option("--running", help="The robot that a daemon runs instead, tight and at home."),
    ] = False,
    camera: CameraUrlOption = None,
    seed: SeedOption = 1,
    out_dir: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for the readings, check.json; else out/check-ROBOT."),
    ] = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Take a calibrated robot to ten poses and say whether it is as it was.

    It is simulated, or `--running`. Ends with status 1 where it has moved: a cable, a drum or an
    exit point has changed so much that it matters.
    """
    out = Output(as_json)
    with out.stage("looking at the robot's file"):
        from cdpr_rt.robots.feasibility.checks import refuse_impossible  # noqa: PLC0415
        from cdpr_tools.calibrate import check as checks  # noqa: PLC0415  # slow to load

        profile = load_robot(robot)
        refuse_impossible(profile)
    folder = out_dir or Path("out") / f"check-{profile.profile}"
    if running:
        if scanner or plant is not None:
            raise BadInputError("--running: not together with --scanner or --plant")
        name = None if socket is not None or url is not None else robot
        with open_daemon(name, socket, url, key_file) as daemon:
            found = checks.checked_running(out, profile, daemon, camera, seed, folder)
    elif camera is not None:
        raise BadInputError("--camera: allowed: with --running")
    else:
        found = checks.checked(out, profile, plant, scanner, seed, folder)
    out.say(*checks.lines(found, profile))
    out.result({"ok": not found.moved, **checks.as_json(found), "data": folder / checks.CHECK})
    if found.moved:
        raise typer.Exit(WorkFailedError.exit_status)


@app.command()
def undo(robot: RobotArgument, as_json: JsonOption = False) -> None:
    """Take back the calibration in force: the one before it, or the robot's file, counts again.

    A robot that runs goes on as it is; its next start takes it.
    """
    out = Output(as_json)
    profile = load_robot(robot)
    from cdpr_tools.calibrate.finish import distrust_again  # noqa: PLC0415  # slow to load

    distrust_again(profile)
    before = take_back(profile)
    if before is None:
        out.say(f"{profile.profile}: the geometry of {profile.path} takes effect at the next start")
    else:
        out.say(
            f"{profile.profile}: calibration {before.version} of {before.date:%Y-%m-%d %H:%M} "
            f"({before.identity}) takes effect at the next start"
        )
    out.result({"ok": True, "in_force": None if before is None else before.summary()})


@app.command()
def study(
    robot: Annotated[
        str, typer.Argument(help="A robot whose platform has six directions.", metavar="ROBOT")
    ] = "spatial-8",
    draws: Annotated[
        int | None,
        typer.Option(
            min=2, max=100_000, help=f"Trials of each case; else {_DRAWS}, of --ablation {_FEW}."
        ),
    ] = None,
    seed: SeedOption = 1,
    png: PngOption = None,
    ablation: Annotated[
        bool,
        typer.Option(
            "--ablation", help="Tell instead what makes the error of a calibration with a camera."
        ),
    ] = False,
    cluster: ClusterOption = None,
    as_json: JsonOption = False,
) -> None:
    """Tell how errors of measurement become errors of the geometry: by a model and by trial.

    Table 3.1 and figures 3.7, 3.8, B.1 to B.6 and C.1 to C.6 of the thesis for a robot of ours,
    on all cores or a cluster; --png draws NAME.png, NAME-B.png and NAME-C.png. With --ablation:
    what made the thesis' 31 mm, and what each improvement takes off.
    """
    with loading_notice():
        from cdpr_tools.calibrate import study as studies  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    if ablation:
        _ablation(out, robot, draws or _FEW, seed, cluster, png)
        return
    draws = draws or _DRAWS
    with out.progress("cases", float(len(studies.cases()))) as advance:
        rows = studies.study(robot, draws, seed, cluster, advance)
    out.say(*studies.lines(rows))
    if png is not None:
        from cdpr_tools.calibrate.study_pictures import draw  # noqa: PLC0415  # slow to load

        with os_error_as(BadInputError, f"--png {png}: cannot be written"):
            draw(png, rows)
    out.result({
        "ok": True, "robot": robot, "draws": draws, "seed": seed, "cases": rows,
        "plateaus": studies.plateaus(rows),
    })  # fmt: skip


def _ablation(
    out: Output, robot: str, draws: int, seed: int, cluster: str | None, png: Path | None
) -> None:
    try:
        with loading_notice():
            from cdpr_tools.calibrate import ablation as ablations  # noqa: PLC0415  # slow to load
    except ModuleNotFoundError as error:
        raise BadInputError(
            f"--ablation needs {error.name}, which comes with: pip install 'cdpr-rt[camera]'"
        ) from None
    if png is not None:
        raise BadInputError("--png and --ablation: give one of them")
    with out.progress("trials", float(ablations.count(draws))) as advance:
        tables = ablations.ablation(robot, draws, seed, cluster, advance)
    out.say(*ablations.lines(tables))
    out.result({"ok": True, "robot": robot, "draws": draws, "seed": seed, **tables})
