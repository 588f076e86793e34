"""`cdpr bench cycle|profiles`: an exchange with 8 axes, and loading what ships."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_tools.bench import profile_loading
from cdpr_tools.bench.cyclic import cycle as cycle_bench
from cdpr_tools.commands.options import JsonOption
from cdpr_tools.output import Output

app = typer.Typer()

_VARIANTS = {
    "ours": "ours: AxisGroup",
    "canopen": "the canopen package's PDOs",
    "floor": "floor: bare socket and struct",
}


@app.command()
def cycle(
    cycles: Annotated[int, typer.Option(min=1, help="Exchanges of each variant.")] = 10_000,
    as_json: JsonOption = False,
) -> None:
    """Measure one exchange with 8 axes: ours, the canopen package's PDO path, and the floor.

    All three talk to the same 8 simulated drives on a bus of their own, in blocks that take turns.
    """
    out = Output(as_json)
    figures = cycle_bench.measure(cycles, out)
    out.say(*_cycle_table(figures))
    out.result({"ok": True, **figures})


def _cycle_table(figures: dict[str, Any]) -> list[str]:
    cpu, wall = figures["cpu_us"], figures["wall_us"]
    ratios, targets, reached = figures["ratios"], figures["targets"], figures["reached"]
    head = f"{'':30}{'host CPU time, us':>20}{'wall, drives too, us':>24}"
    columns = f"{'':30}{'p50':>10}{'p99.9':>10}{'p50':>14}{'p99.9':>10}"
    rows = [
        f"{text:30}{cpu[name]['p50']:10.1f}{cpu[name]['p99.9']:10.1f}"
        f"{wall[name]['p50']:14.1f}{wall[name]['p99.9']:10.1f}"
        for name, text in _VARIANTS.items()
    ]
    bounds = (
        ("canopen_over_ours", "canopen / ours", "at least"),
        ("ours_over_floor", "ours / floor", "at most"),
    )
    verdicts = [
        f"{text}: {ratios[key]:.2f}, wanted {bound} {targets[key]:g}: "
        f"{'reached' if reached[key] else 'MISSED'}"
        for key, text, bound in bounds
    ]
    title = f"one exchange with {figures['axes']} axes, {figures['cycles']} cycles of each"
    return [title, head, columns, *rows, *verdicts]


@app.command()
def profiles(
    repeats: Annotated[
        int, typer.Option(min=1, help="Number of repetitions; the best counts.")
    ] = 5,
    as_json: JsonOption = False,
) -> None:
    """Measure loading and validating every shipped profile, against bare TOML parsing."""
    out = Output(as_json)
    figures = profile_loading.measure(repeats)
    verdict = "reached" if figures["reached"] else "MISSED"
    out.say(
        f"all {figures['files']} profile files: {figures['load_all_ms']:.1f} ms loaded and "
        f"validated, {figures['tomllib_ms']:.1f} ms with tomllib alone, "
        f"ratio {figures['ratio']:.2f}"
    )
    out.say(f"wanted below {figures['bound_ms']:g} ms: {verdict}")
    out.result({"ok": True, **figures})
