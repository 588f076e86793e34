"""`cdpr bench path`: what planning a large path costs, and what time scaling gains."""

from __future__ import annotations

from typing import Annotated

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def path(
    lines: Annotated[
        int, typer.Option(min=100, max=100_000, help="Lines of the G-code file.")
    ] = 10_000,
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 1,
    as_json: JsonOption = False,
) -> None:
    """Measure planning a G-code file as CAM writes it, for spatial-8: preview and picture too.

    The planned motion is compared with one at a single speed and acceleration that every place of
    the path bears, the cost with the package toppra, which knows neither jerk nor tensions.
    """
    with told_on_a_terminal():
        from cdpr_tools.bench.paths import measure as bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    told = bench.measure(lines, seed, out)
    verdict = "reached" if told["reached"] else "MISSED"
    ours_us = 1e6 * told["plan_s"] / told["nodes"]
    out.say(
        f"{told['lines']} lines, seed {told['seed']}: {told['length_m']:.1f} m, {told['nodes']} "
        f"nodes, {told['samples']} samples",
        f"planned in {told['plan_s']:.2f} s of processor time, drawn as well in "
        f"{told['with_picture_s']:.2f} s, wanted at most {told['target_s']:g} s: {verdict}; "
        f"{told['wall_s']:.2f} s by the wall clock",
        f"the motion takes {told['duration_s']:.1f} s; at one speed and acceleration throughout "
        f"{told['constant_limit_s']:.1f} s, {told['gain']:.1f} times as long",
    )
    if (other := told["toppra"]) is None:
        out.say("toppra: not installed")
    else:
        out.say(
            f"a node costs {ours_us:.0f} us, reading, corners, tensions, contacts and jerk "
            f"included; toppra {other['us_a_node']:.0f} us with velocity and acceleration alone "
            f"({other['nodes']} nodes), {other['us_a_node'] / ours_us:.1f} times as much"
        )
    out.result({"ok": True, **told})
