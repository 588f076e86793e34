"""Runs one procedure at a time as a child process, under the right to move of its client."""

from __future__ import annotations

import asyncio
import json
import math
import os
import secrets
import signal
import time
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from cdpr_profiles.errors import brief, printable
from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.errors import ControlError, RawLogError
from cdpr_rt.identification.rawlog import map_raw_log
from cdpr_rt.service.lease import Lease

_LOOK_S: Final = 0.1
_AGAIN_S: Final = 1.0
"""Shortest time between a request to end and the next, which removes the power immediately."""
_END_S: Final = 45.0
"""A procedure that does not end within this time after a request is killed; its drives then stop
without its heartbeat."""
_CUT_S: Final = 2.0
"""The same after an emergency stop."""
_MOST_LINES, _MOST_STEPS, _MOST_CHARS = 200, 400, 400
_LINE_BYTES: Final = 1 << 22
_KINDS: Final = {
    ".html": "text/html; charset=utf-8",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".json": "application/json",
    ".csv": "text/csv; charset=utf-8",
    ".toml": "text/plain; charset=utf-8",
}
"""Files of a report that are served."""


class ProcedureError(ControlError):
    """A procedure cannot be started."""


@dataclass(frozen=True)
class Procedure:
    """What a procedure runs; only the owner of the whitelist makes one."""

    what: str
    """For events and people, such as `commission lower`."""
    commands: tuple[tuple[str, ...], ...]
    """Command lines, one after the other; each ends with its standard input, and prints its
    progress and its result as lines of JSON."""
    token_variable: str
    """Environment variable in which the commands find the token of the right to move."""
    folder: Path
    """Folder for its files."""
    reports: tuple[tuple[str, str], ...] = ()
    """Title and path, within the folder, of each report that it may write."""
    takes_bus: bool = False
    """Whether it runs drives of the loop's buses, which the loop must release."""
    moves: bool = False
    """Whether it moves the robot through the loop; meanwhile its client cannot."""
    values: dict[str, Any] = field(default_factory=dict)
    """Further facts for the client."""


class Buses(Protocol):
    """The loop's buses."""

    def __call__(self, take: bool) -> Awaitable[str]:
        """Let the loop release its buses, or take them again; return why it failed, or ""."""


