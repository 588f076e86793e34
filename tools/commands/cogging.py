"""`cdpr cogging`: the steps of a commissioning one by one, on the bus or from recorded data."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drivers.robot.commissioned import load_profile
from cdpr_profiles import Winch, load_robot, load_winch
from cdpr_profiles.motor_bounds import MotorBounds
from cdpr_rt.errors import RawLogError
from cdpr_rt.identification.cogging_profile import (
    CoggingProfile,
    CoggingProfileError,
    DriveIdentity,
)
from cdpr_rt.identification.commissioning_results import (
    METHODS,
    Paths,
    assemble,
    compare,
    identification,
    identify,
    read_run,
    store_profile,
    validation_name,
)
from cdpr_rt.identification.rawlog import read_raw_log
from cdpr_rt.robot import Robot
from cdpr_tools.commands import options
from cdpr_tools.commands.commission import IndexOption
from cdpr_tools.commands.options import argument, option
from cdpr_tools.commands.with_winch import WinchOnBus, with_winch
from cdpr_tools.commission import axis_sweep, comparison, summary
from cdpr_tools.commission.commissioning import DEFAULT_BANDWIDTH_HZ, Commissioning, Plan
from cdpr_tools.commission.run import prepare
from cdpr_tools.composition.session import confirm_motion, open_winch
from cdpr_tools.consent import require_consent
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output, TableText
from cdpr_tools.raw_data import keeping_raw_data
from cdpr_tools.recordings.truth import true_angle

app = typer.Typer(
    name="cogging",
    help="Identify, check and report the cogging torque of a motor.",
    no_args_is_help=True,
)

_OutOption = Annotated[Path, option("Folder for the recordings.", "--out")]
_TurnsOption = Annotated[int, option("Turns in each direction.", min=1, max=20)]
_SpeedOption = Annotated[float, option("Speed of the sweep.", "--speed-deg-s", min=0.5, max=60.0)]


@app.command()
@with_winch
def sweep(
    winch: WinchOnBus,
    out: Output,
    out_dir: _OutOption,
    turns: _TurnsOption = 2,
    speed_deg_s: _SpeedOption = 3.0,
    overwrite: options.OverwriteOption = False,
    index: IndexOption = "homing",
    yes: options.YesOption = False,
) -> None:
    """Record the slow sweeps and the fast legs from which `fit` identifies the motor."""
    paths = prepare(out_dir, overwrite)
    confirm_motion(winch.url, yes, "the sweep turns the motor")
    with (
        keeping_raw_data(paths.raw_folder),
        open_winch(winch.profile, winch.url, out, winch.plant, paths.truth) as session,
    ):
        plan = Plan(sweep_speed_rad_s=math.radians(speed_deg_s), turns=turns)
        steps = Commissioning(session, out, paths, plan)
        steps.prepare(index)
        steps.measure()
    recorded = [str(p) for name in ("sweep", "fast") for p in paths.passes(name)]
    for path in recorded:
        out.say(f"recorded {path}")
    out.result({"ok": True, "recorded": recorded})


@app.command()
def sweep_axis(
    axis: Annotated[str, argument("Axis of the running robot.")],
    out_dir: _OutOption,
    turns: _TurnsOption = 2,
    speed_deg_s: _SpeedOption = 3.0,
    overwrite: options.OverwriteOption = False,
    robot: options.RobotOption = None,
    socket: options.SocketOption = None,
    yes: options.YesOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Turn a motor as `sweep` does, for `fit`, through this machine's running daemon.

    The daemon's programs turn the motor and its recording holds the data; the other axes hold.
    Ctrl-C stops the motor. Afterwards the drives have no power, even if the command fails.
    """
    # imported here: commissioning a single winch does not need the packages of the daemon
    from cdpr_tools.client.client import open_daemon  # noqa: PLC0415
    from cdpr_tools.client.motion import carry_out  # noqa: PLC0415

    out = Output(as_json)
    with open_daemon(robot, socket, None, None) as daemon:
        description = daemon.get("/description")
        profile = load_robot(description["reference"])
        swept = axis_sweep.SweptAxis.of(description, daemon.get("/status"), axis, profile)
        paths = prepare(out_dir, overwrite)
        what = f"the sweep turns the motor of {axis}: take its cable off the drum first."
        require_consent(what, yes or swept.is_simulated)
        recorded: list[str] = []

        def measure(moved: Robot) -> None:
            axis_sweep.sweep(moved, swept, turns, math.radians(speed_deg_s), out)
            out.note("reading the recording ...")
            rows = moved.log(*axis_sweep.FIELDS)
            recorded.extend(map(str, axis_sweep.write_passes(rows, swept, paths)))

        if carry_out(daemon, out, measure, notice="").stopped and not recorded:
            raise WorkFailedError(f"{axis}: stopped on request")
    for path in recorded:
        out.say(f"recorded {path}")
    out.result({"ok": True, "recorded": recorded})


