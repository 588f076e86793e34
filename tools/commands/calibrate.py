"""`cdpr calibrate`: a robot's geometry from its own cables and from measured points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.calibration_in_force import undo as take_back
from cdpr_tools.client.client import Daemon, open_daemon
from cdpr_tools.commands import options
from cdpr_tools.commands.options import argument, option
from cdpr_tools.commands.with_daemon import with_daemon
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output
from cdpr_tools.signals import HELD, stop_on_signals

if TYPE_CHECKING:
    from cdpr_rt.calibration.parameters import CableGeometry
    from cdpr_rt.calibration.readings import HandEye


# Options shared by several commands of `cdpr calibrate`, and their evaluation.

PointsOption = Annotated[
    Path | None,
    option(
        "Measured positions, CSV with the columns pose (from 1), x_mm, y_mm, z_mm, sigma_mm.",
        metavar="FILE",
    ),
]
IdentifyOption = Annotated[
    str | None,
    option(
        "Parameters to identify, separated by commas: exit, offset, drum, elongation "
        "(these by default), anchor, pulley.",
        metavar="LIST",
    ),
]
KnownMmOption = Annotated[
    float | None,
    option(
        "Standard deviation of the exit points in the robot's file, mm; default 50, as "
        "measured with a tape.",
        "--known-mm",
        min=0.1,
        max=500.0,
    ),
]
KnownDrumOption = Annotated[
    float | None,
    option(
        "Standard deviation of the drums' circumference in the robot's file, %; default 0.5.",
        "--known-drum-percent",
        min=0.001,
        max=50.0,
    ),
]
LengthNoiseOption = Annotated[
    float | None,
    option(
        "Standard deviation of a cable length from its encoder, mm; default: estimated from the "
        "data, at least 0.3.",
        "--length-noise-mm",
        min=0.001,
        max=100.0,
    ),
]
WantedMmOption = Annotated[
    float | None,
    option(
        "Largest allowed uncertainty of positions, mm (3 sigma); default: held-out poses "
        "must improve, and their errors must be as predicted.",
        "--wanted-mm",
        min=0.01,
        max=1000.0,
    ),
]
CalibrationPlantOption = Annotated[
    Path | None, option("Plant file: the truth about robot, cables, motors and camera.")
]
DryRunOption = Annotated[bool, option("Report the result; adopt nothing.", "--dry-run")]
AdoptOption = Annotated[
    bool, option("Adopt the calibration even if its changes are not significant.", "--adopt")
]
PosesOption = Annotated[
    str | None,
    option(
        "Number of poses including home, or a list written by `cdpr poses`. Default: "
        "up to 100, as long as more poses improve the result.",
        metavar="N|FILE",
    ),
]
ScannerOption = Annotated[
    bool, option("Measure the poses with the simulated scanner.", "--scanner")
]
OutDirOption = Annotated[
    Path | None,
    option("Folder for data, images, result and report; default out/calibrate-ROBOT.", "--out"),
]
CameraUrlOption = Annotated[
    str | None, option("Camera on the platform, such as opencv:0.", "--camera", metavar="CAMERA")
]
IntrinsicsOption = Annotated[
    Path | None, option("Intrinsics of the camera; needed for the first pose.", metavar="FILE")
]
MarkersOption = Annotated[
    Path | None,
    option("File with the sizes of the sheets; needed for the first pose.", metavar="FILE"),
]


def hand_eye_of(path: Path | None) -> HandEye | None:
    """Return the hand-eye transform of `--hand-eye`; raises ProfileError."""
    from cdpr_rt.calibration.readings import HandEye  # noqa: PLC0415  # slow to load

    return None if path is None else HandEye.load_file(path)


def geometry_of(
    robot: Robot,
    identify: str | None,
    known_mm: float | None,
    drum_percent: float | None = None,
    length_mm: float | None = None,
) -> CableGeometry:
    """Return the parameters to identify; raises InvalidRequestError for an unknown kind."""
    from cdpr_rt.calibration.parameters import (  # noqa: PLC0415  # slow to load
        USUAL,
        CableGeometry,
        Knowledge,
    )

    known = Knowledge(length_known=length_mm is not None)
    if known_mm is not None:
        known = replace(known, exit_m=1e-3 * known_mm)
    if drum_percent is not None:
        known = replace(known, drum=1e-2 * drum_percent)
    if length_mm is not None:
        known = replace(known, length_m=1e-3 * length_mm)
    kinds = USUAL if identify is None else tuple(part.strip() for part in identify.split(","))
    return CableGeometry.of(robot, kinds, known)


# `cdpr calibrate measure`: move a robot that a daemon runs through poses and calibrate it.


@with_daemon
def measure(
    daemon: Daemon,
    out: Output,
    camera: CameraUrlOption = None,
    ask: Annotated[
        bool, option("Ask at each pose for the measured position of the platform.", "--ask")
    ] = False,
    poses: PosesOption = None,
    intrinsics: IntrinsicsOption = None,
    markers: MarkersOption = None,
    hand_eye: options.HandEyeOption = None,
    seed: options.SeedOption = 1,
    identify: IdentifyOption = None,
    known_mm: KnownMmOption = None,
    out_dir: OutDirOption = None,
    dry_run: DryRunOption = False,
    adopt: AdoptOption = False,
) -> None:
    """Move a running robot through poses, read its cables, identify; adopt a good result.

    Start with the robot at home on tight cables, as after `cdpr tighten`; it is held at the last
    pose. Without --camera and --ask it uses only lengths and tensions. If the folder already has
    poses, also from `cdpr calibrate read`, it continues after them. Ctrl-C holds the platform. The
    exit status is as for `cdpr calibrate run`.
    """
    with out.stage("choosing poses"):
        from cdpr_tools.calibrate import daemon_run  # noqa: PLC0415
        from cdpr_tools.calibrate.daemon_run import AskedPoints, require_points_of  # noqa: PLC0415
        from cdpr_tools.calibrate.finish import concluded, finish, stop_criterion, with_hand_eye  # noqa: PLC0415
        from cdpr_tools.calibrate.measure_poses import DATA, PoseOperator, StoredPoses  # noqa: PLC0415
        from cdpr_tools.calibrate.places import MOST_POSES, places_of, poses_wanted  # noqa: PLC0415
        from cdpr_tools.calibrate.run import POINTS, read_places  # noqa: PLC0415  # slow to load
        from cdpr_tools.client.daemon_robot import commanded  # noqa: PLC0415
        from cdpr_tools.trials.directions import platform_of  # noqa: PLC0415  # slow to load

        robot, description = daemon_run.robot_of(daemon)
        geometry, known = geometry_of(robot, identify, known_mm), hand_eye_of(hand_eye)
        count, listed = poses_wanted(robot, poses)
        folder = out_dir or Path("out") / f"calibrate-{robot.profile}"
        kept = StoredPoses(folder, daemon_run.data_of(folder, robot, description["simulated"]))
        points = folder / POINTS
        require_points_of(len(kept.data.poses), points)
        # check this before the slow choice of poses, and before a file is made
        with commanded(daemon) as running:
            kept.require_home(robot, PoseOperator(running, robot).place())
        if ask or points.exists():
            out.note(f"measured positions: {points}")
        places, most = places_of(robot, count, listed, seed), count or MOST_POSES
    with (
        stop_on_signals(HELD) as stop,
        daemon_run.image_taker(camera, intrinsics, markers, kept, out) as image,
        daemon_run.going_on(kept),
        commanded(daemon, in_control=True) as running,
    ):
        kept.data = with_hand_eye(kept.data, known)
        operator = PoseOperator(running, robot, image, stop)
        home_m = platform_of(robot).home_m
        asked = AskedPoints(out, points, len(home_m), operator.place) if ask else None
        criterion = stop_criterion(out, robot, points if ask else None, geometry)
        read_places(
            *(out, robot, operator, kept, places, most, criterion),
            asked or (lambda _pose: None),
            may_end=count is None,
        )
    out.say("the robot holds the platform at the last pose; `cdpr lower` returns it to its stand")
    result = concluded(
        *(out, robot, kept.data, points if points.exists() else None, geometry),
        *(folder / DATA, folder, dry_run, adopt),
    )
    finish(out, result)


# `cdpr calibrate read`: read the pose at which a robot stands, if people move it.

_ENOUGH = 15


@with_daemon
def read(
    daemon: Daemon,
    out: Output,
    out_dir: Annotated[Path, option("Folder of the poses; the first pose creates it.", "--out")],
    camera: CameraUrlOption = None,
    intrinsics: IntrinsicsOption = None,
    markers: MarkersOption = None,
) -> None:
    """Read the pose of a running robot's platform, for `cdpr calibrate fit`; moves nothing.

    The first pose is home, after `cdpr tighten`; use `cdpr move` to go to the others. At least
    fifteen poses are needed. `cdpr calibrate measure` moves to poses automatically.
    """
    from cdpr_tools.calibrate import daemon_run  # noqa: PLC0415
    from cdpr_tools.calibrate.measure_poses import DATA, PoseOperator, StoredPoses  # noqa: PLC0415
    from cdpr_tools.calibrate.run import POINTS  # noqa: PLC0415  # slow to load
    from cdpr_tools.client.daemon_robot import commanded  # noqa: PLC0415

    robot, description = daemon_run.robot_of(daemon)
    data = daemon_run.data_of(out_dir, robot, description["simulated"])
    kept = StoredPoses(out_dir, data)
    with (
        daemon_run.image_taker(camera, intrinsics, markers, kept, out) as image,
        commanded(daemon) as running,
    ):
        daemon_run.read_into(PoseOperator(running, robot, image), robot, kept)
    data = kept.data
    number = len(data.poses)
    out.say(*daemon_run.lines(robot, data))
    points = f" --points {out_dir / POINTS}" if (out_dir / POINTS).exists() else ""
    out.say(f"{number} poses in {out_dir / DATA}")
    if number >= _ENOUGH:
        out.say(f"to fit them: cdpr calibrate fit {robot.reference} --data {out_dir}{points}")
    reading = data.poses[-1]
    figures = {"pose": number, **reading.model_dump(include={"target", "length_m", "tension_N"})}
    out.result({"ok": True, **figures, "data": out_dir / DATA})


app = typer.Typer(
    name="calibrate",
    help="Calibrate a robot's geometry, drums and elongation.",
    no_args_is_help=True,
)


app.command()(read)
app.command()(measure)


@app.command(name="fit")
def fit_data(
    robot: options.RobotArgument,
    data: Annotated[Path, option("Folder of a run, or its data.json.", metavar="FOLDER|FILE")],
    points: PointsOption = None,
    hand_eye: options.HandEyeOption = None,
    identify: IdentifyOption = None,
    known_mm: KnownMmOption = None,
    drum_percent: KnownDrumOption = None,
    length_mm: LengthNoiseOption = None,
    wanted_mm: WantedMmOption = None,
    out_dir: Annotated[
        Path | None, option("Folder for the result; default that of --data.", "--out")
    ] = None,
    dry_run: DryRunOption = False,
    adopt: AdoptOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Identify from poses measured before, as at the end of a run; nothing moves.

    For the folder of a run, held-out poses are also compared with its simulator's scanner and
    truth. The number after ± is three standard deviations (3 sigma). A result that is not good is
    not adopted, and the exit status is 1. A result without significant changes is not adopted
    either, with status 0.
    """
    from cdpr_rt.calibration.readings import load_data  # noqa: PLC0415
    from cdpr_tools.calibrate.finish import concluded, finish, with_hand_eye  # noqa: PLC0415  # slow to load
    from cdpr_tools.calibrate.measure_poses import DATA  # noqa: PLC0415

    out = Output(as_json)
    profile = load_robot(robot)
    if data.is_dir():
        data /= DATA
    read_before = with_hand_eye(load_data(data), hand_eye_of(hand_eye))
    geometry = geometry_of(profile, identify, known_mm, drum_percent, length_mm)
    result = concluded(
        *(out, profile, read_before, points, geometry),
        *(data, out_dir or data.parent, dry_run, adopt),
        hand_eye=hand_eye,
        wanted_mm=wanted_mm,
    )
    finish(out, result)


