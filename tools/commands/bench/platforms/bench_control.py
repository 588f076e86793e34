"""`cdpr bench control`: what a cycle of a platform's control costs."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_rt.errors import GeometryError
from cdpr_tools.commands.options import JsonOption
from cdpr_tools.errors import BadInputError
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

_VARIANTS = {"ours": "ours, compiled", "obvious": "the same in NumPy and SciPy"}


app = typer.Typer()


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
    with told_on_a_terminal():
        from cdpr_tools.bench import control as bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    try:
        figures = bench.measure(robot, cycles)
    except GeometryError as error:
        raise BadInputError(str(error)) from None
    out.say(*_table(figures))
    out.result({"ok": True, **figures})


def _table(figures: dict[str, Any]) -> list[str]:
    told = {name: "reached" if ok else "MISSED" for name, ok in figures["reached"].items()}
    title = (
        f"{figures['robot']}: {figures['cables']} cables, {figures['directions']} directions, "
        f"{figures['cycles']} updates of each"
    )
    lines = [title, f"{'update of one cycle, us':32}{'p50':>10}{'p99':>10}{'worst':>10}"]
    for name, text in _VARIANTS.items():
        us = figures["update_us"][name]
        lines.append(f"{text:32}{us['p50']:10.1f}{us['p99']:10.1f}{us['worst']:10.1f}")
    targets = figures["targets"]
    return [
        *lines,
        f"NumPy / ours at p50: {figures['obvious_over_ours']:.1f}, wanted at least "
        f"{targets['ratio']:g}: {told['ratio']}",
        f"ours at p99, wanted at most {targets['p99_us']:g} us: {told['p99_us']}",
        f"torques differ by at most {figures['difference_Nm']:.1e} Nm",
    ]
