"""Run a command several times with different delays, and compare the files that it writes.

Busy processes run in parallel, and the command's processes are stopped from time to time. Parts of
a file that depend on the wall clock are ignored.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import random
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final

from mcap.exceptions import McapError
from mcap.reader import make_reader

from cdpr_rt.service.recording_file import TIMING
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.processes import module_command

FRAMES = "frames.log"
"""Name of the log of all frames in a run's folder."""
_LOG_KEY = "CDPR_SIM_FRAME_LOG"
_LOOK_S, _LIST_S = 0.02, 0.3
_END_S = 20.0
_STOP_S = (0.1, 5.0)
_PAUSE_S = 1.5
# ends with its standard input, so also if this process is killed
_BUSY = """
import os, sys, threading
threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
while True:
    pass
"""
WALL_KEYS: Final = ("created", "date", "wall_s")
"""Keys of JSON and TOML files whose values are the time of day or a duration."""
NOT_COMPARED: Final = (".html", ".png", ".svg", ".pdf")
"""Suffixes of pages and pictures, which are drawn from the compared data."""

Piece = tuple[str, bytes]
"""Place in the file, and the content there."""
_BLOCK_BYTES: Final = 1 << 16
_SHOWN: Final = 60
_DATES: Final = re.compile(r"(?<!\d)\d{8}(?:T\d{6}Z|-\d{6})(?!\d)")


@contextmanager
def busy_processes(number: int) -> Iterator[None]:
    """Keep this number of processes busy during the block."""
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
    """Stops one process at a time for 0.1 to 5 s (SIGSTOP), at random times from `rng`."""

    rng: random.Random
    number: int = 0
    held_s: float = 0.0
    _next_s: float = 0.0
    _held: list[int] = field(default_factory=list)
    """Descriptor of the process that is stopped at present."""

    def turn(self, processes: Sequence[int]) -> None:
        """Stop and continue processes when due; `processes` are those that may be stopped."""
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
        """Continue the stopped process (SIGCONT)."""
        while self._held:
            descriptor = self._held.pop()
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(descriptor, signal.SIGCONT)
            os.close(descriptor)


@dataclass(frozen=True)
class Run:
    """Results of one run."""

    number: int
    """Number, from 1."""
    folder: Path
    """Working folder of the run, whose files are compared."""
    output: Path
    """Standard output and standard error of the run."""
    exit_status: int
    seconds: float
    processes: frozenset[int]
    """Process ids of the run, which may occur in names."""
    stops: int
    held_s: float
    """Total time for which a process of the run was stopped."""


def run_once(
    command: Sequence[str],
    folder: Path,
    number: int,
    stops: Stops | None,
    busy: int,
    stop_requested: Callable[[], bool],
) -> Run:
    """Run `command` in a new folder in `folder`, with its simulators' frames logged.

    `command` has the words after `cdpr`, or a program given by its path. Two things delay it:
    `stops` stops its processes for a while, and `busy` other processes use the processors. Raises
    BadInputError if it cannot be run, WorkFailedError if it ends early; no process of the run
    remains in any case.
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
            stack.callback(stops.release)  # a stopped process ends only by SIGKILL
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
    """Run the command during the block; then end it and its children, properly if possible."""
    words = module_command("cdpr_tools.cli", *command)
    if "/" in command[0]:
        words = [str(Path(command[0]).absolute()), *command[1:]]
    path = f"{Path(sys.executable).parent}:{os.environ.get('PATH', os.defpath)}"
    environment = {**os.environ, "PATH": path, _LOG_KEY: str(work / FRAMES)}
    environment["XDG_STATE_HOME"] = str(work / "state")  # no run may use the results of another
    with os_error_as(BadInputError, f"{words[0]}: cannot be run"):
        process = subprocess.Popen(
            words,
            cwd=work,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # a Ctrl-C at the terminal is forwarded from here
        )
    try:
        yield process
    finally:
        _end(process, work)


def _end(process: subprocess.Popen[bytes], work: Path) -> None:
    """Wait for all processes that the command started; kill those that do not end.

    If the command itself has not ended, first request the end of all.
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
            with suppress(OSError):  # ended, or another user's
                if mark in (path / "environ").read_bytes():
                    found.append(int(path.name))
    return sorted(found)


class UnreadableError(Exception):
    """A file does not match its suffix."""


def normalised(text: str, run: Run) -> str:
    """Return a name without the run's folder, the time of day and the run's process ids."""
    text = _DATES.sub("DATE", text.replace(str(run.folder), "."))
    return re.sub(r"(?<=-)\d+(?!\d)", lambda m: "PID" if int(m[0]) in run.processes else m[0], text)


def pieces(path: Path, run: Run) -> Iterator[Piece]:
    """Yield the compared parts of a file; raises UnreadableError."""
    try:
        if path.suffix == ".mcap":
            yield from _messages(path)
        elif path.suffix == ".json":
            yield from _leaves("", json.loads(path.read_bytes()), run)
        elif path.suffix == ".toml":
            yield from _leaves("", tomllib.loads(path.read_text(encoding="utf-8")), run)
        elif path.name.startswith(Path(FRAMES).stem) and path.suffix == Path(FRAMES).suffix:
            with path.open("rb") as file:
                yield from ((f"line {k}", line) for k, line in enumerate(file, 1))
        else:
            with path.open("rb") as file:
                while block := file.read(_BLOCK_BYTES):
                    yield f"byte {file.tell() - len(block)}", block
    except (OSError, ValueError, McapError) as error:
        raise UnreadableError(str(error) or type(error).__name__) from error


