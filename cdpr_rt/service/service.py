"""State of the service behind the control interface: link to the loop, lease, parts."""

from __future__ import annotations

import asyncio
import json
import logging
import tempfile
import time
from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final, Protocol

from cdpr_profiles.errors import brief
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.states import EMERGENCY_STOP
from cdpr_rt.errors import ControlError
from cdpr_rt.loop.right import PublishedRight
from cdpr_rt.loop.stop_socket import STOPS
from cdpr_rt.service.access_control import Tickets
from cdpr_rt.service.lease import Lease, LeaseError
from cdpr_rt.service.link import LoopLink, Reply
from cdpr_rt.service.part import Part
from cdpr_rt.service.procedure_runner import ProcedureRunner
from cdpr_rt.service.recording_folder import RecordingFolder
from cdpr_rt.service.rows import cycle_figures, plain
from cdpr_rt.service.setpoint_stream import SetpointStream, StreamError

# Planning of paths, in a separate process so that it does not delay the service.

_MOST_CHARS: Final = 2000
"""Longest text of an error; it is limited because every `GET /path` repeats it."""

Plan = Callable[[Path, dict[str, Any]], Awaitable[tuple[int, str]]]
"""Function that plans a file with given options; returns the exit status and a JSON text."""


class PlannerBusyError(ControlError):
    """No path can be planned now."""


class PathPlanRunner:
    """Plans one path at a time; clients read `job` until it is not `planning`."""

    def __init__(self) -> None:
        self.work: Plan | None = None
        """The planner, set by the owner of the robot's file; without it nothing can be planned."""
        self.job: dict[str, Any] = {"number": 0, "planning": False, "error": None, "plan": None}
        """The last job: `plan` is the name of the plan, or `error` the reason why the robot cannot
        follow the path.
        """
        self._task: asyncio.Task[None] | None = None
        self._cancelled = ""

    def begin(self, request: dict[str, Any]) -> dict[str, Any]:
        """Begin to plan a file; return the job. Raises PlannerBusyError while one is planned."""
        if self.work is None:
            raise PlannerBusyError("this daemon plans no paths")
        if self.job["planning"]:
            raise PlannerBusyError("another path is being planned")
        number = self.job["number"] + 1
        self.job = {"number": number, "planning": True, "error": None, "plan": None}
        self._cancelled = ""
        self._task = asyncio.create_task(self._plan(self.work, request))
        return self.job

    def cancel(self, why: str) -> None:
        """Discard the path that is being planned, because a stop was requested."""
        if self.job["planning"]:
            self._cancelled = why

    async def _plan(self, work: Plan, request: dict[str, Any]) -> None:
        answer: dict[str, Any] = {"error": "planning was cancelled"}
        try:
            with tempfile.TemporaryDirectory(prefix="cdpr-path-") as folder:
                file = Path(folder) / request["name"]
                await asyncio.to_thread(file.write_text, request["text"], encoding="utf-8")
                status, text = await work(file, request)
            answer = _read(status, text.replace(str(file), request["name"]))
            if self._cancelled:
                answer = {"error": f"not started: {self._cancelled} during planning"}
        except TimeoutError:  # a subclass of OSError, but without a text
            answer = {"error": "planning takes too long; divide the path"}
        except OSError as error:
            answer = {"error": f"cannot be planned: {error.strerror}"}
        finally:
            self.job = {**answer, "number": self.job["number"], "planning": False}
            self.job.setdefault("plan", None)
            self.job.setdefault("error", None)


class WorkspaceBorder:
    """Computes the border of the robot's workspace once, on the first request."""

    def __init__(self) -> None:
        self.work: Callable[[], Awaitable[tuple[int, str]]] | None = None
        """Function that computes it in a separate process; None if no robot is known."""
        self._found: asyncio.Task[dict[str, Any]] | None = None

    async def get(self) -> dict[str, Any]:
        """Return it, as `models.Border`; raises PlannerBusyError if it cannot be computed."""
        if self.work is None:
            raise PlannerBusyError("this daemon computes no workspace")
        if self._found is None:
            self._found = asyncio.create_task(self._compute(self.work()))
        found = await asyncio.shield(self._found)
        if error := found.get("error"):
            self._found = None  # the next request tries again
            raise PlannerBusyError(str(error))
        return found

    @staticmethod
    async def _compute(work: Awaitable[tuple[int, str]]) -> dict[str, Any]:
        try:
            return _read(*await work)
        except (OSError, TimeoutError) as error:
            return {"error": f"the workspace cannot be computed: {error}"}


