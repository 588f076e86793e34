"""Run the seeds of a campaign: each in a fork of a robot that has already come to its start."""

from __future__ import annotations

import faulthandler
import gc
import json
import os
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from cdpr_rt.robot import Error
from cdpr_tools.campaign.judge import Result, judge, predicted
from cdpr_tools.campaign.play import STARTS, Played, Player, RobotAtStart, output_to
from cdpr_tools.campaign.scenario import Scenario
from cdpr_tools.daemon.child import end_with_launcher
from cdpr_tools.processes import module_command

_SEED_CPU_S: Final = 90
"""Processor time after which a seed counts as hung."""
_SEED_S: Final = 900.0
"""The same by the wall clock, for a seed that waits."""
DID_NOT_START: Final = "did not start"
_OUTPUT: Final = "output.txt"
_AT_MOST: Final = 4000
_INTERRUPTED: Final = 130
_ENDS: Final = (signal.SIGTERM, signal.SIGINT)


@dataclass(frozen=True)
class Seeds:
    """Scenarios of one robot with one plant; a job of a runner."""

    scenarios: tuple[Scenario, ...]

    def run(self) -> list[Result]:
        """Return the results, in the order of the scenarios."""
        return _server().run(self.scenarios)


# One process for each process that runs jobs: it has no threads, so it can be forked.


class _Server:
    def __init__(self) -> None:
        self._process = subprocess.Popen(
            module_command("cdpr_tools.campaign.farm"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )

    def run(self, scenarios: Sequence[Scenario]) -> list[Result]:
        process = self._process
        assert process.stdin is not None and process.stdout is not None  # opened with PIPE
        process.stdin.write(json.dumps([asdict(one) for one in scenarios]).encode() + b"\n")
        process.stdin.flush()
        line = process.stdout.readline()
        if not line:
            raise RuntimeError(f"the process of the seeds has ended: {process.wait()}")
        return [_result(one) for one in json.loads(line)]


_servers: list[_Server] = []


def _server() -> _Server:
    if not _servers:
        _servers.append(_Server())
    return _servers[0]


def _result(data: dict[str, Any]) -> Result:
    return Result(**data | {"faults": [tuple(pair) for pair in data["faults"]]})


def _serve() -> None:
    """Run the jobs that arrive on standard input, one a line, until it ends."""
    _end_with(os.getppid())
    out = os.dup(1)
    os.dup2(2, 1)  # nothing but results may go to the caller
    for line in sys.stdin:
        found = run_scenarios([Scenario(**one) for one in json.loads(line)])
        os.write(out, json.dumps([asdict(one) for one in found]).encode() + b"\n")


_forks: list[int] = []
"""Forks of this process that still run."""
_folders: list[Path] = []
"""Temporary folders of this process."""


def _end(*_: object) -> None:
    """End this process after its forks, and remove its files.

    Nothing is raised: a destructor that runs just now would swallow the exception.
    """
    for number in _ENDS:
        signal.signal(number, signal.SIG_IGN)
    for pid in _forks:
        with suppress(OSError):  # it has ended just now
            os.kill(pid, signal.SIGTERM)
            os.waitpid(pid, 0)
    for folder in _folders:
        shutil.rmtree(folder, ignore_errors=True)
    os._exit(_INTERRUPTED)


def _end_with(parent: int) -> None:
    """End when interrupted, and when the parent ends."""
    for number in _ENDS:
        signal.signal(number, _end)
    end_with_launcher(parent)


# Forks.


def run_scenarios(scenarios: Sequence[Scenario]) -> list[Result]:
    """Run scenarios of one robot with one plant, from snapshots; return results in their order."""
    found: dict[int, Result] = {}
    predicted(scenarios[0].robot)  # once for all forks
    lines = _in_fork(lambda out: _from_snapshots(scenarios, out), _SEED_S * (1 + len(scenarios)))
    start_s = 0.0
    for data in lines:
        number = data.pop("number")
        if number is None:
            start_s = data["cpu_s"] / len(scenarios)
        else:
            found[number] = _result(data)
    for result in found.values():
        result.cpu_s = round(result.cpu_s + start_s, 3)
    return [
        found.get(i) or Result(one.seed, one.robot, [f"crash: no result: {lines.end}"])
        for i, one in enumerate(scenarios)
    ]


def _from_snapshots(scenarios: Sequence[Scenario], out: int) -> None:
    """Bring a robot from start to start, and fork it for each scenario that begins there."""
    folder = Path(tempfile.mkdtemp(prefix="cdpr-campaign-"))
    _folders.append(folder)
    tempfile.tempdir = str(folder)
    try:
        start = RobotAtStart(scenarios[0], folder)
        why = ""
        with output_to(folder / _OUTPUT), start.rig:
            for where in STARTS:
                if not why and any(STARTS.index(s.start) >= STARTS.index(where) for s in scenarios):
                    try:
                        start.advance(where)
                    except Error as error:
                        why = str(error)
                start.rig.simulator.before_fork()
                gc.collect()
                gc.freeze()
                for number, scenario in enumerate(scenarios):
                    if scenario.start != where:
                        continue
                    result = Result(
                        scenario.seed, scenario.robot, notes=[f"{DID_NOT_START}: {why}"]
                    )
                    if not why:
                        result = _fork_seed(scenario, start, folder)
                    _write(out, asdict(result) | {"number": number})
        _write(out, {"number": None, "cpu_s": time.process_time()})
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _fork_seed(scenario: Scenario, start: RobotAtStart, folder: Path) -> Result:
    own = folder / "seed"
    own.mkdir()

    def play(out: int) -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (_SEED_CPU_S, _SEED_CPU_S + 5))
        with output_to(own / _OUTPUT):
            faulthandler.register(signal.SIGXCPU, file=2, chain=True)
            start.rig.simulator.after_fork(own)
            start.rig.folder = own
            result = _judged(Player(scenario, start).play(), start, own)
        result.cpu_s = round(time.process_time(), 3)  # a fork begins at 0
        _write(out, asdict(result))

    lines = _in_fork(play, _SEED_S)
    found = [_result(data) for data in lines]
    if not found:
        said = (own / _OUTPUT).read_text(errors="replace")[-_AT_MOST:]
        found = [Result(scenario.seed, scenario.robot, [f"crash: {lines.end}: {said}"])]
    shutil.rmtree(own, ignore_errors=True)
    return found[0]


