"""Client of the daemon, over its Unix socket or over TCP with the key; and the daemon's start."""

from __future__ import annotations

import errno
import getpass
import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http import HTTPStatus
from pathlib import Path
from shlex import quote
from typing import Any, Final

import httpx

from cdpr_profiles.bounded_input import parse_json
from cdpr_profiles.errors import ProfileError, brief
from cdpr_rt.loop.stop_socket import STOP_SUFFIX, StopUnansweredError, send_stop
from cdpr_rt.refusal import CommandRefusal
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.client.status_text import DEAD, death_text
from cdpr_tools.command_group import ROBOT_VARIABLE
from cdpr_tools.daemon.loop_file import LoopFile, launcher_loads, launcher_pid
from cdpr_tools.daemon.paths import (
    LAUNCHER_SUFFIX,
    find_launcher_files,
    find_sockets,
    found_instead,
    is_file_of,
    is_trusted,
)
from cdpr_tools.daemon.settings import read_key
from cdpr_tools.errors import (
    BadInputError,
    CommandError,
    ConnectionLostError,
    CrowdedError,
    LoopEndedError,
    NoDaemonError,
    ServiceRefusalError,
    UnansweredError,
    WorkFailedError,
)
from cdpr_tools.output import Output

_CONNECT_S, _ANSWER_S = 5.0, 70.0
_BAD_INPUT: Final = frozenset({400, 401, 403, 404, 405, 413, 422})
_LEASE_S = 2.0
_STOP_WAIT_S: Final = {"/hold": 3.0, "/disable": 30.0, "/shutdown": 30.0}
_STOP_TRIES, _STOP_AGAIN_S = 50, 0.02


class Daemon:
    """Requests to one daemon; a refusal is raised as the command's error.

    Stops go to the loop's own socket `stops`, if this client can reach one.
    """

    def __init__(self, http: httpx.Client, where: str, stops: Path | None = None) -> None:
        self._http = http
        self.where = where
        self._stops = stops
        self.name = f"{_user()}@{socket.gethostname()}"[:64]

    def get(self, path: str) -> dict[str, Any]:
        """Return the answer of a GET request for `path`."""
        return self._ask("GET", path)

    def post(
        self, path: str, body: dict[str, Any] | None = None, token: str | None = None
    ) -> dict[str, Any]:
        """Send a command under this user's name; return the answer.

        A stop over HTTP that is lost because of too many connections is sent again.
        """
        if path in _STOP_WAIT_S and (answer := self._stop(path)) is not None:
            return answer
        body = {"client": self.name, **(body or {})}
        tries = _STOP_TRIES if path in _STOP_WAIT_S else 1
        for left in reversed(range(tries)):
            try:
                return self._ask("POST", path, body, token)
            except (ConnectionLostError, CrowdedError):
                if not left:
                    raise
                time.sleep(_STOP_AGAIN_S)
        raise AssertionError("there is at least one try")

    def _stop(self, path: str) -> dict[str, Any] | None:
        """Request a stop directly from the loop; return its answer, None if it has no socket."""
        if self._stops is None:
            return None
        do = path.removeprefix("/")
        try:
            answer = send_stop(_trusted(self._stops), do, self.name, _STOP_WAIT_S[path])
        except PermissionError:
            return None
        except StopUnansweredError as error:
            raise WorkFailedError(
                f"{do}: {error}; `cdpr status` shows its state, `cdpr estop` removes the power"
            ) from None
        if answer is None or answer["ok"]:
            return answer
        if (refusal := CommandRefusal.from_json(answer.get("refusal"))) is not None:
            raise DaemonRefusalError.of(refusal)
        raise DaemonRefusalError(str(answer["text"]))

    @contextmanager
    def control(self) -> Iterator[str]:
        """Hold the right to move in the block; yield its token. The caller must renew the right."""
        token = str(self.post("/control", {"ttl_s": _LEASE_S})["token"])
        try:
            yield token
        finally:
            with suppress(CommandError):
                self.release(token)

    def renew(self, token: str) -> None:
        """Renew the right to move."""
        self._ask("PUT", "/control", token=token)

    def release(self, token: str) -> None:
        """Release the right to move."""
        self._ask("DELETE", "/control", token=token)

    def _ask(
        self,
        method: str,
        path: str,
        body: dict[str, Any] | None = None,
        token: str | None = None,
    ) -> dict[str, Any]:
        headers = {} if token is None else {"X-Control-Token": token}
        try:
            response = self._http.request(method, path, json=body, headers=headers)
        except (httpx.ConnectError, httpx.ConnectTimeout) as error:
            raise NoDaemonError(
                f"no daemon answers at {self.where} ({error}); `cdpr run ROBOT` starts one"
            ) from None
        except (httpx.ReadError, httpx.WriteError, httpx.RemoteProtocolError) as error:
            raise ConnectionLostError(f"{self.where}: {error or type(error).__name__}") from None
        except httpx.TimeoutException as error:
            raise UnansweredError(f"{self.where}: {error or type(error).__name__}") from None
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise NoDaemonError(f"{self.where}: {error or type(error).__name__}") from None
        try:
            answer = parse_json(response.content, self.where)
        except ProfileError:
            answer = None
        if not isinstance(answer, dict):
            if response.status_code == HTTPStatus.SERVICE_UNAVAILABLE:
                raise CrowdedError(f"{self.where}: has too many connections; try again")
            raise WorkFailedError(f"{self.where}: is not a daemon")
        if response.is_success:
            return answer
        message = str(answer.get("error", response.reason_phrase))
        if response.status_code in _BAD_INPUT:
            raise BadInputError(message)
        if answer.get("state") == DEAD:
            raise LoopEndedError(death_text(self.get("/status")))
        if (refusal := CommandRefusal.from_json(answer.get("refusal"))) is not None:
            raise DaemonRefusalError.of(refusal)
        if response.status_code == HTTPStatus.CONFLICT:
            refused = DaemonRefusalError if answer.get("state") else ServiceRefusalError
            raise refused(message)  # as text, whether from the loop or the service
        raise WorkFailedError(message)


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # a user without a name, as in a container
        return f"#{os.getuid()}"


