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
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from starlette.types import ASGIApp
from typing_extensions import override

from cdpr_profiles.errors import ProfileError, printable
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.errors import ControlError
from cdpr_rt.programs.path_store import keep_progress, paths_folder
from cdpr_rt.service.access_control import AccessControl, AccessPolicy
from cdpr_rt.service.foxglove_view import LiveView
from cdpr_rt.service.http_app import create_app
from cdpr_rt.service.http_server import Server
from cdpr_rt.service.listening import listen_unix
from cdpr_rt.service.part import Part
from cdpr_rt.service.recording import Recorder
from cdpr_rt.service.recording_folder import RecordingFolder
from cdpr_rt.service.service import InjectionError, Service
from cdpr_rt.service.setpoint_stream import SetpointStream
from cdpr_tools.daemon.child import (
    end_with_launcher,
    is_running,
    launcher_ended,
    loop_stop_s,
    signal_launcher,
)
from cdpr_tools.daemon.drive_texts import RobotDriveTexts
from cdpr_tools.daemon.procedures import planned
from cdpr_tools.daemon.robot_describer import RobotDescriber
from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.errors import DONE, FAILED, BadInputError, CommandError
from cdpr_tools.processes import MOST_KiB, module_command_beside
from cdpr_tools.streams import guard_streams, outlive_output

# Log lines that clients can trigger: a few of each kind a minute; the others are counted.

_MOST, _WINDOW_S = 5, 60.0
_MOST_KINDS = 64


@dataclass
class _Kind:
    since_s: float
    shown: int = 0
    more: int = 0
    level: int = logging.ERROR
    logger: str = ""
    text: str = ""


class BoundedLog(logging.Filter):
    """Passes 5 lines of a kind per minute, and later reports how many were suppressed.

    A kind is a logger's text before its values are inserted; beyond 64 kinds, all others count
    as one. Attach it to a handler, so that it filters all loggers.
    """

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock_s = clock_s
        self._kinds: dict[tuple[str, str], _Kind] = {}
        self._lock = threading.Lock()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether the line is among the first of its kind."""
        if getattr(record, "from_bounded_log", False):
            return True
        key = (record.name, str(record.msg))
        with self._lock:
            if key not in self._kinds and len(self._kinds) >= _MOST_KINDS:
                key = ("", "")
            kind = self._kinds.setdefault(key, _Kind(self._clock_s()))
            kind.level, kind.logger, kind.text = record.levelno, record.name, key[1]
            kind.shown += 1
            kind.more += kind.shown > _MOST
            return kind.shown <= _MOST

    def report_suppressed(self) -> None:
        """Log how many lines were suppressed, for the kinds whose minute is over."""
        now_s = self._clock_s()
        with self._lock:
            over = [key for key, kind in self._kinds.items() if now_s - kind.since_s >= _WINDOW_S]
            kinds = [self._kinds.pop(key) for key in over]
        for kind in kinds:
            if kind.more:
                text = f"{kind.more} more within {_WINDOW_S:g} s: {kind.text or 'other messages'}"
                extra = {"from_bounded_log": True}
                logging.getLogger(kind.logger).log(kind.level, "%s", text, extra=extra)

    async def watch(self) -> None:
        """Report suppressed lines each minute, until cancelled."""
        while True:
            await asyncio.sleep(_WINDOW_S / 6)
            self.report_suppressed()


_TURN_S: Final = 0.05
_TOLD_S: Final = 0.6
"""Clients read the status several times within this time."""
_MOST_FILES = 4096
_SWITCH_S = 5e-4
_PLANNING_S: Final = 600.0
_LOG_FORMAT: Final = "service: %(message)s"
_READING: Final = tuple(module_command_beside("cdpr_tools.recordings.reading_process"))


class _PrintableFormatter(logging.Formatter):
    @override
    def format(self, record: logging.LogRecord) -> str:
        return printable(super().format(record))


def main() -> int:
    """Serve until SIGTERM; return the exit status."""
    guard_streams()
    outlive_output()
    logging.basicConfig(level=logging.ERROR, stream=sys.stderr)
    bounded = BoundedLog()
    for handler in logging.getLogger().handlers:
        handler.addFilter(bounded)
        handler.setFormatter(_PrintableFormatter(_LOG_FORMAT))
    settings = RunSettings.from_argv()
    # stream, recorder and live view have threads: none may delay a stop longer than this
    sys.setswitchinterval(_SWITCH_S)
    _allow_many_files()
    block = SharedBlock.attach(settings.block_fd)
    block.counters["service_pid"] = os.getpid()
    service = Service(block, settings.name)
    service.background.append(bounded.watch)
    service.end_daemon = partial(signal_launcher, settings.launcher_pid, signal.SIGTERM)
    service.wake_launcher = partial(signal_launcher, settings.launcher_pid, signal.SIGCONT)
    folder = paths_folder(settings.name)
    service.background.append(
        partial(keep_progress, folder, block.counters["path"], simulated=settings.simulated)
    )
    service.planner.work = partial(plan_in_process, settings.robot)
    service.drives = RobotDriveTexts(settings.robot)
    if settings.record is not None:
        service.recordings = RecordingFolder(settings.record, settings.name, _READING)
    service.procedures.plan = partial(planned, settings)
    service.procedures.offers = {"simulated_camera": settings.camera is not None}
    describer = RobotDescriber(settings.robot)
    service.describe = describer.answer
    service.background.append(describer.watch)
    service.border.work = partial(border_in_process, settings.robot)
    if settings.simulated:
        service.inject = partial(inject_fault, settings)
    try:
        asyncio.run(_serve(settings, service))
    except (ControlError, CommandError) as error:
        print(f"service: {printable(str(error))}", file=sys.stderr)
        return FAILED
    return DONE


def _allow_many_files() -> None:
    """Raise the limit of open files, so that many connections cannot use up the recorder's."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    # still limited, because each connection takes memory
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, _MOST_FILES), most))


