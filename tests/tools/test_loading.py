"""Slow loading is reported on terminals only."""

from __future__ import annotations

import gc
import os
import pty
import subprocess
import sys
from io import RawIOBase

import pytest

from cdpr_tools.loading import without_collection

SCRIPT = """
import sys, time
from cdpr_tools import loading

loading._SOON_S = float(sys.argv[1])
with loading.loading_notice():
    time.sleep(float(sys.argv[2]))
print("done", file=sys.stderr)
"""


def _told(soon_s: float, seconds: float, **environment: str) -> str:
    """Return the terminal output of the script if the notice is due after `soon_s`."""
    ours, its = pty.openpty()
    command = [sys.executable, "-c", SCRIPT, str(soon_s), str(seconds)]
    with os.fdopen(ours, "rb", buffering=0) as terminal:
        try:
            env = os.environ | {"TERM": "xterm"} | environment
            subprocess.run(command, stderr=its, env=env, check=True)
        finally:
            os.close(its)
        return _all_of(terminal).decode()


def _all_of(terminal: RawIOBase) -> bytes:
    """Return the output on a terminal until its writers close it."""
    told = b""
    while True:
        try:
            told += terminal.read(4096) or b""
        except OSError:  # EIO: end of output
            return told


def test_a_notice_of_slow_loading_is_shown_and_erased() -> None:
    assert _told(0.1, 1.0) == "loading ...\r\x1b[Kdone\r\n"
    assert _told(600.0, 0.0) == "done\r\n"


@pytest.mark.parametrize("name", ["_CDPR_COMPLETE", "TERM"])
def test_no_notice_is_written_during_completion_or_on_a_dumb_terminal(name: str) -> None:
    assert _told(0.0, 0.5, **{name: "dumb"}) == "done\r\n"


def test_no_notice_is_written_to_a_pipe() -> None:
    command = [sys.executable, "-c", SCRIPT, "0.0", "0.5"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == "done\n"


def test_no_garbage_is_collected_while_modules_load() -> None:
    with pytest.raises(ModuleNotFoundError), without_collection():
        assert not gc.isenabled()
        raise ModuleNotFoundError("a package")
    assert gc.isenabled()
