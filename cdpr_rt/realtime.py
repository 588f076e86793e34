"""Make this process as punctual as the machine allows, and say what it did not allow."""

from __future__ import annotations

import ctypes
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager

_MCL_CURRENT_AND_FUTURE = 3
_PRIORITY = 50


def _lock_memory() -> str:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT_AND_FUTURE) == 0:
        return ""
    return f"memory is not locked: {os.strerror(ctypes.get_errno())} (raise the memlock limit)"


def _schedule_fifo() -> str:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except OSError as error:
        return f"scheduling stays ordinary: {error.strerror} (grant rtprio to this user)"
    return ""


@contextmanager
def paced_realtime() -> Iterator[list[str]]:
    """Run the block under SCHED_FIFO with memory locked and the garbage collector frozen.

    Yields what was not allowed, in words with the remedy; an empty list when all was.
    """
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    notices = [notice for notice in (_lock_memory(), _schedule_fifo()) if notice]
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield notices
    finally:
        gc.enable()
        gc.unfreeze()
        if os.sched_getscheduler(0) != before[0]:
            os.sched_setscheduler(0, before[0], before[1])
        ctypes.CDLL(None).munlockall()


@contextmanager
def one_core(*others: int) -> Iterator[None]:
    """Keep this process and those with the identifiers `others` on one core in the block.

    In lockstep the controller and the simulator take turns: a wake-up across cores costs more
    than the work of a cycle. They run as batch processes, which do not interrupt each other:
    the answers of several drives are taken in one turn, not in one each. Which core depends on
    the process, so that two commands at once seldom share one.
    """
    before = os.sched_getaffinity(0)
    policy = os.sched_getscheduler(0), os.sched_getparam(0)
    core = {sorted(before)[os.getpid() % len(before)]}
    for pid in (0, *others):
        os.sched_setaffinity(pid, core)
        os.sched_setscheduler(pid, os.SCHED_BATCH, os.sched_param(0))
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
        os.sched_setscheduler(0, *policy)