def _read(status: int, text: str) -> dict[str, Any]:
    """Return the result of the process."""
    try:
        answer = json.loads(text)
    except ValueError:
        answer = None
    if not isinstance(answer, dict):
        return {"error": f"planning ended with status {status}: out of memory? divide the path"}
    if status:
        error = {"error": brief(str(answer.get("error", "refused")), _MOST_CHARS)}
        return error | {key: answer[key] for key in ("route_m", "obstacle") if key in answer}
    return answer


_TURN_S = 0.2
_LOG = logging.getLogger("cdpr.service")
WAIT_S: Final = {
    "configure": 60.0,
    "check": 30.0,
    "release": 30.0,
    "enable": 30.0,
    "disable": 30.0,
    "acknowledge": 60.0,
    "shutdown": 30.0,
    "program": 15.0,
    "object": 60.0,
}
"""Timeouts of slow replies; all other replies come within a few cycles."""
_WAIT_S = 3.0
_CHANGING_S = 1.0
"""A value that a client changed within this time may still be changing."""
_PROCEDURE_STOPS: Final = "the procedure stops under control"
_PROCEDURE_RUNS: Final = "a procedure runs the drives; cancel it, or wait for its end"


class InjectionError(ControlError):
    """A fault could not be injected into a simulated drive."""


class DriveTextsError(ControlError):
    """What drives report cannot be explained; the message gives the reason."""


class DriveTexts(Protocol):
    """Explains what drives report; the first call may take a second.

    Each method raises DriveTextsError if the robot's file cannot be read.
    """

    def drives(self, statuswords: Sequence[int]) -> list[dict[str, Any]]:
        """Return for each axis what its statusword means, as `models.Drive`."""

    def buses(self) -> list[dict[str, Any]]:
        """Return the planned load of each bus, as `models.Bus`."""

    def object(self, axis: int, index: int, sub: int, data: bytes) -> dict[str, Any]:
        """Return the meaning of an object's data, as `models.DriveObject`."""


class DescribingError(ControlError):
    """A robot cannot be described or saved; the message gives the reason."""


async def _describe_nothing(_request: dict[str, Any]) -> dict[str, Any]:
    raise DescribingError("this daemon describes no robots")


