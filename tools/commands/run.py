"""`cdpr run`: run the control loop of a robot as a daemon."""

from __future__ import annotations

import math
import os
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drivers.bus.url import refuse_second_master
from cdpr_drivers.errors import BusError
from cdpr_drivers.robot.commissioned import load_profiles, uncommissioned_text, with_commissioned
from cdpr_drivers.robot.robot_buses import (
    real_buses,
    refuse_simulated_calibration,
    require_fit,
    robot_urls,
    starts_own_simulator,
)
from cdpr_profiles import Robot
from cdpr_profiles.calibration_in_force import load_calibrated
from cdpr_rt.core.shared_block import MOST_AXES, SharedBlock
from cdpr_rt.diagnosis.checks import refuse_impossible
from cdpr_rt.service.listening import listener_pid
from cdpr_rt.service.retention import BYTES_PER_AXIS, Retention, size_text
from cdpr_rt.state_file import make_private_folder
from cdpr_tools.commands import options
from cdpr_tools.commands.browser import open_page
from cdpr_tools.commands.options import option
from cdpr_tools.composition.own_code import OwnCodeOptions
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.consent import require_consent
from cdpr_tools.daemon.launcher import Launcher, ServiceManager
from cdpr_tools.daemon.loop_file import LauncherLock
from cdpr_tools.daemon.paths import SOCKET_SUFFIX, default_recordings, default_socket
from cdpr_tools.daemon.settings import Address, RunSettings, checked_origin
from cdpr_tools.errors import (
    BAD_INPUT,
    DONE,
    BadInputError,
    CommandError,
    WorkFailedError,
)
from cdpr_tools.output import Output, to_json
from cdpr_tools.robots.calibration_text import calibration_text
from cdpr_tools.streams import end_with_stdin, outlive_output

_KEPT_DAYS, _KEPT_GB = 30.0, 20.0
_RING_S = 15.0  # longer than it takes to detect a hanging service and restart it


app = typer.Typer()


