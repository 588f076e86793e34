"""Emergency stop by a signal to the loop's process, and the end of a daemon without service."""

from __future__ import annotations

import os
import pwd
import select
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from cdpr_drivers.cia402 import POWER_OFF, state_of
from cdpr_profiles.errors import brief
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import SharedBlock, SharedBlockError
from cdpr_rt.core.states import LoopState
from cdpr_rt.service.rows import newest_row
from cdpr_tools.daemon.child import loop_stop_s
from cdpr_tools.daemon.loop_file import POWER_OFF_SIGNAL, LoopFile, find_loops, launcher_pid
from cdpr_tools.daemon.paths import LAUNCHER_SUFFIX, find_launcher_files
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as

_LOOK_S = 0.02
# a drive that does not confirm is asked repeatedly, finally by SDO
_CONFIRM_S: Final = 15.0
# the loop turns at every cycle, or about ten times a second without cycles
_STALLED_S: Final = 1.0
_KILLED_S: Final = 2.0
_UNHEARD_S: Final = 1.0
# the effect on a daemon that only listens, if its master is signalled at the same time
_LISTENS_S: Final = 2.0


@dataclass(frozen=True)
class EmergencyStopResult:
    """Result of the emergency stop of one robot."""

    robot: str
    confirmed: bool
    """Whether every drive has confirmed that its power is off."""
    text: str


class EmergencyStop:
    """Signals one robot's loop, when created, to cut the power; `outcome` waits for the drives."""

    def __init__(self, path: Path) -> None:
        """Signal the loop that the file at `path` names."""
        self._robot = path.stem
        self._pidfd = -1
        self._block: SharedBlock | None = None
        self._known: EmergencyStopResult | None = self._signal_loop(path)
        self._asked_ns = time.monotonic_ns()

    def _signal_loop(self, path: Path) -> EmergencyStopResult | None:
        """Send the signal; return the result if it is known without waiting, else None."""
        try:
            found = self._found = LoopFile.read(path)
            self._robot = found.robot
            pidfd = found.open()
        except WorkFailedError as error:
            return self._failed(str(error))
        if pidfd is None:
            return self._failed(f"its loop has ended; {_own_stop_notice(found)}")
        self._pidfd = pidfd
        try:  # a loop that only listens ignores it; whether it does is only in its memory
            signal.pidfd_send_signal(pidfd, POWER_OFF_SIGNAL)
        except PermissionError:
            whose = _user(found.uid)
            return self._failed(f"its loop is {whose}'s: `sudo -u {whose} cdpr estop` may stop it")
        except ProcessLookupError:
            return self._failed(f"its loop has ended; {_own_stop_notice(found)}")
        return None

    def close(self) -> None:
        """Close the descriptor of the process."""
        if self._pidfd >= 0:
            os.close(self._pidfd)
            self._pidfd = -1

    def outcome(self) -> EmergencyStopResult:
        """Wait until every drive has confirmed, or it is certain that some will not.

        A loop that hangs is killed: its drives stop when its heartbeat ends. A loop that only
        listens continues.
        """
        if self._known is not None:
            return self._known
        try:
            block = self._block = _attach(self._found)
        except (OSError, SharedBlockError) as error:
            ended = "its loop has ended; " + _own_stop_notice(self._found)
            unseen = f"the state of its drives is not known: {error}"
            return self._failed(ended if isinstance(error, FileNotFoundError) else unseen)
        while not (off := self._power_is_off()):
            if self._ended(_LOOK_S):
                return self._failed("its loop has ended; " + _own_stop_notice(self._found))
            alive_ns = int(block.counters["loop_alive_ns"][0])
            stalled = self._since_s(max(alive_ns, self._asked_ns)) > _STALLED_S
            if stalled and not self._listens():
                return self._kill()
            if failure := self._failure_reason():
                return self._failed(f"{failure} ({self._reported_state()})")
        return EmergencyStopResult(self._robot, True, off)

    def _failure_reason(self) -> str:
        """Return why the wait ends without a confirmation; empty until then."""
        since_s = self._since_s(self._asked_ns)
        if self._listens():
            waits = since_s <= _LISTENS_S
            return "" if waits else "this daemon only listens: stop the master that runs its drives"
        if since_s > _UNHEARD_S and self._cycling() is None:
            return "its drives do not answer, and this daemon gives them no power"
        if since_s > _CONFIRM_S:
            return f"not every drive has confirmed within {_CONFIRM_S:g} s that its power is off"
        return ""

    def _kill(self) -> EmergencyStopResult:
        signal.pidfd_send_signal(self._pidfd, signal.SIGKILL)
        killed = "was killed" if self._ended(_KILLED_S) else "does not end even when killed"
        return self._failed(
            f"its loop has run no cycle for {_STALLED_S:g} s and {killed}; "
            + _own_stop_notice(self._found)
        )

    def _failed(self, text: str) -> EmergencyStopResult:
        return EmergencyStopResult(self._robot, False, text)

    def _ended(self, within_s: float) -> bool:
        return bool(select.select([self._pidfd], [], [], within_s)[0])

    @staticmethod
    def _since_s(then_ns: int) -> float:
        return (time.monotonic_ns() - then_ns) * 1e-9

    def _cycling(self) -> Row | None:
        """Return the row of the newest cycle if that cycle began after the request to cut the
        power."""
        assert self._block is not None  # attached
        row = newest_row(self._block)
        return row if row is not None and int(row["stamp_ns"]) > self._asked_ns else None

    def _power_is_off(self) -> str:
        """Return a text once every drive has confirmed in a later cycle; empty until then."""
        row = self._cycling()
        if row is None:
            return ""
        off = all(state_of(int(word)) in POWER_OFF for word in row["statusword"])
        if row["state"] == LoopState.ACTIVE or not off or not row["alive"].all():
            return ""
        return f"power is off, every drive confirms it ({self._reported_state()})"

    def _listens(self) -> bool:
        """Whether the loop only listens and commands no drive."""
        assert self._block is not None  # attached
        try:
            return self._block.status().get("read_only") is True
        except SharedBlockError:  # the loop died while writing
            return False

    def _reported_state(self) -> str:
        assert self._block is not None  # attached
        try:
            status = self._block.status()
        except SharedBlockError as error:
            return str(error)
        state, reason = str(status.get("state")), status.get("reason")
        return brief(f"{state}: {reason}" if reason else state)


