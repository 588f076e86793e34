"""How long a stop takes to be accepted, while other clients flood every interface and without."""

from __future__ import annotations

import json
import os
import secrets
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final

from cdpr_profiles import load_robot
from cdpr_tools.bench.daemon.loop_daemon import with_tolerant_limits
from cdpr_tools.bench.timing import percentiles, verdict
from cdpr_tools.client.client import Daemon, open_daemon
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.processes.module_process import module_command

ROBOT = "bench-2"
FLOODS: Final = {"alone": (0, 0), "flooded": (4, 0), "flooded_lowest": (4, 19)}
"""Clients that flood, and their nice value."""
TRANSPORTS: Final = ("unix", "http")
BOUND_MS: Final = 50.0
_STOPS: Final = ("/disable", "/hold")
_PERCENTILES = (50.0, 99.0, 100.0)
_FLOOD = "cdpr_tools.bench.daemon.flood"
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
                took_ms[case] = {transport: [] for transport in TRANSPORTS}
                with _flooded(bench, clients, nice, sent):
                    for k in range(stops):
                        for transport in TRANSPORTS:
                            ms = _stop(bench, transport, _STOPS[k % len(_STOPS)])
                            took_ms[case][transport].append(ms)
                        time.sleep(_PAUSE_S)
                        advance(float(stops * number + k + 1))
        figures = {
            case: {by: percentiles(ms, *_PERCENTILES, digits=2) for by, ms in of.items()}
            for case, of in took_ms.items()
        }
    worst = max(figures["flooded"][transport]["p99"] for transport in TRANSPORTS)
    return {
        "stops": stops,
        "processors": len(os.sched_getaffinity(0)),
        "clients": FLOODS["flooded"][0],
        "ms": figures,
        "sent": dict(sent),
        "bound_ms": BOUND_MS,
        "reached": worst <= BOUND_MS,
    }


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as a table, a line for each case and transport."""
    lines = [
        f"{figures['stops']} stops for each line, from the call to the loop's answer, in ms; "
        f"{figures['processors']} processors",
        f"{'':58}{'p50':>9}{'p99':>9}{'worst':>9}",
    ]
    for case, text in (
        ("alone", "nobody else asks"),
        ("flooded", f"{figures['clients']} clients flood every interface"),
        ("flooded_lowest", "the same at lowest priority (nice 19)"),
    ):
        for transport, by in (("unix", "Unix socket"), ("http", "HTTP with the key")):
            ms = figures["ms"][case][transport]
            lines.append(f"{f'{text}, {by}':58}{ms['p50']:9.1f}{ms['p99']:9.1f}{ms['max']:9.1f}")
    sent = ", ".join(f"{many} {kind}" for kind, many in figures["sent"].items())
    return [
        *lines,
        f"the flood: {sent.replace('_', ' ')}",
        f"wanted below {figures['bound_ms']:g} ms at the 99th percentile: "
        f"{verdict(figures['reached'])}",
    ]


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
    def client(self, transport: str) -> Iterator[Daemon]:
        """Connect as the commands do."""
        if transport == "unix":
            with open_daemon(None, self.socket, None, None) as daemon:
                yield daemon
        else:
            with open_daemon(None, None, f"http://{self.http}", self.key_file) as daemon:
                yield daemon


def _stop(bench: _Bench, transport: str, path: str) -> float:
    """Ask for a stop; return how long the loop's answer took, ms."""
    begin_s = time.perf_counter()
    with bench.client(transport) as daemon:
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
    robot = with_tolerant_limits(load_robot(ROBOT), folder)
    options = ["--socket", str(bench.socket), "--key-file", str(bench.key_file), "--no-record"]
    options += ["--http", "127.0.0.1:0", "--stream", "127.0.0.1:0", "--live", "0"]
    command = module_command("cdpr_tools.cli", "run", str(robot.path), "--bus", "simbus:")
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
        while (status := daemon.get("/status"))["state"] != "ready":
            if time.monotonic() > deadline_s:
                raise WorkFailedError(f"the robot does not get ready: {status['reason']}")
            if status["state"] == "inactive":
                daemon.post("/check")
            time.sleep(_PAUSE_S)
        bench.http = status["parts"]["service"]["http"]
        bench.stream = status["parts"]["stream"]["address"]


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
    command = module_command(_FLOOD, json.dumps(target))
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
            output, _ = flood.communicate(timeout=_END_S)
            sent.update(json.loads(output or "{}").get("sent", {}))
