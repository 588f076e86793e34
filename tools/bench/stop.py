"""How long a stop takes to be accepted, while other clients flood every interface and without."""

from __future__ import annotations

import json
import os
import secrets
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from profiles import load_robot
from tools.bench.loop_daemon import tolerant
from tools.daemon.client import Daemon, open_daemon
from tools.errors import WorkFailedError
from tools.output import Output

ROBOT = "bench-2"
FLOODS: Final = {"alone": (0, 0), "flooded": (4, 0), "flooded_lowest": (4, 19)}
"""Clients that flood, and their nice value."""
WAYS: Final = ("unix", "http")
BOUND_MS: Final = 50.0
_STOPS: Final = ("/disable", "/hold")
_PERCENTILES = (50.0, 99.0)
_FLOOD = "tools.bench.flood"
_START_S, _END_S, _LEAD_S = 120.0, 60.0, 2.0
_PAUSE_S = 0.01
_MOST_FLOOD_S = 600.0


def measure(stops: int, out: Output) -> dict[str, Any]:
    """Return figures of a daemon with a simulated robot of its own, which has no power.

    Each of `stops` is asked for by a connection of its own, over the Unix socket and over HTTP in
    turn, and counts until the loop's answer is here. Raises WorkFailedError.
    """
    took_ms: dict[str, dict[str, list[float]]] = {}
    sent: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(prefix="cdpr-bench-") as name, ExitStack() as stack:
        bench = stack.enter_context(_daemon(Path(name)))
        with out.progress("stops", float(stops * len(FLOODS))) as advance:
            for number, (case, (clients, nice)) in enumerate(FLOODS.items()):
                took_ms[case] = {way: [] for way in WAYS}
                with _flooded(bench, clients, nice, sent):
                    for k in range(stops):
                        for way in WAYS:
                            ms = _stop(bench, way, _STOPS[k % len(_STOPS)])
                            took_ms[case][way].append(ms)
                        time.sleep(_PAUSE_S)
                        advance(float(stops * number + k + 1))
        figures = {
            case: {way: _spread(ms) for way, ms in of.items()} for case, of in took_ms.items()
        }
    worst = max(figures["flooded"][way]["p99"] for way in WAYS)
    return {
        "stops": stops,
        "processors": len(os.sched_getaffinity(0)),
        "clients": FLOODS["flooded"][0],
        "ms": figures,
        "sent": dict(sent),
        "bound_ms": BOUND_MS,
        "reached": worst <= BOUND_MS,
    }


def _spread(ms: list[float]) -> dict[str, float]:
    found = {f"p{p:g}": float(np.percentile(ms, p)) for p in _PERCENTILES}
    return {key: round(value, 2) for key, value in {**found, "max": max(ms)}.items()}


class _Bench:
    """Where the daemon is."""

    def __init__(self, folder: Path) -> None:
        self.socket = folder / "control.sock"
        self.key_file = folder / "key"
        self.key = secrets.token_hex(16)
        self.key_file.touch(mode=0o600)
        self.key_file.write_text(self.key)
        self.http = self.stream = ""

    @contextmanager
    def client(self, way: str) -> Iterator[Daemon]:
        """Connect as the commands do."""
        if way == "unix":
            with open_daemon(None, self.socket, None, None) as daemon:
                yield daemon
        else:
            with open_daemon(None, None, f"http://{self.http}", self.key_file) as daemon:
                yield daemon


def _stop(bench: _Bench, way: str, path: str) -> float:
    """Ask for a stop; return how long the loop's answer took, ms."""
    begin_s = time.perf_counter()
    with bench.client(way) as daemon:
        try:
            daemon.post(path)
        except WorkFailedError as error:
            # the loop's own answer: without power there is nothing to hold
            if "not in state" not in str(error):
                raise
        return 1e3 * (time.perf_counter() - begin_s)


@contextmanager
def _daemon(folder: Path) -> Iterator[_Bench]:
    """Run `cdpr run` with all its interfaces, its drives booted and without power."""
    bench = _Bench(folder)
    robot = tolerant(load_robot(ROBOT), folder)
    options = ["--socket", str(bench.socket), "--key-file", str(bench.key_file), "--no-record"]
    options += ["--http", "127.0.0.1:0", "--stream", "127.0.0.1:0", "--live", "0"]
    command = [sys.executable, "-P", "-m", "tools.cli", "run", str(robot.path), "--bus", "simbus:"]
    with (folder / "errors").open("w+") as errors:
        process = subprocess.Popen([*command, *options], stdout=subprocess.PIPE, stderr=errors)
        try:
            assert process.stdout is not None  # opened with PIPE
            if not process.stdout.readline():
                errors.seek(0)
                raise WorkFailedError(f"the daemon did not start: {errors.read()[-300:].strip()}")
            _await_ready(bench)
            yield bench
        finally:
            process.terminate()
            process.communicate(timeout=_END_S)


def _await_ready(bench: _Bench) -> None:
    deadline_s = time.monotonic() + _START_S
    with bench.client("unix") as daemon:
        while (told := daemon.get("/status"))["state"] != "ready":
            if time.monotonic() > deadline_s:
                raise WorkFailedError(f"the robot does not get ready: {told['reason']}")
            if told["state"] == "inactive":
                daemon.post("/check")
            time.sleep(_PAUSE_S)
        bench.http = told["parts"]["service"]["http"]
        bench.stream = told["parts"]["stream"]["address"]


@contextmanager
def _flooded(bench: _Bench, clients: int, nice: int, sent: Counter[str]) -> Iterator[None]:
    """Have that many clients flood the daemon within the block; count in `sent` what they sent."""
    target = {
        "socket": str(bench.socket),
        "http": bench.http,
        "stream": bench.stream,
        "key": bench.key,
        "seconds": _MOST_FLOOD_S,
        "nice": nice,
    }
    command = [sys.executable, "-P", "-m", _FLOOD, json.dumps(target)]
    floods = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(clients)]
    try:
        if floods:
            time.sleep(_LEAD_S)
        yield
        if any(flood.poll() is not None for flood in floods):
            raise WorkFailedError("the flood ended too early")
    finally:
        for flood in floods:
            flood.terminate()
        for flood in floods:
            told, _ = flood.communicate(timeout=_END_S)
            sent.update(json.loads(told or "{}").get("sent", {}))
