"""What is loaded for long is told on a terminal, and nowhere else."""

from __future__ import annotations

import os
import pty
import subprocess
import sys

import pytest

SCRIPT = """
import sys, time
from cdpr_tools.loading import loading_notice

with loading_notice():
    time.sleep(float(sys.argv[1]))
print("done", file=sys.stderr)
"""


def _told(seconds: float, **environment: str) -> str:
    """Return what the script writes to a terminal."""
    ours, its = pty.openpty()
    command = [sys.executable, "-c", SCRIPT, str(seconds)]
    with os.fdopen(ours, "rb", buffering=0) as terminal:
        try:
            env = os.environ | {"TERM": "xterm"} | environment
            subprocess.run(command, stderr=its, env=env, check=True)
        finally:
            os.close(its)
        return terminal.read(4096).decode()


def test_what_takes_a_moment_is_told_and_wiped_out() -> None:
    assert _told(1.0) == "loading ...\r\x1b[Kdone\r\n"
    assert _told(0.0) == "done\r\n"


@pytest.mark.parametrize("name", ["_CDPR_COMPLETE", "TERM"])
def test_a_line_that_is_another_s_and_a_dumb_terminal_are_left_alone(name: str) -> None:
    assert _told(0.5, **{name: "dumb"}) == "done\r\n"


def test_a_pipe_is_told_nothing() -> None:
    command = [sys.executable, "-c", SCRIPT, "0.5"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == "done\n"
