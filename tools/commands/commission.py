"""`cdpr commission`: a winch's motor from a drive that is off to a validated cogging profile."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from cdpr_rt.errors import ControlError
from drivers.errors import DriverError
from profiles import load_winch
from tools import summary
from tools.commands.options import (
    BusOption,
    IndexOption,
    JsonOption,
    PlantOption,
    SafetyIoOption,
    WinchArgument,
    YesOption,
)
from tools.commissioning import Paths
from tools.errors import BadInputError, WorkFailedError
from tools.output import Output, to_json
from tools.procedure import DEFAULT_BANDWIDTH_HZ, QUICK, THOROUGH, Commissioning, identify
from tools.report import build
from tools.results import assemble
from tools.session import confirm_motion, open_bus, open_winch


def register(parent: typer.Typer) -> None:
    """Add the command."""
    parent.command()(commission)


def commission(
    winch: WinchArgument,
    bus: BusOption,
    plant: PlantOption = None,
    out_dir: Annotated[
        Path | None, typer.Option("--out", help="Folder for raw data, profile and report.")
    ] = None,
    bandwidth_Hz: Annotated[
        float,
        typer.Option(
            "--bandwidth-hz", min=1.0, max=100.0, help="Closed-loop bandwidth of the PID."
        ),
    ] = DEFAULT_BANDWIDTH_HZ,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier commissioning in --out.")
    ] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="A rough look in a tenth of the time.")
    ] = False,
    index: IndexOption = "homing",
    safety_io: SafetyIoOption = None,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Measure, identify, validate and report one motor, detached from its load."""
    out = Output(as_json)
    profile = load_winch(winch)
    url = open_bus(bus)
    paths = prepare(out_dir or Path("out") / f"commission-{profile.profile}", overwrite)
    confirm_motion(url, yes, "commissioning turns the motor for about 20 minutes")
    plan = QUICK if quick else THOROUGH
    with keeping_raw_data(paths):
        with open_winch(profile, url, out, plant, paths.truth, safety_io) as session:
            run = Commissioning(session, out, paths, plan).run(bandwidth_Hz, index)
        write(paths.run, to_json(run, indent=1))
        found = identify(profile, run["latency_s"], paths)
        results = assemble(paths, run, found)
        build(paths, profile, results, found)
    summary.show(out, results)
    out.result(results)


def prepare(folder: Path, overwrite: bool) -> Paths:
    """Return the paths in `folder`; raises BadInputError where an earlier run would be lost."""
    paths = Paths(folder)
    raw = folder / "raw"
    if raw.exists() and any(raw.iterdir()):
        if not overwrite:
            raise BadInputError(
                f"--out {folder}: holds the data of an earlier run; choose another folder, "
                "or replace it with --overwrite"
            )
        shutil.rmtree(raw)
        for path in (paths.run, paths.results, paths.page, paths.profile, paths.truth):
            path.unlink(missing_ok=True)
    try:
        raw.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"--out {folder}: cannot be created: {error.strerror}") from error
    return paths


def write(path: Path, text: str) -> None:
    """Write a small file; raises WorkFailedError naming it."""
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise WorkFailedError(f"{path}: cannot be written: {error.strerror}") from error


@contextmanager
def keeping_raw_data(paths: Paths) -> Iterator[None]:
    """Add to an error's message where the recordings made so far are."""
    raw = paths.out / "raw"
    try:
        yield
    except (ControlError, DriverError) as error:
        if not any(raw.glob("*.raw")):
            raise
        raise WorkFailedError(f"{error} (recorded so far: {raw})") from error
