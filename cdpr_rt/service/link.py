"""The service's end of the shared memory: texts from the loop, and commands to it."""

from __future__ import annotations

import asyncio
import os
import select
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final

from cdpr_rt.core.shared_block import MESSAGE_BYTES, SharedBlock, SharedBlockError
from cdpr_rt.errors import ControlError
from cdpr_rt.loop.stop_socket import STOPS
from cdpr_rt.service.rows import PublishedText, WallClock

# Event log of the daemon: states, reasons, commands, and faults of its parts.

_KEPT: Final = 512
_LONGEST: Final = 1000


class EventLog:
    """The last events; any thread may add and read. Repeated events are counted, not stored
    again.
    """

    def __init__(self, wall_ns: Callable[[], int]) -> None:
        self._wall_ns = wall_ns
        self._events: deque[dict[str, Any]] = deque(maxlen=_KEPT)
        self._number = 0
        self._lock = threading.Lock()
        self.listeners: list[Callable[..., None]] = []
        """Function called for every event with the text, and with kind and details as keywords."""

    def add(self, kind: str, text: str, **detail: Any) -> None:
        """Add an event of a kind ("state", "reason", "command", "control", the name of a part)."""
        text = text[:_LONGEST]
        time = datetime.fromtimestamp(self._wall_ns() * 1e-9, UTC).isoformat("T", "milliseconds")
        with self._lock:
            last = self._events[-1] if self._events else {}
            same = (last.get("kind"), last.get("text")) == (kind, text)
            self._number += 1
            if same:
                self._events.pop()
            self._events.append(
                {
                    "number": self._number,
                    "time": time,
                    "kind": kind,
                    "text": text,
                    "times": last["times"] + 1 if same else 1,
                    "detail": detail,
                }
            )
        for listener in self.listeners:
            listener(text, kind=kind, detail=detail)

    def since(self, number: int = 0, most: int = _KEPT) -> list[dict[str, Any]]:
        """Return the events after a given number, oldest first, limited to the newest `most`."""
        with self._lock:
            found = [dict(event) for event in self._events if event["number"] > number]
        return found[len(found) - min(most, len(found)) :]


DEAD: Final = "dead"
ENDED: Final = "the loop has ended"
"""Reason of a loop that has ended, unless the launcher reports that it died."""
STARTING: Final = "starting"
_POLL_BUSY_S, _POLL_IDLE_S = 0.002, 0.05
_MOST_PENDING = 32
_SILENT_S = 5.0
_COALESCED: Final = STOPS | {"acknowledge", "configure", "check"}
"""Commands without arguments: if two clients send the same one at the same time, it is sent
once."""


class LoopGoneError(ControlError):
    """The loop cannot take commands: it has not begun, has ended, or hangs."""


class LoopBusyError(ControlError):
    """The loop accepts no more commands at present, or has not answered in time."""


class CommandTooLongError(ControlError):
    """The command does not fit into a message."""


@dataclass(frozen=True)
class Reply:
    """Reply of the loop."""

    ok: bool
    text: str
    state: str
    refusal: dict[str, Any] | None = None
    """The refusal in the form of `CommandRefusal.as_json`, None if there is only a text."""


