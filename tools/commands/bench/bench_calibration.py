"""`cdpr bench calibration`: what identifying a geometry costs, beside plain SciPy."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def calibration(
    poses: Annotated[int, typer.Option(min=10, max=2000, help="Poses of the fit.")] = 100,
    repeats: Annotated[
        int, typer.Option(min=2, max=1000, help="Number of fits; the fastest counts.")
    ] = 10,
    images: Annotated[
        int, typer.Option(min=0, max=1000, help="Also measure the fit with this many images.")
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, max=2**31, help="Random seed.")] = 1,
    as_json: JsonOption = False,
) -> None:
    """Measure the identification of spatial-8: poses measured, unknown, and by plain SciPy.

    SciPy solves the same with poses as unknowns and a numeric Jacobian, once. With --images, also
    the fit of cables, camera and 42 markers, from images that are rendered to the verdict.
    """
    with told_on_a_terminal():
        from cdpr_tools.bench import calibration as bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    told = bench.measure(poses, repeats, out)
    verdict = "reached" if told["reached"] else "MISSED"
    out.say(
        f"{poses} poses x 8 cables, exit points and offsets, processor time:",
        *(
            f"  {text:34}{told[name]['ms']:10.1f} ms, exit points {told[name]['off_mm']:.2f} mm off"
            for name, text in (
                ("measured", "poses measured"),
                ("redundancy", "poses unknown"),
                ("scipy", "SciPy, poses measured"),
            )
        ),
        f"  {'with drums and elongation too':34}{told['usual']:10.1f} ms",
        f"  SciPy takes {told['ratio']:.0f} times as long; wanted at most "
        f"{told['target_ms']:g} ms: {verdict}",
    )
    if images:
        told["joint"] = _joint(out, images, seed)
    out.result({"ok": True, **told})


def _joint(out: Output, images: int, seed: int) -> dict[str, Any]:
    with told_on_a_terminal():
        from cdpr_tools.bench import joint_calibration as bench  # noqa: PLC0415  # slow to load

    told = bench.measure(images, seed, out)
    verdict = "reached" if told["reached"] else "MISSED"
    out.say(
        f"{images} images of {told['markers']} markers, {told['corners']} corners, processor time:",
        f"  {'detection':34}{told['detection_s']:10.2f} s",
        f"  {'map, joint fit, faults, verdict':34}{told['fit_s']:10.2f} s, poses by lengths "
        f"{told['position_mm']:.2f} mm and {told['turn_deg']:.3f} deg off",
        f"  wanted at most {told['target_s']:g} s: {verdict}",
    )
    return told
