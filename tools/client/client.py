"""The daemon as a client sees it: over its Unix socket, or over TCP with the key; and its start."""

from __future__ import annotations

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

from cdpr_profiles.errors import ProfileError, brief
from cdpr_profiles.reading.bounded_input import parse_json
from cdpr_profiles.reading.places import reference
from cdpr_rt.refusal import CommandRefusal
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.client.status_text import DEAD, death_text
from cdpr_tools.daemon.loop_file import launcher_does
from cdpr_tools.daemon.paths import (
    LAUNCHER_SUFFIX,
    find_launcher_files,
    find_sockets,
    found_instead,
    is_trusted,
)
from cdpr_tools.daemon.settings import read_key
from cdpr_tools.errors import BadInputError, CommandError, WorkFailedError
from cdpr_tools.output import Output

_CONNECT_S, _ANSWER_S = 5.0, 70.0
_BAD_INPUT: Final = frozenset({400, 401, 403, 404, 405, 413, 422})
_LEASE_S = 2.0
_STOPS: Final = frozenset({"/hold", "/disable", "/shutdown"})
_STOP_TRIES, _STOP_AGAIN_S = 50, 0.02


class NoDaemonError(WorkFailedError):
    """No daemon answers."""


class ConnectionLostError(NoDaemonError):
    """The connection ended before the answer."""


class Daemon:
    """Requests to one daemon; a refusal is raised as the command's error."""

    def __init__(self, http: httpx.Client, where: str) -> None:
        self._http = http
        self.where = where
        self.name = f"{_user()}@{socket.gethostname()}"[:64]

    def get(self, path: str) -> dict[str, Any]:
        """Return what is at `path`."""
        return self._ask("GET", path)

    def post(
        self, path: str, body: dict[str, Any] | None = None, token: str | None = None
    ) -> dict[str, Any]:
        """Send a command in this user's name; return the answer.

        A stop whose connection is lost, as under too many connections, is sent again.
        """
        body = {"client": self.name, **(body or {})}
        tries = _STOP_TRIES if path in _STOPS else 1
        for left in reversed(range(tries)):
            try:
                return self._ask("POST", path, body, token)
            except ConnectionLostError:
                if not left:
                    raise
                time.sleep(_STOP_AGAIN_S)
        raise AssertionError("there is one try at least")

    @contextmanager
    def control(self) -> Iterator[HeldRight]:
        """Hold the right to move in the block; where the block fails, motion is held first."""
        token = str(self.post("/control", {"ttl_s": _LEASE_S})["token"])
        control = HeldRight(self, token)
        try:
            yield control
        except BaseException:
            if control.obeyed:
                with suppress(CommandError):
                    control.hold()
            raise
        finally:
            with suppress(CommandError):
                self._ask("DELETE", "/control", token=token)

    def renew(self, token: str) -> None:
        """Renew the right to move."""
        self._ask("PUT", "/control", token=token)

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
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise NoDaemonError(f"{self.where}: {error or type(error).__name__}") from None
        try:
            answer = parse_json(response.content, self.where)
        except ProfileError:
            answer = None
        if not isinstance(answer, dict):
            raise WorkFailedError(f"{self.where}: does not answer as a daemon does")
        if response.is_success:
            return answer
        message = str(answer.get("error", response.reason_phrase))
        if response.status_code in _BAD_INPUT:
            raise BadInputError(message)
        if answer.get("state") == DEAD:
            raise WorkFailedError(death_text(self.get("/status")))
        if (refusal := CommandRefusal.from_json(answer.get("refusal"))) is not None:
            raise DaemonRefusalError.of(refusal)
        if response.status_code == HTTPStatus.CONFLICT and answer.get("state"):
            raise DaemonRefusalError(message)  # the loop's, in words alone
        raise WorkFailedError(message)


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # a user without a name, as in a container
        return f"#{os.getuid()}"


class HeldRight:
    """The right to move, while it is held."""

    def __init__(self, daemon: Daemon, token: str) -> None:
        self.daemon = daemon
        self.token = token
        self.obeyed = False
        """Whether a command has been carried out."""

    def post(self, path: str, body: dict[str, Any]) -> dict[str, Any]:
        """Send a command that needs the right."""
        answer = self.daemon.post(path, body, self.token)
        self.obeyed = True
        return answer

    def renew(self) -> None:
        """Renew the right."""
        self.daemon.renew(self.token)

    def hold(self) -> None:
        """Stop the motion, stay there."""
        self.daemon.post("/hold")


@contextmanager
def open_daemon(
    robot: str | None,
    unix: Path | None,
    url: str | None,
    key_file: Path | None,
    answer_s: float = _ANSWER_S,
) -> Iterator[Daemon]:
    """Yield the daemon that the options name, the only one there is where they name none.

    It is to answer each request within `answer_s`.
    Raises BadInputError and NoDaemonError.
    """
    timeout = httpx.Timeout(_CONNECT_S, read=answer_s)
    if url is not None:
        if robot is not None or unix is not None:
            raise BadInputError("--url: not together with --robot or --socket")
        headers = {}
        if key_file is not None:
            headers["Authorization"] = f"Bearer {read_key(key_file).decode()}"
        try:
            # TLS is not spoken here, and its certificates take 20 ms to read
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
        daemon = Daemon(http, str(path))
        if robot is not None and robot.endswith(".toml"):
            _require_file(daemon, Path(robot).resolve())
        yield daemon