def build_parts(settings: RunSettings, service: Service) -> list[Part]:
    """Return the requested parts beside the control interface, not started yet."""
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
    """Record an event, in addition to the states and reasons that the recorder detects."""
    if kind not in ("state", "reason"):
        recorder.remark(text, kind=kind, **detail)


async def _serve(settings: RunSettings, service: Service) -> None:
    app = create_app(service)
    servers = _listen(settings, app, service)
    service.start_parts(build_parts(settings, service))
    gc.collect()
    gc.freeze()  # a collection over all loaded objects takes tens of ms and would delay a stop
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
    """Wait for the signal; if the launcher has died, also for the loop's controlled stop.

    Otherwise the launcher has already ended the loop.
    """
    await ended.wait()
    pid, end_s = int(block.counters["loop_pid"][0]), time.monotonic() + loop_stop_s(block)
    while launcher_ended(settings.launcher_pid) and is_running(pid) and time.monotonic() < end_s:
        await asyncio.sleep(_TURN_S)
    if settings.http is not None:  # remote clients learn of the end only from the status
        await asyncio.sleep(_TOLD_S)


def _listen(settings: RunSettings, app: ASGIApp, service: Service) -> list[Server]:
    """Return the servers: at the Unix socket, and at the TCP sockets bound by the launcher."""
    shared = (
        service.count_refusal, service.lease.is_held_by, service.tickets,
        lambda: service.block.stops,
    )  # fmt: skip
    unix = listen_unix(settings.socket)
    servers = [Server(AccessControl(app, AccessPolicy(local=True), *shared), unix)]
    if (address := settings.http) is not None:
        policy = AccessPolicy.on_tcp(
            settings.page_key(),
            address.host,
            loopback=address.is_loopback,
            open_reading=settings.http_asked and not settings.has_key,
        )
        listener = socket.socket(fileno=settings.http_fd)
        service.http = listener.getsockname()[:2]
        service.page_url = settings.page_url()
        servers.append(Server(AccessControl(app, policy, *shared), listener))
    return servers


def inject_fault(settings: RunSettings, axis: int, fault: str) -> str:
    """Break or mend one simulated axis; return what was done. Raises InjectionError."""
    # loaded with the first fault: no real robot needs it
    from cdpr_drivers.robot.robot_buses import robot_urls  # noqa: PLC0415
    from cdpr_profiles import load_robot  # noqa: PLC0415
    from cdpr_sim_bus.cia402.faults import FAULTS  # noqa: PLC0415
    from cdpr_tools.composition.fault_injection import fault_access  # noqa: PLC0415

    try:
        robot = load_robot(settings.robot)
        if axis >= len(robot.axes):
            raise BadInputError(f"axis {axis}; allowed: 0 to {len(robot.axes) - 1}")
        one = robot.axes[axis]
        with fault_access(robot, one, robot_urls(robot, settings.buses)[one.bus]) as access:
            amount = access.inject(fault, None)
    except (CommandError, ProfileError) as error:
        raise InjectionError(str(error)) from None
    if fault == "put-back":
        return "platform put back"
    return f"{one.name}: {FAULTS[fault].text(amount) if fault in FAULTS else 'mended'}"


_PATH_OPTIONS: Final = (
    "origin_mm", "blend_mm", "ignore", "z_mm", "scale", "rotate_deg", "mirror", "dwell", "line",
)  # fmt: skip
"""Options of `cdpr path show`, with their units."""


async def plan_in_process(
    robot: str, file: Path, request: dict[str, Any], most_KiB: int = MOST_KiB
) -> tuple[int, str]:
    """Plan a file for a robot's profile; return exit status and the JSON line."""
    options = [
        f"--{key.split('_', 1)[0]}={request[key]}"
        for key in _PATH_OPTIONS
        if request.get(key) is not None
    ]
    given = ["path", "show", str(file), "--robot", robot, "--keep", "--json", *options]
    return await _run(module_command_beside("cdpr_tools.cli", *given, most_KiB=most_KiB))


async def border_in_process(robot: str) -> tuple[int, str]:
    """Compute the border of the workspace; return exit status and the JSON line."""
    return await _run(module_command_beside("cdpr_tools.robots.workspace_border", robot))


async def _run(command: Sequence[str]) -> tuple[int, str]:
    """Run a command; return exit status and its last line."""
    process = await asyncio.create_subprocess_exec(
        *command, stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE,
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