@app.command()
def run(
    robot: options.RobotOrWinchArgument,
    bus: options.RobotBusOption = None,
    plant: Annotated[
        Path | None, option("Plant file for the simulator that `simbus:` starts.")
    ] = None,
    camera: Annotated[
        Path | None, option("Socket to create for a simulated camera on the platform.")
    ] = None,
    http: Annotated[
        str | None,
        option("Listen at this address, not at a free port of loopback.", metavar="HOST:PORT"),
    ] = None,
    no_page: Annotated[
        bool, option("Serve no page for a browser: listen at no port.", "--no-page")
    ] = False,
    open_it: Annotated[bool, option("Open the robot's page in a browser.", "--open")] = False,
    unix: Annotated[
        Path | None, option("Unix socket of the control interface, if not the default.", "--socket")
    ] = None,
    key_file: Annotated[
        Path | None,
        option("File with the key of clients that may move the robot over --http or --stream."),
    ] = None,
    record: Annotated[
        Path | None, option("Record into this folder instead of the default one.", metavar="DIR")
    ] = None,
    no_record: Annotated[bool, option("Record nothing.", "--no-record")] = False,
    keep_days: Annotated[
        float | None,
        option(
            "Remove recordings of this robot that are older, in days; default in the user's "
            "folder: 30.",
            min=0.01,
        ),
    ] = None,
    keep_gb: Annotated[
        float | None,
        option(
            "If the robot's recordings exceed this total size in GB, remove the oldest; default in "
            "the user's folder: 20.",
            "--keep-gb",
            min=0.01,
        ),
    ] = None,
    live: Annotated[
        int | None, option("Foxglove live view, on loopback.", metavar="PORT", min=0, max=65535)
    ] = None,
    live_origin: Annotated[
        list[str] | None,
        option(
            "Origin of a web page that may use the live view, such as https://app.foxglove.dev.",
            metavar="ORIGIN",
        ),
    ] = None,
    stream: Annotated[
        str | None,
        option(
            "Receive the set-point stream (UDP) there, not at a free port of loopback.",
            metavar="HOST:PORT",
        ),
    ] = None,
    no_stream: Annotated[bool, option("Receive no set-point stream.", "--no-stream")] = False,
    read_only: Annotated[
        bool, option("Listen to another master's bus; send nothing.", "--read-only")
    ] = False,
    safety_io: options.SafetyIoOption = None,
    tension_port: Annotated[
        str | None, option("Serial port of the robot's tension sensors.", metavar="PORT")
    ] = None,
    commissioned: Annotated[
        Path | None,
        option(
            "Folder with the results of `cdpr commission ROBOT`, used to compensate the motors.",
            metavar="DIR",
        ),
    ] = None,
    controller: options.ControllerOption = None,
    tension_distribution: options.TensionDistributionOption = None,
    program: options.ProgramOption = None,
    allow_code: options.AllowCodeOption = False,
    yes: options.YesOption = False,
    as_json: options.JsonOption = False,
    exit_with_stdin: options.ExitWithStdinOption = False,
) -> None:
    """Start a robot's control loop as a daemon. The motors get no power until you enable them.

    It prints a line when it is ready. Ctrl-C and SIGTERM end it with a controlled stop.
    """
    out = Output(as_json)
    if exit_with_stdin:
        threading.Thread(target=end_with_stdin, daemon=True).start()
    if find_spec("uvicorn") is None:  # report this before a child process fails without it
        raise ModuleNotFoundError(name="uvicorn")
    profile = load_calibrated(robot)
    refuse_simulated_calibration(profile, bus or ())
    settings = settings_for(
        profile, bus=bus, plant=plant, camera=camera, http=http, no_page=no_page, unix=unix,
        key_file=key_file, record=record, no_record=no_record, keep_days=keep_days, keep_gb=keep_gb,
        live=live, live_origin=live_origin, stream=stream, no_stream=no_stream,
        read_only=read_only, safety_io=safety_io, tension_port=tension_port,
        commissioned=commissioned,
        own=OwnCodeOptions(controller, tension_distribution, tuple(program or ())),
        allow_code=allow_code,
    )  # fmt: skip
    if open_it and settings.http is None:
        raise BadInputError("--open and --no-page: give only one of them")
    _require_possible(settings.socket)
    with ExitStack() as stack:
        # hold the lock from before anything starts until everything has ended
        lock = stack.enter_context(LauncherLock(settings.socket))
        _require_free(settings.socket)
        _require_no_master(profile, settings)
        if not settings.own_simulator:
            _note_doubts(profile, out)
        _ask(profile, settings, yes, exit_with_stdin)
        settings = settings.model_copy(
            update={"lock_fd": lock.fd, "record": _writable(settings.record, record, out)}
        )
        settings = settings.with_key_loaded().with_ports_bound()
        manager = ServiceManager()  # before any child starts, so that no child notifies the manager
        for text in (
            uncommissioned_text(with_commissioned(profile, commissioned)),
            calibration_text(profile.calibration.summary()) if profile.calibration else "",
        ):
            if text:
                out.note(text)
        simulator = None
        if settings.own_simulator:
            simulator = _simulator(profile, settings, plant, camera, out)
            stack.callback(simulator.stop)
        _launch(profile, settings, out, manager, simulator, open_it=open_it)


@app.command()
def demo(
    robot: Annotated[str, option("Robot profile, a name or a file.", "--robot")] = "planar-3",
    no_open: Annotated[
        bool, option("Open no browser; print the page's address.", "--no-open")
    ] = False,
) -> None:
    """Start a simulated robot and open its page in a browser.

    It is `cdpr run ROBOT --bus simbus: --open`, and runs until Ctrl-C. Nothing gets power until you
    press *Enable*.
    """
    run(robot, bus=["simbus:"], open_it=not no_open)


def _simulator(
    robot: Robot,
    settings: RunSettings,
    plant: Path | None,
    camera: Path | None,
    out: Output,
) -> OwnSimulator:
    """Start the robot's simulated drives, and check the robot meanwhile."""
    out.note(f"starting simulated drives: {len(robot.axes)} ...")
    check = partial(_note_doubts, robot, out)
    return OwnSimulator(robot.reference, settings.buses[0], plant, camera=camera, meanwhile=check)


def _writable(folder: Path | None, asked: Path | None, out: Output) -> Path | None:
    """Make a folder for recordings and return it; a new one is private to this user.

    If it is not writable, raises BadInputError if the user `asked` for it; otherwise the daemon
    records nothing.
    """
    if folder is None:
        return None
    try:
        make_private_folder(folder)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        if asked is not None:
            raise BadInputError(f"--record {asked}: {error.strerror or error}") from None
        why = f"{folder} cannot be written ({error.strerror or error})"
        out.note(f"not recording: {why}; --record DIR records elsewhere")
        return None


