"""Options that several commands share, and the decorator that adds shared ones to a command."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_profiles.bounded_input import may_replace
from cdpr_tools.command_group import ROBOT_VARIABLE
from cdpr_tools.errors import BadInputError
from cdpr_tools.saving import OWN_MARK


def option(text: str, /, *names: str, **more: Any) -> Any:
    """Return the declaration of an option with this help; `names` if not the parameter's own."""
    return typer.Option(*names, help=text, **more)


def argument(text: str, /, **more: Any) -> Any:
    """Return the declaration of an argument with this help."""
    return typer.Argument(help=text, **more)


def shares(
    options: Callable[..., AbstractContextManager[tuple[Any, ...]]],
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator for typer commands that adds the parameters of `options` to their own.

    The command runs inside the context that `options` returns. The values that it yields are the
    command's first arguments; the command's own parameters are passed by keyword. Required
    parameters of `options` come before the command's own.
    """

    def parameters(function: Callable[..., Any]) -> list[Parameter]:
        declared = signature(function, eval_str=True).parameters.values()
        return [one.replace(kind=Parameter.KEYWORD_ONLY) for one in declared]

    shared = parameters(options)

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @wraps(command)
        def run(**given: Any) -> None:
            with options(**{one.name: given.pop(one.name) for one in shared}) as first:
                command(*first, **given)

        added = parameters(command)[2:]
        needed = [one for one in shared if one.default is Parameter.empty]
        signed = [*needed, *added, *(one for one in shared if one not in needed)]
        run.__signature__ = Signature(signed)  # type: ignore[attr-defined]
        run.__annotations__ = {one.name: one.annotation for one in signed}
        return run

    return decorate


def written_as(
    *endings: str, mark: bytes = OWN_MARK
) -> Callable[[typer.CallbackParam, Path | None], Path | None]:
    """Return the callback of an option for an output file whose name needs one of `endings`.

    Before the work begins, it raises BadInputError if the file cannot be written, or if it exists
    and does not begin with `mark`.
    """

    def checked(param: typer.CallbackParam, value: Path | None) -> Path | None:
        if value is None:
            return None
        typed = f"{param.opts[0]} {value}"
        if value.suffix.lower() not in endings:
            raise BadInputError(f"{typed}: allowed: a name that ends in {', '.join(endings)}")
        if value.is_dir() or not value.parent.is_dir() or not os.access(value.parent, os.W_OK):
            raise BadInputError(f"{typed}: allowed: a file in a folder that can be written to")
        if not may_replace(value, mark):
            raise BadInputError(
                f"{typed}: already exists and was not written by cdpr; choose another name"
            )
        return value

    return checked


PngOption = Annotated[
    Path | None,
    option("Draw the result into NAME.png.", "--png", metavar="FILE", callback=written_as(".png")),
]

RobotArgument = Annotated[
    str,
    argument(
        "Robot profile: a name or the path of a file.", metavar="ROBOT", envvar=ROBOT_VARIABLE
    ),
]
RobotPlantOption = Annotated[
    Path | None, option("Plant file: the truth about robot, cables and motors.")
]
SeedOption = Annotated[int, option("Random seed.", min=0)]
CommissionedOption = Annotated[
    Path | None, option("Folder with the results of `cdpr commission ROBOT`.", metavar="DIR")
]
AgainOption = Annotated[
    bool, option("Evaluate the data in --out again, without motion.", "--again")
]
WinchArgument = Annotated[
    str, argument("Winch profile: a name or the path of a file.", metavar="WINCH")
]
BusOption = Annotated[
    str,
    option(
        "simbus: (starts a simulated drive), simbus:NAME, socketcan:can0, ...",
        "--bus",
        metavar="URL",
    ),
]
PlantOption = Annotated[
    Path | None, option("Plant file for the simulated drive that `simbus:` starts.", "--plant")
]
JsonOption = Annotated[bool, option("End with one JSON line on standard output.", "--json")]
ControllerOption = Annotated[
    str | None,
    option(
        "Your own controller of the platform, or MODULE:CLASS. This runs the code there.",
        "--controller",
        "--control",
        metavar="FILE.py:CLASS",
    ),
]
TensionDistributionOption = Annotated[
    str | None,
    option(
        "Your own tension distribution, or MODULE:NAME. This runs the code there.",
        "--tension-distribution",
        metavar="FILE.py:NAME",
    ),
]
ProgramOption = Annotated[
    list[str] | None,
    option(
        "A program of your own, or MODULE:CLASS; repeatable. This runs the code there.",
        "--program",
        metavar="FILE.py:CLASS",
    ),
]
AllowCodeOption = Annotated[
    bool,
    option(
        "Trust the code that the robot's file names, and run it until it changes.", "--allow-code"
    ),
]
YesOption = Annotated[bool, option("Do not ask before a real motor is energised.", "--yes")]

SafetyIoOption = Annotated[
    str | None,
    option(
        "Safety I/O that must permit power: a name, a file, NAME@HOST:PORT.",
        "--safety-io",
        metavar="IO",
    ),
]

SensorsOption = Annotated[
    str | None,
    option(
        "Tension sensors, a name or a file: too high or unknown tension stops the motion.",
        "--sensors",
        metavar="SENSORS",
    ),
]
SensorsPortOption = Annotated[
    str | None, option("Serial port of the tension sensors' line.", "--tension-port")
]


def _or_usual(context: typer.Context, robot: str | None) -> str | None:
    """Return the robot of a daemon that is given as an option or named by the environment."""
    # a given option takes precedence, whatever the order
    if robot is None and not context.params.get("socket") and not context.params.get("url"):
        return os.environ.get(ROBOT_VARIABLE) or None
    return robot


RobotOption = Annotated[
    str | None,
    option(
        f"Which robot's daemon, if several run; {ROBOT_VARIABLE} is its default.",
        "--robot",
        callback=_or_usual,
    ),
]
SocketOption = Annotated[
    Path | None, option("The daemon's Unix socket, if not the default.", "--socket")
]
UrlOption = Annotated[
    str | None, option("URL of a daemon on another machine.", "--url", metavar="http://HOST:PORT")
]
KeyFileOption = Annotated[Path | None, option("File with the key for --url.", "--key-file")]
ClusterOption = Annotated[
    str | None, option("Compute on this Ray cluster.", "--cluster", metavar="ADDRESS")
]
HandEyeOption = Annotated[
    Path | None,
    option(
        "Measured place of the camera on the platform; default: found from the platform's "
        "rotations.",
        "--hand-eye",
        metavar="FILE",
    ),
]
OverwriteOption = Annotated[bool, option("Replace files that are already in --out.", "--overwrite")]
ExitWithStdinOption = Annotated[
    bool, option("Stop when standard input, a pipe, ends.", "--exit-with-stdin")
]
RobotOrWinchArgument = Annotated[
    str,
    argument(
        "Robot or winch profile: a name or the path of a file.",
        metavar="ROBOT|WINCH",
        envvar=ROBOT_VARIABLE,
    ),
]
RecordedWinchOption = Annotated[
    str | None, option("Winch profile; default: the recorded one.", "--winch")
]
RobotBusOption = Annotated[
    list[str] | None,
    option(
        "simbus: (starts a simulator), simbus:NAME, or BUS=URL once for each bus.",
        "--bus",
        metavar="URL",
    ),
]
