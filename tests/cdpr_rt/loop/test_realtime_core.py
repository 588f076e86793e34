"""The core that a loop reserves, in separate processes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from typing import IO

import pytest

CODE = """
import os, sys
from cdpr_rt.loop.realtime import enable_realtime
notices = enable_realtime()
print(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, sorted(os.sched_getaffinity(0)), notices)
sys.stdout.flush()
sys.stdin.read()
"""


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def _loop(stack: ExitStack) -> str:
    """Start a loop; return its output, while it goes on holding its core."""
    process = subprocess.Popen(
        [sys.executable, "-c", CODE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    stack.callback(process.communicate)
    out: IO[str] | None = process.stdout
    assert out is not None
    return out.readline()


def test_two_loops_do_not_share_a_core(stack: ExitStack) -> None:
    """Other tests hold cores too: a loop that finds no free core reports it and takes none."""
    told = [_loop(stack) for _ in range(2)]
    here = sorted(os.sched_getaffinity(0))
    cores = []
    for text in told:
        policy, _, rest = text.partition(" ")
        held = rest[: rest.index("]") + 1]
        if int(policy) != os.SCHED_FIFO:
            assert "no real-time scheduling" in text
            assert held == str(here)
        elif held == str(here):
            assert "no separate core" in text
        else:
            cores.append(held)
    assert len(set(cores)) == len(cores)
    assert all(core.count(",") == 0 for core in cores)
