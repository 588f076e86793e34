"""`cdpr cogging`: the steps of a commissioning one by one, on the bus or from recorded data."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from cdpr_rt.cogging_profile import CoggingProfileError, DriveIdentity
from cdpr_rt.errors import RawLogError
from cdpr_rt.rawlog import read_raw_log
from profiles import Winch, load_winch
from profiles.motor_bounds import MotorBounds
from tools import summary
from tools.commands.commission import keeping_raw_data, prepare
from tools.commands.options import (
    BusOption,
    IndexOption,
    JsonOption,
    PlantOption,
    WinchArgument,
    YesOption,
)
from tools.commission_files import Paths
from tools.commissioned import load_profile
from tools.commissioning import METHODS
from tools.errors import BadInputError
from tools.evaluation import compare
from tools.output import Output
from tools.procedure import (
    DEFAULT_BANDWIDTH_HZ,
    Commissioning,
    Plan,
    identify,
    store_profile,
    validation_name,
)
from tools.report import build
from tools.results import assemble, identification, read_run
from tools.session import confirm_motion, open_bus, open_winch
from tools.truth import Truth

app = typer.Typer(help="Cogging: sweep, fit, validate, report.", no_args_is_help=True)

_OutOption = Annotated[Path, typer.Option("--out", help="Folder for the recordings.")]


def register(parent: typer.Typer) -> None:
    """Add the command group."""
    parent.add_typer(app, name="cogging")


@app.command()
def sweep(
    winch: WinchArgument,
    bus: BusOption,
    out_dir: _OutOption,
    plant: PlantOption = None,
    turns: Annotated[int, typer.Option(min=1, max=20, help="Turns in each direction.")] = 2,
    speed_deg_s: Annotated[
        float, typer.Option("--speed-deg-s", min=0.5, max=60.0, help="Speed of the sweep.")
    ] = 3.0,
    overwrite: Annotated[bool, typer.Option("--overwrite")] = False,
    index: IndexOption = "homing",
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Record the slow sweeps and the fast legs from which `fit` identifies the motor."""
    out = Output(as_json)
    profile, url = load_winch(winch), open_bus(bus)
    paths = prepare(out_dir, overwrite)
    confirm_motion(url, yes, "the sweep turns the motor")
    with keeping_raw_data(paths), open_winch(profile, url, out, plant, paths.truth) as session:
        plan = Plan(sweep_speed_rad_s=math.radians(speed_deg_s), turns=turns)
        steps = Commissioning(session, out, paths, plan)
        steps.prepare(index)
        steps.measure()
    recorded = [str(p) for name in ("sweep", "fast") for p in paths.passes(name)]
    for path in recorded:
        out.say(f"recorded {path}")
    out.result({"ok": True, "recorded": recorded})


@app.command()
def fit(
    folder: Annotated[Path, typer.Argument(help="The --out folder of sweep or commission.")],
    winch: Annotated[
        str | None, typer.Option(help="Winch profile; the one recorded by default.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Identify from recorded data and write the cogging profile into the folder."""
    out = Output(as_json)
    paths = Paths(folder)
    recorded_winch, identity, latency = _recorded_identity(paths)
    profile = load_winch(winch or recorded_winch)
    found = identify(profile, latency or profile.latency_s, paths)
    store_profile(profile, identity, found, paths)
    result = identification(found)
    summary.show_identified(out, result)
    out.say(f"profile: {paths.profile}")
    out.result({"ok": True, "identification": result, "profile": str(paths.profile)})


def _recorded_identity(paths: Paths) -> tuple[str, DriveIdentity, float | None]:
    """Return the winch, its drive, and its latency, which older recordings do not tell."""
    sweeps = paths.passes("sweep")
    if not sweeps:
        raise BadInputError(f"{paths.out}: holds no recorded sweep (raw/sweep-0.raw, ...)")
    try:
        header = read_raw_log(sweeps[0]).header
        whose, latency = header["identity"], header.get("latency_s")
        identity = DriveIdentity(**{key: whose[key] for key in DriveIdentity.model_fields})
        return str(whose["winch"]), identity, latency if latency is None else float(latency)
    except (KeyError, TypeError, ValueError) as error:
        raise RawLogError(f"{sweeps[0]}: does not say which drive it is of") from error


@app.command()
def validate(
    winch: WinchArgument,
    cogging_profile: Annotated[Path, typer.Argument(help="Cogging profile of this motor.")],
    bus: BusOption,
    out_dir: _OutOption,
    plant: PlantOption = None,
    bandwidth_Hz: Annotated[
        float, typer.Option("--bandwidth-hz", min=1.0, max=100.0)
    ] = DEFAULT_BANDWIDTH_HZ,
    overwrite: Annotated[bool, typer.Option("--overwrite")] = False,
    index: IndexOption = "homing",
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Follow ramps without and with the profile's compensation, under one PID."""
    out = Output(as_json)
    profile, url = load_winch(winch), open_bus(bus)
    bounds = MotorBounds(profile.motor)
    learnt = load_profile(cogging_profile, bounds)
    paths = prepare(out_dir, overwrite)
    confirm_motion(url, yes, "the validation turns the motor")
    with keeping_raw_data(paths), open_winch(profile, url, out, plant, paths.truth) as session:
        try:  # before the motor moves
            learnt.compensation("better", session.drive_identity, bounds)
        except CoggingProfileError as error:
            raise BadInputError(f"{cogging_profile}: {error}") from error
        plan = Plan(bandwidths_Hz=())
        steps = Commissioning(session, out, paths, plan)
        steps.prepare(index)
        steps.validate(learnt, bandwidth_Hz)
    truth = Truth(paths.truth) if paths.truth.exists() else None
    runs = {m: paths.passes(validation_name(m, bandwidth_Hz)) for m in METHODS}
    result = compare(runs, truth)
    validation = {"judged_on": "encoder" if truth is None else "true angle", **result}
    summary.show_validation(out, validation, bandwidth_Hz)
    out.result({"ok": True, "validation": validation})


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(help="The --out folder of a commissioning.")],
    as_json: JsonOption = False,
) -> None:
    """Make the report anew from the files of a commissioning."""
    out = Output(as_json)
    paths = Paths(folder)
    run = read_run(paths)
    profile: Winch = load_winch(run["winch"])
    found = identify(profile, run["latency_s"], paths)
    results = assemble(paths, run, found)
    build(paths, profile, results, found)
    out.say(f"report: {paths.page}")
    out.result(results)