def _judged(played: Played, start: RobotAtStart, folder: Path) -> Result:
    played.output = (folder / _OUTPUT).read_text(errors="replace")
    return judge(played, start.rig.robot)


def run_alone(scenario: Scenario, folder: Path, record: Path | None = None) -> Result:
    """Run a scenario on a robot that is started for it, in this process; record it in `record`."""
    start = RobotAtStart(scenario, folder, record)
    with start.rig:
        for where in STARTS[: STARTS.index(scenario.start) + 1]:
            start.advance(where)
        with output_to(folder / _OUTPUT):
            played = Player(scenario, start).play()
        return _judged(played, start, folder)


class _Lines:
    """Lines of JSON from a fork, until it ends; then `end` says how."""

    def __init__(self, pid: int, descriptor: int, within_s: float) -> None:
        self.end = "still runs"
        self._pid, self._descriptor, self._within_s = pid, descriptor, within_s

    def __iter__(self) -> Iterator[dict[str, Any]]:
        rest, ended = b"", False
        deadline_s = time.monotonic() + self._within_s
        while not ended and (left_s := deadline_s - time.monotonic()) > 0.0:
            if select.select([self._descriptor], [], [], left_s)[0]:
                data = os.read(self._descriptor, 1 << 16)
                ended = not data
                *lines, rest = (rest + data).split(b"\n")
                yield from map(json.loads, lines)
        if not ended:
            os.kill(self._pid, signal.SIGKILL)
        os.close(self._descriptor)
        status = os.waitstatus_to_exitcode(os.waitpid(self._pid, 0)[1])
        _forks.remove(self._pid)
        self.end = f"exit status {status}" if ended else f"hung for {self._within_s:g} s"


def _in_fork(work: Callable[[int], None], within_s: float) -> _Lines:
    """Run `work` in a fork; it writes its results to a descriptor."""
    inner, outer = os.pipe()
    parent = os.getpid()
    pid = os.fork()
    if not pid:
        os.close(inner)
        status = 1
        _forks.clear()
        _folders.clear()
        try:
            _end_with(parent)
            work(outer)
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(status)  # without the cleanup of the parent
    _forks.append(pid)
    os.close(outer)
    return _Lines(pid, inner, within_s)


def _write(out: int, data: dict[str, Any]) -> None:
    text = json.dumps(data).encode() + b"\n"
    while text:
        text = text[os.write(out, text) :]


if __name__ == "__main__":
    _serve()
