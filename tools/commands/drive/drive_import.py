"""`cdpr drive import`: a drive profile from the maker's EDS or DCF."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_profiles import load_drive
from cdpr_profiles.eds.eds_check import EdsFile, read_eds
from cdpr_profiles.eds.eds_text import MOST_EDS_BYTES
from cdpr_profiles.reading.bounded_input import read_bytes
from cdpr_tools.commands.options import JsonOption
from cdpr_tools.drive_import.files import eds_text, profile_text
from cdpr_tools.drive_import.proposal import Proposal, propose
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output

_SUFFIXES = (".eds", ".dcf")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", re.ASCII)


app = typer.Typer()


@app.command("import")
def import_drive(
    file: Annotated[Path, typer.Argument(help="EDS or DCF of the drive.", metavar="FILE")],
    out_dir: Annotated[Path, typer.Option("--out", help="Folder for the profile.")] = Path(),
    name: Annotated[str | None, typer.Option(help="Name of the profile; else the file's.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Make a drive profile from an EDS or DCF, and list what it could not know."""
    out = Output(as_json)
    suffix = file.suffix.lower()
    if suffix not in _SUFFIXES:
        raise BadInputError(f"{file}: allowed: a file *.eds or *.dcf")
    stem = _profile_name(file, name)
    eds = read_eds(file)
    made = propose(eds)
    content, rewritten = eds_text(eds)
    profile, copy = _write(file, out_dir, stem, suffix, content, made)
    load_drive(profile)
    _show(out, eds, made, profile, copy, rewritten)
    out.result(
        {
            "ok": True,
            "profile": profile,
            "eds": copy,
            "eds_rewritten": rewritten,
            "remarks": eds.remarks.texts,
            "facts": {
                key: {"value": made.table[key], "status": status, "how": how}
                for key, (status, how) in made.verified.items()
            },
            "unknown": [dataclasses.asdict(unknown) for unknown in made.unknown],
            "node_id": eds.node_id,
            "bitrate_bit_s": eds.bitrate_bit_s,
        }
    )


def _profile_name(file: Path, name: str | None) -> str:
    if name is None:
        name = re.sub(r"[^a-z0-9]+", "-", file.stem.lower()).strip("-") or "drive"
    elif not _NAME.fullmatch(name):
        raise BadInputError(
            f"--name {name}: allowed: up to 64 letters, digits, '_', '.' and '-', the first a "
            "letter or digit"
        )
    return name


def _write(
    file: Path, folder: Path, stem: str, suffix: str, content: bytes, made: Proposal
) -> tuple[Path, Path]:
    """Write profile and EDS; neither replaces a file that is there."""
    profile, copy = folder / f"{stem}.toml", folder / f"{stem}{suffix}"
    is_source = copy.exists() and copy.samefile(file)
    if is_source and content == read_bytes(file, MOST_EDS_BYTES):
        writes: list[tuple[Path, bytes]] = []
    else:
        copy = folder / f"{stem}-mended{suffix}" if is_source else copy
        writes = [(copy, content)]
    writes.append((profile, profile_text(made, copy.name, file.name).encode("utf-8")))
    for path, _ in writes:
        if path.exists():
            raise BadInputError(f"{path}: is there already; choose another --name or --out")
    with os_error_as(WorkFailedError, f"{folder}: cannot be written"):
        folder.mkdir(parents=True, exist_ok=True)
        for path, written in writes:
            path.write_bytes(written)
    return profile, copy


def _show(
    out: Output, eds: EdsFile, made: Proposal, profile: Path, copy: Path, rewritten: bool
) -> None:
    texts = eds.remarks.texts
    if texts:
        count = len(texts) + eds.remarks.omitted
        out.say(f"{eds.path}: {count} remark{'s' * (count != 1)}")
        for text in texts:
            out.say(f"  {text}")
        out.say("")
    for key, (status, how) in made.verified.items():
        out.say(f"{key:23} {_shown(key, made.table[key]):43} {status}: {how}")
    out.say("")
    out.say("What the file cannot tell:")
    for unknown in made.unknown:
        out.say(f"  {unknown.what}")
        out.say(f"      {unknown.why}")
        out.say(f"      to find out: {unknown.how}")
    out.say("")
    suggested = {"node_id": eds.node_id, "bitrate_bit_s": eds.bitrate_bit_s}
    if values := ", ".join(f"{key} = {one}" for key, one in suggested.items() if one is not None):
        out.say(f"for the winch's file: {values}")
    out.say(f"{copy}" + (": rewritten, its flaws mended" if rewritten else ": as it was"))
    out.say(f"{profile}: name it as `drive` in your winch's file")


def _shown(key: str, value: Any) -> str:
    if key in ("rpdos", "tpdos"):
        return "; ".join(
            f"{pdo['number']}: " + " ".join(f"{e['index']:04X}h" for e in pdo["entries"])
            for pdo in value
        )
    if key in ("vendor_id", "product_code", "revision"):
        return f"{value:08X}h"
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)