@contextmanager
def open_daemon(
    robot: str | None,
    unix: Path | None,
    url: str | None,
    key_file: Path | None,
    answer_s: float = _ANSWER_S,
) -> Iterator[Daemon]:
    """Yield the daemon that the options name; without options, the only one.

    The daemon must answer each request within `answer_s`. Raises BadInputError and NoDaemonError.
    """
    timeout = httpx.Timeout(_CONNECT_S, read=answer_s)
    if url is not None:
        if robot is not None or unix is not None:
            raise BadInputError("--url: cannot be combined with --robot or --socket")
        headers = {}
        if key_file is not None:
            headers["Authorization"] = f"Bearer {read_key(key_file).decode()}"
        try:
            # TLS is not used here, and loading its certificates takes 20 ms
            http = httpx.Client(
                base_url=url, headers=headers, timeout=timeout, trust_env=False, verify=False
            )
        except (httpx.InvalidURL, ValueError) as error:
            raise BadInputError(f"--url {url}: {error}") from None
        if http.base_url.scheme != "http":
            raise BadInputError(f"--url {url}: allowed: http://HOST:PORT")
        with http:
            yield Daemon(http, url)
        return
    path = _trusted(unix) if unix is not None else _only_socket(robot)
    transport = httpx.HTTPTransport(uds=str(path), verify=False)
    with httpx.Client(
        transport=transport, base_url="http://daemon", timeout=timeout, verify=False
    ) as http:
        daemon = Daemon(http, str(path), path.with_suffix(STOP_SUFFIX))
        if robot is not None and robot.endswith(".toml"):
            _require_file(daemon, Path(robot).resolve())
        yield daemon


def _require_file(daemon: Daemon, path: Path) -> None:
    """Raise BadInputError if a daemon of this name runs another file than the given one.

    The loop's file names the robot, so this works even if the service hangs.
    """
    try:
        runs = LoopFile.read(LoopFile.beside(Path(daemon.where))).reference
    except WorkFailedError:
        runs = str(daemon.get("/description").get("reference"))
    if not is_file_of(runs, path):
        raise BadInputError(
            f"--robot {path}: the daemon of this name runs {runs}; allowed: that file, or --socket"
        )


def _trusted(path: Path) -> Path:
    """Return the path of a socket that this user or root owns; raises BadInputError."""
    with suppress(OSError):  # a missing file does not answer either
        owner = path.lstat().st_uid
        if not is_trusted(path, owner):
            raise BadInputError(f"--socket {path}: belongs to user {owner}, not to you or root")
    return path


def answers(robot: str | None, unix: Path | None) -> bool:
    """Whether a daemon of this robot, of any robot, or at this socket accepts a connection."""
    return any(map(_is_alive, find_sockets(robot) if unix is None else [unix]))


def live_sockets() -> list[Path]:
    """Return the sockets of all running daemons that this user may command."""
    return [path for path in find_sockets() if _is_alive(path)]


