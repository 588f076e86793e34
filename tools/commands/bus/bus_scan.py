"""`cdpr bus scan`: who is on a bus."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drivers.bus import BusUrl
from cdpr_profiles import DriveProfile
from cdpr_tools.busview.identifiers import parse_node_ids
from cdpr_tools.busview.profile_match import drive_profiles
from cdpr_tools.busview.roster import entry, lines, responding, signs_of_a_master
from cdpr_tools.busview.scan import LISTEN_S, Scan
from cdpr_tools.busview.source import running_bus
from cdpr_tools.commands.options import JsonOption
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
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
        bool, typer.Option("--force", help="Scan even while another master makes SDO transfers.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """List the nodes on one or several buses: state, identity, modes, profile; reads only."""
    out = Output(as_json)
    urls = [running_bus(text) for text in bus]
    node_ids = parse_node_ids(nodes)
    drives = drive_profiles(profiles)
    with ThreadPoolExecutor(len(urls)) as pool:
        visits = [pool.submit(_visit, url, node_ids, drives, force) for url in urls]
    results = [visit.result() for visit in visits]
    for one in results:
        count = len(one["nodes"])
        out.say(f"{one['bus']}: {count or 'no'} node{'s' if count != 1 else ''}")
        out.say(*(lines(one["nodes"]) if count else [_NOBODY]))
        if one["warning"]:
            out.say(f"! {one['warning']}")
    out.result({"ok": True, "buses": results})


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
                f"{url}: another master is busy with {signs_of_a_master(scan_.traffic)}: "
                "answers to our requests would reach it as well, in the middle of its own "
                "transfers; wait until it is done, or use --force"
            )
        scan_.ask()
    signs = signs_of_a_master(scan_.traffic)
    warning = f"a master is at work ({signs}); the scan has only read" if signs else ""
    return {
        "bus": str(url),
        "nodes": [entry(found, drives) for found in responding(scan_.found)],
        "warning": warning,
        "seconds": time.monotonic() - begun,
    }
