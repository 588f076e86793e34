"""`cdpr estop`: remove the power from a robot immediately."""

from __future__ import annotations

import os
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from cdpr_tools.command_group import ROBOT_VARIABLE
from cdpr_tools.commands.options import JsonOption, SocketOption, argument, option
from cdpr_tools.daemon.estop import EmergencyStop
from cdpr_tools.daemon.loop_file import LoopFile, find_loops
from cdpr_tools.daemon.paths import found_instead, short_name
from cdpr_tools.errors import FAILED, BadInputError, WorkFailedError
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def estop(
    robot: Annotated[
        str | None, argument("Which robot, if several daemons run.", metavar="[ROBOT]")
    ] = None,
    named: Annotated[str | None, option("The same as ROBOT.", "--robot")] = None,
    every: Annotated[bool, option("Every robot whose daemon is found.", "--all")] = False,
    socket: SocketOption = None,
    as_json: JsonOption = False,
) -> None:
    """Remove the power from a robot's drives immediately: no braking, no lowering.

    The command goes directly to the control loop's process, independent of the daemon's other
    processes, and waits until the drives report that they have no power. If they do not, the
    command says so and the exit status is 1. This is not an emergency stop in the sense of a safety
    standard; that requires a button in hardware.
    """
    out = Output(as_json)
    # first send all stops, then wait
    stops = [EmergencyStop(path) for path in _chosen((robot, named), every, socket)]
    outcomes = []
    for one in stops:
        with closing(one):
            outcome = one.outcome()
        outcomes.append(asdict(outcome))
        doubt = "" if outcome.confirmed else "NOT CONFIRMED: "
        out.say(f"{outcome.robot}: {doubt}{outcome.text}")
    confirmed = all(outcome["confirmed"] for outcome in outcomes)
    out.result({"ok": confirmed, "robots": outcomes})
    if not confirmed:
        raise typer.Exit(FAILED)


def _chosen(robots: tuple[str | None, ...], every: bool, socket: Path | None) -> list[Path]:
    """Return the files of the chosen loops; raises BadInputError, WorkFailedError."""
    named = {name for name in robots if name is not None}
    if len(named) + every + (socket is not None) > 1:
        given = [*sorted(named), *["--all"] * every, *["--socket"] * (socket is not None)]
        raise BadInputError(
            f"{', '.join(given)}: nothing was stopped; allowed: one robot, --all or --socket"
        )
    robot = named.pop() if named else None
    if socket is not None:
        return [LoopFile.beside(socket)]
    found = find_loops(robot)
    if not found:
        whose = "" if robot is None else f" for {robot}"
        others = found_instead(filter(_lives, find_loops(None)), "; --all stops it")
        raise WorkFailedError(f"no running loop was found{whose}: nothing was stopped{others}")
    if every or robot is not None or len(found) == 1:
        return found
    live = [path for path in found if _lives(path)]
    if usual := [path for path in live if path.stem == short_name(os.getenv(ROBOT_VARIABLE, ""))]:
        return usual
    if len(live) > 1:
        names = ", ".join(path.stem for path in live)
        raise BadInputError(f"{len(live)} daemons run: name one of {names}, or give --all")
    return live or found


def _lives(path: Path) -> bool:
    """Return whether the loop named in the file runs; True if unknown."""
    try:
        return LoopFile.read(path).runs()
    except WorkFailedError:
        return True
