"""`cdpr bench bus`: frames per second and cost per frame on each kind of bus."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

_ORDER = ("simbus", "socketcan", "socketcand", "slcan")


app = typer.Typer()


@app.command()
def bus(
    exchanges: Annotated[
        int, typer.Option(min=1, help="Exchanges of 8 frames out and 8 in, for each variant.")
    ] = 500,
    as_json: JsonOption = False,
) -> None:
    """Measure frames per second and host cost per frame, beside plain python-can.

    On simbus, on SocketCAN (vcan0, where there is one), through socketcand and through a serial
    adapter, each with a node in a process of its own that answers every frame.
    """
    with told_on_a_terminal():
        from cdpr_tools.bench.cyclic import bus as bus_bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    figures = bus_bench.measure(exchanges, out)
    out.say(*_table(figures))
    out.result({"ok": True, **figures})


def _table(figures: dict[str, Any]) -> list[str]:
    lines = [
        f"{figures['frames_per_exchange']} frames of 8 bytes an exchange, half of them answers; "
        f"{figures['exchanges']} exchanges of each variant",
        f"{'':24}{'':>10}{'host CPU us a frame':>30}{'wall us a frame':>20}{'python-can':>14}",
        f"{'':24}{'frames/s':>10}{'mean':>10}"
        + f"{'p50':>10}{'p99.9':>10}" * 2
        + f"{'/ ours':>14}",
    ]
    for name in _ORDER:
        measured = figures["buses"][name]
        if "missing" in measured:
            lines.append(f"{name}: not measured: {measured['missing']}")
            continue
        for variant in ("ours", "python-can"):
            one = measured[variant]
            cpu, wall = one["cpu_us_per_frame"], one["wall_us_per_frame"]
            columns = (cpu["mean"], cpu["p50"], cpu["p99.9"], wall["p50"], wall["p99.9"])
            numbers = "".join(f"{value:10.1f}" for value in columns)
            ratio = f"{measured['python_can_over_ours']:14.2f}" if variant == "ours" else ""
            lines.append(f"{name + ' ' + variant:24}{one['frames_per_s']:10}{numbers}{ratio}")
        if "delivery_us" in measured:
            late = measured["delivery_us"]
            lines.append(
                f"{'':24}from the kernel's time stamp to the program: "
                f"p50 {late['p50']:.1f} us, p99.9 {late['p99.9']:.1f} us"
            )
    return lines
