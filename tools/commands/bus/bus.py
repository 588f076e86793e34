"""`cdpr bus`: look at a CAN bus: who is there, what is said, whether it fits."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drivers.bus import Filters
from cdpr_drivers.errors import BusError
from cdpr_tools.busview.identifiers import filters, parse_identifiers
from cdpr_tools.busview.known import known_bus
from cdpr_tools.busview.monitor import LineWriter, LogFile, Viewer, watch
from cdpr_tools.busview.replay import BLOCK, Pacer, Sender, check, filtered, play, read_frames
from cdpr_tools.busview.source import SimbusSource, open_source, running_bus
from cdpr_tools.busview.summary import Summary
from cdpr_tools.commands.bus import bus_budget, bus_scan
from cdpr_tools.commands.options import JsonOption, YesOption
from cdpr_tools.consent import require_consent
from cdpr_tools.output import Output
from cdpr_tools.signals import stop_on_signals

app = typer.Typer(name="bus", help="Look at a CAN bus.", no_args_is_help=True)
app.add_typer(bus_scan.app)
app.add_typer(bus_budget.app)

_LATE_S = 0.05
"""For how long frames that the bus has counted may be under way to us."""


@app.callback()
def _group() -> None:
    """Look at a CAN bus."""


_BusOption = Annotated[
    str, typer.Option("--bus", help="simbus:NAME, socketcan:can0, ...", metavar="URL")
]
_ProfileOption = Annotated[
    str | None, typer.Option("--profile", help="Decode every node as this drive.", metavar="DRIVE")
]
_WinchOption = Annotated[
    str | None, typer.Option("--winch", help="Decode the node of this winch, with its ratings.")
]
_RobotOption = Annotated[
    str | None,
    typer.Option("--robot", help="Decode this robot's nodes; ROBOT:BUS for one of its buses."),
]
_IdsOption = Annotated[
    str | None,
    typer.Option("--ids", help="Only these identifiers, hexadecimal: 181,700-77F", metavar="IDS"),
]
_RawOption = Annotated[bool, typer.Option("--raw", help="Print candump lines, undecoded.")]


@app.command()
def monitor(
    bus: _BusOption,
    profile: _ProfileOption = None,
    winch: _WinchOption = None,
    robot: _RobotOption = None,
    ids: _IdsOption = None,
    log: Annotated[
        Path | None, typer.Option("--log", help="Log all frames to this file, in candump format.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--seconds", min=0.1, help="End after this many seconds.")
    ] = None,
    raw: _RawOption = False,
    as_json: JsonOption = False,
) -> None:
    """Show what is said on a bus, decoded, until Ctrl-C; only listens."""
    out = Output(as_json)
    url = running_bus(bus)
    known = known_bus(url, profile, winch, robot)
    summary = Summary(known.bitrate_bit_s)
    with ExitStack() as stack:
        stack.callback(_show, out, summary)
        lines = stack.enter_context(LineWriter(sys.stderr if as_json else sys.stdout))
        viewer = Viewer(known.decoder(), summary, lines, raw=raw)
        source = open_source(url, _filters(ids))
        stack.callback(source.close)
        file = None if log is None else stack.enter_context(LogFile(log))
        stop_wanted = stack.enter_context(stop_on_signals())
        watch(source, viewer, file, seconds, stop_wanted)
        if isinstance(source, SimbusSource):
            _ask_bus(source, summary)
    if source.lost is not None:
        raise source.lost
    if not summary.frames:
        out.note("nothing was heard")
    out.result({"ok": True, "bus": str(url), "log": log, **summary.table()})


@app.command()
def replay(
    file: Annotated[
        Path, typer.Argument(help="Log of candump, or another that python-can reads; - for stdin.")
    ],
    profile: _ProfileOption = None,
    winch: _WinchOption = None,
    robot: _RobotOption = None,
    ids: _IdsOption = None,
    channel: Annotated[
        str | None, typer.Option("--channel", help="Which bus, where the file holds several.")
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed",
            min=0.001,
            help="Speed factor of the replay; by default 1 with --to, else without waiting.",
        ),
    ] = None,
    to: Annotated[
        str | None, typer.Option("--to", help="Also send all of it to this bus.", metavar="URL")
    ] = None,
    raw: _RawOption = False,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Show a recorded session as the monitor does, or send it to a bus again."""
    out = Output(as_json)
    known = known_bus(None, profile, winch, robot)
    wanted = None if ids is None else parse_identifiers(ids)
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
        stop_wanted = stack.enter_context(stop_on_signals())
        frames = filtered(read_frames(file, channel), wanted)
        if url is None:
            whole = speed is None and str(file) != "-"
            pacer = Pacer(speed, stop_wanted)
            play(frames, viewer, pacer, stop_wanted, block=BLOCK if whole else 1)
            sent: dict[str, int] = {}
        else:
            sender = stack.enter_context(Sender(url, out.note))
            play(frames, viewer, Pacer(speed or 1.0, stop_wanted), stop_wanted, sender)
            sent = {"sent": sender.sent, "not_sent": sender.not_sent}
    out.result({"ok": True, "file": file, **sent, **summary.table()})


def _filters(ids: str | None) -> Filters | None:
    return None if ids is None else filters(parse_identifiers(ids))


def _ask_bus(source: SimbusSource, summary: Summary) -> None:
    """Complete the summary by what a simulated bus tells: its time, and what we missed."""
    try:
        if source.lost is not None:
            raise source.lost
        passed = source.ask()
    except BusError:
        summary.untimed = True  # it has ended, and its time with it
        return
    summary.time_s, summary.led = passed["bus_time_s"], bool(passed["led"])
    if source.seen is None:
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
