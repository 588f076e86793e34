"""The process above the daemon's two: starts them, restarts the service, ends both in order."""

from __future__ import annotations

import os
import select
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Final

from cdpr_rt.core.shared_block import SharedBlock, SharedBlockError
from cdpr_rt.core.states import CUT_SHORT
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.daemon.loop_file import POWER_OFF_SIGNAL, LoopFile, started
from cdpr_tools.daemon.processes.child import POWER_UNCONFIRMED, Child, move_to
from cdpr_tools.daemon.processes.notify import ServiceManager
from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.errors import BAD_INPUT, DONE, FAILED

LOOP: Final = "cdpr_tools.daemon.processes.loop_process"
SERVICE: Final = "cdpr_tools.daemon.processes.service_process"
DEAD: Final = "dead"
"""The state that is reported of a loop that has died; no state of a loop that lives."""

_ON_COMMAND: Final = (DONE, POWER_UNCONFIRMED)
"""Exit statuses of a loop that has not died."""
_TURN_S = 0.2
# a controlled stop from full speed, and brakes that follow, take less, besides a lowering
_LOOP_STOP_S = 30.0
# a second Ctrl-C: the power is off and the drives have said so in less
_AT_ONCE_S = 10.0
# what relays a terminal's Ctrl-C besides, such as sudo, is no second one
_SAME_PRESS_S = 0.2
# the recording is closed in this time
_SERVICE_STOP_S = 10.0
# the loop turns at every cycle, or some ten times a second where no cycles run
_LOOP_STALLED_S = 2.0
# the service turns some ten times a second; a disk may hold it up
_SERVICE_STALLED_S = 10.0
# for so long it does not even go on reading its libraries, however slow the machine
_SERVICE_START_S = 30.0
# it has all of that behind it by now, and is busy with something else
_SERVICE_LOADING_S = 600.0
# a service that dies at once is not started in a tight circle
_RESTART_S = (0.1, 0.5, 2.0, 5.0)
_STEADY_S = 30.0


