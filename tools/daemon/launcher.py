"""The process above the daemon's two: starts them, restarts the service, ends both in order."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any, Final

from cdpr_rt.runtime.shared_block import SharedBlock, SharedBlockError
from tools.daemon.notify import ServiceManager
from tools.daemon.settings import RunSettings
from tools.errors import BAD_INPUT, DONE, FAILED
from tools.simulator import OwnSimulator

LOOP: Final = "tools.daemon.loop_process"
SERVICE: Final = "tools.daemon.service_process"
DEAD: Final = "dead"
"""The state that is told of a loop that has died; no state of a loop that lives."""

_TURN_S = 0.2
# a controlled stop from full speed, and brakes that follow, take less, besides a lowering
_LOOP_STOP_S = 30.0
# the recording is closed in this time
_SERVICE_STOP_S = 10.0
# the loop turns at every cycle, or some ten times a second where no cycles run
_LOOP_STALLED_S = 2.0
# the service turns some ten times a second; a disk may hold it up
_SERVICE_STALLED_S = 10.0
# reading its libraries from a slow disk, on a busy machine, takes less
_SERVICE_START_S = 30.0
# a service that dies at once is not started in a tight circle
_RESTART_S = (0.1, 0.5, 2.0, 5.0)
_STEADY_S = 30.0
# one thread for each library: the loop's process has one core to itself
_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}


class Child:
    """One of the daemon's processes; it inherits the shared memory and nothing else."""

    def __init__(self, module: str, settings: RunSettings, keep: Sequence[int] = ()) -> None:
        command = [sys.executable, "-m", module, settings.model_dump_json()]
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=sys.stderr.fileno(),  # standard output is the launcher's alone
            env={**os.environ, **_ONE_THREAD},
            pass_fds=(settings.block_fd, *keep),
            start_new_session=True,  # a Ctrl-C at the terminal is ours to handle, not its
        )
        self.started = time.monotonic()
        self.pidfd = os.pidfd_open(self.process.pid)

    @property
    def end(self) -> str:
        """How it ended, in words; empty while it lives."""
        code = self.process.poll()
        if code is None:
            return ""
        return f"killed by signal {-code}" if code < 0 else f"ended with exit status {code}"

    def stop(self, timeout_s: float) -> bool:
        """Ask it to end and wait; whether it did so by itself in time."""
        if self.process.poll() is None:
            self.process.terminate()
        try:
            self.process.wait(timeout_s)
            return True
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            return False
        finally:
            self.close()

    def close(self) -> None:
        """Let go of the descriptor; safe to repeat."""
        if self.pidfd >= 0:
            os.close(self.pidfd)
            self.pidfd = -1


