"""The daemon's second process: control interface, recorder, live view, set-point stream."""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import resource
import signal
import socket
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any, Final

from starlette.types import ASGIApp

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.errors import ControlError
from cdpr_rt.programs.platform.paths.path_progress import keep_progress, paths_folder
from cdpr_rt.service.bounded_log import BoundedLog
from cdpr_rt.service.http.access_control import AccessControl, AccessPolicy
from cdpr_rt.service.http.app import create_app
from cdpr_rt.service.http.connections import FairQueue
from cdpr_rt.service.http.server import Server
from cdpr_rt.service.listening import listen_unix
from cdpr_rt.service.part import Part
from cdpr_rt.service.recordings.recording import Recorder
from cdpr_rt.service.service import Service
from cdpr_rt.service.streams.setpoint_stream import SetpointStream
from cdpr_rt.service.view.foxglove_view import LiveView
from cdpr_tools.daemon.processes.child import end_with_launcher, is_running, launcher_ended
from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.errors import DONE, FAILED, CommandError

_LOOP_STOP_S, _TURN_S = 70.0, 0.05
_MOST_FILES = 4096
_SWITCH_S = 5e-4
_PLANNING_S: Final = 600.0
_NICER: Final = 10
_MOST_KiB: Final = 4 << 20
"""Of the process's memory: a file from outside does not take the daemon's."""
_WITHIN: Final = f'ulimit -v {_MOST_KiB} && exec nice -n{_NICER} "$@"'


def main() -> int:
    """Serve until SIGTERM; return the exit status."""
    logging.basicConfig(level=logging.ERROR, format="service: %(message)s", stream=sys.stderr)
    bounded = BoundedLog()
    for handler in logging.getLogger().handlers:
        handler.addFilter(bounded)
    settings = RunSettings.from_argv()
    # stream, recorder and live view have threads: none keeps a stop waiting for longer than this
    sys.setswitchinterval(_SWITCH_S)
    _allow_many_files()
    block = SharedBlock.attach(settings.block_fd)
    block.counters["service_pid"] = os.getpid()
    service = Service(block, settings.name)
    service.background.append(bounded.watch)
    service.end_daemon = partial(os.kill, settings.launcher_pid or os.getpid(), signal.SIGTERM)
    folder = paths_folder(settings.name)
    service.background.append(
        partial(keep_progress, folder, block.counters["path"], simulated=settings.simulated)
    )
    service.planner.work = partial(plan_in_process, settings.robot)
    try:
        asyncio.run(_serve(settings, service))
    except (ControlError, CommandError) as error:
        print(f"service: {error}", file=sys.stderr)
        return FAILED
    return DONE


def _allow_many_files() -> None:
    """Raise the limit of open files: many connections are not to use up the recorder's."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    # bounded all the same: each connection takes memory
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, _MOST_FILES), most))


def build_parts(settings: RunSettings, service: Service) -> list[Part]:
    """Return what was asked for beside the control interface, not started yet."""
    parts: list[Part] = []
    block, lease = service.block, service.lease
    if settings.record is not None:
        ended = partial(service.note_failure, Recorder.name)
        recorder = Recorder(
            block, settings.record, settings.name, ended=ended, retention=settings.keep
        )
        service.events.listeners.append(partial(_note, recorder))
        parts.append(recorder)
    if settings.live is not None:
        ended = partial(service.note_failure, LiveView.name)
        listener = socket.socket(fileno=settings.live_fd)
        parts.append(LiveView(block, settings.name, listener, settings.live_origins, ended))
    if settings.stream is not None:
        ended = partial(service.note_failure, SetpointStream.name)
        sock = socket.socket(fileno=settings.stream_fd)
        parts.append(SetpointStream(block, lease, sock, settings.key(), ended))
    return parts


def _note(recorder: Recorder, text: str, kind: str, detail: dict[str, Any]) -> None:
    """Have an event recorded, beside the states and reasons that the recorder finds by itself."""
    if kind not in ("state", "reason"):
        recorder.remark(text, kind=kind, **detail)


async def _serve(settings: RunSettings, service: Service) -> None:
    app = create_app(service)
    servers = _listen(settings, app, service)
    service.start_parts(build_parts(settings, service))
    gc.collect()
    gc.freeze()  # looking through all that was loaded takes tens of ms, in which no stop is taken
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, ended.set)
    end_with_launcher(settings.launcher_pid)
    watching = asyncio.create_task(service.watch())
    serving = [asyncio.create_task(server.serve_until_stopped()) for server in servers]
    waiting = asyncio.create_task(_wait_for_end(ended, settings, service.block))
    try:
        done, _ = await asyncio.wait(
            {watching, waiting, *serving}, return_when=asyncio.FIRST_COMPLETED
        )
        for task in done - {waiting}:
            task.result()  # raises what ended it
    finally:
        for server in servers:
            server.should_exit = True
        await asyncio.gather(*serving, return_exceptions=True)
        watching.cancel()
        waiting.cancel()
        service.stop_parts()
        settings.socket.unlink(missing_ok=True)


async def _wait_for_end(ended: asyncio.Event, settings: RunSettings, block: SharedBlock) -> None:
    """Wait for the signal; where the launcher has died, for the loop's controlled stop as well.

    Otherwise the launcher has seen to it that the loop has ended first.
    """
    await ended.wait()
    pid, end_s = int(block.counters["loop_pid"][0]), time.monotonic() + _LOOP_STOP_S
    while launcher_ended(settings.launcher_pid) and is_running(pid) and time.monotonic() < end_s:
        await asyncio.sleep(_TURN_S)


def _listen(settings: RunSettings, app: ASGIApp, service: Service) -> list[Server]:
    """Return the servers: at the Unix socket, and at what the launcher has bound on TCP."""
    shared = (service.count_refusal, service.lease.is_held_by, service.tickets)
    queue = FairQueue()
    note = partial(service.events.add, "http")
    unix = listen_unix(settings.socket)
    servers = [Server(AccessControl(app, AccessPolicy(local=True), *shared), unix, queue, note)]
    if (address := settings.http) is not None:
        policy = AccessPolicy.on_tcp(settings.key(), address.host, loopback=address.is_loopback)
        listener = socket.socket(fileno=settings.http_fd)
        service.http = listener.getsockname()[:2]
        servers.append(Server(AccessControl(app, policy, *shared), listener, queue, note))
    return servers


async def plan_in_process(robot: str, file: Path, request: dict[str, Any]) -> tuple[int, str]:
    """Plan a file for a robot's profile; return exit status and the JSON line."""
    options = [f"--blend={request['blend_mm']}", f"--ignore={request['ignore']}"]
    if request["origin_mm"] is not None:
        options.append(f"--origin={request['origin_mm']}")
    command = [sys.executable, "-P", "-m", "cdpr_tools.cli", "path", str(file)]
    process = await asyncio.create_subprocess_exec(
        "sh", "-c", _WITHIN, "sh", *command, "--robot", robot, "--keep", "--json", *options,
        stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
    )  # fmt: skip
    try:
        output, _ = await asyncio.wait_for(process.communicate(), _PLANNING_S)
    except BaseException:
        process.kill()
        await process.wait()
        raise
    lines = output.decode("utf-8", "replace").strip().splitlines()
    return process.returncode or 0, lines[-1] if lines else ""


if __name__ == "__main__":
    sys.exit(main())
