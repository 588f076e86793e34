"""Real-time settings of a process: scheduling, memory, core; and notices of denied settings."""

from __future__ import annotations

import ctypes
import gc
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_MCL_CURRENT_AND_FUTURE = 3
_PRIORITY = 50
_SWITCH_INTERVAL_S = 1e-4
_CORES_NEEDED = 2
_ISOLATED = Path("/sys/devices/system/cpu/isolated")
_CLAIM = "\0cdpr-rt/core/{}"
_claims: list[socket.socket] = []  # held until the process ends


def _lock_memory() -> str:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT_AND_FUTURE) == 0:
        return ""
    return f"memory is not locked: {os.strerror(ctypes.get_errno())} (raise the memlock limit)"


def _schedule_fifo(also: int = 0) -> str:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | also, os.sched_param(_PRIORITY))
    except OSError as error:
        return f"no real-time scheduling: {error.strerror} (grant rtprio to this user)"
    return ""


def freeze_memory() -> list[str]:
    """Lock memory, freeze the heap and turn the garbage collector off.

    Call it when the process has allocated all that it needs. Returns notices of denied settings,
    with the remedy.
    """
    notice = _lock_memory()
    gc.collect()
    gc.freeze()
    gc.disable()
    return [notice] if notice else []


def enable_realtime() -> list[str]:
    """Give the calling thread SCHED_FIFO and a core until the process ends.

    The core is an isolated one if possible. The interpreter's switch interval is shortened. Threads
    started later have normal priority on the same core. Returns notices of denied settings, with
    the remedy.
    """
    notices = [_schedule_fifo(os.SCHED_RESET_ON_FORK)]
    if not notices[0]:  # without SCHED_FIFO it is better to move to another core than to wait
        notices.append(_take_core())
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    return [notice for notice in notices if notice]


def _take_core() -> str:
    """Claim a core that no other loop on this machine uses, an isolated one if possible.

    A process may not run on isolated cores until it requests them.
    """
    usable = os.sched_getaffinity(0)
    isolated = _isolated_cores()
    if len(usable | isolated) < _CORES_NEEDED:
        return f"only {len(usable)} usable core: the loop shares it with everything else"
    ordinary = sorted(usable - isolated)[1:]  # the first core is left for the rest of the machine
    for core in (*sorted(isolated, reverse=True), *reversed(ordinary)):
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            claim.bind(_CLAIM.format(core))
            os.sched_setaffinity(0, {core})
        except OSError:  # the core is claimed, or not in this control group
            claim.close()
            continue
        _claims.append(claim)
        if core in isolated:
            return ""
        return "no core is isolated (isolcpus=): other processes may run on the loop's core"
    return "every core already has a loop: this one has no separate core"


def _isolated_cores() -> set[int]:
    try:
        text = _ISOLATED.read_text().strip()
    except OSError:
        return set()
    cores: set[int] = set()
    for part in filter(None, text.split(",")):
        first, _, last = part.partition("-")
        cores |= set(range(int(first), int(last or first) + 1))
    return cores


@contextmanager
def paced_realtime() -> Iterator[list[str]]:
    """Run the block under SCHED_FIFO with memory locked and the garbage collector frozen.

    Yields notices of denied settings, with the remedy.
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

    In lockstep the controller and the simulator take turns, and a wake-up across cores costs more
    than the work of a cycle. They run as batch processes, which do not interrupt each other, so the
    controller reads the answers of several drives in one turn. A core serves one such block on this
    machine at a time; if all cores are taken, the processes stay where they are.
    """
    before = os.sched_getaffinity(0)
    policy = os.sched_getscheduler(0), os.sched_getparam(0)
    with _free_core(before) as core:
        for pid in (0, *others):
            if core is not None:
                os.sched_setaffinity(pid, {core})
            os.sched_setscheduler(pid, os.SCHED_BATCH, os.sched_param(0))
        try:
            yield
        finally:
            os.sched_setaffinity(0, before)
            os.sched_setscheduler(0, *policy)


@contextmanager
def _free_core(usable: set[int]) -> Iterator[int | None]:
    """Claim a free core and yield it, or None; the kernel releases the claim."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        for core in sorted(usable, reverse=True):
            try:
                claim.bind(_CLAIM.format(core))
            except OSError:
                continue
            yield core
            return
        yield None