class Service:
    """One daemon's service: made once, used by all routes."""

    def __init__(self, block: SharedBlock, robot: str) -> None:
        self.robot = robot
        self.block = block
        self.link = LoopLink(block)
        self.lease = Lease(PublishedRight(block))
        self.tickets = Tickets()
        self.events = self.link.events
        self.parts: list[Part] = []
        self._unstarted: dict[str, str] = {}
        self.planner = PathPlanRunner()
        """Plans paths in a separate process."""
        self.procedures = ProcedureRunner(
            self.lease, lambda text: self.events.add("procedure", text), self._pass_buses,
            block.counters["procedure_pid"],
        )  # fmt: skip
        """Runs commissioning and calibration in a separate process."""
        self.border = WorkspaceBorder()
        self.stream: SetpointStream | None = None
        """The running set-point stream, None if none is received."""
        self.counts = {"refused": 0, "live_clients": 0, "slow_clients_dropped": 0}
        """Status values of the service itself, shown as the part `service`."""
        self.background: list[Callable[[], Coroutine[Any, Any, None]]] = []
        """Further coroutines that run as long as the service, until cancelled."""
        self.http: tuple[str, int] | None = None
        """TCP address at which the service listens, None without TCP."""
        self.page_url = ""
        """Address of the page with its key, "" without a page."""
        self.end_daemon: Callable[[], None] = lambda: None
        """Ends the daemon if its loop has died and no command can reach it."""
        self.wake_launcher: Callable[[], None] = lambda: None
        """Resumes the launcher if it was stopped (SIGSTOP, Ctrl-Z)."""
        self.inject: Callable[[int, str], str] | None = None
        """Function that breaks or mends a simulated axis and returns a description; None for real
        drives."""
        self.recordings: RecordingFolder | None = None
        """The robot's recordings, None if this daemon does not record."""
        self.describe: Callable[[dict[str, Any]], Awaitable[dict[str, Any]]] = _describe_nothing
        """Function that describes, diagnoses or saves a robot in a separate process."""
        self.drives: DriveTexts | None = None
        """Explains what drives report."""
        self._sets: dict[tuple[Any, ...], tuple[float, str]] = {}
        self._held_by = ""
        self._noted: Reply | None = None
        self._stops_taken = int(self.link.status().get("stops", {}).get("taken", 0))

    def count_refusal(self) -> None:
        """Count a request that the access control has rejected."""
        self.counts["refused"] += 1

    def start_parts(self, parts: Sequence[Part]) -> None:
        """Start each part; if a part cannot start, status and events give the reason."""
        for part in parts:
            try:
                part.start()
            except Exception as error:
                self._unstarted[part.name] = f"cannot start: {error}"
                self.note_failure(part.name, f"{part.name}: cannot start: {error}")
            else:
                self.parts.append(part)
                if isinstance(part, SetpointStream):
                    self.stream = part

    def note_failure(self, part: str, text: str) -> None:
        """Report in the events and on standard error that a part has failed; from any thread."""
        self.events.add(part, text)
        _LOG.error("%s", text)

    def stop_parts(self) -> None:
        """End all started parts, even if one fails to end."""
        for part in reversed(self.parts):
            try:
                part.stop()
            except Exception as error:
                self.events.add(part.name, f"{part.name}: failed to end: {error}")

    def issue_stream_session(self, token: str | None) -> dict[str, Any]:
        """Open a stream session for the holder of the right to move; see `models.StreamAccess`.

        Raises LeaseError, and StreamError if no stream is received.
        """
        if self.stream is None:
            raise StreamError(
                f"{self.robot}: its daemon receives no set-point stream: it was started with "
                "--no-stream or --read-only"
            )
        given, (host, port) = self.stream.sessions.issue(token), self.stream.address
        return {"session": given.number, "key": given.key.hex(), "host": host, "port": port}

    # -- commands

    async def command_with_right(
        self,
        do: str,
        client: str,
        token: str | None,
        gone: Callable[[], Awaitable[bool]],
        *,
        stops: int | None = None,
        **fields: Any,
    ) -> Reply:
        """Send a command that needs the right to move; renew that right while it is carried out.

        The right expires if the client has `gone` during that time. The loop starts no motion if
        there were more than `stops` stops, by default those until now. Raises LeaseError and the
        errors of `LoopLink.command`.
        """
        stops = self.block.stops if stops is None else stops
        right = self.lease.renew(token, moves=True).number
        self._note_stop()
        if self.procedures.is_ending:
            raise LeaseError(f"{_PROCEDURE_STOPS}; wait for its end")
        keeping = asyncio.create_task(self._keep_right(token, gone))
        try:
            # begun here, so that the client's next request comes after this command
            return await self.command(do, client, right=right, stops=stops, **fields)
        finally:
            keeping.cancel()

    async def _keep_right(self, token: str | None, gone: Callable[[], Awaitable[bool]]) -> None:
        with suppress(LeaseError):  # the same client has released the right in the meantime
            while not await gone():
                self.lease.renew(token)
                await asyncio.sleep(_TURN_S)

    async def command(self, do: str, client: str, **fields: Any) -> Reply:
        """Send a command that needs no right to move; raises the errors of `LoopLink.command`.

        If the loop has died, `shutdown` also ends the daemon: the drives have stopped without the
        loop.
        """
        if do == "shutdown" and self.link.dead:
            self.events.add("command", f"{do} by {client}")
            self.end_daemon()
            self.wake_launcher()
            return Reply(True, self.link.ended_how, self.link.state())
        if do == "configure" and self.procedures.has_bus:  # two masters would run the drives
            return Reply(False, f"{do}: {_PROCEDURE_RUNS}", self.link.state())
        stopping = do in STOPS and self._cancel_work(f"{do} by {client}")
        try:
            reply = await self.link.command(do, WAIT_S.get(do, _WAIT_S), client=client, **fields)
        finally:
            if do == "shutdown":  # the loop needs no launcher to stop
                self.wake_launcher()
        if stopping and not reply.ok:  # the loop moves nothing, but a procedure does
            reply = replace(reply, ok=True, text=_PROCEDURE_STOPS, refusal=None)
        if reply is self._noted:
            return reply  # the command was shared by many clients
        self._noted = reply
        result = "" if reply.ok else f": refused: {reply.text}"
        if do == "set" and reply.ok:
            self._note_set(client, fields["wanted"])
        elif do != "object":
            what = fields["program"] if do == "program" else do
            self.events.add("command", f"{what} by {client}{result}")
        elif fields["value"] is not None:
            what = "{index:04X}h:{sub} of axis {axis} set to {value}".format(**fields)
            self.events.add("command", f"object {what} by {client}{result}")
        return reply

    def _note_set(self, client: str, wanted: Mapping[str, Any]) -> None:
        """Note which values a client has changed; an event follows when the client stops changing
        them."""
        program = self.link.status().get("program")
        values = ", ".join(f"{key} {value}" for key, value in wanted.items())
        text = f"set {values} of {program} by {client}"
        self._sets[client, program, *wanted] = time.monotonic(), text

    def _note_sets(self) -> None:
        now_s = time.monotonic()
        for key, (changed_s, text) in list(self._sets.items()):
            if now_s - changed_s > _CHANGING_S:
                del self._sets[key]
                self.events.add("set", text)

    def _cancel_work(self, why: str) -> bool:
        """Cancel planning and end a procedure, because of a stop; return whether one runs."""
        self.planner.cancel(why)
        return self.procedures.end(why)

    async def _pass_buses(self, take: bool) -> str:
        """Let the loop take its buses or release them to a procedure; return why not, or ""."""
        for do in ("configure", "check") if take else ("release",):
            try:
                reply = await self.link.command(do, WAIT_S[do], client="procedure")
            except ControlError as error:
                return f"{do}: {error}"
            if not reply.ok:
                return f"{do}: {reply.text}"
        return ""

    # -- status

    def status(self) -> dict[str, Any]:
        """Return the complete status, as `models.Status`."""
        link = self.link
        of_loop = link.status()
        counters = self.block.counters
        return {
            "program": None,
            "commanded": "",
            "reason_limit": None,
            "faults": [],
            "read_only": False,
            "lockstep": False,
            "notices": [],
            **of_loop,
            "released": self.procedures.has_bus and bool(of_loop.get("released")),
            "robot": self.robot,
            "stop_count": self.block.stops,
            "state": link.state(),
            "reason": link.ended_how or str(of_loop.get("reason", "")),
            "loop": {
                "pid": int(counters["loop_pid"][0]),
                "alive": not link.dead and int(counters["loop_pid"][0]) != 0,
                "silent_s": link.silent_s(),
            },
            "control": self.control(),
            **cycle_figures(self.block, link.description()),
            "calibration": link.description().get("calibration"),
            "parts": self.part_figures(),
        }

    def control(self) -> dict[str, Any]:
        """Return the holder of the right to move."""
        holder = self.lease.holder()
        if holder is None:
            return {"held": False, "client": None, "left_s": 0.0, "procedure": ""}
        return {"held": True, **asdict(holder)}

    def part_figures(self) -> dict[str, dict[str, Any]]:
        """Return the status values of each part, and of the service itself."""
        where = None if self.http is None else f"{self.http[0]}:{self.http[1]}"
        figures: dict[str, dict[str, Any]] = {"service": {"http": where, **self.counts}}
        figures |= {name: {"error": text} for name, text in self._unstarted.items()}
        for part in self.parts:
            try:
                figures[part.name] = plain(part.status())
            except Exception as error:
                figures[part.name] = {"error": str(error)}
        return figures

    # -- in the background

    async def watch(self) -> None:
        """Follow the loop and the holder of the right to move, until cancelled."""
        if self.link.status().get("released"):
            self.procedures.recover()
        async with asyncio.TaskGroup() as tasks:
            for work in (
                self.link.watch, self._watch_holder, self.procedures.watch, *self.background
            ):  # fmt: skip
                tasks.create_task(work())

    async def _watch_holder(self) -> None:
        while True:
            self._note_holder()
            self._note_stop()
            self._note_sets()
            self._note_emergency()
            self.block.counters["service_alive_ns"][0] = time.monotonic_ns()
            await asyncio.sleep(_TURN_S / 4)

    def _note_stop(self) -> None:
        """Record a stop from the loop's own socket in the same way as a stop through the
        service.
        """
        stops = self.link.status().get("stops") or {}
        if (taken := stops.get("taken", 0)) == self._stops_taken:
            return
        self._stops_taken = taken
        text = f"{stops['do']} by {stops['client']}"
        self._cancel_work(text)
        self.events.add("command", text)
        if stops["do"] == "shutdown":  # the loop needs no launcher to stop
            self.wake_launcher()

    def _note_emergency(self) -> None:
        """End a procedure that runs the loop's drives, if the loop has ended or must cut power."""
        if not self.procedures.has_bus:
            return
        if self.link.dead:
            self.procedures.cut(self.link.ended_how)
        elif self.link.status().get("reason") == EMERGENCY_STOP:
            self.procedures.cut(EMERGENCY_STOP)

    def _note_holder(self) -> None:
        holder = self.lease.holder()
        client = holder.client if holder else ""
        if client != self._held_by:
            gone, self._held_by = self._held_by, client
            text = (
                f"{client} has the right to move"
                if client
                else f"{gone} no longer has the right to move"
            )
            self.events.add("control", text)