def _messages(path: Path) -> Iterator[Piece]:
    """Yield the messages of each topic in the order of the file."""
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        if summary is None:
            raise UnreadableError("the recording was not closed")
        topics = sorted({channel.topic for channel in summary.channels.values()} - {TIMING})
        for topic in topics:
            messages = reader.iter_messages(topics=[topic], log_time_order=False)
            for number, (_, _, message) in enumerate(messages, 1):
                yield f"{topic}, message {number}", message.data


def _leaves(where: str, value: Any, run: Run) -> Iterator[Piece]:
    if isinstance(value, dict):
        for key, one in value.items():
            if key not in WALL_KEYS:
                yield from _leaves(f"{where}.{key}" if where else key, one, run)
    elif isinstance(value, list):
        for number, one in enumerate(value):
            yield from _leaves(f"{where}[{number}]", one, run)
    else:
        yield where, (normalised(value, run) if isinstance(value, str) else repr(value)).encode()


def difference(one: Iterator[Piece], other: Iterator[Piece]) -> str:
    """Return the first difference as text, or ""."""
    for a, b in zip_longest(one, other):
        if a != b:
            return _described(a, b)
    return ""


def _described(a: Piece | None, b: Piece | None) -> str:
    if a is None or b is None:
        ends, there = ("first", b) if a is None else ("second", a)
        assert there is not None  # one of the two has more
        return f"{there[0]}: the {ends} file has already ended"
    if a[0] != b[0]:
        return f"{a[0]} in one file, {b[0]} in the other"
    if a[0].startswith("byte "):
        first = next(
            (k for k, (x, y) in enumerate(zip(a[1], b[1], strict=False)) if x != y),
            min(len(a[1]), len(b[1])),
        )
        return f"byte {int(a[0][5:]) + first}"
    if a[0].startswith("/") and (inner := _inner(a[1], b[1])):
        return f"{a[0]}: {inner}"
    return f"{a[0]}: {_shown(a[1])} | {_shown(b[1])}"


def _inner(a: bytes, b: bytes) -> str:
    """Return the first difference of two messages, by its name."""
    no_run = Run(0, Path("/nowhere"), Path("/nowhere"), 0, 0.0, frozenset(), 0, 0.0)
    try:
        return difference(*(_leaves("", json.loads(text), no_run) for text in (a, b)))
    except ValueError:
        return ""


def _shown(text: bytes) -> str:
    shown = text.decode(errors="replace").strip()
    return shown if len(shown) <= _SHOWN else shown[:_SHOWN] + " ..."


@dataclass(frozen=True)
class Verdict:
    """Result of the comparison of one file."""

    file: str
    """Name of the file in its run's folder, without the time of day and process ids."""
    same: bool | None
    """Whether the file is the same in all runs; None if it is not compared."""
    hashes: Sequence[str]
    """One hash for each run that has the file."""
    difference: str = ""
    """The first difference, as text."""

    def line(self) -> str:
        """Return the verdict as a line."""
        if self.same is None:
            return f"not compared              {self.file}"
        hashes = list(dict.fromkeys(self.hashes))
        if self.same:
            return f"same     {hashes[0]} {self.file}"
        return f"DIFFERS  {hashes[0]} {self.file}: {self.difference}"


def compare(runs: Sequence[Run]) -> list[Verdict]:
    """Return the verdict for each file that any run has written."""
    files = [_files(run) for run in runs]
    names = sorted({name for some in files for name in some})
    return [_verdict(name, runs, [some.get(name) for some in files]) for name in names]


def _files(run: Run) -> dict[str, Path]:
    """Return the files of a run by their normalised names."""
    found: dict[str, Path] = {}
    for path in sorted(one for one in run.folder.rglob("*") if one.is_file()):
        name = base = normalised(str(path.relative_to(run.folder)), run)
        number = 1
        while name in found:
            number += 1
            name = f"{base} ({number})"
        found[name] = path
    return found


def _verdict(name: str, runs: Sequence[Run], paths: Sequence[Path | None]) -> Verdict:
    if name.endswith(NOT_COMPARED):
        return Verdict(name, None, ())
    hashes: list[str] = []
    first: tuple[Path, Run] | None = None
    found = ""
    for run, path in zip(runs, paths, strict=True):
        if path is None:
            found = found or f"run {run.number} did not write it"
            continue
        try:
            hashes.append(_hash(path, run))
        except UnreadableError as error:
            hashes.append("unreadable  ")
            found = found or f"in run {run.number}: cannot be read: {error}"
            continue
        if first is None:
            first = path, run
        elif hashes[-1] != hashes[0] and not found:
            where = difference(pieces(*first), pieces(path, run))
            found = f"runs {first[1].number} and {run.number}: {where}"
    return Verdict(name, not found, hashes, found)


def _hash(path: Path, run: Run) -> str:
    sha = hashlib.sha256()
    for where, piece in pieces(path, run):
        sha.update(f"{where} {len(piece)} ".encode() + piece)
    return sha.hexdigest()[:16]
