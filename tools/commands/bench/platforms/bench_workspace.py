"""`cdpr bench workspace`: what it costs to tell whether cables hold a pose."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

_METHODS = {
    "margins": "ours: margins in closed form",
    "active set": "ours, before: active set, every corner",
    "osqp": "OSQP, every corner until one is not held",
    "pycapacity": "pycapacity: half-spaces, then every corner",
}


app = typer.Typer()


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
    with told_on_a_terminal():
        from cdpr_tools.bench import workspace as bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    figures = bench.measure(poses, compared, out)
    out.say(*_table(figures))
    out.result({"ok": True, **figures})


def _table(figures: dict[str, Any]) -> list[str]:
    volume = figures["volume"]
    lines = [
        f"{figures['poses']} poses of {figures['robot']}, {100.0 * figures['held_share']:.0f} % of "
        f"them held: {figures['spent_s']:.1f} s of one core",
        f"a million takes {figures['million_s']:.1f} s, wanted at most {figures['target_s']:g}: "
        f"{_verdict(figures['reached']['cost'])}",
        "",
        f"{figures['compared']:<46d}{'us a pose':>12}{'times ours':>12}{'otherwise':>11}",
    ]
    for name, told in figures["others"].items():
        lines.append(
            f"{_METHODS[name]:46}{told['us']:12.1f}{told['times']:12.1f}{told['otherwise']:11d}"
        )
    lines += [f"{_METHODS[name]}: not installed" for name in figures["not_installed"]]
    return [
        *lines,
        "",
        f"volume at home's orientation: grid {volume['grid_m3']:.3f} m3, rays "
        f"{volume['rays_m3']:.3f} m3, drawn places {volume['drawn_m3']:.3f} m3 (+- "
        f"{volume['drawn_std_m3']:.3f})",
        f"rays against grid: {100.0 * volume['rays_against_grid']:+.1f} %, wanted within 2 %: "
        f"{_verdict(figures['reached']['agreement'])}",
    ]


def _verdict(reached: bool) -> str:
    return "reached" if reached else "MISSED"
