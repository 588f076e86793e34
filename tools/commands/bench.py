"""`cdpr bench`: what the project costs on this machine, measured by cdpr_tools.bench."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_profiles import load_robot
from cdpr_rt.errors import GeometryError
from cdpr_tools.commands.options import JsonOption, SeedOption
from cdpr_tools.errors import FAILED, BadInputError, raised_as
from cdpr_tools.loading import loading_notice
from cdpr_tools.output import Output

app = typer.Typer(
    name="bench", help="Measure this project's own cost on this machine.", no_args_is_help=True
)


def _run(module: str, as_json: bool, **given: Any) -> None:
    """Measure with a module's `measure`, and show the figures with its `report`."""
    with loading_notice():
        bench = importlib.import_module(f"cdpr_tools.bench.{module}")
    out = Output(as_json)
    figures = bench.measure(**given, out=out)
    out.say(*bench.report(figures))
    if error := figures.pop("error", ""):
        typer.echo(f"cdpr: {error}", err=True)
        out.result({**figures, "ok": False, "error": error, "exit_status": FAILED})
        raise typer.Exit(FAILED)
    out.result({"ok": True, **figures})


@app.command()
def bus(
    exchanges: Annotated[
        int, typer.Option(min=1, help="Exchanges of 8 frames out and 8 in, for each variant.")
    ] = 500,
    as_json: JsonOption = False,
) -> None:
    """Measure frames per second and host cost per frame, beside plain python-can.

    On simbus, on SocketCAN (vcan0, where there is one), through socketcand and through a serial
    adapter, each with a node in a process of its own that answers every frame.
    """
    _run("cyclic.bus", as_json, exchanges=exchanges)


@app.command()
def calibration(
    poses: Annotated[int, typer.Option(min=10, max=2000, help="Poses of the fit.")] = 100,
    repeats: Annotated[
        int, typer.Option(min=2, max=1000, help="Number of fits; the fastest counts.")
    ] = 10,
    images: Annotated[
        int, typer.Option(min=0, max=1000, help="Also measure the fit with this many images.")
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, max=2**31, help="Random seed.")] = 1,
    as_json: JsonOption = False,
) -> None:
    """Measure the identification of spatial-8: poses measured, unknown, and by plain SciPy.

    SciPy solves the same with poses as unknowns and a numeric Jacobian, once. With --images, also
    the fit of cables, camera and 42 markers, from images that are rendered to the verdict.
    """
    _run("calibration", as_json, poses=poses, repeats=repeats, images=images, seed=seed)


@app.command()
def control(
    robot: Annotated[str, typer.Option(help="A robot with a platform.")] = "spatial-8",
    cycles: Annotated[int, typer.Option(min=500, help="Updates of each implementation.")] = 5_000,
    as_json: JsonOption = False,
) -> None:
    """Measure one update of a platform's control: pose, wrench, tensions, torques.

    The same update as one writes it first, in NumPy and SciPy, is measured in the same run, in
    turns, from the same angles; both have to come to the same torques.
    """
    with raised_as(BadInputError, GeometryError):
        _run("control.measure", as_json, name=robot, cycles=cycles)


@app.command()
def cycle(
    cycles: Annotated[int, typer.Option(min=1, help="Exchanges of each variant.")] = 10_000,
    as_json: JsonOption = False,
) -> None:
    """Measure one exchange with 8 axes: ours, the canopen package's PDO path, and the floor.

    All three talk to the same 8 simulated drives on a bus of their own, in blocks that take turns.
    """
    _run("cyclic.cycle", as_json, cycles=cycles)


@app.command()
def profiles(
    repeats: Annotated[
        int, typer.Option(min=1, help="Number of repetitions; the best counts.")
    ] = 5,
    as_json: JsonOption = False,
) -> None:
    """Measure loading and validating every shipped profile, against bare TOML parsing."""
    _run("profile_loading", as_json, repeats=repeats)


@app.command()
def kinematics(
    poses: Annotated[int, typer.Option(min=100, help="Poses of each kind.")] = 10_000,
    as_json: JsonOption = False,
) -> None:
    """Measure the pose from cable lengths: along a path, and from bad starts.

    Along a path on spatial-8, from the last pose. On CoGiRo from starts that are up to 1 m and 2
    to 40 degrees off, beside Levenberg-Marquardt, compiled of the same parts, and SciPy's.
    """
    _run("kinematics", as_json, poses=poses)


@app.command()
def latency(
    seconds: Annotated[
        float, typer.Option(min=0.1, max=86_400.0, help="Duration of each of the four curves.")
    ] = 5.0,
    rate: Annotated[float, typer.Option(min=1.0, max=10_000.0, help="Cycles a second.")] = 1000.0,
    picture: Annotated[Path, typer.Option("--out", help="File for the picture.")] = Path(
        "out/latency.png"
    ),
    as_json: JsonOption = False,
) -> None:
    """Measure how late a loop wakes up, with and without the real-time settings, as a picture.

    Both on the machine as it is and with every processor kept busy, which it does by itself.
    """
    _run("cyclic.latency", as_json, rate_Hz=rate, seconds=seconds, picture=picture)


