"""Measure how soon a stop is accepted, with and without clients that flood every interface."""

from __future__ import annotations

import json
import os
import secrets
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Final

from cdpr_profiles import load_robot
from cdpr_rt.loop.stop_socket import STOP_SUFFIX, send_stop
from cdpr_tools.bench import flood
from cdpr_tools.bench.harness import Figures, Row, Target, percentiles
from cdpr_tools.bench.loop import with_tolerant_limits
from cdpr_tools.bench.page import press_stops
from cdpr_tools.client.client import await_start, open_daemon
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.processes import module_command

_ROBOT = "bench-2"
_CLIENTS: Final = 4
SOCKET, HTTP = "the loop's socket", "HTTP with the key"
_STOPS: Final = ("disable", "hold")
_END_S, _LEAD_S, _PAUSE_S = 60.0, 2.0, 0.01

Ask = Callable[[str], object]
"""Requests a stop and returns once the loop has answered."""


def measure(stops: int, out: Output, *, from_page: bool = False) -> Figures:
    """Measure the time from a stop to the loop's answer, with and without a flood of requests.

    The daemon runs its own simulated robot, without power. Stops go over the loop's socket and
    over HTTP in turn, each on a new connection. `from_page` presses the page's stop button instead.
    Raises WorkFailedError.
    """
    if from_page:
        return press_stops(stops, out)
    rows: dict[str, Row] = {}
    sent: Counter[str] = Counter()
    cases = {"no other requests": 0, "flooded": _CLIENTS}
    with (
        tempfile.TemporaryDirectory(prefix="cdpr-bench-") as name,
        _daemon(Path(name)) as (target, asks),
        out.progress("stops", float(stops * len(cases))) as advance,
    ):
        for number, (case, clients) in enumerate(cases.items()):
            ms: dict[str, list[float]] = {transport: [] for transport in asks}
            with _flooded(target, clients, sent):
                for k in range(stops):
                    for transport, ask in asks.items():
                        begin_s = time.perf_counter()
                        ask(_STOPS[k % len(_STOPS)])
                        ms[transport].append(1e3 * (time.perf_counter() - begin_s))
                    time.sleep(_PAUSE_S)
                    advance(float(stops * number + k + 1))
            rows |= {
                f"{case}, {by}": percentiles(of, 50.0, 99.0, 100.0, digits=2)
                for by, of in ms.items()
            }
    kinds = ", ".join(f"{many} {kind}" for kind, many in sent.items()).replace("_", " ")
    p99_ms = rows[f"flooded, {SOCKET}"]["p99"]
    return Figures(
        f"{stops} stops each, from the call to the loop's answer, ms; {_CLIENTS} clients flood "
        f"every interface; {len(os.sched_getaffinity(0))} processors",
        rows,
        # HTTP has its usual rate limits and shares them with the flood
        {"socket": Target(f"flooded, {SOCKET}, p99, ms", p99_ms, 50.0)},
        notes=[f"the flood: {kinds}"],
        more={"stops": stops, "sent": dict(sent)},
    )


def _ask_over_http(url: str, key_file: Path, do: str) -> None:
    with open_daemon(None, None, url, key_file) as daemon:
        try:
            daemon.post(f"/{do}")
        except WorkFailedError as error:
            # the loop's own answer: without power there is nothing to hold
            if "not allowed in state" not in str(error):
                raise


def _ask_the_loop(path: Path, do: str) -> None:
    if send_stop(path, do, "bench", _END_S) is None:
        raise WorkFailedError(f"{path}: no loop reads stops there")


@contextmanager
def _daemon(folder: Path) -> Iterator[tuple[flood.Target, dict[str, Ask]]]:
    """Run `cdpr run` with all its interfaces, its drives booted and without power."""
    control, key_file, key = folder / "control.sock", folder / "key", secrets.token_hex(16)
    key_file.touch(mode=0o600)
    key_file.write_text(key)
    robot = with_tolerant_limits(load_robot(_ROBOT), folder)
    options = ["--socket", str(control), "--key-file", str(key_file), "--no-record"]
    options += ["--http", "127.0.0.1:0", "--stream", "127.0.0.1:0", "--live", "0"]
    command = module_command("cdpr_tools.cli", "run", str(robot.path), "--bus", "simbus:")
    with (folder / "errors").open("w+") as errors:
        process = subprocess.Popen([*command, *options], stdout=subprocess.PIPE, stderr=errors)
        try:
            assert process.stdout is not None  # opened with PIPE
            if not process.stdout.readline():
                errors.seek(0)
                raise WorkFailedError(f"the daemon did not start: {errors.read()[-300:].strip()}")
            with open_daemon(None, control, None, None) as daemon:
                await_start(daemon, Output(as_json=True))
                parts = daemon.get("/status")["parts"]
            http = parts["service"]["http"]
            yield (
                flood.Target(str(control), http, parts["stream"]["address"], key),
                {
                    SOCKET: partial(_ask_the_loop, control.with_suffix(STOP_SUFFIX)),
                    HTTP: partial(_ask_over_http, f"http://{http}", key_file),
                },
            )
        finally:
            process.terminate()
            process.communicate(timeout=_END_S)


@contextmanager
def _flooded(target: flood.Target, clients: int, sent: Counter[str]) -> Iterator[None]:
    """Let `clients` clients flood the daemon within the block; add their messages to `sent`."""
    command = module_command("cdpr_tools.bench.flood", json.dumps(asdict(target)))
    with ExitStack() as stack:
        processes = []
        for _ in range(clients):
            process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
            processes.append(process)
            stack.callback(_end, process, sent)
        if processes:
            time.sleep(_LEAD_S)
        yield
        if any(process.poll() is not None for process in processes):
            raise WorkFailedError("the flood ended too early")


def _end(process: subprocess.Popen[str], sent: Counter[str]) -> None:
    process.terminate()
    output, _ = process.communicate(timeout=_END_S)
    sent.update(json.loads(output or "{}").get("sent", {}))
