"""`cdpr bus scan`: who is on a bus."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated, Any

import typer

from drivers.bus import BusUrl
from profiles import DriveProfile
from tools.busview.fit import drive_profiles
from tools.busview.identifiers import parse_node_ids
from tools.busview.roster import entry, lines, master_signs, there
from tools.busview.scan import LISTEN_S, Scan
from tools.busview.source import named_bus
from tools.commands.options import JsonOption
from tools.errors import WorkFailedError
from tools.output import Output


def add(app: typer.Typer) -> None:
    """Add the command to the group `cdpr bus`."""
    app.command("scan")(scan)


def scan(
    bus: Annotated[
        list[str], typer.Option("--bus", help="simbus:NAME, socketcan:can0, ...", metavar="URL")
    ],
    nodes: Annotated[
        str, typer.Option("--nodes", help="Node ids to ask, as 1-127 or 1,5,20-23.")
    ] = "1-127",
    profiles: Annotated[
        Path | None, typer.Option("--profiles", help="Folder with drive profiles of your own.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Also while another master makes SDO transfers.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Tell who is on one or several buses: state, identity, modes, profile; reads only."""
    out = Output(as_json)
    urls = [named_bus(text) for text in bus]
    node_ids = parse_node_ids(nodes)
    drives = drive_profiles(profiles)
    with ThreadPoolExecutor(len(urls)) as pool:
        visits = [pool.submit(_visit, url, node_ids, drives, force) for url in urls]
    told = [visit.result() for visit in visits]
    for one in told:
        count = len(one["nodes"])
        out.say(f"{one['bus']}: {count or 'no'} node{'s' if count != 1 else ''}")
        for line in lines(one["nodes"]) if count else [_NOBODY]:
            out.say(line)
        if one["warning"]:
            out.say(f"! {one['warning']}")
    out.result({"ok": True, "buses": told})


_NOBODY = "nobody answers: check power, wiring, termination, bit rate and node ids"


def _visit(
    url: BusUrl, node_ids: list[int], drives: dict[str, DriveProfile], force: bool
) -> dict[str, Any]:
    """Scan one bus; raises WorkFailedError where another master is in the way."""
    begun = time.monotonic()
    with Scan(url, node_ids) as scan_:
        scan_.listen(LISTEN_S)
        if scan_.traffic.sdo_requests and not force:
            raise WorkFailedError(
                f"{url}: another master is busy with {master_signs(scan_.traffic)}: answers to our "
                "requests would reach it as well, in the middle of its own transfers; wait until "
                "it is done, or use --force"
            )
        scan_.ask()
    signs = master_signs(scan_.traffic)
    warning = f"a master is at work ({signs}); the scan has only read" if signs else ""
    return {
        "bus": str(url),
        "nodes": [entry(found, drives) for found in there(scan_.found)],
        "warning": warning,
        "seconds": time.monotonic() - begun,
    }
