"""`cdpr bench latency`: how punctually this machine wakes a loop up."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_tools.bench.cyclic import latency as latency_bench
from cdpr_tools.commands.options import JsonOption
from cdpr_tools.output import Output

app = typer.Typer()


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
    out = Output(as_json)
    figures, late = latency_bench.measure(rate, seconds, out)
    latency_bench.draw(figures, late, picture)
    out.say(*_table(figures))
    out.say(f"picture: {picture}")
    out.result({"ok": True, **figures, "picture": picture})


def _table(figures: dict[str, Any]) -> list[str]:
    lines = [
        f"{figures['wakeups']} wake-ups at {figures['rate_Hz']:g} Hz for each line, in us behind "
        f"the deadline; kernel {figures['kernel']}, {figures['processors']} processors",
        f"{'':30}{'p50':>9}{'p99':>9}{'p99.9':>9}{'worst':>10}",
    ]
    for load in latency_bench.LOADS:
        for variant, text in latency_bench.VARIANTS.items():
            us = figures["late_us"][load][variant]
            values = f"{us['p50']:9.1f}{us['p99']:9.1f}{us['p99.9']:9.1f}{us['max']:10.1f}"
            lines.append(f"{load + ':':8}{text:22}{values}")
    lines += [f"not allowed: {notice}" for notice in figures["not_allowed"]]
    return lines