class Launcher:
    """Runs the daemon until it is told to stop, or until its loop has stopped on command.

    `say` gets a line for people now and then, `ready` the loop's status once both are up.
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
        """Why the daemon ended other than on command."""

    def run(self) -> int:
        """Run both processes; return the exit status for the shell."""
        with _recorded_signals(self._signals) as wakeup:
            # it stays as long as the loop does, whatever becomes of this process
            lifeline = () if self._simulator is None else (self._simulator.lifeline,)
            self._loop, self._wakeup = Child(LOOP, self._settings, lifeline), wakeup
            self._service: Child | None = self._start_service()
            try:
                while not self._signals and not self._finished():
                    self._wait()
                    self._turn()
                return self._stop()
            finally:
                # whatever went wrong here: power goes with the loop
                self._loop.stop(_LOOP_STOP_S)
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
        """Whether the daemon ends: its loop did so on command, or one of the two cannot begin.

        A loop that died while it was up does not end it: the service stays and says so.
        """
        code = self._loop.process.poll()
        if code in _ON_COMMAND:
            return True
        if code is not None and not self._up:
            self._start_failed("loop", self._loop)
        return not self._up and bool(self.reason)

    def _start_failed(self, name: str, child: Child) -> None:
        self.reason = f"the {name} could not begin: {child.end}"
        if child.process.returncode == BAD_INPUT:
            self._failure = BAD_INPUT

    def _turn(self) -> None:
        now = time.monotonic()
        self._leave_core()
        self._write_loop_file()
        self._watch_loop()
        self._watch_service(now)
        status = self._status()
        reachable = self._loop_file is not None and self._settings.socket.exists()
        if not self._up and _settled(status) and reachable:
            self._up = True
            self._manager.notify(READY=1)
            self._ready(status)
        self._report_faults(status)
        if self._manager.asks:
            self._report(status, now)

    def _watch_loop(self) -> None:
        if self._loop.end:
            if self._up and not self.reason and self._loop.process.returncode not in _ON_COMMAND:
                self.reason = f"the loop has died: {self._loop.end}"
                self._block.write_status(
                    {**self._status(), "state": DEAD, "reason": self.reason, "reason_limit": None}
                )
                self._say(f"{self.reason}; the drives stop by themselves. The service stays")
            return
        stalled = self._up and self._silence_s("loop_alive_ns") > _LOOP_STALLED_S
        if stalled != self._stalled:
            self._stalled = stalled
            if self._status().get("lockstep"):  # time stands still with it: nothing is missed
                return
            self._say(
                f"the loop has not turned for {_LOOP_STALLED_S:g} s"
                if stalled
                else "the loop turns again"
            )

    def _write_loop_file(self) -> None:
        """Say in the runtime folder which process `cdpr estop` goes to, once it would obey.

        A daemon whose loop cannot be named ends, before it has said that it is ready.
        """
        counters, pid = self._block.counters, self._loop.process.pid
        if self._loop_file is not None or self._loop.end or counters["loop_pid"][0] != pid:
            return
        named = LoopFile(
            robot=self._settings.name,
            uid=os.geteuid(),
            pid=pid,
            started=started(pid),
            block_fd=self._settings.block_fd,
            drives_stop_s=2.0 * self._described("master_heartbeat_s"),
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
        """Leave the loop's core to it, once it has taken one; a new service inherits that."""
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
            # an address that is taken may be free again in a moment, bad input stays bad
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
        if not self._block.counters["service_alive_ns"][0]:  # it has not turned even once
            silent_s, allowed_s = service.idle_s(), _SERVICE_START_S
            loading_s = time.monotonic() - service.started
            if loading_s > _SERVICE_LOADING_S:
                silent_s, allowed_s = loading_s, _SERVICE_LOADING_S
        if silent_s > allowed_s:
            self._say(f"the service has not turned for {allowed_s:g} s and is killed")
            service.process.kill()
            service.process.wait()

    def _report_faults(self, status: dict[str, Any]) -> None:
        """Say why the motion ended, at the terminal or in the journal; once each time."""
        if not self._up or not status or status.get("state") == DEAD:
            return
        is_fault = status.get("state") == "fault"
        fault = (status.get("since_ns"), _summary(status)) if is_fault else None
        if fault is not None and fault != self._fault:
            self._say(fault[1])
        self._fault = fault

    def _report(self, status: dict[str, Any], now: float) -> None:
        """Keep the service manager informed; its watchdog is fed while the loop lives and turns."""
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
        """End the loop under control, then the service, so that the recording is whole."""
        self._manager.notify(STOPPING=1, STATUS="stopping")
        failure = self._stop_loop()
        self.reason = self.reason or failure
        if self._service is not None and not self._service.stop(_SERVICE_STOP_S):
            self._say("the service did not end by itself and was killed")
        self._manager.retry()
        return self._failure if self.reason else DONE

    def _stop_loop(self) -> str:
        """End the loop; return why it did not end well, empty when it did."""
        timeout_s = self._described("lowering_s") + _LOOP_STOP_S
        if self._status().get("driving") and not self._loop.end:
            self._say(self._stop_notice(timeout_s))
        timeout_s = _LOOP_STALLED_S if self._stalled else timeout_s
        self._loop.process.terminate()
        began_s, at_once = time.monotonic(), False
        while not self._loop.end and time.monotonic() < began_s + timeout_s:
            self._wait()
            self._manager.retry()
            if not at_once and self._asked_twice():
                at_once, began_s, timeout_s = True, time.monotonic(), _AT_ONCE_S
                self._say("the power is taken at once")
                self._loop.process.send_signal(POWER_OFF_SIGNAL)
        if not self._loop.end:
            self._loop.process.kill()
            self._loop.process.wait()
            return f"the loop did not stop within {timeout_s:g} s and was killed"
        code, reason = self._loop.process.returncode, str(self._status().get("reason", ""))
        if CUT_SHORT in reason or code == POWER_UNCONFIRMED:
            return reason
        # one that is asked while it loads has opened nothing yet
        loading = code == -signal.SIGTERM and not self._block.counters["loop_alive_ns"][0]
        return "" if code == DONE or loading else f"the loop {self._loop.end}"

    def _stop_notice(self, timeout_s: float) -> str:
        lowers = self._described("lowering_s") > 0.0
        what = "the platform is let down, unless brakes hold it" if lowers else "the axes brake"
        return (
            f"stopping: {what}, then the power goes off; this may take up to {timeout_s:.0f} s. "
            "A second Ctrl-C takes the power at once"
        )

    def _asked_twice(self) -> bool:
        """Whether the end was asked for twice; SIGHUP of a closing terminal does not count."""
        times = [at_s for number, at_s in self._signals if number != signal.SIGHUP]
        return bool(times) and times[-1] - self._signals[0][1] > _SAME_PRESS_S

    def _described(self, key: str) -> float:
        try:
            return float(self._block.description().get(key, 0.0))
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


@contextmanager
def _recorded_signals(noted: list[tuple[int, float]]) -> Iterator[int]:
    """Note what asks the daemon to end, and yield a descriptor that can be read after each.

    Afterwards it ends already: who asks once more is not to take its exit status from it.
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