class LoopLink:
    """Commands with their replies, the loop's texts, and whether the loop is alive.

    Methods must be called in the asyncio loop in which `watch` runs; other threads may read
    `status`, `description`, `state` and `wall_ns`.
    """

    def __init__(self, block: SharedBlock) -> None:
        self.block = block
        self.events = EventLog(self.wall_ns)
        self._status = PublishedText(block, "status")
        self._description = PublishedText(block, "description")
        self._pending: dict[int, asyncio.Future[Reply]] = {}
        self._coalesced: dict[str, asyncio.Future[Reply]] = {}
        self._wake = asyncio.Event()
        self._loop = _ProcessWatch()
        self._last_reported = ("", "")
        while block.take_reply() is not None:  # replies to a service that has ended
            pass

    # -- data from the loop

    def status(self) -> dict[str, Any]:
        """Return the status that the loop publishes, {} before the first one."""
        self._status.update()
        return self._status.value

    def description(self) -> dict[str, Any]:
        """Return the robot's description, {} before the loop has published it."""
        self._description.update()
        return self._description.value

    def state(self) -> str:
        """Return the loop's state by name, or "starting", or "dead"."""
        if self.dead:
            return DEAD
        return str(self.status().get("state", STARTING))

    @property
    def dead(self) -> bool:
        """Whether a loop has run and has ended."""
        return self._loop.ended(int(self.block.counters["loop_pid"][0]))

    @property
    def ended_how(self) -> str:
        """Reason of the loop's end, "" while it is alive."""
        if not self.dead:
            return ""
        status = self.status()
        # the launcher knows the exit status and writes the reason in place of the loop
        reason = str(status.get("reason", "")) if status.get("state") == DEAD else ""
        return reason or ENDED

    def silent_s(self) -> float:
        """Return the time since the loop's last iteration, 0 before the first."""
        alive_ns = int(self.block.counters["loop_alive_ns"][0])
        return max(0.0, (time.monotonic_ns() - alive_ns) * 1e-9) if alive_ns else 0.0

    def wall_ns(self) -> int:
        """Return the time of day, ns since 1970; setting the system clock later has no effect."""
        return WallClock(self.block)(time.monotonic_ns())

    # -- commands

    async def command(self, do: str, wait_s: float, **fields: Any) -> Reply:
        """Send a command; return the loop's reply to it.

        Raises LoopGoneError, LoopBusyError (also after `wait_s` without a reply) and
        CommandTooLongError.
        """
        self._require_loop()
        if do not in STOPS:
            self._require_cycles()
        else:
            self.block.count_stop()
            # commands stay in order: a stop without a reply must come after all commands that may
            # start motion
            self._take_replies()
        future = self._coalesced.get(do)
        if future is None or future.done():
            future = self._send(do, fields)
        self._require_cycles()  # a silent loop obeys the stop if it continues
        try:
            return await asyncio.wait_for(asyncio.shield(future), wait_s)
        except TimeoutError:
            raise LoopBusyError(
                f"the loop has not answered {do!r} within {wait_s:g} s; look at the status"
            ) from None

    def _require_loop(self) -> None:
        if self.dead:
            raise LoopGoneError(self.ended_how)
        if int(self.block.counters["loop_pid"][0]) == 0:
            raise LoopGoneError("the loop has not started yet")

    def _require_cycles(self) -> None:
        if self.silent_s() > _SILENT_S:
            raise LoopGoneError(f"the loop has run no cycle for {self.silent_s():.1f} s")

    def _send(self, do: str, fields: dict[str, Any]) -> asyncio.Future[Reply]:
        urgent = do in STOPS
        if not urgent and len(self._pending) >= _MOST_PENDING:
            raise LoopBusyError(f"{_MOST_PENDING} commands are already waiting for the loop")
        post = self.block.post_urgent if urgent else self.block.post_command
        try:
            number = post({"do": do, **fields})
        except SharedBlockError as error:
            if "bytes" in str(error):
                raise CommandTooLongError(
                    f"the command is too long; allowed: {MESSAGE_BYTES} bytes"
                ) from None
            raise LoopBusyError(str(error)) from None
        future: asyncio.Future[Reply] = asyncio.get_running_loop().create_future()
        self._pending[number] = future
        if do in _COALESCED:
            self._coalesced[do] = future
        future.add_done_callback(lambda done: self._forget(number, do, done))
        self._wake.set()
        return future

    def _forget(self, number: int, do: str, done: asyncio.Future[Reply]) -> None:
        self._pending.pop(number, None)
        if self._coalesced.get(do) is done:
            del self._coalesced[do]
        if not done.cancelled():
            done.exception()  # retrieve the exception even if no client waits any more

    # -- background tasks

    async def watch(self) -> None:
        """Read replies and record changes, until cancelled."""
        looked_s = 0.0
        while True:
            self._take_replies()
            now_s = time.monotonic()
            if now_s - looked_s >= _POLL_IDLE_S:
                looked_s = now_s
                self._look()
            self._wake.clear()
            pause_s = _POLL_BUSY_S if self._pending else _POLL_IDLE_S
            try:
                await asyncio.wait_for(self._wake.wait(), pause_s)
            except TimeoutError:
                continue

    def _take_replies(self) -> None:
        while (reply := self.block.take_reply()) is not None:
            future = self._pending.get(int(reply.get("to", 0)))
            if future is not None and not future.done():
                text, state = str(reply.get("text", "")), str(reply.get("state", ""))
                future.set_result(Reply(bool(reply.get("ok")), text, state, reply.get("refusal")))

    def _look(self) -> None:
        dead = self.dead
        if dead:
            for future in list(self._pending.values()):
                if not future.done():
                    future.set_exception(LoopGoneError(self.ended_how))
        status = self.status()
        state = self.state()
        reason = self.ended_how or str(status.get("reason", ""))
        before = self._last_reported
        self._last_reported = state, reason
        if state != before[0]:
            self.events.add("state", state, program=status.get("program"))
        if reason and reason != before[1]:
            self.events.add("reason", reason, limit=status.get("reason_limit"))


class _ProcessWatch:
    """Shows whether the loop's process runs; its descriptor cannot refer to another process
    later.
    """

    def __init__(self) -> None:
        self._pid = self._fd = 0
        self._ended = False

    def ended(self, pid: int) -> bool:
        if self._ended or pid == 0:
            return self._ended
        if pid != self._pid:
            try:
                self._fd = os.pidfd_open(pid)
            except ProcessLookupError:
                self._ended = True
                return True
            self._pid = pid
        poll = select.poll()  # `select` fails at descriptors from 1024
        poll.register(self._fd, select.POLLIN)
        self._ended = bool(poll.poll(0))
        return self._ended
