"""`cdpr service-unit`: a systemd unit that runs a robot's daemon."""

from __future__ import annotations

import os
import pwd
import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, cast

import typer
from typer.core import TyperGroup
from typer.main import get_command

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.robot.robot_buses import robot_urls, starts_own_simulator
from cdpr_profiles import Robot, load_robot
from cdpr_rt.model.robot_arrays import can_lower
from cdpr_rt.programs.lower import lowering_s
from cdpr_tools.commands import run
from cdpr_tools.commands.options import RobotOrWinchArgument, option
from cdpr_tools.composition.own_code import OwnCodeOptions
from cdpr_tools.errors import BadInputError
from cdpr_tools.rendering import rendered

_SOCKETS = Path("/run/cdpr-rt")
_ASIDE = ("open_it", "robot", "yes", "as_json", "exit_with_stdin")
_OWN_CODE = ("controller", "tension_distribution", "program")
_OF_THE_SIMULATOR = "camera"
"""Options that only the simulator of the command understands."""


app = typer.Typer()


@app.command(
    "service-unit",
    context_settings={"ignore_unknown_options": True, "allow_extra_args": True},
)
def print_unit(
    context: typer.Context,
    robot: RobotOrWinchArgument,
    user: Annotated[
        str | None, option("User that runs it; by default you, or `cdpr` if you are root.")
    ] = None,
) -> None:
    """Print a systemd unit that runs the robot's daemon.

    Paths in it become absolute. Errors in the robot or the options are reported now, not when the
    service starts.
    """
    profile = load_robot(robot)
    with _run_command().make_context("cdpr run", [robot, *context.args]) as read:
        asked = dict(read.params)
    if asked["allow_code"]:
        raise BadInputError(
            "--allow-code: a service must not allow code that changes later; start `cdpr run` once "
            "with this option, as the service's user"
        )
    if asked["unix"] is None:
        asked["unix"] = _SOCKETS / f"{profile.profile}.sock"
    apart = (*_ASIDE, _OF_THE_SIMULATOR, *_OWN_CODE)
    controller, tensions, programs = (asked[name] for name in _OWN_CODE)
    own = OwnCodeOptions(controller, tensions, tuple(programs or ()))
    run.settings_for(profile, own=own, **{k: v for k, v in asked.items() if k not in apart})
    buses = asked["bus"] or []
    urls = [] if starts_own_simulator(buses) else list(robot_urls(profile, buses).values())
    if user is None:
        user = "cdpr" if os.geteuid() == 0 else pwd.getpwuid(os.geteuid()).pw_name
    typer.echo(service_unit(profile, urls, list(_words(asked)), user), nl=False)


def _run_command() -> Any:
    """Return `cdpr run`, which reads its options."""
    return cast(TyperGroup, get_command(run.app)).commands["run"]


def _words(asked: dict[str, Any]) -> Iterator[str]:
    """Yield the given options as words of a command line, with absolute paths."""
    for parameter in _run_command().params:
        value = asked.get(parameter.name)
        if parameter.name in _ASIDE or value is None or value is False:
            continue
        option = parameter.opts[0]
        if value is True:
            yield option
            continue
        for one in value if isinstance(value, list | tuple) else [value]:
            yield from (option, _absolute(parameter.name, one))


def _absolute(name: str, value: Any) -> str:
    if name in _OWN_CODE and ".py:" in value:  # FILE.py:NAME
        return str(Path(value).absolute())
    is_file = isinstance(value, Path) or (name == "safety_io" and Path(value).is_file())
    return str(Path(value).absolute()) if is_file else str(value)


_STOP_S = 60.0
"""Time that the launcher needs to end the loop and the recording, without the time for lowering."""


def service_unit(robot: Robot, urls: Sequence[BusUrl], options: Sequence[str], user: str) -> str:
    """Return the text of a unit that runs `robot` on `urls` with `options` of `cdpr run`."""
    devices = [
        f"sys-subsystem-net-devices-{url.channel}.device"
        for url in urls
        if url.interface == "socketcan"
    ]
    lowers = robot.platform if can_lower(robot) else None
    words = [_program(), "run", robot.reference, "--yes", *options]
    return rendered(
        "service-unit.j2",
        robot=_one_line(robot.name),
        devices=devices,
        command=" ".join(_quoted(word) for word in words),
        user=user,
        stop_s=_STOP_S + (0.0 if lowers is None else lowering_s(lowers)),
    )


def _program() -> str:
    beside = Path(sys.executable).with_name("cdpr")
    return str(beside) if os.access(beside, os.X_OK) else shutil.which("cdpr") or str(beside)


def _one_line(text: str) -> str:
    return " ".join(text.split()).replace("%", "%%")


def _quoted(word: str) -> str:
    """Return a word of a command line, quoted for systemd (systemd.service(5), COMMAND LINES)."""
    word = word.replace("%", "%%").replace("$", "$$")
    if word and not set(word) & set(" \t\n\"'\\;"):
        return word
    escaped = word.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
