"""`cdpr bench markers`: what a map of markers costs, and how near the truth it is."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def markers(
    images: Annotated[
        int, typer.Option(min=5, max=1000, help="Number of images, of 1.3 megapixels.")
    ] = 100,
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 7,
    as_json: JsonOption = False,
) -> None:
    """Make a map of 42 markers from rendered images, beside one from OpenCV's own corners.

    Errors are against the truth of the simulator; along and across the reference marker's plane as
    in figure 3.21 of the thesis, and in the frame in which the map fits the truth best.
    """
    with told_on_a_terminal():
        from cdpr_tools.bench import markers as bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    figures = bench.measure(images, seed, out)
    out.say(*_table(figures, bench.TARGET_S))
    out.result({"ok": True, **figures})


def _table(figures: dict[str, Any], target_s: float) -> list[str]:
    ours, theirs = figures["ours"], figures["opencv"]
    rows = (
        ("detection, processor time", "detection_s", "s", 2),
        ("map, processor time", "fit_s", "s", 2),
        ("corners fit to", "corner_sigma_px", "px", 3),
        ("largest error along the plane", "xy_max_mm", "mm", 2),
        ("largest error across it", "z_max_mm", "mm", 2),
        ("error where it fits best, rms", "shape_rms_mm", "mm", 2),
        ("what the map says of that", "told_mm", "mm", 2),
    )
    lines = [f"{figures['images']} images{'ours':>30}{'OpenCV corners':>20}{'ratio':>9}"]
    for text, key, unit, digits in rows:
        a, b = ours[key], theirs[key]
        ratio = f"{b / a:9.1f}" if a else ""
        lines.append(f"{text:32}{a:8.{digits}f} {unit:3}{b:13.{digits}f} {unit:3}{ratio}")
    verdict = "reached" if figures["reached"]["time"] else "MISSED"
    lines.append(f"detection and map wanted within {target_s:g} s: {verdict}")
    return lines
