"""`cdpr jog|move|controller|tighten|lower|pause|resume`: motion by a daemon."""

from __future__ import annotations

import math
import time
from enum import StrEnum
from typing import Annotated, Any

import typer

from cdpr_tools.client.client import Daemon, axis_values, key_values
from cdpr_tools.client.motion import (
    RENEW_S,
    ProgressNotes,
    await_end,
    finish,
    is_done,
    require_program,
)
from cdpr_tools.client.platform_move import PlatformMove, ReferenceFrame, require_platform
from cdpr_tools.client.refusals import in_typed_words
from cdpr_tools.commands.daemon.with_daemon import with_daemon
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.number_options import numbers_command
from cdpr_tools.output import Output
from cdpr_tools.signals import HELD, stop_on_signals

_DEADMAN_S = 0.6
_STANDING = frozenset({"hold", "idle"})


app = typer.Typer()


@app.command()
@with_daemon
def jog(
    daemon: Daemon,
    out: Output,
    axes: Annotated[
        list[str], typer.Argument(help="Speeds in deg/s at the motor.", metavar="AXIS=SPEED...")
    ],
    seconds: Annotated[float, typer.Option(min=0.1, max=3600.0, help="Duration.")] = 1.0,
    cable: Annotated[
        bool, typer.Option("--cable", help="Speeds are mm/s of cable, positive pays out.")
    ] = False,
) -> None:
    """Turn axes at a speed for a while; they stop when this command does, however it ends."""
    n, speeds = _given(daemon, axes, "mm/s" if cable else "deg/s")
    factor = 1e-3 if cable else math.radians(1.0)
    values = [factor * speeds.get(axis, 0.0) for axis in range(n)]
    key = "cable_velocity_m_s" if cable else "velocity_rad_s"
    arguments = {key: values, "timeout_s": _DEADMAN_S, "duration_s": seconds}
    notes = ProgressNotes(out)
    with stop_on_signals(HELD) as stop_requested, daemon.control() as control:
        with in_typed_words("jog", axes=_names(daemon)):
            control.post("/program", {"program": "jog", "wanted": arguments})
        while not stop_requested():
            time.sleep(RENEW_S)
            progress = require_program(daemon, "jog").get("program_progress", {})
            notes("jog", progress)
            if is_done(progress):
                break
            control.post("/set", {"wanted": arguments})
        control.hold()
    finish(daemon, out, stop_requested())


@app.command(cls=numbers_command("--to", "--rotate"))
@with_daemon
def move(
    daemon: Daemon,
    out: Output,
    axes: Annotated[
        list[str] | None,
        typer.Argument(help="Angles in deg of the motor.", metavar="[AXIS=ANGLE]..."),
    ] = None,
    to: Annotated[
        str | None,
        typer.Option(metavar="X Y [Z]", help="The platform to this position, in mm."),
    ] = None,
    rotate: Annotated[
        str | None,
        typer.Option(
            metavar="RX RY RZ | ANGLE",
            help="The platform to this rotation vector from its orientation at home, in deg; an "
            "angle in a plane.",
        ),
    ] = None,
    relative: Annotated[
        bool, typer.Option("--relative", help="Relative to the present position.")
    ] = False,
    frame: Annotated[
        ReferenceFrame,
        typer.Option(help="With --relative: along and about whose axes the platform moves."),
    ] = ReferenceFrame.ROOM,
    cable: Annotated[
        bool, typer.Option("--cable", help="Relative, in mm of cable; positive pays out.")
    ] = False,
    speed: Annotated[
        float | None,
        typer.Option(
            min=0.01,
            help="Top speed: deg/s at the motor; mm/s of a platform, its rotation scaled alike.",
        ),
    ] = None,
) -> None:
    """Move axes or the platform to positions and wait; Ctrl-C holds and exits with 1."""
    if to is not None or rotate is not None:
        if axes or cable:
            given = ", ".join([*(axes or []), *["--cable"] * cable])
            text = f"--to, --rotate: not together with axes or --cable: {given}"
            if any("=" not in axis for axis in axes or []):
                text += "; allowed: numbers without a unit, of mm and deg"
            raise BadInputError(text)
        _move_platform(daemon, out, PlatformMove(to, rotate, relative, frame, speed))
        return
    if frame is not ReferenceFrame.ROOM:
        raise BadInputError(f"--frame {frame}: allowed: together with --to or --rotate")
    _run_to_end(daemon, out, "pid", _to_angles(daemon, axes or [], relative, cable, speed))


def _move_platform(daemon: Daemon, out: Output, move: PlatformMove) -> None:
    _run_to_end(daemon, out, "pose", move.arguments(daemon), move.typed)


def _run_to_end(
    daemon: Daemon, out: Output, program: str, arguments: dict[str, Any], typed: str = ""
) -> None:
    with stop_on_signals(HELD) as stop_requested, daemon.control() as control:
        with in_typed_words("move", typed, _names(daemon)):
            control.post("/program", {"program": program, "wanted": arguments})
        ended = await_end(control, program, stop_requested, math.inf, out)
        control.hold()
    finish(daemon, out, stop_requested(), ended, arrived=ended is not None)