def status_in_memory(found: LoopFile) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the part of a loop's status about its drives, and its description.

    Raises OSError and SharedBlockError.
    """
    block = _attach(found)
    status, description = block.status(), block.description()
    row = newest_row(block)
    alive = () if row is None else row["alive"]
    names = [str(axis.get("name")) for axis in description.get("axes", ())]
    axes = [{"name": name, "alive": bool(one)} for name, one in zip(names, alive, strict=False)]
    if not status:
        raise SharedBlockError("the loop has not published its status yet")
    return {**status, "axes": axes}, description


def _attach(found: LoopFile) -> SharedBlock:
    # read only; do not block if the descriptor is not shared memory (a FIFO, a terminal)
    flags = os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
    block = SharedBlock.attach(os.open(f"/proc/{found.pid}/fd/{found.block_fd}", flags))
    if int(block.counters["loop_pid"][0]) != found.pid:
        raise SharedBlockError("the shared memory belongs to another loop")
    return block


def _own_stop_notice(found: LoopFile) -> str:
    return (
        f"its drives stop within {found.drives_stop_s:g} s without its heartbeat: check "
        "that they have stopped"
    )


def _user(uid: int) -> str:
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return f"#{uid}"


_LAUNCHER_S: Final = 10.0
"""Once the loop has ended, a working launcher ends within this time."""
_STARTING_S: Final = 60.0
"""A launcher ends the processes that it is starting within this time; no drive has power yet."""


def launcher_left(socket: Path) -> str:
    """Return as text that the launcher at `socket` still runs, and what to do; "" if it ended."""
    pid = launcher_pid(socket.with_suffix(LAUNCHER_SUFFIX))
    if pid is None:
        return ""
    return f"its launcher, process {pid}, does not respond: end it with `kill -9 {pid}`"


def end_leftover_processes(robot: str | None, socket: Path | None) -> list[str]:
    """End a daemon whose service does not answer; return lines that describe the actions.

    A loop without a service stops under control. A daemon that is starting ends as after Ctrl-C. If
    neither runs, do nothing and return no line. Raises BadInputError if several daemons run and the
    user named none. Raises WorkFailedError if the daemon belongs to another user or does not end.
    """
    paths = find_loops(robot) if socket is None else [LoopFile.beside(socket)]
    found = [(path, LoopFile.read(path)) for path in paths if _is_there(path)]
    running = [(path, one) for path, one in found if one.runs()]
    if len(running) > 1 and robot is None:
        names = ", ".join(one.robot for _, one in running)
        raise BadInputError(f"{len(running)} loops run: choose one by --robot ({names})")
    if running:
        return [_end(*running[0])]
    locks = find_launcher_files(robot) if socket is None else [socket.with_suffix(LAUNCHER_SUFFIX)]
    launchers = [(path, pid) for path in locks if (pid := launcher_pid(path)) is not None]
    if len(launchers) > 1 and robot is None:
        names = ", ".join(path.stem for path, _ in launchers)
        raise BadInputError(
            f"{len(launchers)} daemons are starting; choose one by --robot ({names})"
        )
    return [_end_start(path, pid) for path, pid in launchers[:1]]


def _is_there(path: Path) -> bool:
    with os_error_as(WorkFailedError, f"{path}: cannot be read"):
        return path.exists()


def end_starting(socket: Path) -> list[str]:
    """End a daemon that is starting, as Ctrl-C does; return the action, or no line if none runs."""
    path = socket.with_suffix(LAUNCHER_SUFFIX)
    pid = launcher_pid(path)
    return [] if pid is None else [_end_start(path, pid)]


def _end_start(path: Path, pid: int) -> str:
    """End a launcher whose loop does not run; the launcher ends the processes it has started."""
    done = f"{path.stem}: its daemon was starting; it has ended"
    try:
        pidfd = os.pidfd_open(pid)
    except ProcessLookupError:
        return done
    try:
        if launcher_pid(path) == pid:  # the pid may belong to another process by now
            signal.pidfd_send_signal(pidfd, signal.SIGTERM)
        if not select.select([pidfd], [], [], _STARTING_S)[0]:
            raise WorkFailedError(
                f"{path.stem}: its launcher, process {pid}, still runs {_STARTING_S:g} s after "
                f"SIGTERM: end it with `kill -9 {pid}`"
            )
    except PermissionError:
        raise WorkFailedError(f"{path.stem}: its launcher, process {pid}, is another user's") from (
            None
        )
    except ProcessLookupError:  # it has ended
        pass
    finally:
        os.close(pidfd)
    return done


def _end(path: Path, loop: LoopFile) -> str:
    pidfd = loop.open()
    if pidfd is None:
        return f"{loop.robot}: its loop has ended"
    try:
        signal.pidfd_send_signal(pidfd, signal.SIGTERM)
        end_s = loop_stop_s(_attach(loop))
        if not select.select([pidfd], [], [], end_s)[0]:
            raise WorkFailedError(f"{loop.robot}: its loop still runs {end_s:g} s after SIGTERM")
    except PermissionError:
        raise WorkFailedError(f"{loop.robot}: its loop is another user's") from None
    except (OSError, SharedBlockError):  # the loop has ended already
        pass
    finally:
        os.close(pidfd)
    done = f"{loop.robot}: its service did not answer; its loop was stopped under control"
    deadline_s = time.monotonic() + _LAUNCHER_S
    while left := launcher_left(path):
        if time.monotonic() > deadline_s:
            raise WorkFailedError(f"{done}; {left}")
        time.sleep(_LOOK_S)
    return done
