"""`cdpr bench planar`: what a cycle of the planar robot's control costs."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from tools.output import Output

_WAYS = {"ours": "ours, compiled", "obvious": "the same in plain NumPy"}


def add(parent: typer.Typer) -> None:
    """Add the command."""
    parent.command("planar")(planar)


def planar(
    cycles: Annotated[int, typer.Option(min=1000, help="Updates of each way.")] = 20_000,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON line.")] = False,
) -> None:
    """Measure one update of the planar robot's control: pose, wrench, tensions, torques.

    The same update as one writes it first, in NumPy, is measured in the same run, in turns, from
    the same angles; both have to come to the same torques.
    """
    from tools.bench import planar as planar_bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    figures = planar_bench.measure(cycles)
    for line in _table(figures):
        out.say(line)
    out.result({"ok": True, **figures})


def _table(figures: dict[str, Any]) -> list[str]:
    lines = [f"{'update of one cycle, us':32}{'p50':>10}{'p99.9':>10}{'worst':>10}"]
    for name, text in _WAYS.items():
        us = figures["update_us"][name]
        lines.append(f"{text:32}{us['p50']:10.1f}{us['p99.9']:10.1f}{us['worst']:10.1f}")
    told = "reached" if figures["reached"] else "MISSED"
    return [
        *lines,
        f"NumPy / ours at p50: {figures['obvious_over_ours']:.1f}, wanted at least "
        f"{figures['target']:g}: {told}",
        f"torques differ by at most {figures['difference_Nm']:.1e} Nm",
    ]