def _only_socket(robot: str | None) -> Path:
    found = [path for path in find_sockets(robot) if _is_alive(path)]
    if len(found) == 1:
        return found[0]
    if not found:
        whose = "" if robot is None else f" for {robot}"
        if robot is not None and robot == os.environ.get(ROBOT_VARIABLE):
            whose += f" (from {ROBOT_VARIABLE})"
        if is_starting(robot):
            raise NoDaemonError(f"the daemon{whose} is starting, or ending: it does not answer")
        others = found_instead(live_sockets())
        raise NoDaemonError(f"no daemon runs{whose}; `cdpr run ROBOT` starts one{others}")
    if robot is not None:  # this user's daemons before the system's
        return found[0]
    names = ", ".join(path.stem for path in found)
    raise BadInputError(f"{len(found)} daemons run: choose one by --robot ({names})")


def is_starting(robot: str | None, unix: Path | None = None) -> bool:
    """Whether a daemon of the robot, of any robot, or at this socket is starting or ending."""
    marks = find_launcher_files(robot) if unix is None else [unix.with_suffix(LAUNCHER_SUFFIX)]
    return any(launcher_pid(mark) is not None for mark in marks) or launcher_loads(robot, unix)


def _is_alive(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(1.0)
        # EAGAIN: the daemon runs, but too many connections wait
        return probe.connect_ex(str(path)) in (0, errno.EAGAIN)


def axis_values(texts: list[str], axes: list[dict[str, Any]], unit: str) -> dict[int, float]:
    """Return the numbers given as AXIS=NUMBER, by the axis' index; raises BadInputError.

    A number without an axis is for the robot's only axis.
    """
    names = [str(axis.get("name")) for axis in axes]
    values: dict[int, float] = {}
    for text in texts:
        name, equals, number = text.rpartition("=")
        if not equals and len(names) == 1:
            name = names[0]
        if name not in names:
            raise BadInputError(
                f"{text}: allowed: AXIS={unit} of {', '.join(map(repr, names))}, such as "
                f"{quote(f'{names[0]}=20')}"
            )
        if names.index(name) in values:
            raise BadInputError(f"{text}: {name} is given twice")
        try:
            values[names.index(name)] = float(number)
        except ValueError:
            raise BadInputError(f"{text}: {number!r} is not a number of {unit}") from None
    return values


def key_values(texts: list[str]) -> dict[str, Any]:
    """Return the values given as KEY=VALUE, with the value as JSON; raises BadInputError."""
    values: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise BadInputError(f"{text}: allowed: KEY=VALUE")
        try:
            values[key] = parse_json(value, brief(key))
        except ProfileError as error:
            raise BadInputError(f"{error} (a value is JSON, such as 1.5 or [1, 2])") from None
    return values


# if the installation did not compile the control loop, the first start does it, for minutes
_START_S, _ASK_S, _TELL_S = 600.0, 0.2, 10.0


def await_socket(robot: str | None, unix: Path | None, out: Output) -> None:
    """Wait until a daemon accepts a connection; do not wait if no launcher runs.

    Raises WorkFailedError if it takes too long.
    """
    waiting = _Waiting(out)
    while not answers(robot, unix):
        if not is_starting(robot, unix):
            return  # and none is expected
        waiting.go_on("its simulated drives and processes are starting")


def await_start(daemon: Daemon, out: Output) -> None:
    """Wait until the drives have booted for the first time, or the reason of a failure is known.

    Raises WorkFailedError if it takes too long, or if the control loop has died.
    """
    waiting = _Waiting(out)
    while what := _startup_stage(status := daemon.get("/status"), waiting.waited):
        waiting.go_on(what)
    if status["state"] == DEAD:
        raise WorkFailedError(death_text(status))


class _Waiting:
    """Reports from time to time that a daemon is still starting."""

    def __init__(self, out: Output) -> None:
        self._out = out
        self._began_s = self._tell_s = time.monotonic()
        self.waited = False

    def go_on(self, what: str) -> None:
        """Wait a moment for `what`; raises WorkFailedError if it takes too long."""
        self.waited = True
        now_s = time.monotonic()
        taken_s = now_s - self._began_s
        if taken_s > _START_S:
            raise WorkFailedError(f"the daemon has not started within {_START_S:g} s")
        if now_s >= self._tell_s:
            after = f" (waiting for {taken_s:.0f} s)" if taken_s >= 1.0 else ""
            self._out.note(f"the daemon is still starting: {what}{after} ...")
            self._tell_s += _TELL_S
        time.sleep(_ASK_S)


def _startup_stage(status: dict[str, Any], waited: bool) -> str:
    """Return the present step of a daemon that is starting; "" if it is ready.

    If this command has started the daemon, the start includes the check of the bus.
    """
    if status.get("state") == "starting":
        return "its control loop is loading"
    booting = ("unconfigured", "inactive") if waited else ("unconfigured",)
    if status.get("state") in booting and not status.get("reason", "none yet"):
        return "its drives are booting"
    return ""
