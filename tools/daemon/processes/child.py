"""The daemon's two processes: as their launcher sees them, and how they end when it ends."""

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

from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.processes.module_process import module_command

POWER_UNCONFIRMED: Final = 3
"""Exit status of a loop that ended on command, after which a drive may still have power."""

_PR_SET_PDEATHSIG = 1


def end_with_launcher(launcher_pid: int) -> None:
    """Have the kernel send this process SIGTERM when its launcher ends, however it ends.

    Call it once the process handles SIGTERM; a launcher that has ended already counts as well.
    Nothing is done for a process that was started without one (0).
    """
    if launcher_pid == 0:
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    if launcher_ended(launcher_pid):
        os.kill(os.getpid(), signal.SIGTERM)


def launcher_ended(launcher_pid: int) -> bool:
    """Whether the launcher that this process was started by has ended."""
    return launcher_pid not in (0, os.getppid())


def is_running(pid: int) -> bool:
    """Whether there is such a process; one that has ended but was not waited for counts as well."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


# one thread for each library: the loop's process has one core to itself
_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}


class Child:
    """One of the daemon's processes; it inherits the shared memory and `keep`."""

    def __init__(self, module: str, settings: RunSettings, keep: Sequence[int] = ()) -> None:
        self.process = subprocess.Popen(
            module_command(module, settings.model_dump_json()),
            stdin=subprocess.DEVNULL,
            stdout=sys.stderr.fileno(),  # standard output is the launcher's alone
            env={**os.environ, **_ONE_THREAD},
            pass_fds=(settings.block_fd, *keep),
            start_new_session=True,  # a Ctrl-C at the terminal is ours to handle, not its
        )
        self.started = time.monotonic()
        self._used, self._used_at = 0, self.started
        self.pidfd = os.pidfd_open(self.process.pid)

    @property
    def end(self) -> str:
        """How it ended, as text; empty while it runs."""
        code = self.process.poll()
        if code is None:
            return ""
        return f"killed by signal {-code}" if code < 0 else f"ended with exit status {code}"

    def idle_s(self) -> float:
        """Return for how long it has not been seen to have used a processor.

        On a machine that is slow or busy a process takes long for what it does, and yet does it.
        """
        used, now = _processor_ticks(self.process.pid), time.monotonic()
        if used != self._used:
            self._used, self._used_at = used, now
        return now - self._used_at

    def stop(self, timeout_s: float) -> bool:
        """Terminate it and wait; return whether it ended before it had to be killed."""
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
    """Return the time of a processor that a process has used, in ticks of the kernel."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])  # utime and stime, proc(5)


def move_to(pid: int, cores: set[int]) -> None:
    """Keep all threads of a process on these cores, and those that they will start."""
    with suppress(OSError):  # it, or one of its threads, has ended meanwhile
        for task in Path(f"/proc/{pid}/task").iterdir():
            os.sched_setaffinity(int(task.name), cores)
