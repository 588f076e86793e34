"""`cdpr_rt.connect` and `cdpr_rt.run`: a daemon's robot, for scripts."""

from __future__ import annotations

import json
import math
import subprocess
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.errors import DriverError
from cdpr_drivers.robot.robot_buses import real_buses
from cdpr_profiles import load_robot
from cdpr_profiles.errors import ProfileError
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import Row, cycle_dtype
from cdpr_rt.errors import ControlError
from cdpr_rt.robot import (
    AlreadyRunning,
    Error,
    InvalidArgument,
    InvalidRobot,
    NotRunning,
    Refused,
    Robot,
    path_of,
    texts_of,
)
from cdpr_rt.service.stream_client import StreamClient
from cdpr_rt.service.stream_packet import StreamSession
from cdpr_tools.client.client import Daemon, answers, await_start, is_starting, open_daemon
from cdpr_tools.client.daemon_end import end_daemon
from cdpr_tools.client.handle_errors import errors_for_scripts, robot_errors
from cdpr_tools.client.status_text import DEAD, death_text
from cdpr_tools.composition.fault_injection import fault_access
from cdpr_tools.errors import BAD_INPUT, CommandError, NoDaemonError
from cdpr_tools.output import Output
from cdpr_tools.processes import module_command
from cdpr_tools.streams import procedure_token

_WITH_RIGHT: Final = frozenset({"enable", "program", "set"})
"""Commands that need the right to move."""
_TTL_S: Final = 2.0
_RENEW_S: Final = 0.5
_PLAN_S: Final = 0.1
_RECORD_S: Final = 1.0
_RECORDED_S: Final = 10.0
_LOOK_S: Final = 0.2
_OBSERVE_S: Final = 0.02
_OBSERVED: Final = ("position_rad", "cable_length_m", "tension_N")
_LEAST_ROWS: Final = 2
_SILENT_S: Final = 5.0
_HANGS_S: Final = 10.0
"""A loop that has run no cycle for this time hangs."""
_LOOKED_AFTER_S: Final = 1.0
_END_S: Final = 90.0
"""Time for a daemon to end, in addition to the time to lower the platform."""


def connect(robot: str | Path | None = None, *, socket: str | Path | None = None) -> Robot:
    """Return the robot of a running daemon: by name or file, by its socket, or the only one.

    The handle takes the right to move with its first command that needs it and renews it in a
    thread. Closing the handle releases the right and holds the robot. If the script dies, the right
    expires after 2 s and the motion stops. Raises NotRunning and InvalidRobot.
    """
    with ExitStack() as stack, errors_for_scripts(opening=True):
        name = None if robot is None else str(robot)
        unix = None if socket is None else path_of("socket", socket)
        try:
            daemon = stack.enter_context(open_daemon(name, unix, None, None))
        except NoDaemonError:
            if name is not None:
                load_robot(name)  # raises if there is no such robot
            raise
        await_start(daemon, Output(as_json=True))
        backend = _Remote(daemon)
        backend.opened = stack.pop_all()
        return Robot(backend)


def run(
    robot: str | Path,
    *,
    bus: str | Sequence[str] | None = None,
    plant: str | Path | None = None,
    record: str | Path | None = None,
    stream: str | None = None,
    controller: str | None = None,
    tension_distribution: str | None = None,
    programs: Sequence[str] = (),
    allow_code: bool = False,
    yes: bool = False,
) -> Robot:
    """Start a daemon as `cdpr run` does and return its robot.

    `bus` are URLs as for `--bus`, such as "simbus:" for simulated drives; by default those of the
    robot's file. `record` is the folder of the recording. `stream` is the HOST:PORT at which the
    daemon receives set-points, by default a free port of this machine. `controller`,
    `tension_distribution` and `programs` are your own: "FILE.py:NAME" or "MODULE:NAME". If the
    robot's file names code, `allow_code` allows it from now on. A bus with real drives needs
    `yes`. The daemon ends when the handle is closed or the script dies: it lowers the platform and
    removes the power. Raises AlreadyRunning, InvalidRobot, and InvalidArgument if `yes` is
    missing. Raises Error if the daemon does not start, or does not confirm at its end that the
    power is off.
    """
    _require_no_daemon(str(robot))
    buses = texts_of("bus", bus or ())
    with errors_for_scripts(opening=True):
        profile = load_robot(robot)
        try:
            real = real_buses(profile, buses)
        except DriverError as error:
            if not buses:  # those of the file
                raise
            raise InvalidArgument(str(error).replace("--bus", "bus")) from None
    if real and not yes:
        where = " and ".join(real)
        raise InvalidArgument(f"yes: False; real motors on {where} will move; give yes=True")
    options = [word for url in buses for word in ("--bus", url)]
    for option, value in (
        ("--plant", plant),
        ("--record", record),
        ("--stream", stream),
        ("--controller", controller),
        ("--tension-distribution", tension_distribution),
    ):
        options += [] if value is None else [option, str(value)]
    options += [
        word for program in texts_of("programs", programs) for word in ("--program", program)
    ]
    options += ["--allow-code"] * allow_code
    with ExitStack() as stack, errors_for_scripts(opening=True):
        try:
            process = _DaemonProcess([str(robot), *options, *["--yes"] * yes])
        except Error:
            _require_no_daemon(str(robot))  # another script may have started one meanwhile
            raise
        stack.callback(process.stop)
        daemon = stack.enter_context(open_daemon(None, process.socket, None, None))
        await_start(daemon, Output(as_json=True))
        backend = _Remote(daemon)
        process.lowering_s = float(backend.description.get("lowering_s", 0.0))
        backend.opened = stack.pop_all()
        return Robot(backend)


