"""Emergency stop by a signal to the loop's process, and the end of a daemon without a service."""

from __future__ import annotations

import os
import pwd
import select
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cdpr_drivers.cia402 import POWER_OFF, state_of
from cdpr_profiles.errors import brief
from cdpr_rt.core.shared_block import SharedBlock, SharedBlockError
from cdpr_rt.core.states import LoopState
from cdpr_tools.daemon.loop_file import POWER_OFF_SIGNAL, LoopFile
from cdpr_tools.daemon.paths import find_loop_files
from cdpr_tools.errors import BadInputError, WorkFailedError

_LOOK_S = 0.02
# the drives are asked over and over, and once more by SDO, where one does not confirm
_CONFIRM_S: Final = 15.0
# the loop turns at every cycle, or some ten times a second where no cycles run
_STALLED_S: Final = 1.0
_KILLED_S: Final = 2.0
_UNHEARD_S: Final = 1.0
# a daemon that only listens sees the effect of a signal sent to the master at the same time
_LISTENS_S: Final = 2.0


@dataclass(frozen=True)
class EmergencyStopResult:
    """Result of the emergency stop of one robot."""

    robot: str
    confirmed: bool
    """Whether every drive has confirmed that its power is off."""
    text: str


class EmergencyStop:
    """Signals one robot's loop to remove the power when made; `outcome` waits for the drives."""

    def __init__(self, path: Path) -> None:
        """Tell the loop that the file at `path` names."""
        self._robot = path.stem
        self._pidfd = -1
        self._block: SharedBlock | None = None
        self._known: EmergencyStopResult | None = self._signal_loop(path)
        self._asked_ns = time.monotonic_ns()

    def _signal_loop(self, path: Path) -> EmergencyStopResult | None:
        """Send the signal; return what is known without waiting, None where there is to wait."""
        try:
            found = self._found = LoopFile.read(path)
            self._robot = found.robot
            pidfd = found.open()
        except WorkFailedError as error:
            return self._failed(str(error))
        if pidfd is None:
            return self._failed(f"its loop has ended; {_own_stop_notice(found)}")
        self._pidfd = pidfd
        try:  # to one that only listens as well: only its memory says so, and it lets it be
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
        """Wait until every drive has confirmed, or it is known that some will not.

        A loop that does not turn is killed: its drives stop by themselves without its heartbeat.
        One that only listens is left alone.
        """
        if self._known is not None:
            return self._known
        try:
            block = self._block = _attach(self._found)
        except (OSError, SharedBlockError) as error:
            ended = "its loop has ended; " + _own_stop_notice(self._found)
            unseen = f"what its drives say cannot be seen: {error}"
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
        """Return why waiting ends without a confirmation, empty until then."""
        since_s = self._since_s(self._asked_ns)
        if self._listens():
            waits = since_s <= _LISTENS_S
            return "" if waits else "this daemon only listens: stop the master that runs its drives"
        if since_s > _UNHEARD_S and not self._cycling():
            return "its drives are not heard, and are not given power"
        if since_s > _CONFIRM_S:
            return f"not every drive has confirmed within {_CONFIRM_S:g} s that its power is off"
        return ""

    def _kill(self) -> EmergencyStopResult:
        signal.pidfd_send_signal(self._pidfd, signal.SIGKILL)
        killed = "was killed" if self._ended(_KILLED_S) else "does not even end when it is killed"
        return self._failed(
            f"its loop has not turned for {_STALLED_S:g} s and {killed}; "
            + _own_stop_notice(self._found)
        )

    def _failed(self, text: str) -> EmergencyStopResult:
        return EmergencyStopResult(self._robot, False, text)

    def _ended(self, within_s: float) -> bool:
        return bool(select.select([self._pidfd], [], [], within_s)[0])

    @staticmethod
    def _since_s(then_ns: int) -> float:
        return (time.monotonic_ns() - then_ns) * 1e-9

    def _cycling(self) -> bool:
        """Whether a cycle has begun since the power was to be taken."""
        block = self._block
        assert block is not None  # attached
        rows = int(block.counters["rows"][0])
        return (
            rows > 0 and int(block.rows[(rows - 1) % block.capacity]["stamp_ns"]) > self._asked_ns
        )

    def _power_is_off(self) -> str:
        """Return that every drive confirms in a cycle begun since, as text; empty until then."""
        block = self._block
        assert block is not None  # attached
        if not self._cycling():
            return ""
        row = block.rows[(int(block.counters["rows"][0]) - 1) % block.capacity]
        off = all(state_of(int(word)) in POWER_OFF for word in row["statusword"])
        if row["state"] == LoopState.ACTIVE or not off or not row["alive"].all():
            return ""
        return f"power is off, every drive says so ({self._reported_state()})"

    def _listens(self) -> bool:
        """Whether the loop only listens, and commands no drive."""
        assert self._block is not None  # attached
        try:
            return self._block.status().get("read_only") is True
        except SharedBlockError:  # it died in the middle of writing
            return False

    def _reported_state(self) -> str:
        assert self._block is not None  # attached
        try:
            status = self._block.status()
        except SharedBlockError as error:
            return str(error)
        state, reason = str(status.get("state")), status.get("reason")
        return brief(f"{state}: {reason}" if reason else state)


def _attach(found: LoopFile) -> SharedBlock:
    # read only, and not waiting where the descriptor is no shared memory (a FIFO, a terminal)
    flags = os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
    return SharedBlock.attach(os.open(f"/proc/{found.pid}/fd/{found.block_fd}", flags))


def _own_stop_notice(found: LoopFile) -> str:
    return (
        "drives that had power from it stop by themselves, without its heartbeat, within "
        f"{found.drives_stop_s:g} s: check that they have"
    )


def _user(uid: int) -> str:
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return f"#{uid}"


_END_S: Final = 90.0
"""A platform is let down in less."""


def end_leftover_processes(robot: str | None, socket: Path | None) -> list[str]:
    """Have a loop that runs without a service stop under control; return what was done, as lines.

    Nothing is done, and no line returned, where none runs. Raises BadInputError where several do
    and none was named, WorkFailedError where it is another user's or does not end.
    """
    paths = find_loop_files(robot) if socket is None else [LoopFile.beside(socket)]
    found = [LoopFile.read(path) for path in paths if path.exists()]
    running = [one for one in found if one.runs()]
    if len(running) > 1 and robot is None:
        names = ", ".join(one.robot for one in running)
        raise BadInputError(f"{len(running)} loops run: choose one by --robot ({names})")
    return [_end(one) for one in running[:1]]


def _end(loop: LoopFile) -> str:
    pidfd = loop.open()
    if pidfd is None:
        return f"{loop.robot}: its loop has ended"
    try:
        signal.pidfd_send_signal(pidfd, signal.SIGTERM)
        if not select.select([pidfd], [], [], _END_S)[0]:
            raise WorkFailedError(f"{loop.robot}: its loop still runs {_END_S:g} s after SIGTERM")
    except PermissionError:
        raise WorkFailedError(f"{loop.robot}: its loop is another user's") from None
    finally:
        os.close(pidfd)
    return f"{loop.robot}: its service did not answer; its loop was stopped under control"
