"""`cdpr import`: recordings of other programs for the commands of this project."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_profiles import load_winch
from cdpr_tools.commands.commission import prepare
from cdpr_tools.commands.options import JsonOption, OverwriteOption, WinchArgument
from cdpr_tools.output import Output, TableText

app = typer.Typer(
    name="import",
    help="Convert recordings of other programs: CSV, OptiTrack, Vicon.",
    no_args_is_help=True,
)


@app.callback()
def _group() -> None:
    """Convert recordings of other programs: CSV, OptiTrack, Vicon."""


FilesArgument = Annotated[
    list[Path],
    typer.Argument(help="CSV files, or exports of OptiTrack or Vicon.", metavar="FILE..."),
]
MapOption = Annotated[
    Path, typer.Option("--map", help="Which column is what, TOML.", metavar="FILE")
]


@app.command()
def motor(
    winch: WinchArgument,
    files: FilesArgument,
    mapping: MapOption,
    out_dir: Annotated[Path, typer.Option("--out", help="Folder for the passes.", metavar="DIR")],
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Convert recordings of a turning motor for `cdpr cogging fit` and `cdpr cogging compare`.

    Each motion in one direction becomes a pass. Columns: time, angle, torque (or current).
    """
    from cdpr_tools.imports.motor import import_motor  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    found = import_motor(files, mapping, load_winch(winch), prepare(out_dir, overwrite))
    for note in found.notes:
        out.note(note)
    head = ["pass", "from", "turns", "speed", "samples", "in gaps"]
    rows = [
        [
            one["pass"], one["source"], f"{one['turns']:.2f}", f"{one['speed_deg_s']:.1f} deg/s",
            str(one["samples"]), f"{one['in_gaps']:.1%}",
        ]
        if "turns" in one
        else [one["pass"], one["source"], "", "", str(one["samples"]), ""]
        for one in found.passes
    ]  # fmt: skip
    out.say(f"written to {out_dir / 'raw'}", TableText([head, *rows], left=["pass", "from"]))
    out.result(
        {
            "ok": True,
            "passes": found.passes,
            "torque_lag_s": found.torque_lag_s,
            "notes": found.notes,
        }
    )