@app.command()
def fit(
    folder: Annotated[Path, argument("The --out folder of sweep or commission.")],
    winch: options.RecordedWinchOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Identify from recorded data and write the cogging profile into the folder."""
    out = Output(as_json)
    paths = Paths(folder)
    recorded_winch, identity, latency = _recorded_identity(paths)
    profile = load_winch(winch or recorded_winch)
    found = identify(profile, profile.latency_s if latency is None else latency, paths)
    store_profile(profile, identity, found, paths)
    result = identification(found)
    summary.show_identified(out, result)
    out.say(f"profile: {paths.profile}")
    out.result({"ok": True, "identification": result, "profile": str(paths.profile)})


@app.command(name="compare")
def compare_runs(
    folder: Annotated[Path, argument("Folder in which `fit` wrote a profile.")],
    others: Annotated[list[Path], argument("Folders with other recordings.", metavar="OTHER...")],
    as_json: options.JsonOption = False,
) -> None:
    """Compare how well each method explains the torque of other recordings of the motor.

    R2 is the share of the torque's variance that the curve over the angle explains. Recordings in
    FOLDER itself are marked: the curves were identified from them. Hysteresis shifts static maps,
    and curves of a direction that was not identified. A second line gives R2 at the best shift, up
    to 1 deg.
    """
    out = Output(as_json)
    profile = CoggingProfile.load(Paths(folder).profile)
    used = comparison.runs_of(folder)
    swept = [run for run in used if not run.is_static]
    curves = comparison.tables(profile, swept)
    rows, results = [["recording", *comparison.CURVES]], []
    others = [other for other in others if other.resolve() != folder.resolve()]
    for run in [*used, *(run for other in others for run in comparison.runs_of(other))]:
        of_run = {name: curves[name][run.direction] for name in comparison.CURVES}
        by_method = {name: comparison.explained(curve, run) for name, curve in of_run.items()}
        own = " (used for the identification)" if run in used else ""
        rows.append([f"{run.path}{own}", *(f"{r2:.4f}" for r2 in by_method.values())])
        facts = {"recording": str(run.path), "identified_from": bool(own), "r2": by_method}
        results.append(facts)
        if run.is_static or run.direction not in {one.direction for one in swept}:
            best = {name: comparison.best_shift(curve, run) for name, curve in of_run.items()}
            shown = [f"{r2:.4f} at {math.degrees(by):+.2f} deg" for r2, by in best.values()]
            rows.append(["  at the best shift of the angle", *shown])
            facts["shifted"] = {
                name: {"r2": r2, "shift_deg": math.degrees(by)} for name, (r2, by) in best.items()
            }
    out.say("R2 of the torque without its mean friction", TableText(rows, left=["recording"]))
    out.result({"ok": True, "runs": results})


def _recorded_identity(paths: Paths) -> tuple[str, DriveIdentity, float | None]:
    """Return the winch, its drive, and its latency, which older recordings do not contain."""
    sweeps = paths.passes("sweep")
    if not sweeps:
        raise BadInputError(f"{paths.out}: contains no recorded sweep (raw/sweep-0.raw, ...)")
    try:
        header = read_raw_log(sweeps[0]).header
        whose, latency = header["identity"], header.get("latency_s")
        identity = DriveIdentity(**{key: whose[key] for key in DriveIdentity.model_fields})
        return str(whose["winch"]), identity, latency if latency is None else float(latency)
    except (KeyError, TypeError, ValueError) as error:
        raise RawLogError(f"{sweeps[0]}: does not name its drive") from error


@app.command()
@with_winch
def validate(
    winch: WinchOnBus,
    out: Output,
    cogging_profile: Annotated[Path, argument("Cogging profile of this motor.")],
    out_dir: _OutOption,
    bandwidth_Hz: Annotated[
        float, option("Closed-loop bandwidth of the PID.", "--bandwidth-hz", min=1.0, max=100.0)
    ] = DEFAULT_BANDWIDTH_HZ,
    overwrite: options.OverwriteOption = False,
    index: IndexOption = "homing",
    yes: options.YesOption = False,
) -> None:
    """Follow ramps without and with the profile's compensation, under one PID."""
    bounds = MotorBounds(winch.profile.motor)
    learnt = load_profile(cogging_profile, bounds)
    paths = prepare(out_dir, overwrite)
    confirm_motion(winch.url, yes, "the validation turns the motor")
    with (
        keeping_raw_data(paths.raw_folder),
        open_winch(winch.profile, winch.url, out, winch.plant, paths.truth) as session,
    ):
        try:  # before the motor moves
            learnt.compensation("harmonic", session.drive_identity, bounds)
        except CoggingProfileError as error:
            raise BadInputError(f"{cogging_profile}: {error}") from error
        plan = Plan(bandwidths_Hz=())
        steps = Commissioning(session, out, paths, plan)
        steps.prepare(index)
        steps.validate(learnt, bandwidth_Hz)
    truth = true_angle(paths.truth)
    runs = {m: paths.passes(validation_name(m, bandwidth_Hz)) for m in METHODS}
    result = compare(runs, truth)
    validation = {"judged_on": "encoder" if truth is None else "true angle", **result}
    summary.show_validation(out, validation, bandwidth_Hz)
    out.result({"ok": True, "validation": validation})


@app.command()
def report(
    folder: Annotated[Path, argument("The --out folder of a commissioning.")],
    as_json: options.JsonOption = False,
) -> None:
    """Make the report again from the files of a commissioning."""
    out = Output(as_json)
    paths = Paths(folder)
    run = read_run(paths)
    profile: Winch = load_winch(run["winch"])
    from cdpr_tools.commission import page  # noqa: PLC0415  # slow to load

    found = identify(profile, run["latency_s"], paths)
    results = assemble(paths, run, found, true_angle(paths.truth))
    page.build(paths, profile, results, found)
    out.say(f"report: {paths.page}")
    out.result(results)
