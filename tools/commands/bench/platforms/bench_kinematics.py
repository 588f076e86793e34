"""`cdpr bench kinematics`: what a pose from cable lengths costs, and how bad a start may be."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

_SEARCHES = {"ours": "ours", "plain": "plain LM, compiled", "scipy": "plain LM, SciPy"}
_ROUNDS = {
    "exact": "exact lengths",
    "noisy": "cables that stretch, 5 mm of noise",
}


app = typer.Typer()


@app.command()
def kinematics(
    poses: Annotated[int, typer.Option(min=100, help="Poses of each kind.")] = 10_000,
    as_json: JsonOption = False,
) -> None:
    """Measure the pose from cable lengths: along a path, and from bad starts.

    Along a path on spatial-8, from the last pose. On CoGiRo from starts that are up to 1 m and 2
    to 40 degrees off, beside Levenberg-Marquardt, compiled of the same parts, and SciPy's.
    """
    with told_on_a_terminal():
        from cdpr_tools.bench import kinematics as bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    figures = bench.measure(poses, out)
    out.say(*_table(figures))
    out.result({"ok": True, **figures})


def _table(figures: dict[str, Any]) -> list[str]:
    verdicts = {name: "reached" if ok else "MISSED" for name, ok in figures["reached"].items()}
    us = figures["tracking"]
    lines = [
        f"spatial-8, from the last pose, {figures['poses']} poses: p50 {us['p50']:.1f} us, p99 "
        f"{us['p99']:.1f} us, p99.9 {us['p99.9']:.1f} us",
        f"p99 wanted at most {figures['target_us']:g} us: {verdicts['tracking']}",
    ]
    for name, text in _ROUNDS.items():
        lines += [
            f"CoGiRo, {figures['poses']} poses, start off by 1 m and the angle, {text}",
            f"{'':8}" + "".join(f"{search:^32}" for search in _SEARCHES.values()),
            f"{'deg':8}" + f"{'success':>10}{'p50, us':>11}{'p99, us':>11}" * len(_SEARCHES),
        ]
        for row in figures[name]:
            cells = "".join(
                f"{100 * one['success']:8.2f} %{one['p50']:11.1f}{one['p99']:11.1f}"
                for one in map(row.get, _SEARCHES)
            )
            lines.append(f"{row['angle_deg']:<8.1f}{cells}")
        lines.append(
            "at every angle, against plain LM, compiled: success at least "
            f"{verdicts[name + '_success']}, p50 at most {verdicts[name + '_p50']}, p99 at most "
            f"{verdicts[name + '_p99']}"
        )
    return lines