class Launcher:
    """Runs the daemon until it is told to stop, or until its loop has stopped on command.

    `tell` gets a line for people now and then, `ready` the loop's status once both are up.
    """

    def __init__(
        self,
        settings: RunSettings,
        block: SharedBlock,
        tell: Callable[[str], None],
        ready: Callable[[dict[str, Any]], None],
        manager: ServiceManager,
        simulator: OwnSimulator | None = None,
    ) -> None:
        self._settings = settings
        self._block = block
        self._tell = tell
        self._ready = ready
        self._simulator = simulator
        self._manager = manager
        self._signals: list[int] = []
        self._restarts = 0
        self._restart_at = 0.0
        self._up = False
        self._stalled = False
        self._left_core = False
        self._told = ""
        self._fault: tuple[Any, str] | None = None
        self._fed = 0.0
        self._failure = FAILED
        self.reason = ""
        """Why the daemon ended other than on command."""

    def run(self) -> int:
        """Run both processes; return the exit status for the shell."""
        with _noted_signals(self._signals) as wakeup:
            # it stays as long as the loop does, whatever becomes of this process
            lifeline = () if self._simulator is None else (self._simulator.lifeline,)
            self._loop = Child(LOOP, self._settings, lifeline)
            self._service: Child | None = Child(SERVICE, self._settings)
            try:
                while not self._signals and not self._finished():
                    self._wait(wakeup)
                    self._turn()
                return self._stop()
            finally:
                # whatever went wrong here: power goes with the loop
                self._loop.stop(_LOOP_STOP_S)
                if self._service is not None:
                    self._service.stop(_SERVICE_STOP_S)

    def _wait(self, wakeup: int) -> None:
        poll = select.poll()
        poll.register(wakeup, select.POLLIN)
        for child in (self._loop, self._service):
            if child is not None and not child.end:
                poll.register(child.pidfd, select.POLLIN)
        for fd, _ in poll.poll(1000.0 * _TURN_S):
            if fd == wakeup:
                os.read(wakeup, 4096)

    def _finished(self) -> bool:
        """Whether the daemon ends: its loop did so on command, or one of the two cannot begin.

        A loop that died while it was up does not end it: the service stays and says so.
        """
        code = self._loop.process.poll()
        if code == DONE:
            return True
        if code is not None and not self._up:
            self._could_not_begin("loop", self._loop)
        return not self._up and bool(self.reason)

    def _could_not_begin(self, name: str, child: Child) -> None:
        self.reason = f"the {name} could not begin: {child.end}"
        if child.process.returncode == BAD_INPUT:
            self._failure = BAD_INPUT

    def _turn(self) -> None:
        now = time.monotonic()
        self._leave_core()
        self._watch_loop()
        self._watch_service(now)
        status = self._status()
        if not self._up and _settled(status) and self._settings.socket.exists():
            self._up = True
            self._manager.tell(READY=1)
            self._ready(status)
        self._tell_of_faults(status)
        if self._manager.asks:
            self._report(status, now)

    def _watch_loop(self) -> None:
        if self._loop.end:
            if self._up and not self.reason and self._loop.process.returncode != DONE:
                self.reason = f"the loop has died: {self._loop.end}"
                self._block.write_status(
                    {**self._status(), "state": DEAD, "reason": self.reason, "reason_limit": None}
                )
                self._tell(f"{self.reason}; the drives stop by themselves. The service stays")
            return
        stalled = self._up and self._silence_s("loop_alive_ns") > _LOOP_STALLED_S
        if stalled != self._stalled:
            self._stalled = stalled
            self._tell(
                f"the loop has not turned for {_LOOP_STALLED_S:g} s"
                if stalled
                else "the loop turns again"
            )

    def _leave_core(self) -> None:
        """Leave the loop's core to it, once it has taken one; a new service inherits that."""
        if self._left_core or self._loop.end:
            return
        taken = os.sched_getaffinity(self._loop.process.pid)
        here = os.sched_getaffinity(0)
        if len(taken) > 1 or not here - taken:
            return
        self._left_core = True
        besides = (self._service, self._simulator)
        for pid in (os.getpid(), *(one.process.pid for one in besides if one is not None)):
            _move_to(pid, here - taken)

    def _watch_service(self, now: float) -> None:
        if self._service is not None:
            if not self._service.end:
                self._watch_service_turns()
                return
            # an address that is taken may be free again in a moment, bad input stays bad
            hopeless = self._service.process.returncode == BAD_INPUT
            if not self._up and (hopeless or self._restarts >= len(_RESTART_S)):
                self._could_not_begin("service", self._service)
                return
            lived = now - self._service.started
            self._restarts = 1 if lived > _STEADY_S else self._restarts + 1
            pause = _RESTART_S[min(self._restarts, len(_RESTART_S)) - 1]
            self._tell(f"the service {self._service.end}; it starts again in {pause:g} s")
            self._service.close()
            self._service, self._restart_at = None, now + pause
        elif now >= self._restart_at:
            self._block.counters["service_alive_ns"] = 0
            self._service = Child(SERVICE, self._settings)

    def _watch_service_turns(self) -> None:
        service, allowed_s = self._service, _SERVICE_STALLED_S
        if service is None:
            return
        silent_s = self._silence_s("service_alive_ns")
        if not self._block.counters["service_alive_ns"][0]:  # it has not turned even once
            silent_s, allowed_s = time.monotonic() - service.started, _SERVICE_START_S
        if silent_s > allowed_s:
            self._tell(f"the service has not turned for {allowed_s:g} s and is killed")
            service.process.kill()
            service.process.wait()

    def _tell_of_faults(self, status: dict[str, Any]) -> None:
        """Say why the motion ended, at the terminal or in the journal; once each time."""
        if not self._up or not status or status.get("state") == DEAD:
            return
        is_fault = status.get("state") == "fault"
        fault = (status.get("since_ns"), _summary(status)) if is_fault else None
        if fault is not None and fault != self._fault:
            self._tell(fault[1])
        self._fault = fault

    def _report(self, status: dict[str, Any], now: float) -> None:
        """Keep the service manager informed; its watchdog is fed while the loop lives and turns."""
        text = _summary(status)
        if text != self._told:
            self._told = text
            self._manager.tell(STATUS=text)
        due = self._manager.watchdog_s and now - self._fed > self._manager.watchdog_s / 4.0
        if due and not self._loop.end and not self._stalled:
            self._fed = now
            self._manager.tell(WATCHDOG=1)

    def _stop(self) -> int:
        """End the loop under control, then the service, so that the recording is whole."""
        self._manager.tell(STOPPING=1, STATUS="stopping")
        failure = self._stop_loop()
        self.reason = self.reason or failure
        if self._service is not None and not self._service.stop(_SERVICE_STOP_S):
            self._tell("the service did not end by itself and was killed")
        return self._failure if self.reason else DONE

    def _stop_loop(self) -> str:
        """End the loop; return why it did not end well, empty when it did."""
        patience_s = _LOOP_STALLED_S if self._stalled else _LOOP_STOP_S + self._lowering_s()
        if not self._loop.stop(patience_s):
            return f"the loop did not stop within {patience_s:g} s and was killed"
        code = self._loop.process.returncode
        # one that is asked while it loads has opened nothing yet
        loading = code == -signal.SIGTERM and not self._block.counters["loop_alive_ns"][0]
        return "" if code == DONE or loading else f"the loop {self._loop.end}"

    def _lowering_s(self) -> float:
        try:
            return float(self._block.description().get("lowering_s", 0.0))
        except SharedBlockError:  # the loop died in the middle of it
            return 0.0

    def _silence_s(self, counter: str) -> float:
        alive = int(self._block.counters[counter][0])
        return (time.monotonic_ns() - alive) / 1e9 if alive else 0.0

    def _status(self) -> dict[str, Any]:
        try:
            return self._block.status()
        except SharedBlockError:  # the loop died in the middle of it
            return {}


def _settled(status: dict[str, Any]) -> bool:
    """Whether the loop has done what it does by itself at its start, or says why it could not."""
    return status.get("state") in ("ready", "active") or bool(status.get("reason"))


def _summary(status: dict[str, Any]) -> str:
    state, reason = status.get("state", "starting"), status.get("reason", "")
    return f"{state}: {reason}" if reason else str(state)


def _move_to(pid: int, cores: set[int]) -> None:
    """Keep all threads of a process on these cores, and those that they will start."""
    with suppress(OSError):  # it, or one of its threads, has ended meanwhile
        for task in Path(f"/proc/{pid}/task").iterdir():
            os.sched_setaffinity(int(task.name), cores)


@contextmanager
def _noted_signals(noted: list[int]) -> Iterator[int]:
    """Note what asks the daemon to end, and yield a descriptor that can be read after each."""

    def note(number: int, _frame: FrameType | None) -> None:
        noted.append(number)

    reader, writer = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    asked = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
    before = {number: signal.signal(number, note) for number in asked}
    wakeup = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    try:
        yield reader
    finally:
        signal.set_wakeup_fd(wakeup)
        for number, handler in before.items():
            signal.signal(number, handler)
        os.close(reader)
        os.close(writer)
