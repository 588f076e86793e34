"""`cdpr status|page|check|enable|disable|hold|ack|stop`: show and change a daemon's state."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Group
from rich.live import Live
from rich.text import Text

from cdpr_tools.client.client import Daemon, live_sockets, open_daemon
from cdpr_tools.client.daemon_end import end_daemon
from cdpr_tools.client.daemon_robot import commanded
from cdpr_tools.client.motion import where_text
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.client.status_text import (
    is_simulated,
    next_steps,
    status_text,
)
from cdpr_tools.commands import options
from cdpr_tools.commands.browser import open_page
from cdpr_tools.commands.options import option
from cdpr_tools.commands.with_daemon import with_daemon, with_daemon_at_once
from cdpr_tools.consent import require_consent
from cdpr_tools.daemon.estop import end_leftover_processes
from cdpr_tools.errors import CommandError, NoDaemonError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.signals import stop_on_signals

_WATCH_S = 0.2
_ANSWER_S = 10.0
"""Timeout of an answer; a slower service counts as hanging, and a signal ends the loop."""
_BOOT_S = 60.0
_BOOTING = ("unconfigured", "inactive")


app = typer.Typer()


@app.command()
@with_daemon_at_once
def status(
    daemon: Daemon,
    out: Output,
    watch: Annotated[bool, option("Show it continuously until Ctrl-C.", "--watch")] = False,
) -> None:
    """Show the state of the daemon and its robot."""
    state = daemon.get("/status")
    if watch:
        state = _watch(daemon, out, state)
    else:
        out.say(*status_text(state))
    out.result({"ok": state["state"] not in ("fault", "dead"), **state})


@app.command()
@with_daemon
def page(
    daemon: Daemon,
    out: Output,
    open_it: Annotated[bool, option("Open it in a browser.", "--open")] = False,
) -> None:
    """Print the address of the robot's page for a browser, or open it.

    The address contains a key: whoever has it may move the robot.
    """
    address = daemon.get("/page-address")
    if open_it:
        open_page(address["url"], out)
    out.say(address["url"])
    out.result(address)


def _watch(daemon: Daemon, out: Output, state: dict[str, Any]) -> dict[str, Any]:
    """Show the status continuously; wait if the service is being restarted."""
    with (
        stop_on_signals() as stop_requested,
        Live(Group(*status_text(state)), console=out.text, auto_refresh=False) as view,
    ):
        while not stop_requested():
            time.sleep(_WATCH_S)
            try:
                state = daemon.get("/status")
            except NoDaemonError as error:
                view.update(Text(str(error), style="red"), refresh=True)
            else:
                view.update(Group(*status_text(state)), refresh=True)
    return state


@app.command()
@with_daemon
def check(daemon: Daemon, out: Output) -> None:
    """Boot the drives again and check the bus, without power."""
    if daemon.get("/status")["state"] in ("unconfigured", "inactive"):
        daemon.post("/configure")
    _show(out, daemon.post("/check"))


@app.command()
@with_daemon
def enable(
    daemon: Daemon,
    out: Output,
    program: Annotated[str, option("Program that runs as soon as there is power.")] = "hold",
    yes: options.YesOption = False,
) -> None:
    """Switch the drives on; they hold their position.

    If they already have power, nothing changes.
    """
    status = _booted(daemon, out)
    if status["state"] == "active":
        _require_no_stop(status)
        out.say(f"already has power, program {status['program']}", *next_steps(status))
        out.result({"ok": True, "state": "active", "text": ""})
        return
    _confirm(status, yes)
    with commanded(daemon) as robot:
        robot.enable(program)
    status = daemon.get("/status")
    _show(out, {"state": status["state"], "text": ""}, *next_steps(status))


def _require_no_stop(status: dict[str, Any]) -> None:
    """Raise WorkFailedError during a stop, because the stop would undo the request."""
    if (reaction := str(status.get("reacting", "none"))) != "none":
        reason = f": {status['reason']}" if status["reason"] else ""
        raise WorkFailedError(
            f"the robot is stopping ({reaction}){reason}; `cdpr status` shows when it has ended"
        )


def _booted(daemon: Daemon, out: Output) -> dict[str, Any]:
    """Return the status once the drives have booted or the reason why not is known."""
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
    """Stop the motion under control, then switch the drives off.

    If a fault has already done so, nothing changes.
    """
    try:
        answer = daemon.post("/disable")
    except DaemonRefusalError as error:
        refusal = error.refusal
        if refusal is None or refusal.arguments.get("state") != "fault":
            raise
        answer = {"state": "fault", "text": daemon.get("/status")["reason"]}
        _show(
            out,
            answer,
            "it has already stopped the robot; next: `cdpr ack`, after its cause is removed",
        )
        return
    _show(out, answer)


@app.command()
@with_daemon_at_once
def hold(daemon: Daemon, out: Output) -> None:
    """Stop the motion and hold the position under power; `cdpr resume` continues it."""
    answer = daemon.post("/hold")
    more: list[str] = []
    with suppress(CommandError):  # the robot holds even if its service does not answer
        status = daemon.get("/status")
        more = [*where_text(status), *next_steps(status)]
        if status["program"] == "hold" and not next_steps(status):
            more.append("if this interrupted a move or path: `cdpr resume` continues it")
    _show(out, answer, *more)


@app.command()
@with_daemon
def ack(daemon: Daemon, out: Output) -> None:
    """Acknowledge a fault after its cause has been removed; the power stays off."""
    status = daemon.get("/status")
    if (state := status["state"]) in ("ready", "active"):
        _require_no_stop(status)
        out.say("no fault to acknowledge")
        out.result({"ok": True, "state": state, "text": ""})
        return
    answer = daemon.post("/acknowledge")
    _show(out, answer, *next_steps(daemon.get("/status")))


@app.command()
def stop(
    robot: options.RobotOption = None,
    socket: options.SocketOption = None,
    url: options.UrlOption = None,
    key_file: options.KeyFileOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Stop the motion under control, switch the drives off and end the daemon.

    The exit status is 0 if the drives have no power afterwards, or if no daemon ran. It is 1 if the
    loop died, if a drive does not answer and may have power, or if it is not certain that the
    daemon has ended.
    """
    out = Output(as_json)
    try:
        with open_daemon(robot, socket, url, key_file, _ANSWER_S) as daemon:
            end_daemon(daemon, out, Path(daemon.where) if url is None else None)
    except NoDaemonError:  # no request has been sent yet
        if url is not None:  # the daemon may run on another machine
            raise
        ended = end_leftover_processes(robot, socket)
        if not ended and socket is None and live_sockets():
            raise  # another robot runs, which the caller may have meant
        out.say(*ended or ["nothing runs"])
    out.result({"ok": True})


def _show(out: Output, answer: dict[str, Any], *more: str) -> None:
    out.say(answer["state"] + (f": {answer['text']}" if answer["text"] else ""), *more)
    out.result({"ok": True, **answer})


def _confirm(state: dict[str, Any], yes: bool) -> None:
    """Ask before motors on a real bus get power."""
    urls = [str(bus.get("url", "")) for bus in state.get("buses", {}).values()]
    real = [url for url in urls if not url.startswith("simbus:")]
    if not is_simulated(state):
        where = " and ".join(real) or "its buses"
        require_consent(f"{state['robot']} on {where}: the drives will be switched on.", yes)
