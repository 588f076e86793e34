"""`cdpr bus`: show the nodes and the traffic of a CAN bus, and check its load."""

from __future__ import annotations

import math
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.budget import BusBudget, machine_budget
from cdpr_drivers.errors import BusError
from cdpr_drivers.robot.robot_buses import refusal
from cdpr_profiles import DriveProfile, load_winch_or_robot
from cdpr_profiles.errors import printable
from cdpr_tools.busview.monitor import (
    FrameSource,
    LineWriter,
    LogFile,
    Summary,
    Viewer,
    filters,
    known_bus,
    parse_identifiers,
    parse_node_ids,
    running_bus,
    watch,
)
from cdpr_tools.busview.replay import BLOCK, Pacer, Sender, check, filtered, play, read_frames
from cdpr_tools.busview.scan import (
    LISTEN_S,
    Scan,
    drive_profiles,
    entry,
    lines,
    responding,
    signs_of_a_master,
)
from cdpr_tools.commands import options
from cdpr_tools.commands.options import argument, option
from cdpr_tools.consent import require_consent
from cdpr_tools.errors import BAD_INPUT, WorkFailedError
from cdpr_tools.output import Output, TableText
from cdpr_tools.signals import stop_on_signals

app = typer.Typer(
    name="bus", help="Look at the traffic and the devices of a CAN bus.", no_args_is_help=True
)

_LATE_S = 0.05
"""Longest delay until frames that the bus has counted arrive here."""


_ProfileOption = Annotated[
    str | None, option("Decode every node as this drive.", "--profile", metavar="DRIVE")
]
_WinchOption = Annotated[
    str | None, option("Decode the node of this winch, with its ratings.", "--winch")
]
_RobotOption = Annotated[
    str | None, option("Decode this robot's nodes; ROBOT:BUS for one of its buses.", "--robot")
]
_IdsOption = Annotated[
    str | None, option("Only these identifiers, hexadecimal: 181,700-77F", "--ids", metavar="IDS")
]
_RawOption = Annotated[bool, option("Print candump lines, undecoded.", "--raw")]