class ProcedureRunner:
    """Runs one procedure at a time; clients read `job()`.

    A procedure ends, as with Ctrl-C at a terminal, if it is cancelled, if anybody stops the robot,
    or if its client loses the right to move. `pid`, which outlives this process, has the process
    that runs the drives of the loop's buses, or 0. For one asyncio loop.
    """

    def __init__(
        self, lease: Lease, note: Callable[[str], None], buses: Buses, pid: IntArray
    ) -> None:
        self._lease, self._note, self._buses, self._pid = lease, note, buses, pid
        self.plan: Callable[[Any], Procedure] | None = None
        """Function that returns the procedure for a checked request; set by its owner.

        It raises ProcedureError. Without it no procedure runs.
        """
        self.offers: dict[str, Any] = {}
        """Facts about this robot that clients need before they choose, set by the owner."""
        self._number = 0
        self._running = False
        self._procedure: Procedure | None = None
        self._client = self._kind = self._ending = self._error = ""
        self._token = self._lent = ""
        self._result: dict[str, Any] | None = None
        self._lines: deque[str] = deque(maxlen=_MOST_LINES)
        self._steps: list[dict[str, Any]] = []
        self._process: asyncio.subprocess.Process | None = None
        self._task: asyncio.Task[None] | None = None
        self._asked_s = self._cut_s = 0.0
        self._began = 0.0
        self._folders: dict[str, Path] = {}

    # -- for clients

    @property
    def has_bus(self) -> bool:
        """Whether the running procedure runs the drives of the loop's buses."""
        return self._running and self._procedure is not None and self._procedure.takes_bus

    @property
    def is_ending(self) -> bool:
        """Whether a procedure runs that must end."""
        return self._running and bool(self._ending)

    def job(self) -> dict[str, Any]:
        """Return the running procedure or the last one, as `models.ProcedureJob`."""
        procedure = self._procedure
        return {
            "number": self._number,
            "procedure": self._kind,
            "what": procedure.what if procedure else "",
            "client": self._client,
            "running": self._running,
            "ending": self._ending,
            "steps": self._steps,
            "lines": list(self._lines),
            "error": self._error,
            "result": self._result,
            "reports": self._reports(),
            "offers": self.offers,
            "values": procedure.values if procedure else {},
        }

    async def begin(self, request: Any, client: str, token: str | None) -> dict[str, Any]:
        """Start the procedure of a request; raises ProcedureError and LeaseError."""
        self._lease.renew(token)
        if self.plan is None:
            raise ProcedureError("this daemon runs no procedures")
        if self._running:
            raise ProcedureError(
                f"{self._procedure.what if self._procedure else 'another procedure'} is running"
            )
        self._running = True  # before the first wait: a second request finds it
        self._procedure = None
        self._client, self._token = client, token or ""
        self._ending, self._asked_s, self._cut_s = "", 0.0, 0.0
        try:
            procedure = await asyncio.to_thread(self.plan, request)
            self._lent = self._lease.lend(token, procedure.what) if procedure.moves else ""
        except BaseException:
            self._running = False
            raise
        self._number += 1
        self._procedure, self._kind = procedure, str(request.procedure)
        self._error, self._result = "", None
        self._lines.clear()
        self._steps = []
        self._began = time.time()
        self._note(f"{procedure.what} begun by {client}")
        self._task = asyncio.create_task(self._run(procedure))
        return self.job()

    def end(self, why: str) -> bool:
        """Let the running procedure end under control; return whether one runs.

        A second request, a second later, removes the power immediately.
        """
        if not self._running:
            return False
        now_s = time.monotonic()
        if self._asked_s and now_s - self._asked_s < _AGAIN_S:
            return True
        self._asked_s = now_s
        self._ending = self._ending or why
        self._signal(signal.SIGINT)
        return True

    def cut(self, why: str) -> None:
        """Let the running procedure remove the power immediately, or kill it."""
        if self.end(why) and not self._cut_s:
            self._cut_s = time.monotonic()

    def recover(self) -> None:
        """End the procedure of a service that was killed; then the loop takes its buses again."""
        what = "procedure of a service that was killed"
        self._running = True
        self._procedure, self._kind = Procedure(what, (), "", Path(), takes_bus=True), "commission"
        self._client = "the daemon"
        self._number += 1
        self._note(f"{what}: the loop takes the drives again when this has ended")
        self._task = asyncio.create_task(self._run(self._procedure, int(self._pid[0])))
        self.end("its service was killed")

    def _signal(self, number: signal.Signals) -> None:
        with suppress(OSError):
            if self._process is not None and self._process.returncode is None:
                self._process.send_signal(number)
            elif self._leads_session(pid := int(self._pid[0])):
                os.kill(pid, number)

    @staticmethod
    def _leads_session(pid: int) -> bool:
        """Whether a process exists and leads a session, as procedures do."""
        try:
            return pid > 0 and os.getsid(pid) == pid
        except OSError:
            return False

    def find(self, secret: str, name: str) -> tuple[Path, str] | None:
        """Return a file of a report and its type, or None if there is no such file to serve."""
        folder = self._folders.get(secret)
        kind = _KINDS.get(Path(name).suffix)
        if folder is None or kind is None:
            return None
        try:
            whole = folder.resolve(strict=True)
            path = (whole / name).resolve(strict=True)
            if not path.is_relative_to(whole) or not path.is_file():
                return None
            return path, kind
        except (OSError, ValueError):
            return None

    def curves(self) -> dict[str, Any]:
        """Return the newest part of the present measurement, as `models.Curves`."""
        folder = self._procedure.folder if self._procedure and self._running else None
        return _curves(folder, self._began)

    def _reports(self) -> list[dict[str, str]]:
        procedure = self._procedure
        if procedure is None or self._running:
            return []
        there = []
        for title, name in procedure.reports:
            with suppress(OSError):
                if (procedure.folder / name).stat().st_mtime >= self._began - 1.0:
                    there.append((title, name))
        if not there:
            return []
        secret = next((key for key, one in self._folders.items() if one == procedure.folder), "")
        if not secret:
            secret = secrets.token_urlsafe(24)
            self._folders[secret] = procedure.folder
        return [{"title": title, "path": f"/reports/{secret}/{name}"} for title, name in there]

    # -- the process

    async def watch(self) -> None:
        """End the procedure if its client has lost the right to move, until cancelled."""
        try:
            while True:
                await asyncio.sleep(_LOOK_S)
                if self._running:
                    self._look()
        finally:  # the service ends
            if self._task is not None and not self._task.done():
                self.end("the daemon ends")
                with suppress(TimeoutError, asyncio.CancelledError):
                    await asyncio.wait_for(asyncio.shield(self._task), _AGAIN_S)
                self._signal(signal.SIGKILL)

    def _look(self) -> None:
        if not self._ending and not self._lease.is_held_by(self._token):
            self.end("its page no longer has the right to move")
        now_s = time.monotonic()
        if self._cut_s:
            self._signal(signal.SIGINT)  # the second interrupt removes the power
        if now_s - (self._asked_s or now_s) > _END_S or now_s - (self._cut_s or now_s) > _CUT_S:
            self._signal(signal.SIGKILL)

    async def _run(self, procedure: Procedure, orphan: int | None = None) -> None:
        released = orphan is not None
        try:
            while orphan and self._leads_session(orphan):
                await asyncio.sleep(_LOOK_S)
            if procedure.takes_bus and not released:
                self._error = await self._buses(False)
                released = not self._error
            for command in procedure.commands:
                if self._error or self._ending:
                    break
                self._error = await self._run_command(command, procedure.token_variable)
        except OSError as error:
            self._error = f"cannot be started: {error.strerror}"
        except (KeyError, TypeError):
            self._error = "its progress could not be read"
        finally:
            if released and not self._cut_s and (why := await self._buses(True)):
                self._error = f"{self._error}; {why}" if self._error else why
            if self._ending:
                self._error = f"ended: {self._ending}"
            self._process = None
            self._running = False
            self._lease.end_loan()
            self._note(f"{procedure.what}: {self._error or 'done'}")

    async def _run_command(self, command: tuple[str, ...], variable: str) -> str:
        """Run a command; return why it failed, or ""."""
        self._result = None
        process = self._process = await asyncio.create_subprocess_exec(
            *command,
            stdin=asyncio.subprocess.PIPE,  # a command ends with this pipe, even if we die
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            env={**os.environ, variable: self._lent or self._token},
            start_new_session=True,
            limit=_LINE_BYTES,
        )
        if self._procedure is not None and self._procedure.takes_bus:
            self._pid[0] = process.pid
        if self._ending:
            process.send_signal(signal.SIGINT)
        assert process.stdout is not None and process.stderr is not None
        try:
            await asyncio.gather(
                _each_line(process.stdout, self._take), _each_line(process.stderr, self._say)
            )
        except BaseException:  # the buses are taken again: the command may not run on
            self._signal(signal.SIGKILL)
            raise
        finally:
            status = await process.wait()
            self._pid[0] = 0
        if self._result is None:
            return f"ended with status {status}, without a result"
        return str(self._result.get("error", ""))  # without it, a status of 1 is a verdict

    def _say(self, line: str) -> None:
        self._lines.append(brief(printable(line), _MOST_CHARS))

    def _take(self, line: str) -> None:
        """Take a line of standard output: progress, or the result."""
        try:
            said = json.loads(line)
        except ValueError:
            return
        if not isinstance(said, dict):
            return
        if (progress := said.get("progress")) is None:
            self._result = said
            return
        what = str(progress["what"])
        if self._steps and self._steps[-1]["what"] == what:
            self._steps[-1] = progress
        elif len(self._steps) < _MOST_STEPS:
            self._steps.append(progress)


