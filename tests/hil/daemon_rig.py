"""A real daemon for tests: `cdpr run` on its own simulated robot."""

from __future__ import annotations

import itertools
import json
import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
from waiting import until

from cdpr_tools.composition.simulator import OwnSimulator

# slow enough for a busy machine: the paced simulator must answer in time
_ROBOT = """
name = "Two motors, slowly"
sync_period_s = {period_s}
[limits]
torque_Nm = 1.5
following_error_rad = 1.0
[[buses]]
name = "can0"
[[axes]]
winch = "winch-mpp0923d"
name = "left"
bus = "can0"
node_id = 1
[[axes]]
winch = "winch-mpp0923d"
name = "right"
bus = "can0"
node_id = 2
"""
NAME, PERIOD_S = "slow-2", 0.01
PATIENCE_S = 60.0
_RIGHT_S = 10.0
_names = itertools.count()


def write_robot(folder: Path, period_s: float = PERIOD_S, limits: str = "") -> Path:
    """Write the robot's file into a folder, with more lines `limits` in that table. Return it."""
    path = folder / f"{NAME}.toml"
    path.write_text(_ROBOT.format(period_s=period_s).replace("[limits]", f"[limits]\n{limits}"))
    return path


def alive(pid: int) -> bool:
    """Return whether a process runs. A zombie does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


class RealDaemon:
    """`cdpr run` of a slow robot with two axes, or of `robot`. `ready` is its line of readiness.

    If `paced`, drives follow the wall clock. Otherwise their time waits for the loop.
    """

    def __init__(
        self,
        folder: Path,
        *options: str,
        env: dict[str, str] | None = None,
        bus: str = "simbus:",
        period_s: float = PERIOD_S,
        limits: str = "",
        robot: Path | None = None,
        cwd: Path | None = None,
        paced: bool = False,
        stderr: int | None = None,
    ) -> None:
        self.socket = folder / "control.sock"
        self.at = ("--socket", str(self.socket))
        self.http = self.connection()
        self._errors = folder / "errors"
        self.robot = robot or write_robot(folder, period_s, limits)
        self._simulator: OwnSimulator | None = None
        if paced:
            bus = f"simbus:paced-{os.getpid()}-{next(_names)}"
            self._simulator = OwnSimulator(str(self.robot), bus, paced=True)
        asked = ("run", str(self.robot), "--bus", bus, *self.at)
        command = [sys.executable, "-P", "-m", "cdpr_tools.cli", *asked]
        with self._errors.open("w") as errors:
            self.process = subprocess.Popen(
                [*command, *options],
                stdout=subprocess.PIPE,
                stderr=errors if stderr is None else stderr,
                text=True,
                env={**os.environ, **(env or {})},
                cwd=cwd,
            )
        self.bus = f"simbus:own-{self.process.pid}" if bus == "simbus:" else bus
        try:
            self.ready: dict[str, Any] = json.loads(self._first_line())["ready"]
            self.wait_for("ready")
        except BaseException as error:
            error.add_note(f"{self.status()} {self.errors()}")
            self.end()
            raise

    def connection(self) -> httpx.Client:
        """Return another connection to the control interface."""
        transport = httpx.HTTPTransport(uds=str(self.socket))
        return httpx.Client(transport=transport, base_url="http://localhost", timeout=PATIENCE_S)

    def _first_line(self) -> str:
        assert self.process.stdout is not None
        readable, _, _ = select.select([self.process.stdout], [], [], PATIENCE_S)
        line = self.process.stdout.readline() if readable else ""
        assert line, self.errors()
        return line

    def errors(self) -> str:
        """Return the standard error so far, or all of it after the end."""
        return self._errors.read_text()

    def status(self) -> dict[str, Any]:
        """Return the status from the control interface, {} if it does not answer."""
        try:
            status: dict[str, Any] = self.http.get("/status").json()
        except (httpx.HTTPError, ValueError):
            return {}
        return status

    def wait_for(self, state: str) -> dict[str, Any]:
        """Wait until the loop is in `state`. Return the status."""
        status: dict[str, Any] = {}

        def there() -> bool:
            nonlocal status
            status = self.status()
            return status.get("state") == state

        try:
            until(there)
        except AssertionError:
            raise AssertionError(f"not {state}: {status}; {self.errors()}") from None
        return status

    def children(self) -> dict[str, int]:
        """Return the living processes among loop, service and simulator."""
        pid = self.process.pid
        found = {}
        for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            command = Path(f"/proc/{child}/cmdline").read_bytes()
            for name in ("loop", "service"):
                if f"{name}_process".encode() in command:
                    found[name] = int(child)
            if b"\0sim\0up\0" in command:
                found["simulator"] = int(child)
        return found

    def end(self) -> int:
        """End the daemon as a user would. Return its exit status."""
        self.http.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            self.process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()
        if self._simulator is not None:
            self._simulator.stop()
        return self.process.returncode


@contextmanager
def held_right(daemon: RealDaemon, client: str) -> Iterator[httpx.Headers]:
    """Yield headers with the right to move and renew it. At the end, hold the axes and release it.

    The right expires by the wall clock, but the time of an unpaced robot waits for the loop. On a
    busy machine, a second of the robot may last longer than the right.
    """
    taken = daemon.http.post("/control", json={"client": client, "ttl_s": _RIGHT_S})
    assert taken.status_code == 200, taken.text
    headers = httpx.Headers({"X-Control-Token": taken.json()["token"]})
    over = threading.Event()

    def renew() -> None:
        with daemon.connection() as own:
            while not over.wait(0.2 * _RIGHT_S):
                own.put("/control", headers=headers)

    renewing = threading.Thread(target=renew)
    renewing.start()
    try:
        yield headers
    finally:
        over.set()
        renewing.join()
    assert daemon.http.post("/hold", json={"client": client}).status_code == 200
    assert daemon.http.delete("/control", headers=headers).status_code == 200


def cdpr(
    *arguments: str | Path, typed: str = "", timeout_s: float = PATIENCE_S
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, with `typed` as its standard input."""
    command = [sys.executable, "-m", "cdpr_tools.cli", *map(str, arguments)]
    return subprocess.run(
        command, input=typed, capture_output=True, text=True, timeout=timeout_s, check=False
    )
