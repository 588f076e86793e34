"""`cdpr robot`: describe a cable robot, look at it, try it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from profiles import Robot, load_robot
from tools.commands import robot_trial
from tools.commands.options import JsonOption
from tools.errors import BAD_INPUT, BadInputError
from tools.output import Output
from tools.robots import checks, summary

app = typer.Typer(help="Describe a cable robot, look at it, try it.", no_args_is_help=True)

_Robot = Annotated[
    str, typer.Argument(help="Robot profile: a name or the path of a file.", metavar="ROBOT")
]
_Picture = Annotated[Path | None, typer.Option("--png", help="Draw it into this file.")]


def register(parent: typer.Typer) -> None:
    """Add the command group."""
    robot_trial.add(app)
    parent.add_typer(app, name="robot")


@app.callback()
def _group() -> None:
    """Describe a cable robot, look at it, try it."""


@app.command()
def show(robot: _Robot, png: _Picture = None, as_json: JsonOption = False) -> None:
    """Show a robot's platform, cables and workspace, and check whether it can work.

    Ends with status 2 where something about it is impossible.
    """
    out = Output(as_json)
    profile = load_robot(robot)
    platform = profile.platform
    if platform is None:
        raise BadInputError(
            f"{profile.path}: platform: this robot has none, its winches have nothing in common; "
            f"`cdpr profiles show` tells what else there is"
        )
    told = summary.figures(profile, platform)
    for line in summary.lines(profile, platform, told):
        out.say(line)
    if png is not None:
        _draw(profile, png, out)
    found = checks.findings(profile)
    out.say("")
    for finding in found:
        kind = "impossible" if finding.impossible else "mind"
        out.say(f"{kind}: {finding.key}: {finding.text}")
    if not found:
        out.say("nothing to object to" if "held_share" in told else _UNKNOWN)
    told["findings"] = [{"key": f.key, "text": f.text, "impossible": f.impossible} for f in found]
    possible = not any(finding.impossible for finding in found)
    out.result({"ok": possible, **told})
    if not possible:
        raise typer.Exit(BAD_INPUT)


_UNKNOWN = "not checked: tensions are known of planar robots with three cables only"


def _draw(profile: Robot, path: Path, out: Output) -> None:
    from tools.robots.picture import draw_robot  # noqa: PLC0415  # slow to load

    if profile.platform is None or not profile.platform.is_planar:
        raise BadInputError(f"--png: {profile.path} is no planar robot, the others are not drawn")
    try:
        draw_robot(profile, profile.platform, path)
    except OSError as error:
        raise BadInputError(f"--png {path}: {error.strerror}") from None
    out.say(f"\npicture: {path}")
