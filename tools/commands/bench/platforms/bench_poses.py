"""`cdpr bench poses`: how many reachable poses a second, and whether brute force agrees."""

from __future__ import annotations

from typing import Annotated

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def poses(
    ways: Annotated[int, typer.Option(min=1, help="Paths checked by brute force.")] = 10_000,
    seed: Annotated[int, typer.Option(min=0)] = 1,
    as_json: JsonOption = False,
) -> None:
    """Measure drawing reachable poses of spatial-8, and look at ways again by plain NumPy.

    Each pose is held and clear of contact all the way from home. The ways that are looked at again,
    at every millimetre, lead far out of the box of targets, so that most of them end early.
    """
    with told_on_a_terminal():
        from cdpr_tools.bench.poses import measure  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    figures = measure.measure(ways, seed, out)
    reached = figures["reached"]
    out.say(
        f"{figures['poses_1_s']:.0f} poses a second of processor time, wanted at least "
        f"{figures['target_1_s']:.0f}: {_verdict(reached['rate'])}",
        f"{figures['over_plain_numpy']:.0f} times plain NumPy at every millimetre "
        f"({figures['plain_numpy_1_s']:.1f} a second), {figures['over_thesis']:.0f} times the "
        "thesis",
        f"of {figures['ways']} ways {figures['whole']} lead to their end, "
        f"{figures['cut_by_contact']} end at contact, {figures['cut_by_tensions']} where tensions "
        "do not hold",
        f"accepted, but not by brute force: {figures['false_acceptances']}, wanted 0: "
        f"{_verdict(reached['no_false_acceptance'])}",
        f"ended more than 1 mm too soon: {figures['ended_1_mm_too_soon']}",
    )
    out.result({"ok": True, **figures})


def _verdict(reached: bool) -> str:
    return "reached" if reached else "MISSED"
