"""`cdpr teleop`: move a robot by hand through its daemon; and the teleoperation experiment."""

from __future__ import annotations

import os
from dataclasses import fields, replace
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from cdpr_drivers.errors import ConfigurationError
from cdpr_profiles import load_robot
from cdpr_tools.command_group import ROBOT_VARIABLE
from cdpr_tools.commands import options
from cdpr_tools.commands.options import argument, option
from cdpr_tools.errors import BadInputError, CommandError
from cdpr_tools.output import Output
from cdpr_tools.teleop.gamepad import EvdevFinder, Gamepad, stick_map
from cdpr_tools.teleop.input_device import Directions, InputDevice, parse_scale
from cdpr_tools.teleop.keyboard import Keyboard
from cdpr_tools.teleop.script import ScriptDevice, read_script

if TYPE_CHECKING:
    from cdpr_tools.teleop.experiment_operator import OperatorParameters
    from cdpr_tools.teleop.experiment_trial import ExperimentSettings


_LEAD = "robot"


class _RobotOrCommand(TyperGroup):
    """Reads `cdpr teleop planar-3` as `cdpr teleop robot planar-3`, also before `--help`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the command `robot` if no command is named."""
        if args and args[0] not in self.commands:
            args = [_LEAD, *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    name="teleop",
    cls=_RobotOrCommand,
    help="Move a robot by keyboard, gamepad or script.",
    no_args_is_help=True,
)


class Device(StrEnum):
    """The input device."""

    GAMEPAD = "gamepad"
    KEYBOARD = "keyboard"
    SCRIPT = "script"


