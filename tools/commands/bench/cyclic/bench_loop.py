"""`cdpr bench loop`: what a cycle of the daemon costs, paced at 1 kHz."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

_VARIANTS = {
    "ours": "ours, recorded and watched",
    "without_service": "ours, the loop's process alone",
    "obvious": "the baseline loop on canopen",
    "obvious_slow": "the baseline loop at {slow_Hz} Hz",
}


app = typer.Typer()


@app.command()
def loop(
    seconds: Annotated[
        float, typer.Option(min=3.0, max=3600.0, help="Duration of each variant.")
    ] = 30.0,
    robot: Annotated[
        str,
        typer.Option(
            help="Robot profile; with a platform it runs `pose`. Bare axes where left out."
        ),
    ] = "",
    as_json: JsonOption = False,
) -> None:
    """Measure the control loop of 8 axes on two simulated buses at 1 kHz, and one full bus.

    The motors turn, or lead their platform; the simulator runs in a process of its own. In the same
    run the same loop is measured as one writes it first, on the canopen package's PDOs and NumPy.
    """
    with told_on_a_terminal():
        from cdpr_tools.bench.daemon import loop as loop_bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    figures = loop_bench.measure(seconds, out, robot)
    out.say(*_table(figures))
    out.result({"ok": True, **figures})


def _table(figures: dict[str, Any]) -> list[str]:
    lines = [
        f"{figures['axes']} axes on {figures['buses']} buses, {figures['period_us']} us a cycle",
        f"{'':32}{'host CPU':>10}{'computing, us':>22}{'late by, us':>22}{'late':>8}{'answers':>9}",
        f"{'':32}{'us/cycle':>10}"
        + f"{'p50':>11}{'p99.9':>11}" * 2
        + f"{'cycles':>8}{'missed':>9}",
    ]
    for name, text in _VARIANTS.items():
        if (one := figures.get(name)) is None:
            continue
        compute, late = one["compute_us"], one["lateness_us"]
        lines.append(
            f"{text.format(**figures):32}{one['host_us']:10.1f}"
            f"{compute['p50']:11.1f}{compute['p99.9']:11.1f}"
            f"{late['p50']:11.1f}{late['p99.9']:11.1f}{one['late']:8}{one['missed']:9}"
        )
    full, shares, targets = figures["one_bus"], figures["shares"], figures["targets"]
    verdicts = {name: "reached" if ok else "MISSED" for name, ok in figures["reached"].items()}
    return [
        *lines,
        f"computing, p99.9: {100 * shares['compute_share']:.1f} % of the period, wanted at most "
        f"{100 * targets['compute_share']:g} %: {verdicts['compute_share']}",
        f"the baseline loop / ours: {shares['obvious_over_ours']:.2f}, wanted at least "
        f"{targets['obvious_over_ours']:g}: {verdicts['obvious_over_ours']}",
        f"recording and live views cost the loop {100 * shares['recording_share']:.1f} %, wanted "
        f"at most {100 * targets['recording_share']:g} %: {verdicts['recording_share']}",
        f"one bus, {full['axes']} axes: {full['rate_Hz']:g} Hz are {100 * full['share']:.0f} % "
        f"of the {full['limit_Hz']} Hz it carries; {full['cycles']} cycles, {full['overruns']} "
        f"overruns, {full['late']} late, {full['missed']} answers missed: {verdicts['one_bus']}",
    ]