@app.command()
def run(
    robot: options.RobotArgument,
    camera: Annotated[
        bool,
        option(
            "Use the camera on the platform; the default for platforms with six directions.",
            "--camera",
        ),
    ] = False,
    redundancy: Annotated[
        bool, option("Use only encoder lengths and tensions.", "--redundancy")
    ] = False,
    scanner: ScannerOption = False,
    points: PointsOption = None,
    poses: PosesOption = None,
    plant: CalibrationPlantOption = None,
    intrinsics: Annotated[
        Path | None,
        option(
            "Intrinsics of the camera; by default calibrated with a board first.", metavar="FILE"
        ),
    ] = None,
    markers: Annotated[
        Path | None,
        option(
            "File with sizes and known places of the sheets; by default those of the plant.",
            metavar="FILE",
        ),
    ] = None,
    hand_eye: options.HandEyeOption = None,
    seed: options.SeedOption = 1,
    identify: IdentifyOption = None,
    known_mm: KnownMmOption = None,
    out_dir: OutDirOption = None,
    resume: Annotated[bool, option("Continue a run that ended early.", "--resume")] = False,
    overwrite: options.OverwriteOption = False,
    dry_run: DryRunOption = False,
    adopt: AdoptOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Move a simulated robot through poses, read its cables, identify, verify, adopt.

    The command starts a simulator. The robot starts at home with the geometry of its file. The
    number after ± is three standard deviations (3 sigma). A result that is not good is not adopted,
    and the exit status is 1. A result without significant changes is not adopted either, with
    status 0.
    """
    out = Output(as_json)
    with out.stage("checking the robot's file"):
        from cdpr_rt.diagnosis.checks import refuse_impossible  # noqa: PLC0415
        from cdpr_tools.calibrate import run as runs  # noqa: PLC0415
        from cdpr_tools.calibrate.finish import (  # noqa: PLC0415  # slow to load
            concluded,
            finish,
            refuse_foreign_report,
            stop_criterion,
            with_hand_eye,
        )
        from cdpr_tools.calibrate.measure_poses import DATA  # noqa: PLC0415
        from cdpr_tools.calibrate.places import poses_wanted  # noqa: PLC0415
        from cdpr_tools.calibrate.run import check_points, source_of  # noqa: PLC0415

        profile = load_robot(robot)
        refuse_impossible(profile)
        geometry, known = geometry_of(profile, identify, known_mm), hand_eye_of(hand_eye)
        count, listed = poses_wanted(profile, poses)
        if points is not None:
            check_points(points, profile, None if resume else count)

    folder = out_dir or Path("out") / f"calibrate-{profile.profile}"
    refuse_foreign_report(folder)
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
        _require_new(folder, DATA, overwrite)
        source = source_of(
            profile, camera=camera, redundancy=redundancy, scanner=scanner, points=bool(points)
        )
        if known is not None and source != "camera":
            raise BadInputError("--hand-eye: allowed only with --camera")
        settings = runs.CalibrationRunSettings(
            robot=profile.profile,
            plant=None if plant is None else str(plant.resolve()),
            source=source,
            poses=count,
            seed=seed,
            places=listed,
            points=None if points is None else str(points.resolve()),
        )
        setup = None
        if source == "camera":
            from cdpr_tools.calibrate.pose_camera import camera_setup  # noqa: PLC0415  # needs an extra

            setup = camera_setup(out, plant, intrinsics, markers)
        kept = runs.StoredRun.new(folder, profile, setup)
    settings.save(folder)
    kept.data = with_hand_eye(kept.data, known)
    data = runs.measure(
        out, profile, settings, kept, stop_criterion(out, profile, points, geometry)
    )
    result = concluded(
        *(out, profile, data, points, geometry, folder / DATA, folder, dry_run, adopt)
    )
    finish(out, result)


def _require_as_begun(given: Mapping[str, object]) -> None:
    """Raise BadInputError for options that only a new run accepts."""
    for name, value in given.items():
        if value:
            raise BadInputError(
                f"{name}: cannot be combined with --resume, which continues with the options of "
                "the run"
            )


def _require_new(folder: Path, name: str, overwrite: bool) -> None:
    if (folder / name).exists() and not overwrite:
        raise BadInputError(
            f"{folder / name}: already exists; give --resume to continue it, or --overwrite"
        )


@app.command()
def check(
    robot: options.RobotArgument,
    scanner: ScannerOption = False,
    plant: CalibrationPlantOption = None,
    running: Annotated[
        bool,
        option(
            "Check the robot that a daemon runs; its cables must be tight and its platform at "
            "home.",
            "--running",
        ),
    ] = False,
    camera: CameraUrlOption = None,
    seed: options.SeedOption = 1,
    out_dir: Annotated[
        Path | None,
        option("Folder for the readings (check.json); default out/check-ROBOT.", "--out"),
    ] = None,
    socket: options.SocketOption = None,
    url: options.UrlOption = None,
    key_file: options.KeyFileOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Move a calibrated robot to ten poses and report whether it has changed.

    The robot is simulated, or `--running`. The exit status is 1 if a cable, a drum or an exit
    point has changed enough to matter.
    """
    out = Output(as_json)
    with out.stage("checking the robot's file"):
        from cdpr_rt.diagnosis.checks import refuse_impossible  # noqa: PLC0415
        from cdpr_tools.calibrate import check as checks  # noqa: PLC0415  # slow to load

        profile = load_robot(robot)
        refuse_impossible(profile)
    folder = out_dir or Path("out") / f"check-{profile.profile}"
    if running:
        if scanner or plant is not None:
            raise BadInputError("--running: cannot be combined with --scanner or --plant")
        name = None if socket is not None or url is not None else robot
        with open_daemon(name, socket, url, key_file) as daemon:
            found = checks.checked_running(out, profile, daemon, camera, seed, folder)
    elif camera is not None:
        raise BadInputError("--camera: allowed only with --running")
    else:
        found = checks.checked(out, profile, plant, scanner, seed, folder)
    out.say(*checks.lines(found, profile))
    out.result({"ok": not found.moved, **checks.as_json(found), "data": folder / checks.CHECK})
    if found.moved:
        raise typer.Exit(WorkFailedError.exit_status)


@app.command()
def undo(robot: options.RobotArgument, as_json: options.JsonOption = False) -> None:
    """Undo the calibration in force; the previous one, or the robot's file, applies again.

    A running robot is not affected until its next start.
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
        str, argument("A robot whose platform has six directions.", metavar="ROBOT")
    ] = "spatial-8",
    draws: Annotated[int, option("Trials of each case.", min=2, max=100_000)] = 200,
    seed: options.SeedOption = 1,
    png: options.PngOption = None,
    cluster: options.ClusterOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Show how measurement errors become errors of the geometry, by a model and by trial.

    Computes table 3.1 and figures 3.7, 3.8, B.1 to B.6 and C.1 to C.6 of the thesis for one of our
    robots, on all cores or a cluster. --png draws NAME.png, NAME-B.png and NAME-C.png.
    """
    from cdpr_tools.calibrate import study as studies  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    with out.progress("cases", float(len(studies.cases()))) as advance:
        rows = studies.study(robot, draws, seed, cluster, advance)
    out.say(*studies.lines(rows))
    if png is not None:
        with os_error_as(BadInputError, f"--png {png}: cannot be written"):
            studies.draw(png, rows)
    out.result({
        "ok": True, "robot": robot, "draws": draws, "seed": seed, "cases": rows,
        "plateaus": studies.plateaus(rows),
    })  # fmt: skip
