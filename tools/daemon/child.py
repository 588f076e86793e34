"""Start and end of the daemon's two processes, which end together with their launcher."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from cdpr_rt.core.shared_block import SharedBlock, SharedBlockError
from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.processes import module_command

POWER_UNCONFIRMED: Final = 3
"""Exit status of a loop that ended on command although a drive may still have power."""

_PR_SET_PDEATHSIG = 1


def end_with_launcher(launcher_pid: int) -> None:
    """Have the kernel send this process SIGTERM when its launcher ends, for whatever reason.

    Call it once the process handles SIGTERM; it also works if the launcher has already ended.
    It does nothing for a process that was started without a launcher (0).
    """
    if launcher_pid == 0:
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    if launcher_ended(launcher_pid):
        os.kill(os.getpid(), signal.SIGTERM)


def launcher_ended(launcher_pid: int) -> bool:
    """Whether the launcher that started this process has ended."""
    return launcher_pid not in (0, os.getppid())


def signal_launcher(launcher_pid: int, number: signal.Signals) -> None:
    """Signal the launcher of this process, or this process if it has no launcher (0).

    It does nothing once the launcher has ended: another process may then have its number.
    """
    if not launcher_ended(launcher_pid):
        with suppress(OSError):
            os.kill(launcher_pid or os.getpid(), number)


def is_running(pid: int) -> bool:
    """Whether the process exists, even as a zombie."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


_STOP_S: Final = 30.0
"""Longest time of a controlled stop from full speed, with brakes but without lowering."""


def loop_stop_s(block: SharedBlock) -> float:
    """Return the longest time of a controlled end of the loop, including lowering."""
    return _STOP_S + float(described(block, "lowering_s"))


def described(block: SharedBlock, key: str) -> float:
    """Return a number from the loop's description; 0 if there is no description yet."""
    try:
        return float(block.description().get(key, 0.0))
    except SharedBlockError:  # the loop died while writing it
        return 0.0


# one thread for each library: the loop's process has a single core
_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}


class Child:
    """One of the daemon's processes; it inherits the shared memory, the robot's lock and `keep`."""

    def __init__(self, module: str, settings: RunSettings, keep: Sequence[int] = ()) -> None:
        self.process = subprocess.Popen(
            module_command(module, settings.model_dump_json()),
            stdin=subprocess.DEVNULL,
            stdout=sys.stderr.fileno(),  # standard output is the launcher's alone
            env={**os.environ, **_ONE_THREAD},
            pass_fds=(*settings.shared_fds, *keep),
            start_new_session=True,  # a Ctrl-C at the terminal is handled here, not there
        )
        self.started = time.monotonic()
        self._used, self._used_at = 0, self.started
        try:
            self.pidfd = os.pidfd_open(self.process.pid)
        except OSError:  # nobody would know about the process
            self.process.kill()
            self.process.wait()
            raise

    @property
    def end(self) -> str:
        """How the process ended, as text; empty while it runs."""
        code = self.process.poll()
        if code is None:
            return ""
        return f"killed by signal {-code}" if code < 0 else f"ended with exit status {code}"

    def idle_s(self) -> float:
        """Return the time since the process was last seen to use a processor.

        On a slow or busy machine the process takes long, but it makes progress.
        """
        used, now = _processor_ticks(self.process.pid), time.monotonic()
        if used != self._used:
            self._used, self._used_at = used, now
        return now - self._used_at

    def stop(self, timeout_s: float) -> bool:
        """Terminate the process and wait; return False if it had to be killed."""
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
        """Close the descriptor; safe to repeat."""
        if self.pidfd >= 0:
            os.close(self.pidfd)
            self.pidfd = -1


def _processor_ticks(pid: int) -> int:
    """Return the processor time that a process has used, in kernel ticks."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])  # utime and stime, proc(5)


def move_to(pid: int, cores: set[int]) -> None:
    """Keep all present and future threads of a process on these cores."""
    with suppress(OSError):  # the process, or one of its threads, has ended
        for task in Path(f"/proc/{pid}/task").iterdir():
            os.sched_setaffinity(int(task.name), cores)