async def _each_line(stream: asyncio.StreamReader, take: Callable[[str], None]) -> None:
    while True:
        try:
            line = await stream.readline()
        except ValueError:  # longer than the limit; the rest follows
            continue
        if not line:
            return
        if text := line.decode("utf-8", "replace").strip():
            take(text)


# The curves of a measurement, from the raw log that is being written.

_SHOWN_S, _SHOWN_POINTS = 30.0, 300
_LEAST_BYTES: Final = 8192
"""Size of a log with some rows."""
_NO_CURVES: Final[dict[str, Any]] = {"name": "", "time_s": [], "error_deg": [], "torque_Nm": []}


def _curves(folder: Path | None, since: float) -> dict[str, Any]:
    """Return some points of the last seconds of the newest raw log below a folder."""
    try:
        logs = [] if folder is None else list(folder.rglob("raw/*.raw"))
        found = [(log.stat(), log) for log in logs]
        filled = [(of.st_mtime, log) for of, log in found if of.st_size > _LEAST_BYTES]
        changed_s, newest = max(filled, default=(0.0, Path()))
        return _points_of(newest) if changed_s >= since else _NO_CURVES
    except (OSError, ValueError, KeyError, RawLogError):  # just begun, or removed
        return _NO_CURVES


def _points_of(path: Path) -> dict[str, Any]:
    log = map_raw_log(path)
    period_s = float(log.header["period_s"])
    last = log.rows[-max(1, round(_SHOWN_S / period_s)) :]
    points = replace(log, rows=np.array(last[:: max(1, len(last) // _SHOWN_POINTS)]))
    time_s = points.column("time_s")
    error = np.degrees(points.column("setpoint_rad") - points.column("position_rad"))
    return {
        "name": str(log.header["what"]),
        "time_s": (time_s - time_s[-1]).tolist(),
        "error_deg": _finite(error),
        "torque_Nm": _finite(points.column("torque_actual_Nm")),
    }


def _finite(values: FloatArray) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values.tolist()]