def _require_file(daemon: Daemon, path: Path) -> None:
    """Raise BadInputError where a daemon runs another robot than that of a file of its name."""
    runs = str(daemon.get("/description").get("reference"))
    if runs not in (reference("robots", path), reference("winches", path)):
        raise BadInputError(
            f"--robot {path}: the daemon of this name runs {runs}; allowed: that file, or --socket"
        )


def _trusted(path: Path) -> Path:
    """Return the path of a socket that this user or root owns; raises BadInputError."""
    with suppress(OSError):  # what is not there does not answer either
        owner = path.lstat().st_uid
        if not is_trusted(path, owner):
            raise BadInputError(f"--socket {path}: was put there by user {owner}, not by you")
    return path


def answers(robot: str | None, unix: Path | None) -> bool:
    """Whether a daemon of the robot, of any, or at this socket, can be connected to."""
    return any(map(_is_alive, find_sockets(robot) if unix is None else [unix]))


def _only_socket(robot: str | None) -> Path:
    found = [path for path in find_sockets(robot) if _is_alive(path)]
    if len(found) == 1:
        return found[0]
    if not found:
        whose = "" if robot is None else f" for {robot}"
        doing = _launcher_does(find_launcher_files(robot))
        if doing is not None:
            what = f"is still starting, {doing}" if doing else "is starting, or ending"
            raise NoDaemonError(f"the daemon{whose} {what}: it does not answer")
        others = found_instead(filter(_is_alive, find_sockets()))
        raise NoDaemonError(f"no daemon runs{whose}; `cdpr run ROBOT` starts one{others}")
    if robot is not None:  # this user's before the system's
        return found[0]
    names = ", ".join(path.stem for path in found)
    raise BadInputError(f"{len(found)} daemons run: choose one by --robot ({names})")


def _launcher_does(marks: list[Path]) -> str | None:
    """Return what the first of these launchers that runs is doing, None where none runs."""
    return next((doing for doing in map(launcher_does, marks) if doing is not None), None)


def _is_alive(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(1.0)
        return probe.connect_ex(str(path)) == 0


def axis_values(texts: list[str], axes: list[dict[str, Any]], unit: str) -> dict[int, float]:
    """Return the numbers given as AXIS=NUMBER, by the axis' place; raises BadInputError.

    A number alone is for the robot's only axis.
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
            raise BadInputError(f"{text}: {name} is there twice")
        try:
            values[names.index(name)] = float(number)
        except ValueError:
            raise BadInputError(f"{text}: {number!r} is no number of {unit}") from None
    return values


def key_values(texts: list[str]) -> dict[str, Any]:
    """Return what was given as KEY=VALUE, the value as JSON; raises BadInputError."""
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


# the first start on a machine compiles the control loop, a slow one for minutes
_START_S, _ASK_S, _TELL_S = 600.0, 0.2, 10.0


def await_socket(robot: str | None, unix: Path | None, out: Output) -> None:
    """Wait until a daemon whose launcher runs can be connected to; not where none does.

    Raises WorkFailedError where it takes too long.
    """
    waiting = _Waiting(out)
    while not answers(robot, unix):
        marks = find_launcher_files(robot)
        if unix is not None:
            marks = [unix.with_suffix(LAUNCHER_SUFFIX)]
        if (doing := _launcher_does(marks)) is None:
            return  # nor is one to be expected
        waiting.go_on(doing or "its simulated drives and its processes come up")


def await_start(daemon: Daemon, out: Output) -> None:
    """Wait until the drives have booted for the first time, or why they have not is known.

    Raises WorkFailedError where it takes too long, or where the control loop has died.
    """
    waiting = _Waiting(out)
    while what := _startup_stage(status := daemon.get("/status"), waiting.waited):
        waiting.go_on(what)
    if status["state"] == DEAD:
        raise WorkFailedError(death_text(status))


class _Waiting:
    """Tells now and then that a daemon is still starting."""

    def __init__(self, out: Output) -> None:
        self._out = out
        self._began_s = self._tell_s = time.monotonic()
        self.waited = False

    def go_on(self, what: str) -> None:
        """Wait a moment for `what`; raises WorkFailedError where it takes too long."""
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
    """Return what is going on in a daemon that is not up yet, "" in one that is.

    One that has been waited for goes on to check its bus; another may stay inactive.
    """
    if status.get("state") == "starting":
        notices = "; ".join(status.get("notices") or ())
        return (
            notices or "its control loop is loaded, and compiled where this machine runs it first"
        )
    booting = ("unconfigured", "inactive") if waited else ("unconfigured",)
    if status.get("state") in booting and not status.get("reason", "none yet"):
        return "its drives are booting"
    return ""