@app.command()
def loop(
    seconds: Annotated[
        float, typer.Option(min=3.0, max=3600.0, help="Duration of each variant.")
    ] = 30.0,
    robot: Annotated[
        str,
        typer.Option(
            help="Robot profile; with a platform it runs `pose`. Bare axes where left out."
        ),
    ] = "",
    as_json: JsonOption = False,
) -> None:
    """Measure the control loop of 8 axes on two simulated buses at 1 kHz, and one full bus.

    The motors turn, or lead their platform; the simulator runs in a process of its own. In the same
    run the same loop is measured as one writes it first, on the canopen package's PDOs and NumPy.
    """
    _run("daemon.loop", as_json, seconds=seconds, name=robot)


@app.command()
def markers(
    images: Annotated[
        int, typer.Option(min=5, max=1000, help="Number of images, of 1.3 megapixels.")
    ] = 100,
    seed: SeedOption = 7,
    as_json: JsonOption = False,
) -> None:
    """Make a map of 42 markers from rendered images, beside one from OpenCV's own corners.

    Errors are against the truth of the simulator; along and across the reference marker's plane as
    in figure 3.21 of the thesis, and in the frame in which the map fits the truth best.
    """
    _run("markers", as_json, count=images, seed=seed)


@app.command()
def path(
    lines: Annotated[
        int, typer.Option(min=100, max=100_000, help="Lines of the G-code file.")
    ] = 10_000,
    seed: SeedOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Measure planning a G-code file as CAM writes it, for spatial-8: preview and picture too.

    The planned motion is compared with one at a single speed and acceleration that every place of
    the path bears, the cost with the package toppra, which knows neither jerk nor tensions.
    """
    _run("paths", as_json, lines=lines, seed=seed)


@app.command()
def poses(
    ways: Annotated[int, typer.Option(min=1, help="Paths checked by brute force.")] = 10_000,
    seed: SeedOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Measure drawing reachable poses of spatial-8, and look at ways again by plain NumPy.

    Each pose is held and clear of contact all the way from home. The ways that are looked at again,
    at every millimetre, lead far out of the box of targets, so that most of them end early.
    """
    _run("poses.measure", as_json, ways=ways, seed=seed)


@app.command()
def soak(
    hours: Annotated[float, typer.Option(min=1e-4, max=1e4, help="Hours of bus time.")] = 1.0,
    wall_minutes: Annotated[
        float,
        typer.Option(
            min=0.01,
            help="End after so many minutes on the clock; not before --hours by default.",
            show_default=False,
        ),
    ] = math.inf,
    robot: Annotated[str, typer.Option(help="Robot profile: a name or a path.")] = "bench-8",
    rate: Annotated[
        float | None,
        typer.Option(min=1.0, max=10_000.0, help="Cycles a second, instead of the robot's."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Move a simulated robot in lockstep for hours; no memory may leak and no frame be lost.

    Exit status 1 when one does.
    """
    _run(
        "soak",
        as_json,
        robot=load_robot(robot),
        hours=hours,
        most_wall_s=60.0 * wall_minutes,
        rate_Hz=rate,
    )


@app.command()
def stop(
    stops: Annotated[int, typer.Option(min=1, max=100_000, help="Stops of each kind.")] = 500,
    as_json: JsonOption = False,
) -> None:
    """Measure how soon the loop accepts a stop while four clients flood every interface.

    On a simulated robot of its own, without power; the flood stays on this machine.
    """
    _run("daemon.stop", as_json, stops=stops)


@app.command()
def tension(
    poses: Annotated[int, typer.Option(min=500, help="Poses of each robot.")] = 10_000,
    as_json: JsonOption = False,
) -> None:
    """Measure tension distribution on poses of spatial-8 and suspended-8, feasible or not.

    Every method is asked for the same poses as the general solvers DAQP, PIQP and OSQP, in turns,
    and follows paths with as many points, on which its tensions may change by steps.
    """
    _run("tension.measure", as_json, poses=poses)


@app.command()
def workspace(
    poses: Annotated[int, typer.Option(min=1000, help="Poses checked.")] = 1_000_000,
    compared: Annotated[
        int, typer.Option(min=10, help="How many of them other methods check too.")
    ] = 300,
    as_json: JsonOption = False,
) -> None:
    """Measure whether the cables of spatial-8 hold poses, at full acceleration, on one core.

    Beside OSQP and pycapacity; and the workspace's volume by a grid, by rays and by drawn places.
    """
    _run("workspace", as_json, poses=poses, compared=compared)
