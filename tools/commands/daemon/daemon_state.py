"""`cdpr status|check|enable|disable|hold|ack|stop`: a daemon's state, and changes of it."""

from __future__ import annotations

import time
from typing import Annotated, Any

import typer
from rich.live import Live
from rich.text import Text

from cdpr_tools.client.client import Daemon, NoDaemonError, open_daemon
from cdpr_tools.client.motion import ProgressNotes
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.client.status_text import (
    DEAD,
    after_stop_text,
    fallen_text,
    has_died,
    status_text,
    unheard_axes,
)
from cdpr_tools.commands.daemon.with_daemon import with_daemon, with_daemon_at_once
from cdpr_tools.commands.options import (
    JsonOption,
    KeyFileOption,
    RobotOption,
    SocketOption,
    UrlOption,
    YesOption,
)
from cdpr_tools.consent import require_consent
from cdpr_tools.daemon.estop import end_leftover_processes
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.signals import stop_on_signals

_WATCH_S = 0.2
_END_S = 90.0
_BOOT_S = 60.0
_BOOTING = ("unconfigured", "inactive")


app = typer.Typer()


@app.command()
@with_daemon_at_once
def status(
    daemon: Daemon,
    out: Output,
    watch: Annotated[
        bool, typer.Option("--watch", help="Show it continuously until Ctrl-C.")
    ] = False,
) -> None:
    """Show the state of a daemon and its robot; changes nothing."""
    state = daemon.get("/status")
    if watch:
        state = _watch(daemon, out, state)
    else:
        for part in status_text(state).renderables:
            out.text.print(part, soft_wrap=True)
    out.result({"ok": state["state"] not in ("fault", "dead"), **state})


def _watch(daemon: Daemon, out: Output, state: dict[str, Any]) -> dict[str, Any]:
    """Show the status over and over; a service that is started anew meanwhile is waited for."""
    with (
        stop_on_signals() as stop_requested,
        Live(status_text(state), console=out.text, auto_refresh=False) as view,
    ):
        while not stop_requested():
            time.sleep(_WATCH_S)
            try:
                state = daemon.get("/status")
            except NoDaemonError as error:
                view.update(Text(str(error), style="red"), refresh=True)
            else:
                view.update(status_text(state), refresh=True)
    return state


@app.command()
@with_daemon
def check(daemon: Daemon, out: Output) -> None:
    """Boot the drives anew and check the bus without power; ready afterwards."""
    if daemon.get("/status")["state"] in ("unconfigured", "inactive"):
        daemon.post("/configure")
    _show(out, daemon.post("/check"))


@app.command()
@with_daemon
def enable(
    daemon: Daemon,
    out: Output,
    program: Annotated[
        str, typer.Option(help="Program that runs as soon as there is power.")
    ] = "hold",
    yes: YesOption = False,
) -> None:
    """Give the drives power; they hold where they are.

    Where they have it already nothing changes.
    """
    status = _booted(daemon, out)
    if status["state"] == "active":
        _require_no_stop(status)
        out.say(f"has power already, program {status['program']}", *_next(status))
        out.result({"ok": True, "state": "active", "text": ""})
        return
    _confirm(status, yes)
    with daemon.control() as control:
        answer = control.post("/enable", {"program": program})
    _show(out, answer, *_next(daemon.get("/status")))


def _require_no_stop(status: dict[str, Any]) -> None:
    """Raise WorkFailedError of a robot that is being stopped: what is asked for would be undone."""
    if (reaction := str(status.get("reacting", "none"))) != "none":
        reason = f": {status['reason']}" if status["reason"] else ""
        raise WorkFailedError(
            f"the robot is being stopped, {reaction} under way{reason}; `cdpr status` says when it "
            "has ended"
        )


def _next(status: dict[str, Any]) -> list[str]:
    """Return what a platform that has power and is not held yet takes to be moved."""
    progress = status.get("program_progress") or {}
    if progress.get("tight") is not False or status["program"] != "hold":
        return []
    fallen = fallen_text(status)
    return [f"cables loose{fallen or '; next: `cdpr tighten`, then it can be moved'}"]