@app.command()
def monitor(
    bus: Annotated[str, option("simbus:NAME, socketcan:can0, ...", "--bus", metavar="URL")],
    profile: _ProfileOption = None,
    winch: _WinchOption = None,
    robot: _RobotOption = None,
    ids: _IdsOption = None,
    log: Annotated[
        Path | None, option("Log all frames to this file, in candump format.", "--log")
    ] = None,
    seconds: Annotated[
        float | None, option("End after this many seconds.", "--seconds", min=0.1)
    ] = None,
    raw: _RawOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Show the decoded traffic of a bus until Ctrl-C; only listens."""
    out = Output(as_json)
    url = running_bus(bus)
    known = known_bus(url, profile, winch, robot)
    summary = Summary(known.bitrate_bit_s)
    with ExitStack() as stack:
        stack.callback(_show, out, summary)
        lines = stack.enter_context(LineWriter(sys.stderr if as_json else sys.stdout))
        viewer = Viewer(known.decoder(), summary, lines, raw=raw)
        source = FrameSource(url, None if ids is None else filters(parse_identifiers(ids)))
        stack.callback(source.close)
        file = None if log is None else stack.enter_context(LogFile(log))
        stop_requested = stack.enter_context(stop_on_signals())
        watch(source, viewer, file, seconds, stop_requested)
        _ask_bus(source, summary, all_seen=ids is None)
    if source.lost is not None:
        raise source.lost
    if not summary.frames:
        out.note("no frames were received")
    out.result({"ok": True, "bus": str(url), "log": log, **summary.table()})


@app.command()
def replay(
    file: Annotated[
        Path, argument("Log of candump, or another that python-can reads; - for stdin.")
    ],
    profile: _ProfileOption = None,
    winch: _WinchOption = None,
    robot: _RobotOption = None,
    ids: _IdsOption = None,
    channel: Annotated[
        str | None, option("Bus to replay, if the file contains several.", "--channel")
    ] = None,
    speed: Annotated[
        float | None,
        option(
            "Speed factor of the replay; by default 1 with --to, else without waiting.",
            "--speed",
            min=0.001,
        ),
    ] = None,
    to: Annotated[
        str | None, option("Also send all frames to this bus.", "--to", metavar="URL")
    ] = None,
    raw: _RawOption = False,
    yes: options.YesOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Show a recorded session as the monitor does, or send it to a bus again."""
    out = Output(as_json)
    known = known_bus(None, profile, winch, robot)
    identifiers = None if ids is None else parse_identifiers(ids)
    url = None if to is None else running_bus(to)
    if url is not None:
        check(file, channel)
        what = f"the recorded frames are sent to {url}, commands to motors among them."
        require_consent(what, yes or url.is_simulated)
    summary = Summary(known.bitrate_bit_s)
    with ExitStack() as stack:
        stack.callback(_show, out, summary)
        lines = stack.enter_context(LineWriter(sys.stderr if as_json else sys.stdout))
        viewer = Viewer(known.decoder(), summary, lines, raw=raw)
        stop_requested = stack.enter_context(stop_on_signals())
        frames = filtered(read_frames(file, channel), identifiers)
        if url is None:
            whole = speed is None and str(file) != "-"
            pacer = Pacer(speed, stop_requested)
            play(frames, viewer, pacer, stop_requested, block=BLOCK if whole else 1)
            sent: dict[str, int] = {}
        else:
            sender = stack.enter_context(Sender(url, out.note))
            play(frames, viewer, Pacer(speed or 1.0, stop_requested), stop_requested, sender)
            sent = {"sent": sender.sent, "not_sent": sender.not_sent}
    out.result({"ok": True, "file": file, **sent, **summary.table()})


def _ask_bus(source: FrameSource, summary: Summary, *, all_seen: bool) -> None:
    """Add to the summary what a simulated bus reports: its time, and the missed frames.

    `all_seen` means that no filter removed frames.
    """
    try:
        passed = source.ask()
    except BusError:
        summary.untimed = True  # the bus has ended, so its time is unknown
        return
    if passed is None:
        return
    summary.time_s, summary.led = passed["bus_time_s"], bool(passed["led"])
    if not all_seen:
        return
    before = -1
    while before < source.seen < passed["frames"]:
        before = source.seen
        source.receive(_LATE_S)
    summary.missed = max(0, int(passed["frames"]) - source.seen)


def _show(out: Output, summary: Summary) -> None:
    if not summary.frames:
        return
    for line in summary.lines():
        out.note(line)


@app.command()
def scan(
    bus: Annotated[list[str], option("simbus:NAME, socketcan:can0, ...", "--bus", metavar="URL")],
    nodes: Annotated[
        str, option("Node ids to ask, such as 1-127 or 1,5,20-23.", "--nodes")
    ] = "1-127",
    profiles: Annotated[
        Path | None, option("Folder with drive profiles of your own.", "--profiles")
    ] = None,
    force: Annotated[
        bool, option("Scan even while another master makes SDO transfers.", "--force")
    ] = False,
    as_json: options.JsonOption = False,
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


_NOBODY = "no node answers: check power, wiring, termination, bit rate and node ids"


def _visit(
    url: BusUrl, node_ids: list[int], drives: dict[str, DriveProfile], force: bool
) -> dict[str, Any]:
    """Scan one bus; raises WorkFailedError if another master uses it."""
    begun = time.monotonic()
    with Scan(url, node_ids) as scan_:
        scan_.listen(LISTEN_S)
        if scan_.traffic.sdo_requests and not force:
            raise WorkFailedError(
                f"{url}: another master is busy with {signs_of_a_master(scan_.traffic)}: it would "
                "also receive our answers during its transfers; wait until it has finished, or use "
                "--force"
            )
        scan_.ask()
    signs = signs_of_a_master(scan_.traffic)
    warning = f"another master is active ({signs}); the scan only read" if signs else ""
    return {
        "bus": str(url),
        "nodes": [entry(found, drives) for found in responding(scan_.found)],
        "warning": warning,
        "seconds": time.monotonic() - begun,
    }


_US = 1e6
_LOW, _HIGH = 1.0, 10_000.0


@app.command()
def budget(
    machine: options.RobotOrWinchArgument,
    rate: Annotated[
        float | None, option("Cycles per second; default: as in the profile.", min=_LOW, max=_HIGH)
    ] = None,
    as_json: options.JsonOption = False,
) -> None:
    """Compute the worst-case time of the cycle on each bus, the highest rate, and the time left.

    The exit status is 2 if the cycle does not fit.
    """
    out = Output(as_json)
    profile = load_winch_or_robot(machine)
    period_s = None if rate is None else 1.0 / rate
    budgets = machine_budget(profile, period_s)
    out.say(*_report(profile.name, budgets))
    reason = refusal(budgets)
    figures = {"rate_Hz": 1.0 / budgets[0].period_s, "buses": [_figures(b) for b in budgets]}
    if reason:
        typer.echo(printable(f"cdpr: {profile.path}: {reason}"), err=True)
        out.result({"ok": False, "error": reason, "exit_status": BAD_INPUT, **figures})
        raise typer.Exit(BAD_INPUT)
    out.result({"ok": True, **figures})


def _figures(budget: BusBudget) -> dict[str, Any]:
    return {
        "bus": budget.bus,
        "bitrate_bit_s": budget.bitrate_bit_s,
        "nodes": budget.nodes,
        "period_us": round(budget.period_s * _US, 3),
        "cycle_us": round(budget.cycle_s * _US, 3),
        "cycle_without_stuffing_us": round(budget.bare_cycle_s * _US, 3),
        "heartbeats_us_per_cycle": round(budget.heartbeat_share * budget.period_s * _US, 3),
        "margin_us": round(budget.margin_s * _US, 3),
        "cycle_limit_Hz": round(budget.cycle_limit_Hz, 2),
        "highest_rate_Hz": math.floor(budget.highest_rate_Hz * 100) / 100,
        "sdo_transfers_per_s": round(budget.sdo_transfers_s, 1),
        "changes_us": round(budget.changes_s * _US, 3),
        "changes_seen_after_cycles": budget.recovery_cycles,
        "longest_wait_of_sync_us": round(budget.longest_wait_s * _US, 3),
        "fits": budget.fits,
    }


def _report(name: str, budgets: list[BusBudget]) -> list[str]:
    period_s = budgets[0].period_s
    titles = "bit/s", "drives", "cycle, us", "unstuffed", "share", "left, us", "highest"
    rows = [["bus", *titles]]
    for b in budgets:
        cells = (
            f"{b.bitrate_bit_s}",
            f"{len(b.nodes)}",
            f"{b.cycle_s * _US:.0f}",
            f"{b.bare_cycle_s * _US:.0f}",
            f"{b.cycle_s / b.period_s:.1%}",
            f"{b.margin_s * _US:.1f}",
            f"{math.floor(b.highest_rate_Hz)} Hz",
        )
        rows.append([b.bus, *cells])
    head = f"{name} at {1.0 / period_s:.6g} Hz: {period_s * _US:.0f} us a cycle"
    return [head, TableText(rows), *(_explanation(b) for b in budgets if b.fits)]


def _explanation(b: BusBudget) -> str:
    """Return what needs the remaining time, as text."""
    text = (
        f"{b.bus}: heartbeats take {b.heartbeat_share * b.period_s * _US:.1f} us per "
        f"cycle; the remaining time is for computing, EMCY and {b.sdo_transfers_s:.0f} "
        "SDO transfers a second"
    )
    if b.changes_s and math.isfinite(b.recovery_cycles):
        cycles = f"{b.recovery_cycles:.0f} cycle{'s' if b.recovery_cycles > 1 else ''}"
        text += f", and the master sees changes in all drives within {cycles}"
    return text + f"; SYNC may come up to {b.longest_wait_s * _US:.0f} us late"
