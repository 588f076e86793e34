"""`cdpr bench soak`: hours of bus time with a whole robot."""

from __future__ import annotations

import math
from typing import Annotated, Any

import typer

from cdpr_profiles import load_robot
from cdpr_tools.bench import soak as soak_bench
from cdpr_tools.commands.options import JsonOption
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def soak(
    hours: Annotated[float, typer.Option(min=1e-4, max=1e4, help="Hours of bus time.")] = 1.0,
    wall_minutes: Annotated[
        float, typer.Option(min=0.01, help="End after so many minutes on the clock.")
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
    out = Output(as_json)
    figures = soak_bench.measure(load_robot(robot), hours, 60.0 * wall_minutes, rate, out)
    out.say(*_table(figures))
    if not figures["ok"]:
        error = _failure(figures)
        typer.echo(f"cdpr: {error}", err=True)
        out.result({**figures, "error": error, "exit_status": WorkFailedError.exit_status})
        raise typer.Exit(WorkFailedError.exit_status)
    out.result(figures)


def _failure(figures: dict[str, Any]) -> str:
    texts = [f"{figures['lost_frames']} frames were lost"] if figures["lost_frames"] else []
    texts += [
        f"the {name} gained {figures['memory_growth_KiB'][name]} KiB and "
        f"{figures['open_files_growth'][name]} open files"
        for name in figures["leaks"]
    ]
    return "; ".join(texts)


def _table(figures: dict[str, Any]) -> list[str]:
    lines = [
        f"{figures['drives']} drives were up in {figures['boot_s']:.2f} s of bus time",
        f"{figures['robot']} at {figures['rate_Hz']:g} Hz: {figures['bus_hours']:.3f} h of bus "
        f"time, {figures['cycles']} cycles, in {figures['wall_s']:.0f} s "
        f"({figures['us_per_cycle']:.0f} us each)",
        f"{figures['bus_hours_in_10_minutes']:.2f} h fit into 10 minutes; 24 h take "
        f"{figures['wall_hours_for_24_bus_hours']:.1f} h",
    ]
    for name, verdict in figures["buses"].items():
        lines.append(
            f"bus {name}: {verdict['frames_counted']} frames on the bus, "
            f"{verdict['frames_expected']} expected by the master (heartbeats to within "
            f"{verdict['tolerance']}); SYNCs lost {verdict['syncs_lost']}, answers missed "
            f"{verdict['answers_missed']}, dropped {verdict['dropped']}, cycles that did not fit "
            f"{verdict['overruns']}"
        )
    for name, gained in figures["memory_growth_KiB"].items():
        lines.append(
            f"{name}: {figures['memory_KiB'][name] / 1024:.0f} MiB, grown by {gained} KiB; "
            f"open files grown by {figures['open_files_growth'][name]}"
        )
    return lines
