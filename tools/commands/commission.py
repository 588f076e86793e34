"""`cdpr commission`: motors from drives that are off to validated cogging profiles."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drivers.bus import BusUrl
from cdpr_profiles import Robot, Winch, load_winch_or_robot
from cdpr_rt.procedures.commissioning.commission_files import Paths
from cdpr_rt.procedures.commissioning.finding_index import Index
from cdpr_rt.procedures.commissioning.identified import identify
from cdpr_rt.procedures.commissioning.procedure import (
    DEFAULT_BANDWIDTH_HZ,
    QUICK,
    THOROUGH,
    Commissioning,
    Plan,
)
from cdpr_rt.procedures.commissioning.results import assemble
from cdpr_tools.commands.options import (
    IndexOption,
    JsonOption,
    OverwriteOption,
    PlantOption,
    SafetyIoOption,
    WinchOrRobotArgument,
    YesOption,
)
from cdpr_tools.commission import summary
from cdpr_tools.commission.robot_commissioning import (
    MotorOfRobot,
    chosen_axes,
    detached_motors,
    lines_for_robot,
)
from cdpr_tools.composition.session import confirm_motion, open_bus, open_winch
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output, to_json
from cdpr_tools.raw_data import keeping_raw_data, refuse_loss
from cdpr_tools.recordings.truth import true_angle
from cdpr_tools.report import build

_TURNS = "turns the motor for about 20 minutes"


app = typer.Typer()


@dataclass(frozen=True)
class _Request:
    """How a motor is commissioned."""

    plan: Plan
    bandwidth_Hz: float
    index: Index
    safety_io: str | None


@app.command()
def commission(
    machine: WinchOrRobotArgument,
    bus: Annotated[
        list[str] | None,
        typer.Option(
            "--bus",
            help="simbus: (starts simulated drives of its own), simbus:NAME, socketcan:can0, ...; "
            "for a robot also BUS=URL, or as its file says.",
            metavar="URL",
        ),
    ] = None,
    axis: Annotated[
        list[str] | None,
        typer.Option(help="Of a robot, the axis whose motor is measured; may be repeated."),
    ] = None,
    every: Annotated[
        bool, typer.Option("--all", help="Of a robot, all motors one after the other.")
    ] = False,
    plant: PlantOption = None,
    out_dir: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="Folder for raw data, profile and report, of a robot one in it for each axis; "
            "else out/commission-NAME.",
        ),
    ] = None,
    bandwidth_Hz: Annotated[
        float,
        typer.Option(
            "--bandwidth-hz", min=1.0, max=100.0, help="Closed-loop bandwidth of the PID."
        ),
    ] = DEFAULT_BANDWIDTH_HZ,
    overwrite: OverwriteOption = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="A rough result in a fifth of the time.")
    ] = False,
    index: IndexOption = "homing",
    safety_io: SafetyIoOption = None,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Measure, identify, validate and report motors, each detached from its load."""
    out = Output(as_json)
    profile = load_winch_or_robot(machine)
    folder = out_dir or Path("out") / f"commission-{profile.profile}"
    request = _Request(QUICK if quick else THOROUGH, bandwidth_Hz, index, safety_io)
    if isinstance(profile, Robot):
        motors = chosen_axes(profile, axis or (), every, folder)
        for motor in motors:
            prepare(motor.paths.out, overwrite)
        with detached_motors(profile, bus or (), motors, out, plant) as urls:
            _ask(motors, urls, yes)
            out.result(_commission_robot(profile, motors, urls, request, out))
        return
    if axis or every:
        raise BadInputError("--axis, --all: for a robot; a winch has one motor")
    url = open_bus(_only(bus))
    paths = prepare(folder, overwrite)
    confirm_motion(url, yes, f"commissioning {_TURNS}")
    out.result(_commission(profile, url, paths, request, out, plant))


def _only(buses: Sequence[str] | None) -> str:
    if not buses or len(buses) > 1:
        raise BadInputError("--bus: allowed: one, such as simbus: or socketcan:can0, for a winch")
    return buses[0]


def _ask(motors: Sequence[MotorOfRobot], urls: Sequence[BusUrl], yes: bool) -> None:
    for motor, url in zip(motors, urls, strict=True):
        what = f"commissioning axis {motor.axis.name} {_TURNS}: its cable has to be off the drum"
        confirm_motion(url, yes, what)


def _commission_robot(
    robot: Robot,
    motors: Sequence[MotorOfRobot],
    urls: Sequence[BusUrl],
    request: _Request,
    out: Output,
) -> dict[str, Any]:
    """Commission one motor after the other; return what the command ends with."""
    results = {}
    for motor, url in zip(motors, urls, strict=True):
        out.say(f"axis {motor.axis.name}, node {motor.axis.node_id} on {url}")
        results[motor.axis.name] = _commission(motor.winch, url, motor.paths, request, out)
    out.say(*lines_for_robot(robot, motors))
    folder = motors[0].paths.out.parent
    return {"ok": True, "robot": robot.reference, "commissioned": str(folder), "axes": results}


def _commission(
    winch: Winch,
    url: BusUrl,
    paths: Paths,
    request: _Request,
    out: Output,
    plant: Path | None = None,
) -> dict[str, Any]:
    """Commission the motor of `winch`; return what was found, as the report tells it."""
    with keeping_raw_data(paths.raw_folder):
        with open_winch(winch, url, out, plant, paths.truth, request.safety_io) as session:
            run = Commissioning(session, out, paths, request.plan).run(
                request.bandwidth_Hz, request.index
            )
        write(paths.run, to_json(run, indent=1))
        found = identify(winch, run["latency_s"], paths)
        results = assemble(paths, run, found, true_angle(paths.truth))
        build(paths, winch, results, found)
    summary.show(out, results)
    return results


def prepare(folder: Path, overwrite: bool) -> Paths:
    """Return the paths in `folder`; raises BadInputError where an earlier run would be lost."""
    paths = Paths(folder)
    raw = paths.raw_folder
    refuse_loss(folder, raw, overwrite)
    if folder.is_dir() and any(folder.iterdir()) and not raw.is_dir() and not overwrite:
        raise BadInputError(
            f"--out {folder}: holds other things; choose a new folder, or put a commissioning "
            "beside them with --overwrite"
        )
    if raw.is_dir() and any(raw.iterdir()):
        shutil.rmtree(raw)
        for path in (paths.run, paths.results, paths.page, paths.profile, paths.truth):
            path.unlink(missing_ok=True)
    with os_error_as(BadInputError, f"--out {folder}: cannot be created"):
        raw.mkdir(parents=True, exist_ok=True)
    return paths


def write(path: Path, text: str) -> None:
    """Write a small file; raises WorkFailedError naming it."""
    with os_error_as(WorkFailedError, f"{path}: cannot be written"):
        path.write_text(text + "\n", encoding="utf-8")