def _names(daemon: Daemon) -> list[str]:
    return [str(axis["name"]) for axis in daemon.get("/status")["axes"]]


def _to_angles(
    daemon: Daemon, axes: list[str], relative: bool, cable: bool, speed: float | None
) -> dict[str, Any]:
    """Return what the program `pid` is to do; raises BadInputError."""
    if not axes:
        raise BadInputError(
            "nothing to move; allowed: AXIS=ANGLE..., or --to and --rotate for a platform"
        )
    if "pid" not in daemon.get("/description").get("programs", ["pid"]):
        raise BadInputError(
            f"{axes[0]}: the platform is moved as a whole; allowed: --to and --rotate, or "
            "`cdpr jog` for a single winch"
        )
    n, goals = _given(daemon, axes, "mm" if cable else "deg")
    factor = 1e-3 if cable else math.radians(1.0)
    key = "cable_m" if cable else "distance_rad" if relative else "position_rad"
    arguments: dict[str, Any] = {
        key: [factor * goals[axis] if axis in goals else None for axis in range(n)]
    }
    if speed is not None:
        arguments["speed_rad_s"] = math.radians(speed)
    return arguments


@app.command()
@with_daemon
def controller(
    daemon: Daemon,
    out: Output,
    name: Annotated[str, typer.Argument(help="Program: hold, idle, sweep, pid, ...")],
    values: Annotated[
        list[str] | None,
        typer.Argument(help="Arguments of the program, in JSON.", metavar="[KEY=VALUE]..."),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            min=0.1, help="End after this many seconds; at the program's own end otherwise."
        ),
    ] = None,
) -> None:
    """Change over to a program and stay with it until it is done; hold follows then.

    `hold` and `idle` run on when the command has ended.
    """
    arguments, ended = key_values(values or []), None
    with stop_on_signals(HELD) as stop_requested, daemon.control() as control:
        control.post("/program", {"program": name, "wanted": arguments})
        if name not in _STANDING:
            ended = await_end(control, name, stop_requested, seconds or math.inf, out)
            control.hold()
    finish(daemon, out, stop_requested(), ended)


def _given(daemon: Daemon, texts: list[str], unit: str) -> tuple[int, dict[int, float]]:
    """Return how many axes there are and the numbers given for some; raises BadInputError."""
    axes = daemon.get("/status")["axes"]
    values = axis_values(texts, axes, unit)
    for axis, value in values.items():
        if not math.isfinite(value):
            raise BadInputError(f"{axes[axis]['name']}={value:g}: allowed: a finite number")
    return len(axes), values


class LengthSource(StrEnum):
    """From what the cables' lengths follow."""

    HOME = "home"
    LAST = "last"
    LENGTHS = "lengths"


@app.command()
@with_daemon
def tighten(
    daemon: Daemon,
    out: Output,
    source: Annotated[
        LengthSource | None,
        typer.Option(
            "--from",
            help="From what the cables' lengths follow: the platform stands at home, they are "
            "those of the last stop, or the lengths that the daemon knows. By default what it "
            "knows, else home.",
        ),
    ] = None,
) -> None:
    """Take up the slack of a platform's cables and learn where it is; it is held then."""
    arguments = {} if source is None else {"from": source.value}
    typed = "tighten" if source is None else f"tighten --from {source.value}"
    with in_typed_words("tighten", typed, option="--from "):
        _carry_out(daemon, out, "tighten", arguments)


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
    arguments = {"blind": True} if blind else {}
    status = daemon.get("/status")
    if status["program"] == "lower" and status["control"]["held"]:
        raise WorkFailedError(
            f"lower: the platform is being let down already, by {status['control']['client']}; "
            "`cdpr status --watch` shows it"
        )
    tight = (status.get("program_progress") or {}).get("tight")
    where = "let down blind" if blind else "on its stand" if tight else "where it is"
    _carry_out(daemon, out, "lower", arguments, f"{where}, cables loose, power on")


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
    with in_typed_words("resume", instead="cdpr move --to"):
        _carry_out(daemon, out, "pose", {"resume": True})


def _require_platform(daemon: Daemon, what: str) -> None:
    require_platform(daemon.get("/description"), what)


def _carry_out(
    daemon: Daemon, out: Output, program: str, arguments: dict[str, Any], where: str = ""
) -> None:
    """Have a program run to its end, then hold; `where` are the words for its end."""
    _require_platform(daemon, program)
    with stop_on_signals(HELD) as stop_requested, daemon.control() as control:
        control.post("/program", {"program": program, "wanted": arguments})
        ended = await_end(control, program, stop_requested, math.inf, out)
        control.hold()
    finish(daemon, out, stop_requested(), ended, where)
