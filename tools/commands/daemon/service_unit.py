"""`cdpr service-unit`: a systemd unit that runs a robot's daemon."""

from __future__ import annotations

import os
import pwd
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.main import get_command

from cdpr_drivers.robot.robot_buses import asks_for_own_simulator, robot_urls
from cdpr_profiles import load_robot
from cdpr_tools.commands.daemon import run
from cdpr_tools.daemon.unit import service_unit

_SOCKETS = Path("/run/cdpr-rt")
_ASIDE = ("robot", "yes", "as_json")
_OF_THE_SIMULATOR = "camera"
"""An option that the daemon's own processes do not know."""

_User = Annotated[
    str | None, typer.Option(help="Who runs it; by default you, or `cdpr` where that is root.")
]


app = typer.Typer()


@app.command(
    "service-unit",
    context_settings={"ignore_unknown_options": True, "allow_extra_args": True},
)
def print_unit(
    context: typer.Context,
    robot: Annotated[str, typer.Argument(metavar="ROBOT|WINCH", help="As for `cdpr run`.")],
    user: _User = None,
) -> None:
    """Print a systemd unit that runs the robot's daemon; takes the options of `cdpr run` as well.

    Paths in it become absolute. What is wrong with the robot or the options is said now, not by
    the service at its start.
    """
    profile = load_robot(robot)
    asked = _as_run_reads_them([robot, *context.args])
    if asked["unix"] is None:
        asked["unix"] = _SOCKETS / f"{profile.profile}.sock"
    apart = (*_ASIDE, _OF_THE_SIMULATOR)
    run.settings_for(profile, **{k: v for k, v in asked.items() if k not in apart})
    buses = asked["bus"] or []
    urls = [] if asks_for_own_simulator(buses) else list(robot_urls(profile, buses).values())
    typer.echo(service_unit(profile, urls, list(_words(asked)), user or _default_user()), nl=False)


def _default_user() -> str:
    return "cdpr" if os.geteuid() == 0 else pwd.getpwuid(os.geteuid()).pw_name


def _as_run_reads_them(arguments: list[str]) -> dict[str, Any]:
    with get_command(run.app).make_context("cdpr run", arguments) as context:
        return dict(context.params)


def _words(asked: dict[str, Any]) -> Iterator[str]:
    """Yield what was asked for as options again, its paths absolute."""
    for parameter in get_command(run.app).params:
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
    is_file = isinstance(value, Path) or (name == "safety_io" and Path(value).is_file())
    return str(Path(value).absolute()) if is_file else str(value)
