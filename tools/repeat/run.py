"""One run of a command in a folder of its own, and what holds it up.

Busy processes beside it, and processes of its own that are stopped."""

from __future__ import annotations

import math
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.processes.module_process import module_command

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
    """Stops one process at a time for 0.1 to 5 s (SIGSTOP), at moments left to `rng`."""

    rng: random.Random
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
            self._next_s = now_s + self.rng.expovariate(1.0 / _PAUSE_S)
            return
        low, high = map(math.log, _STOP_S)
        with suppress(ProcessLookupError):
            descriptor = os.pidfd_open(self.rng.choice(processes))
            self._held.append(descriptor)
            signal.pidfd_send_signal(descriptor, signal.SIGSTOP)
            duration_s = math.exp(self.rng.uniform(low, high))
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


FRAMES = "frames.log"
"""The log of all frames among the files of a run."""
_LOG_KEY = "CDPR_SIM_FRAME_LOG"
_LOOK_S, _LIST_S = 0.02, 0.3
_END_S = 20.0


@dataclass(frozen=True)
class Run:
    """What a run has left."""

    number: int
    """From 1."""
    folder: Path
    """The working folder that it had; its files are compared."""
    output: Path
    """What it wrote to standard output and standard error."""
    exit_status: int
    seconds: float
    processes: frozenset[int]
    """Their ids, which may stand in names."""
    stops: int
    held_s: float
    """For how long one of them was stopped."""


def run_once(
    command: Sequence[str],
    folder: Path,
    number: int,
    stops: Stops | None,
    busy: int,
    stop_requested: Callable[[], bool],
) -> Run:
    """Run `command` in a new folder in `folder`, with its simulators' frames logged.

    `command` are the words after `cdpr`, or a program named by its path. `stops` hold it up,
    beside so many `busy` processes. Raises BadInputError for what cannot be run, WorkFailedError
    where it is to end early; no process of the run is left in any case.
    """
    place = folder / f"run-{number}"
    work, output = place / "files", place / "output.txt"
    work.mkdir(parents=True)
    began_s, looked_s = time.monotonic(), 0.0
    seen: set[int] = set()
    processes: list[int] = []
    with ExitStack() as stack:
        out = stack.enter_context(output.open("wb"))
        stack.enter_context(busy_processes(busy))
        process = stack.enter_context(_running(command, work, out.fileno()))
        if stops is not None:
            stack.callback(stops.release)  # a stopped process ends by no signal but SIGKILL
        while process.poll() is None:
            if stop_requested():
                raise WorkFailedError(f"stopped on request, in run {number}")
            if time.monotonic() - looked_s > _LIST_S:
                looked_s, processes = time.monotonic(), processes_of(work)
                seen.update(processes)
            if stops is not None:
                stops.turn(processes)
            time.sleep(_LOOK_S)
    seconds = time.monotonic() - began_s
    number_of, held_s = (0, 0.0) if stops is None else (stops.number, stops.held_s)
    status = process.returncode
    return Run(number, work, output, status, seconds, frozenset(seen), number_of, held_s)


@contextmanager
def _running(command: Sequence[str], work: Path, out: int) -> Iterator[subprocess.Popen[bytes]]:
    """Run the command meanwhile; end it, and whatever it has left, in order if possible."""
    words = module_command("cdpr_tools.cli", *command)
    if "/" in command[0]:
        words = [str(Path(command[0]).absolute()), *command[1:]]
    path = f"{Path(sys.executable).parent}:{os.environ.get('PATH', os.defpath)}"
    environment = {**os.environ, "PATH": path, _LOG_KEY: str(work / FRAMES)}
    environment["XDG_STATE_HOME"] = str(work / "state")  # what one run learns, no other knows
    with os_error_as(BadInputError, f"{words[0]}: cannot be run"):
        process = subprocess.Popen(
            words,
            cwd=work,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # a Ctrl-C at the terminal is ours to pass on
        )
    try:
        yield process
    finally:
        _end(process, work)


def _end(process: subprocess.Popen[bytes], work: Path) -> None:
    """Wait for whatever the command has started, kill what does not end.

    Where the command itself has not ended, ask all of them to.
    """
    if process.poll() is None:
        process.terminate()
        for pid in processes_of(work):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGTERM)
    end_s = time.monotonic() + _END_S
    while (left := processes_of(work)) and time.monotonic() < end_s:
        process.poll()
        time.sleep(_LOOK_S)
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    process.wait()


def processes_of(work: Path) -> list[int]:
    """Return the ids of all processes of the run whose files are in `work`."""
    mark = f"{_LOG_KEY}={work / FRAMES}\0".encode()
    found = []
    for path in Path("/proc").iterdir():
        if path.name.isdecimal():
            with suppress(OSError):  # ended, or not ours
                if mark in (path / "environ").read_bytes():
                    found.append(int(path.name))
    return sorted(found)
