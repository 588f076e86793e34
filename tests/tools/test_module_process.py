"""Processes that end when their standard input closes, and others."""

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

import pytest

from cdpr_tools.processes import end_by_stdin

ENDS = "import sys; sys.stdout.write('x' * (1 << 20)); sys.stdout.flush(); sys.stdin.read()"
"""More data than fits into a pipe."""
STAYS = "import time; print('up', flush=True); time.sleep(600)"
LEAVES_A_CHILD = (
    "import subprocess, sys; "
    "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']); "
    "print(child.pid, flush=True); sys.stdin.read()"
)


@contextmanager
def _running(code: str) -> Iterator[subprocess.Popen[bytes]]:
    pipe = subprocess.PIPE
    process = subprocess.Popen([sys.executable, "-c", code], stdin=pipe, stdout=pipe)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def _out(process: subprocess.Popen[bytes]) -> IO[bytes]:
    assert process.stdout is not None
    return process.stdout


def test_a_process_ends_however_much_it_writes() -> None:
    with _running(ENDS) as process:
        end_by_stdin(process, 60.0)
        assert process.returncode == 0


def test_a_process_that_does_not_end_is_killed() -> None:
    with _running(STAYS) as process:
        _out(process).readline()
        end_by_stdin(process, 0.3)
        assert process.returncode == -signal.SIGKILL


def test_stopping_does_not_wait_for_a_child_that_keeps_the_pipes() -> None:
    with _running(LEAVES_A_CHILD) as process:
        child = int(_out(process).readline())
        try:
            began_s = time.monotonic()
            end_by_stdin(process, 300.0)
            assert process.returncode == 0 and time.monotonic() - began_s < 60.0
        finally:
            subprocess.run(["kill", str(child)], check=True)


def test_an_interrupt_while_stopping_leaves_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    with _running(STAYS) as process:
        _out(process).readline()
        waited = process.communicate

        def communicate(timeout: float) -> tuple[str, str]:
            # once and here, because an earlier interrupt would end the test run
            monkeypatch.undo()
            press = signal.pthread_kill, (threading.get_ident(), signal.SIGINT)
            threading.Timer(0.2, *press).start()
            return waited(timeout=timeout)

        monkeypatch.setattr(process, "communicate", communicate)
        with pytest.raises(KeyboardInterrupt):
            end_by_stdin(process, 300.0)
        assert process.wait(60.0) == -signal.SIGKILL
