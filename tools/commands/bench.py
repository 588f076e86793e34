"""`cdpr bench`: measure the cost of this software on this machine."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_profiles import load_robot
from cdpr_profiles.errors import printable
from cdpr_rt.errors import GeometryError
from cdpr_rt.robot import Error as RobotError
from cdpr_tools.commands.options import JsonOption, option
from cdpr_tools.errors import FAILED, BadInputError, WorkFailedError, raised_as
from cdpr_tools.output import Output

app = typer.Typer(
    name="bench", help="Measure the cost of this software on this machine.", no_args_is_help=True
)


def _run(bench: str, as_json: bool, **given: Any) -> None:
    """Run the benchmark of a module and show its figures."""
    module = importlib.import_module(f"cdpr_tools.bench.{bench}")
    out = Output(as_json)
    with raised_as(WorkFailedError, RobotError):
        figures = module.measure(**given, out=out)
    out.say(*figures.lines())
    if figures.error:
        typer.echo(printable(f"cdpr: {figures.error}"), err=True)
        failed = {"ok": False, "error": figures.error, "exit_status": FAILED}
        out.result({**figures.as_json(), **failed})
        raise typer.Exit(FAILED)
    out.result({"ok": True, **figures.as_json()})


@app.command()
def api(
    starts: Annotated[int, option("Number of new scripts; each makes its first move.", min=1)] = 5,
    cycles: Annotated[int, option("Cycles in lockstep with each controller.", min=200)] = 4_000,
    seconds: Annotated[
        float, option("Duration at 250 Hz with each controller.", min=3, max=3600)
    ] = 20.0,
    as_json: JsonOption = False,
) -> None:
    """Measure the Python interface: a script's first move, and controllers written in Python.

    The same script runs on a simulation in lockstep and on a daemon in real time. A do-nothing
    controller and one in NumPy take turns with the built-in one.
    """
    _run("api", as_json, starts=starts, cycles=cycles, seconds=seconds)


@app.command()
def bus(
    exchanges: Annotated[
        int, option("Exchanges with each library, 8 frames out and 8 in.", min=1)
    ] = 500,
    as_json: JsonOption = False,
) -> None:
    """Measure frames per second and host cost per frame, beside plain python-can.

    It uses simbus, SocketCAN (vcan0, if there is one), socketcand and a serial adapter. On each, a
    node in a separate process answers every frame.
    """
    _run("bus", as_json, exchanges=exchanges)


@app.command()
def control(
    robot: Annotated[str, option("A robot with a platform.")] = "spatial-8",
    cycles: Annotated[int, option("Updates of each implementation.", min=500)] = 5_000,
    as_json: JsonOption = False,
) -> None:
    """Measure one update of a platform's control: pose, wrench, tensions, torques.

    A plain controller in NumPy and SciPy gets the same angles; both take turns in the same run.
    """
    with raised_as(BadInputError, GeometryError):
        _run("control", as_json, name=robot, cycles=cycles)


@app.command()
def cycle(
    cycles: Annotated[int, option("Exchanges with each library.", min=1)] = 10_000,
    as_json: JsonOption = False,
) -> None:
    """Measure one exchange with 8 axes: ours, and the canopen package's PDO path.

    Both talk to the same 8 simulated drives on a separate bus, in blocks that take turns.
    """
    _run("cycle", as_json, cycles=cycles)


@app.command()
def kinematics(
    poses: Annotated[int, option("Poses of each kind.", min=100)] = 1_000,
    as_json: JsonOption = False,
) -> None:
    """Measure the pose from cable lengths: along a path, and from bad starts.

    The robot is spatial-8. The search starts at the last pose, or up to 0.5 m and 10 or 40 degrees
    off. SciPy's Levenberg-Marquardt solves the same problems.
    """
    _run("kinematics", as_json, poses=poses)


@app.command()
def latency(
    seconds: Annotated[
        float, option("Duration of each of the four curves.", min=0.1, max=86_400)
    ] = 5.0,
    rate: Annotated[float, option("Cycles per second.", min=1, max=10_000)] = 1000.0,
    picture: Annotated[Path, option("File for the picture.", "--out")] = Path("out/latency.png"),
    as_json: JsonOption = False,
) -> None:
    """Measure how late a loop wakes up, with and without the real-time settings, as a picture.

    Both are measured on the machine as it is, and while the command keeps every processor busy.
    """
    _run("latency", as_json, rate_Hz=rate, seconds=seconds, picture=picture)


@app.command()
def loop(
    seconds: Annotated[float, option("Duration of each variant.", min=3, max=3600)] = 30.0,
    robot: Annotated[
        str,
        option(
            "Robot profile, whose platform is moved to and fro. Default: axes without a platform."
        ),
    ] = "",
    as_json: JsonOption = False,
) -> None:
    """Measure the control loop of 8 axes on two simulated buses at 1 kHz.

    The motors turn, or move their platform. The simulator runs in a separate process. In the same
    run a baseline loop, on the canopen package's PDOs and NumPy, turns axes without a platform.
    """
    _run("loop", as_json, seconds=seconds, name=robot)


@app.command()
def page(
    seconds: Annotated[float, option("Duration of each case.", min=3, max=3600)] = 60.0,
    hours: Annotated[
        float, option("Hours of messages to send to a page.", min=0.1, max=1000)
    ] = 8.0,
    as_json: JsonOption = False,
) -> None:
    """Measure the robot's page in Chromium: start, rate, cost, 50 open pages, memory.

    The robot has 8 axes at 1 kHz. Nobody, one page, and 50 pages watch it in turns.
    """
    _run("page", as_json, seconds=seconds, hours=hours)


@app.command()
def soak(
    hours: Annotated[float, option("Hours of bus time.", min=1e-4, max=1e4)] = 1.0,
    wall_minutes: Annotated[
        float,
        option(
            "End after this many minutes, even if --hours are not over.",
            min=0.01,
            show_default=False,
        ),
    ] = math.inf,
    robot: Annotated[str, option("Robot profile: a name or a path.")] = "bench-8",
    rate: Annotated[
        float | None,
        option("Cycles per second; default: as in the robot's file.", min=1, max=10_000),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Move a simulated robot in lockstep for hours, and watch for leaked memory and lost frames.

    The exit status is 1 if memory leaks or a frame is lost.
    """
    given = {"robot": load_robot(robot), "hours": hours, "rate_Hz": rate}
    _run("soak", as_json, most_wall_s=60.0 * wall_minutes, **given)


@app.command()
def stop(
    stops: Annotated[int, option("Stops of each kind.", min=1, max=100_000)] = 500,
    from_page: Annotated[
        bool,
        option("Press the page's stop in Chromium while motors turn, and watch the bus.", "--page"),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Measure how soon the loop accepts a stop while four clients flood every interface.

    It uses a separate simulated robot without power. The flood stays on this machine.
    """
    _run("stop", as_json, stops=stops, from_page=from_page)


@app.command()
def tension(
    poses: Annotated[int, option("Poses of each robot.", min=500)] = 10_000,
    as_json: JsonOption = False,
) -> None:
    """Measure tension distribution on poses of spatial-8 and suspended-8, feasible or not.

    Every method solves the same poses as the general solvers DAQP and OSQP, in turns.
    """
    _run("tension", as_json, poses=poses)
