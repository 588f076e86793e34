"""The daemon's parent process: starts two processes, restarts the service, ends both in order."""

from __future__ import annotations

import os
import select
import signal
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import Any, Final

from cdpr_rt.core.shared_block import SharedBlock, SharedBlockError
from cdpr_rt.core.states import CUT_SHORT
from cdpr_rt.service.listening import listener_pid
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.daemon.child import (
    POWER_UNCONFIRMED,
    Child,
    described,
    loop_stop_s,
    move_to,
)
from cdpr_tools.daemon.loop_file import POWER_OFF_SIGNAL, LoopFile, started
from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.errors import BAD_INPUT, DONE, FAILED

# Notifications to systemd by sd_notify(3), if it requests them.

# systemd takes datagrams of 4096 bytes; a character has up to 4
_MOST_CHARS: Final = 900


class ServiceManager:
    """The service manager (such as systemd) that started this process with Type=notify, if any.

    The manager's variables are removed from the environment, so that children do not notify in
    place of this process.
    """

    def __init__(self) -> None:
        address = os.environ.pop("NOTIFY_SOCKET", "")
        microseconds = os.environ.pop("WATCHDOG_USEC", "")
        whose = os.environ.pop("WATCHDOG_PID", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._pending: dict[str, str] = {}
        watched = microseconds.isdigit() and whose in ("", str(os.getpid()))
        self.watchdog_s = int(microseconds) / 1e6 if watched else 0.0
        """Watchdog timeout; 0 without a watchdog."""

    @property
    def asks(self) -> bool:
        """Whether a manager requests notifications."""
        return bool(self._address)

    def notify(self, **fields: str | int) -> None:
        """Send assignments such as READY=1; keep those that the manager does not accept now.

        For each name, the newest assignment is kept until `retry` succeeds.
        """
        self._pending.update({key: _one_line(str(value)) for key, value in fields.items()})
        self.retry()

    def retry(self) -> None:
        """Send the assignments that the manager has not accepted yet; never waits."""
        if self._pending and self._sent(self._pending):
            self._pending.clear()

    def feed(self) -> bool:
        """Feed the watchdog; return whether it accepted the message, which is not repeated."""
        return self._sent({"WATCHDOG": "1"})

    def _sent(self, fields: Mapping[str, str]) -> bool:
        if not self._address:
            return True
        text = "\n".join(f"{key}={value}" for key, value in fields.items())
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as speaker:
            try:
                speaker.sendto(text.encode(), socket.MSG_DONTWAIT, self._address)
            except OSError:  # its queue is full, or it is restarting
                return False
        return True


def _one_line(text: str) -> str:
    """Return a value as one line, without a second assignment, short enough for the manager."""
    return " ".join(text.split())[:_MOST_CHARS]


LOOP: Final = "cdpr_tools.daemon.loop_process"
SERVICE: Final = "cdpr_tools.daemon.service_process"
DEAD: Final = "dead"
"""The reported state of a loop that has died; a living loop never has this state."""

_ON_COMMAND: Final = (DONE, POWER_UNCONFIRMED)
"""Exit statuses of a loop that has not died."""
_TURN_S = 0.2
# after a second Ctrl-C; cutting the power and confirming it takes less
_AT_ONCE_S = 10.0
# a Ctrl-C relayed by a program such as sudo within this time is not a second one
_SAME_PRESS_S = 0.2
# the recording is closed within this time
_SERVICE_STOP_S = 10.0
# the loop turns at every cycle, or about ten times a second without cycles
_LOOP_STALLED_S = 2.0
# the service turns about ten times a second; a disk may delay it
_SERVICE_STALLED_S = 10.0
# a service that is idle for this time is not even loading its libraries, on any machine
_SERVICE_START_S = 30.0
# after this time a busy service has loaded everything, and is busy with something else
_SERVICE_LOADING_S = 600.0
# delays before restarts: a service that dies immediately must not restart in a tight loop
_RESTART_S = (0.1, 0.5, 2.0, 5.0)
_STEADY_S = 30.0


class Launcher:
    """Runs the daemon until a stop request, or until its loop has stopped on command.

    `say` is called with messages for the user, `ready` with the loop's status once both processes
    run.
    """

    def __init__(
        self,
        settings: RunSettings,
        block: SharedBlock,
        say: Callable[[str], None],
        ready: Callable[[dict[str, Any]], None],
        manager: ServiceManager,
        simulator: OwnSimulator | None = None,
    ) -> None:
        self._settings = settings
        self._block = block
        self._say = say
        self._ready = ready
        self._simulator = simulator
        self._manager = manager
        self._signals: list[tuple[int, float]] = []
        self._restarts = 0
        self._restart_at = 0.0
        self._up = False
        self._stalled = False
        self._left_core = False
        self._loop_file: LoopFile | None = None
        self._reported = ""
        self._fault: tuple[Any, str] | None = None
        self._fed = 0.0
        self._failure = FAILED
        self.reason = ""
        """Why the daemon ended without a command."""

    def run(self) -> int:
        """Run both processes; return the exit status for the shell."""
        with _recorded_signals(self._signals) as wakeup:
            # the simulator lives as long as the loop, even if this process dies
            lifeline = () if self._simulator is None else (self._simulator.lifeline,)
            self._loop, self._wakeup = Child(LOOP, self._settings, lifeline), wakeup
            self._service: Child | None = None
            try:
                self._service = self._start_service()
                while not self._signals and not self._finished():
                    self._wait()
                    self._turn()
                return self._stop()
            finally:
                # after any failure here: lower the platform; the end of the loop cuts the power
                self._loop.stop(loop_stop_s(self._block))
                if self._loop_file is not None:
                    self._loop_file.remove(LoopFile.beside(self._settings.socket))
                if self._service is not None:
                    self._service.stop(_SERVICE_STOP_S)

    def _start_service(self) -> Child:
        return Child(SERVICE, self._settings, self._settings.service_fds)

    def _wait(self) -> None:
        poll = select.poll()
        poll.register(self._wakeup, select.POLLIN)
        for child in (self._loop, self._service):
            if child is not None and not child.end:
                poll.register(child.pidfd, select.POLLIN)
        for fd, _ in poll.poll(1000.0 * _TURN_S):
            if fd == self._wakeup:
                os.read(self._wakeup, 4096)

    def _finished(self) -> bool:
        """Return whether the daemon ends: its loop ended on command, or a process cannot start.

        A loop that died while it ran does not end the daemon: the service stays and reports it.
        """
        code = self._loop.process.poll()
        if code in _ON_COMMAND:
            return True
        if code is not None and not self._up:
            self._start_failed("loop", self._loop)
        return not self._up and bool(self.reason)

    def _start_failed(self, name: str, child: Child) -> None:
        self.reason = f"the {name} could not start: {child.end}"
        if child.process.returncode == BAD_INPUT:
            self._failure = BAD_INPUT

    def _turn(self) -> None:
        now = time.monotonic()
        self._leave_core()
        self._write_loop_file()
        self._watch_loop()
        self._watch_service(now)
        status = self._status()
        if not self._up and _settled(status) and self._is_reachable():
            self._up = True
            self._manager.notify(READY=1)
            self._ready(status)
        self._report_faults(status)
        if self._manager.asks:
            self._report(status, now)

    def _is_reachable(self) -> bool:
        """Whether `cdpr estop` finds the loop, and this daemon's own service is at the socket."""
        if self._loop_file is None or self._service is None:
            return False
        return listener_pid(self._settings.socket) == self._service.process.pid

    def _watch_loop(self) -> None:
        if self._loop.end:
            if self._up and not self.reason and self._loop.process.returncode not in _ON_COMMAND:
                self.reason = f"the loop has died: {self._loop.end}"
                self._block.write_status(
                    {
                        **self._status(),
                        "state": DEAD,
                        "reason": self.reason,
                        "reason_limit": None,
                        "faults": [],
                    }
                )
                self._say(
                    f"{self.reason}; its drives stop without its heartbeat. The service keeps "
                    "running"
                )
            return
        stalled = self._up and self._silence_s("loop_alive_ns") > _LOOP_STALLED_S
        if stalled != self._stalled:
            self._stalled = stalled
            if self._status().get("lockstep"):  # its time stands still with it: no cycle is missed
                return
            self._say(
                f"the loop has run no cycle for {_LOOP_STALLED_S:g} s"
                if stalled
                else "the loop runs again"
            )

    def _write_loop_file(self) -> None:
        """Write the loop's file into the runtime folder for `cdpr estop`, once the loop obeys
        signals.

        A daemon whose loop cannot be named ends before it reports that it is ready.
        """
        counters, pid = self._block.counters, self._loop.process.pid
        if self._loop_file is not None or self._loop.end or counters["loop_pid"][0] != pid:
            return
        named = LoopFile(
            robot=self._settings.name,
            reference=self._settings.robot,
            uid=os.geteuid(),
            pid=pid,
            started=started(pid),
            block_fd=self._settings.block_fd,
            drives_stop_s=2.0 * described(self._block, "master_heartbeat_s"),
        )
        path = LoopFile.beside(self._settings.socket)
        try:
            named.write(path)
        except OSError as error:
            self.reason = f"{path}: cannot be written, for `cdpr estop`: {error.strerror}"
            self._failure = BAD_INPUT
            return
        self._loop_file = named

    def _leave_core(self) -> None:
        """Move this process off the loop's core, once the loop has one; a new service inherits
        this."""
        if self._left_core or self._loop.end:
            return
        loop_cores = os.sched_getaffinity(self._loop.process.pid)
        allowed = os.sched_getaffinity(0)
        if len(loop_cores) > 1 or not allowed - loop_cores:
            return
        self._left_core = True
        besides = (self._service, self._simulator)
        for pid in (os.getpid(), *(one.process.pid for one in besides if one is not None)):
            move_to(pid, allowed - loop_cores)

    def _watch_service(self, now: float) -> None:
        if self._service is not None:
            if not self._service.end:
                self._watch_service_turns(self._service)
                return
            # an occupied address may soon be free again; bad input stays bad
            hopeless = self._service.process.returncode == BAD_INPUT
            if not self._up and (hopeless or self._restarts >= len(_RESTART_S)):
                self._start_failed("service", self._service)
                return
            lived = now - self._service.started
            self._restarts = 1 if lived > _STEADY_S else self._restarts + 1
            pause = _RESTART_S[min(self._restarts, len(_RESTART_S)) - 1]
            self._say(f"the service {self._service.end}; it starts again in {pause:g} s")
            self._service.close()
            self._service, self._restart_at = None, now + pause
        elif now >= self._restart_at:
            self._block.counters["service_alive_ns"] = 0
            self._service = self._start_service()

    def _watch_service_turns(self, service: Child) -> None:
        silent_s, allowed_s = self._silence_s("service_alive_ns"), _SERVICE_STALLED_S
        if not self._block.counters["service_alive_ns"][0]:  # the service has not turned even once
            silent_s, allowed_s = service.idle_s(), _SERVICE_START_S
            loading_s = time.monotonic() - service.started
            if loading_s > _SERVICE_LOADING_S:
                silent_s, allowed_s = loading_s, _SERVICE_LOADING_S
        if silent_s > allowed_s:
            self._say(f"the service has not responded for {allowed_s:g} s and is killed")
            service.process.kill()
            service.process.wait()

    def _report_faults(self, status: dict[str, Any]) -> None:
        """Report why the motion ended, at the terminal or in the journal; each fault once."""
        if not self._up or not status or status.get("state") == DEAD:
            return
        is_fault = status.get("state") == "fault"
        fault = (status.get("since_ns"), _summary(status)) if is_fault else None
        if fault is not None and fault != self._fault:
            self._say(fault[1])
        self._fault = fault

    def _report(self, status: dict[str, Any], now: float) -> None:
        """Inform the service manager; feed its watchdog while the loop runs."""
        text = _summary(status)
        if text == self._reported:
            self._manager.retry()
        else:
            self._reported = text
            self._manager.notify(STATUS=text)
        due = self._manager.watchdog_s and now - self._fed > self._manager.watchdog_s / 4.0
        if due and not self._loop.end and not self._stalled and self._manager.feed():
            self._fed = now

    def _stop(self) -> int:
        """End the loop under control, then the service, so that the recording is complete."""
        self._manager.notify(STOPPING=1, STATUS="stopping")
        failure = self._stop_loop()
        self.reason = self.reason or failure
        if self._service is not None and not self._service.stop(_SERVICE_STOP_S):
            self._say("the service did not end and was killed")
        self._manager.retry()
        return self._failure if self.reason else DONE

    def _stop_loop(self) -> str:
        """End the loop; return why it did not end correctly, or an empty text."""
        timeout_s = loop_stop_s(self._block)
        if self._status().get("driving") and not self._loop.end:
            self._say(self._stop_notice(timeout_s))
        self._loop.process.terminate()
        began_s, at_once, hangs = time.monotonic(), False, self._stalled
        while not self._loop.end and time.monotonic() < began_s + timeout_s:
            self._wait()
            self._manager.retry()
            # a loop that turns again has the time to lower
            hangs = hangs and self._silence_s("loop_alive_ns") > _LOOP_STALLED_S
            if hangs and time.monotonic() > began_s + _LOOP_STALLED_S:
                timeout_s = _LOOP_STALLED_S
                break
            if not at_once and self._asked_twice():
                at_once, began_s, timeout_s = True, time.monotonic(), _AT_ONCE_S
                self._say("the power is removed now")
                self._loop.process.send_signal(POWER_OFF_SIGNAL)
        if not self._loop.end:
            self._loop.process.kill()
            self._loop.process.wait()
            return f"the loop did not stop within {timeout_s:g} s and was killed"
        code, reason = self._loop.process.returncode, str(self._status().get("reason", ""))
        if CUT_SHORT in reason or code == POWER_UNCONFIRMED:
            return reason
        # a loop that is stopped while loading has opened nothing yet
        loading = code == -signal.SIGTERM and not self._block.counters["loop_alive_ns"][0]
        return "" if code == DONE or loading else f"the loop {self._loop.end}"

    def _stop_notice(self, timeout_s: float) -> str:
        lowers = described(self._block, "lowering_s") > 0.0
        what = "the platform is lowered, unless brakes hold it" if lowers else "the axes brake"
        return (
            f"stopping: {what}, then the power goes off; this may take up to {timeout_s:.0f} s. "
            "Press Ctrl-C again to remove the power immediately"
        )

    def _asked_twice(self) -> bool:
        """Whether the end was requested twice; SIGHUP of a closing terminal does not count."""
        times = [at_s for number, at_s in self._signals if number != signal.SIGHUP]
        return bool(times) and times[-1] - times[0] > _SAME_PRESS_S

    def _silence_s(self, counter: str) -> float:
        alive = int(self._block.counters[counter][0])
        return (time.monotonic_ns() - alive) / 1e9 if alive else 0.0

    def _status(self) -> dict[str, Any]:
        try:
            return self._block.status()
        except SharedBlockError:  # the loop died while writing it
            return {}


def _settled(status: dict[str, Any]) -> bool:
    """Whether the loop has completed its automatic start, or reports why it could not."""
    return status.get("state") in ("ready", "active") or bool(status.get("reason"))


def _summary(status: dict[str, Any]) -> str:
    state, reason = status.get("state", "starting"), status.get("reason", "")
    return f"{state}: {reason}" if reason else str(state)


@contextmanager
def _recorded_signals(noted: list[tuple[int, float]]) -> Iterator[int]:
    """Record requests to end, and yield a descriptor that is readable after each.

    Afterwards the process is ending: a further request must not change its exit status.
    """

    def note(number: int, _frame: FrameType | None) -> None:
        noted.append((number, time.monotonic()))

    reader, writer = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    asked = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
    for number in asked:
        signal.signal(number, note)
    wakeup = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    try:
        yield reader
    finally:
        signal.set_wakeup_fd(wakeup)
        for number in asked:
            signal.signal(number, signal.SIG_IGN)
        os.close(reader)
        os.close(writer)
