"""A process of the daemon signals its launcher."""

from __future__ import annotations

import signal
import subprocess
import sys

from cdpr_tools.daemon.child import signal_launcher

SLEEPS = [sys.executable, "-c", "import time; time.sleep(600)"]
PARENT = """
import os, signal, subprocess, sys, time
tells = "import os, signal; from cdpr_tools.daemon.child import signal_launcher;"
tells += "signal_launcher(os.getppid(), signal.SIGTERM)"
subprocess.run([sys.executable, "-c", tells])
time.sleep(60)
"""


def test_only_the_running_launcher_is_signalled_and_no_process_with_its_pid() -> None:
    assert subprocess.run([sys.executable, "-c", PARENT], check=False).returncode == -signal.SIGTERM
    with subprocess.Popen(SLEEPS) as other:
        try:
            signal_launcher(other.pid, signal.SIGKILL)
            assert other.poll() is None
        finally:
            other.kill()
    signal_launcher(other.pid, signal.SIGCONT)  # no process has this pid, which is not an error
