"""Signal handlers are restored after each test."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from cdpr_tools.signals import stop_on_signals

TOLD = "import signal; print(signal.getsignal(signal.SIGINT) is signal.default_int_handler)"


@pytest.mark.parametrize("time", ["first", "again"])
def test_a_process_receives_ctrl_c_after_a_test_that_ignored_it(time: str) -> None:
    heard = subprocess.run([sys.executable, "-c", TOLD], capture_output=True, check=True)
    assert heard.stdout == b"True\n", time
    with stop_on_signals() as stop_requested:
        os.kill(os.getpid(), signal.SIGINT)
    assert stop_requested()
    assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN  # the next process would inherit this