@app.command(_LEAD)
def robot(
    robot: Annotated[
        str, argument("Robot whose daemon is running.", metavar="ROBOT", envvar=ROBOT_VARIABLE)
    ],
    device: Annotated[Device, option("Input device.", "--device")] = Device.KEYBOARD,
    scale: Annotated[
        str,
        option(
            "Robot motion divided by hand motion, as a ratio or a number.", metavar="ROBOT:HAND"
        ),
    ] = "1:1",
    script: Annotated[
        Path | None,
        option(
            "For --device script; each line: SECONDS X_MM Y_MM, then optionally z=MM, "
            "turn=RX,RY,RZ (deg), clutch, confirm.",
            metavar="FILE",
        ),
    ] = None,
    via: Annotated[
        str | None,
        option(
            "Send the stream to this address instead, for example a tunnel or proxy.",
            metavar="HOST:PORT",
        ),
    ] = None,
    input_path: Annotated[
        Path | None,
        option("The gamepad's device node; default: the first suitable one.", "--input"),
    ] = None,
    axes: Annotated[
        str | None,
        option(
            "Axes that move the platform; - reverses one. Default: left stick, directional pad.",
            metavar="X,Y[,Z]",
        ),
    ] = None,
    turn_axes: Annotated[
        str | None,
        option(
            "Axes that turn the platform. Default: right stick, directional pad.",
            metavar="AXIS[,...]",
        ),
    ] = None,
    dead_man: Annotated[str, option("Button to hold while the stick moves the robot.")] = "BTN_TR",
    confirm: Annotated[str, option("Button that confirms a target.")] = "BTN_SOUTH",
    dead_zone: Annotated[
        float, option("Dead zone of the stick, as a share of its travel.", min=0.0, max=0.9)
    ] = 0.1,
    hand_speed: Annotated[
        float, option("Hand speed at full deflection, mm/s.", min=0.1, max=1000.0)
    ] = 50.0,
    socket: options.SocketOption = None,
    url: options.UrlOption = None,
    key_file: options.KeyFileOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Move a robot that has power by hand, through its daemon's set-point stream.

    The robot follows while this command runs, and holds when it ends for any reason.

    `cdpr teleop experiment` lets a simulated operator do this; see `cdpr teleop experiment --help`.
    """
    from cdpr_tools.teleop.teleoperation import TeleopSettings, teleoperate  # noqa: PLC0415  # slow to load

    factor = parse_scale(scale)
    lines = () if script is None else read_script(script, factor)
    if (device is Device.SCRIPT) != (script is not None):
        raise BadInputError("--script: required with --device script, and allowed only there")
    of_gamepad = (("--input", input_path), ("--axes", axes), ("--turn-axes", turn_axes))
    for name, given in of_gamepad if device is not Device.GAMEPAD else ():
        if given is not None:
            raise BadInputError(f"{name} {given}: allowed only with --device gamepad")

    def open_device(directions: Directions) -> InputDevice:
        """Open the device; called after everything else has been checked."""
        if device is Device.SCRIPT:
            return ScriptDevice(lines)
        if device is Device.KEYBOARD:
            return Keyboard(factor, directions=directions)
        used = stick_map(
            directions, axes, turn_axes, dead_man, confirm, dead_zone, 1e-3 * hand_speed
        )
        return Gamepad(EvdevFinder(input_path, used), used, factor)

    teleoperate(
        TeleopSettings(robot, open_device, factor, via, socket, url, key_file), Output(as_json)
    )


_LONGEST_ROUND_TRIP_ms = 10_000


@app.command()
def experiment(
    robot: options.RobotArgument = "planar-3",
    plant: options.RobotPlantOption = None,
    commissioned: options.CommissionedOption = None,
    without_compensation: Annotated[
        bool, option("Do not use commissioning results.", "--without-compensation")
    ] = False,
    places: Annotated[str, option("Places of the pattern.")] = "A,B,C",
    scales: Annotated[str, option("Scales, robot to hand.")] = "8:1,4:1,2:1",
    round_trips: Annotated[str, option("Round-trip delays, ms.")] = "0,350,730",
    repeats: Annotated[int, option("Runs of each condition.", min=1, max=100)] = 2,
    without_clutch: Annotated[
        bool, option("As in the thesis: no clutch.", "--without-clutch")
    ] = False,
    unsteadied: Annotated[
        bool, option("As in the thesis: send tremor unfiltered.", "--unsteadied")
    ] = False,
    operator: Annotated[
        list[str] | None,
        option("Set a parameter of the operator model; may be repeated.", metavar="NAME=VALUE"),
    ] = None,
    perfect_robot: Annotated[
        bool, option("Simulate the operator with an ideal robot.", "--perfect-robot")
    ] = False,
    seed: options.SeedOption = 1,
    jobs: Annotated[
        int | None, option("Sessions in parallel; one for each core by default.", min=1)
    ] = None,
    out_dir: Annotated[
        Path | None,
        option("Folder for all data; continues an interrupted experiment.", "--out", metavar="DIR"),
    ] = None,
    again: options.AgainOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Let a simulated operator move a simulated robot along the thesis' path; evaluate the errors.

    By default 54 runs: 10 targets at three places, three scales and three delays, each repeated.
    The robot runs over the simulated bus, the operator over the daemon's stream, and both are
    recorded. The command prints tables 2.1 and 2.2 beside the thesis' and draws figures 2.10 to
    2.12.
    """
    from cdpr_tools.teleop import experiment as experiments  # noqa: PLC0415  # slow to load
    from cdpr_tools.teleop.experiment_operator import OperatorParameters, Station  # noqa: PLC0415
    from cdpr_tools.teleop.experiment_trial import ExperimentSettings  # noqa: PLC0415

    out = Output(as_json)
    cores = jobs or len(os.sched_getaffinity(0))
    if again and out_dir is None:
        raise BadInputError("--again: needs --out, the folder of an experiment")
    if again and out_dir is not None:
        _show(out, experiments.judge(out_dir, cores), out_dir)
        return
    for path, name in ((plant, "--plant"), (commissioned, "--commissioned")):
        if path is not None and not path.exists():
            raise BadInputError(f"{name} {path}: no such file or folder")
    settings = ExperimentSettings(
        robot=load_robot(robot).reference,
        plant=None if plant is None else str(plant.resolve()),
        commissioned=None if commissioned is None else str(commissioned.resolve()),
        compensated=not without_compensation,
        seed=seed,
        operator=_operator(OperatorParameters(), operator or []),
        station=Station(clutch=not without_clutch, steady=not unsteadied),
        places=tuple(places.split(",")),
        scales=tuple(parse_scale(scale) for scale in scales.split(",")),
        round_trips_s=tuple(_round_trip_s(text) for text in round_trips.split(",")),
        repeats=repeats,
    )
    if perfect_robot:
        _show(out, experiments.operator_alone(settings), None)
        return
    _run(out, settings, out_dir or _new_folder(settings), cores)


def _run(out: Output, settings: ExperimentSettings, folder: Path, jobs: int) -> None:
    from cdpr_tools.teleop import experiment as experiments  # noqa: PLC0415  # slow to load

    experiments.begin(settings, folder)
    try:
        experiments.perform(settings, folder, jobs, out)
    except KeyboardInterrupt:
        out.note(f"interrupted; the same command with --out {folder} continues")
        raise
    except (CommandError, ConfigurationError) as error:
        raise type(error)(f"{error}; the same command with --out {folder} continues") from error
    _show(out, experiments.judge(folder, jobs), folder)


def _show(out: Output, result: dict[str, Any], folder: Path | None) -> None:
    out.say(*result.pop("lines"))
    if folder is not None:
        out.say("")
        out.say(f"recordings, result.json and pictures: {folder}")
    out.result(result)


def _new_folder(settings: ExperimentSettings) -> Path:
    moment = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    return Path("out") / f"experiment-{Path(settings.robot).stem}-{moment}"


def _round_trip_s(text: str) -> float:
    try:
        milliseconds = float(text)
    except ValueError:
        milliseconds = -1.0
    if not 0.0 <= milliseconds <= _LONGEST_ROUND_TRIP_ms:
        raise BadInputError(
            f"--round-trips {text}: allowed: 0 to {_LONGEST_ROUND_TRIP_ms} ms, commas between"
        )
    return milliseconds / 1e3


def _operator(parameters: OperatorParameters, changes: list[str]) -> OperatorParameters:
    names = [field.name for field in fields(parameters)]
    for change in changes:
        name, _, text = change.partition("=")
        if name not in names:
            raise BadInputError(f"--operator {change}: allowed: NAME=VALUE, {', '.join(names)}")
        try:
            value = float(text)
        except ValueError:
            value = -1.0
        if not 0.0 < value < float("inf"):
            raise BadInputError(f"--operator {change}: allowed: a number above 0")
        present = getattr(parameters, name)
        parameters = replace(parameters, **{name: type(present)(value)})
    return parameters
