"""`cdpr log`: what is in the daemon's recordings, as figures, tables and pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_tools.commands.options import JsonOption, written_as
from cdpr_tools.output import Output
from cdpr_tools.recordings.export import check_target, export
from cdpr_tools.recordings.selection import Selection, fields_of, files_of
from cdpr_tools.recordings.summary import summarise, summary_lines

app = typer.Typer(
    name="log",
    help="The daemon's recordings: what is in them, as tables and pictures.",
    no_args_is_help=True,
)

_FilesArgument = Annotated[
    list[Path], typer.Argument(help="Recordings (*.mcap), or a folder of them.", metavar="FILE")
]
_FromOption = Annotated[
    float, typer.Option("--from", help="Begin so many seconds after the first cycle.", min=0.0)
]
_UntilOption = Annotated[
    float,
    typer.Option(
        "--until",
        help="End so many seconds after the first cycle; with the last one by default.",
        show_default=False,
    ),
]
_EVENTS_SHOWN = 30


@app.command()
def info(files: _FilesArgument, as_json: JsonOption = False) -> None:
    """Summarise recordings: duration, events, gaps, and how they ended."""
    out = Output(as_json)
    results = []
    for path in files_of(files):
        results.append(summarise(path, out))
        out.say(*summary_lines(results[-1], _EVENTS_SHOWN))
    out.result({"ok": True, "recordings": results})


@app.command("export")
def export_command(
    files: _FilesArgument,
    target: Annotated[Path, typer.Option("--out", help="A name ending in .csv or .parquet.")],
    fields: Annotated[
        str | None, typer.Option(help="Only these fields, with commas; all by default.")
    ] = None,
    from_s: _FromOption = 0.0,
    until_s: _UntilOption = float("inf"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the target.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write the cycles of recordings, one after the other, into one table."""
    out = Output(as_json)
    check_target(target, overwrite)
    selection = Selection(files, fields_of(fields), from_s, until_s)
    with out.progress(target.name, selection.reading_s) as selection.advance:
        rows = export(selection, target)
    out.say(f"{target}: {rows} rows")
    out.result({"ok": True, "out": target, "rows": rows})


@app.command()
def plot(
    files: _FilesArgument,
    target: Annotated[
        Path | None,
        typer.Option(
            "--png",
            "--out",
            metavar="FILE",
            help="Draw it into NAME.png; beside FILE by default.",
            callback=written_as(".png"),
        ),
    ] = None,
    axis: Annotated[list[str] | None, typer.Option(help="Only this axis; may be repeated.")] = None,
    from_s: _FromOption = 0.0,
    until_s: _UntilOption = float("inf"),
    as_json: JsonOption = False,
) -> None:
    """Draw motion, torques, tensions and the timing of the cycles into a picture."""
    out = Output(as_json)
    path = target or files_of(files)[0].with_suffix(".png")
    with out.stage("loading what draws", quick=True):
        from cdpr_tools.recordings.picture import FIELDS, draw  # noqa: PLC0415  # slow to load

    selection = Selection(files, FIELDS, from_s, until_s)
    with out.progress(path.name, selection.reading_s) as selection.advance:
        columns = selection.columns()
    with out.stage(f"{path.name}: drawing", quick=True):
        rows = draw(selection, columns, axis, path)
    out.say(f"{path}: {rows} cycles")
    out.result({"ok": True, "out": path, "rows": rows})