def _require_no_daemon(robot: str) -> None:
    if answers(robot, None):
        raise AlreadyRunning(f"{robot}: its daemon runs already; connect({robot!r}) uses it")
    if is_starting(robot):
        raise AlreadyRunning(f"{robot}: its daemon is starting, or ending; wait for it")


@contextmanager
def commanded(daemon: Daemon, *, in_control: bool = False) -> Iterator[Robot]:
    """Yield the daemon's robot to a command; its errors are raised as errors of the command.

    If it is `in_control`, the right to move is taken before the block, and the robot is held at its
    end.
    """
    with robot_errors():
        backend = _Remote(daemon)
        backend.watched_only = not in_control
        try:
            if in_control:
                backend.take_right()
            yield Robot(backend, in_block=True)
        finally:
            if in_control:
                backend.close()
            backend.release()


class _Remote:
    """Backend on a daemon. The right to move is taken by the first command that needs it."""

    look_s = 0.1

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        self.opened = ExitStack()
        """Contexts that are closed together with the handle."""
        self.description: Mapping[str, Any] = daemon.get("/description")
        self._began_ns = time.monotonic_ns()
        self.watched_only = False
        """Whether the right to move expires if nobody reads the status for a second."""
        self._looked_s = time.monotonic()
        status = daemon.get("/status")
        self._file, self._lockstep = _recorded_file(status), bool(status["lockstep"])
        self._lock = threading.Lock()
        self._token: str | None = None
        self._given = procedure_token
        """Token of the client for which a daemon runs this command; only that client renews it."""
        self._closed = threading.Event()
        self._renewer = threading.Thread(
            target=_keep_right, args=(weakref.ref(self), self._closed), daemon=True
        )
        self._renewer.start()

    def renew_right(self) -> None:
        """Renew the right to move if this handle holds it and the script still uses it."""
        if self.watched_only and time.monotonic() - self._looked_s > _LOOKED_AFTER_S:
            return
        with self._lock:
            if self._token is not None:
                try:
                    self._daemon.renew(self._token)
                except NoDaemonError:
                    return  # the service restarts; the right expires without renewal
                except CommandError:
                    self._token = None

    def take_right(self) -> str:
        """Take the right to move unless it is held; return its token."""
        if self._given is not None:
            return self._given
        with self._errors(), self._lock:
            if self._token is None:
                asked = {"ttl_s": _TTL_S}
                self._token = str(self._daemon.post("/control", asked)["token"])
            return self._token

    def command(self, do: str, program: str = "", wanted: Mapping[str, Any] | None = None) -> None:
        body: dict[str, Any] = {"program": program} if program else {}
        if wanted is not None:
            body["wanted"] = dict(wanted)
        token = self.take_right() if do in _WITH_RIGHT else None
        with self._errors():
            self._daemon.post(f"/{do}", body, token)

    @contextmanager
    def _errors(self) -> Iterator[None]:
        if self._closed.is_set():
            raise NotRunning("the handle is closed")
        with errors_for_scripts():
            yield

    def brief_status(self) -> dict[str, Any]:
        """See `Backend.brief_status`; raises Error if the loop hangs with the drives' power on."""
        status = self.status()
        if status["state"] == "active" and _silent_s(status) > _HANGS_S:
            raise Error(
                f"the loop has run no cycle for {_HANGS_S:g} s: does a controller or program not "
                "return? `cdpr estop` removes the power"
            )
        return status

    def status(self) -> dict[str, Any]:
        self._looked_s = time.monotonic()
        with self._errors():
            status = self._daemon.get("/status")
        if status["state"] == DEAD:
            raise NotRunning(death_text(status))
        return status

    def _statuses(self, pause_s: float) -> Iterator[dict[str, Any]]:
        """Yield statuses at this interval while the loop runs and bus time advances."""
        last_s, passed_s = -1.0, time.monotonic()
        while True:
            status = self.status()
            if (now_s := _time_of(status)) != last_s:
                last_s, passed_s = now_s, time.monotonic()
            if _silent_s(status) > _SILENT_S or time.monotonic() - passed_s > _SILENT_S:
                return
            yield status
            time.sleep(pause_s)

    def wait(self, seconds: float) -> None:
        if not self._lockstep:
            time.sleep(seconds)
            return
        end_s = math.nan
        for status in self._statuses(min(seconds, _LOOK_S)):  # bus time may run slowly
            if math.isnan(end_s):
                end_s = _time_of(status) + seconds
            if _time_of(status) >= end_s:
                return

    def observe(self, seconds: float) -> Row:
        until_s, rows = math.nan, list[tuple[Any, ...]]()
        for status in self._statuses(_OBSERVE_S):
            if math.isnan(until_s):
                until_s = _time_of(status) + seconds
            if _time_of(status) >= until_s and len(rows) >= _LEAST_ROWS:
                break
            axes = [[_number(axis[key]) for axis in status["axes"]] for key in _OBSERVED]
            rows.append((_time_of(status), *axes))
        else:
            raise Error(f"the loop has run no cycle for {_SILENT_S:g} s")
        dtype = cycle_dtype(len(self.description["axes"]))
        return np.array(rows, [(name, dtype[name]) for name in ("time_s", *_OBSERVED)])

    def true_pose(self) -> FloatArray:
        raise Error("true_pose: available only from simulate()")

    def plan(self, file: Path) -> str:
        # imported here: it uses this module
        from cdpr_tools.client.path_following import path_source  # noqa: PLC0415

        try:
            body = path_source(file)
        except (ProfileError, ControlError) as error:
            raise Refused(str(error)) from None
        with self._errors():
            number = self._daemon.post("/path", body)["number"]
            while (job := self._daemon.get("/path"))["planning"]:
                self._looked_s = time.monotonic()
                time.sleep(_PLAN_S)
        if job["number"] != number:
            raise Refused(f"{file}: another client has planned a path meanwhile; plan again")
        if job["error"]:
            raise Refused(str(job["error"]))
        if (line := job.get("next_line")) is not None:
            raise Refused(f"{file}: is too long for one plan; divide it at line {line}")
        return str(job["plan"])

    @contextmanager
    def open_stream(self) -> Iterator[Callable[[Sequence[float], float], None]]:
        """Open the daemon's stream; yield a function that sends a position and its scale."""
        token = self.take_right()
        with self._errors():
            given = self._daemon.post("/stream", token=token)
        session = StreamSession(int(given["session"]), bytes.fromhex(given["key"]))
        with StreamClient(given["host"], int(given["port"]), session) as client:

            def send(position_m: Sequence[float], scale: float) -> None:
                client.send(position_m, scale=scale)
                client.receive()

            yield send

    def log(self, fields: Sequence[str]) -> Row:
        last = _recorded_file(self.status())
        if not self._file or not last:
            raise Error(f"{self.description['robot']}: its daemon does not record")
        until_ns, deadline = time.monotonic_ns(), time.monotonic() + _RECORDED_S
        while True:
            time.sleep(_RECORD_S)  # the recorder writes data once they are a second old
            log = self._recorded(
                Path(self._file), Path(last), {"stamp_ns": None, **dict.fromkeys(fields)}
            )
            complete = bool(log.size and log["stamp_ns"][-1] >= until_ns)
            if complete or time.monotonic() > deadline:
                break
        if not complete and self.status()["state"] in ("ready", "active"):
            raise Error(f"{last}: the recording lags behind the robot; is the disk too slow?")
        return log[list(fields)][log["stamp_ns"] <= until_ns]

    def _recorded(self, first: Path, last: Path, fields: Collection[str]) -> Row:
        """Return the rows since the handle was opened, from the recordings `first` to `last`."""
        # imported here: it needs pyarrow
        from cdpr_rt.service.recording_file import RecordingError  # noqa: PLC0415
        from cdpr_rt.service.recording_reader import RecordingReader  # noqa: PLC0415

        dtype = cycle_dtype(len(self.description["axes"]))
        dtype = np.dtype([(name, dtype[name]) for name in fields])
        rows = [np.zeros(0, dtype)]
        try:
            for path in sorted(first.parent.glob("*.mcap")):
                if first.name <= path.name <= last.name:
                    for part in RecordingReader(path).cycles(fields):
                        if part["stamp_ns"][-1] >= self._began_ns:
                            rows.append(_rows_of(part, dtype))
        except RecordingError as error:
            raise Error(str(error)) from None
        log = np.concatenate(rows)
        return log[log["stamp_ns"] >= self._began_ns]

    def inject_fault(self, axis: int, fault: str, value: int | None) -> None:
        with self._errors():
            robot = load_robot(self.description["reference"])
            one, buses = robot.axes[axis], self.status()["buses"]
            url = BusUrl.parse(str(buses[one.bus]["url"]))
            with fault_access(robot, one, url) as access:
                access.inject(fault, None if value is None else str(value))

    def end(self) -> None:
        with self._errors():
            end_daemon(self._daemon, Output(as_json=True), Path(self._daemon.where))

    def close(self) -> None:
        with self.opened:
            with suppress(CommandError):
                self._hold()
            self.release()

    def _hold(self) -> None:
        if self._closed.is_set():
            return
        if self._given is not None:  # a stop would also end this procedure
            self._daemon.post("/program", {"program": "hold"}, self._given)
        elif self._token is not None:
            self._daemon.post("/hold")

    def release(self) -> None:
        """Release the right to move; programs that do not need it continue. Idempotent."""
        if self._closed.is_set():
            return
        self._closed.set()
        if (token := self._token) is not None:
            self._renewer.join(_RENEW_S)
            if not self._renewer.is_alive():  # else the service hangs, and the right expires
                with suppress(CommandError):
                    self._daemon.release(token)