def _booted(daemon: Daemon, out: Output) -> dict[str, Any]:
    """Return the status once the drives have booted, or why they have not is known."""
    deadline, announced = time.monotonic() + _BOOT_S, False
    while (status := daemon.get("/status"))["state"] in _BOOTING and not status["reason"]:
        if time.monotonic() > deadline:
            break
        if not announced:
            out.note("the drives are still booting ...")
        announced = True
        time.sleep(_WATCH_S)
    return status


@app.command()
@with_daemon_at_once
def disable(daemon: Daemon, out: Output) -> None:
    """Stop the motion under control, then take the power off.

    Where a fault has done so already nothing changes.
    """
    try:
        answer = daemon.post("/disable")
    except DaemonRefusalError as error:
        refusal = error.refusal
        if refusal is None or refusal.arguments.get("state") != "fault":
            raise
        answer = {"state": "fault", "text": daemon.get("/status")["reason"]}
        _show(out, answer, "stopped by it already; next: `cdpr ack`, once its cause is gone")
        return
    _show(out, answer)


@app.command()
@with_daemon_at_once
def hold(daemon: Daemon, out: Output) -> None:
    """Stop the motion and stay there, whoever moves; the power stays on."""
    _show(out, daemon.post("/hold"))


@app.command()
@with_daemon
def ack(daemon: Daemon, out: Output) -> None:
    """Acknowledge a fault whose cause is gone; nothing gets power by it."""
    status = daemon.get("/status")
    if (state := status["state"]) in ("ready", "active"):
        _require_no_stop(status)
        out.say("no fault to acknowledge")
        out.result({"ok": True, "state": state, "text": ""})
        return
    _show(out, daemon.post("/acknowledge"))


@app.command()
def stop(
    robot: RobotOption = None,
    socket: SocketOption = None,
    url: UrlOption = None,
    key_file: KeyFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """End the daemon: the motion stops under control, the power goes off.

    Ends with status 0 where the drives have no power by it, or nothing ran; with 1 where its loop
    had died, or dies meanwhile, a drive was not heard, whose power may be on, or it does not end.
    """
    out = Output(as_json)
    try:
        with open_daemon(robot, socket, url, key_file) as daemon:
            _end(daemon, out)
    except NoDaemonError:
        left = [] if url is not None else end_leftover_processes(robot, socket)
        out.say(*left or ["nothing runs"])
    out.result({"ok": True})


def _end(daemon: Daemon, out: Output) -> None:
    """Ask the daemon to end and wait for it; raises WorkFailedError where it does not."""
    status = daemon.get("/status")
    had_died, ended, dies = has_died(status), status, ""
    daemon.post("/shutdown")
    notes, deadline = ProgressNotes(out, status), time.monotonic() + _END_S
    if status["state"] == "active":
        out.note("stopping: what moves is brought to rest, then the power goes off ...")
    while time.monotonic() < deadline:
        try:
            status = daemon.get("/status")
        except NoDaemonError:
            told = "; ".join(filter(None, (after_stop_text(ended), dies)))
            if had_died or dies or unheard_axes(ended):
                raise WorkFailedError(told) from None
            out.say(told)
            return
        if has_died(status) and not had_died and not dies:
            # one whose drives do not confirm ends with an error, and the service stays for that;
            # one that ends as asked may be seen before the service ends as well
            dies = str(status["reason"])
            daemon.post("/shutdown")
        if not had_died:
            if status["state"] != DEAD:  # a drive may have fallen silent meanwhile
                ended = status
            notes(str(status["program"]), status.get("program_progress") or {})
        time.sleep(_WATCH_S)
    raise WorkFailedError(f"the daemon still runs {_END_S:g} s after it was asked to end")


def _show(out: Output, answer: dict[str, Any], *more: str) -> None:
    out.say(answer["state"] + (f": {answer['text']}" if answer["text"] else ""), *more)
    out.result({"ok": True, **answer})


def _confirm(state: dict[str, Any], yes: bool) -> None:
    """Ask before motors on a real bus get power."""
    urls = [str(bus.get("url", "")) for bus in state.get("buses", {}).values()]
    real = [url for url in urls if not url.startswith("simbus:")]
    if real or not urls:
        where = " and ".join(real) or "its buses"
        require_consent(f"{state['robot']} on {where}: the drives get power.", yes)
