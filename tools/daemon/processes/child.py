"""The link of a daemon's processes to their launcher: they end when it ends."""

from __future__ import annotations

import ctypes
import os
import signal

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
