"""`cdpr path show|run|resume|back`: check a path, follow it, resume it, and step back along it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
from typer.core import TyperGroup
from typing_extensions import override

from cdpr_profiles import Robot
from cdpr_profiles.calibration_in_force import load_calibrated
from cdpr_profiles.errors import ProfileError
from cdpr_tools.client.client import Daemon, await_start, open_daemon
from cdpr_tools.command_group import ROBOT_VARIABLE
from cdpr_tools.commands.options import (
    JsonOption,
    KeyFileOption,
    RobotOption,
    SocketOption,
    UrlOption,
    argument,
    option,
    shares,
    written_as,
)
from cdpr_tools.commands.with_daemon import with_daemon
from cdpr_tools.errors import BadInputError, CommandError, os_error_as
from cdpr_tools.output import Output

if TYPE_CHECKING:
    from cdpr_tools.robots.path_options import PathOptions


class _Verbs(TyperGroup):
    """Commands on paths; a file without a command is rejected with the commands."""

    @override
    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Reject a command that is typed as an option, and a file without a command."""
        first = args[0] if args else ""
        if (verb := first.removeprefix("--")) != first and verb in self.commands:
            ctx.fail(
                f"{first}: commands have no dashes: `{' '.join(['cdpr path', verb, *args[1:]])}`"
            )
        if Path(first).suffix:
            verbs = [word[2:] for word in args if word[:2] == "--" and word[2:] in self.commands]
            lines = [f"`cdpr path {verb} {first}`" for verb in verbs or ("show", "run")]
            ctx.fail(f"{first}: name a command first: {' or '.join(lines)}")
        return super().parse_args(ctx, args)


app = typer.Typer(
    name="path",
    cls=_Verbs,
    help="Check, run and resume paths from G-code or way points.",
    no_args_is_help=True,
)


class PathFile(NamedTuple):
    """A path as typed."""

    file: Path
    options: PathOptions


@shares
@contextmanager
def _with_path(
    file: Annotated[
        Path, argument("Way points (.toml, .csv) or G-code (.nc, .ngc, .gcode, .tap, .cnc).")
    ],
    origin: Annotated[
        str | None,
        option(
            "Position of G-code's zero in the room, in mm; 'X Y Z G55 X Y Z' for two zeros.",
            metavar="'X Y Z'",
        ),
    ] = None,
    blend: Annotated[
        float,
        option(
            "Tolerance in mm for cutting corners of G-code without G61 or G64 P.",
            min=0.0,
            max=1000.0,
        ),
    ] = 1.0,
    ignore: Annotated[
        str,
        option(
            "G-code letters to drop, and M codes and macros whose lines are skipped.",
            metavar="'U M777 ...'",
        ),
    ] = "",
    z: Annotated[float | None, option("Z in mm, for G-code without Z.", min=-1e6, max=1e6)] = None,
    scale: Annotated[
        float, option("Scale factor of G-code's lengths, but not of F.", min=1e-3, max=1e3)
    ] = 1.0,
    rotate: Annotated[float, option("Turn G-code around Z, degrees.", min=-360.0, max=360.0)] = 0.0,
    mirror: Annotated[str, option("Change the sign of G-code's X or Y.", metavar="x|y")] = "",
    dwell: Annotated[str, option("Unit of P of G-code's G4.", metavar="s|ms")] = "s",
    line: Annotated[
        int, option("Begin with this line of the file, at its start position.", min=0)
    ] = 0,
    as_json: JsonOption = False,
) -> Iterator[tuple[PathFile, Output]]:
    """Pass the path that these options describe, and the output, to a command."""
    from cdpr_tools.robots.path_options import PathOptions  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    options = PathOptions(origin, blend, ignore, z, scale, rotate, mirror, dwell, line)
    if hint := options.metres_hint():
        out.note(hint)
    yield PathFile(file, options), out


FeedOption = Annotated[
    float | None,
    option(
        "Percent of the planned speed; default: 100, or the previous value if a path is resumed.",
        min=1.0,
        max=100.0,
    ),
]


@app.command()
@_with_path
def show(
    path: PathFile,
    out: Output,
    robot: Annotated[
        str,
        option(
            "Robot profile, a name or a file, or the name of a daemon's robot; "
            f"{ROBOT_VARIABLE} is its default.",
            "--robot",
            envvar=ROBOT_VARIABLE,
        ),
    ],
    picture: Annotated[
        Path | None,
        option(
            "Draw the path into NAME.png.",
            "--png",
            "--picture",
            metavar="FILE",
            callback=written_as(".png"),
        ),
    ] = None,
    keep: Annotated[
        bool, option("Store the plan for the robot's daemon, under its name.", "--keep")
    ] = False,
) -> None:
    """Plan a path and show its duration, tensions and first problem; nothing moves.

    Exit with status 2 if the robot cannot follow the path.
    """
    _preview(robot_by_name(robot), path, out, picture, keep)


@app.command()
@_with_path
def run(
    path: PathFile,
    out: Output,
    feed: FeedOption = None,
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Let the running daemon plan a path and follow it to its end.

    Ctrl-C holds the platform on the path. Exit with status 2 if the robot cannot follow the path.
    """
    from cdpr_tools.client.path_following import follow  # noqa: PLC0415  # slow to load

    path.options.require_use(path.file)
    with open_daemon(robot, socket, url, key_file) as daemon:
        await_start(daemon, out)
        follow(daemon, out, path.file, path.options, _share(feed))


@app.command()
@with_daemon
def resume(daemon: Daemon, out: Output, feed: FeedOption = None) -> None:
    """Continue an interrupted path from where it stopped."""
    from cdpr_tools.client.path_following import resume_path  # noqa: PLC0415  # slow to load

    resume_path(daemon, out, _share(feed))


@app.command()
@with_daemon
def back(
    daemon: Daemon,
    out: Output,
    distance: Annotated[float, argument("How far, in mm along the path.", min=0.1, metavar="MM")],
    feed: FeedOption = None,
) -> None:
    """Go back a step along an interrupted path, and hold there."""
    from cdpr_tools.client.path_following import resume_path  # noqa: PLC0415  # slow to load

    resume_path(daemon, out, _share(feed), distance)


def _share(percent: float | None) -> float | None:
    return None if percent is None else 0.01 * percent


def robot_by_name(name: str) -> Robot:
    """Return the robot of a profile's name or file, else that of a daemon of this name.

    Raises ProfileError.
    """
    try:
        return load_calibrated(name)
    except ProfileError:
        if Path(name).suffix == ".toml":
            raise
        with suppress(CommandError, KeyError), open_daemon(name, None, None, None) as daemon:
            return load_calibrated(str(daemon.get("/description")["reference"]))
        raise


def _preview(robot: Robot, path: PathFile, out: Output, picture: Path | None, keep: bool) -> None:
    from cdpr_tools.robots import path_preview as previews  # noqa: PLC0415  # slow to load

    with out.progress("planning", 10.0) as advance:
        shown = previews.preview(robot, *path, lambda _, part: advance(10.0 * part))
    preview_figures = previews.figures(shown)
    out.say(*previews.lines(shown, robot, preview_figures))
    if picture is not None:
        from cdpr_tools.robots.path_preview import draw_path  # noqa: PLC0415  # slow to load

        with os_error_as(BadInputError, f"--png {picture}"):
            draw_path(shown, robot, picture)
        out.say(f"picture: {picture}")
    if wrong := previews.obstacle_text(shown):
        raise BadInputError(wrong, **preview_figures)
    if keep:
        preview_figures["plan"] = previews.keep(shown, robot)
    out.result({"ok": True, **preview_figures})