def _keep_right(held: weakref.ref[_Remote], closed: threading.Event) -> None:
    """Renew the right to move while the handle exists and the script runs."""
    while not closed.wait(_RENEW_S) and threading.main_thread().is_alive():
        backend = held()
        if backend is None:
            return
        backend.renew_right()
        del backend


def _silent_s(status: Mapping[str, Any]) -> float:
    return float(status["loop"]["silent_s"])


def _time_of(status: Mapping[str, Any]) -> float:
    return float((status["cycle"] or {"time_s": math.inf})["time_s"])


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _recorded_file(status: Mapping[str, Any]) -> str:
    recording = status["parts"].get("recording") or {}
    return str(recording["file"]) if recording.get("recording") else ""


def _rows_of(columns: Mapping[str, Any], dtype: np.dtype[Any]) -> Row:
    rows = np.zeros(len(columns["stamp_ns"]), dtype)
    for name in columns.keys() & set(dtype.names or ()):
        rows[name] = columns[name]
    return rows


class _DaemonProcess:
    """A running `cdpr run` that ends together with this process."""

    def __init__(self, arguments: Sequence[str]) -> None:
        self.lowering_s = 0.0
        """Longest time in which the daemon lowers the platform."""
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115  # closed when it has ended
        self._process = subprocess.Popen(
            module_command("cdpr_tools.cli", "run", *arguments, "--exit-with-stdin", "--json"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            start_new_session=True,  # a Ctrl-C of the terminal ends the script, then the daemon
        )
        try:
            assert self._process.stdout is not None  # opened with PIPE
            line = self._process.stdout.readline()
            ready = json.loads(line).get("ready") if line else None
            if ready is None:
                status = self._process.wait(_END_S)
                text = self._last_error()
                if status != BAD_INPUT:
                    raise Error(text)
                raise InvalidArgument(text) if text.startswith("--") else InvalidRobot(text)
            self.socket = Path(ready["socket"])
        except BaseException:
            with suppress(Error):
                self.stop()
            raise

    def stop(self) -> None:
        """End the daemon under control and wait until it has ended; kill a daemon that hangs.

        A Ctrl-C takes effect afterwards. Raises Error if the daemon does not confirm the power-off.
        """
        process, interrupted, status = self._process, False, None
        deadline = time.monotonic() + _END_S + self.lowering_s
        assert process.stdin is not None  # opened with PIPE
        with self._errors, process:
            while status is None:
                try:
                    process.stdin.close()
                    status = process.wait(max(0.0, deadline - time.monotonic()))
                except KeyboardInterrupt:
                    interrupted = True
                except subprocess.TimeoutExpired:
                    process.kill()
                    raise Error("the daemon does not end; `cdpr estop` removes the power") from None
            if status:
                raise Error(self._last_error())
        if interrupted:
            raise KeyboardInterrupt

    def _last_error(self) -> str:
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        causes = [line.removeprefix("cdpr: ") for line in lines if "could not start" not in line]
        return (causes or lines or ["the daemon ended"])[-1]
