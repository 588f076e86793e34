"""`cdpr path`: preview a path, follow it, and resume it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_profiles import Robot
from cdpr_profiles.calibration.in_force import load_calibrated
from cdpr_profiles.errors import ProfileError
from cdpr_tools.commands.options import (
    JsonOption,
    KeyFileOption,
    SocketOption,
    UrlOption,
    written_as,
)
from cdpr_tools.errors import BadInputError, CommandError, os_error_as
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def path(
    file: Annotated[
        Path | None,
        typer.Argument(
            help="Way points (.toml, .csv) or G-code (.nc, .ngc, .gcode, .tap, .cnc).",
            metavar="[FILE]",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            help="Robot profile, a name or a file, or the name of a daemon's robot; with --run, "
            "--resume and --back which daemon's, where several run.",
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--png",
            "--picture",
            metavar="FILE",
            help="Draw it into NAME.png.",
            callback=written_as(".png"),
        ),
    ] = None,
    origin: Annotated[
        str | None,
        typer.Option(
            metavar="'X Y Z'",
            help="Where G-code's zero is in the room, in mm; 'X Y Z G55 X Y Z' for two.",
        ),
    ] = None,
    blend: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1000.0,
            help="Tolerance, mm, for cutting G-code's corners where it has no G61 or G64 P.",
        ),
    ] = 1.0,
    ignore: Annotated[
        str,
        typer.Option(
            metavar="'U M777 ...'",
            help="Letters of G-code that are dropped, M codes whose lines are skipped.",
        ),
    ] = "",
    z: Annotated[
        float | None, typer.Option(min=-1e6, max=1e6, help="Z, mm, of G-code that names none.")
    ] = None,
    scale: Annotated[
        float, typer.Option(min=1e-3, max=1e3, help="Factor of G-code's lengths, not of F.")
    ] = 1.0,
    rotate: Annotated[
        float, typer.Option(min=-360.0, max=360.0, help="Turn G-code around Z, degrees.")
    ] = 0.0,
    mirror: Annotated[
        str, typer.Option(metavar="x|y", help="Change the sign of G-code's X or Y.")
    ] = "",
    dwell: Annotated[str, typer.Option(metavar="s|ms", help="Unit of P of G-code's G4.")] = "s",
    line: Annotated[
        int, typer.Option(min=0, help="Begin with this line of the file, from where it begins.")
    ] = 0,
    run: Annotated[
        bool, typer.Option("--run", help="Follow it on the running daemon; Ctrl-C holds on it.")
    ] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Take up the path that was left, where it was left.")
    ] = False,
    back: Annotated[
        float | None,
        typer.Option(min=0.1, help="Step back by so many mm along the path that was left."),
    ] = None,
    feed: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            max=100.0,
            help="Percent of the planned speed: 100, or what it was left with.",
        ),
    ] = None,
    keep: Annotated[
        bool, typer.Option("--keep", help="Leave the plan to the robot's daemon, by a name.")
    ] = False,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Preview, run and resume paths from G-code or way points.

    Exit with status 2 if the robot cannot follow the path, and report the first problem. With
    --run the running daemon plans and follows the path.
    """  # fmt: skip
    from cdpr_tools.client import path_following as following  # noqa: PLC0415  # slow to load
    from cdpr_tools.client.client import open_daemon  # noqa: PLC0415  # slow to load
    from cdpr_tools.paths.options import PathOptions  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    options = PathOptions(origin, blend, ignore, z, scale, rotate, mirror, dwell, line)
    if hint := options.metres_hint():
        out.note(hint)
    follows = run or resume or back is not None
    share = None if feed is None else 0.01 * feed
    if sum((run, resume, back is not None)) > 1:
        raise BadInputError("--run, --resume, --back: allowed: one of them")
    looks = ["--png"] * (picture is not None) + ["--keep"] * keep
    if follows and looks:
        raise BadInputError(f"{', '.join(looks)}: allowed: without --run, --resume and --back")
    if (file is None) != (resume or back is not None):
        raise BadInputError(
            "FILE: allowed: a path's file, or none with --resume and --back, which go on with "
            "the path that was left"
        )
    if follows:
        opened = open_daemon(robot, socket, url, key_file)
        if file is not None:
            following.follow(opened, out, file, options, share)
        else:
            following.resume_path(opened, out, back, share)
        return
    assert file is not None  # see above
    if robot is None:
        raise BadInputError("--robot: missing; allowed: a robot's name or file, or --run")
    _preview(robot_by_name(robot), file, options, out, picture, keep)


def robot_by_name(name: str) -> Robot:
    """Return the robot of a profile's name or file, else that of a daemon of this name.

    Raises ProfileError.
    """
    from cdpr_tools.client.client import open_daemon  # noqa: PLC0415  # slow to load

    try:
        return load_calibrated(name)
    except ProfileError:
        if Path(name).suffix == ".toml":
            raise
        with suppress(CommandError, KeyError), open_daemon(name, None, None, None) as daemon:
            return load_calibrated(str(daemon.get("/description")["reference"]))
        raise


def _preview(
    robot: Robot, file: Path, options: Any, out: Output, picture: Path | None, keep: bool
) -> None:
    from cdpr_tools.paths import preview as previews  # noqa: PLC0415  # slow to load

    with out.progress("planning", 10.0) as advance:
        shown = previews.preview(robot, file, options, lambda _, part: advance(10.0 * part))
    preview_figures = previews.figures(shown)
    out.say(*previews.lines(shown, robot, preview_figures))
    if picture is not None:
        from cdpr_tools.paths.preview import draw_path  # noqa: PLC0415  # slow to load

        with os_error_as(BadInputError, f"--png {picture}"):
            draw_path(shown, robot, picture)
        out.say(f"picture: {picture}")
    if wrong := previews.obstacle_text(shown):
        raise BadInputError(wrong)
    if keep:
        preview_figures["plan"] = previews.keep(shown, robot)
    out.result({"ok": True, **preview_figures})
