"""`cdpr commission`: take motors from disabled drives to validated cogging profiles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.robot.commissioned import folder_of
from cdpr_drivers.robot.robot_buses import require_fit, robot_urls, starts_own_simulator
from cdpr_profiles import Robot, RobotAxis, Winch, load_winch_or_robot
from cdpr_rt.identification.commissioning_results import Paths
from cdpr_tools.commands import options
from cdpr_tools.commands.options import option
from cdpr_tools.commission.commissioning import DEFAULT_BANDWIDTH_HZ, QUICK, THOROUGH, Index
from cdpr_tools.commission.run import Request, commission_winch, prepare
from cdpr_tools.composition.session import confirm_motion, open_bus, simulator_of
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output

IndexOption = Annotated[
    Index,
    option(
        "Find the encoder index by homing, or by touch probe during a normal motion.", "--index"
    ),
]

_TURNS = "turns the motor for about 20 minutes"


app = typer.Typer()


@dataclass(frozen=True)
class _MotorOfRobot:
    """The motor of one axis, as a single winch, and the paths of its files."""

    axis: RobotAxis
    winch: Winch
    paths: Paths


def chosen_axes(
    robot: Robot, names: Sequence[str], every: bool, folder: Path
) -> tuple[_MotorOfRobot, ...]:
    """Return the motors of the axes called `names`, or of all; files go into `folder`.

    Raises BadInputError for an unknown name, and unless either `names` or `every` is given.
    """
    known = {axis.name: axis for axis in robot.axes}
    allowed = ", ".join(repr(name) for name in known)
    if every == bool(names):
        raise BadInputError(f"{robot.name}: give either --axis NAME ({allowed}) or --all")
    for name in names:
        if name not in known:
            raise BadInputError(f"--axis {name}: not an axis of {robot.name}; allowed: {allowed}")
    chosen = list(known.values()) if every else [known[name] for name in dict.fromkeys(names)]
    return tuple(_motor(robot, axis, folder) for axis in chosen)


def _motor(robot: Robot, axis: RobotAxis, folder: Path) -> _MotorOfRobot:
    winch = replace(axis.winch, name=f"{robot.name}, axis {axis.name}")
    return _MotorOfRobot(axis, winch, Paths(folder / folder_of(axis)))


@contextmanager
def _detached_motors(
    robot: Robot,
    buses: Sequence[str],
    motors: Sequence[_MotorOfRobot],
    out: Output,
    plant: Path | None,
) -> Iterator[list[BusUrl]]:
    """Yield the bus of each of `motors`; `simbus:` without a name starts drives without cables.

    Raises ConfigurationError for a robot that does not fit its buses, and for unknown buses.
    """
    require_fit(robot)
    with ExitStack() as stack:
        if starts_own_simulator(buses):
            out.note(f"starting simulated drives without cables: {len(robot.axes)} ...")
            buses = [simulator_of(stack, robot, plant, detached=True)]
        elif plant is not None:
            raise BadInputError("--plant: only for a simulator that the command starts (simbus:)")
        urls = robot_urls(robot, buses)
        yield [urls[motor.axis.bus] for motor in motors]


def _lines_for_robot(robot: Robot, motors: Sequence[_MotorOfRobot]) -> list[str]:
    """Return lines of text that show how the robot's file refers to the new profiles."""
    folder = motors[0].paths.out.parent
    lines = [f"to compensate them: cdpr run {robot.reference} --commissioned {folder}"]
    lines.append("or in the robot's file, under [[axes]]:")
    lines += [f'  {m.axis.name}: commissioned = "{m.paths.out.absolute()}"' for m in motors]
    return lines


@app.command()
def commission(
    machine: options.RobotOrWinchArgument,
    bus: Annotated[
        list[str] | None,
        option(
            "simbus: (starts simulated drives), simbus:NAME, socketcan:can0, ...; "
            "for a robot also BUS=URL; default: the URLs in its file.",
            "--bus",
            metavar="URL",
        ),
    ] = None,
    axis: Annotated[
        list[str] | None, option("For a robot: the axis whose motor is measured; may be repeated.")
    ] = None,
    every: Annotated[
        bool, option("For a robot: measure all motors, one after the other.", "--all")
    ] = False,
    plant: options.PlantOption = None,
    out_dir: Annotated[
        Path | None,
        option(
            "Folder for raw data, profile and report, with a subfolder for each axis of a "
            "robot; default out/commission-NAME.",
            "--out",
        ),
    ] = None,
    bandwidth_Hz: Annotated[
        float, option("Closed-loop bandwidth of the PID.", "--bandwidth-hz", min=1.0, max=100.0)
    ] = DEFAULT_BANDWIDTH_HZ,
    overwrite: options.OverwriteOption = False,
    quick: Annotated[bool, option("A rough result in a fifth of the time.", "--quick")] = False,
    index: IndexOption = "homing",
    safety_io: options.SafetyIoOption = None,
    yes: options.YesOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Measure, identify, validate and report motors, each detached from its load."""
    out = Output(as_json)
    profile = load_winch_or_robot(machine)
    folder = out_dir or Path("out") / f"commission-{profile.profile}"
    request = Request(QUICK if quick else THOROUGH, bandwidth_Hz, index, safety_io)
    if isinstance(profile, Robot):
        motors = chosen_axes(profile, axis or (), every, folder)
        for motor in motors:
            prepare(motor.paths.out, overwrite)
        with _detached_motors(profile, bus or (), motors, out, plant) as urls:
            _ask(motors, urls, yes)
            out.result(_commission_robot(profile, motors, urls, request, out))
        return
    if axis or every:
        raise BadInputError("--axis, --all: for a robot; a winch has one motor")
    url = open_bus(_only(bus))
    paths = prepare(folder, overwrite)
    confirm_motion(url, yes, f"commissioning {_TURNS}")
    out.result(commission_winch(profile, url, paths, request, out, plant))


def _only(buses: Sequence[str] | None) -> str:
    if not buses or len(buses) > 1:
        raise BadInputError("--bus: give one URL for a winch, such as simbus: or socketcan:can0")
    return buses[0]


def _ask(motors: Sequence[_MotorOfRobot], urls: Sequence[BusUrl], yes: bool) -> None:
    for motor, url in zip(motors, urls, strict=True):
        what = f"commissioning axis {motor.axis.name} {_TURNS}: take its cable off the drum first"
        confirm_motion(url, yes, what)


def _commission_robot(
    robot: Robot,
    motors: Sequence[_MotorOfRobot],
    urls: Sequence[BusUrl],
    request: Request,
    out: Output,
) -> dict[str, Any]:
    """Commission one motor after the other; return the result of the command."""
    results = {}
    for motor, url in zip(motors, urls, strict=True):
        out.say(f"axis {motor.axis.name}, node {motor.axis.node_id} on {url}")
        results[motor.axis.name] = commission_winch(motor.winch, url, motor.paths, request, out)
    out.say(*_lines_for_robot(robot, motors))
    folder = motors[0].paths.out.parent
    return {"ok": True, "robot": robot.reference, "commissioned": str(folder), "axes": results}
