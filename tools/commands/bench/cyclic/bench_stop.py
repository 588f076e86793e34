"""`cdpr bench stop`: how long a stop takes while others flood the daemon."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_tools.bench.daemon import stop as stop_bench
from cdpr_tools.commands.options import JsonOption
from cdpr_tools.output import Output

_CASES = {
    "alone": "nobody else asks",
    "flooded": "{clients} clients flood every interface",
    "flooded_lowest": "the same at lowest priority (nice 19)",
}
_TRANSPORTS = {"unix": "Unix socket", "http": "HTTP with the key"}


app = typer.Typer()


@app.command()
def stop(
    stops: Annotated[int, typer.Option(min=1, max=100_000, help="Stops of each kind.")] = 500,
    as_json: JsonOption = False,
) -> None:
    """Measure how soon the loop accepts a stop while four clients flood every interface.

    On a simulated robot of its own, without power; the flood stays on this machine.
    """
    out = Output(as_json)
    figures = stop_bench.measure(stops, out)
    out.say(*_table(figures))
    out.result({"ok": True, **figures})


def _table(figures: dict[str, Any]) -> list[str]:
    lines = [
        f"{figures['stops']} stops for each line, from the call to the loop's answer, in ms; "
        f"{figures['processors']} processors",
        f"{'':58}{'p50':>9}{'p99':>9}{'worst':>9}",
    ]
    for case, text in _CASES.items():
        for transport, by in _TRANSPORTS.items():
            ms = figures["ms"][case][transport]
            name = f"{text.format(**figures)}, {by}"
            lines.append(f"{name:58}{ms['p50']:9.1f}{ms['p99']:9.1f}{ms['max']:9.1f}")
    sent = ", ".join(f"{many} {kind}" for kind, many in figures["sent"].items())
    verdict = "reached" if figures["reached"] else "MISSED"
    return [
        *lines,
        f"the flood: {sent.replace('_', ' ')}",
        f"wanted below {figures['bound_ms']:g} ms at the 99th percentile: {verdict}",
    ]