def _note_doubts(robot: Robot, out: Output) -> None:
    """Print warnings about the robot; raises ProfileError if it cannot work."""
    for doubt in refuse_impossible(robot):
        out.note(doubt)


def settings_for(
    robot: Robot,
    *,
    bus: list[str] | None,
    plant: Path | None,
    camera: Path | None = None,
    http: str | None,
    no_page: bool = False,
    unix: Path | None,
    key_file: Path | None,
    record: Path | None,
    no_record: bool,
    keep_days: float | None = None,
    keep_gb: float | None = None,
    live: int | None,
    live_origin: list[str] | None = None,
    stream: str | None,
    no_stream: bool = False,
    read_only: bool,
    safety_io: str | None,
    tension_port: str | None = None,
    commissioned: Path | None = None,
    own: OwnCodeOptions | None = None,
    allow_code: bool = False,
) -> RunSettings:
    """Return the settings from the options of `cdpr run`; raises BadInputError."""
    if len(robot.axes) > MOST_AXES:
        raise BadInputError(f"{robot.path}: {len(robot.axes)} axes; allowed: 1 to {MOST_AXES}")
    require_fit(robot)
    load_profiles(with_commissioned(robot, commissioned))
    if record is not None and no_record:
        raise BadInputError("--record and --no-record: give only one of them")
    if http is not None and no_page:
        raise BadInputError("--http and --no-page: give only one of them")
    if stream is not None and no_stream:
        raise BadInputError("--stream and --no-stream: give only one of them")
    own = own or OwnCodeOptions()
    own.require_use(robot, allow_code=allow_code)
    own_simulator = starts_own_simulator(bus or ())
    if plant is not None and not own_simulator:
        raise BadInputError("--plant: only for a simulator that the command starts (simbus:)")
    if camera is not None and not own_simulator:
        raise BadInputError("--camera: only for a simulator that the command starts (simbus:)")
    if read_only and own_simulator:
        raise BadInputError(
            "--read-only: a simulator that the command starts has no other master; give "
            "--bus simbus:NAME of a running one"
        )
    return RunSettings(
        robot=robot.reference,
        name=robot.profile,
        buses=(f"simbus:own-{os.getpid()}",) if own_simulator else tuple(bus or ()),
        simulated=own_simulator
        or all(url.is_simulated for url in robot_urls(robot, tuple(bus or ())).values()),
        own_simulator=own_simulator,
        plant=plant,
        camera=camera,
        read_only=read_only,
        safety_io=safety_io,
        tension_port=tension_port,
        commissioned=commissioned,
        own=own,
        socket=unix or default_socket(robot.profile),
        http=_page_address(http, no_page),
        http_asked=http is not None,
        key_file=key_file,
        record=None if no_record else record or default_recordings(),
        keep=_kept(record, keep_days, keep_gb),
        live=live,
        live_origins=tuple(map(checked_origin, live_origin or ())),
        stream=_stream_address(stream, no_stream or read_only),
        launcher_pid=os.getpid(),
    )


def _page_address(http: str | None, off: bool) -> Address | None:
    """Return where HTTP is served: by default at the first free port for pages on loopback."""
    if http is None:
        return None if off else Address(host="127.0.0.1", port=0)
    return Address.parse("--http", http)


def _stream_address(stream: str | None, off: bool) -> Address | None:
    """Return where set-points are received: by default at a free port of loopback."""
    if stream is None:
        return None if off else Address(host="127.0.0.1", port=0)
    return Address.parse("--stream", stream)


def _kept(record: Path | None, days: float | None, gb: float | None) -> Retention:
    """Return which recordings are kept; by default all in a folder that the user gives."""
    usual_days, usual_gb = (_KEPT_DAYS, _KEPT_GB) if record is None else (math.inf, math.inf)
    return Retention(usual_days if days is None else days, 1e9 * (usual_gb if gb is None else gb))


