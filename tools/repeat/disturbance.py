"""What holds a run up: busy processes beside it, and processes of its own that are stopped."""

from __future__ import annotations

import math
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

_STOP_S = (0.1, 5.0)
_PAUSE_S = 1.5
# ends with its standard input, so also when we are killed
_BUSY = """
import os, sys, threading
threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
while True:
    pass
"""


@contextmanager
def busy_processes(number: int) -> Iterator[None]:
    """Keep so many processes busy meanwhile."""
    command = [sys.executable, "-S", "-c", _BUSY]
    processes: list[subprocess.Popen[bytes]] = []
    try:
        for _ in range(number):
            processes.append(
                subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True)
            )
        yield
    finally:
        for process in processes:
            process.kill()
            process.communicate()


@dataclass
class Stops:
    """Stops one process at a time for 0.1 to 5 s (SIGSTOP), at moments left to `chance`."""

    chance: random.Random
    number: int = 0
    held_s: float = 0.0
    _next_s: float = 0.0
    _held: list[int] = field(default_factory=list)
    """Descriptor of the process that is stopped now."""

    def turn(self, processes: Sequence[int]) -> None:
        """Do what is due; `processes` are those that may be stopped."""
        now_s = time.monotonic()
        if now_s < self._next_s:
            return
        if self._held or not processes:
            self.release()
            self._next_s = now_s + self.chance.expovariate(1.0 / _PAUSE_S)
            return
        low, high = map(math.log, _STOP_S)
        with suppress(ProcessLookupError):
            descriptor = os.pidfd_open(self.chance.choice(processes))
            self._held.append(descriptor)
            signal.pidfd_send_signal(descriptor, signal.SIGSTOP)
            duration_s = math.exp(self.chance.uniform(low, high))
            self.number += 1
            self.held_s += duration_s
            self._next_s = now_s + duration_s

    def release(self) -> None:
        """Continue what is stopped (SIGCONT)."""
        while self._held:
            descriptor = self._held.pop()
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(descriptor, signal.SIGCONT)
            os.close(descriptor)
