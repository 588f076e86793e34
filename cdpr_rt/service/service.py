"""State of the service behind the control interface: link to the loop, lease, parts."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from contextlib import suppress
from typing import Any, Final

from cdpr_rt.core.cycle_row import AXIS_FIELDS, SCALARS
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.runtime.right import PublishedRight
from cdpr_rt.service.http.tickets import Tickets
from cdpr_rt.service.lease import Lease, LeaseError
from cdpr_rt.service.link import URGENT, LoopLink, Reply
from cdpr_rt.service.part import Part
from cdpr_rt.service.path_planner import PathPlanRunner
from cdpr_rt.service.rows import newest_row, plain, row_table
from cdpr_rt.service.streams.setpoint_stream import SetpointStream, StreamError

_TURN_S = 0.2
_LOG = logging.getLogger("cdpr.service")
_AXIS_FIELDS: Final = tuple(field.name for field in AXIS_FIELDS if field.status)
_DESCRIBED: Final = ("name", "bus", "node_id", "winch", "commissioned")
WAIT_S: Final = {
    "configure": 60.0,
    "check": 30.0,
    "enable": 30.0,
    "disable": 30.0,
    "acknowledge": 60.0,
    "shutdown": 30.0,
    "program": 15.0,
}
"""Time-outs of replies; all others come within a few cycles."""
_WAIT_S = 3.0


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
        """Plans paths, in a process of its own."""
        self.stream: SetpointStream | None = None
        """The running set-point stream, None where none is received."""
        self.counts = {"refused": 0, "live_clients": 0, "slow_clients_dropped": 0}
        """Figures of the service itself, shown as the part `service`."""
        self.background: list[Callable[[], Coroutine[Any, Any, None]]] = []
        """Further coroutines that run while the service does, until cancelled."""
        self.http: tuple[str, int] | None = None
        """Address at which it listens on TCP, None where it does not."""
        self.end_daemon: Callable[[], None] = lambda: None
        """Ends the daemon where its loop has died, and no command can reach it."""
        self._held_by = ""
        self._noted: Reply | None = None

    def count_refusal(self) -> None:
        """Count a request that was refused by the access control."""
        self.counts["refused"] += 1

    def start_parts(self, parts: Sequence[Part]) -> None:
        """Start each; of one that cannot start, status and events say why."""
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
        """Say in the events, and on standard error, that a part does not work; from any thread."""
        self.events.add(part, text)
        _LOG.error("%s", text)

    def stop_parts(self) -> None:
        """End all that have started, whatever becomes of one."""
        for part in reversed(self.parts):
            try:
                part.stop()
            except Exception as error:
                self.events.add(part.name, f"{part.name}: did not end well: {error}")

    def issue_stream_session(self, token: str | None) -> dict[str, Any]:
        """Give the holder of the right to move a session of the stream, as `models.StreamAccess`.

        Raises LeaseError, and StreamError where no stream is received.
        """
        if self.stream is None:
            raise StreamError(
                f"{self.robot}: its daemon takes no set-point stream; allowed: one that was "
                "started with --stream HOST:PORT"
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
        **fields: Any,
    ) -> Reply:
        """Send a command that needs the right to move; keep that right alive while it is done.

        It lapses when the client has `gone` meanwhile. Raises LeaseError and what
        `LoopLink.command` raises.
        """
        right = self.lease.renew(token).number
        keeping = asyncio.create_task(self._keep_right(token, gone))
        try:
            # begun here and now, so that what the client asks for next comes after it
            return await self.command(do, client, right=right, **fields)
        finally:
            keeping.cancel()

    async def _keep_right(self, token: str | None, gone: Callable[[], Awaitable[bool]]) -> None:
        with suppress(LeaseError):  # given back meanwhile, by the same client
            while not await gone():
                self.lease.renew(token)
                await asyncio.sleep(_TURN_S)

    async def command(self, do: str, client: str, **fields: Any) -> Reply:
        """Send a command that anybody may give; raises what `LoopLink.command` raises.

        A daemon whose loop has died is ended by `shutdown` as well: its drives have stopped by
        themselves.
        """
        if do == "shutdown" and self.link.dead:
            self.events.add("command", f"{do} by {client}")
            self.end_daemon()
            return Reply(True, self.link.ended_how, self.link.state())
        if do in URGENT:
            self.planner.cancel(f"{do} by {client}")
        reply = await self.link.command(do, WAIT_S.get(do, _WAIT_S), client=client, **fields)
        if reply is self._noted:
            return reply  # many have asked for the same at once
        self._noted = reply
        if do != "set" or not reply.ok:
            result = "" if reply.ok else f": refused: {reply.text}"
            self.events.add("command", f"{do} by {client}{result}")
        return reply

    # -- what there is to see

    def status(self) -> dict[str, Any]:
        """Return everything at a glance, as `models.Status`."""
        link = self.link
        of_loop = link.status()
        row = newest_row(self.block)
        counters = self.block.counters
        return {
            "program": None,
            "reason_limit": None,
            "read_only": False,
            "lockstep": False,
            "notices": [],
            **of_loop,
            "robot": self.robot,
            "state": link.state(),
            "reason": link.ended_how or str(of_loop.get("reason", "")),
            "loop": {
                "pid": int(counters["loop_pid"][0]),
                "alive": not link.dead and int(counters["loop_pid"][0]) != 0,
                "silent_s": link.silent_s(),
            },
            "control": self.control(),
            "cycle": None if row is None else row_table(row, SCALARS),
            "axes": self._axes(row),
            "parts": self.part_figures(),
        }

    def control(self) -> dict[str, Any]:
        """Return who holds the right to move."""
        holder = self.lease.holder()
        if holder is None:
            return {"held": False, "client": None, "left_s": 0.0}
        return {"held": True, "client": holder.client, "left_s": holder.left_s}

    def part_figures(self) -> dict[str, dict[str, Any]]:
        """Return what each part tells of itself, and the service's own figures."""
        where = None if self.http is None else f"{self.http[0]}:{self.http[1]}"
        figures: dict[str, dict[str, Any]] = {"service": {"http": where, **self.counts}}
        figures |= {name: {"error": text} for name, text in self._unstarted.items()}
        for part in self.parts:
            try:
                figures[part.name] = plain(part.status())
            except Exception as error:
                figures[part.name] = {"error": str(error)}
        return figures

    def _axes(self, row: Any) -> list[dict[str, Any]]:
        described = self.link.description().get("axes") or [{} for _ in range(self.block.n)]
        axes = [{key: axis.get(key) for key in _DESCRIBED} for axis in described]
        if row is None:
            return axes
        table = row_table(row, _AXIS_FIELDS)
        return [
            {**axis, **{name: table[name][number] for name in _AXIS_FIELDS}}
            for number, axis in enumerate(axes[: self.block.n])
        ]

    # -- in the background

    async def watch(self) -> None:
        """Follow the loop and who holds the right to move, until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            for work in (self.link.watch, self._watch_holder, *self.background):
                tasks.create_task(work())

    async def _watch_holder(self) -> None:
        while True:
            self._note_holder()
            self.block.counters["service_alive_ns"][0] = time.monotonic_ns()
            await asyncio.sleep(_TURN_S / 4)

    def _note_holder(self) -> None:
        holder = self.lease.holder()
        client = holder.client if holder else ""
        if client != self._held_by:
            gone, self._held_by = self._held_by, client
            text = (
                f"{client} may move"
                if client
                else f"{gone} does not hold the right to move any more"
            )
            self.events.add("control", text)
