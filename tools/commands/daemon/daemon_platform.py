"""`cdpr tighten|lower|pause|resume`: a platform from its stand into motion, and back onto it."""

from __future__ import annotations

import math
import re
from enum import StrEnum
from typing import Annotated, Any

import typer

from cdpr_tools.client.client import Daemon
from cdpr_tools.client.motion import await_end, finish
from cdpr_tools.commands.daemon.with_daemon import with_daemon
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.signals import HELD, stop_on_signals


class Source(StrEnum):
    """From what the cables' lengths follow."""

    HOME = "home"
    LAST = "last"
    LENGTHS = "lengths"


app = typer.Typer()


@app.command()
@with_daemon
def tighten(
    daemon: Daemon,
    out: Output,
    source: Annotated[
        Source | None,
        typer.Option(
            "--from",
            help="Lengths of the cables: the platform stands at home, those of the last stop, or "
            "those that the daemon knows; home where it knows none.",
        ),
    ] = None,
) -> None:
    """Take up the slack of a platform's cables and learn where it is; it is held then."""
    wanted = {} if source is None else {"from": source.value}
    typed = "tighten" if source is None else f"tighten --from {source.value}"
    try:
        _carry_out(daemon, out, "tighten", wanted)
    except (BadInputError, WorkFailedError) as error:
        told = str(error).replace("tighten: from:", f"{typed}:")
        raise type(error)(re.sub(r"\bfrom: (?=[a-z])", "--from ", told)) from None


@app.command()
@with_daemon
def lower(
    daemon: Daemon,
    out: Output,
    blind: Annotated[
        bool,
        typer.Option("--blind", help="Every winch just lets its cable out, wherever that leads."),
    ] = False,
) -> None:
    """Let the platform down onto its stand; the power stays on, the cables are loose."""
    wanted = {"blind": True} if blind else {}
    tight = (daemon.get("/status").get("program_progress") or {}).get("tight")
    where = "let down blind" if blind else "on its stand" if tight else "where it is"
    _carry_out(daemon, out, "lower", wanted, f"{where}, cables loose, power on")


@app.command()
@with_daemon
def pause(daemon: Daemon, out: Output) -> None:
    """Stop the platform and hold it there; `resume` goes on."""
    _require_platform(daemon, "pause")
    daemon.post("/hold")
    finish(daemon, out, stopped=False)


@app.command()
@with_daemon
def resume(daemon: Daemon, out: Output) -> None:
    """Go on to the position, or along the path, that was left when it was paused."""
    if (daemon.get("/status").get("program_progress") or {}).get("path"):
        from cdpr_tools.client.path_following import go_on  # noqa: PLC0415  # slow to load

        go_on(daemon, out)
        return
    _carry_out(daemon, out, "pose", {"resume": True})


def _require_platform(daemon: Daemon, what: str) -> None:
    programs = daemon.get("/description").get("programs", [])
    if "lower" not in programs:
        raise BadInputError(f"{what}: only for robots whose platform is moved as a whole")


def _carry_out(
    daemon: Daemon, out: Output, program: str, wanted: dict[str, Any], where: str = ""
) -> None:
    """Have a program run to its end, then hold; `where` are the words for its end."""
    _require_platform(daemon, program)
    with stop_on_signals(HELD) as stop_requested, daemon.control() as control:
        control.post("/program", {"program": program, "wanted": wanted})
        ended = await_end(control, program, stop_requested, math.inf, out)
        control.hold()
    finish(daemon, out, stop_requested(), ended, where)