def _recording_text(robot: Robot, settings: RunSettings) -> str:
    """Return the folder of recordings, their size per hour, and how many are kept, as text."""
    if settings.record is None:
        return "records nothing"
    hour = 3600.0 * BYTES_PER_AXIS * len(robot.axes) / robot.sync_period_s
    keep = settings.keep
    kept = [f"{keep.days:g} days"] * math.isfinite(keep.days)
    kept += [size_text(keep.total_bytes)] * math.isfinite(keep.total_bytes)
    until = f"keeps at most {' and '.join(kept)}" if kept else "removes none"
    return f"records into {settings.record}: about {size_text(hour)} an hour; {until}"


def _launch(
    robot: Robot,
    settings: RunSettings,
    out: Output,
    manager: ServiceManager,
    simulator: OwnSimulator | None,
    *,
    open_it: bool,
) -> None:
    block = SharedBlock.create(len(robot.axes), _RING_S, 1.0 / robot.sync_period_s)
    block.counters["start_monotonic_ns"] = time.monotonic_ns()
    block.counters["start_realtime_ns"] = time.time_ns()
    settings = settings.model_copy(update={"block_fd": block.fd})

    def ready(status: dict[str, Any]) -> None:
        report = {"robot": robot.name, "state": status["state"], "reason": status.get("reason", "")}
        report |= {"socket": str(settings.socket), "pid": os.getpid()}
        url = settings.page_url()
        if url and open_it:
            open_page(url, out)
        _report_ready(report, url.partition("#")[0] if settings.has_key else url, out)

    out.note(_recording_text(robot, settings))
    out.note("starting the control loop ...")
    outlive_output()
    launcher = Launcher(settings, block, out.note, ready, manager, simulator)
    status = launcher.run()
    if status != DONE:
        raise _ended(launcher.reason, status)
    out.result({"ok": True})


def _report_ready(report: dict[str, Any], url: str, out: Output) -> None:
    """Report on standard output that the daemon is ready, as JSON unless a person reads it.

    The page's key is shown only on a terminal, because other output may go to a log, and only if
    the key was made for this run.
    """
    report["page"] = url.partition("#")[0] or None
    if out.as_json or not sys.stdout.isatty():
        print(to_json({"ready": report}), flush=True)
        return
    out.say(
        f"{report['robot']}: {report['state']}"
        + (f": {report['reason']}" if report["reason"] else "")
    )
    if url:
        out.say(f"page {url}")
    out.say(f"socket {report['socket']}; Ctrl-C ends it")
    if report["state"] == "ready":
        page = "*Enable* on the page, or " if url else ""
        out.say(f"next: {page}`cdpr enable` in a second terminal")


def _ended(reason: str, status: int) -> CommandError:
    return BadInputError(reason) if status == BAD_INPUT else WorkFailedError(reason)


def _require_possible(control: Path) -> None:
    """Raise BadInputError if no daemon could ever listen at `control`."""
    if control.suffix != SOCKET_SUFFIX:  # the loop's file beside it differs only in the suffix
        raise BadInputError(f"--socket {control}: allowed: a name that ends in {SOCKET_SUFFIX}")
    if not os.access(control.parent, os.W_OK | os.X_OK):
        raise BadInputError(f"--socket {control}: {control.parent} is not a writable folder")


def _require_free(control: Path) -> None:
    """Raise BadInputError if a process without the robot's lock listens at `control`."""
    if (pid := listener_pid(control)) is not None:
        whose = f"process {pid}" if pid else "a process"
        raise BadInputError(f"--socket {control}: {whose} listens there already; end it first")


def _require_no_master(robot: Robot, settings: RunSettings) -> None:
    """Raise WorkFailedError if another process currently runs drives on one of the buses."""
    if settings.read_only:
        return
    for url in robot_urls(robot, settings.buses).values():
        try:
            refuse_second_master(url)
        except BusError as error:
            raise WorkFailedError(f"{error}, or give --read-only to listen") from None


def _ask(robot: Robot, settings: RunSettings, yes: bool, exit_with_stdin: bool) -> None:
    real = real_buses(robot, settings.buses)
    if real and not settings.read_only:
        where = " and ".join(real)
        if exit_with_stdin and not yes:  # a pipe cannot answer a question
            raise BadInputError(f"{where}: with --exit-with-stdin, real drives need --yes")
        require_consent(f"{robot.name} on {where}: its motors will turn on command.", yes)
