"""Tests and their processes take signals whatever a test before them has done."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from cdpr_tools.signals import stop_on_signals

TOLD = "import signal; print(signal.getsignal(signal.SIGINT) is signal.default_int_handler)"


@pytest.mark.parametrize("time", ["first", "again"])
def test_what_is_started_after_a_command_that_was_interrupted_hears_ctrl_c(time: str) -> None:
    heard = subprocess.run([sys.executable, "-c", TOLD], capture_output=True, check=True)
    assert heard.stdout == b"True\n", time
    with stop_on_signals() as stop_requested:
        os.kill(os.getpid(), signal.SIGINT)
    assert stop_requested()
    assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN  # what the next process would inherit
