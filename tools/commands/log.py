"""`cdpr log`: show the daemon's recordings as figures, tables and pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_rt.service.retention import size_text
from cdpr_tools.commands.options import JsonOption, argument, option, written_as
from cdpr_tools.daemon.paths import default_recordings
from cdpr_tools.errors import BadInputError, os_error_as
from cdpr_tools.output import Output, TableText
from cdpr_tools.recordings.selection import (
    Selection,
    check_target,
    export,
    fields_of,
    files_of,
    is_being_written,
    sessions,
)
from cdpr_tools.recordings.summary import summarise, summary_lines

app = typer.Typer(
    name="log",
    help="List, plot and export recordings.",
    no_args_is_help=True,
)

_FilesArgument = Annotated[
    list[Path] | None,
    argument(
        "Recordings (*.mcap), a folder of them, or a session that `cdpr log list` names; default: "
        "the newest session.",
        metavar="[FILE]",
    ),
]
_FromOption = Annotated[
    float, option("Begin this many seconds after the first cycle.", "--from", min=0.0)
]
_UntilOption = Annotated[
    float,
    option(
        "End this many seconds after the first cycle; default: the last cycle.",
        "--until",
        show_default=False,
    ),
]
_EVENTS_SHOWN = 30


@app.command("list")
def list_command(
    folder: Annotated[
        Path | None,
        argument("Folder of recordings; default: that of `cdpr run`.", metavar="[FOLDER]"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the recorded sessions, newest last."""
    out = Output(as_json)
    where = folder or default_recordings()
    found: list[dict[str, Any]] = []
    if folder is None and not any(where.glob("*.mcap")):
        out.say(f"no recordings in {where}")
        out.result({"ok": True, "folder": where, "sessions": found})
        return
    rows = [["session", "files", "size"]]
    for name, files in sessions(files_of([where])).items():
        with os_error_as(BadInputError, f"{where}: cannot be read"):
            size = sum(path.stat().st_size for path in files)
        count = f"{len(files)} file{'s' if len(files) > 1 else ''}"
        rows.append([name, count, size_text(size)])
        found.append({"session": name, "files": files, "bytes": size})
    out.say(TableText(rows), f"in {where}")
    out.result({"ok": True, "folder": where, "sessions": found})


def _recordings(files: list[Path] | None) -> list[Path]:
    """Return the recordings to read, by default the newest session of `cdpr run`."""
    if files:
        return files_of(files)
    return list(sessions(files_of([default_recordings()])).values())[-1]


@app.command()
def info(files: _FilesArgument = None, as_json: JsonOption = False) -> None:
    """Summarise recordings: duration, events, gaps, and how they ended."""
    out = Output(as_json)
    results = []
    for path in _recordings(files):
        results.append(summarise(path, out))
        out.say(*summary_lines(results[-1], _EVENTS_SHOWN))
    out.result({"ok": True, "recordings": results})


@app.command("export")
def export_command(
    target: Annotated[Path, option("A name ending in .csv or .parquet.", "--out")],
    files: _FilesArgument = None,
    fields: Annotated[
        str | None, option("Only these fields, separated by commas; default: all.")
    ] = None,
    from_s: _FromOption = 0.0,
    until_s: _UntilOption = float("inf"),
    overwrite: Annotated[bool, option("Replace an existing file.", "--overwrite")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write the cycles of recordings, one after the other, into one table."""
    out = Output(as_json)
    check_target(target, overwrite)
    selection = Selection(_recordings(files), fields_of(fields), from_s, until_s)
    with out.progress(target.name, selection.reading_s) as selection.advance:
        rows = export(selection, target)
    out.say(f"{target}: {rows} rows")
    out.result({"ok": True, "out": target, "rows": rows})


@app.command()
def plot(
    files: _FilesArgument = None,
    target: Annotated[
        Path | None,
        option(
            "Draw the recording into NAME.png; default: beside the recording.",
            "--png",
            "--out",
            metavar="FILE",
            callback=written_as(".png"),
        ),
    ] = None,
    axis: Annotated[list[str] | None, option("Only this axis; may be repeated.")] = None,
    every: Annotated[bool, option("Draw all sessions, not the newest.", "--all")] = False,
    from_s: _FromOption = 0.0,
    until_s: _UntilOption = float("inf"),
    as_json: JsonOption = False,
) -> None:
    """Draw motion, torques, tensions and the timing of the cycles into a picture.

    If there are several sessions, it draws the newest.
    """
    out = Output(as_json)
    found = sessions(_recordings(files))
    name = list(found)[-1]
    if len(found) > 1 and not every:
        out.note(f"drawing {name}, the newest of {len(found)} sessions; --all draws all")
        found = {name: found[name]}
    files = [path for some in found.values() for path in some]
    path = target or files[0].with_name(f"{name if len(files) > 1 else files[0].stem}.png")
    with out.stage("loading the plotting library", quick=True):
        from cdpr_tools.recordings.picture import FIELDS, draw  # noqa: PLC0415  # slow to load

    selection = Selection(files, FIELDS, from_s, until_s)
    with out.progress(path.name, selection.reading_s) as selection.advance:
        columns = selection.columns()
    with out.stage(f"{path.name}: drawing", quick=True):
        rows = draw(selection, columns, axis, path)
    live = ", still being recorded" if is_being_written(files[-1]) else ""
    out.say(f"{path}: {rows} cycles{live}")
    out.result({"ok": True, "out": path, "rows": rows})
